from __future__ import annotations

import math
from dataclasses import replace

import pytest
from flight_bench import START_NS, TICK_NS, healthy, with_link, without_pose

from lcd_flight.model import State, TickInputs
from lcd_flight.model.frames import IDENTITY
from lcd_flight.safety.evidence import Evidence, SafetyMemory, Scope, gather, pose_gap_s, pose_seen

STATE = State((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), IDENTITY, (0.0, 0.0, 0.0))
GOOD = healthy(0, STATE, START_NS)


def gathered(inputs: TickInputs, memory: SafetyMemory, saturated: bool = False) -> tuple[Evidence, SafetyMemory]:
    return gather(
        inputs,
        memory,
        scope=Scope.AIRBORNE,
        state=STATE,
        position_error_m=0.0,
        saturated=saturated,
        invalid_commands=0,
    )


def at(inputs: TickInputs, now_ns: int) -> TickInputs:
    """The same, on time at another time."""
    return replace(inputs, now_ns=now_ns, deadline_ns=now_ns)


def test_the_gap_counts_from_the_arrival_of_the_newest_usable_pose() -> None:
    usable, memory = pose_seen(GOOD, SafetyMemory())
    assert usable
    later = at(without_pose(GOOD, 40_000_000), GOOD.now_ns + 40_000_000)
    usable, memory = pose_seen(later, memory)
    assert not usable
    assert gathered(later, memory)[0].pose_gap_s == pytest.approx(0.043)


def test_what_the_loop_slept_through_is_no_gap_but_what_comes_after_is() -> None:
    _, memory = pose_seen(GOOD, SafetyMemory())
    woken = GOOD.now_ns + 70_000_000
    late = replace(without_pose(GOOD, 70_000_000), now_ns=woken, deadline_ns=woken - 4_000_000, missed=5)
    assert pose_gap_s(late, memory) == pytest.approx(0.019)
    after = at(without_pose(GOOD, 76_000_000), woken + 6_000_000)
    assert pose_gap_s(after, memory) == pytest.approx(0.079)


def test_before_the_first_pose_the_gap_is_infinite() -> None:
    inputs = replace(GOOD, pose=replace(GOOD.pose, state=None, age_ns=None))
    assert gathered(inputs, pose_seen(inputs, SafetyMemory())[1])[0].pose_gap_s == math.inf


@pytest.mark.parametrize("broken", [math.nan, math.inf, -1e7])
@pytest.mark.parametrize("field", ["p_WB", "v_WB_W", "w_WB_B", "q_WB"])
def test_a_pose_that_no_vehicle_has_is_not_used(field: str, broken: float) -> None:
    vector = getattr(STATE, field)
    state = replace(STATE, **{field: (broken, *vector[1:])})
    assert not pose_seen(replace(GOOD, pose=replace(GOOD.pose, state=state)), SafetyMemory())[0]


def test_rejects_are_counted_since_the_tick_before() -> None:
    counted = replace(GOOD, pose=replace(GOOD.pose, rejected=7))
    evidence, memory = gathered(counted, SafetyMemory(rejected=5))
    assert evidence.rejected == 2
    assert gathered(counted, memory)[0].rejected == 0


def test_saturation_is_the_share_of_the_last_half_second() -> None:
    memory = SafetyMemory()
    for tick in range(80):
        evidence, memory = gathered(GOOD, memory, saturated=tick >= 50)
    assert evidence.saturation_share == pytest.approx(0.6)
    for _ in range(50):
        evidence, memory = gathered(GOOD, memory)
    assert evidence.saturation_share == 0.0


def test_skipped_ticks_prolong_what_went_before_them() -> None:
    late = replace(GOOD, missed=9)
    assert gathered(late, SafetyMemory(), saturated=True)[0].saturation_share == pytest.approx(0.2)


def test_skipped_ticks_are_a_share_of_the_last_second() -> None:
    memory = SafetyMemory()
    evidence, memory = gathered(replace(GOOD, missed=10), memory)
    assert evidence.skipped_share == pytest.approx(0.10)
    for _ in range(89):
        evidence, memory = gathered(GOOD, memory)
    assert evidence.skipped_share == pytest.approx(0.10)
    for _ in range(11):
        evidence, memory = gathered(GOOD, memory)
    assert evidence.skipped_share == 0.0


def test_a_pause_longer_than_the_window_fills_it() -> None:
    evidence, _ = gathered(replace(GOOD, missed=10_000), SafetyMemory())
    assert evidence.skipped_share == pytest.approx(0.99)


def test_lateness_and_the_link() -> None:
    inputs = with_link(replace(GOOD, now_ns=GOOD.deadline_ns + TICK_NS), connected=False, age_ns=None)
    evidence, _ = gathered(inputs, SafetyMemory())
    assert evidence.lateness_s == pytest.approx(0.01)
    assert evidence.disconnected
    assert evidence.link_age_s == math.inf
