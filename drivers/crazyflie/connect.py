"""Connecting: with a time limit, and anew where an answer was lost that cannot be asked for twice. All of it blocks."""

from __future__ import annotations

import threading
from pathlib import Path

from drivers.crazyflie.session import Session
from lcd_flight.model import Clock, RefusedError

SILENCE_NS = 1_000_000_000
"""A connection that has not moved on for so long has lost an answer."""
UNHEARD_ATTEMPTS = 3
"""Nobody is there who has not said a word by then."""
_POLL_S = 0.02


def connect(uri: str, toc_cache: Path, clock: Clock, limit_s: float, cancelled: threading.Event) -> Session:
    """A session that has all tables and parameter values; whoever gets it shuts it.

    cancelled: set by whoever does not want to wait any longer.

    Raises:
        RefusedError: nobody answers, or the driver cannot be opened; with the remedy.
    """
    deadline_ns = clock.now_ns() + round(limit_s * 1e9)
    heard, unheard = False, 0
    while True:
        session = Session(toc_cache, clock)
        connected = False
        try:
            connected = _completed(session, uri, clock, deadline_ns, cancelled)
        finally:
            if not connected:
                session.shut()
        if connected:
            return session
        heard, unheard = heard or session.received > 0, unheard + (session.received == 0)
        if session.failure:
            remedy = "plug in the radio or cable, and check the rights to it"
            raise RefusedError(f"cannot open {uri} ({session.failure}): {remedy}")
        if cancelled.is_set():
            raise RefusedError(f"connecting to {uri} was interrupted")
        if clock.now_ns() >= deadline_ns or unheard >= UNHEARD_ATTEMPTS:
            raise RefusedError(_in_vain(uri, heard))


def _completed(session: Session, uri: str, clock: Clock, deadline_ns: int, cancelled: threading.Event) -> bool:
    """Whether one attempt came to its end."""
    session.open_link(uri)
    while not session.ready.wait(_POLL_S):
        now_ns = clock.now_ns()
        stalled = now_ns - session.progress_ns > SILENCE_NS
        if session.failure or stalled or now_ns >= deadline_ns or cancelled.is_set():
            return False
    return True


def _in_vain(uri: str, heard: bool) -> str:
    """Why no attempt came to its end."""
    if not heard:
        return f"no answer from {uri}: is the vehicle on, in range, and at this address?"
    return f"the connection to {uri} does not come about: the link loses too much, or another program holds the vehicle"
