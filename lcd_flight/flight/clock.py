"""The real clock: monotonic nanoseconds, and sleep that wakes within a fraction of a millisecond.

asyncio's own sleep rounds up to whole milliseconds on epoll; a Linux timerfd on an absolute deadline, watched by the
event loop, does not. Python has it from 3.13; before that the C library is asked. Elsewhere asyncio's sleep serves.
"""

from __future__ import annotations

import asyncio
import ctypes
import functools
import os
import sys
import time

NS_PER_S = 1_000_000_000

_TFD_TIMER_ABSTIME = 1
"""timerfd_settime(2)"""


class RealClock:
    """The host's monotonic clock (`lcd_flight.model.Clock`)."""

    def now_ns(self) -> int:
        """Nanoseconds of CLOCK_MONOTONIC: steps of the wall clock have no effect."""
        return time.monotonic_ns()

    async def sleep_until(self, deadline_ns: int) -> None:
        """Return at the deadline, or at the loop's next turn where it has passed."""
        if deadline_ns <= time.monotonic_ns():
            await asyncio.sleep(0)
        elif sys.platform == "linux":
            await _sleep_on_timerfd(deadline_ns)
        else:
            await asyncio.sleep((deadline_ns - time.monotonic_ns()) / NS_PER_S)


async def _sleep_on_timerfd(deadline_ns: int) -> None:
    """Watch a timer of its own: creating one costs microseconds, and there is nothing to close later."""
    loop = asyncio.get_running_loop()
    expired: asyncio.Future[None] = loop.create_future()
    timer = armed_timer(deadline_ns)
    try:
        loop.add_reader(timer, _set, expired)
        await expired
    finally:
        loop.remove_reader(timer)
        os.close(timer)


def _set(future: asyncio.Future[None]) -> None:
    """The reader may be called again before the sleeper has run."""
    if not future.done():
        future.set_result(None)


def armed_timer(deadline_ns: int) -> int:
    """A file descriptor that becomes readable at `deadline_ns` of CLOCK_MONOTONIC; the caller closes it.

    Raises:
        OSError: the system has no timer to give.
    """
    if sys.version_info >= (3, 13):
        timer = os.timerfd_create(time.CLOCK_MONOTONIC, flags=os.TFD_NONBLOCK | os.TFD_CLOEXEC)
        os.timerfd_settime_ns(timer, flags=os.TFD_TIMER_ABSTIME, initial=deadline_ns)
        return timer
    return _armed_timer_by_libc(deadline_ns)


class _TimerSpec(ctypes.Structure):
    """`struct itimerspec`: interval, then first expiration, each in seconds and nanoseconds."""

    _fields_ = (
        ("interval_s", ctypes.c_long),
        ("interval_ns", ctypes.c_long),
        ("value_s", ctypes.c_long),
        ("value_ns", ctypes.c_long),
    )


def _armed_timer_by_libc(deadline_ns: int) -> int:
    """`armed_timer` before Python 3.13."""
    libc = _libc()
    timer = int(libc.timerfd_create(time.CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC))
    spec = _TimerSpec(0, 0, *divmod(deadline_ns, NS_PER_S))
    if timer < 0 or libc.timerfd_settime(timer, _TFD_TIMER_ABSTIME, ctypes.byref(spec), None) < 0:
        error = ctypes.get_errno()
        raise OSError(error, os.strerror(error))
    return timer


@functools.cache
def _libc() -> ctypes.CDLL:
    """The C library that this process already runs on."""
    return ctypes.CDLL(None, use_errno=True)
