"""Whatever frames arrive, and whenever: the filter raises nothing and reports a sound state or none."""

from __future__ import annotations

import math

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lcd_flight.model import PoseOptions, PoseReport
from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.pose_filter import FilterState, PoseFilter

FUZZ = settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])

ANY = st.floats()
SMALL = st.floats(-0.02, 0.02)
VECTORS = st.tuples(ANY, ANY, ANY) | st.tuples(SMALL, SMALL, SMALL)
UNIT = st.sampled_from([(0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, -1.0), (1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.8)])
STAMPS = st.integers(0, 2_000_000_000) | st.integers(-(2**63), 2**63 - 1)

FRAMES = st.builds(
    MocapFrame,
    body=st.just("b"),
    sequence=st.integers(0, 50) | st.integers(0, 2**63 - 1),
    frame_number=st.just(0),
    source_time_ns=STAMPS,
    send_time_ns=STAMPS,
    clock_id=st.sampled_from(["c", "c", "c", "d"]),
    axes=st.sampled_from(["enu", "enu", "enu", "ned"]),
    position=VECTORS,
    quaternion=UNIT | st.tuples(ANY, ANY, ANY, ANY),
    velocity=st.none() | VECTORS,
    body_rates=st.none() | VECTORS,
    occluded=st.booleans(),
)


def check(report: PoseReport, frames: int) -> None:
    assert report.received == frames
    assert report.rejected + report.late <= frames
    if report.state is not None:
        numbers = (*report.state.p_WB, *report.state.v_WB_W, *report.state.q_WB, *report.state.w_WB_B)
        assert all(math.isfinite(number) for number in numbers)
        assert math.isclose(math.hypot(*report.state.q_WB), 1.0, rel_tol=1e-9)


@FUZZ
@given(st.lists(st.tuples(FRAMES, st.integers(0, 200_000_000)), max_size=30))
def test_any_frames_at_any_time(arrivals: list[tuple[MocapFrame, int]]) -> None:
    pose_filter, state, now_ns = PoseFilter(PoseOptions()), FilterState(), 0
    for count, (frame, wait_ns) in enumerate(arrivals, start=1):
        now_ns += wait_ns
        state = pose_filter.step(state, frame, now_ns)
        check(pose_filter.report(state, now_ns), count)
        check(pose_filter.report(state, now_ns + 50_000_000), count)


@FUZZ
@given(st.lists(st.tuples(VECTORS, VECTORS, VECTORS, st.integers(1, 30_000_000)), min_size=10, max_size=40))
def test_an_orderly_stream_of_wild_poses(poses: list[tuple[tuple[float, float, float], ...]]) -> None:
    """Count and clock are right, so that the frames get past them to the gate and the Kalman filter."""
    pose_filter, state, now_ns = PoseFilter(PoseOptions()), FilterState(), 0
    for sequence, (position, velocity, body_rates, wait_ns) in enumerate(poses):
        now_ns += wait_ns
        frame = MocapFrame(
            body="b",
            sequence=sequence,
            frame_number=0,
            source_time_ns=now_ns,
            send_time_ns=now_ns,
            clock_id="c",
            position=position,
            quaternion=(0.0, 0.0, 0.0, 1.0),
            velocity=velocity,
            body_rates=body_rates,
        )
        state = pose_filter.step(state, frame, now_ns)
        check(pose_filter.report(state, now_ns + 100_000_000), sequence + 1)
