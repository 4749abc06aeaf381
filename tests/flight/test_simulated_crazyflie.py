"""What the firmware does, flown: each behaviour in virtual time, by the bytes that a client sends."""

from __future__ import annotations

import math
import struct

import pytest
from virtual_crazyflie import (
    ARMED,
    CAN_ARM,
    CAN_FLY,
    CRASHED,
    FLYING,
    HOVER,
    LOCKED,
    NOTIFY,
    STOP,
    TUMBLED,
    Client,
    rpyt,
)

from lcd_flight.model.frames import body_z_axis, tilt_of, yaw_of
from sim_bridge.crazyflie.supervisor import State


@pytest.fixture
def client() -> Client:
    return Client()


class TestThrust:
    def test_it_takes_none_before_it_was_told_zero(self, client: Client) -> None:
        client.wait(200.0)
        client.fly(500.0, 50_000)
        assert client.height_m == 0.0
        client.ask(rpyt(0))
        client.fly(500.0, 50_000)
        assert client.height_m > 0.1

    def test_it_is_linear_in_force(self, client: Client) -> None:
        """Acceleration from two thrusts: (F - m g) / m with F = 4 * 0.12 N * counts / 65535."""
        for counts in (45_000, 55_000):
            client = Client()
            client.unlock()
            client.fly(400.0, counts)
            before = client.state.v_WB_W[2]
            client.fly(100.0, counts)
            gained = (client.state.v_WB_W[2] - before) / 0.1
            assert gained == pytest.approx(0.48 * counts / 65535.0 / 0.029 - 9.81, abs=0.4)  # less the inflow's share

    def test_hover_is_where_the_figures_say(self, client: Client) -> None:
        client.take_off()
        before = client.state.v_WB_W[2]
        client.fly(300.0, HOVER)
        assert client.state.v_WB_W[2] - before == pytest.approx(0.0, abs=0.12)

    def test_there_is_a_cap(self) -> None:
        heights = []
        for counts in (60_000, 65_535):
            client = Client()
            client.unlock()
            client.fly(400.0, counts)
            heights.append(client.height_m)
        assert heights[0] == heights[1] > 0.1

    def test_below_the_least_no_motor_is_asked_for_any(self, client: Client) -> None:
        client.unlock()
        client.fly(200.0, 999)
        assert not client.info & FLYING
        client.fly(200.0, 1000)
        assert client.info & FLYING

    def test_in_the_dead_band_motors_are_asked_but_do_not_turn(self, client: Client) -> None:
        client.unlock()
        client.fly(200.0, 6_999)
        assert client.info & FLYING
        assert max(client.vehicle.body.motor_shares) == 0.0
        client.fly(200.0, 7_000)
        assert min(client.vehicle.body.motor_shares) > 0.08

    def test_older_firmware_makes_more_of_the_same_counts(self) -> None:
        """Counts that hover with linear force climb where they are pulse widths: the wrong map is no detail."""
        speeds = []
        for firmware in ("2026.08", "2024.10"):
            client = Client(firmware=firmware)
            client.unlock()
            client.fly(500.0, 42_000)
            speeds.append(client.state.v_WB_W[2])
        assert speeds[1] > speeds[0] + 0.3


