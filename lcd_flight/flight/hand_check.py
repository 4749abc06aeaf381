"""The check by hand before a first flight: does a vehicle that is carried and tilted look so to everybody? Pure.

Flips at take-off come from axes that do not agree. The operator is asked for one motion after another; what motion
capture sees of it decides, the vehicle's own accelerometers and attitude must agree with it, and the control law must
want to undo it. Motors stay off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import Reference, State, Telemetry, TickInputs, Vector3
from lcd_flight.model.frames import (
    angle_between,
    body_x_axis,
    body_z_axis,
    conjugate,
    rotate,
    seen_from_heading,
    tilt_of,
    wrapped,
    yaw_of,
)
from lcd_flight.safety.preflight import Check

STILL_SPEED = 0.1
STILL_NS = 500_000_000
"""A motion begins from rest: so long below this speed, in m/s, and level."""
LEVEL_RAD = math.radians(10.0)
ATTITUDE_RAD = math.radians(10.0)
"""Between motion capture and the vehicle's own attitude, in the hand."""
FORCE_RAD = math.radians(15.0)
"""Between motion capture's vertical and that of the accelerometers."""


@dataclass(frozen=True, slots=True)
class Motion:
    """One direction, its opposite, and how much of it counts."""

    name: str
    opposite: str
    enough: float
    """m or rad."""


@dataclass(frozen=True, slots=True)
class Step:
    """One motion that is asked for."""

    motion: int
    """Index into `MOTIONS`; always its positive direction."""
    request: str


MOTIONS = (
    Motion("forward", "back", 0.3),
    Motion("left", "right", 0.3),
    Motion("up", "down", 0.3),
    Motion("right side down", "left side down", math.radians(20.0)),
    Motion("nose down", "nose up", math.radians(20.0)),
    Motion("turned left", "turned right", math.radians(30.0)),
)
STEPS = (
    Step(0, "carry it 0.3 m straight ahead, level"),
    Step(1, "carry it 0.3 m to its left, level"),
    Step(2, "lift it by 0.3 m, level"),
    Step(4, "hold it still and level, then tip its nose down by 20 deg"),
    Step(3, "hold it level again, then tip its right side down by 20 deg"),
    Step(5, "hold it level again, then turn it left by 30 deg"),
)


@dataclass(frozen=True, slots=True)
class HandCheck:
    """How far the check has come."""

    checks: tuple[Check, ...] = ()
    """Of the motions that were made."""
    rest: State | None = None
    """Where the next motion begins; None until the vehicle rests."""
    resting_since_ns: int | None = None

    @property
    def request(self) -> str:
        """What to do next; empty when nothing is left."""
        return STEPS[len(self.checks)].request if len(self.checks) < len(STEPS) else ""

    @property
    def failed(self) -> tuple[str, ...]:
        """What did not agree."""
        return tuple(check.text for check in self.checks if not check.ok)


def watched(check: HandCheck, inputs: TickInputs, setup: FlightSetup) -> HandCheck:
    """The check after one more tick."""
    state = inputs.pose.state
    if not check.request or state is None:
        return check
    if check.rest is None:
        return _rested(check, state, inputs.now_ns)
    amounts = moved(check.rest, state)
    shares = [amount / motion.enough for amount, motion in zip(amounts, MOTIONS, strict=True)]
    seen = max(range(len(MOTIONS)), key=lambda index: abs(shares[index]))
    if abs(shares[seen]) < 1.0:
        return check
    step = STEPS[len(check.checks)]
    verdict = _judged(step, seen, amounts[seen], check.rest, state, inputs, setup)
    return HandCheck(checks=(*check.checks, verdict))


