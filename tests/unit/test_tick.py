"""One fault at a time into a flight of the bench: what it leads to, and when."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from flight_bench import (
    LIMITS,
    ORDERS,
    START_NS,
    TICK_NS,
    WAYPOINTS,
    Fault,
    Flight,
    codes,
    first,
    fly,
    healthy,
    height_m,
    phases,
    plan,
    setup,
    straight,
    with_link,
    with_telemetry,
    without_pose,
)

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import MAX_STEP_S, tick
from lcd_flight.model import (
    AttitudeThrust,
    Command,
    Finding,
    FlightPlan,
    Geofence,
    Leg,
    LegKind,
    MotorRequest,
    Phase,
    Reference,
    SafetyLimits,
    State,
    TickInputs,
    Trajectory,
    Vector3,
    Vehicle,
)
from lcd_flight.model.frames import IDENTITY, tilt_of
from lcd_flight.planning.minimum_snap import minimum_snap

UP = [Phase.PREFLIGHT, Phase.READY, Phase.ARMED, Phase.TAKEOFF, Phase.HOLD, Phase.TRACK]
TRACKING = 420
"""Ticks since take-off at which the bench's flight is between its waypoints."""


def from_tick(start: int, change: Callable[[TickInputs], TickInputs], ticks: int = 100_000) -> Fault:
    """A change from one tick on, for a while."""
    return lambda tick, inputs: change(inputs) if start <= tick < start + ticks else inputs


def gap(start: int, ticks: int) -> Fault:
    """No pose from one tick on, for a while."""
    return lambda tick, inputs: (
        without_pose(inputs, (tick - start + 1) * TICK_NS) if start <= tick < start + ticks else inputs
    )


def with_limits(limits: SafetyLimits) -> FlightSetup:
    return FlightSetup.of(plan(), setup().vehicle, limits)


def finding(flight: Flight, code: str) -> tuple[int, Finding]:
    """Ticks since take-off at which a finding begins, and it."""
    return next((i - 3, f) for i, (_, t) in enumerate(flight) for f in t.findings if f.code == code)


class TestCleanFlight:
    def test_phases(self) -> None:
        assert phases(fly()) == [*UP, Phase.LAND, Phase.LANDED]

    def test_finds_nothing(self) -> None:
        assert codes(fly()) == set()

    def test_legs_come_in_order_and_on_time(self) -> None:
        flight = fly()
        begins = {leg: i for i, (_, t) in reversed(list(enumerate(flight))) if (leg := t.leg) >= 0}
        assert list(reversed(begins)) == [0, 1, 2, 3, 4, 5]
        times = [begins[leg] - begins[0] for leg in range(6)]
        assert times == pytest.approx([0, 200, 250, 350, 650, 700], abs=1)

    def test_follows_the_plan(self) -> None:
        errors = [math.hypot(*t.position_error_W) for _, t in fly() if t.position_error_W and t.phase is Phase.TRACK]
        assert max(errors) < 0.05

    def test_motors_are_asked_for_once_each(self) -> None:
        asked = [(t.phase, t.motors) for _, t in fly() if t.motors is not MotorRequest.NONE]
        assert asked == [(Phase.ARMED, MotorRequest.ARM), (Phase.LANDED, MotorRequest.DISARM)]

    def test_sends_nothing_before_arming_and_after_landing(self) -> None:
        flight = fly()
        sent = [t.phase for _, t in flight if t.setpoint is not None]
        assert set(sent) == {Phase.ARMED, Phase.TAKEOFF, Phase.HOLD, Phase.TRACK, Phase.LAND}
        assert next(t.setpoint for _, t in flight if t.phase is Phase.ARMED) == AttitudeThrust(
            0.0, (0.0, 0.0, 0.0, 1.0)
        )

    def test_lands_on_the_ground(self) -> None:
        assert height_m(fly()[-1][0]) == 0.0

    def test_equal_inputs_give_equal_ticks(self) -> None:
        assert [t for _, t in fly()] == [t for _, t in fly()]


