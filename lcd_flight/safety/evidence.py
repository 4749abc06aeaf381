"""What the monitors look at in one tick, and what they remember from the ticks before."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

from lcd_flight.model import State, Telemetry, TickInputs

PERIOD_NS = 10_000_000
"""Of the control loop: 100 Hz."""
SATURATION_TICKS = 50
"""Window of the saturation share: 0.5 s."""
SKIPPED_TICKS = 100
"""Window of the share of skipped ticks: 1 s."""
IMPLAUSIBLE = 1e6
"""m, m/s or rad/s that no state has; the pose filter's own gate is far narrower."""


class Scope(IntEnum):
    """When a monitor is judged; each includes the ones after it."""

    ALWAYS = 0
    ARMED = 1
    """From arming on."""
    AIRBORNE = 2


@dataclass(frozen=True, slots=True)
class SafetyMemory:
    """What judging a tick needs from the ticks before."""

    since_ns: tuple[int | None, ...] = ()
    """For each monitor, since when its limit has been exceeded without a break."""
    saturated: int = 0
    """One bit a tick, the newest lowest."""
    skipped: int = 0
    """One bit a deadline: 1 where its tick was skipped."""
    rejected: int = 0
    """The pose source's counter at the tick before."""
    seen_ns: int | None = None
    """Arrival of the newest pose that could be used."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that the monitors may look at."""

    now_ns: int
    scope: Scope
    lateness_s: float
    """Of this tick against its deadline."""
    skipped_share: float
    """Of the deadlines of the last second."""
    pose_gap_s: float
    """`pose_gap_s` of this tick."""
    pose_rate_hz: float
    rejected: int
    """Frames since the tick before."""
    reject_reason: str
    link_age_s: float
    """Since the vehicle's newest packet; infinite before the first."""
    disconnected: bool
    taken_over: str
    """Who flies in our place; empty where nobody does."""
    loss_share: float
    telemetry: Telemetry | None
    state: State | None
    """Measured, or predicted over a gap."""
    position_error_m: float | None
    saturation_share: float
    """Of the ticks of the last 0.5 s, where the plan did not foresee it."""
    invalid_commands: int
    """Control steps in a row, up to the tick before, whose result was not finite."""


def pose_seen(inputs: TickInputs, memory: SafetyMemory) -> tuple[bool, SafetyMemory]:
    """Whether this tick's pose can be used, that is there and plausible; and the memory with it noted."""
    pose = inputs.pose
    if pose.state is None or pose.age_ns is None or not _is_plausible(pose.state):
        return False, memory
    return True, replace(memory, seen_ns=inputs.now_ns - pose.age_ns)


def pose_gap_s(inputs: TickInputs, memory: SafetyMemory) -> float:
    """Time since the newest pose that could be used, infinite before the first.

    What this loop itself has just slept through does not count: no pose could be used in that time. It is judged by
    `loop_slow`, and a pose that is really away is seen in the next tick.
    """
    if memory.seen_ns is None:
        return math.inf
    slept_ns = inputs.now_ns - inputs.deadline_ns + inputs.missed * PERIOD_NS
    return max(inputs.now_ns - memory.seen_ns - max(slept_ns, 0), 0) * 1e-9


def gather(
    inputs: TickInputs,
    memory: SafetyMemory,
    *,
    scope: Scope,
    state: State | None,
    position_error_m: float | None,
    saturated: bool,
    invalid_commands: int,
) -> tuple[Evidence, SafetyMemory]:
    """The evidence of one tick and the memory that goes with it.

    memory: from `pose_seen`. saturated: whether the setpoint before this tick was at a limit unforeseen by the plan.
    """
    slots = inputs.missed + 1
    saturation = _pushed(memory.saturated, saturated, slots, SATURATION_TICKS)
    skipped = _pushed(_pushed(memory.skipped, True, inputs.missed, SKIPPED_TICKS), False, 1, SKIPPED_TICKS)
    link = inputs.link
    evidence = Evidence(
        now_ns=inputs.now_ns,
        scope=scope,
        lateness_s=(inputs.now_ns - inputs.deadline_ns) * 1e-9,
        skipped_share=skipped.bit_count() / SKIPPED_TICKS,
        pose_gap_s=pose_gap_s(inputs, memory),
        pose_rate_hz=inputs.pose.rate_hz,
        rejected=max(inputs.pose.rejected - memory.rejected, 0),
        reject_reason=inputs.pose.reject_reason,
        link_age_s=math.inf if link.age_ns is None else link.age_ns * 1e-9,
        disconnected=not link.connected,
        taken_over=link.taken_over,
        loss_share=link.loss_share,
        telemetry=link.telemetry,
        state=state,
        position_error_m=position_error_m,
        saturation_share=saturation.bit_count() / SATURATION_TICKS,
        invalid_commands=invalid_commands,
    )
    return evidence, replace(memory, saturated=saturation, skipped=skipped, rejected=inputs.pose.rejected)


def _pushed(bits: int, value: bool, count: int, size: int) -> int:
    """A window of bits moved on by `count` slots that all hold `value`."""
    count = min(count, size)
    return ((bits << count) | ((1 << count) - 1) * value) & ((1 << size) - 1)


def _is_plausible(state: State) -> bool:
    """Whether numbers can be a vehicle's at all; written so that NaN cannot."""
    numbers = (*state.p_WB, *state.v_WB_W, *state.w_WB_B)
    return all(abs(number) < IMPLAUSIBLE for number in numbers) and abs(math.hypot(*state.q_WB) - 1.0) < 0.1
