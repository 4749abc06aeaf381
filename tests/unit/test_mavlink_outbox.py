"""What may go to the vehicle, and when: the rules alone."""

from __future__ import annotations

import pytest

from drivers.mavlink.outbox import MS, Mode, Outbox

S = 1000 * MS


def goes_out(box: Outbox, stamp_ns: int, now_ns: int) -> bool:
    """Whether a setpoint may, and then does."""
    may = box.admits(stamp_ns, now_ns)
    if may:
        box.sent(stamp_ns, now_ns)
    return may


def flying(now_ns: int = 0) -> Outbox:
    box = Outbox()
    box.idle(now_ns)
    box.ready(now_ns)
    assert goes_out(box, now_ns, now_ns)
    return box


def test_nothing_before_arming() -> None:
    box = Outbox()
    assert not goes_out(box, 0, 0)
    assert not box.idles(0)
    assert not box.stops(0)
    assert box.stale == 0


def test_its_own_stream_at_the_control_rate_while_setpoints_are_not_taken() -> None:
    box = Outbox()
    box.idle(0)
    due = [at for at in range(0, 100 * MS, MS) if box.idles(at)]
    assert due == list(range(0, 100 * MS, 10 * MS))
    assert not goes_out(box, 50 * MS, 50 * MS)


def test_the_stream_goes_on_until_the_first_setpoint_and_not_after_it() -> None:
    box = Outbox()
    box.idle(0)
    assert box.idles(0)
    box.ready(5 * MS)
    assert not box.idles(9 * MS)
    assert box.idles(10 * MS)
    assert goes_out(box, 15 * MS, 15 * MS)
    assert not box.idles(20 * MS)


def test_an_armed_vehicle_that_gets_no_setpoint_is_left_alone_after_ten_seconds() -> None:
    box = Outbox()
    box.ready(0)
    assert box.idles(10 * S)
    assert not box.idles(10 * S + 20 * MS)


@pytest.mark.parametrize(("age_ms", "goes"), [(0, True), (50, True), (51, False)])
def test_a_setpoint_may_be_50_ms_old(age_ms: int, goes: bool) -> None:
    box = flying()
    assert goes_out(box, S, S + age_ms * MS) is goes
    assert box.stale == (0 if goes else 1)


def test_the_freshest_wins() -> None:
    box = flying()
    assert goes_out(box, 20 * MS, 21 * MS)
    assert not goes_out(box, 10 * MS, 22 * MS)
    assert goes_out(box, 20 * MS, 23 * MS)
    assert box.stale == 1


def test_silence_is_seen_from_100_ms_on_and_ended_by_a_fresh_setpoint() -> None:
    box = flying()
    assert not box.falls_back(100 * MS - 1)
    assert box.falls_back(100 * MS)
    assert not box.idles(100 * MS)  # nothing of its own in the air
    assert goes_out(box, 5 * S, 5 * S)
    assert not box.falls_back(5 * S)


def test_without_a_first_setpoint_there_is_no_silence() -> None:
    box = Outbox()
    box.ready(0)
    assert not box.falls_back(S)


def test_who_took_over_gets_nothing_any_more() -> None:
    box = flying()
    box.hand_over(S, to_pilot=True)
    for change in (box.idle, box.ready, box.land, box.rest, box.stop):
        change(2 * S)
        assert box.mode is Mode.HANDED_OVER
    assert not goes_out(box, 2 * S, 2 * S)
    assert not box.idles(2 * S)
    assert not box.stops(2 * S)
    assert box.over
    assert not box.latched


def test_a_stop_is_repeated_until_it_is_confirmed_and_latched() -> None:
    box = flying()
    box.stop(S)
    assert [at // MS for at in range(S, S + 160 * MS, MS) if box.stops(at)] == [1000, 1050, 1100, 1150]
    box.confirm(armed=False)
    assert not box.stops(2 * S)
    box.hand_over(2 * S, to_pilot=True)
    for change in (box.idle, box.ready, box.land, box.rest):
        change(2 * S)
        assert box.mode is Mode.STOPPED
    assert not goes_out(box, 2 * S, 2 * S)
    assert box.latched


def test_a_landing_sends_nothing_and_can_be_followed_by_another_flight() -> None:
    box = flying()
    box.land(S)
    assert not goes_out(box, S, S)
    assert not box.idles(S)
    assert not box.falls_back(2 * S)
    box.rest(3 * S)
    box.idle(4 * S)
    assert box.idles(4 * S)


def test_a_vehicle_that_is_armed_again_is_stopped_again() -> None:
    box = flying()
    box.stop(S)
    assert box.stops(S)
    box.confirm(armed=False)
    assert not box.stops(2 * S)
    box.confirm(armed=True)
    assert box.stops(3 * S)


def test_what_the_autopilot_flies_by_itself_can_be_stopped() -> None:
    box = flying()
    box.hand_over(S, to_pilot=False)
    assert not goes_out(box, S, S)
    box.stop(2 * S)
    assert box.stops(2 * S)


def test_what_may_go_out_and_does_not_is_silence() -> None:
    box = flying()
    assert box.admits(90 * MS, 90 * MS)
    assert box.falls_back(100 * MS)
