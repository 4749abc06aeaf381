"""Asking the system to let the loop run on time. What it will not give is said, and the flight goes on without."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import sys
from collections.abc import Iterator

PRIORITY = 50
"""Of SCHED_FIFO: above ordinary programs, below the kernel's own threads."""
SWITCH_INTERVAL_S = 2e-4
"""How long another Python thread may hold the interpreter; the default of 5 ms is half a tick."""

_MCL_CURRENT_AND_FUTURE = 1 | 2
"""mlockall(2)"""


@contextlib.contextmanager
def realtime() -> Iterator[tuple[str, ...]]:
    """No garbage collection, a short switch interval, real-time priority, memory locked; all undone at the end.

    Yields one line for each thing that was not permitted.
    """
    with contextlib.ExitStack() as stack:
        stack.enter_context(_without_collection())
        stack.enter_context(_switching_fast())
        yield tuple(note for note in (_take_priority(stack), _lock_memory(stack)) if note)


@contextlib.contextmanager
def prioritised() -> Iterator[str]:
    """Real-time priority alone, undone at the end: for what must keep time and may live for days.

    Yields why it was not permitted, or nothing.
    """
    with contextlib.ExitStack() as stack:
        yield _take_priority(stack)


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    was_enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if was_enabled:
            gc.enable()


@contextlib.contextmanager
def _switching_fast() -> Iterator[None]:
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before_s)


def _take_priority(stack: contextlib.ExitStack) -> str:
    """Real-time priority for this thread; empty, or why not."""
    if not hasattr(os, "sched_setscheduler"):
        return "this system has no real-time priority; ticks may be late"
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        return f"no real-time priority ({error.strerror}): ticks may be late on a busy machine; see `ulimit -r`"
    stack.callback(os.sched_setscheduler, 0, before, parameters)
    return ""


def _lock_memory(stack: contextlib.ExitStack) -> str:
    """No page of this process is swapped out; empty, or why not."""
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "mlockall"):
        return "this system cannot lock memory; ticks may be late"
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) != 0:
        reason = os.strerror(ctypes.get_errno())
        return f"memory not locked ({reason}): ticks may be late where memory is short; see `ulimit -l`"
    stack.callback(libc.munlockall)
    return ""
