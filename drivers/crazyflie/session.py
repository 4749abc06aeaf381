"""cflib's `Crazyflie`, with what it leaves open: silence, errors in the wrong thread, and threads that stay.

- Over UDP cflib waits for ever for an answer that was lost. It can repeat requests (it does on radios without
  safelink), so it is told to; the first two requests cannot be repeated, and `connect` closes and tries again.
- It closes the link in whatever thread an error occurs, while that thread holds its send lock, and joins the very
  threads it may be in. Here errors are noted and nothing is closed: a vehicle that comes back into range is heard
  again, and silence is judged by the age of packets.
- Closing sends a setpoint of its own, after which silence would lock the vehicle. Here the driver is closed first.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cflib.crtp
from cflib.crazyflie import Crazyflie
from cflib.crazyflie.param import _ExtendedTypeFetcher
from cflib.crtp.crtpstack import CRTPPacket, CRTPPort

from lcd_flight.model import Clock

logging.getLogger("cflib").addHandler(logging.NullHandler())  # what matters is told in our own words

_FIRMWARE, _DEVICE = 1, 2
"""Questions to the platform service, beside the protocol's version, which cflib asks (platformservice.h)."""
_VERSIONS = 1
"""Their channel."""
_ASKED, _ANSWER_S = 3, 0.3
MAX_FAULTS = 10
"""Kept until they are looked at: a peer that is gone refuses a hundred packets a second."""
_JOIN_S = 1.5
"""cflib's receiving threads look up once a second."""


class Session(Crazyflie):  # type: ignore[misc]  # cflib is untyped
    """One connection."""

    link: Any
    """cflib's driver; None while there is none."""

    def __init__(self, toc_cache: Path, clock: Clock) -> None:
        if not cflib.crtp.CLASSES:
            cflib.crtp.init_drivers()
        super().__init__(rw_cache=str(toc_cache))
        self.newest_ns: int | None = None
        """Arrival of the newest packet."""
        self.received = 0
        self.progress_ns = clock.now_ns()
        """Arrival of the newest packet that moves a connection on."""
        self.ready = threading.Event()
        """Tables and the values of all parameters are there."""
        self.failure = ""
        """Why the link could not be opened; empty where it was."""
        self.quality: float | None = None
        """Share of radio packets that were acknowledged at once."""
        self.device = self.version = ""
        """Platform and firmware in their own words, once `identify` has asked; empty where they do not say."""
        self._clock = clock
        self._faults: list[str] = []
        self.packet_received.add_callback(self._note_packet)
        self.link_established.add_callback(self._repeat_requests)
        self.fully_connected.add_callback(lambda _uri: self.ready.set())
        self.connection_failed.add_callback(self._note_failure)
        self.link_statistics.link_quality_updated.add_callback(self._note_quality)

    @property
    def protocol(self) -> int:
        """The CRTP protocol that the firmware speaks."""
        return int(self.platform.get_protocol_version())

    @property
    def revision(self) -> str:
        """Of the firmware, hexadecimal; `unknown` where it does not say."""
        values = self.param.values.get("firmware", {})
        try:
            return f"{int(values['revision0']):08x}{int(values['revision1']):04x}"
        except (KeyError, ValueError):
            return "unknown"

    def identify(self) -> None:
        """Ask platform and firmware who they are. Blocks, for two seconds at most."""
        self.version, self.device = self._ask_version(_FIRMWARE), self._ask_version(_DEVICE)

    def _ask_version(self, command: int) -> str:
        answers: queue.SimpleQueue[str] = queue.SimpleQueue()

        def take(packet: CRTPPacket) -> None:
            if packet.channel == _VERSIONS and len(packet.data) > 1 and packet.data[0] == command:
                answers.put(bytes(packet.data[1:]).partition(b"\0")[0].decode("ascii", "replace"))

        self.add_port_callback(CRTPPort.PLATFORM, take)
        try:
            for _ in range(_ASKED):
                self.transmit(bytes([CRTPPort.PLATFORM << 4 | 0x0C | _VERSIONS, command]))
                with contextlib.suppress(queue.Empty):
                    return answers.get(timeout=_ANSWER_S)
        finally:
            self.remove_port_callback(CRTPPort.PLATFORM, take)
        return ""

    def take_faults(self) -> list[str]:
        """What the driver complained of since the last call."""
        faults, self._faults = self._faults, []
        return faults

    def transmit(self, packet: bytes) -> None:
        """Hand one packet to the driver."""
        self.send_packet(CRTPPacket(packet[0], packet[1:]))

    def shut(self) -> None:
        """Close without a word to the vehicle, and leave no thread behind. Takes up to three seconds."""
        self.incoming.stop()
        if self.incoming.is_alive():
            if self.link is not None:
                self.link.in_queue.put(None)  # it waits there for up to a second
            self.incoming.join(_JOIN_S)
        with self._send_lock:
            link = self.link
            self.link = None
        if link is not None:
            link.close()
        for timer in list(self._answer_patterns.values()):
            timer.cancel()
        updater = self.param.param_updater
        self.close_link()
        self._end(updater, lambda: updater.request_queue.put(None))
        for thread in threading.enumerate():
            if isinstance(thread, _ExtendedTypeFetcher) and thread._cf is self:
                self._end(thread, thread._close)

    @staticmethod
    def _end(thread: threading.Thread | None, wake: Callable[[], Any]) -> None:
        """Wait for a thread that has been told to end but may have missed it."""
        if thread is not None and thread.is_alive():
            wake()
            thread.join(_JOIN_S)

    def _link_error_cb(self, errmsg: str) -> None:
        """In place of cflib's own, which closes the link; see above."""
        if len(self._faults) < MAX_FAULTS:
            self._faults.append(next(iter(errmsg.splitlines()), "unknown error"))

    def _note_packet(self, packet: CRTPPacket) -> None:
        self.newest_ns = self._clock.now_ns()
        self.received += 1
        if packet.port != CRTPPort.LINKCTRL or packet.channel != 0:  # echoes of the ping come whatever else is lost
            self.progress_ns = self.newest_ns

    def _repeat_requests(self, _uri: str) -> None:
        if self.link is not None and self.link_uri.startswith("udp://"):
            self.link.needs_resending = True

    def _note_failure(self, _uri: str, message: str) -> None:
        self.failure = next(iter(message.splitlines()), "unknown error").removeprefix("Couldn't load link driver: ")

    def _note_quality(self, percent: float) -> None:
        self.quality = percent / 100.0