class TestSigns:
    """cflib's setpoint: roll to the right, pitch forward, yaw as the mode says; x forward, y left, z up."""

    def test_roll_is_to_the_right(self, client: Client) -> None:
        client.take_off()
        client.fly(500.0, HOVER, roll=10.0)
        assert client.state.p_WB[1] < -0.05
        assert abs(client.state.p_WB[0]) < 0.02
        assert body_z_axis(client.state.q_WB)[1] == pytest.approx(-math.sin(math.radians(10.0)), abs=0.03)

    def test_pitch_is_forward(self, client: Client) -> None:
        client.take_off()
        client.fly(500.0, HOVER, pitch=10.0)
        assert client.state.p_WB[0] > 0.05
        assert abs(client.state.p_WB[1]) < 0.02
        assert body_z_axis(client.state.q_WB)[0] == pytest.approx(math.sin(math.radians(10.0)), abs=0.03)

    def test_yaw_is_an_absolute_angle_counter_clockwise_where_the_mode_says_so(self, client: Client) -> None:
        client.wait(200.0)
        client.set("flightmode.stabModeYaw", 1)
        client.take_off()
        client.fly(1500.0, HOVER, yaw=40.0)
        assert math.degrees(yaw_of(client.state.q_WB)) == pytest.approx(40.0, abs=4.0)

    def test_yaw_is_a_rate_clockwise_otherwise(self, client: Client) -> None:
        client.take_off()
        client.fly(500.0, HOVER, yaw=60.0)
        before = yaw_of(client.state.q_WB)
        client.fly(500.0, HOVER, yaw=60.0)
        turned = math.degrees(yaw_of(client.state.q_WB) - before)
        assert turned == pytest.approx(-30.0, abs=5.0)

    def test_a_yaw_rate_without_thrust_is_not_saved_up(self, client: Client) -> None:
        client.unlock()
        client.fly(1000.0, 0, yaw=90.0)
        client.fly(700.0, 45_000)
        assert client.height_m > 0.1
        assert abs(math.degrees(yaw_of(client.state.q_WB))) < 3.0

    def test_the_yaw_rate_of_a_manual_setpoint_is_counter_clockwise(self, client: Client) -> None:
        client.take_off()
        for _ in range(100):
            client.ask(b"\x7c\x0b" + struct.pack("<fffHB", 0.0, 0.0, 60.0, HOVER, 0))
            client.wait(10.0)
        assert math.degrees(yaw_of(client.state.q_WB)) > 20.0

    def test_tilt_is_towards_the_vehicles_own_front_not_the_worlds(self) -> None:
        client = Client(yaw_rad=math.pi / 2.0)
        client.wait(200.0)
        for _ in range(50):
            client.show((0.0, 0.0, 0.0), client.state.q_WB)
            client.wait(10.0)
        client.take_off()
        client.fly(500.0, HOVER, pitch=10.0)
        assert client.state.p_WB[1] > 0.05
        assert abs(client.state.p_WB[0]) < 0.03

    def test_the_logged_pitch_is_nose_up(self, client: Client) -> None:
        """The opposite of what was commanded; roll and yaw are not turned round, and the quaternion is the body's."""
        client.take_off()
        client.fly(500.0, HOVER, roll=5.0, pitch=10.0)
        roll, pitch, _ = self._logged(client, "stateEstimate", "roll pitch yaw")
        assert pitch == pytest.approx(-10.0, abs=2.0)
        assert roll == pytest.approx(5.0, abs=2.0)
        quaternion = self._logged(client, "stateEstimate", "qx qy qz qw")
        assert quaternion == pytest.approx(client.state.q_WB, abs=0.02)

    def test_the_motors_are_numbered_from_front_right_clockwise(self, client: Client) -> None:
        """Rolling to the right: the left motors, M3 and M4, give more; pitching forward, the rear ones, M2 and M3."""
        for tilt, more in (({"roll": 20.0}, (2, 3)), ({"pitch": 20.0}, (1, 2))):
            client = Client()
            client.take_off()
            client.ask(rpyt(HOVER, **tilt))
            client.wait(10.0)
            motors = self._logged(client, "motor", "m1 m2 m3 m4")
            assert min(motors[m] for m in more) > max(motors[m] for m in set(range(4)) - set(more))

    @staticmethod
    def _logged(client: Client, group: str, names: str) -> list[float]:
        """The newest values of some log variables, as floats."""
        entries = []
        for number in range(200):
            (item,) = client.ask(b"\x5c\x02" + number.to_bytes(2, "little"))
            entries.append(item[5:].split(b"\0")[:2])
            if len(item) == 2:
                break
        numbers = [entries.index([group.encode(), name.encode()]) for name in names.split()]
        block = b"".join(b"\x07" + number.to_bytes(2, "little") for number in numbers)
        client.ask(b"\x5d\x05")
        client.ask(b"\x5d\x06\x01" + block)
        client.ask(b"\x5d\x03\x01\x01")
        (packet,) = (said for said in client.wait(10.0) if said[0] == 0x5E)
        return list(struct.unpack(f"<{len(numbers)}f", packet[5:]))


