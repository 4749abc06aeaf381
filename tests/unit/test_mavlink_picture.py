"""What is made of the vehicle's messages: texts in pieces, poses that go out, restarts, names for what is missing."""

from __future__ import annotations

import math

import pytest

from drivers.mavlink.ardupilot import ArduPilot
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.picture import Picture
from drivers.mavlink.pose_stream import PoseStream
from drivers.mavlink.px4 import Px4
from drivers.mavlink.status_text import StatusTexts
from lcd_flight.model import RawPose, Vector3
from lcd_flight.model.frames import from_yaw

MS = 1_000_000


def text(words: str, severity: int = 4, number: int = 0, piece: int = 0) -> Message:
    return mavlink.MAVLink_statustext_message(severity, words.encode(), number, piece)


class TestTexts:
    def test_a_short_one_comes_at_once(self) -> None:
        assert StatusTexts().take(text("PreArm: no position"), 0) == ["warning: PreArm: no position"]

    def test_pieces_are_put_together_whatever_their_order(self) -> None:
        texts, long = StatusTexts(), "a" * 50 + "b" * 50 + "c"
        assert texts.take(text(long[:50], number=7, piece=0), 0) == []
        assert texts.take(text(long[50:100], number=7, piece=1), MS) == []
        assert texts.take(text(long[100:], number=7, piece=2), 2 * MS) == [f"warning: {long}"]

    def test_a_piece_that_never_comes_is_waited_for_no_longer_than_a_second(self) -> None:
        texts = StatusTexts()
        texts.take(text("x" * 50, number=7, piece=0), 0)
        assert texts.overdue(900 * MS) == []
        assert texts.overdue(1_100 * MS) == ["warning: " + "x" * 50]
        assert texts.overdue(5_000 * MS) == []

    def test_another_text_ends_an_unfinished_one(self) -> None:
        texts = StatusTexts()
        texts.take(text("x" * 50, number=7, piece=0), 0)
        assert texts.take(text("short", number=8, piece=0), MS) == ["warning: " + "x" * 50, "warning: short"]

    def test_endless_pieces_are_cut(self) -> None:
        texts, told = StatusTexts(), []
        for piece in range(100):
            told += texts.take(text("y" * 50, number=1, piece=piece), piece)
        assert max(map(len, told)) <= 16 * 50 + 20

    def test_what_cannot_be_printed_is_not(self) -> None:
        assert StatusTexts().take(text("\x1b[2Jboo"), 0) == ["warning: ?[2Jboo"]

    def test_refusals_quote_complaints_of_the_last_seconds(self) -> None:
        texts = StatusTexts()
        texts.take(text("old"), 0)
        texts.take(text("Arming denied", 2), 20_000 * MS)
        texts.take(text("nice weather", 6), 20_001 * MS)
        texts.take(text("Arming denied", 2), 20_002 * MS)
        assert texts.recent(20_003 * MS) == '"Arming denied"'
        assert texts.recent(40_000 * MS) == ""


