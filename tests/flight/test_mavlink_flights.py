"""Whole flights over the MAVLink link against the simulated vehicle, in virtual time: good ones, and every fault."""

from __future__ import annotations

import hashlib
import itertools
import random
from collections.abc import Callable
from pathlib import Path

import pytest
from mavlink_bench import CLOCK, Bench, Flown, bench, flight, kind_of, run

from lcd_flight.flight import director
from lcd_flight.model import Outcome, Phase, Tick, TickInputs

FLAVOURS = ["px4", "ardupilot"]

pytestmark = pytest.mark.usefixtures("own_state")


@pytest.fixture
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signing timestamps are kept here, not among the user's own; who took over gets poses for a moment only."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(director, "HANDED_OVER_S", 8.0)


SETPOINT, ODOMETRY = 82, 331
LAND = {"px4": 4 << 16 | 6 << 24, "ardupilot": 9}
PILOT = {"px4": ("posctl", "POSCTL"), "ardupilot": ("loiter", "LOITER")}

Act = Callable[[Bench, TickInputs, Tick], None]


def nothing(_made: Bench, _inputs: TickInputs, _tick: Tick) -> None:
    """Let it fly."""


def unchecked(_made: Bench, _done: Flown) -> None:
    """Leave it at the outcome."""


def flown(
    flavour: str,
    given: str = "",
    act: Act = nothing,
    check: Callable[[Bench, Flown], None] = unchecked,
    **options: object,
) -> Flown:
    """One flight; `check` may look at the bench afterwards."""
    made_flight: list[Flown] = []

    async def main() -> None:
        async with bench(flavour, **options) as made:  # type: ignore[arg-type]
            done = await flight(made, given, lambda inputs, tick: act(made, inputs, tick))
            made_flight.append(done)
            check(made, done)

    run(main)
    return made_flight[0]


class Once:
    """Does something in the first tick of a phase that has lasted for a while."""

    def __init__(self, phase: Phase, after_s: float, what: Callable[[Bench], None]) -> None:
        self.at_ns: int | None = None
        self._phase, self._after_ns, self._what = phase, round(after_s * 1e9), what
        self._since_ns: int | None = None

    def __call__(self, made: Bench, inputs: TickInputs, tick: Tick) -> None:
        if tick.phase is not self._phase or self.at_ns is not None:
            return
        self._since_ns = self._since_ns or inputs.now_ns
        if inputs.now_ns - self._since_ns >= self._after_ns:
            self.at_ns = inputs.now_ns
            self._what(made)


def switch(made: Bench, mode: str) -> None:
    """The pilot turns the mode switch."""
    pilot = made.vehicle.firmware.pilot
    pilot.request_mode(pilot.modes[mode])


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_flight_lands_and_the_autopilot_disarms_in_its_own_mode(flavour: str) -> None:
    def check(made: Bench, done: Flown) -> None:
        assert not made.armed
        assert made.mode == LAND[flavour]
        assert made.height_m < 0.02
        setpoints = [at_ns for at_ns, _ in made.air.sent(SETPOINT)]
        armed_ns = next(i.now_ns for i, t in done.listener.flight if t.phase is Phase.ARMED)
        assert min(setpoints) >= armed_ns  # nothing moves before
        landed_ns = next(i.now_ns for i, t in done.listener.flight if t.phase is Phase.LANDED)
        in_flight = [at_ns for at_ns in setpoints if armed_ns + 5e9 < at_ns < landed_ns]
        gaps_ms = {round((b - a) / 1e6) for a, b in itertools.pairwise(in_flight)}
        assert gaps_ms == {10}
        poses = [at_ns for at_ns, _ in made.air.sent(ODOMETRY)]
        assert 45 < (len(poses) - 1) / (poses[-1] - poses[0]) * 1e9 < 51

    done = flown(flavour, check=check)
    assert (done.outcome, done.reason) == (Outcome.LANDED, "")
    assert done.listener.codes == set()
    last = done.listener.flight[-1][0].link
    assert last.lost == 0
    assert last.stale == 0
    assert last.sent > 500


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_pilot_takes_over_and_nothing_is_sent_any_more(flavour: str) -> None:
    mode, name = PILOT[flavour]
    take = Once(Phase.TRACK, 0.5, lambda made: switch(made, mode))

    def check(made: Bench, _done: Flown) -> None:
        assert take.at_ns is not None
        after = [at_ns for at_ns, _ in made.air.sent(SETPOINT, take.at_ns)]
        assert max(after) - take.at_ns < 0.15e9  # 10 heartbeats a second
        commands = [data for at_ns, data in made.air.sent(76, take.at_ns) if data[10 + 28 : 10 + 30] != b"\xff\x01"]
        assert commands == []  # no change of mode, no disarming
        assert made.armed

    done = flown(flavour, act=take, check=check, rc=True)
    assert done.outcome is Outcome.ABORTED
    assert done.outcome.exit_code == 4
    assert done.reason == f"the pilot took over: mode {name}"
    assert done.listener.phases[-1] is Phase.HANDED_OVER
    assert done.reason in done.told


