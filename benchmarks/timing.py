"""What the benchmarks of the links share: timing call by call, at a flight's switch interval, and rows of a table."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

PERIOD_S = 0.002
"""A flight's is 10 ms; faster here, to be done in seconds."""
SWITCH_INTERVAL_S = 2e-4
"""As the flight loop sets it."""
SHARES = (("median", 50.0), ("99th percentile", 99.0))


def paced(call: Callable[[], object], number: int) -> list[float]:
    """How long each call took, in us."""
    taken = []
    for _ in range(number):
        began = time.perf_counter_ns()
        call()
        taken.append((time.perf_counter_ns() - began) * 1e-3)
        time.sleep(PERIOD_S)
    return taken


@contextlib.contextmanager
def as_in_flight() -> Iterator[None]:
    """With the flight's switch interval."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def row(
    what: str, ours_us: Sequence[float], peer_us: Sequence[float] | None, share: float, name: str | None
) -> dict[str, Any]:
    """One row: a percentile of both sides."""
    ours = float(np.percentile(ours_us, share))
    peer = None if peer_us is None else float(np.percentile(peer_us, share))
    return {
        "what": what,
        "unit": "us",
        "ours": ours,
        "peer": peer,
        "peer_name": name,
        "ratio": None if peer is None else peer / ours,
    }