class TestPoses:
    def raw(self, n: int, p_WB: Vector3 | None = None, period_ms: float = 10.0) -> RawPose:
        at_ns = round(n * period_ms * MS)
        return RawPose(n, at_ns - 4 * MS, at_ns, p_WB or (0.01 * n, 0.0, 0.0), from_yaw(0.005 * n))

    @pytest.mark.parametrize(
        ("rate_hz", "period_ms"), [(50.0, 10.0), (30.0, 10.0), (40.0, 10.0), (50.0, 5.0), (50.0, 30.0)]
    )
    def test_no_more_than_asked_for_and_no_fewer_than_there_are(self, rate_hz: float, period_ms: float) -> None:
        stream = PoseStream(rate_hz)
        count = sum(stream.take(self.raw(n, period_ms=period_ms)) is not None for n in range(1000))
        expected = min(rate_hz, 1000.0 / period_ms) * period_ms
        assert count == pytest.approx(expected, rel=0.02)

    def test_velocity_and_rates_by_differences(self) -> None:
        stream = PoseStream(50.0)
        sent = [odometry for n in range(20) if (odometry := stream.take(self.raw(n)))]
        assert sent[0].v_WB_W == (0.0, 0.0, 0.0)
        assert sent[-1].v_WB_W == pytest.approx((1.0, 0.0, 0.0))
        assert sent[-1].w_WB_B == pytest.approx((0.0, 0.0, 0.5), abs=1e-6)
        assert sent[-1].stamp_ns == 180 * MS

    def test_the_sources_own_twist_goes_first(self) -> None:
        raw = RawPose(0, 0, 0, (0.0, 0.0, 0.0), from_yaw(0.0), (1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
        found = PoseStream(50.0).take(raw)
        assert found is not None
        assert (found.v_WB_W, found.w_WB_B) == ((1.0, 2.0, 3.0), (0.1, 0.2, 0.3))

    def test_a_jump_and_a_gap_are_told_by_the_counter(self) -> None:
        stream = PoseStream(50.0)
        for n in range(10):
            stream.take(self.raw(n))
        jumped = stream.take(self.raw(10, (5.0, 0.0, 0.0)))
        assert jumped is not None
        assert jumped.resets == 1
        assert jumped.v_WB_W == (0.0, 0.0, 0.0)  # not the jump's
        after_gap = stream.take(self.raw(100, (5.0, 0.0, 0.0)))
        assert after_gap is not None
        assert after_gap.resets == 2


class TestPicture:
    def attitude(self, boot_ms: int, q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> Message:
        return mavlink.MAVLink_attitude_quaternion_message(boot_ms, *q, 0.0, 0.0, 0.0)

    def test_a_clock_that_goes_back_is_a_restart(self) -> None:
        picture = Picture("enu")
        for boot_ms in (5_000, 5_020, 5_010):
            picture.take(self.attitude(boot_ms), 0)
        assert picture.restarts == 0
        picture.take(self.attitude(40), 0)
        assert picture.restarts == 1
        telemetry = picture.telemetry(now_ns=0, lost=False)
        assert telemetry is not None
        assert telemetry.messages == ("the autopilot was restarted",)

    def test_a_vehicle_that_talks_without_end_does_not_fill_the_memory(self) -> None:
        picture = Picture("enu")
        for n in range(1_000):
            picture.take(text(f"text {n}", 6), 0)
        telemetry = picture.telemetry(now_ns=0, lost=False)
        assert telemetry is not None
        assert len(telemetry.messages) == 100
        assert telemetry.messages[-1] == "info: text 999"

    def test_an_attitude_that_is_none_yet(self) -> None:
        picture = Picture("enu")
        picture.take(self.attitude(1, (math.nan,) * 4), 0)
        assert picture.q_WB is None

    def test_text_is_told_once_and_nothing_before_the_first_message(self) -> None:
        picture = Picture("enu")
        assert picture.telemetry(now_ns=0, lost=False) is None
        picture.take(text("hello", 6), 0)
        first, second = (picture.telemetry(now_ns=0, lost=False) for _ in range(2))
        assert first is not None
        assert second is not None
        assert (first.messages, second.messages) == (("info: hello",), ())

    @pytest.mark.parametrize(("millivolts", "volts"), [(0, None), (65535, None), (11_700, 11.7)])
    def test_a_battery_that_is_not_measured_is_not_reported(self, millivolts: int, volts: float | None) -> None:
        picture = Picture("enu")
        picture.take(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, millivolts, -1, -1, 0, 0, 0, 0, 0, 0), 0)
        assert picture.battery_V == (None if volts is None else pytest.approx(volts))

    def test_accelerometers_of_px4(self) -> None:
        picture = Picture("enu")
        picture.take(mavlink.MAVLink_highres_imu_message(0, 1.0, 2.0, -9.8, *(0.0,) * 10, 0), 0)
        assert picture.specific_force_B == (1.0, -2.0, 9.8)

    def test_accelerometers_of_ardupilot(self) -> None:
        picture = Picture("enu")
        picture.take(mavlink.MAVLink_raw_imu_message(0, 0, 100, -1000, *(0,) * 6), 0)
        assert picture.specific_force_B == pytest.approx((0.0, -0.981, 9.81))

    @pytest.mark.parametrize(
        ("state", "failsafe", "terminated"), [(4, False, False), (5, True, False), (8, True, True)]
    )
    def test_failsafes(self, state: int, failsafe: bool, terminated: bool) -> None:
        picture = Picture("enu")
        picture.take(mavlink.MAVLink_heartbeat_message(2, 12, 129, 0, state, 3), 0)
        assert (picture.failsafe, picture.terminated) == (failsafe, terminated)


class TestFlavours:
    def test_modes_of_px4(self) -> None:
        names = {6 << 16: "OFFBOARD", 3 << 16: "POSCTL", 4 << 16 | 6 << 24: "AUTO.LAND", 4 << 16 | 77 << 24: "AUTO.77"}
        assert {mode: Px4().mode_name(mode) for mode in names} == names

    def test_modes_of_ardupilot(self) -> None:
        names = {4: "GUIDED", 20: "GUIDED_NOGPS", 9: "LAND", 99: "99"}
        assert {mode: ArduPilot().mode_name(mode) for mode in names} == names
        assert ArduPilot("guided_nogps").flight_mode == 20

    def test_what_an_estimator_lacks_is_named(self) -> None:
        assert ArduPilot().estimate_objection(0x33F) == ""
        assert ArduPilot().estimate_objection(0x87) == (
            "no pos horiz rel, pos horiz abs, pos vert abs, pred pos horiz rel, pred pos horiz abs; const pos mode"
        )
        assert "does not report" in ArduPilot().estimate_objection(None)
        assert Px4().estimate_objection(0x2F) == ""
        assert Px4().estimate_objection(0x27) == "no pos horiz rel"

    @pytest.mark.parametrize("value", [0.0, 15.0, -1.0, 2_000_000_000.0, 8388609.0])
    def test_integers_of_px4_keep_their_bits(self, value: float) -> None:
        wire = Px4().value_to(value, mavlink.MAV_PARAM_TYPE_INT32)
        assert Px4().value_from(wire, mavlink.MAV_PARAM_TYPE_INT32) == value