class TestSilence:
    def test_after_half_a_second_it_levels_and_keeps_its_thrust(self, client: Client) -> None:
        client.take_off()
        client.fly(300.0, 50_000, roll=15.0)
        climbing = client.state.v_WB_W[2]
        client.wait(450.0)
        assert tilt_of(client.state.q_WB) > math.radians(12.0)
        client.wait(600.0)
        assert client.supervision is State.LEVEL_OUT
        assert tilt_of(client.state.q_WB) < math.radians(6.0)
        assert client.info & FLYING
        client.wait(600.0)
        assert client.state.v_WB_W[2] > climbing + 1.0

    def test_a_setpoint_in_time_ends_levelling_out(self, client: Client) -> None:
        client.take_off()
        client.wait(800.0)
        assert client.supervision is State.LEVEL_OUT
        client.fly(100.0, HOVER)
        assert client.supervision is State.FLYING

    def test_after_two_seconds_motors_are_off_and_it_is_locked_until_it_is_restarted(self, client: Client) -> None:
        client.take_off()
        client.wait(1950.0)
        assert not client.info & LOCKED
        client.wait(150.0)
        assert client.info & LOCKED
        assert not client.info & (CAN_FLY | ARMED | CAN_ARM)
        assert client.vehicle.body.motor_shares == (0.0,) * 4
        assert "SUP: Locked, reboot required\n" in client.text
        client.wait(5000.0)
        assert client.ask("9D 01 01") == [bytes.fromhex("9D 81 00 00")]  # arming is refused
        assert client.info & LOCKED

    def test_stop_and_silence_locks(self, client: Client) -> None:
        client.take_off(200.0)
        client.ask(STOP)
        client.wait(2500.0)
        assert client.info & LOCKED

    def test_stop_and_notify_does_not(self, client: Client) -> None:
        client.take_off(200.0)
        client.ask(STOP)
        client.ask(NOTIFY)
        client.wait(10_000.0)
        assert not client.info & LOCKED
        assert client.info & ARMED

    def test_a_zero_setpoint_after_the_notification_locks_it_after_all(self, client: Client) -> None:
        """cflib's `close_link` sends one: wait until it no longer counts as flying before closing."""
        client.take_off(200.0)
        for packet in (STOP, NOTIFY, rpyt(0)):
            client.ask(packet)
        client.wait(2500.0)
        assert client.info & LOCKED

    def test_a_zero_setpoint_after_it_has_landed_does_not(self, client: Client) -> None:
        client.take_off(200.0)
        client.ask(STOP)
        client.ask(NOTIFY)
        client.wait(2500.0)
        client.ask(rpyt(0))
        client.wait(5000.0)
        assert not client.info & LOCKED

    def test_notify_in_the_air_cuts_the_motors(self, client: Client) -> None:
        client.take_off()
        client.ask(NOTIFY)
        client.wait(100.0)
        assert client.vehicle.body.motor_shares == (0.0,) * 4
        assert client.height_m > 0.1
        assert not client.info & LOCKED

    def test_silence_on_the_ground_is_nothing(self, client: Client) -> None:
        client.unlock()
        client.wait(5000.0)
        assert client.info & ARMED
        assert not client.info & LOCKED


