"""The pose filter's rules, frame by frame: what is believed, what is rejected and why, what is coasted over."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from lcd_flight.model import MocapAxes, PoseOptions, PoseReport, Vector3
from lcd_flight.model.frames import angle_between, from_yaw
from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.pose_filter import CONFIRMING_FRAMES, LOSING_REJECTS, FilterState, PoseFilter

MS = 1_000_000
PERIOD_NS = 10 * MS


class Stream:
    """A camera system watching one body fly along x at 1 m/s, turning at 0.5 rad/s; its clock is 5 s ahead."""

    def __init__(self, options: PoseOptions | None = None) -> None:
        self.filter = PoseFilter(options or PoseOptions())
        self.state = FilterState()
        self.n = 0

    @property
    def now_ns(self) -> int:
        return self.n * PERIOD_NS + MS

    def frame(self, **changes: Any) -> MocapFrame:
        stamp = self.n * PERIOD_NS + 5_000 * MS
        truth = MocapFrame(
            body="b",
            sequence=self.n,
            frame_number=self.n,
            source_time_ns=stamp,
            send_time_ns=stamp,
            clock_id="c",
            position=(0.01 * self.n, 0.0, 1.0),
            quaternion=from_yaw(0.005 * self.n),
        )
        return msgspec.structs.replace(truth, **changes)

    def give(self, count: int = 1, **changes: Any) -> PoseReport:
        """The next frames, each a millisecond under way, with some fields changed."""
        for _ in range(count):
            self.n += 1
            self.state = self.filter.step(self.state, self.frame(**changes), self.now_ns)
        return self.report()

    def miss(self, count: int = 1) -> None:
        """Frames that never come."""
        self.n += count

    def report(self, later_ns: int = 0) -> PoseReport:
        return self.filter.report(self.state, self.now_ns + later_ns)


@pytest.fixture
def flying() -> Stream:
    stream = Stream()
    stream.give(50)
    return stream


def position(report: PoseReport) -> Vector3:
    assert report.state is not None
    return report.state.p_WB


def test_nothing_is_known_before_the_first_frame() -> None:
    assert Stream().report() == PoseReport(state=None, age_ns=None)


def test_a_pose_is_believed_once_enough_frames_fitted_one_another() -> None:
    stream = Stream()
    early = stream.give(CONFIRMING_FRAMES - 1)
    assert (early.state, early.age_ns, early.raw) == (None, None, None)
    report = stream.give()
    assert position(report) == pytest.approx((0.05, 0.0, 1.0), abs=2e-3)
    assert report.age_ns == 0
    assert (report.received, report.rejected, report.lost, report.late) == (5, 0, 0, 0)


def test_twist_is_estimated_from_poses(flying: Stream) -> None:
    state = flying.report().state
    assert state is not None
    assert state.v_WB_W == pytest.approx((1.0, 0.0, 0.0), abs=0.02)
    assert state.w_WB_B == pytest.approx((0.0, 0.0, 0.5), abs=0.02)


def test_the_pose_is_brought_forward_to_the_tick(flying: Stream) -> None:
    report = flying.report(later_ns=7 * MS)
    assert report.age_ns == 7 * MS
    assert position(report)[0] == pytest.approx(0.50 + 0.007, abs=1e-3)
    assert report.state is not None
    assert angle_between(report.state.q_WB, from_yaw(0.25 + 0.0035)) < 1e-3
    assert report.raw is not None
    assert report.raw.p_WB == (0.5, 0.0, 1.0)


def test_transit_beyond_the_least_counts_as_age_of_the_pose(flying: Stream) -> None:
    flying.n += 1
    flying.state = flying.filter.step(flying.state, flying.frame(), flying.now_ns + 8 * MS)
    report = flying.report(later_ns=8 * MS)
    assert report.age_ns == 0
    assert position(report)[0] == pytest.approx(0.51 + 0.008, abs=1e-3)


@pytest.mark.parametrize(("gap_ms", "valid"), [(99, True), (100, True), (101, False)])
def test_a_gap_is_coasted_over_for_a_tenth_of_a_second(flying: Stream, gap_ms: int, *, valid: bool) -> None:
    report = flying.report(later_ns=gap_ms * MS)
    assert (report.state is not None) == valid
    assert report.age_ns == gap_ms * MS
    if valid:
        assert position(report)[0] == pytest.approx(0.5 + 1e-3 * gap_ms, abs=0.01)


def test_after_a_short_gap_the_pose_is_back_at_once(flying: Stream) -> None:
    flying.miss(30)
    assert flying.report().state is None
    report = flying.give()
    assert position(report)[0] == pytest.approx(0.81, abs=2e-3)
    assert report.lost == 30


def test_after_a_long_gap_the_pose_is_believed_anew(flying: Stream) -> None:
    flying.miss(51)
    assert flying.give(CONFIRMING_FRAMES - 1).state is None
    assert flying.give().state is not None


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"position": (0.51, 0.16, 1.0)}, "jump of 0.16 m in 10 ms (limit 0.15 m)"),
        ({"quaternion": from_yaw(0.25 + math.radians(31.0))}, "flip of 31 deg in 10 ms (limit 30 deg)"),
        ({"quaternion": (1.0, 0.0, 0.0, 0.0)}, "flip of 180 deg in 10 ms (limit 30 deg)"),
        ({"position": (math.nan, 0.0, 1.0)}, "position not finite, or beyond 1000 m"),
        ({"position": (math.inf, 0.0, 1.0)}, "position not finite, or beyond 1000 m"),
        ({"position": (0.5, 0.0, 1e6)}, "position not finite, or beyond 1000 m"),
        ({"quaternion": (0.0, 0.0, 0.0, 0.0)}, "quaternion is not of unit length (0.000)"),
        ({"quaternion": (0.0, 0.0, 0.0, 1.02)}, "quaternion is not of unit length (1.020)"),
        ({"quaternion": (math.nan, 0.0, 0.0, 1.0)}, "quaternion is not of unit length (nan)"),
        ({"velocity": (0.0, math.nan, 0.0)}, "velocity not finite, or beyond 100 m/s"),
        ({"body_rates": (0.0, 0.0, 1e9)}, "body rates not finite, or beyond 200 rad/s"),
        ({"occluded": True}, "occluded"),
        ({"axes": "ned"}, "frame is ned, the mission expects enu"),
    ],
)
def test_a_bad_frame_is_rejected_and_the_good_ones_carry_on(
    flying: Stream, changes: dict[str, Any], reason: str
) -> None:
    report = flying.give(**changes)
    assert (report.rejected, report.reject_reason) == (1, reason)
    assert position(report)[0] == pytest.approx(0.51, abs=2e-3)
    assert report.age_ns == PERIOD_NS
    after = flying.give()
    assert after.age_ns == 0
    assert after.rejected == 1
    assert position(after)[0] == pytest.approx(0.52, abs=2e-3)


@pytest.mark.parametrize(
    "changes",
    [
        {"position": (0.51, 0.14, 1.0)},
        {"quaternion": from_yaw(0.25 + math.radians(29.0))},
        {"quaternion": (0.0, 0.0, 0.0, 0.995)},
    ],
)
def test_a_frame_just_within_the_gate_is_taken(flying: Stream, changes: dict[str, Any]) -> None:
    assert flying.give(**changes).rejected == 0


def test_the_gate_widens_with_the_time_since_the_last_frame(flying: Stream) -> None:
    flying.miss(9)
    report = flying.give(position=(0.5, 1.0, 1.0), quaternion=from_yaw(0.25 + math.radians(80.0)))
    assert report.rejected == 0


def test_the_greatest_speed_is_an_option() -> None:
    stream = Stream(PoseOptions(max_speed_m_s=1.0))
    stream.give(20)
    assert stream.give(position=(0.21, 0.07, 1.0)).reject_reason == "jump of 0.07 m in 10 ms (limit 0.06 m)"


def test_a_frozen_source_is_noticed_at_the_third_frame(flying: Stream) -> None:
    same = {"position": (0.51, 0.0, 1.0), "quaternion": from_yaw(0.255)}
    assert flying.give(2, **same).rejected == 0
    report = flying.give(**same)
    assert (report.rejected, report.reject_reason) == (1, "frozen: the very same pose 3 times")


def test_a_source_that_stays_frozen_is_lost_and_never_believed(flying: Stream) -> None:
    report = flying.give(100, position=(0.51, 0.0, 1.0), quaternion=from_yaw(0.255))
    assert report.state is None
    assert report.rejected == 98
    assert flying.give(CONFIRMING_FRAMES).state is not None


def test_too_many_rejects_in_a_row_are_a_loss(flying: Stream) -> None:
    assert flying.give(LOSING_REJECTS - 1, occluded=True).state is not None
    report = flying.give(occluded=True)
    assert report.state is None
    assert report.rejected == LOSING_REJECTS


def test_rejects_that_are_not_in_a_row_are_no_loss(flying: Stream) -> None:
    for _ in range(4):
        flying.give(LOSING_REJECTS - 1, occluded=True)
        flying.give()
    assert flying.report().state is not None


def test_a_body_that_was_carried_elsewhere_is_believed_anew(flying: Stream) -> None:
    for _ in range(LOSING_REJECTS + CONFIRMING_FRAMES - 1):
        report = flying.give(position=(7.0 + 0.01 * flying.n, 3.0, 1.0))
    assert report.state is None
    assert report.rejected == LOSING_REJECTS
    assert position(flying.give(position=(7.0 + 0.01 * flying.n, 3.0, 1.0)))[0] == pytest.approx(7.59, abs=0.02)


def test_poses_that_jump_to_and_fro_are_never_believed() -> None:
    stream = Stream()
    for n in range(100):
        assert stream.give(position=(float(n % 2), 0.0, 1.0)).state is None


def test_duplicates_and_frames_out_of_order_change_nothing(flying: Stream) -> None:
    before = flying.report()
    for frame in (flying.frame(), flying.frame(sequence=3, source_time_ns=30 * MS, position=(9.0, 9.0, 9.0))):
        flying.state = flying.filter.step(flying.state, frame, flying.now_ns)
    after = flying.report()
    assert (after.received, after.late, after.reject_reason) == (52, 2, "out of order")
    assert (after.state, after.raw, after.rejected) == (before.state, before.raw, 0)


def test_a_late_frame_is_dropped(flying: Stream) -> None:
    flying.n += 1
    flying.state = flying.filter.step(flying.state, flying.frame(), flying.now_ns + 25 * MS)
    report = flying.report(later_ns=25 * MS)
    assert (report.late, report.reject_reason, report.age_ns) == (1, "late by 25 ms (limit 20 ms)", 35 * MS)


def test_a_backlog_after_a_stall_of_the_host_is_taken_from_the_first_frame_that_is_fresh(flying: Stream) -> None:
    began = flying.n
    for n in range(began + 1, began + 6):
        flying.n = n
        arrival_ns = (began + 5) * PERIOD_NS + MS
        flying.state = flying.filter.step(flying.state, flying.frame(), arrival_ns)
    report = flying.report()
    assert report.late == 2
    assert report.lost == 0
    assert position(report)[0] == pytest.approx(0.55, abs=2e-3)


def test_the_sign_of_the_quaternion_goes_on_smoothly(flying: Stream) -> None:
    before = flying.report().state
    x, y, z, w = from_yaw(0.255)
    after = flying.give(quaternion=(-x, -y, -z, -w))
    assert before is not None
    assert after.state is not None
    assert after.raw is not None
    assert sum(a * b for a, b in zip(before.q_WB, after.state.q_WB, strict=True)) > 0.99
    assert after.raw.q_WB == pytest.approx((x, y, z, w))


def test_a_source_clock_that_is_set_back_is_believed_anew(flying: Stream) -> None:
    report = flying.give(source_time_ns=0)
    assert report.state is None
    assert report.reject_reason == "the source's clock began anew"


def test_a_restarted_publisher_interrupts_nothing(flying: Stream) -> None:
    report = flying.give(sequence=0)
    assert report.state is not None
    assert (report.lost, report.rejected, report.late) == (0, 0, 0)


def test_the_rate_is_that_of_accepted_frames(flying: Stream) -> None:
    flying.give(100)
    assert flying.report().rate_hz == pytest.approx(100.0, abs=1.0)
    for _ in range(50):
        flying.give()
        flying.give(occluded=True)
    assert flying.report().rate_hz == pytest.approx(50.0, abs=1.0)


def test_bytes_that_were_no_frame_are_counted_as_rejects(flying: Stream) -> None:
    state = flying.filter.malformed(flying.state, "not a mocap frame: cut")
    report = flying.filter.report(state, flying.now_ns)
    assert (report.received, report.rejected, report.reject_reason) == (51, 1, "not a mocap frame: cut")


@pytest.mark.parametrize("axes", ["ned", "y_up"])
def test_other_axes_arrive_in_our_world(axes: MocapAxes) -> None:
    stream = Stream(PoseOptions(axes=axes))
    given = {"ned": (2.0, 1.0, -3.0), "y_up": (1.0, 3.0, -2.0)}[axes]
    for n in range(CONFIRMING_FRAMES):
        stream.give(axes=axes, position=(given[0] + 1e-6 * n, *given[1:]), quaternion=(0.0, 0.0, 0.0, 1.0))
    assert position(stream.report()) == pytest.approx((1.0, 2.0, 3.0), abs=1e-3)


def test_a_step_is_pure(flying: Stream) -> None:
    state = flying.state
    copy = replace(state)
    one = flying.filter.step(state, flying.frame(sequence=51, source_time_ns=10**12), 10**12)
    assert state == copy
    assert flying.filter.step(state, flying.frame(sequence=51, source_time_ns=10**12), 10**12) == one
    assert PoseFilter(PoseOptions()).report(state, 10**9) == flying.filter.report(state, 10**9)