class TestPose:
    def test_a_gap_of_40_ms_is_coasted(self) -> None:
        flight = fly(fault=gap(TRACKING, 4))
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]
        assert codes(flight) == {"pose_late"}

    def test_loss_brakes_after_50_ms_and_descends_after_300(self) -> None:
        flight = fly(fault=gap(TRACKING, 100_000))
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.DESCEND_BLIND, Phase.KILL]
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING + 4  # the last good one was 3 ms old
        assert first(flight, Phase.DESCEND_BLIND) == TRACKING + 29

    def test_while_the_pose_is_away_the_state_is_predicted(self) -> None:
        clean, blind = fly(), fly(fault=gap(TRACKING, 4))
        moved = math.dist(position(clean, TRACKING), position(clean, TRACKING + 4))
        assert moved > 0.02  # so that holding the last state would not pass for prediction
        for tick_ in range(TRACKING, TRACKING + 4):
            error, known = blind[tick_ + 3][1].position_error_W, clean[tick_ + 3][1].position_error_W
            assert error == pytest.approx(known, abs=1e-3)

    def test_braking_stops_and_holds(self) -> None:
        flight = fly(fault=gap(TRACKING, 10))
        begin = first(flight, Phase.BRAKE_HOLD)
        held = [position(flight, begin + after) for after in (200, 490)]
        assert math.dist(*held) < 0.01
        assert 0.05 < math.dist(held[0], position(flight, TRACKING - 1)) < 0.5

    def test_a_hold_of_five_seconds_lands(self) -> None:
        flight = fly(fault=gap(TRACKING, 10))
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.LAND_NOW) - first(flight, Phase.BRAKE_HOLD) == 501
        assert height_m(flight[-1][0]) == 0.0

    def test_the_blind_descent_is_level_below_hover_and_timed(self) -> None:
        flight = fly(fault=gap(TRACKING, 100_000))
        blind = [t for _, t in flight if t.phase is Phase.DESCEND_BLIND]
        weight_N = setup().vehicle.weight_N
        assert all(t.setpoint and tilt_of(t.setpoint.q_WB) < 1e-9 for t in blind)
        assert all(t.setpoint and 0.9 * weight_N < t.setpoint.thrust_N < weight_N for t in blind)
        assert 150 < len(blind) < 450
        assert [t.motors for _, t in flight if t.phase is Phase.KILL] == [MotorRequest.STOP] * 6

    def test_the_blind_descent_ends_at_once_where_a_pose_sees_it_stand(self) -> None:
        flight = fly(fault=gap(TRACKING, 130))
        assert phases(flight)[-2:] == [Phase.DESCEND_BLIND, Phase.LANDED]

    def test_cut_stops_the_motors(self) -> None:
        flight = fly(with_limits(replace(LIMITS, on_mocap_lost="cut")), gap(TRACKING, 100_000))
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.KILL]

    @pytest.mark.parametrize("broken", [math.nan, math.inf])
    def test_a_state_that_is_not_finite_is_no_state(self, broken: float) -> None:
        def spoil(inputs: TickInputs) -> TickInputs:
            assert inputs.pose.state is not None
            return replace(inputs, pose=replace(inputs.pose, state=replace(inputs.pose.state, p_WB=(broken, 0.0, 1.0))))

        flight = fly(fault=from_tick(TRACKING, spoil, 3))
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]
        assert all(t.setpoint is None or t.setpoint.is_finite() for _, t in flight)

    def test_rejected_frames_warn_and_no_more(self) -> None:
        def reject(inputs: TickInputs) -> TickInputs:
            return replace(inputs, pose=replace(inputs.pose, rejected=4, reject_reason="jump of 0.40 m"))

        flight = fly(fault=from_tick(TRACKING, reject))
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]
        at, found = finding(flight, "pose_rejected")
        assert (at, found.message) == (TRACKING, "4 pose frames rejected: jump of 0.40 m")
        assert sum(f.code == "pose_rejected" for _, t in flight for f in t.findings) == 1

    def test_a_low_rate_brakes_after_a_second(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: replace(i, pose=replace(i.pose, rate_hz=80.0))), ticks=600)
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING + 100


