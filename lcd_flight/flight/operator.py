"""The operator: signals and keys become commands. Read once a tick; no thread, nothing to wait for.

Keys: `l` lands, `r` goes on after a brake, space stops the motors. First Ctrl-C lands, second descends level, third
stops the motors; SIGTERM lands, and so does SIGHUP, the terminal that goes away.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import TextIO

from lcd_flight.model import Command

KEYS = {b"l": Command.LAND, b"r": Command.RESUME, b" ": Command.STOP_MOTORS}
INTERRUPTS = (Command.LAND, Command.DESCEND, Command.STOP_MOTORS)
"""What the first, the second, the third and every further Ctrl-C ask for."""
_POLL_S = 0.05


class Operator:
    """Collects commands. `listening` takes the signals, `keys` the terminal."""

    def __init__(self, terminal: TextIO | None = None) -> None:
        """terminal: where keys come from, standard input by default; anything but a terminal has none."""
        self._terminal = terminal or sys.stdin
        self._pressed: list[Command] = []
        self._interrupts = self._quits = 0
        self._keys = False
        self.quits = 0
        """Ctrl-C and SIGTERM so far, of which the commands have been read; what ends a wait ends by these."""

    def __call__(self) -> tuple[Command, ...]:
        """What has been asked for since the last call."""
        if self._keys:
            self._read_keys()
        self.quits = self._quits  # first: a signal may come between the two
        commands = tuple(self._pressed)
        del self._pressed[: len(commands)]
        return commands

    def interrupt(self) -> None:
        """One more Ctrl-C."""
        self._pressed.append(INTERRUPTS[min(self._interrupts, len(INTERRUPTS) - 1)])
        self._interrupts += 1
        self._quits += 1

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Signals are commands for as long as this lasts; in another thread than the main one, nothing happens."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {
            signal.SIGINT: signal.signal(signal.SIGINT, self._on_interrupt),
            signal.SIGTERM: signal.signal(signal.SIGTERM, self._on_terminate),
            signal.SIGHUP: signal.signal(signal.SIGHUP, self._on_terminate),
        }
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextlib.contextmanager
    def keys(self) -> Iterator[bool]:
        """Single keys are commands for as long as this lasts; yields whether there is a terminal to press them on."""
        if not _is_terminal(self._terminal):
            yield False
            return
        import termios
        import tty

        file = self._terminal.fileno()
        before = termios.tcgetattr(file)
        try:
            tty.setcbreak(file)
            self._keys = True
            yield True
        finally:
            self._keys = False
            with contextlib.suppress(termios.error):  # a terminal that has gone needs nothing put back
                termios.tcsetattr(file, termios.TCSADRAIN, before)

    async def agreed(self) -> bool:
        """Whether the next line that is typed says yes; no where there is no terminal."""
        if not _is_terminal(self._terminal):
            return False
        while not self._readable():
            await asyncio.sleep(_POLL_S)
        return self._terminal.readline().strip().lower() in ("y", "yes")

    def _on_interrupt(self, _number: int, _frame: FrameType | None) -> None:
        self.interrupt()

    def _on_terminate(self, number: int, _frame: FrameType | None) -> None:
        self._pressed.append(Command.LAND)
        self._quits += number == signal.SIGTERM

    def _read_keys(self) -> None:
        while self._keys and self._readable():
            try:
                key = os.read(self._terminal.fileno(), 1)
            except OSError:
                key = b""
            self._keys = bool(key)  # nothing to read, and yet readable: the terminal has gone
            if key in KEYS:
                self._pressed.append(KEYS[key])

    def _readable(self) -> bool:
        return bool(select.select([self._terminal], [], [], 0.0)[0])


def _is_terminal(stream: TextIO) -> bool:
    try:
        return stream.isatty()
    except ValueError:  # closed
        return False
