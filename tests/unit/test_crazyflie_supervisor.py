"""The firmware's supervisor by itself: how long what must last, to its 40 ms."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sim_bridge.crazyflie.supervisor import PERIOD_MS, State, Supervisor, Surroundings

AT_REST = Surroundings(
    now_ms=0,
    setpoint_ms=0,
    motors_run=False,
    acceleration_g=(0.0, 0.0, 1.0),
    stop_parameter=False,
    tumble_check=True,
    preflight_timeout_ms=30_000,
    landing_timeout_ms=3_000,
)


class Watched:
    """A supervisor and its time."""

    def __init__(self, auto_arming: bool = True) -> None:
        self.supervisor = Supervisor(auto_arming)
        self.now_ms = 0

    def live(self, duration_ms: int, *, silent_since_ms: int | None = None, **around: object) -> State:
        for _ in range(duration_ms // PERIOD_MS):
            self.now_ms += PERIOD_MS
            setpoint_ms = self.now_ms if silent_since_ms is None else silent_since_ms
            self.supervisor.update(replace(AT_REST, now_ms=self.now_ms, setpoint_ms=setpoint_ms, **around))
        return self.supervisor.state

    def time_until(self, state: State, **around: object) -> int:
        began_ms = self.now_ms
        while self.live(PERIOD_MS, **around) is not state:
            assert self.now_ms - began_ms < 60_000, f"never {state.name}"
        return self.now_ms - began_ms


@pytest.fixture
def flying() -> Watched:
    watched = Watched()
    assert watched.live(200) is State.READY_TO_FLY
    assert watched.live(200, motors_run=True) is State.FLYING
    return watched


def test_it_is_ready_four_updates_after_it_is_switched_on() -> None:
    watched = Watched()
    states = [watched.live(PERIOD_MS) for _ in range(4)]
    assert states == [State.CHECKS_NOT_PASSED, State.CHECKS_PASSED, State.READY_TO_FLY, State.READY_TO_FLY]


@pytest.mark.parametrize(
    ("up_g", "lasts_ms"),
    [(0.49, 1000), (0.0, 1000), (-0.19, 1000), (-0.21, 100), (-1.0, 100)],
)
def test_tilted_for_long_or_upside_down_for_a_moment_is_a_crash(flying: Watched, up_g: float, lasts_ms: int) -> None:
    crashed_ms = flying.time_until(State.CRASHED, motors_run=True, acceleration_g=(0.8, 0.0, up_g))
    assert lasts_ms < crashed_ms <= lasts_ms + 2 * PERIOD_MS


@pytest.mark.parametrize("acceleration_g", [(0.5, 0.0, 0.51), (0.0, 0.0, 0.0), (0.09, -0.09, -0.09)])
def test_leaning_and_falling_freely_are_none(flying: Watched, acceleration_g: tuple[float, float, float]) -> None:
    assert flying.live(5000, motors_run=True, acceleration_g=acceleration_g) is State.FLYING


def test_upright_in_between_begins_the_time_anew(flying: Watched) -> None:
    for _ in range(5):
        assert flying.live(960, motors_run=True, acceleration_g=(0.9, 0.0, 0.4)) is State.FLYING
        assert flying.live(40, motors_run=True) is State.FLYING


def test_tumbled_while_it_levels_out_locks(flying: Watched) -> None:
    silent = flying.now_ms
    assert flying.live(600, motors_run=True, silent_since_ms=silent) is State.LEVEL_OUT
    assert flying.live(400, motors_run=True, silent_since_ms=silent, acceleration_g=(0.0, 0.0, -1.0)) is State.LOCKED


def test_silence_levels_after_500_and_locks_after_2000_ms(flying: Watched) -> None:
    silent = flying.now_ms
    level_ms = flying.time_until(State.LEVEL_OUT, motors_run=True, silent_since_ms=silent)
    assert 500 < level_ms <= 500 + PERIOD_MS
    locked_ms = level_ms + flying.time_until(State.LOCKED, motors_run=True, silent_since_ms=silent)
    assert 2000 < locked_ms <= 2000 + 3 * PERIOD_MS


def test_it_has_landed_two_seconds_after_the_last_thrust(flying: Watched) -> None:
    assert 2000 - PERIOD_MS <= flying.time_until(State.LANDED) <= 2000 + PERIOD_MS


def test_tumbled_before_take_off_it_does_not_arm() -> None:
    watched = Watched(auto_arming=False)
    watched.live(1400, acceleration_g=(1.0, 0.0, 0.0))
    assert not watched.supervisor.request_arming(True)
    watched.live(200)
    assert watched.supervisor.request_arming(True)
    assert watched.live(200) is State.READY_TO_FLY
    assert watched.live(1400, acceleration_g=(1.0, 0.0, 0.0)) is State.CHECKS_NOT_PASSED
    assert not watched.supervisor.armed


def test_an_emergency_stop_on_the_ground_locks_too() -> None:
    watched = Watched()
    watched.live(200)
    assert watched.live(200, stop_parameter=True) is State.LOCKED


def test_crashed_and_stopped_it_is_locked(flying: Watched) -> None:
    flying.live(400, acceleration_g=(0.0, 0.0, -1.0))
    flying.supervisor.stop_emergency()
    assert flying.live(80, acceleration_g=(0.0, 0.0, -1.0)) is State.LOCKED