def moved(rest: State, state: State) -> tuple[float, float, float, float, float, float]:
    """How far along each of `MOTIONS`: m as seen from the heading at rest, and rad."""
    way_W: Vector3 = (
        state.p_WB[0] - rest.p_WB[0],
        state.p_WB[1] - rest.p_WB[1],
        state.p_WB[2] - rest.p_WB[2],
    )
    forward, left = seen_from_heading(way_W, body_x_axis(rest.q_WB))
    right_side_down = math.asin(_clipped(rotate(state.q_WB, (0.0, 1.0, 0.0))[2]))
    nose_down = math.asin(_clipped(-body_x_axis(state.q_WB)[2]))
    turn = wrapped(yaw_of(state.q_WB) - yaw_of(rest.q_WB))
    return (forward, left, way_W[2], right_side_down, nose_down, turn)


def _rested(check: HandCheck, state: State, now_ns: int) -> HandCheck:
    """With the place of rest, once the vehicle has been still and level for long enough."""
    if math.hypot(*state.v_WB_W) > STILL_SPEED or tilt_of(state.q_WB) > LEVEL_RAD:
        return replace(check, resting_since_ns=None)
    since_ns = now_ns if check.resting_since_ns is None else check.resting_since_ns
    return replace(check, resting_since_ns=since_ns, rest=state if now_ns - since_ns >= STILL_NS else None)


def _judged(
    step: Step, seen: int, amount: float, rest: State, state: State, inputs: TickInputs, setup: FlightSetup
) -> Check:
    """What the motion says: whether it was the one that was asked for, and whether the others agree."""
    wanted, motion = MOTIONS[step.motion], MOTIONS[seen]
    direction = motion.name if amount > 0.0 else motion.opposite
    if seen != step.motion or amount < 0.0:
        text = (
            f"{wanted.name} was asked for and motion capture saw {direction}: make the rigid body's axes forward, "
            "left, up, and check motion_capture.frame"
        )
        return Check(wanted.name, False, text)
    doubt = _objection(inputs.link.telemetry, state) or _unwanted(seen, rest, state, setup)
    size = f"{amount:.2f} m" if seen < 3 else f"{math.degrees(amount):.0f} deg"
    return Check(wanted.name, not doubt, f"{wanted.name}: {doubt}" if doubt else f"{size} {wanted.name}")


def _objection(telemetry: Telemetry | None, state: State) -> str:
    """Why the vehicle's own senses contradict motion capture; empty where they do not."""
    if telemetry is None:
        return "the vehicle reports nothing"
    force_B = telemetry.specific_force_B
    if force_B is not None and math.hypot(*force_B) > 0.0:
        up_B = rotate(conjugate(state.q_WB), (0.0, 0.0, 1.0))
        cosine = sum(a * b for a, b in zip(force_B, up_B, strict=True)) / math.hypot(*force_B)
        angle = math.acos(_clipped(cosine))
        if angle > FORCE_RAD:
            return (
                f"its accelerometers and motion capture disagree on what is up by {math.degrees(angle):.0f} deg: turn "
                "the rigid body's axes to forward, left, up"
            )
    if telemetry.q_WB is not None:
        angle = angle_between(telemetry.q_WB, state.q_WB)
        if angle > ATTITUDE_RAD:
            return f"its own attitude is {math.degrees(angle):.0f} deg from motion capture's"
    return ""


def _unwanted(seen: int, rest: State, state: State, setup: FlightSetup) -> str:
    """Why the control law would not bring the vehicle back to where it rested; empty where it would."""
    if seen > 2:
        return ""
    zero = (0.0, 0.0, 0.0)
    hold = Reference(rest.p_WB, zero, zero, zero, zero, yaw_of(rest.q_WB), 0.0, 0.0)
    still = replace(state, v_WB_W=zero, w_WB_B=zero)
    setpoint, _ = setup.law(still, hold, setup.vehicle, zero, 0.01)
    forward, left = seen_from_heading(body_z_axis(setpoint.q_WB), body_x_axis(state.q_WB))
    pull = (forward, left, setpoint.thrust_N - setup.vehicle.weight_N)[seen]
    return "" if pull < 0.0 else "the control law would carry it further away"


def _clipped(sine: float) -> float:
    return max(-1.0, min(1.0, sine))
