"""A link of one's own: thrust and attitude as JSON datagrams, telemetry back likewise; `json://HOST:PORT`.

The vehicle must look after itself: level or off after 100 ms without a setpoint, and never again after `stop`.
"""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Self

from lcd_flight.model import AttitudeThrust, Clock, InputError, LinkContext, LinkReport, RefusedError, Telemetry

MS = 1_000_000
MAX_AGE_NS = 50 * MS
ARMING_NS = 1000 * MS


def open_link(address: str, options: Mapping[str, str], context: LinkContext) -> JsonLink:
    """The link behind `json://HOST:PORT`.

    Raises:
        InputError: anything else.
    """
    host, _, port = address.rpartition(":")
    if options or not host or not port.isdigit():
        raise InputError(f"json://{address}: write json://HOST:PORT, without options")
    return JsonLink((host, int(port)), context.clock)


class JsonLink:
    """`lcd_flight.model.Link`."""

    description = "JSON over UDP"

    def __init__(self, peer: tuple[str, int], clock: Clock) -> None:
        self._peer, self._clock = peer, clock
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._telemetry: Telemetry | None = None
        self._newest_ns = self._sent = self._received = self._stale = 0
        self._stopped = False

    async def __aenter__(self) -> Self:
        """Say hello; the vehicle answers with telemetry from then on."""
        self._socket.connect(self._peer)
        self._say(hello=True)
        return self

    async def __aexit__(self, *_error: object) -> None:
        """Stop the motors, close; also after an exception."""
        self.stop_motors()
        self._socket.close()

    async def arm(self) -> None:
        """Ask until the vehicle says that it is armed.

        Raises:
            RefusedError: it does not.
        """
        give_up_ns = self._clock.now_ns() + ARMING_NS
        while not (self._telemetry and self._telemetry.armed):
            if self._stopped or self._clock.now_ns() > give_up_ns:
                raise RefusedError(f"the vehicle at {self._peer} did not arm: is it on, was it stopped?")
            self._say(arm=True)
            await self._clock.sleep_until(self._clock.now_ns() + 20 * MS)
            self._listen()

    async def disarm(self) -> None:
        """Take readiness away on the ground."""
        self._say(arm=False)

    def send(self, setpoint: AttitudeThrust, stamp_ns: int) -> None:
        """Send what is fresh; never wait."""
        old = self._clock.now_ns() - stamp_ns > MAX_AGE_NS or stamp_ns < self._newest_ns
        if self._stopped or old or not setpoint.is_finite():
            self._stale += 1
            return
        self._newest_ns, self._sent = stamp_ns, self._sent + 1
        self._say(thrust_N=setpoint.thrust_N, q_WB=setpoint.q_WB, yaw_rate=setpoint.yaw_rate)

    def stop_motors(self) -> None:
        """Emergency stop; no setpoint follows it. The flight repeats it, so a lost datagram does not matter."""
        self._stopped = True
        self._say(stop=True)

    def report(self, now_ns: int) -> LinkReport:
        """What is known now."""
        self._listen()
        age_ns = None if self._telemetry is None else now_ns - self._telemetry.stamp_ns
        return LinkReport(
            connected=True,
            age_ns=age_ns,
            sent=self._sent,
            received=self._received,
            stale=self._stale,
            telemetry=self._telemetry,
        )

    def _say(self, **message: Any) -> None:
        with suppress(OSError):  # a datagram that cannot be sent is a datagram that is lost
            self._socket.send(json.dumps(message).encode())

    def _listen(self) -> None:
        """Take what has arrived: `{"battery_V": 4.1, "armed": false}`; what is no telemetry is passed over."""
        while True:
            try:
                said = json.loads(self._socket.recv(2048))
                volts, armed = float(said["battery_V"]), bool(said["armed"])
            except OSError:  # nothing there, or nobody
                return
            except (ValueError, KeyError, TypeError):
                continue
            self._telemetry = Telemetry(self._clock.now_ns(), battery_V=volts, armed=armed)
            self._received += 1
