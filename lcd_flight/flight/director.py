"""Drives the loop from the first pose to the end of the flight: check, ask, arm, take off, wait."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from lcd_flight.flight.hand_check import HandCheck, watched
from lcd_flight.flight.loop import Condition, FlightLoop
from lcd_flight.flight.operator import Operator
from lcd_flight.flight.phases import TIME_LIMITS_S
from lcd_flight.flight.progress import ByHand, Checked, Progress
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.flight.tick import EXPIRED
from lcd_flight.model import Command, Outcome, Phase, RefusedError, Severity, Tick, TickInputs
from lcd_flight.safety.preflight import WINDOW_S, Check, preflight

FIRST_POSE_S = 5.0
"""How long the first pose and the vehicle's first report may take; after that the pre-flight says what is missing."""
BY_HAND_S = 60.0
"""For each motion of the check by hand."""
LINGER_S = 1.0
"""How long ticks go on after the end: for the log, and to repeat a stop."""
HANDED_OVER_S = 60.0
"""How long they go on, and poses with them, for somebody else who flies the vehicle; until it is disarmed at most."""

Consent = Callable[[Operator], Awaitable[bool]]
"""Asks whether to arm."""


@dataclass(frozen=True, slots=True)
class Direction:
    """What came of it, where the ticks alone do not tell."""

    checks: tuple[Check, ...] = ()
    outcome: Outcome | None = None
    reason: str = ""


