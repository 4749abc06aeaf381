"""From a URI to a vehicle that is set up, read back, and knows where it is; and back to no thread at all."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from drivers.crazyflie import crtp_wire, estimator, parameters
from drivers.crazyflie.connect import connect
from drivers.crazyflie.log_blocks import BLOCKS, start
from drivers.crazyflie.options import CrazyflieOptions
from drivers.crazyflie.outbox import Outbox
from drivers.crazyflie.picture import Picture
from drivers.crazyflie.sender import Sender
from drivers.crazyflie.session import Session
from lcd_flight.jit import cache_folder
from lcd_flight.model import LinkContext, RawPose, RefusedError

FIRST_POSE_S = 5.0
FIRST_REPORTS_S = 3.0
POLL_NS = 20_000_000

Result = TypeVar("Result")


class Connection:
    """One vehicle, with all that is known of it. `open` it once, `close` it whatever happened."""

    def __init__(self, uri: str, options: CrazyflieOptions, context: LinkContext) -> None:
        self.uri = uri
        self.picture = Picture()
        self.pose: RawPose | None = None
        """The newest of motion capture."""
        self.session: Session | None = None
        self.sender: Sender | None = None
        self._options, self._context, self._clock = options, context, context.clock
        self._cancelled = threading.Event()
        self._executor = ThreadPoolExecutor(1, "crazyflie-setup")

    async def open(self, fallback: Callable[[], bytes], accept: Callable[[Session], None]) -> None:
        """Connect, listen, stream poses, set parameters, reset the estimator.

        fallback: makes the fallback's packet. accept: raises where this vehicle is not to be flown.

        Raises:
            RefusedError: nobody answers, a parameter does not hold, or the estimate does not agree with motion capture.
        """
        if self._context.listen_poses is None:
            raise RefusedError(f"{self.uri} needs poses from motion capture to tell its vehicle, and there are none")
        limit_s, toc = self._options.connect_s, cache_folder() / "crazyflie-toc"
        self.session = session = await self._elsewhere(
            lambda: connect(self.uri, toc, self._clock, limit_s, self._cancelled)
        )
        accept(session)
        await self._elsewhere(session.identify)
        await self._listen(session)
        watchdog = crtp_wire.emergency_watchdog(session.protocol) if self._context.on_link_lost == "cut" else None
        outbox = Outbox(fallback, self._options.pose_rate_hz, watchdog)
        self.sender = Sender(outbox, self._clock, session.transmit)
        self.sender.start()
        self._context.listen_poses(self._take_pose)
        await self._pose_streams()
        for change in await self._elsewhere(lambda: parameters.require(session)):
            self.picture.say(f"parameter {change}")
        await self._settle(session)

    async def close(self) -> None:
        """Send what is still due, close, and wait for every thread; may be called at any time."""
        sender, session = self.sender, self.session
        self.sender = self.session = None
        if sender is not None:
            await self._elsewhere(sender.end)
        if session is not None:
            await self._elsewhere(session.shut)
        self._executor.shutdown()

    async def pause(self, duration_s: float) -> None:
        """Let time pass."""
        await self._clock.sleep_until(self._clock.now_ns() + round(duration_s * 1e9))

    async def until(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Whether a condition comes true in time."""
        deadline_ns = self._clock.now_ns() + round(limit_s * 1e9)
        while not condition():
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                return False
            await self._clock.sleep_until(now_ns + POLL_NS)
        return True

    async def _elsewhere(self, blocking: Callable[[], Result]) -> Result:
        """Run what blocks in the thread for it; who is cancelled meanwhile waits for its end."""
        running = asyncio.get_running_loop().run_in_executor(self._executor, blocking)
        try:
            return await asyncio.shield(running)
        except asyncio.CancelledError:
            self._cancelled.set()
            await asyncio.gather(running, return_exceptions=True)
            raise

    async def _listen(self, session: Session) -> None:
        """Have the vehicle report, every report handed to the event loop."""
        loop = asyncio.get_running_loop()

        def take(block: str, vehicle_ms: int, values: Mapping[str, float]) -> None:
            arrival_ns = self._clock.now_ns()
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                loop.call_soon_threadsafe(self.picture.take, block, vehicle_ms, values, arrival_ns)

        await self._elsewhere(lambda: start(session, BLOCKS, take))
        if not await self.until(lambda: self.picture.complete, FIRST_REPORTS_S):
            raise RefusedError(f"the vehicle at {self.uri} does not report: restart it")

    def _take_pose(self, raw: RawPose) -> None:
        """Pass a pose on, as it comes."""
        self.pose = raw
        if self.sender is not None:
            packet = crtp_wire.extpose(raw.p_WB, raw.q_WB)
            self.sender.change(lambda box: box.pose(packet, raw.arrival_ns))

    async def _pose_streams(self) -> None:
        if not await self.until(lambda: self.pose is not None, FIRST_POSE_S):
            raise RefusedError(estimator.objection(self.picture, None, self._clock.now_ns()))

    async def _settle(self, session: Session) -> None:
        """Reset the estimator and wait until it is right for a while."""
        for value in (1, 0):
            await self._elsewhere(lambda value=value: parameters.write(session, estimator.RESET, value, held=False))  # type: ignore[misc]
            await self.pause(estimator.RESET_S)
        wrong_ns = began_ns = self._clock.now_ns()
        while (now_ns := self._clock.now_ns()) - wrong_ns < estimator.SETTLED_NS:
            objection = estimator.objection(self.picture, self.pose, now_ns)
            if objection:
                wrong_ns = now_ns
                if now_ns - began_ns > estimator.LIMIT_NS:
                    raise RefusedError(f"the vehicle's estimate cannot be flown with: {objection}")
            await self._clock.sleep_until(now_ns + POLL_NS)