def replace_leg(leg: Leg, trajectory: Trajectory) -> Leg:
    return replace(leg, trajectory=trajectory) if leg.kind is LegKind.TRAJECTORY else leg


def fallen(start: int) -> Callable[[TickInputs], TickInputs]:
    """Free fall from 0.8 m, from that tick on."""

    def fall(inputs: TickInputs) -> TickInputs:
        since_s = (inputs.now_ns - START_NS) * 1e-9 - (start + 3) * 0.01
        speed = 9.81 * since_s if since_s < 0.41 else 0.0
        z_m = max(0.8 - 0.5 * 9.81 * since_s**2, 0.0)
        state = State((0.4, 0.4, z_m), (0.0, 0.0, -speed), IDENTITY, (0.0, 0.0, 0.0))
        return replace(inputs, pose=replace(inputs.pose, state=state))

    return fall


def position(flight: Flight, tick_: int) -> Vector3:
    state = flight[tick_ + 3][0].pose.state
    assert state is not None
    return state.p_WB


class TestBattery:
    @pytest.mark.parametrize(("voltage_V", "code"), [(3.1, "battery_low"), (2.9, "battery_critical")])
    def test_a_dip_of_under_two_seconds_is_nothing(self, voltage_V: float, code: str) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_telemetry(i, battery_V=voltage_V), 199))
        assert codes(flight) == set()
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]

    def test_low_warns(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_telemetry(i, battery_V=3.1)))
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]
        assert finding(flight, "battery_low")[0] == TRACKING + 200

    def test_critical_lands_after_two_seconds(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_telemetry(i, battery_V=2.9)))
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.LAND_NOW) == TRACKING + 200

    def test_critical_may_only_warn(self) -> None:
        limits = replace(LIMITS, on_battery_critical="warn")
        flight = fly(with_limits(limits), from_tick(TRACKING, lambda i: with_telemetry(i, battery_V=2.9)))
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]


class TestTracking:
    def shifted(self, distance_m: float) -> Fault:
        def shift(inputs: TickInputs) -> TickInputs:
            state = inputs.pose.state
            assert state is not None
            x, y, z = state.p_WB
            return replace(inputs, pose=replace(inputs.pose, state=replace(state, p_WB=(x - distance_m, y, z))))

        return from_tick(TRACKING, shift, 1)

    def test_over_half_the_limit_brakes_in_the_same_tick(self) -> None:
        flight = fly(fault=self.shifted(0.8))
        assert phases(flight)[:8] == [*UP, Phase.BRAKE_HOLD, Phase.LAND_NOW]
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING

    def test_over_the_limit_lands_in_the_same_tick(self) -> None:
        flight = fly(fault=self.shifted(1.6))
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.LAND_NOW) == TRACKING

    def test_saturation_over_half_of_half_a_second_brakes(self) -> None:
        full = from_tick(TRACKING, lambda i: with_telemetry(i, motor_shares=(0.4, 1.0, 0.4, 0.4)))
        flight = fly(fault=full)
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING + 26
        assert flight[TRACKING + 3][1].saturated

    def test_saturation_that_the_plan_itself_asks_for_is_left_to_the_position_error(self) -> None:
        fast = [replace_leg(leg, minimum_snap(WAYPOINTS, np.array([0.6, 0.6]))) for leg in plan().legs]
        flown = FlightSetup.of(FlightPlan(tuple(fast)), setup().vehicle, LIMITS)
        assert flown.foreseen_saturation == (False, False, False, True, False, False)
        full = from_tick(TRACKING - 70, lambda i: with_telemetry(i, motor_shares=(0.4, 1.0, 0.4, 0.4)), 60)
        assert "saturation" not in codes(fly(flown, full, ticks=480))

    def test_saturation_for_a_moment_does_not(self) -> None:
        full = from_tick(TRACKING, lambda i: with_telemetry(i, motor_shares=(0.4, 1.0, 0.4, 0.4)), 25)
        assert phases(fly(fault=full)) == [*UP, Phase.LAND, Phase.LANDED]