def test_who_switches_back_does_not_get_our_setpoints_again() -> None:
    take = Once(Phase.TRACK, 0.5, lambda made: switch(made, "loiter"))
    back: list[int] = []

    def act(made: Bench, inputs: TickInputs, tick: Tick) -> None:
        take(made, inputs, tick)
        if tick.phase is Phase.HANDED_OVER and not back:
            back.append(inputs.now_ns)
            switch(made, "guided")

    def check(made: Bench, _done: Flown) -> None:
        assert made.air.sent(SETPOINT, back[0]) == []

    assert flown("ardupilot", act=act, check=check, rc=True).outcome is Outcome.ABORTED


def test_a_pilot_who_disarms_in_the_air_is_a_crash_that_is_told() -> None:
    cut = Once(Phase.TRACK, 0.5, lambda made: made.vehicle.firmware.pilot.disarm("Disarmed by RC"))
    done = flown("px4", act=cut)
    assert done.outcome is Outcome.CRASHED
    assert "disarmed in the air, not by us" in done.told


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_silence_brakes_and_lands_by_itself_if_it_is_short(flavour: str) -> None:
    """Half a second without a word downwards: seen after 100 ms, held; the mission does not go on by itself."""

    def tampers(data: bytes, up: bool, now_ns: int) -> list[bytes]:
        return [] if not up and begins[0] <= now_ns < begins[0] + 500_000_000 else [data]

    begins = [1 << 62]

    def begin(_made: Bench) -> None:
        begins[0] = CLOCK.now_ns()

    done = flown(flavour, act=Once(Phase.TRACK, 0.5, begin), tampers=tampers)
    seen = done.first("link_age")
    assert 0.08e9 < seen.now_ns - begins[0] < 0.14e9
    assert Phase.BRAKE_HOLD in done.listener.phases
    assert done.outcome is Outcome.ABORTED


def test_a_vehicle_that_hears_nothing_any_more_lands_by_its_own_failsafe() -> None:
    """Upwards everything is lost for good; the autopilot's stream failsafe acts, and we say that it does."""

    def tampers(data: bytes, up: bool, now_ns: int) -> list[bytes]:
        return [] if up and kind_of(data) == SETPOINT and now_ns >= begins[0] else [data]

    begins = [1 << 62]

    def begin(_made: Bench) -> None:
        begins[0] = CLOCK.now_ns()

    done = flown("px4", act=Once(Phase.TRACK, 0.5, begin), tampers=tampers)
    assert done.outcome is Outcome.ABORTED
    assert "took over: mode AUTO." in done.reason
    assert "no offboard signal" in done.told


