"""The sender's rules, as scripts of times and packets. They keep people safe: each test fails without its rule."""

from __future__ import annotations

import itertools

from drivers.crazyflie import crtp_wire
from drivers.crazyflie.outbox import FALLBACK_LIMIT_NS, MS, Mode, Outbox

FALLBACK = crtp_wire.rpyt(0.0, 0.0, 10.0, 36_900)
FEED = crtp_wire.emergency_watchdog(12)
START_NS = 1_000_000 * MS


def setpoint(number: int) -> bytes:
    return crtp_wire.rpyt(float(number), 0.0, 0.0, 40_000)


class Script:
    """An outbox and a clock of milliseconds; `sent` is everything that became due, with its time."""

    def __init__(self, watchdog: bytes | None = None, pose_rate_hz: float = 100.0) -> None:
        self.box = Outbox(lambda: FALLBACK, pose_rate_hz, watchdog)
        self.ms = 0
        self.sent: list[tuple[int, bytes]] = []

    @property
    def now_ns(self) -> int:
        return START_NS + self.ms * MS

    def run(self, milliseconds: int) -> Script:
        """Look at what is due once a millisecond, as the thread does at the latest."""
        for _ in range(milliseconds):
            self.sent += [(self.ms, parcel.packet) for parcel in self.box.due(self.now_ns)]
            self.ms += 1
        return self

    def offer(self, number: int, age_ms: int = 0) -> Script:
        self.box.offer(setpoint(number), self.now_ns - age_ms * MS)
        return self

    def fly(self, milliseconds: int) -> Script:
        """As a healthy control loop."""
        for number in range(milliseconds // 10):
            self.offer(number).run(10)
        return self

    def armed(self) -> Script:
        self.box.unlock(self.now_ns)
        return self.run(100)

    def flying(self) -> Script:
        self.armed().fly(200).sent.clear()
        return self

    def packets(self) -> list[bytes]:
        return [packet for _, packet in self.sent]

    def times(self, packet: bytes) -> list[int]:
        return [ms for ms, sent in self.sent if sent == packet]


def test_nothing_goes_out_before_arming() -> None:
    assert Script().fly(500).sent == []


def test_arming_unlocks_with_zero_setpoints_at_the_control_rate_until_the_first_one_comes() -> None:
    script = Script().armed()
    assert set(script.packets()) == {crtp_wire.UNLOCK}
    assert len(script.sent) == 10
    script.sent.clear()
    assert script.offer(1).run(50).packets() == [setpoint(1)]


def test_a_setpoint_never_overtakes_the_unlocking() -> None:
    script = Script()
    script.box.unlock(script.now_ns)
    script.offer(1).run(1).offer(2).run(1)
    assert script.packets() == [crtp_wire.UNLOCK, setpoint(2)]


def test_each_setpoint_goes_out_once_and_at_once() -> None:
    script = Script().flying()
    assert script.offer(7).run(60).sent == [(300, setpoint(7))]


def test_the_freshest_wins() -> None:
    script = Script().flying()
    assert script.offer(1).offer(2).offer(3).run(5).packets() == [setpoint(3)]


def test_what_has_aged_is_not_sent_and_counted() -> None:
    script = Script().flying()
    assert script.offer(1, age_ms=51).run(5).sent == []
    assert script.box.stale == 1
    assert script.offer(2, age_ms=50).run(5).packets() == [setpoint(2)]


def test_from_100_ms_without_a_fresh_one_the_fallback_goes_out_at_the_control_rate() -> None:
    script = Script().flying()  # the last one was sent 10 ms before
    script.run(200)
    assert set(script.packets()) == {FALLBACK}
    begun = script.times(FALLBACK)[0] - 290
    assert begun == 100
    gaps = {b - a for a, b in itertools.pairwise(script.times(FALLBACK))}
    assert gaps == {10}
    assert script.box.mode is Mode.FALLBACK


def test_stale_setpoints_do_not_hold_the_fallback_off() -> None:
    script = Script().flying()
    for number in range(30):
        script.offer(number, age_ms=60).run(10)
    assert set(script.packets()) == {FALLBACK}


def test_a_fresh_setpoint_ends_the_fallback() -> None:
    script = Script().flying().run(300)
    script.sent.clear()
    script.fly(100)
    assert FALLBACK not in script.packets()
    assert script.box.mode is Mode.FLYING


def test_a_fallback_that_nobody_ends_stops_the_motors() -> None:
    script = Script().flying().run(FALLBACK_LIMIT_NS // MS + 200)
    assert script.packets()[-1] == crtp_wire.STOP
    script.sent.clear()
    assert set(script.fly(100).packets()) == {crtp_wire.STOP}


def test_the_air_is_never_silent_for_longer_than_the_fallback_takes() -> None:
    script = Script().flying()
    for pause_ms in (30, 90, 99, 300, 1500):
        script.offer(1).run(pause_ms)
    times = [ms for ms, _ in script.sent]
    assert max(b - a for a, b in itertools.pairwise(times)) <= 100


def test_an_emergency_stop_is_repeated_and_latched() -> None:
    script = Script().flying()
    script.box.stop(script.now_ns)
    script.fly(200)
    assert set(script.packets()) == {crtp_wire.STOP}
    assert len(script.sent) == 20
    for change in (script.box.unlock, script.box.end, script.box.descend):
        change(script.now_ns)
        script.sent.clear()
        assert set(script.fly(50).packets()) == {crtp_wire.STOP}
    assert script.box.latched


def test_the_end_is_stop_then_notification_then_silence() -> None:
    script = Script().flying()
    script.box.end(script.now_ns)
    script.run(100).box.rest()
    script.run(300)
    packets = script.packets()
    assert packets == [crtp_wire.STOP] * 10 + [crtp_wire.NOTIFY_STOP] * 3


def test_an_emergency_stop_ends_with_a_notification_too_and_stays_latched() -> None:
    script = Script().flying()
    script.box.stop(script.now_ns)
    script.run(50).box.rest()
    script.run(50)
    assert script.packets() == [crtp_wire.STOP] * 5 + [crtp_wire.NOTIFY_STOP] * 3
    script.sent.clear()
    script.box.unlock(script.now_ns)
    assert script.fly(100).sent == []


def test_nothing_is_told_to_a_vehicle_that_was_never_armed() -> None:
    script = Script()
    script.box.end(0)
    script.box.rest()
    assert script.run(100).sent == []


def test_a_descent_is_not_ended_by_setpoints() -> None:
    script = Script().flying()
    script.box.descend(script.now_ns)
    assert set(script.fly(300).packets()) == {FALLBACK}


def test_setpoints_are_of_one_type_from_arming_to_the_stop() -> None:
    script = Script().armed().fly(300).run(400).fly(100)
    assert {packet[0] for packet in script.packets()} == {0x3C}


def test_after_the_end_it_can_be_armed_again() -> None:
    script = Script().flying()
    script.box.end(script.now_ns)
    script.run(100).box.rest()
    script.run(50).sent.clear()
    script.armed().fly(50)
    assert script.packets()[0] == crtp_wire.UNLOCK
    assert script.packets()[-1] == setpoint(4)


def test_poses_go_out_as_they_come_with_the_newest_winning() -> None:
    script = Script()
    script.box.pose(b"old", script.now_ns)
    script.box.pose(b"new", script.now_ns + 6 * MS)
    assert script.run(5).packets() == [b"new"]


def test_poses_are_thinned_to_the_rate_that_was_asked_for_and_jitter_does_not_thin_them_further() -> None:
    for source_hz, limit_hz, expected in ((300, 100.0, 100), (100, 100.0, 100), (100, 50.0, 50), (200, 150.0, 150)):
        script, count = Script(pose_rate_hz=limit_hz), 0
        for number in range(source_hz):
            jitter_ms = (number * 7919) % 5 - 2
            script.box.pose(b"pose", START_NS + (number * 1000 // source_hz + jitter_ms) * MS)
            count += len(script.box.due(START_NS))
        assert abs(count - expected) <= 0.05 * expected, (source_hz, limit_hz, count)


def test_the_emergency_watchdog_is_fed_while_the_loop_lives_and_starves_when_it_does_not() -> None:
    script = Script(watchdog=FEED).armed().fly(1000)
    fed = script.times(FEED)
    assert all(b - a <= 110 for a, b in itertools.pairwise(fed))
    assert len(fed) >= 9
    script.sent.clear()
    script.run(1000)  # the fallback flies, the loop is dead
    assert all(ms <= 1100 + 50 for ms in script.times(FEED))


def test_it_is_fed_on_after_landing_too_since_it_cannot_be_switched_off_again() -> None:
    script = Script(watchdog=FEED).armed().fly(300)
    script.box.end(script.now_ns)
    script.run(20).box.rest()
    script.sent.clear()
    for _ in range(50):
        script.box.alive(script.now_ns)
        script.run(10)
    assert len(script.times(FEED)) >= 4


def test_without_the_policy_it_is_never_woken_and_before_arming_neither() -> None:
    assert FEED not in Script().armed().fly(500).packets()
    script = Script(watchdog=FEED)
    script.box.alive(script.now_ns)
    assert script.run(40).sent == []


def test_requests_go_out_in_order_before_setpoints() -> None:
    script = Script().flying()
    script.box.request(b"first")
    script.box.request(b"second")
    assert script.offer(1).run(1).packets() == [b"first", b"second", setpoint(1)]