class TestFence:
    def moving(self, x_m: float, vx: float) -> Fault:
        def move(inputs: TickInputs) -> TickInputs:
            state = inputs.pose.state
            assert state is not None
            pose = replace(inputs.pose, state=replace(state, p_WB=(x_m, *state.p_WB[1:]), v_WB_W=(vx, 0.0, 0.0)))
            return replace(inputs, pose=pose)

        return from_tick(TRACKING, move, 1)

    def fenced(self, x_m: float) -> FlightSetup:
        limits = replace(LIMITS, geofence=Geofence((-2.0, -2.0, 0.0), (x_m, 3.0, 3.0)))
        return with_limits(replace(limits, max_position_error_m=50.0, brake_position_error_m=50.0))

    def test_brakes_before_it_is_reached(self) -> None:
        assert first(fly(self.fenced(1.5), self.moving(1.3, 1.5)), Phase.BRAKE_HOLD) == TRACKING

    def test_a_vehicle_that_would_stop_before_it_flies_on(self) -> None:
        assert phases(fly(self.fenced(1.5), self.moving(1.3, 1.2))) == [*UP, Phase.LAND, Phase.LANDED]

    def test_outside_lands(self) -> None:
        assert phases(fly(self.fenced(1.5), self.moving(1.6, 0.0))) == [*UP, Phase.LAND_NOW, Phase.LANDED]

    def test_a_metre_outside_stops_the_motors(self) -> None:
        flight = fly(self.fenced(1.5), self.moving(2.51, 0.0))
        assert phases(flight) == [*UP, Phase.KILL]
        assert first(flight, Phase.KILL) == TRACKING

    def test_a_real_stop_ends_inside(self) -> None:
        inside = self.fenced(0.72)
        flight = fly(inside)
        assert Phase.BRAKE_HOLD in phases(flight)
        assert max(i.pose.state.p_WB[0] for i, _ in flight if i.pose.state) < 0.72 + 0.02


class TestController:
    def broken(self, steps: range, how: str) -> FlightSetup:
        """A law that fails in some of its steps."""
        count = iter(range(100_000))

        def law(
            state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
        ) -> tuple[AttitudeThrust, Vector3]:
            setpoint, integral = setup().law(state, reference, vehicle, integral, dt_s)
            if next(count) not in steps:
                return setpoint, integral
            if how == "raises":
                raise ZeroDivisionError
            if how == "integral":
                return setpoint, (math.inf, 0.0, 0.0)
            return replace(setpoint, thrust_N=math.nan), integral

        return FlightSetup.of(plan(), setup().vehicle, LIMITS, law)

    @pytest.mark.parametrize("how", ["nan", "raises", "integral"])
    def test_two_steps_are_bridged_by_the_last_good_setpoint(self, how: str) -> None:
        flight = fly(self.broken(range(TRACKING, TRACKING + 2), how))
        sent = [t.setpoint for _, t in flight[TRACKING + 2 : TRACKING + 5]]
        assert sent == [sent[0]] * 3
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]
        assert codes(flight) == {"controller_invalid"}

    def test_after_the_third_it_brakes(self) -> None:
        flight = fly(self.broken(range(TRACKING, TRACKING + 3), "nan"), ticks=TRACKING + 50)
        sent = [t.setpoint for _, t in flight[TRACKING + 2 : TRACKING + 6]]
        assert sent == [sent[0]] * 4
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING + 3
        assert Phase.DESCEND_BLIND not in phases(flight)

    def test_the_fourth_is_no_longer_bridged(self) -> None:
        flight = fly(self.broken(range(TRACKING, TRACKING + 4), "nan"), ticks=TRACKING + 50)
        fourth = flight[TRACKING + 3 + 3][1].setpoint
        assert fourth is not None
        assert tilt_of(fourth.q_WB) < 1e-9

    def test_a_law_that_stays_away_ends_in_a_level_descent(self) -> None:
        flight = fly(self.broken(range(TRACKING, 100_000), "nan"))
        assert phases(flight)[-3:-1] == [Phase.BRAKE_HOLD, Phase.DESCEND_BLIND]
        assert first(flight, Phase.DESCEND_BLIND) == TRACKING + 6
        assert all(t.setpoint is None or t.setpoint.is_finite() for _, t in flight)