@pytest.mark.parametrize(
    ("share", "outcome"),
    [(0.01, Outcome.LANDED), (0.05, Outcome.LANDED), (0.2, Outcome.ABORTED), (0.3, Outcome.ABORTED)],
)
def test_loss_both_ways(share: float, outcome: Outcome) -> None:
    luck = random.Random(4)  # noqa: S311 - chance, not secrecy
    losing = [False]

    def tampers(data: bytes, _up: bool, _now_ns: int) -> list[bytes]:
        return [] if losing[0] and luck.random() < share else [data]

    def begin(_made: Bench) -> None:
        losing[0] = True

    done = flown("px4", act=Once(Phase.TAKEOFF, 0.1, begin), tampers=tampers)
    assert done.outcome is outcome
    assert done.listener.flight[-1][0].link.lost > 0
    measured = max(i.link.loss_share for i, t in done.listener.flight if t.phase.airborne)
    assert measured == pytest.approx(share, abs=0.1)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_duplicates_and_reorder_are_no_loss(flavour: str) -> None:
    luck = random.Random(5)  # noqa: S311 - chance, not secrecy
    held: dict[bool, list[bytes]] = {True: [], False: []}

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        if luck.random() < 0.1:
            return [data, data]
        if not held[up] and luck.random() < 0.1:
            held[up].append(data)
            return []
        late, held[up] = held[up], []
        return [data, *late]

    done = flown(flavour, tampers=tampers)
    assert done.outcome is Outcome.LANDED
    assert max(i.link.loss_share for i, t in done.listener.flight if t.phase.airborne) < 0.05
    assert done.listener.flight[-1][0].link.lost <= 2


def test_a_heartbeat_of_another_system_and_a_flood_of_rubbish_change_nothing() -> None:
    luck = random.Random(6)  # noqa: S311 - chance, not secrecy

    def act(made: Bench, _inputs: TickInputs, _tick: Tick) -> None:
        for _ in range(5):
            made.air.deliver(luck.randbytes(luck.randrange(1, 300)))
        made.air.deliver(bytes.fromhex("fd09000000070100000004000000020c5804033a63"), ("10.0.0.9", 5))

    assert flown("px4", act=act).outcome is Outcome.LANDED


def test_heartbeats_that_stay_away_are_a_lost_link_whatever_else_is_heard() -> None:
    """Without them nobody sees whether the pilot has taken over. Three of the slowest are waited for."""

    def tampers(data: bytes, up: bool, now_ns: int) -> list[bytes]:
        return [] if not up and kind_of(data) == 0 and now_ns >= begins[0] else [data]

    begins = [1 << 62]

    def begin(_made: Bench) -> None:
        begins[0] = CLOCK.now_ns()

    done = flown("px4", act=Once(Phase.TAKEOFF, 0.5, begin), tampers=tampers)
    seen = done.first("link_lost")
    assert 3.4e9 < seen.now_ns - begins[0] < 3.6e9
    assert Phase.LAND_NOW in done.listener.phases
    assert done.outcome is Outcome.ABORTED


def test_poses_go_on_to_the_pilot_who_flies_until_the_vehicle_is_disarmed() -> None:
    take = Once(Phase.TRACK, 0.5, lambda made: switch(made, "land"))

    def check(made: Bench, done: Flown) -> None:
        assert not made.armed
        assert made.height_m < 0.02
        assert take.at_ns is not None
        over_ns = next(i.now_ns for i, t in done.listener.flight if t.phase is Phase.HANDED_OVER)
        assert len(made.air.sent(ODOMETRY, over_ns)) > 50
        assert made.air.sent(SETPOINT, over_ns) == []

    done = flown("ardupilot", act=take, check=check)
    assert done.reason == "the pilot took over: mode LAND"


def test_a_restart_in_the_air_is_a_crash() -> None:
    done = flown("px4", act=Once(Phase.TRACK, 0.5, lambda made: made.vehicle.reboot()))
    assert done.outcome is Outcome.CRASHED
    assert "was restarted" in done.told


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_signed_flight_in_which_somebody_replays_and_forges(flavour: str, tmp_path: Path) -> None:
    secret = hashlib.sha256(b"test").digest()
    key = tmp_path / "key"
    key.write_text(secret.hex())
    key.chmod(0o600)
    heard: list[bytes] = []

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        if up:
            return [data]
        heard.append(data)
        again = heard[-50:-49]
        forged = [data[:-12] + b"\xff" * 6 + data[-6:]]  # from the far future
        return [*forged, data, *again]

    def check(made: Bench, _done: Flown) -> None:
        assert all(data[2] & 1 for _, data in made.air.ups)

    done = flown(flavour, f"signing=file:{key}", tampers=tampers, key=secret, check=check)
    assert done.outcome is Outcome.LANDED
    assert done.listener.flight[-1][0].link.lost == 0
