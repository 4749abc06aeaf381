"""Layers that make any link worse: they stand between the flight and a link, and are a link themselves.

They act on setpoints on their way to the vehicle. What a real link repeats until it is acknowledged (arming, the
emergency stop) is never dropped, and everything works in the time of the given clock, so that a flight in virtual
time is as deterministic with them as without.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import TracebackType
from typing import Annotated, Self

import msgspec
import numpy as np

from lcd_flight.model import AttitudeThrust, Link, LinkContext, LinkReport
from lcd_flight.model.streams import Stream
from lcd_flight.wire.uri_options import read_options

NS_PER_MS = 1_000_000
_SECOND_NS = 1_000_000_000


class Layer:
    """Passes everything on unchanged: what a layer does not touch."""

    def __init__(self, link: Link) -> None:
        self._link = link

    async def __aenter__(self) -> Self:
        """Connect the link inside."""
        await self._link.__aenter__()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the link inside."""
        await self._link.__aexit__(kind, error, trace)

    @property
    def description(self) -> str:
        """What is at the other end."""
        return self._link.description

    async def arm(self) -> None:
        """Make the vehicle ready to spin its motors.

        Raises:
            RefusedError: the vehicle will not, with its reason.
        """
        await self._link.arm()

    async def disarm(self) -> None:
        """Take readiness away on the ground."""
        await self._link.disarm()

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Hand over a setpoint."""
        self._link.send(setpoint, stamp_ns)

    def stop_motors(self) -> None:
        """Emergency stop."""
        self._link.stop_motors()

    def report(self, now_ns: int) -> LinkReport:
        """What is known now."""
        return self._link.report(now_ns)


class DelayOptions(msgspec.Struct, frozen=True):
    """How long a setpoint takes."""

    delay_ms: Annotated[float, msgspec.Meta(ge=0.0, le=10_000.0)] = 10.0
    delay_jitter_ms: Annotated[float, msgspec.Meta(ge=0.0, le=10_000.0)] = 0.0
    """Added to it, uniform from zero to this; setpoints may overtake one another."""


class Delay(Layer):
    """`delay`: setpoints and the emergency stop reach the link later than they were sent."""

    def __init__(self, link: Link, options: Mapping[str, str], context: LinkContext) -> None:
        """Wrap `link`.

        Raises:
            InputError: an option that is unknown or out of its limits.
        """
        super().__init__(link)
        self._options = read_options(DelayOptions, options, "link layer delay")
        self._clock = context.clock
        self._jitter = Stream(context.seed, "link layer/delay")
        self._sent = 0
        self._under_way: set[asyncio.Task[None]] = set()
        self._taking = False

    async def __aenter__(self) -> Self:
        """Connect the link inside."""
        await super().__aenter__()
        self._taking = True
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the link inside; what is still under way is lost."""
        self._taking = False
        for task in self._under_way:
            task.cancel()
        await asyncio.gather(*self._under_way, return_exceptions=True)
        await super().__aexit__(kind, error, trace)

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Send a setpoint on its way, with its stamp: the link inside judges how old it is by then."""
        if self._taking:
            self._later(lambda: self._link.send(setpoint, stamp_ns))

    def stop_motors(self) -> None:
        """Send the stop on its way; no setpoint follows it."""
        if self._taking:
            self._taking = False
            self._later(self._link.stop_motors)

    def _later(self, deliver: Callable[[], None]) -> None:
        share = float(self._jitter.uniforms(np.array([self._sent]), 1)[0, 0])
        delay_ms = self._options.delay_ms + share * self._options.delay_jitter_ms
        task = asyncio.create_task(self._deliver(deliver, self._clock.now_ns() + round(delay_ms * NS_PER_MS)))
        self._sent += 1
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _deliver(self, deliver: Callable[[], None], due_ns: int) -> None:
        await self._clock.sleep_until(due_ns)
        deliver()


class DropOptions(msgspec.Struct, frozen=True):
    """How many setpoints get lost."""

    drop: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.05
    """Share of setpoints, each lost independently of the others."""


class Drop(Layer):
    """`drop`: some setpoints never reach the link, and the report says so."""

    def __init__(self, link: Link, options: Mapping[str, str], context: LinkContext) -> None:
        """Wrap `link`.

        Raises:
            InputError: an option that is unknown or out of its limits.
        """
        super().__init__(link)
        self._share = read_options(DropOptions, options, "link layer drop").drop
        self._clock = context.clock
        self._luck = Stream(context.seed, "link layer/drop")
        self._sent = 0
        self._lost = 0
        self._last_second: deque[tuple[int, bool]] = deque(maxlen=1000)
        """When a setpoint was sent, and whether it was lost."""

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Hand over a setpoint, or lose it."""
        lost = bool(self._luck.uniforms(np.array([self._sent]), 1)[0, 0] < self._share)
        now_ns = self._clock.now_ns()
        self._sent += 1
        self._lost += lost
        self._last_second.append((now_ns, lost))
        self._forget(now_ns)
        if not lost:
            self._link.send(setpoint, stamp_ns)

    def report(self, now_ns: int) -> LinkReport:
        """The link's report, with what was lost here."""
        self._forget(now_ns)
        inner = self._link.report(now_ns)
        here = sum(lost for _, lost in self._last_second) / max(1, len(self._last_second))
        return replace(
            inner,
            sent=inner.sent + self._lost,
            lost=inner.lost + self._lost,
            loss_share=1.0 - (1.0 - inner.loss_share) * (1.0 - here),
        )

    def _forget(self, now_ns: int) -> None:
        """Keep the last second."""
        while self._last_second and self._last_second[0][0] <= now_ns - _SECOND_NS:
            self._last_second.popleft()
