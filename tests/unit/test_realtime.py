from __future__ import annotations

import ctypes
import gc
import os
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from lcd_flight.flight.realtime import PRIORITY, SWITCH_INTERVAL_S, prioritised, realtime


class System:
    """What the operating system was asked for, and whether it is in the mood."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, permits: bool) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.permits = permits
        monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_OTHER)
        monkeypatch.setattr(os, "sched_getparam", lambda _pid: os.sched_param(0))
        monkeypatch.setattr(os, "sched_setscheduler", self.set_scheduler)
        libc = SimpleNamespace(mlockall=self.lock, munlockall=lambda: self.calls.append(("unlock",)))
        monkeypatch.setattr(ctypes, "CDLL", lambda *_args, **_options: libc)

    def set_scheduler(self, _pid: int, policy: int, parameters: os.sched_param) -> None:
        if not self.permits:
            raise PermissionError(1, "Operation not permitted")
        self.calls.append((policy, parameters.sched_priority))

    def lock(self, flags: int) -> int:
        self.calls.append(("lock", flags))
        ctypes.set_errno(0 if self.permits else 12)
        return 0 if self.permits else -1


def test_takes_what_is_permitted_and_puts_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(monkeypatch, permits=True)
    with realtime() as notes:
        assert notes == ()
        assert system.calls == [(os.SCHED_FIFO, PRIORITY), ("lock", 3)]
    assert system.calls[2:] == [("unlock",), (os.SCHED_OTHER, 0)]


def test_goes_on_without_what_is_not_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(monkeypatch, permits=False)
    with realtime() as notes:
        assert len(notes) == 2
        assert "no real-time priority (Operation not permitted)" in notes[0]
        assert "memory not locked (Cannot allocate memory)" in notes[1]
    assert system.calls == [("lock", 3)]


def test_priority_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    system = System(monkeypatch, permits=True)
    with prioritised() as objection:
        assert (objection, gc.isenabled()) == ("", True)
        assert system.calls == [(os.SCHED_FIFO, PRIORITY)]
    assert system.calls[1:] == [(os.SCHED_OTHER, 0)]
    system.permits = False
    with prioritised() as objection:
        assert "no real-time priority" in objection


@pytest.mark.parametrize("fails", [False, True])
def test_collection_and_switch_interval_are_restored(monkeypatch: pytest.MonkeyPatch, fails: bool) -> None:
    System(monkeypatch, permits=True)
    interval_s = sys.getswitchinterval()
    try:
        with realtime():
            assert not gc.isenabled()
            assert gc.get_freeze_count() > 0
            assert sys.getswitchinterval() == pytest.approx(SWITCH_INTERVAL_S)
            if fails:
                raise ZeroDivisionError
    except ZeroDivisionError:
        assert fails
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == interval_s


def test_collection_that_was_off_stays_off(monkeypatch: pytest.MonkeyPatch) -> None:
    System(monkeypatch, permits=True)
    gc.disable()
    try:
        with realtime():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
