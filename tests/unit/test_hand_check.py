"""The check by hand: motions in a hand, told by motion capture, accelerometers and attitude that agree, or do not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from flight_bench import healthy, setup, with_telemetry

from lcd_flight.flight.hand_check import STEPS, HandCheck, moved, watched
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, State, TickInputs, Vector3
from lcd_flight.model.frames import IDENTITY, conjugate, from_yaw, multiply, rotate

HEADING = from_yaw(0.7)
ZERO: Vector3 = (0.0, 0.0, 0.0)
Sees = Callable[[State], State]


def tilted(axis: int, degrees: float) -> Quaternion:
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(0.5 * math.radians(degrees))
    return (half[0], half[1], half[2], math.cos(0.5 * math.radians(degrees)))


def at(way_B: Vector3 = ZERO, turn: Quaternion = IDENTITY) -> State:
    """Carried from the start by so much, as seen from its heading, and turned by so much."""
    x, y, z = rotate(HEADING, way_B)
    return State((1.0 + x, 2.0 + y, 0.8 + z), ZERO, multiply(HEADING, turn), ZERO)


MOTIONS = [
    at((0.4, 0.02, 0.0)),
    at((0.03, 0.4, 0.0)),
    at((0.0, 0.0, 0.4)),
    at(turn=tilted(1, 25.0)),
    at(turn=tilted(0, 25.0)),
    at(turn=tilted(2, 40.0)),
]
"""As they are asked for."""


def inputs(true: State, tick: int, capture: Sees, onboard: Sees) -> TickInputs:
    """What a tick is given: accelerometers feel the truth, motion capture and the estimate have their own views."""
    up_B = rotate(conjugate(true.q_WB), (0.0, 0.0, GRAVITY_M_PER_S2))
    seen = healthy(tick, capture(true), tick * 10_000_000)
    return with_telemetry(seen, q_WB=onboard(true).q_WB, specific_force_B=up_B)


def carried(motions: list[State], capture: Sees = lambda s: s, onboard: Sees | None = None) -> HandCheck:
    """Rest, motion, rest, motion ..., for as long as the check asks for more."""
    check, tick = HandCheck(), 0
    for motion in motions:
        for true in [*[at()] * 80, motion]:
            check = watched(check, inputs(true, tick, capture, onboard or capture), setup())
            tick += 1
    return check


def test_a_vehicle_whose_axes_agree_passes() -> None:
    check = carried(MOTIONS)
    assert check.request == ""
    assert check.failed == ()
    assert [c.name for c in check.checks] == ["forward", "left", "up", "nose down", "right side down", "turned left"]
    assert check.checks[0].text == "0.40 m forward"
    assert check.checks[4].text == "25 deg right side down"


def test_it_asks_for_one_motion_after_another() -> None:
    assert HandCheck().request == STEPS[0].request
    assert carried(MOTIONS[:3]).request == STEPS[3].request


def test_small_motions_of_the_hand_decide_nothing() -> None:
    assert carried([at((0.2, 0.1, 0.05), tilted(1, 8.0))]).checks == ()


def test_a_motion_begins_from_rest() -> None:
    check = HandCheck()
    for tick in range(200):
        moving = replace(at((0.001 * tick, 0.0, 0.0)), v_WB_W=(0.3, 0.0, 0.0))
        check = watched(check, inputs(moving, tick, lambda s: s, lambda s: s), setup())
    assert check.rest is None
    assert check.checks == ()


@pytest.mark.parametrize(
    ("step", "capture", "saw"),
    [
        pytest.param(0, tilted(2, 90.0), "right", id="body turned by 90 deg"),
        pytest.param(0, tilted(2, 180.0), "back", id="body turned by 180 deg"),
        pytest.param(3, tilted(2, 90.0), "right side down", id="tilt about another axis"),
        pytest.param(3, tilted(2, 180.0), "nose up", id="tilt the other way"),
    ],
)
def test_a_rigid_body_with_wrong_axes_is_seen_by_the_first_motion(step: int, capture: Quaternion, saw: str) -> None:
    def sees(true: State) -> State:
        return replace(true, q_WB=multiply(true.q_WB, capture))

    check = HandCheck(checks=carried(MOTIONS[:step]).checks)
    tick = 10_000
    for true in [*[at()] * 80, MOTIONS[step]]:
        check = watched(check, inputs(true, tick, sees, sees), setup())
        tick += 1
    assert len(check.failed) == 1
    assert f"motion capture saw {saw}" in check.failed[0]


def test_a_mirrored_world_is_seen_by_the_motion_to_the_left() -> None:
    def sees(true: State) -> State:
        x, y, z = true.p_WB
        ahead_x, ahead_y, _ = rotate(HEADING, (0.0, 1.0, 0.0))
        along = (x - 1.0) * ahead_x + (y - 2.0) * ahead_y
        return replace(true, p_WB=(x - 2.0 * along * ahead_x, y - 2.0 * along * ahead_y, z))

    check = carried(MOTIONS[:2], sees)
    assert check.checks[0].ok
    assert "motion capture saw right" in check.failed[0]


def test_accelerometers_that_feel_another_vertical_object() -> None:
    """The estimate follows motion capture, so that the two agree with one another and are both wrong."""

    def sees(true: State) -> State:
        return replace(true, q_WB=multiply(true.q_WB, tilted(2, 45.0)))

    capture = [at(turn=multiply(multiply(tilted(2, 45.0), tilted(1, 30.0)), tilted(2, -45.0)))]
    check = HandCheck(checks=carried(MOTIONS[:3]).checks)
    for tick, true in enumerate([*[at()] * 80, capture[0]]):
        check = watched(check, inputs(true, tick, sees, sees), setup())
    assert "accelerometers and motion capture disagree" in check.failed[0]


def test_an_estimate_that_does_not_follow_objects() -> None:
    check = carried(MOTIONS[:1], onboard=lambda true: replace(true, q_WB=multiply(true.q_WB, tilted(2, 20.0))))
    assert "its own attitude is 20 deg from motion capture's" in check.failed[0]


def test_a_control_law_that_pushes_away_objects() -> None:
    def away(
        state: State, reference: object, vehicle: object, integral: Vector3, dt_s: float
    ) -> tuple[object, Vector3]:
        setpoint, held = setup().law(state, reference, vehicle, integral, dt_s)  # type: ignore[arg-type]
        x, y, z, w = setpoint.q_WB
        return replace(setpoint, q_WB=(-x, -y, z, w)), held

    check, flown = HandCheck(), replace(setup(), law=away)  # type: ignore[arg-type]
    for tick, true in enumerate([*[at()] * 80, MOTIONS[0]]):
        check = watched(check, inputs(true, tick, lambda s: s, lambda s: s), flown)
    assert "would carry it further away" in check.failed[0]


def test_motions_are_measured_from_the_heading_at_rest() -> None:
    assert moved(at(), at((0.3, -0.2, 0.1), tilted(2, 10.0))) == pytest.approx(
        (0.3, -0.2, 0.1, 0.0, 0.0, math.radians(10.0)), abs=1e-9
    )
