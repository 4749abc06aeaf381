from __future__ import annotations

import asyncio
import contextlib
import io
import os
import pty
import signal
import termios
import threading
from collections.abc import Iterator
from typing import TextIO

import pytest

from lcd_flight.flight.operator import Operator
from lcd_flight.model import Command


@pytest.fixture
def terminal() -> Iterator[tuple[int, TextIO]]:
    """The person's end and the program's end of a terminal."""
    person, program = pty.openpty()
    with os.fdopen(program, "r") as stream:
        yield person, stream
    os.close(person)


def test_interrupts_get_graver() -> None:
    operator = Operator(io.StringIO())
    with operator.listening():
        for _ in range(4):
            signal.raise_signal(signal.SIGINT)
    assert operator() == (Command.LAND, Command.DESCEND, Command.STOP_MOTORS, Command.STOP_MOTORS)


def test_they_do_so_over_several_ticks() -> None:
    operator = Operator(io.StringIO())
    found = []
    with operator.listening():
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)
            found.append(operator())
    assert found == [(Command.LAND,), (Command.DESCEND,), (Command.STOP_MOTORS,)]
    assert operator() == ()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_terminated_process_and_a_lost_terminal_land(number: signal.Signals) -> None:
    operator = Operator(io.StringIO())
    with operator.listening():
        signal.raise_signal(number)
        signal.raise_signal(number)
    assert operator() == (Command.LAND, Command.LAND)


def test_what_ends_a_wait_is_an_interrupt_or_a_termination_whose_command_was_read() -> None:
    operator, found = Operator(io.StringIO()), []
    with operator.listening():
        for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
            signal.raise_signal(number)
            found.append(operator.quits)
            operator()
    assert [*found, operator.quits] == [0, 0, 1, 2]


def test_the_handlers_before_are_put_back_also_after_an_error() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    during: list[object] = []
    with contextlib.suppress(ZeroDivisionError), Operator(io.StringIO()).listening():
        during = [signal.getsignal(number) for number in numbers]
        raise ZeroDivisionError
    assert all(a is not b for a, b in zip(during, before, strict=True))
    assert [signal.getsignal(number) for number in numbers] == before


def test_in_another_thread_signals_are_left_alone() -> None:
    found: list[bool] = []
    before = signal.getsignal(signal.SIGINT)  # a process in the background may be told to ignore it

    def listen() -> None:
        with Operator(io.StringIO()).listening():
            found.append(signal.getsignal(signal.SIGINT) is before)

    thread = threading.Thread(target=listen)
    thread.start()
    thread.join()
    assert found == [True]


def test_keys(terminal: tuple[int, TextIO]) -> None:
    person, program = terminal
    operator = Operator(program)
    with operator.keys() as there:
        assert there
        os.write(person, b"l r?")
        assert operator() == (Command.LAND, Command.STOP_MOTORS, Command.RESUME)
        assert operator() == ()


def test_keys_count_only_while_they_are_listened_to(terminal: tuple[int, TextIO]) -> None:
    person, program = terminal
    operator = Operator(program)
    os.write(person, b"l")
    assert operator() == ()


@pytest.mark.parametrize("fails", [False, True])
def test_the_terminal_is_put_back(terminal: tuple[int, TextIO], fails: bool) -> None:
    _, program = terminal
    before = termios.tcgetattr(program)
    try:
        with Operator(program).keys():
            assert not termios.tcgetattr(program)[3] & termios.ICANON
            if fails:
                raise ZeroDivisionError
    except ZeroDivisionError:
        assert fails
    assert termios.tcgetattr(program) == before


def test_a_terminal_that_goes_away_ends_the_keys() -> None:
    person, program = pty.openpty()
    with os.fdopen(program, "r") as stream:
        operator = Operator(stream)
        with operator.keys():
            os.close(person)
            assert operator() == ()
            assert operator() == ()


@pytest.mark.parametrize("stream", ["string", "closed", "pipe"])
def test_without_a_terminal_there_are_no_keys(stream: str) -> None:
    reading, writing = os.pipe()
    with os.fdopen(reading, "r") as pipe, os.fdopen(writing, "w") as other_end:
        other_end.write("l y\n")
        other_end.flush()
        no_terminal: TextIO = pipe if stream == "pipe" else io.StringIO("l y\n")
        if stream == "closed":
            no_terminal.close()
        operator = Operator(no_terminal)
        with operator.keys() as there:
            assert not there
            assert operator() == ()
        assert asyncio.run(operator.agreed()) is False


@pytest.mark.parametrize(
    ("typed", "agreed"), [("y\n", True), ("YES\n", True), ("n\n", False), ("\n", False), ("yo\n", False)]
)
def test_agreement_is_a_line_that_says_so(terminal: tuple[int, TextIO], typed: str, agreed: bool) -> None:
    person, program = terminal
    os.write(person, typed.encode())
    assert asyncio.run(Operator(program).agreed()) is agreed


def test_waiting_for_an_answer_does_not_hold_up_the_loop(terminal: tuple[int, TextIO]) -> None:
    person, program = terminal

    async def main() -> tuple[int, bool]:
        asking = asyncio.ensure_future(Operator(program).agreed())
        turns = 0
        while not asking.done():
            await asyncio.sleep(0.01)
            turns += 1
            if turns == 10:
                os.write(person, b"y\n")
        return turns, await asking

    turns, agreed = asyncio.run(main())
    assert agreed
    assert turns >= 10
