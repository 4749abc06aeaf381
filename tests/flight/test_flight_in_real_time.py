"""One flight against the wall clock, pose over ZeroMQ; and what it refuses before."""

from __future__ import annotations

import os
import signal
import socket
import threading

import pytest
import zmq
from short_mission import Listener, mission, plan, vehicle

from lcd_flight.flight.session import run_flight
from lcd_flight.mission import Mission
from lcd_flight.model import Outcome, Phase, RefusedError, Tick, TickInputs

pytestmark = pytest.mark.realtime


def with_endpoint(endpoint: str) -> Mission:
    return mission(motion_capture={"endpoint": endpoint})


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


@pytest.mark.slow
def test_holds_its_rate_and_lands() -> None:
    """Judged by outcome: a machine that is too busy may make it land early, but never lose a tick unseen."""
    listener = Listener()
    result = run_flight(with_endpoint(free_endpoint()), plan(), vehicle(), observers=(listener,))
    assert result.outcome in (Outcome.LANDED, Outcome.ABORTED), result.reason
    assert listener.phases[-1] is Phase.LANDED
    first, last = listener.flight[0][0], listener.flight[-1][0]
    deadlines = (last.deadline_ns - first.deadline_ns) // 10_000_000
    assert deadlines == len(listener.flight) - 1 + sum(i.missed for i, _ in listener.flight[1:])
    assert result.figures.missed == sum(i.missed for i, _ in listener.flight)
    assert all(i.now_ns >= i.deadline_ns for i, _ in listener.flight)
    assert last.pose.received > 500
    assert result.figures.lateness_ms(0.5) < 10.0


@pytest.mark.slow
def test_a_terminated_process_lands_its_vehicle() -> None:
    def act(_inputs: TickInputs, tick: Tick) -> None:
        if tick.phase is Phase.TRACK and not terminated.is_set():
            terminated.set()
            os.kill(os.getpid(), signal.SIGTERM)

    terminated, listener = threading.Event(), Listener(act=act)
    result = run_flight(with_endpoint(free_endpoint()), plan(), vehicle(), observers=(listener,))
    assert terminated.is_set()
    assert result.outcome is Outcome.ABORTED
    assert listener.phases[-1] is Phase.LANDED
    assert listener.closed == 1


def test_a_port_in_use_is_refused_before_anything_moves() -> None:
    endpoint, listener = free_endpoint(), Listener()
    context = zmq.Context()
    taken = context.socket(zmq.PUB)
    try:
        taken.bind(endpoint)
        with pytest.raises(RefusedError, match=endpoint.rpartition(":")[2]):
            run_flight(with_endpoint(endpoint), plan(), vehicle(), observers=(listener,))
    finally:
        taken.close(0)
        context.term()
    assert listener.flight == []
    assert listener.closed == 1