class Director:
    """Gives the loop its commands."""

    def __init__(
        self,
        loop: FlightLoop,
        setup: FlightSetup,
        operator: Operator,
        consent: Consent | None = None,
        progress: Progress | None = None,
    ) -> None:
        """consent: None where nobody needs to be asked."""
        self._loop, self._setup, self._operator = loop, setup, operator
        self._consent, self._progress = consent, progress
        self._checks: tuple[Check, ...] = ()

    async def direct(self, arm: bool, idle_s: float, *, by_hand: bool = False) -> Direction:
        """Everything that a flight is asked to do, in order.

        Without `arm`, stand ready for a while instead, or with `by_hand` be carried through the check by hand.
        """
        try:
            await self._check()
            if not arm:
                return await (self._carried() if by_hand else self._stood(idle_s))
            await self._ready()
            await self._agree()
            with self._operator.keys():
                await self._take_off()
                await self._loop.until(lambda _, decided: decided.phase.over)
                await self._see_off()
                if self._loop.memory.phase is not Phase.HANDED_OVER:
                    await self._loop.for_s(LINGER_S)
                await self._loop.motors_done()
        except RefusedError as error:
            with self._operator.keys():
                await self._see_off()
            return Direction(self._checks, Outcome.REFUSED, str(error))
        return Direction(self._checks)

    async def _check(self) -> None:
        """The pre-flight over its window, from the first pose and the vehicle's first report on."""
        first = await self._on_ground(lambda _inputs, _decided: True)
        latest_ns = first.now_ns + round(FIRST_POSE_S * 1e9)
        await self._on_ground(lambda inputs, _: _reports(inputs) or inputs.now_ns >= latest_ns)
        self._loop.order(Command.CHECK)
        self._loop.recent.clear()
        await self._for_s(WINDOW_S)
        self._checks = preflight(tuple(self._loop.recent), self._setup.plan, self._setup.limits)
        if self._progress is not None:
            self._progress(Checked(self._checks))
        failed = [check.text for check in self._checks if not check.ok]
        if failed:
            raise RefusedError("\n".join(failed))

    async def _ready(self) -> None:
        self._loop.order(Command.CHECKED)
        await self._on_ground(lambda _, decided: decided.phase is Phase.READY)

    async def _stood(self, idle_s: float) -> Direction:
        """Everything but the motors."""
        await self._ready()
        await self._for_s(idle_s)
        return Direction(self._checks, Outcome.OK)

    async def _carried(self) -> Direction:
        """The check by hand, to its end or until its time is over.

        Raises:
            RefusedError: something did not agree, it was not finished, or the operator or a fault ended it.
        """
        check = HandCheck()

        def moved_on(inputs: TickInputs, _decided: Tick) -> bool:
            nonlocal check
            before, check = check, watched(check, inputs, self._setup)
            return len(check.checks) > len(before.checks)

        while check.request:
            self._tell(check)
            ended = await self._on_ground_within(moved_on, BY_HAND_S)
            if ended:
                raise RefusedError(f"the check by hand was not finished: {check.request}")
        self._tell(check)
        if check.failed:
            raise RefusedError("\n".join(check.failed))
        return Direction((*self._checks, *check.checks), Outcome.OK)

    def _tell(self, check: HandCheck) -> None:
        if self._progress is not None:
            self._progress(ByHand(check.checks, check.request))

    async def _agree(self) -> None:
        """Ask, while the ticks go on: the question is void as soon as the vehicle is no longer ready."""
        if self._consent is None:
            return
        asking = asyncio.ensure_future(self._consent(self._operator))
        ending = asyncio.ensure_future(self._on_ground(lambda _inputs, _decided: False))
        try:
            await asyncio.wait({asking, ending}, return_when=asyncio.FIRST_COMPLETED)
            if ending.done():
                await ending
            if not await asking:
                raise RefusedError("arming was not confirmed")
        finally:
            asking.cancel()
            ending.cancel()
            await asyncio.gather(asking, ending, return_exceptions=True)

    async def _take_off(self) -> None:
        self._loop.order(Command.ARM)
        await self._on_ground(lambda _, decided: decided.phase is Phase.ARMED)
        try:
            await self._loop.motors_done()
        except RefusedError:
            self._loop.order(Command.LAND)
            await self._loop.in_phase(Phase.IDLE)
            raise
        if self._loop.memory.phase is not Phase.ARMED:  # it took too long; its disarming is what was waited for
            raise RefusedError(f"the vehicle was not armed within {TIME_LIMITS_S[Phase.ARMED]:g} s")
        self._loop.order(Command.TAKEOFF)
        await self._on_ground(lambda _, decided: decided.phase.airborne)

    async def _see_off(self) -> None:
        """Go on for somebody else who flies, whose position may hang on our poses; Ctrl-C or SIGTERM ends that."""
        recent = self._loop.recent
        if not recent or not _is_flown_by_others(recent[-1]):
            return
        began, phase, quits = recent[-1], self._loop.memory.phase, self._operator.quits
        end_ns = began.now_ns + round(HANDED_OVER_S * 1e9)

        def left(inputs: TickInputs, decided: Tick) -> bool:
            ended = inputs.now_ns >= end_ns or self._operator.quits > quits
            return ended or decided.phase is not phase or not _is_flown_by_others(inputs)

        decided = await self._loop.until(left)
        if decided.phase is phase and _is_flown_by_others(recent[-1]):
            why = "interrupted" if self._operator.quits > quits else f"{HANDED_OVER_S:g} s are over"
            self._loop.notes.append(f"{recent[-1].link.taken_over}; {why}: its poses stop, and it is still armed")

    async def _for_s(self, duration_s: float) -> None:
        first = await self._on_ground(lambda _inputs, _decided: True)
        end_ns = first.now_ns + round(duration_s * 1e9)
        await self._on_ground(lambda inputs, _: inputs.now_ns >= end_ns)

    async def _on_ground_within(self, condition: Condition, limit_s: float) -> bool:
        """Whether the time was over before a condition held."""
        first = await self._on_ground(lambda _inputs, _decided: True)
        end_ns, over = first.now_ns + round(limit_s * 1e9), False

        def held_or_over(inputs: TickInputs, decided: Tick) -> bool:
            nonlocal over
            if condition(inputs, decided):
                return True
            over = inputs.now_ns >= end_ns
            return over

        await self._on_ground(held_or_over)
        return over

    async def _on_ground(self, condition: Condition) -> Tick:
        """The first tick from now on that fulfils a condition.

        Raises:
            RefusedError: the operator, a fault or a time limit ended it before.
        """
        decided = await self._loop.until(lambda inputs, t: condition(inputs, t) or _ended(t))
        if _ended(decided):
            gravest = max(decided.findings, key=lambda finding: finding.severity)
            raise RefusedError(f"stopped before take-off: {gravest.message}")
        return decided


def _reports(inputs: TickInputs) -> bool:
    telemetry = inputs.link.telemetry
    return inputs.pose.state is not None and telemetry is not None and telemetry.battery_V is not None


def _is_flown_by_others(inputs: TickInputs) -> bool:
    telemetry = inputs.link.telemetry
    return bool(inputs.link.taken_over) and telemetry is not None and bool(telemetry.armed)


def _ended(decided: Tick) -> bool:
    return any(f.severity >= Severity.BRAKE or f.code == EXPIRED for f in decided.findings)