class TestLink:
    def test_silence_brakes_after_100_ms_and_lands_after_a_second(self) -> None:
        def silent(tick_: int, inputs: TickInputs) -> TickInputs:
            return with_link(inputs, age_ns=(tick_ - TRACKING + 1) * TICK_NS) if tick_ >= TRACKING else inputs

        flight = fly(fault=silent)
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.BRAKE_HOLD) == TRACKING + 10
        assert first(flight, Phase.LAND_NOW) == TRACKING + 100

    def test_a_closed_connection_lands(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_link(i, connected=False)))
        assert first(flight, Phase.LAND_NOW) == TRACKING

    @pytest.mark.parametrize(
        ("loss", "then"), [(0.1, Phase.LAND), (0.12, Phase.LAND), (0.2, Phase.BRAKE_HOLD), (0.3, Phase.BRAKE_HOLD)]
    )
    def test_loss(self, loss: float, then: Phase) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_link(i, loss_share=loss)))
        assert phases(flight)[6] is (Phase.LAND_NOW if loss == 0.3 else then)

    def test_a_crash_that_the_vehicle_reports_is_adopted_for_good(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: with_telemetry(i, crashed=True), 1))
        assert phases(flight) == [*UP, Phase.CRASHED]
        assert next(t.motors for _, t in flight if t.phase is Phase.CRASHED) is MotorRequest.STOP
        assert all(t.setpoint is None for _, t in flight if t.phase is Phase.CRASHED)


class TestLoopTiming:
    def test_a_late_tick_warns(self) -> None:
        flight = fly(fault=from_tick(TRACKING, lambda i: replace(i, deadline_ns=i.now_ns - 25_000_000), 1))
        assert codes(flight) == {"loop_late"}
        assert phases(flight) == [*UP, Phase.LAND, Phase.LANDED]

    def test_a_tenth_of_the_ticks_missed_lands(self) -> None:
        flight = fly(fault=lambda k, i: replace(i, missed=1) if k >= TRACKING and k % 5 == 0 else i)
        assert Phase.LAND_NOW in phases(flight)
        assert TRACKING + 40 < first(flight, Phase.LAND_NOW) < TRACKING + 100

    def test_a_pause_moves_the_plan_on_by_one_step_only(self) -> None:
        memory, state = Memory(), State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
        times = [0, 1, 2, 3, 4, 5, 105]
        for sequence, slot in enumerate(times):
            inputs = healthy(sequence, state, START_NS + slot * TICK_NS, ORDERS.get(sequence, ()))
            decided, memory = tick(inputs, setup(), memory)
        assert decided.dt_s == MAX_STEP_S
        assert decided.leg_time_s == pytest.approx(0.02 + MAX_STEP_S)

    def test_time_that_stands_still_or_runs_back_is_no_step(self) -> None:
        memory, state = Memory(), State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
        for now_ns in (START_NS, START_NS, START_NS - 5):
            decided, memory = tick(healthy(0, state, now_ns), setup(), memory)
        assert decided.dt_s == 0.0


