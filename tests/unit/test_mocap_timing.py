"""Order, clock offset, lateness and rate of frames."""

from __future__ import annotations

import pytest

from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.timing import Judged, Timing, Window, added, counted_at, judged, rate_hz

MS = 1_000_000
SECOND = 1_000_000_000


def frame(sequence: int, source_ms: float, clock_id: str = "c") -> MocapFrame:
    stamp = round(source_ms * MS)
    return MocapFrame(
        body="b",
        sequence=sequence,
        frame_number=0,
        source_time_ns=stamp,
        send_time_ns=stamp,
        clock_id=clock_id,
        position=(0.0, 0.0, 0.0),
        quaternion=(0.0, 0.0, 0.0, 1.0),
    )


def run(*frames: tuple[MocapFrame, float]) -> list[Judged]:
    """Judge frames with their arrivals in ms, one after another."""
    timing: Timing | None = None
    results = []
    for one, arrival_ms in frames:
        results.append(judged(timing, one, round(arrival_ms * MS)))
        timing = results[-1].timing
    return results


def test_the_first_frame_begins_the_clock() -> None:
    (first,) = run((frame(41, 1000), 1007))
    assert first.new_clock
    assert not first.refused
    assert first.timing.offset_ns == 7 * MS


def test_frames_in_order_lose_nothing() -> None:
    _, second = run((frame(1, 10), 12), (frame(2, 20), 22))
    assert (second.refused, second.lost, second.new_clock) == ("", 0, False)


def test_gaps_in_the_sequence_are_losses() -> None:
    _, second = run((frame(1, 10), 12), (frame(5, 50), 52))
    assert second.lost == 3


@pytest.mark.parametrize(
    ("again", "reason"), [((2, 20), "duplicate"), ((1, 10), "out of order"), ((2, 10), "out of order")]
)
def test_frames_that_are_not_newer_are_refused(again: tuple[int, float], reason: str) -> None:
    *_, last = run((frame(1, 10), 12), (frame(2, 20), 22), (frame(*again), 23))
    assert last.refused == reason
    assert (last.timing.sequence, last.timing.source_ns) == (2, 20 * MS)


def test_the_offset_is_the_smallest_transit_seen() -> None:
    *_, last = run((frame(1, 0), 105), (frame(2, 10), 113), (frame(3, 20), 127))
    assert last.timing.offset_ns == 103 * MS
    assert not last.refused


@pytest.mark.parametrize(("transit_ms", "refused"), [(23.0, ""), (23.001, "late by 20 ms (limit 20 ms)")])
def test_lateness_is_counted_from_the_smallest_transit(transit_ms: float, refused: str) -> None:
    _, late = run((frame(1, 0), 3), (frame(2, 10), 10 + transit_ms))
    assert late.refused == refused


def test_a_late_frame_still_moves_the_count_on() -> None:
    *_, after = run((frame(1, 0), 3), (frame(2, 10), 60), (frame(3, 60), 63))
    assert after.lost == 0
    assert not after.refused


def test_the_offset_follows_a_drifting_clock_within_its_window() -> None:
    drifting = [(frame(n, 10.0 * n), 10.0 * n * 1.0001) for n in range(6_000)]  # 100 ppm for a minute
    results = run(*drifting)
    assert not any(r.refused for r in results)
    assert results[-1].timing.offset_ns == pytest.approx(6 * MS, abs=1.1 * MS)


def test_a_publisher_that_began_anew_goes_on_without_losses() -> None:
    *_, restarted = run((frame(900, 1000), 1001), (frame(0, 1500), 1501))
    assert (restarted.refused, restarted.lost, restarted.new_clock) == ("", 0, False)
    assert restarted.timing.sequence == 0


def test_a_source_clock_that_is_set_back_begins_a_new_time_scale() -> None:
    *_, stepped = run((frame(1, 5000), 10), (frame(2, 3000), 20))
    assert stepped.new_clock
    assert not stepped.refused
    assert stepped.timing.offset_ns == -2980 * MS


def test_a_source_clock_that_is_set_forward_is_taken_over_at_once() -> None:
    *_, stepped = run((frame(1, 10), 12), (frame(2, 3_600_020), 22))
    assert not stepped.refused
    assert stepped.timing.offset_ns == (22 - 3_600_020) * MS


def test_another_clock_begins_a_new_time_scale() -> None:
    *_, other = run((frame(5, 5000), 5001), (frame(2, 7, clock_id="rebooted"), 5011))
    assert other.new_clock
    assert other.timing.offset_ns == 5004 * MS


def test_the_rate_counts_whole_tenths_of_the_last_second() -> None:
    arrivals: Window = ()
    for n in range(300):
        arrivals = counted_at(arrivals, n * 10 * MS)
    assert rate_hz(arrivals, 3 * SECOND) == 100.0
    assert rate_hz(arrivals, 3 * SECOND - 30 * MS) == 100.0  # the tenth that has begun is left out
    assert rate_hz(arrivals, 3 * SECOND + 500 * MS) == 50.0
    assert rate_hz(arrivals, 5 * SECOND) == 0.0
    assert len(arrivals) <= 11


def test_a_window_combines_within_a_bucket_and_forgets_old_ones() -> None:
    window: Window = ()
    for bucket, value in ((1, 5), (1, 3), (2, 9), (11, 4), (12, 8)):
        window = added(window, bucket, value, min)
    assert window == ((2, 9), (11, 4), (12, 8))