class TestArming:
    def test_a_brushed_vehicle_arms_by_itself(self, client: Client) -> None:
        client.wait(200.0)
        assert client.info & ARMED

    def test_a_brushless_one_waits_to_be_asked(self) -> None:
        client = Client("2.1-brushless")
        client.take_off()
        assert client.height_m == 0.0
        assert client.info & (CAN_ARM | ARMED | CAN_FLY) == CAN_ARM
        assert client.ask("9D 01 01") == [bytes.fromhex("9D 81 01 01")]
        client.take_off()
        assert client.height_m > 0.1

    def test_it_disarms_when_it_has_not_flown_for_30_seconds(self) -> None:
        client = Client("2.1-brushless")
        client.wait(200.0)
        client.ask("9D 01 01")
        client.wait(29_900.0)
        assert client.info & ARMED
        client.wait(300.0)
        assert client.info & (CAN_ARM | ARMED) == CAN_ARM

    def test_it_disarms_three_seconds_after_landing(self) -> None:
        client = Client("2.1-brushless")
        client.wait(200.0)
        client.ask("9D 01 01")
        client.take_off(200.0)
        client.fly(2500.0, 0)
        assert client.supervision is State.LANDED
        client.wait(2000.0)
        assert client.info & ARMED
        client.wait(1500.0)
        assert client.info & (CAN_ARM | ARMED) == CAN_ARM
        assert not client.info & LOCKED

    def test_from_the_ground_it_flies_again_within_those(self) -> None:
        client = Client("2.1-brushless")
        client.wait(200.0)
        client.ask("9D 01 01")
        client.take_off(200.0)
        client.fly(2500.0, 0)
        client.fly(500.0, 50_000)
        assert client.supervision is State.FLYING

    def test_disarming_in_the_air_locks(self) -> None:
        client = Client("2.1-brushless")
        client.wait(200.0)
        client.ask("9D 01 01")
        client.take_off()
        client.ask("9D 01 00")
        client.wait(200.0)
        assert client.info & LOCKED

    def test_the_time_outs_are_parameters(self) -> None:
        client = Client("2.1-brushless")
        client.wait(200.0)
        client.set("supervisor.prefltTimeout", 1000)
        client.ask("9D 01 01")
        client.wait(1200.0)
        assert not client.info & ARMED


class TestEmergencyStop:
    @pytest.mark.parametrize("packet", ["9D 03", "6D 03"], ids=["supervisor port", "localization port"])
    def test_it_stops_and_holds_until_a_reboot(self, client: Client, packet: str) -> None:
        client.take_off()
        client.ask(packet)
        client.wait(100.0)
        assert client.info & LOCKED
        assert client.vehicle.body.motor_shares == (0.0,) * 4
        client.wait(3000.0)
        client.fly(1000.0, 50_000)
        assert client.info & LOCKED

    def test_the_parameter_does_it_too(self, client: Client) -> None:
        client.take_off()
        client.set("stabilizer.stop", 1)
        client.wait(150.0)
        assert client.info & LOCKED

    @pytest.mark.parametrize("feed", ["9D 04", "6D 04"], ids=["supervisor port", "localization port"])
    def test_its_watchdog_begins_with_its_first_packet(self, client: Client, feed: str) -> None:
        client.take_off()
        client.fly(1500.0, HOVER)
        assert not client.info & LOCKED
        client.ask(feed)
        client.fly(900.0, HOVER)
        client.ask(feed)
        client.fly(900.0, HOVER)
        assert not client.info & LOCKED
        client.fly(300.0, HOVER)
        assert client.info & LOCKED


class TestTumbling:
    def test_lying_on_its_side_it_has_crashed_and_recovers_once_upright(self, client: Client) -> None:
        client.take_off(700.0)
        client.fly(800.0, 40_000, roll=95.0)
        assert client.vehicle.body.broken
        client.fly(1300.0, 40_000)
        assert client.info & (TUMBLED | CRASHED) == TUMBLED | CRASHED
        assert client.supervision is State.CRASHED
        assert client.ask("9D 02") == [bytes.fromhex("9D 82 00 00")]
        client.vehicle.body.put_upright()
        client.fly(2200.0, 0)  # until it no longer counts as flying; the last setpoint would be flown again
        assert client.info & (TUMBLED | CRASHED) == CRASHED
        assert client.ask("9D 02") == [bytes.fromhex("9D 82 01 01")]
        client.wait(200.0)
        assert client.info & (ARMED | CRASHED) == ARMED
        client.wait(15_000.0)  # until the estimate stands upright too
        client.take_off()
        assert client.height_m > 0.05

    def test_little_thrust_for_a_second_counts_as_tumbled(self) -> None:
        """The accelerometer shows less than half of g; the check can be switched off."""
        for check, crashes in ((1, True), (0, False)):
            client = Client()
            client.wait(200.0)
            client.set("supervisor.tmblChckEn", check)
            client.take_off(1500.0, 60_000)
            client.fly(1300.0, 14_000)
            assert bool(client.info & CRASHED) is crashes
            assert client.height_m > 1.0

    def test_falling_freely_does_not(self, client: Client) -> None:
        client.take_off(1500.0, 60_000)
        client.fly(1300.0, 0)
        assert client.height_m > 1.0
        assert not client.info & (TUMBLED | CRASHED)


