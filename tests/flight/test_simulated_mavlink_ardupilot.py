"""The simulated ArduPilot Copter flies, refuses and fails as was seen in flight experiments; in virtual time."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import common
from virtual_mavlink import (
    ACCEPTED,
    ARM,
    DENIED,
    FAILED,
    GUIDED,
    GUIDED_NOGPS,
    HOVER,
    INTERVAL,
    LAND,
    REBOOT,
    SET_MODE,
    STABILIZE,
    Client,
    turned,
)

BRAKE, LOITER, AFTER_BOOT = 17, 5, {"HEARTBEAT", "STATUSTEXT", "TIMESYNC"}
THRUST = HOVER["ardupilot"]
EKF = 193
GOOD = 0x33F


@pytest.fixture
def client() -> Client:
    return Client("ardupilot")


@pytest.fixture
def flying(client: Client) -> Client:
    client.take_off()
    client.forget()
    return client


@pytest.fixture
def blind() -> Client:
    """Without motion capture of its own."""
    return Client("ardupilot", own_mocap=False)


def set_origin(client: Client) -> None:
    client.send(common.MAVLink_set_gps_global_origin_message(1, 473977420, 85455940, 488000))


def ready(client: Client) -> bool:
    """As EKF_STATUS_REPORT says."""
    client.command(512, EKF)
    flags: int = client.of("EKF_STATUS_REPORT")[-1].flags
    return flags & GOOD == GOOD and not flags & 0x80


def test_after_a_boot_it_says_little_until_it_is_asked(client: Client) -> None:
    client.wait(12_000)
    assert {message.get_type() for message in client.heard} == AFTER_BOOT
    assert client.command(INTERVAL, 32, 100_000) == ACCEPTED
    client.wait(1000)
    assert len(client.of("LOCAL_POSITION_NED")) == pytest.approx(10, abs=1)


def test_local_position_is_acknowledged_but_silent_without_a_position(blind: Client) -> None:
    assert blind.command(INTERVAL, 32, 100_000) == ACCEPTED
    blind.wait(1000)
    assert not blind.of("LOCAL_POSITION_NED")


def test_the_estimator_is_ready_after_origin_and_odometry(blind: Client) -> None:
    assert not ready(blind)
    set_origin(blind)
    blind.watch(2500)
    assert ready(blind)
    assert blind.pilot.estimator.position == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_without_an_origin_arming_fails_for_ever(blind: Client) -> None:
    blind.watch(5000)
    assert not ready(blind)
    assert blind.mode(GUIDED) == ACCEPTED
    assert blind.command(ARM, 1) == FAILED
    assert blind.texts[-1] == "Arm: waiting for home"


def test_odometry_before_the_origin_leaves_a_bias_in_height(blind: Client) -> None:
    blind.watch(1000)
    set_origin(blind)
    blind.watch(3000)
    assert blind.pilot.estimator.position[2] == pytest.approx(0.09, abs=0.01)


@pytest.mark.parametrize("wrong", [{"frame": 1}, {"frame": 21}, {"child": 8}, {"quality": -1}])
def test_other_odometry_is_ignored_without_a_word(blind: Client, wrong: dict[str, int]) -> None:
    set_origin(blind)
    blind.wait(20)
    blind.forget()
    blind.watch(2500, **wrong)
    assert not ready(blind)
    assert not blind.texts


def test_an_origin_is_set_once(blind: Client) -> None:
    set_origin(blind)
    blind.send(common.MAVLink_set_gps_global_origin_message(1, 1, 1, 1))
    blind.send(common.MAVLink_set_gps_global_origin_message(1, 2**31 - 1, 0, 0))
    assert blind.pilot.origin == (473977420, 85455940, 488000)
    blind.wait(20)
    assert [origin.latitude for origin in blind.of("GPS_GLOBAL_ORIGIN")] == [473977420]


def test_odometry_below_4_hz_refuses_arming(blind: Client) -> None:
    set_origin(blind)
    blind.watch(5000, rate_hz=50.0)
    blind.mode(GUIDED)
    for _ in range(5):
        blind.watch(1000, rate_hz=2.0)
        blind.see((0.0, 0.0, 0.0))
        assert blind.command(ARM, 1) == FAILED
        assert blind.texts[-1] == "Arm: VisOdom not healthy"
    blind.watch(4000, rate_hz=5.0)
    assert blind.command(ARM, 1) == ACCEPTED


def test_a_short_gap_leaves_the_flags_good(blind: Client) -> None:
    set_origin(blind)
    blind.watch(3000)
    blind.wait(500)
    blind.watch(100)
    assert ready(blind)


def test_flags_stay_good_for_seven_seconds_after_odometry_stops(blind: Client) -> None:
    set_origin(blind)
    blind.watch(3000)
    blind.wait(6500)
    assert ready(blind)
    blind.wait(1000)
    assert not ready(blind)


def test_the_failsafe_comes_eight_seconds_after_poses_stop() -> None:
    client = Client("ardupilot")
    client.take_off()
    client.mode(GUIDED)
    client.go_blind()
    client.fly(7800, THRUST)
    assert client.pilot.mode == GUIDED
    client.fly(400, THRUST)
    assert client.pilot.mode == LAND
    assert client.texts[-1] == "EKF Failsafe: changed to LAND Mode"


def test_a_jump_is_ignored_for_seconds_unless_it_is_told(blind: Client) -> None:
    set_origin(blind)
    blind.watch(3000)
    blind.watch(2000, (0.0, 2.5, 0.0))
    assert blind.pilot.estimator.position[1] == pytest.approx(0.0, abs=0.1)
    assert ready(blind)
    assert blind.of("EKF_STATUS_REPORT")[-1].pos_horiz_variance > 1.0
    blind.watch(100, (0.0, 2.5, 0.0), resets=1)
    assert blind.pilot.estimator.position[1] == pytest.approx(2.5, abs=0.1)


def test_arming_is_refused_for_a_while_after_a_boot() -> None:
    client = Client("ardupilot", boot_s=None)
    client.wait(10_000)
    client.mode(GUIDED_NOGPS)
    assert client.command(ARM, 1) == FAILED
    assert client.texts[-1] == "Arm: Accels inconsistent"
    client.wait(6_000)
    assert client.command(ARM, 1) == FAILED
    assert client.texts[-1] == "Arm: Gyros inconsistent"
    client.wait(4_500)
    assert client.command(ARM, 1) == ACCEPTED


@pytest.mark.parametrize("magic", [2989, 21196])
def test_arming_can_be_forced(magic: int) -> None:
    client = Client("ardupilot", boot_s=None)
    client.wait(100)
    assert client.command(ARM, 1, magic) == ACCEPTED


@pytest.mark.parametrize(
    ("mode", "reason"),
    [
        (LAND, "LAND mode not armable"),
        (BRAKE, "BRAKE mode not armable"),
        (STABILIZE, "RC not found"),
        (GUIDED, "waiting for home"),
    ],
)
def test_modes_are_accepted_while_disarmed_and_refused_at_arming(blind: Client, mode: int, reason: str) -> None:
    assert blind.mode(mode) == ACCEPTED
    assert blind.command(ARM, 1) == FAILED
    assert blind.texts[-1] == f"Arm: {reason}"


def test_armed_without_a_position_a_mode_that_needs_one_is_refused(blind: Client) -> None:
    blind.mode(GUIDED_NOGPS)
    assert blind.command(ARM, 1) == ACCEPTED
    assert blind.mode(GUIDED) == FAILED
    assert blind.texts[-1] == "Mode change to GUIDED failed: requires position"
    assert blind.mode(99) == FAILED
    assert blind.texts[-1] == "No such mode 99"


def test_a_mode_without_the_custom_flag_is_denied(client: Client) -> None:
    assert client.command(SET_MODE, 128, GUIDED) == DENIED


def test_motors_are_off_for_two_seconds_and_then_ramp(client: Client) -> None:
    client.mode(GUIDED_NOGPS)
    client.command(ARM, 1)
    client.fly(1900, 0.5)
    assert client.pilot.force == 0.0
    client.fly(350, 0.5)
    half = client.pilot.force
    client.fly(400, 0.5)
    assert 0.1 * client.pilot.force < half < 0.8 * client.pilot.force


@pytest.mark.parametrize(("share", "force_g"), [(0.8, 0.824), (1.0, 1.0), (1.2, 1.172)])
def test_thrust_to_force_is_affine(flying: Client, share: float, force_g: float) -> None:
    flying.fly(100, share * THRUST)
    assert flying.pilot.force == pytest.approx(force_g, abs=0.005)


def climb_rate(client: Client, thrust: float) -> float:
    """m/s, once it has settled."""
    client.fly(2000, thrust)
    z = client.state.p_WB[2]
    client.fly(2000, thrust)
    return (client.state.p_WB[2] - z) / 2.0


@pytest.mark.parametrize(("thrust", "climb"), [(0.5, 0.0), (0.6, 0.5), (0.37, -0.39)])
def test_without_the_option_bit_thrust_is_a_climb_rate(thrust: float, climb: float) -> None:
    client = Client("ardupilot", wrong="GUID_OPTIONS:0")
    client.mode(GUIDED_NOGPS)
    client.command(ARM, 1)
    client.fly(3000, 0.5)
    assert client.vehicle.body.height_m == 0.0, "0.5 does not lift it off"
    client.fly(4000, 0.7)
    assert climb_rate(client, thrust) == pytest.approx(climb, abs=0.12)


def test_a_stream_that_stops_is_held_and_then_levelled_at_its_height(flying: Client) -> None:
    """GUID_TIMEOUT is 0.5 s here; horizontal speed is not braked."""
    flying.fly(500, THRUST, turned(roll_deg=15.0))
    flying.wait(400)
    assert abs(flying.pilot.estimator.attitude[1]) > math.sin(math.radians(5.0))
    flying.wait(700)
    assert abs(flying.pilot.estimator.attitude[1]) < math.sin(math.radians(1.5))
    speed, z = flying.state.v_WB_W[0], flying.state.p_WB[2]
    flying.wait(500)
    assert flying.state.v_WB_W[0] > 0.5 * speed > 0.2
    flying.wait(1500)
    assert flying.state.p_WB[2] == pytest.approx(z, abs=0.2)
    flying.fly(300, THRUST, turned(roll_deg=-15.0))
    assert flying.pilot.estimator.attitude[1] < -math.sin(math.radians(4.0)), "resuming takes over at once"


def test_thrust_that_is_no_number_drops_it_until_a_reboot(flying: Client) -> None:
    flying.target(math.nan)
    flying.wait(20)
    assert flying.pilot.force == 0.0
    flying.fly(200, THRUST)
    flying.command(ARM, 0, 21196)
    assert flying.command(ARM, 1) == FAILED
    assert flying.texts[-1] == "Arm: Internal errors 0x1000000"
    assert flying.command(REBOOT, 1) == ACCEPTED
    flying.wait(500)
    flying.vehicle.body.put_upright()
    flying.mode(GUIDED_NOGPS)
    assert flying.command(ARM, 1) == ACCEPTED


def test_thrust_beyond_one_is_one(flying: Client) -> None:
    flying.target(1.5)
    assert flying.pilot.target.thrust == 1.0


@pytest.mark.parametrize(
    ("q", "mask"),
    [((1.001, 0, 0, 0), 7), ((0, 0, 0, 0), 7), ((1, 0, 0, 0), 71), ((1, 0, 0, 0), 135), ((math.nan, 0, 0, 0), 7)],
)
def test_unfit_setpoints_are_dropped_in_silence(flying: Client, q: tuple[float, ...], mask: int) -> None:
    before = flying.pilot.target
    flying.target(THRUST, q, mask)
    assert flying.pilot.target is before
    assert not flying.texts


def test_asking_for_the_mode_that_it_has_changes_nothing(flying: Client) -> None:
    """A client that lost the acknowledgement asks again in flight."""
    target = flying.pilot.target
    assert flying.mode(GUIDED_NOGPS) == ACCEPTED
    assert flying.pilot.target is target


def test_a_mask_that_ignores_some_rates_begins_guided_anew(flying: Client) -> None:
    flying.fly(200, THRUST, turned(roll_deg=20.0))
    flying.target(THRUST, turned(roll_deg=20.0), 3)
    assert flying.pilot.target is None


def test_setpoints_in_other_modes_are_ignored(client: Client) -> None:
    client.target(0.5)
    assert client.pilot.target is None


def test_land_comes_down_and_disarms_within_two_to_four_seconds_of_the_floor(flying: Client) -> None:
    assert flying.mode(LAND) == ACCEPTED
    while flying.vehicle.body.height_m > 0.0:
        flying.wait(20)
    flying.wait(1500)
    assert flying.pilot.armed
    flying.wait(2500)
    assert not flying.pilot.armed
    assert flying.texts == ["Disarming motors"]


def test_touching_down_on_no_thrust_is_not_seen_as_landed_for_seconds(flying: Client) -> None:
    flying.fly(1200, 0.7 * THRUST)
    flying.fly(2000, 0.0)
    assert flying.vehicle.body.height_m == 0.0
    assert flying.command(ARM, 0) == FAILED
    assert flying.mode(LAND) == ACCEPTED
    flying.wait(2500)
    assert not flying.pilot.armed


def test_disarming_in_the_air_is_refused_unless_forced(flying: Client) -> None:
    assert flying.command(ARM, 0) == FAILED
    assert flying.command(ARM, 0, 21196) == ACCEPTED


def test_armed_and_idle_it_disarms_after_ten_seconds(client: Client) -> None:
    client.mode(GUIDED_NOGPS)
    assert client.command(ARM, 1) == ACCEPTED
    client.wait(9800)
    assert client.pilot.armed
    client.wait(400)
    assert not client.pilot.armed


def test_a_roll_of_45_degrees_is_flown(flying: Client) -> None:
    flying.fly(800, THRUST, turned(roll_deg=45.0))
    assert flying.pilot.estimator.attitude[1] == pytest.approx(math.sin(math.radians(22.5)), abs=0.03)


def test_any_system_id_is_obeyed(client: Client) -> None:
    client._out.srcSystem = 77
    assert client.mode(GUIDED_NOGPS) == ACCEPTED


def test_factory_parameters_take_no_poses() -> None:
    client = Client("ardupilot", defaults="factory")
    client.wait(3000)
    assert not ready(client)
