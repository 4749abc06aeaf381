"""The loop around the tick: reads pose and link at 100 Hz, ticks, sends, tells the observers.

It decides nothing. Whoever drives the flight (`session`) gives it commands and waits for phases.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.rate import RateKeeper, Wake
from lcd_flight.flight.result import LoopFigures
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import tick
from lcd_flight.model import (
    Clock,
    Command,
    LcdError,
    Link,
    MotorRequest,
    Observer,
    Phase,
    PoseSource,
    Tick,
    TickInputs,
)
from lcd_flight.safety.gate import is_fresh
from lcd_flight.safety.preflight import WINDOW_S

OperatorCommands = Callable[[], tuple[Command, ...]]
"""What the operator has asked for since the last call."""

Condition = Callable[[TickInputs, Tick], bool]


class FlightLoop:
    """One flight's loop. `run` it as a task; it ends with `stop()`."""

    def __init__(
        self,
        setup: FlightSetup,
        clock: Clock,
        link: Link,
        pose: PoseSource,
        operator: OperatorCommands = tuple,
        observers: Sequence[Observer] = (),
    ) -> None:
        self.memory = Memory()
        self.figures = LoopFigures()
        self.recent: deque[TickInputs] = deque(maxlen=round(WINDOW_S * 100))
        """The inputs of the last two seconds, for the pre-flight."""
        self.notes: list[str] = []
        """What went wrong beside the flight."""
        self._setup, self._clock, self._link, self._pose = setup, clock, link, pose
        self._operator = operator
        self._observers = list(observers)
        self._orders: list[Command] = []
        self._waiting: list[tuple[Condition, asyncio.Future[Tick]]] = []
        self._motor_task: asyncio.Task[None] | None = None
        self._running = True

    def order(self, *commands: Command) -> None:
        """Give commands to the next tick."""
        self._orders.extend(commands)

    def stop(self) -> None:
        """End after the tick that is running."""
        self._running = False

    async def until(self, condition: Condition) -> Tick:
        """The first tick from now on that fulfils a condition."""
        waiting: asyncio.Future[Tick] = asyncio.get_running_loop().create_future()
        self._waiting.append((condition, waiting))
        return await waiting

    async def in_phase(self, *phases: Phase) -> Tick:
        """The first tick from now on in one of the phases."""
        return await self.until(lambda _, decided: decided.phase in phases)

    async def for_s(self, duration_s: float) -> Tick:
        """The first tick that is so much later than now."""
        end_ns = self._clock.now_ns() + round(duration_s * 1e9)
        return await self.until(lambda inputs, _: inputs.now_ns >= end_ns)

    async def motors_done(self) -> None:
        """Wait for the arming or disarming that was asked for last.

        Raises:
            RefusedError: the vehicle would not, with its reason.
        """
        if self._motor_task is not None:
            await self._motor_task

    async def run(self) -> None:
        """Tick until stopped."""
        keeper = RateKeeper(self._clock)
        while self._running:
            self._step(await keeper.next())

    def _step(self, wake: Wake) -> None:
        """One tick, from what is known to what is sent."""
        inputs = self._inputs(wake)
        decided, self.memory = tick(inputs, self._setup, self.memory)
        self._send(decided)
        self.recent.append(inputs)
        self.figures.note(inputs, self._clock.now_ns())
        for observer in tuple(self._observers):
            self._tell(observer, inputs, decided)
        self._wake_waiting(inputs, decided)

    def _inputs(self, wake: Wake) -> TickInputs:
        commands = (*self._orders, *self._operator())
        self._orders.clear()
        return TickInputs(
            sequence=self.figures.ticks,
            now_ns=wake.now_ns,
            deadline_ns=wake.deadline_ns,
            missed=wake.missed,
            pose=self._pose.report(wake.now_ns),
            link=self._link.report(wake.now_ns),
            commands=commands,
        )

    def _send(self, decided: Tick) -> None:
        """Hand setpoint and motor request to the link; a setpoint that has aged is withheld and counted."""
        match decided.motors:
            case MotorRequest.STOP:
                self._link.stop_motors()
            case MotorRequest.ARM:
                self._motor_task = asyncio.ensure_future(self._link.arm())
            case MotorRequest.DISARM:
                self._motor_task = asyncio.ensure_future(self._disarm())
        if decided.setpoint is None:
            return
        if is_fresh(decided.now_ns, self._clock.now_ns()):
            self._link.send(decided.setpoint, decided.now_ns)
        else:
            self.figures.stale += 1

    async def _disarm(self) -> None:
        """Disarm; a vehicle that will not is stopped."""
        try:
            await self._link.disarm()
        except LcdError as error:
            self.notes.append(f"disarming failed ({error}); the motors were stopped")
            self._link.stop_motors()

    def _tell(self, observer: Observer, inputs: TickInputs, decided: Tick) -> None:
        """Let an observer take note; one that fails is left out from then on."""
        try:
            observer.observe(inputs, decided)
        except Exception as error:  # noqa: BLE001 - nothing that listens may end a flight
            self._observers.remove(observer)
            self.notes.append(f"{type(observer).__name__} failed and was left out: {type(error).__name__}: {error}")

    def _wake_waiting(self, inputs: TickInputs, decided: Tick) -> None:
        still_waiting = []
        for condition, waiting in self._waiting:
            if waiting.done():
                continue
            if condition(inputs, decided):
                waiting.set_result(decided)
            else:
                still_waiting.append((condition, waiting))
        self._waiting = still_waiting
