"""A link and a pose source of a few lines: the bench's point mass, with switches for what may go wrong."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from flight_bench import PointMass, healthy

from lcd_flight.model import AttitudeThrust, Clock, LinkReport, PoseListener, PoseReport, RefusedError


class FakeVehicle:
    """The point mass, brought forward whenever anybody looks at it."""

    def __init__(self, clock: Clock, mass_kg: float) -> None:
        self.body = PointMass(mass_kg)
        self.setpoint: AttitudeThrust | None = None
        self.armed = False
        self.stopped = False
        self._clock = clock
        self._now_ns = clock.now_ns()

    def advance(self) -> None:
        """To the present, in steps of a tick."""
        while self._now_ns + 10_000_000 <= self._clock.now_ns():
            flying = self.armed and not self.stopped
            self.body.advance(self.setpoint if flying else None)
            self._now_ns += 10_000_000


class FakeLink:
    """`lcd_flight.model.Link`."""

    description = "a point mass"

    def __init__(self, vehicle: FakeVehicle, clock: Clock) -> None:
        self.vehicle = vehicle
        self.sent: list[tuple[AttitudeThrust, int]] = []
        self.calls: list[str] = []
        self.refuse_arming = self.refuse_disarming = ""
        self.arming_s = 0.05
        self._clock = clock

    async def __aenter__(self) -> Self:
        self.calls.append("open")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.calls.append("close")

    async def arm(self) -> None:
        self.calls.append("arm")
        await self._clock.sleep_until(self._clock.now_ns() + round(self.arming_s * 1e9))
        if self.refuse_arming:
            raise RefusedError(self.refuse_arming)
        self.vehicle.armed = True

    async def disarm(self) -> None:
        self.calls.append("disarm")
        if self.refuse_disarming:
            raise RefusedError(self.refuse_disarming)
        self.vehicle.armed = False

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        self.vehicle.advance()
        self.vehicle.setpoint = setpoint
        self.sent.append((setpoint, stamp_ns))

    def stop_motors(self) -> None:
        self.calls.append("stop")
        self.vehicle.stopped = True

    def report(self, now_ns: int) -> LinkReport:
        return healthy(0, self.vehicle.body.state, now_ns).link


class FakePose:
    """`lcd_flight.model.PoseSource`."""

    def __init__(self, vehicle: FakeVehicle, clock: Clock) -> None:
        self.vehicle = vehicle
        self.from_ns = 0
        """Before that, nothing."""
        self._clock = clock

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is held."""

    def report(self, now_ns: int) -> PoseReport:
        self.vehicle.advance()
        if now_ns < self.from_ns:
            return PoseReport(state=None, age_ns=None)
        return healthy(now_ns // 10_000_000, self.vehicle.body.state, now_ns).pose

    def listen(self, listener: PoseListener) -> None:
        """Nobody asks it."""