class TestOperator:
    def test_land(self) -> None:
        flight = fly(orders={TRACKING: (Command.LAND,)})
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.LAND_NOW) == TRACKING
        assert finding(flight, "operator_land")[1].message == "the operator asked to land"

    def test_land_again_descends_and_again_stops(self) -> None:
        orders = {TRACKING: (Command.LAND,), TRACKING + 20: (Command.DESCEND,), TRACKING + 40: (Command.STOP_MOTORS,)}
        flight = fly(orders=orders)
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.KILL]
        assert first(flight, Phase.KILL) == TRACKING + 40

    def test_the_gravest_of_several_wins(self) -> None:
        flight = fly(orders={TRACKING: (Command.STOP_MOTORS, Command.LAND)})
        assert phases(flight) == [*UP, Phase.KILL]

    def test_nothing_is_sent_after_a_stop(self) -> None:
        flight = fly(orders={TRACKING: (Command.STOP_MOTORS,), TRACKING + 2: (Command.TAKEOFF, Command.RESUME)})
        assert all(t.setpoint is None and t.motors is MotorRequest.STOP for _, t in flight[TRACKING + 3 :])

    def test_resume_flies_the_interrupted_leg_again(self) -> None:
        held = gap(TRACKING, 10)
        flight = fly(fault=held, orders={TRACKING + 200: (Command.RESUME,)})
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.HOLD, Phase.TRACK, Phase.LAND, Phase.LANDED]
        resumed = flight[TRACKING + 203 :]
        again = next(t for _, t in resumed if t.leg == 3)
        assert again.leg_time_s < 0.02
        assert again.position_error_W is not None
        assert math.hypot(*again.position_error_W) < 0.1
        errors = [math.hypot(*t.position_error_W) for _, t in resumed if t.position_error_W and t.leg == 3]
        assert max(errors) < 0.1

    def test_a_take_off_that_was_held_is_resumed_at_its_end(self) -> None:
        flight = fly(fault=gap(100, 10), orders={250: (Command.RESUME,)})
        assert phases(flight)[3:8] == [Phase.TAKEOFF, Phase.BRAKE_HOLD, Phase.HOLD, Phase.TRACK, Phase.LAND]

    def test_resume_while_the_fault_lasts_holds_on(self) -> None:
        low = from_tick(TRACKING, lambda i: replace(i, pose=replace(i.pose, rate_hz=80.0)))
        flight = fly(fault=low, orders={TRACKING + 150: (Command.RESUME,)})
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.LANDED]


class TestGround:
    def stand(self, commands: dict[int, tuple[Command, ...]], ticks: int, fault: Fault | None = None) -> Flight:
        memory, flight = Memory(), Flight()
        state = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
        for sequence in range(ticks):
            inputs = healthy(sequence, state, START_NS + sequence * TICK_NS, commands.get(sequence, ()))
            inputs = fault(sequence, inputs) if fault else inputs
            decided, memory = tick(inputs, setup(), memory)
            flight.append((inputs, decided))
        return flight

    def test_takes_off_only_when_armed(self) -> None:
        orders = {
            0: (Command.TAKEOFF,),
            1: (Command.CHECK,),
            2: (Command.ARM,),
            3: (Command.CHECKED,),
            4: (Command.TAKEOFF,),
        }
        assert phases(self.stand(orders, 10)) == [Phase.IDLE, Phase.PREFLIGHT, Phase.READY]

    def test_readiness_expires_after_30_s(self) -> None:
        flight = self.stand({0: (Command.CHECK,), 1: (Command.CHECKED,)}, 3010)
        assert phases(flight) == [Phase.PREFLIGHT, Phase.READY, Phase.IDLE]
        assert finding(flight, "phase_expired")[0] + 3 == 3001

    def test_an_armed_vehicle_that_does_not_take_off_is_disarmed_after_10_s(self) -> None:
        flight = self.stand({0: (Command.CHECK,), 1: (Command.CHECKED,), 2: (Command.ARM,)}, 1010)
        assert phases(flight) == [Phase.PREFLIGHT, Phase.READY, Phase.ARMED, Phase.IDLE]
        assert [t.motors for _, t in flight if t.motors is not MotorRequest.NONE] == [
            MotorRequest.ARM,
            MotorRequest.DISARM,
        ]

    def test_a_pose_that_is_lost_disarms(self) -> None:
        commands = {0: (Command.CHECK,), 1: (Command.CHECKED,), 2: (Command.ARM,)}
        flight = self.stand(commands, 60, gap(10, 1000))
        assert phases(flight)[-1] is Phase.IDLE
        assert flight[-1][1].setpoint is None

    def test_before_the_first_pose_it_waits(self) -> None:
        none = from_tick(0, lambda i: replace(i, pose=replace(i.pose, state=None, age_ns=None, raw=None)))
        flight = self.stand({0: (Command.CHECK,)}, 50, none)
        assert phases(flight) == [Phase.PREFLIGHT]
        assert codes(flight) == set()


