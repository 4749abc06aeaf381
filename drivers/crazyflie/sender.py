"""The thread that hands packets to cflib: its `send_packet` may block for two seconds, and the event loop must not."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from drivers.crazyflie.outbox import Mode, Outbox
from lcd_flight.model import Clock, Transmission

_LOG_CAPACITY = 1000


class Sender:
    """Runs an outbox in a thread of its own. Everything here may be called from any thread."""

    def __init__(self, outbox: Outbox, clock: Clock, transmit: Callable[[bytes], None]) -> None:
        """transmit: hands one packet to the driver; may block."""
        self._outbox, self._clock, self._transmit = outbox, clock, transmit
        self._changed = threading.Condition()
        self._ending = False
        self._sent: deque[Transmission] = deque(maxlen=_LOG_CAPACITY)
        # A daemon: a driver that hangs must not keep a process that is done.
        self._thread = threading.Thread(target=self._run, name="crazyflie-sender", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def end(self) -> None:
        """Send what is still due, and wait for the thread's end."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        self._thread.join()

    def change(self, change: Callable[[Outbox], None]) -> None:
        """Let `change` change the outbox, and look at once at what is due."""
        with self._changed:
            change(self._outbox)
            self._changed.notify()

    def request(self, packet: bytes) -> None:
        """Send a packet that is no setpoint."""
        self.change(lambda box: box.request(packet))

    def alive(self, now_ns: int) -> None:
        """The control loop shows that it is; nothing is due at once for that."""
        self._outbox.alive(now_ns)

    @property
    def mode(self) -> Mode:
        """Of the outbox."""
        return self._outbox.mode

    @property
    def latched(self) -> bool:
        """Whether there was an emergency stop."""
        return self._outbox.latched

    @property
    def stale(self) -> int:
        """Setpoints that aged while they waited for the driver."""
        return self._outbox.stale

    def transmitted(self) -> tuple[Transmission, ...]:
        """The setpoints that went out since the last call, byte for byte."""
        with self._changed:
            sent = tuple(self._sent)
            self._sent.clear()
        return sent

    def _run(self) -> None:
        while True:
            with self._changed:
                now_ns = self._clock.now_ns()
                parcels = self._outbox.due(now_ns)
                if not parcels:
                    if self._ending:
                        return
                    self._changed.wait((self._outbox.next_ns(now_ns) - now_ns) * 1e-9)
                    continue
            for parcel in parcels:
                self._transmit(parcel.packet)
                if parcel.setpoint:
                    record = Transmission(self._clock.now_ns(), parcel.packet.hex())
                    with self._changed:
                        self._sent.append(record)
