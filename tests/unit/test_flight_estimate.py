from __future__ import annotations

import math
from dataclasses import replace

import pytest
from flight_bench import START_NS, TICK_NS, fly, healthy, setup, without_pose

from lcd_flight.flight.estimate import HOVER_SHARES, estimate, hover_thrust_N, predicted
from lcd_flight.flight.memory import Memory
from lcd_flight.model import AttitudeThrust, Phase, Reference, State
from lcd_flight.model.frames import IDENTITY, multiply

VEHICLE = setup().vehicle
HOVER = AttitudeThrust(VEHICLE.weight_N, IDENTITY)
FLYING = State((0.0, 0.0, 1.0), (1.0, 0.0, -0.5), IDENTITY, (0.0, 0.0, 3.0))
AT_REST = Reference(
    p_W=(0.0, 0.0, 1.0),
    v_W=(0.0, 0.0, 0.0),
    a_W=(0.0, 0.0, 0.0),
    j_W=(0.0, 0.0, 0.0),
    s_W=(0.0, 0.0, 0.0),
    yaw_rad=0.0,
    yaw_rate=0.0,
    yaw_acceleration=0.0,
)
HOLDING = Memory(phase=Phase.HOLD)


def test_a_hovering_vehicle_is_predicted_to_fly_straight_on() -> None:
    state = predicted(FLYING, HOVER, VEHICLE, 0.01)
    assert state.p_WB == pytest.approx((0.01, 0.0, 0.995))
    assert state.v_WB_W == pytest.approx(FLYING.v_WB_W)
    assert state.q_WB == HOVER.q_WB


def test_a_tilted_one_is_predicted_to_accelerate_that_way() -> None:
    tilt_rad = 0.2
    tilted = (0.0, math.sin(tilt_rad / 2), 0.0, math.cos(tilt_rad / 2))
    thrust_N = VEHICLE.weight_N / math.cos(tilt_rad)
    state = predicted(FLYING, AttitudeThrust(thrust_N, multiply(tilted, IDENTITY)), VEHICLE, 0.01)
    assert state.v_WB_W == pytest.approx((1.0 + 0.01 * 9.81 * math.tan(tilt_rad), 0.0, -0.5))
    assert state.p_WB[0] == pytest.approx(0.01 + 0.5e-4 * 9.81 * math.tan(tilt_rad))


def test_a_good_pose_is_taken_as_it_is() -> None:
    state, safety = estimate(healthy(0, FLYING, START_NS), setup(), Memory(), 0.01)
    assert state is FLYING
    assert safety.seen_ns == START_NS - 3_000_000


def test_a_gap_is_predicted_from_the_state_before_until_the_timeout() -> None:
    _, safety = estimate(healthy(0, FLYING, START_NS), setup(), Memory(), 0.01)
    memory = Memory(phase=Phase.TRACK, state=FLYING, setpoint=HOVER, safety=safety)
    for ticks in (1, 29):
        inputs = without_pose(healthy(1, FLYING, START_NS + ticks * TICK_NS), ticks * TICK_NS)
        assert estimate(inputs, setup(), memory, 0.01)[0] == predicted(FLYING, HOVER, VEHICLE, 0.01)
    inputs = without_pose(healthy(1, FLYING, START_NS + 30 * TICK_NS), 30 * TICK_NS)
    assert estimate(inputs, setup(), memory, 0.01)[0] is None


def test_on_the_ground_a_gap_changes_nothing() -> None:
    _, safety = estimate(healthy(0, FLYING, START_NS), setup(), Memory(), 0.01)
    memory = Memory(phase=Phase.ARMED, state=FLYING, setpoint=HOVER, safety=safety)
    inputs = without_pose(healthy(1, FLYING, START_NS + 5 * TICK_NS), 5 * TICK_NS)
    assert estimate(inputs, setup(), memory, 0.01)[0] is FLYING


@pytest.mark.parametrize("share", [0.9, 1.0, 1.1])
def test_the_hover_thrust_is_learned_within_a_few_seconds(share: float) -> None:
    memory, setpoint = HOLDING, AttitudeThrust(share * VEHICLE.weight_N, IDENTITY)
    for _ in range(400):
        memory = replace(memory, hover_N=hover_thrust_N(memory, setpoint, FLYING, AT_REST, VEHICLE, 0.01))
    assert memory.hover_N == pytest.approx(share * VEHICLE.weight_N, rel=0.005)


@pytest.mark.parametrize(("share", "believed"), [(0.3, HOVER_SHARES[0]), (1.8, HOVER_SHARES[1])])
def test_it_is_not_believed_to_be_far_from_the_weight(share: float, believed: float) -> None:
    memory, setpoint = HOLDING, AttitudeThrust(share * VEHICLE.weight_N, IDENTITY)
    for _ in range(400):
        memory = replace(memory, hover_N=hover_thrust_N(memory, setpoint, FLYING, AT_REST, VEHICLE, 0.01))
    assert memory.hover_N == pytest.approx(believed * VEHICLE.weight_N)


def test_it_is_learned_in_hovers_of_the_plan_only() -> None:
    heavy = AttitudeThrust(1.1 * VEHICLE.weight_N, IDENTITY)
    moving, turning = replace(AT_REST, v_W=(0.4, 0.0, 0.0)), replace(AT_REST, a_W=(0.0, 0.0, 0.4))
    for memory, reference in (
        (HOLDING, moving),
        (HOLDING, turning),
        (HOLDING, None),
        (Memory(phase=Phase.TAKEOFF), AT_REST),
        (Memory(phase=Phase.LAND), AT_REST),
    ):
        assert hover_thrust_N(memory, heavy, FLYING, reference, VEHICLE, 0.01) is None


def test_a_flight_learns_it_before_it_needs_it() -> None:
    flight = fly(mass_share=1.08, ticks=400)
    held = [t.setpoint.thrust_N for _, t in flight if t.phase is Phase.HOLD and t.setpoint]
    assert held[-1] == pytest.approx(1.08 * VEHICLE.weight_N, rel=0.01)
