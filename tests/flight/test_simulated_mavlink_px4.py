"""The simulated PX4 flies, refuses and fails as PX4 does; in virtual time."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import common
from virtual_mavlink import (
    ACCEPTED,
    ARM,
    DENIED,
    LAND_HERE,
    PX4_ALTCTL,
    PX4_LAND,
    PX4_LOITER,
    PX4_OFFBOARD,
    PX4_POSCTL,
    REBOOT,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    Client,
    turned,
)

STABILIZED, TAKEOFF, RTL = 7 << 16, 4 << 16 | 2 << 24, 4 << 16 | 5 << 24


@pytest.fixture
def client() -> Client:
    return Client()


@pytest.fixture
def flying(client: Client) -> Client:
    client.take_off()
    client.forget()
    return client


def test_offboard_is_refused_without_a_second_of_setpoints_and_says_so(client: Client) -> None:
    assert client.mode(PX4_OFFBOARD) == TEMPORARILY_REJECTED
    client.fly(900, 0.0)
    assert client.mode(PX4_OFFBOARD) == TEMPORARILY_REJECTED
    assert client.texts[-1] == "Switching to mode 'Offboard' is currently not possible"
    client.fly(200, 0.0)
    assert client.mode(PX4_OFFBOARD) == ACCEPTED


def test_setpoints_slower_than_2_hz_are_no_stream(client: Client) -> None:
    for _ in range(5):
        client.target(0.0)
        client.wait(600)
    client.target(0.0)
    assert client.mode(PX4_OFFBOARD) == TEMPORARILY_REJECTED


def test_setpoints_are_nothing_where_they_are_not_forwarded() -> None:
    client = Client(wrong="MAV_FWDEXTSP:0")
    client.fly(1500, 0.0)
    assert client.mode(PX4_OFFBOARD) == TEMPORARILY_REJECTED


def test_the_heartbeat_tells_the_mode_and_that_it_is_armed(flying: Client) -> None:
    flying.fly(1000, 0.5)
    heartbeat = flying.of("HEARTBEAT")[-1]
    assert (heartbeat.autopilot, heartbeat.custom_mode, heartbeat.base_mode & 128) == (12, PX4_OFFBOARD, 128)
    assert heartbeat.system_status == common.MAV_STATE_ACTIVE


def test_it_is_armed_again_while_it_is_armed(flying: Client) -> None:
    assert flying.command(ARM, 1) == ACCEPTED


def test_motors_stay_off_for_the_spool_up_time(client: Client) -> None:
    client.fly(1200, 0.0)
    client.mode(PX4_OFFBOARD)
    client.command(ARM, 1)
    client.fly(900, 0.8)
    assert client.vehicle.body.height_m == 0.0
    client.fly(400, 0.8)
    assert client.vehicle.body.height_m > 0.01


def test_thrust_is_in_proportion_to_force() -> None:
    """0.55 of 0.5 is 1.1 times the weight: 0.98 m/s^2 upwards, less drag."""
    client = Client(seed=3)
    client.take_off()
    before = client.state.v_WB_W[2]
    client.fly(200, 0.55)
    assert client.state.v_WB_W[2] - before == pytest.approx(0.2 * 0.981, abs=0.1)


def test_a_setpoint_that_ignores_thrust_keeps_offboard_and_drops_it(flying: Client) -> None:
    before = flying.state.p_WB[2]
    for _ in range(15):
        flying.target(0.5, mask=7 | 64)
        flying.wait(20)
    assert flying.state.p_WB[2] < before - 0.1
    assert flying.pilot.mode == PX4_OFFBOARD


@pytest.mark.parametrize("thrust", [math.nan, math.inf])
def test_a_setpoint_that_is_not_finite_is_not_flown(flying: Client, thrust: float) -> None:
    before = flying.pilot.target
    flying.target(thrust)
    assert flying.pilot.target is before


def test_thrust_beyond_one_is_one(flying: Client) -> None:
    flying.target(1.5)
    assert flying.pilot.target.thrust == 1.0


def test_a_lost_stream_lands_by_the_parameter(flying: Client) -> None:
    """COM_OF_LOSS_T is 0.5 s here, COM_OBL_RC_ACT 4."""
    flying.wait(450)
    assert flying.pilot.mode == PX4_OFFBOARD
    flying.wait(150)
    assert flying.pilot.mode == PX4_LAND
    assert flying.texts == ["Failsafe activated: no offboard signal"]
    flying.wait(8000)
    assert not flying.pilot.armed
    assert flying.texts[-1] == "Disarmed by landing"


@pytest.mark.parametrize(
    ("action", "mode"), [(0, PX4_POSCTL), (1, PX4_ALTCTL), (2, STABILIZED), (3, RTL), (4, PX4_LAND), (5, PX4_LOITER)]
)
def test_what_a_lost_stream_leads_to(action: int, mode: int) -> None:
    client = Client(wrong=f"COM_OBL_RC_ACT:{action}")
    client.take_off()
    client.wait(700)
    assert client.pilot.mode == mode


def test_the_heartbeat_is_critical_while_a_failsafe_has_it_and_not_when_somebody_else_does(flying: Client) -> None:
    flying.wait(2000)
    assert flying.of("HEARTBEAT")[-1].system_status == common.MAV_STATE_CRITICAL
    flying.pilot.request_mode(PX4_POSCTL)
    flying.wait(1000)
    assert flying.of("HEARTBEAT")[-1].system_status == common.MAV_STATE_ACTIVE


def test_termination_stops_the_motors() -> None:
    client = Client(wrong="COM_OBL_RC_ACT:6")
    client.take_off()
    client.wait(700)
    assert not client.pilot.armed


def test_as_the_firmware_comes_it_holds_for_five_seconds_first() -> None:
    client = Client(wrong="COM_OBL_RC_ACT:4,COM_FAIL_ACT_T:5,COM_OF_LOSS_T:1")
    client.take_off()
    client.wait(900)
    assert client.pilot.mode == PX4_OFFBOARD
    client.wait(200)
    assert client.pilot.mode == PX4_LOITER
    client.wait(4800)
    assert client.pilot.mode == PX4_LOITER
    client.wait(400)
    assert client.pilot.mode == PX4_LAND


def test_without_a_position_a_lost_stream_lands_where_it_should_hold() -> None:
    client = Client(own_mocap=False, wrong="COM_OBL_RC_ACT:5")
    client.take_off()
    client.wait(700)
    assert client.pilot.mode == PX4_LAND


def test_it_holds_its_place_in_loiter(flying: Client) -> None:
    assert flying.mode(PX4_LOITER) == ACCEPTED
    flying.wait(2000)
    x, y, z = flying.state.p_WB
    flying.wait(4000)
    assert flying.state.p_WB == pytest.approx((x, y, z), abs=0.3)


def test_land_disarms_by_itself_two_seconds_after_landing(flying: Client) -> None:
    assert flying.command(LAND_HERE) == ACCEPTED
    while flying.vehicle.body.height_m > 0.0:
        flying.wait(20)
    flying.wait(2800)
    assert flying.pilot.armed
    flying.wait(800)
    assert not flying.pilot.armed
    assert not flying.vehicle.body.broken


def test_a_take_off_by_command_ends_in_loiter(client: Client) -> None:
    client.wait(100)
    assert client.command(ARM, 1) == ACCEPTED
    assert client.command(22) == ACCEPTED
    client.wait(8000)
    assert client.pilot.mode == PX4_LOITER
    assert client.state.p_WB[2] == pytest.approx(2.5, abs=0.4)


def test_disarming_in_the_air_is_refused_unless_forced(flying: Client) -> None:
    assert flying.command(ARM, 0) == TEMPORARILY_REJECTED
    assert "Disarming denied: not landed" in flying.texts
    assert flying.command(ARM, 0, 21196) == ACCEPTED
    assert not flying.pilot.armed


def test_without_poses_a_mode_that_needs_a_position_ends_after_five_seconds(flying: Client) -> None:
    flying.mode(PX4_LOITER)
    flying.go_blind()
    flying.wait(4900)
    assert flying.pilot.mode == PX4_LOITER
    flying.wait(300)
    assert flying.pilot.mode == PX4_LAND
    assert flying.texts[-1] == "Failsafe activated: position estimate invalid"
    flying.wait(10_000)
    assert not flying.pilot.armed


def test_offboard_with_attitudes_needs_no_position(flying: Client) -> None:
    flying.go_blind()
    flying.fly(6000, 0.5)
    assert flying.pilot.mode == PX4_OFFBOARD


def test_a_pilot_who_flies_by_hand_may_disarm_in_the_air(flying: Client) -> None:
    flying.mode(STABILIZED)
    assert flying.command(ARM, 0) == ACCEPTED


def test_the_pilot_takes_over(flying: Client) -> None:
    flying.pilot.request_mode(PX4_POSCTL)
    flying.fly(200, 0.9, turned(roll_deg=30.0))
    assert flying.pilot.mode == PX4_POSCTL
    assert flying.state.v_WB_W[2] < 0.5


def test_armed_and_idle_it_disarms_after_ten_seconds(client: Client) -> None:
    client.wait(100)
    assert client.command(ARM, 1) == ACCEPTED
    client.wait(9800)
    assert client.pilot.armed
    client.wait(400)
    assert client.texts[-1] == "Disarmed by auto preflight disarming"


def test_it_stays_armed_after_landing_where_it_is_told_to() -> None:
    client = Client(wrong="COM_DISARM_LAND:0")
    client.take_off()
    client.mode(PX4_LAND)
    client.wait(20_000)
    assert client.pilot.landed
    assert client.pilot.armed


@pytest.mark.parametrize(
    ("options", "mode", "reason"),
    [
        ({"boot_s": 5.0}, PX4_LOITER, "ekf2 missing data"),
        ({"own_mocap": False}, PX4_LOITER, "position estimate invalid"),
        ({}, STABILIZED, "No manual control input"),
        ({"battery_V": 3.0}, PX4_LOITER, "Battery unhealthy"),
        ({}, PX4_LAND, "Mode not suitable for arming: Land"),
    ],
)
def test_arming_is_refused_with_the_reason(options: dict[str, object], mode: int, reason: str) -> None:
    client = Client(**options)  # type: ignore[arg-type]
    client.wait(100)
    assert client.mode(mode) == ACCEPTED
    assert client.command(ARM, 1) == TEMPORARILY_REJECTED
    assert client.texts[-2:] == ["Arming denied: Resolve system health failures first", f"Preflight Fail: {reason}"]
    assert client.command(ARM, 1, 21196) == ACCEPTED, "forced"


def test_a_pilot_with_a_remote_control_can_arm_by_hand() -> None:
    client = Client(rc=True)
    client.wait(100)
    client.mode(STABILIZED)
    assert client.command(ARM, 1) == ACCEPTED


def test_offboard_is_armed_only_while_setpoints_come(client: Client) -> None:
    client.fly(1200, 0.0)
    client.mode(PX4_OFFBOARD)
    client.wait(700)
    assert client.command(ARM, 1) == TEMPORARILY_REJECTED
    assert client.texts[-1] == "Preflight Fail: No offboard signal"


def test_it_says_when_it_is_ready() -> None:
    client = Client(boot_s=2.0)
    client.wait(1900)
    assert not client.texts
    client.wait(200)
    assert client.texts == ["Ready for takeoff!"]


def test_other_arming_numbers_are_unsupported(client: Client) -> None:
    assert client.command(ARM, 2) == UNSUPPORTED
    assert client.command(ARM, math.nan) == UNSUPPORTED


def test_it_reboots_when_it_is_disarmed(flying: Client) -> None:
    assert flying.command(REBOOT, 1) == DENIED
    flying.command(ARM, 0, 21196)
    flying.forget()
    assert flying.command(REBOOT, 1) == ACCEPTED
    flying.wait(200)
    assert "Ready for takeoff!" in flying.texts
    assert flying.pilot.mode == PX4_LOITER


def test_hitting_the_floor_disarms_it(flying: Client) -> None:
    flying.fly(600, 0.9)
    flying.fly(3000, 0.0, turned(roll_deg=30.0))
    assert flying.vehicle.body.broken
    assert not flying.pilot.armed
    flying.wait(1000)
    assert flying.of("HEARTBEAT")[-1].system_status == common.MAV_STATE_CRITICAL


def test_a_critical_battery_lands_where_it_is_told_to() -> None:
    client = Client(wrong="COM_LOW_BAT_ACT:2")
    client.take_off()
    client.vehicle.body.set_battery(3.0)
    client.fly(200, 0.5)
    assert client.pilot.mode == PX4_LAND
    assert client.texts[-2:] == ["Low battery level", "Failsafe activated: critical battery"]
