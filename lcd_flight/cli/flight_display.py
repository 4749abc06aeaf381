"""Shows a flight while it goes on, from a thread of its own: a terminal that blocks must never delay a tick."""

from __future__ import annotations

import threading
from queue import SimpleQueue
from types import TracebackType
from typing import Self

from lcd_flight.cli.terminal import Terminal
from lcd_flight.flight.progress import ByHand, Checked, Connected, Flying
from lcd_flight.model import LegKind, Phase

Event = Connected | Checked | ByHand | Flying
CAPACITY = 100
"""Reports that may wait for the terminal; further ones are dropped, since newer ones follow."""
BAR_WIDTH = 20
PHASE_LABELS = {
    Phase.TAKEOFF: "TAKEOFF",
    Phase.HOLD: "HOLD",
    Phase.TRACK: "FLY",
    Phase.LAND: "LAND",
    Phase.LANDED: "LANDED",
    Phase.BRAKE_HOLD: "BRAKE",
    Phase.LAND_NOW: "LAND NOW",
    Phase.DESCEND_BLIND: "DESCEND",
    Phase.HANDED_OVER: "HAND OVER",
    Phase.KILL: "CUT",
    Phase.CRASHED: "CRASHED",
}
_ABNORMAL = (Phase.BRAKE_HOLD, Phase.LAND_NOW, Phase.DESCEND_BLIND, Phase.HANDED_OVER, Phase.KILL, Phase.CRASHED)


class FlightDisplay:
    """The flight's progress callback; a context manager, so that its thread ends and the last line stands."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self._queue: SimpleQueue[Event | None] = SimpleQueue()
        # A daemon: a terminal that hangs for ever must not keep the process.
        self._thread = threading.Thread(target=self._run, name="flight-display", daemon=True)

    def __call__(self, event: Event) -> None:
        """Take an event; never waits. The first begins the thread, which so inherits the priority of the loop."""
        if self._thread.ident is None:  # decision 0081: below the loop's priority it could keep ticks waiting
            self._thread.start()
        telling = not isinstance(event, Flying) or event.entered or event.findings or event.messages
        if telling or self._queue.qsize() < CAPACITY:
            self._queue.put(event)

    def __enter__(self) -> Self:
        """Nothing to do before the first event."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Show what is left, for a second at most."""
        if self._thread.ident is not None:
            self._queue.put(None)
            self._thread.join(1.0)

    def _run(self) -> None:
        while (event := self._queue.get()) is not None:
            match event:
                case Connected():
                    self._terminal.line("CONNECT", f"{event.uri}  {event.description}")
                case Checked():
                    self._checked(event)
                case ByHand():
                    self._by_hand(event)
                case Flying():
                    self._flying(event)
        self._terminal.end_status()

    def _checked(self, event: Checked) -> None:
        verdict = "pass" if event.ok else "refused"
        self._terminal.line("PREFLIGHT", f"{' | '.join(check.text for check in event.checks if check.ok)}  {verdict}")
        for check in event.checks:
            if not check.ok:
                self._terminal.warn(check.text)

    def _by_hand(self, event: ByHand) -> None:
        if event.checks:
            latest = event.checks[-1]
            self._terminal.line("BY HAND", latest.text, "" if latest.ok else "red")
        if event.request:
            self._terminal.line("BY HAND", f"please: {event.request}")

    def _flying(self, event: Flying) -> None:
        if event.entered and event.phase in PHASE_LABELS:
            self._terminal.line(PHASE_LABELS[event.phase], _entered(event), "red" if event.phase in _ABNORMAL else "")
        for message in event.messages:
            self._terminal.line("VEHICLE", message)
        for finding in event.findings:
            self._terminal.warn(f"{event.time_s:.1f}s {finding.message}")
        if event.phase.airborne:
            self._terminal.status(_status(event))


def _entered(event: Flying) -> str:
    """What begins with a phase."""
    if event.phase is Phase.HANDED_OVER:
        return f"{event.time_s:.1f} s after take-off; its poses go on until it is disarmed, Ctrl-C ends them"
    if event.kind is None or event.phase in _ABNORMAL or event.phase is Phase.LANDED:
        return f"{event.time_s:.1f} s after take-off"
    what = {LegKind.TRANSFER: "to the start of the next item", LegKind.TRAJECTORY: f"{event.waypoints} waypoints"}
    return f"{what.get(event.kind, '')}  {event.leg_duration_s:.1f} s".strip()


def _status(event: Flying) -> str:
    """One line that changes in place."""
    share = min(event.leg_time_s / event.leg_duration_s, 1.0) if event.leg_duration_s > 0.0 else 0.0
    filled = round(share * BAR_WIDTH)
    parts = [f"[{'#' * filled}{'-' * (BAR_WIDTH - filled)}] {event.leg_time_s:4.1f}/{event.leg_duration_s:.1f} s"]
    if event.waypoints:
        parts.append(f"wp {event.waypoint}/{event.waypoints}")
    if event.error_m is not None:
        parts.append(f"err {event.error_m:.2f} m (max {event.max_error_m:.2f})")
    if event.thrust_share is not None:
        parts.append(f"thr {event.thrust_share:.0%}")
    if event.battery_V is not None:
        parts.append(f"{event.battery_V:.2f} V")
    return "  ".join([*parts, f"loop {event.rate_hz:.1f} Hz"])
