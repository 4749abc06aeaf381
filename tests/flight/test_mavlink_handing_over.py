"""After a hand-over: poses go on for who flies, the operator is heard, and may stop what no pilot flies."""

from __future__ import annotations

import asyncio
import io
import signal
from collections.abc import Callable

import pytest
from mavlink_bench import CLOCK, Bench, Flown, bench, flight, kind_of, level, run, stream, wait_s
from mavlink_specification import packet

from drivers.mavlink.codec import Codec
from lcd_flight.flight import director
from lcd_flight.flight.operator import Operator
from lcd_flight.model import Command, Outcome, Phase, RefusedError, Tick, TickInputs
from sim_bridge.mavlink.vocabulary import Result

SETPOINT, ODOMETRY, COMMAND = 82, 331, 76
ARM, SET_MODE = 400, 176
PILOT = "the pilot took over: mode POSCTL"

Acts = Callable[[Bench, Operator, float], None]
"""Told once a tick of the seconds since the vehicle was handed over."""


class Scene:
    """A PX4 that is handed over after a second of its mission, to a pilot or to its own failsafe."""

    def __init__(self, acts: Acts, *, to_pilot: bool) -> None:
        self.operator = Operator(io.StringIO())
        self.over_ns = 0
        """When the tick saw it."""
        self.commands: list[float] = []
        """First parameters of the orders to arm or disarm since then."""
        self.poses_s = 0.0
        """So long poses went on."""
        self.armed = True
        """When the link had closed."""
        self._acts, self._to_pilot = acts, to_pilot
        self._mute = False

    def fly(self) -> Flown:
        """The whole flight."""
        done: list[Flown] = []

        async def main() -> None:
            async with bench(rc=True, tampers=self._tampers) as made:
                done.append(await flight(made, "", lambda inputs, tick: self._act(made, inputs, tick), self.operator))
                self._look(made)

        run(main)
        return done[0]

    def _tampers(self, data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        return [] if up and self._mute and kind_of(data) == SETPOINT else [data]

    def _act(self, made: Bench, inputs: TickInputs, tick: Tick) -> None:
        if tick.phase is Phase.TRACK and tick.leg_time_s > 0.5:
            if self._to_pilot:
                switch(made, "posctl")
            else:
                self._mute = True
        if tick.phase is Phase.HANDED_OVER:
            self.over_ns = self.over_ns or inputs.now_ns
            self._acts(made, self.operator, (inputs.now_ns - self.over_ns) * 1e-9)

    def _look(self, made: Bench) -> None:
        self.commands = orders(made, ARM, self.over_ns)
        self.poses_s = (made.air.sent(ODOMETRY)[-1][0] - self.over_ns) * 1e-9
        self.armed = made.armed
        assert CLOCK.now_ns() - made.air.sent(ODOMETRY)[-1][0] < 1.2e9  # nothing waits without poses


def switch(made: Bench, mode: str) -> None:
    pilot = made.vehicle.firmware.pilot
    pilot.request_mode(pilot.modes[mode])


def once(at_s: float, what: Callable[[Bench, Operator], None]) -> Acts:
    """Does something so long after the hand-over."""
    done: list[bool] = []

    def acts(made: Bench, operator: Operator, since_s: float) -> None:
        if since_s >= at_s and not done:
            done.append(True)
            what(made, operator)

    return acts


def stop(_made: Bench, operator: Operator) -> None:
    """The space bar."""
    operator._pressed.append(Command.STOP_MOTORS)


def interrupt(_made: Bench, operator: Operator) -> None:
    operator.interrupt()


def terminate(_made: Bench, operator: Operator) -> None:
    operator._on_terminate(signal.SIGTERM, None)


@pytest.mark.parametrize("ending", [interrupt, terminate])
@pytest.mark.parametrize("to_pilot", [True, False])
def test_who_interrupts_ends_the_poses_at_once_and_is_told(
    ending: Callable[[Bench, Operator], None], to_pilot: bool
) -> None:
    scene = Scene(once(1.0, ending), to_pilot=to_pilot)
    done = scene.fly()
    assert 0.9 < scene.poses_s < 1.1
    assert done.outcome is Outcome.ABORTED
    assert done.outcome.exit_code == 4
    assert done.notes == (f"{done.reason}; interrupted: its poses stop, and it is still armed",)
    assert scene.commands == []
    assert scene.armed


def test_an_interrupt_from_before_does_not_end_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(director, "HANDED_OVER_S", 3.0)

    scene = Scene(lambda *_: None, to_pilot=True)
    scene.operator.interrupt()
    scene.operator()  # the flight has read it
    done = scene.fly()
    assert 2.9 < scene.poses_s < 3.1
    assert done.notes == (f"{PILOT}; 3 s are over: its poses stop, and it is still armed",)


def test_a_terminal_that_goes_away_does_not_end_them() -> None:
    def what(made: Bench, operator: Operator, since_s: float) -> None:
        hang_up(made, operator, since_s)
        disarm(made, operator, since_s)

    hang_up = once(0.5, lambda _, operator: operator._on_terminate(signal.SIGHUP, None))
    disarm = once(2.0, lambda made, _: made.vehicle.firmware.pilot.disarm("Disarmed by RC"))
    scene = Scene(what, to_pilot=True)
    done = scene.fly()
    assert 1.9 < scene.poses_s < 2.2
    assert done.notes == ()


def test_the_operator_stops_what_its_own_failsafe_flies() -> None:
    scene = Scene(once(0.5, stop), to_pilot=False)
    done = scene.fly()
    assert done.listener.phases[-2:] == [Phase.HANDED_OVER, Phase.KILL]
    assert not scene.armed
    assert scene.commands
    assert (done.outcome, done.reason) == (Outcome.CUT, "the operator stopped the motors")


def test_a_third_interrupt_stops_it_too() -> None:
    scene = Scene(once(0.5, interrupt), to_pilot=False)
    scene.operator.interrupt()
    scene.operator.interrupt()
    scene.operator()
    done = scene.fly()
    assert not scene.armed
    assert done.outcome is Outcome.CUT


def test_the_operator_does_not_stop_what_a_pilot_flies_and_is_told_why() -> None:
    def what(made: Bench, operator: Operator, since_s: float) -> None:
        press(made, operator, since_s)
        leave(made, operator, since_s)

    press, leave = once(0.5, stop), once(1.0, interrupt)
    scene = Scene(what, to_pilot=True)
    done = scene.fly()
    assert scene.commands == []
    assert scene.armed
    assert done.outcome.exit_code == 4
    told = [f.message for _, t in done.listener.flight for f in t.findings if f.code == "operator_stop"]
    assert told == [f"not sent ({PILOT}): the operator stopped the motors"]


def test_a_pilot_who_takes_it_from_its_failsafe_has_it() -> None:
    def what(made: Bench, operator: Operator, since_s: float) -> None:
        for act in acts:
            act(made, operator, since_s)

    acts = [once(0.5, lambda made, _: switch(made, "posctl")), once(1.0, stop), once(1.5, interrupt)]
    scene = Scene(what, to_pilot=False)
    done = scene.fly()
    assert scene.commands == []
    assert scene.armed
    assert "by itself" in done.reason
    assert PILOT in done.told
    assert done.notes == (f"{PILOT}; interrupted: its poses stop, and it is still armed",)


def unacknowledged(*commands: int) -> Callable[[bytes, bool, int], list[bytes]]:
    """Acknowledgements of some commands are lost."""

    def tampers(data: bytes, up: bool, _now_ns: int) -> list[bytes]:
        lost = not up and kind_of(data) == 77 and int.from_bytes(data[10:12], "little") in commands
        return [] if lost else [data]

    return tampers


def orders(made: Bench, command: int, since_ns: int = 0) -> list[float]:
    """First parameters of the commands of one kind."""
    sent = b"".join(data for _, data in made.air.sent(COMMAND, since_ns))
    return [m.param1 for m in Codec(1, 1).decode(bytearray(sent)) if m.command == command]


def test_a_landing_whose_acknowledgement_is_lost_is_not_taken_from_the_pilot() -> None:
    """He switches between two attempts."""

    async def main() -> None:
        async with bench(rc=True, tampers=unacknowledged(SET_MODE)) as made:
            link = made.link()
            await link.__aenter__()
            await link.arm()
            while made.height_m < 1.0:
                await stream(link, level(1.15), 0.05)
            leaving_ns, leaving = CLOCK.now_ns(), asyncio.create_task(link.__aexit__(None, None, None))
            await wait_s(0.25)  # LAND has been seen in a heartbeat
            switch(made, "posctl")
            await wait_s(3.0)
            assert len(orders(made, SET_MODE, leaving_ns)) == 1
            assert made.mode == made.vehicle.firmware.pilot.modes["posctl"]
            made.vehicle.firmware.pilot.disarm()
            await leaving

    run(main)


def test_what_was_armed_and_disarmed_by_the_pilot_is_not_armed_again() -> None:
    """The acknowledgement is lost; the heartbeat has shown it armed."""

    async def main() -> None:
        async with bench(rc=True, tampers=unacknowledged(ARM)) as made, made.link() as link:
            arming = asyncio.create_task(link.arm())
            while not made.armed:
                await wait_s(0.004)
            await wait_s(0.15)
            made.vehicle.firmware.pilot.disarm("Disarmed by RC")
            with pytest.raises(RefusedError):
                await arming
            assert orders(made, ARM) == [1.0]
            assert not made.armed

    run(main)


def test_an_autopilot_that_is_in_progress_for_ever_does_not_keep_the_link_from_closing() -> None:
    told = {"command": SET_MODE, "result": 5, "target_system": 245, "target_component": 191}

    async def main() -> None:
        async with bench(tampers=unacknowledged(SET_MODE)) as made:
            link = made.link()
            await link.__aenter__()
            await link.arm()
            await stream(link, level(0.4), 0.3)
            pilot = made.vehicle.firmware.pilot
            pilot.request_mode = lambda _mode: Result.ACCEPTED  # type: ignore[method-assign]
            closing_ns, closing = CLOCK.now_ns(), asyncio.create_task(link.__aexit__(None, None, None))
            while not closing.done() and CLOCK.now_ns() - closing_ns < 60e9:
                await wait_s(0.2)
                made.air.deliver(packet("COMMAND_ACK", told, 0, (1, 1)))
            assert closing.done()
            assert CLOCK.now_ns() - closing_ns < 20e9
            assert not made.armed

    run(main)