class TestRoute:
    def test_a_leg_that_does_not_settle_is_left_with_a_warning(self) -> None:
        def shaken(tick_: int, inputs: TickInputs) -> TickInputs:
            state = inputs.pose.state
            assert state is not None
            moving = replace(state, v_WB_W=(0.2, 0.0, 0.0))
            return replace(inputs, pose=replace(inputs.pose, state=moving)) if 300 < tick_ < 1000 else inputs

        flight = fly(fault=shaken)
        assert "not_settled" in codes(flight)
        assert phases(flight)[-1] is Phase.LANDED
        begins = next(i for i, (_, t) in enumerate(flight) if t.leg == 3)
        assert begins - 3 == pytest.approx(350 + 500, abs=2)

    def test_time_beyond_the_end_of_a_leg_counts_for_the_next(self) -> None:
        """Else every leg would begin up to a tick late, and the flight would fall behind its rehearsal."""
        height = WAYPOINTS[0].tolist()
        legs = (
            Leg(LegKind.TAKEOFF, straight([0.0, 0.0, 0.0, 0.0], height, 1.004)),
            *(Leg(LegKind.HOLD, Trajectory.hover(height[:3], 0.0, 0.104)) for _ in range(5)),
            Leg(LegKind.LAND, straight(height, [0.0, 0.0, 0.0, 0.0], 1.5)),
        )
        flight = fly(FlightSetup.of(FlightPlan(legs), setup().vehicle, LIMITS))
        landing = next(t for _, t in flight if t.leg == 6)
        flown_s = (landing.now_ns - START_NS) * 1e-9 - 0.03
        assert flown_s == pytest.approx(1.004 + 5 * 0.104 + landing.leg_time_s)
        assert landing.leg_time_s < 0.01

    def test_a_plan_without_landing_is_landed(self) -> None:
        whole = plan()
        airborne = FlightPlan(tuple(leg for leg in whole.legs if leg.kind is not LegKind.LAND))
        flight = fly(FlightSetup.of(airborne, setup().vehicle, LIMITS))
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.LANDED]

    @pytest.mark.parametrize("mass_share", [0.85, 1.15])
    def test_motors_stop_on_the_ground_also_where_thrust_is_not_as_believed(self, mass_share: float) -> None:
        for flight in (fly(mass_share=mass_share), fly(mass_share=mass_share, orders={TRACKING: (Command.LAND,)})):
            landed = next(i for i, t in flight if t.phase is Phase.LANDED)
            assert height_m(landed) < 0.01

    @pytest.mark.parametrize("mass_share", [0.92, 1.0, 1.1])
    def test_the_blind_descent_comes_down_also_where_thrust_is_not_as_believed(self, mass_share: float) -> None:
        heights = []

        def blind(tick_: int, inputs: TickInputs) -> TickInputs:
            heights.append(height_m(inputs))
            return gap(TRACKING, 100_000)(tick_, inputs)

        flight = fly(mass_share=mass_share, fault=blind, linger=0)
        assert phases(flight)[-1] is Phase.KILL
        assert heights[TRACKING] > 0.7
        assert heights[-1] == 0.0
        assert max(np.diff(heights[-200:])) < 0.01

    def test_a_vehicle_that_falls_has_crashed(self) -> None:
        flight = fly(orders={TRACKING: (Command.LAND,)}, fault=from_tick(TRACKING, fallen(TRACKING)))
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.CRASHED]
        assert finding(flight, "fallen")[1].message == "is on the ground although it should fly"

    def test_a_vehicle_that_falls_at_the_end_of_its_landing_has_crashed(self) -> None:
        flight = fly(orders={TRACKING: (Command.LAND,)}, fault=from_tick(TRACKING + 215, fallen(TRACKING + 215)))
        assert phases(flight) == [*UP, Phase.LAND_NOW, Phase.CRASHED]
        assert finding(flight, "hard_landing")[1].message == "hit the ground at 3.7 m/s"

    def test_a_vehicle_that_is_on_the_ground_unseen_has_fallen(self) -> None:
        """The pose is away while it falls: the landing goes on from where it is believed to be."""
        lost, down = gap(TRACKING, 28), from_tick(TRACKING + 28, fallen(TRACKING))
        flight = fly(fault=lambda k, i: down(k, lost(k, i)))
        assert phases(flight) == [*UP, Phase.BRAKE_HOLD, Phase.CRASHED]
        assert codes(flight) >= {"fallen"}

    def test_a_vehicle_that_does_not_lift_off_is_stopped(self) -> None:
        still = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), IDENTITY, (0.0, 0.0, 0.0))
        flight = fly(fault=lambda _, i: replace(i, pose=replace(i.pose, state=still)))
        assert phases(flight) == [*UP[:4], Phase.LAND_NOW, Phase.LANDED]
        assert first(flight, Phase.LAND_NOW) < 100
        assert "no_lift_off" in codes(flight)

    def test_a_vehicle_that_lies_on_its_side_has_crashed(self) -> None:
        def tipped(inputs: TickInputs) -> TickInputs:
            state = inputs.pose.state
            assert state is not None
            turned = replace(state, q_WB=(math.sin(0.45), 0.0, 0.0, math.cos(0.45)))
            return replace(inputs, pose=replace(inputs.pose, state=turned)) if state.p_WB[2] < 0.01 else inputs

        flight = fly(fault=from_tick(TRACKING, tipped))
        assert phases(flight) == [*UP, Phase.LAND, Phase.CRASHED]
        assert "lies_tilted" in codes(flight)

    def test_a_landing_from_high_up_has_the_time_it_takes(self) -> None:
        high = WAYPOINTS[0] * (1.0, 1.0, 30.0, 1.0)
        legs = (
            Leg(LegKind.TAKEOFF, straight([0.0, 0.0, 0.0, 0.0], high.tolist(), 20.0)),
            Leg(LegKind.LAND, straight(high.tolist(), [0.0, 0.0, 0.0, 0.0], 80.0)),
        )
        tall = replace(LIMITS, geofence=Geofence((-2.0, -2.0, 0.0), (3.0, 3.0, 40.0)))
        flown = FlightSetup.of(FlightPlan(legs), setup().vehicle, tall)
        assert phases(fly(flown, ticks=12_000))[-2:] == [Phase.LAND, Phase.LANDED]
        flight = fly(flown, orders={1900: (Command.LAND,)}, ticks=12_000)
        assert phases(flight)[-2:] == [Phase.LAND_NOW, Phase.LANDED]
        assert (len(flight) - first(flight, Phase.LAND_NOW)) * 0.01 > 65.0

    def test_a_landing_that_finds_no_ground_ends_level_and_is_stopped(self) -> None:
        def hovers(inputs: TickInputs) -> TickInputs:
            state = State((0.5, 1.0, 0.4), (0.0, 0.0, -0.2), IDENTITY, (0.0, 0.0, 0.0))
            return replace(inputs, pose=replace(inputs.pose, state=state))

        flight = fly(fault=from_tick(850, hovers), ticks=6000)
        assert phases(flight)[-4:] == [Phase.LAND, Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.KILL]

    def test_landing_is_pressed_down(self) -> None:
        last = [t for _, t in fly() if t.phase is Phase.LAND][-1]
        assert last.reference is not None
        assert last.reference.p_W[2] < -0.1


def test_findings_of_the_gate_are_in_the_record() -> None:
    def wild(
        state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
    ) -> tuple[AttitudeThrust, Vector3]:
        return AttitudeThrust(1e3, (0.0, 0.0, 0.0, 1.0)), integral

    flight = fly(FlightSetup.of(plan(), setup().vehicle, LIMITS, wild), ticks=20)
    assert "gate_thrust" in codes(flight)
    flying = [t for _, t in flight if t.phase is Phase.TAKEOFF]
    assert all(t.saturated and t.setpoint and t.setpoint.thrust_N == setup().gate.thrust_N for t in flying)


def test_times_are_measured() -> None:
    steps = np.array([t.dt_s for _, t in fly()])
    assert np.allclose(steps, 0.01)
