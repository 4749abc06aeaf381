"""What is known of the vehicle: its newest reports put together, and how many were lost. Lives in the event loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from drivers.crazyflie.log_blocks import ATTITUDE, SLOW, STATUS
from drivers.crazyflie.status import Status
from drivers.crazyflie.thrust_map import FULL_SCALE
from lcd_flight.model import GRAVITY_M_PER_S2, Quaternion, Telemetry, Vector3
from lcd_flight.model.frames import normalized

_SECOND_NS = 1_000_000_000
_CLOCK_MS = 1 << 24
"""The vehicle's stamps are 24 bits of milliseconds."""


class Picture:
    """Takes reports as they come."""

    def __init__(self) -> None:
        self.stamp_ns: int | None = None
        """Arrival of the newest report."""
        self.battery_V: float | None = None
        self.status: Status | None = None
        self.q_WB: Quaternion | None = None
        self.p_WB: Vector3 | None = None
        self.variance_m2: float | None = None
        """Of the onboard position, the largest of the three axes."""
        self.specific_force_B: Vector3 | None = None
        self.motor_shares: tuple[float, ...] | None = None
        self.lost = 0
        """Reports that never came."""
        self._messages: list[str] = []
        self._vehicle_ms: int | None = None
        self._last_second: deque[tuple[int, int]] = deque()
        """Arrival of each attitude report, and how many were missing before it."""

    def take(self, block: str, vehicle_ms: int, values: Mapping[str, float], arrival_ns: int) -> None:
        """One report."""
        self.stamp_ns = arrival_ns
        if block == ATTITUDE.name:
            self._count(vehicle_ms, arrival_ns)
            self.q_WB = _attitude(values)
            self.motor_shares = tuple(values[f"motor.m{number}"] / FULL_SCALE for number in range(1, 5))
        elif block == STATUS.name:
            self._take_status(values)
        elif block == SLOW.name:
            self.variance_m2 = max(values[f"kalman.var{axis}"] for axis in "XYZ")
            x, y, z = (values[f"acc.{axis}"] * GRAVITY_M_PER_S2 for axis in "xyz")
            self.specific_force_B = (x, y, z)

    @property
    def complete(self) -> bool:
        """Whether every kind of report has come."""
        return self.q_WB is not None and self.status is not None and self.variance_m2 is not None

    def say(self, text: str) -> None:
        """Something for the log."""
        self._messages.append(text)

    def loss_share(self, now_ns: int) -> float:
        """Reports lost, as a share, over the last second."""
        while self._last_second and self._last_second[0][0] <= now_ns - _SECOND_NS:
            self._last_second.popleft()
        lost = sum(missing for _, missing in self._last_second)
        return lost / max(1, lost + len(self._last_second))

    def telemetry(self, *, armed: bool) -> Telemetry | None:
        """All of it, None before the first report; text is told once."""
        if self.stamp_ns is None:
            return None
        messages, self._messages = tuple(self._messages), []
        status = self.status
        return Telemetry(
            stamp_ns=self.stamp_ns,
            battery_V=self.battery_V,
            armed=None if status is None else armed and Status.ARMED in status,
            airborne=None if status is None else Status.FLYING in status,
            crashed=None if status is None else bool(status.trouble),
            status=None if status is None else int(status),
            q_WB=self.q_WB,
            p_WB=self.p_WB,
            specific_force_B=self.specific_force_B,
            motor_shares=self.motor_shares,
            messages=messages,
        )

    def _take_status(self, values: Mapping[str, float]) -> None:
        self.battery_V = values["pm.vbat"]
        self.p_WB = (values["stateEstimate.x"], values["stateEstimate.y"], values["stateEstimate.z"])
        status = Status(int(values["supervisor.info"]))
        if self.status is not None and status.trouble and not self.status.trouble:
            self.say(f"the vehicle reports trouble: {status.trouble}")
        self.status = status

    def _count(self, vehicle_ms: int, arrival_ns: int) -> None:
        """Missing reports show as gaps in the vehicle's own stamps."""
        missing = 0
        if self._vehicle_ms is not None:
            elapsed_ms = (vehicle_ms - self._vehicle_ms) % _CLOCK_MS
            missing = max(round(elapsed_ms / ATTITUDE.period_ms) - 1, 0)
        if missing > _CLOCK_MS // (2 * ATTITUDE.period_ms):  # it came out of order
            return
        self._vehicle_ms = vehicle_ms
        self.lost += missing
        self._last_second.append((arrival_ns, missing))


def _attitude(values: Mapping[str, float]) -> Quaternion | None:
    """None for numbers that are no rotation, as before the estimator has begun."""
    try:
        return normalized(tuple(values[f"stateEstimate.q{axis}"] for axis in "xyzw"))  # type: ignore[arg-type]
    except ValueError:
        return None
