"""Whatever goes wrong, in whatever order: severity does not fall, and nothing is sent that may not be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

from flight_bench import TICK_NS, Flight, fly, healthy, setup, with_link, with_telemetry, without_pose
from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.flight.memory import Memory
from lcd_flight.flight.replay import differences
from lcd_flight.flight.tick import tick
from lcd_flight.model import Command, MotorRequest, Phase, State, TickInputs
from lcd_flight.model.frames import IDENTITY, tilt_of

RANK = {
    Phase.TAKEOFF: 0,
    Phase.HOLD: 0,
    Phase.TRACK: 0,
    Phase.LAND: 1,
    Phase.BRAKE_HOLD: 1,
    Phase.LAND_NOW: 2,
    Phase.DESCEND_BLIND: 3,
    Phase.LANDED: 4,
    Phase.KILL: 5,
    Phase.CRASHED: 5,
}
TICKS = 450
Chosen = tuple[str, int, int, float]
"""Kind of fault, first tick, how many, how much."""


def moved(inputs: TickInputs, offset_m: float, speed: float) -> TickInputs:
    state = inputs.pose.state
    if state is None:
        return inputs
    x, y, z = state.p_WB
    vx, vy, vz = state.v_WB_W
    there = replace(state, p_WB=(x + offset_m, y, z), v_WB_W=(vx + speed, vy, vz))
    return replace(inputs, pose=replace(inputs.pose, state=there))


KINDS: dict[str, Callable[[TickInputs, int, float], TickInputs]] = {
    "no pose": lambda i, k, _: without_pose(i, k * TICK_NS),
    "broken pose": lambda i, _k, _x: moved(i, math.nan, 0.0),
    "offset": lambda i, _, x: moved(i, 3.0 * x, 0.0),
    "fast": lambda i, _, x: moved(i, 0.0, 8.0 * x),
    "rejects": lambda i, k, _: replace(i, pose=replace(i.pose, rejected=k)),
    "slow pose": lambda i, _, x: replace(i, pose=replace(i.pose, rate_hz=100.0 * x)),
    "silent link": lambda i, k, _: with_link(i, age_ns=k * TICK_NS),
    "closed link": lambda i, _k, _x: with_link(i, connected=False),
    "lossy link": lambda i, _, x: with_link(i, loss_share=0.5 * x),
    "battery": lambda i, _, x: with_telemetry(i, battery_V=2.5 + x),
    "saturated": lambda i, _k, _x: with_telemetry(i, motor_shares=(1.0, 1.0, 1.0, 1.0)),
    "mute": lambda i, _k, _x: with_link(i, telemetry=None),
    "late": lambda i, _, x: replace(i, deadline_ns=i.now_ns - round(4e7 * x), missed=round(3 * x)),
    "crashed": lambda i, _k, _x: with_telemetry(i, crashed=True),
}

faults = st.lists(
    st.tuples(st.sampled_from(sorted(KINDS)), st.integers(1, TICKS - 20), st.integers(1, 250), st.floats(0.0, 1.0)),
    max_size=5,
)
orders = st.dictionaries(
    st.integers(-3, TICKS - 20), st.lists(st.sampled_from(list(Command)), min_size=1, max_size=2).map(tuple), max_size=4
)


def flown(chosen: list[Chosen], asked: dict[int, tuple[Command, ...]]) -> Flight:
    def fault(tick_: int, inputs: TickInputs) -> TickInputs:
        for kind, start, length, size in chosen:
            if start <= tick_ < start + length:
                inputs = KINDS[kind](inputs, tick_ - start + 1, size)
        return inputs

    return fly(fault=fault, orders=asked, ticks=TICKS)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(faults, orders)
def test_any_faults_in_any_order(
    chosen: list[tuple[str, int, int, float]], asked: dict[int, tuple[Command, ...]]
) -> None:
    flight = flown(chosen, asked)
    check_severity(flight)
    check_setpoints(flight)
    check_motors(flight)
    assert differences(flight, setup()) == []


def check_severity(flight: Flight) -> None:
    """It only rises once in the air, but for a resumed hold."""
    for (_, before), (inputs, after) in pairwise(flight):
        if before.phase in RANK:
            resumed = before.phase is Phase.BRAKE_HOLD and Command.RESUME in inputs.commands
            assert resumed or RANK[after.phase] >= RANK[before.phase]


def check_setpoints(flight: Flight) -> None:
    """Sent from arming to the end and at no other time, finite and within the limits."""
    gate = setup().gate
    for _, decided in flight:
        assert (decided.setpoint is not None) == (decided.phase.airborne or decided.phase is Phase.ARMED)
        if decided.setpoint is not None:
            assert decided.setpoint.is_finite()
            assert 0.0 <= decided.setpoint.thrust_N <= gate.thrust_N
            assert tilt_of(decided.setpoint.q_WB) <= gate.tilt_rad + 1e-9
            assert math.isclose(math.hypot(*decided.setpoint.q_WB), 1.0, abs_tol=1e-9)


def check_motors(flight: Flight) -> None:
    """A stop is repeated for ever; arming is asked for at most once, and taken back on the ground."""
    asked = [decided.motors for _, decided in flight]
    assert asked.count(MotorRequest.ARM) <= 1
    for _, decided in flight:
        assert (decided.motors is MotorRequest.STOP) or decided.phase is not Phase.KILL
        assert decided.motors is not MotorRequest.DISARM or not decided.phase.airborne


numbers = st.floats(allow_nan=True, allow_infinity=True, width=64)
vectors = st.tuples(numbers, numbers, numbers)
sane = st.floats(-1e6, 1e6)
turns = st.sampled_from([IDENTITY, (1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.8, 0.0), (0.0, 0.0, 0.0, 1.09)])
states = st.builds(State, vectors, vectors, st.tuples(numbers, numbers, numbers, numbers), vectors) | st.builds(
    State, st.tuples(sane, sane, sane), st.tuples(sane, sane, sane), turns, st.tuples(sane, sane, sane)
)


@st.composite
def garbage(draw: Any) -> TickInputs:
    """Inputs that no honest source would give."""
    inputs = healthy(draw(st.integers(0, 9)), draw(states), draw(st.integers(0, 2**62)), draw(commands))
    inputs = replace(inputs, deadline_ns=draw(st.integers(0, 2**62)), missed=draw(st.integers(0, 2**31)))
    age_ns = draw(st.none() | st.integers(-(2**40), 2**40))
    inputs = replace(inputs, pose=replace(inputs.pose, rate_hz=draw(numbers), age_ns=age_ns, rejected=draw(counts)))
    inputs = with_telemetry(
        inputs, battery_V=draw(st.none() | numbers), motor_shares=draw(st.lists(numbers).map(tuple))
    )
    return with_link(inputs, loss_share=draw(numbers), age_ns=draw(st.none() | st.integers(0, 2**62)))


commands = st.lists(st.sampled_from(list(Command)), max_size=3).map(tuple)
counts = st.integers(0, 2**31)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.lists(garbage(), min_size=1, max_size=8))
def test_no_input_makes_the_tick_raise_or_send_nonsense(sequence: list[TickInputs]) -> None:
    memory, flight = Memory(), Flight()
    for inputs in (healthy(0, STANDING, 0, (Command.CHECK,)), *READY, *sequence):
        decided, memory = tick(inputs, setup(), memory)
        flight.append((inputs, decided))
    check_setpoints(flight)


STANDING = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
READY = [
    healthy(n, STANDING, n * TICK_NS, (command,))
    for n, command in enumerate((Command.CHECKED, Command.ARM, Command.TAKEOFF), start=1)
]