class TestBattery:
    def test_flying_lowers_its_voltage(self, client: Client) -> None:
        before = client.vehicle.body.battery_V
        client.take_off()
        assert client.vehicle.body.battery_V < before - 0.2

    def test_a_critical_one_shuts_it_down_after_five_seconds(self) -> None:
        client = Client(battery_V=3.1)
        client.wait(200.0)
        assert client.ask("FC 00")
        client.set("pm.criticalLowVoltage", 3.5)
        client.wait(4800.0)
        assert client.ask("FC 00")
        client.wait(400.0)
        assert client.ask("FC 00") == []


class TestReboot:
    def test_it_undoes_a_lock_and_forgets_what_was_not_stored(self, client: Client) -> None:
        client.take_off(200.0)
        client.set("flightmode.stabModeYaw", 1)
        client.ask("9D 03")
        client.wait(3000.0)
        assert client.info & LOCKED
        assert client.ask("FF FE F0 01") == [bytes.fromhex("FF FE F0 01")]
        client.wait(200.0)
        assert client.info & (LOCKED | ARMED) == ARMED
        assert client.get("flightmode.stabModeYaw") == 0
        client.take_off()
        assert client.height_m > 0.05

    @pytest.mark.parametrize("off", ["FF FE 01", "FF FE 02", "FF FE F0 00"], ids=["all", "this", "boot loader"])
    def test_switched_off_it_is_silent_until_it_is_switched_on(self, client: Client, off: str) -> None:
        client.wait(200.0)
        assert client.ask(off) == [bytes.fromhex(off)]
        assert client.ask("FC 00") == []
        assert client.ask("FF FE 03") == [bytes.fromhex("FF FE 03")]
        assert client.ask("FC 00") == [bytes.fromhex("FC 00")]

    def test_switching_on_what_is_on_changes_nothing(self, client: Client) -> None:
        client.take_off()
        client.ask("FF FE 03")
        client.wait(100.0)
        assert client.info & FLYING


class TestWhatIsNotSimulated:
    @pytest.mark.parametrize(
        "packet", [b"\x7c\x07" + bytes(16), b"\x7c\x0a" + bytes(16), b"\x7c\x0b" + bytes(14) + b"\x01"]
    )
    def test_other_setpoints_are_ignored_and_it_says_so_once(self, client: Client, packet: bytes) -> None:
        client.wait(200.0)
        for _ in range(3):
            client.ask(packet)
            client.wait(20.0)
        assert client.text.count("SIM: not simulated, ignored") == 1

    def test_other_controllers_than_the_pid_do_not_fly(self, client: Client) -> None:
        client.wait(200.0)
        client.set("stabilizer.controller", 2)
        client.take_off()
        assert client.height_m == 0.0
        assert "not the PID" in client.text

    def test_rates_of_roll_and_pitch_are_ignored(self, client: Client) -> None:
        client.wait(200.0)
        client.set("flightmode.stabModeRoll", 0)
        client.take_off()
        assert client.height_m == 0.0
        assert "rates of roll and pitch" in client.text


class TestInTheAirAndOn:
    def test_it_is_deterministic(self) -> None:
        states = []
        for _ in range(2):
            client = Client(seed=3)
            client.take_off()
            client.fly(300.0, HOVER, roll=3.0, yaw=20.0)
            states.append(client.state)
        assert states[0] == states[1]

    def test_the_seed_matters(self) -> None:
        flown = []
        for seed in (1, 2):
            client = Client(seed=seed)
            client.take_off()
            flown.append(client.state)
        assert flown[0] != flown[1]
