"""What a block of LANES vehicles does in one tick: each part of `lane`, `guidance` and `judge` as a loop over lanes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcd_flight.model import FloatArray, SeedArray
from sim_bridge.kernels import rows
from sim_bridge.kernels.guidance import (
    ADAPTIVE,
    AGAINST_DRAG,
    FEED_FORWARD,
    Law,
    ask_force,
    ask_force_adaptively,
    ask_force_against_drag,
    ask_wrench,
    command_attitude,
    command_rotors,
    command_rotors_in_airflow,
    refer,
    stabilise,
)
from sim_bridge.kernels.judge import count_clips, judge_position, judge_yaw
from sim_bridge.kernels.lane import (
    disturb,
    draw,
    first_stage,
    last_stage,
    look,
    second_stage,
    spin,
    third_stage,
)
from sim_bridge.kernels.multirotor import Airframe
from sim_bridge.kernels.onboard import Onboard
from sim_bridge.kernels.rows import LANES


class Craft(NamedTuple):
    """What flies it, all the way down to the rotors."""

    air: Airframe
    law: Law
    onboard: Onboard
    flight_loop: bool
    """Whether the law's thrust and attitude go to the onboard controller; else its force and moment to the rotors."""
    steps: int
    """Runge-Kutta steps of a tick; in the flight loop, periods of the onboard controller."""
    step_s: float
    motor_noise: float
    """rad/s"""
    motor_decay: float
    """exp(-t / tau) of half a step t."""
    initial_speed: float
    """rad/s, of every rotor."""


def fly_tick(memory: FloatArray, keys: SeedArray, tick: int, craft: Craft) -> None:
    """Ten milliseconds of flight under the setpoint or the command given last, then the motors' noise."""
    for _ in range(craft.steps):
        if craft.flight_loop:
            for lane in range(LANES):
                stabilise(memory, lane, craft.air, craft.onboard)
        if craft.air.lifts:
            fly_step(memory, craft, True)
        else:
            fly_step(memory, craft, False)
    if craft.motor_noise > 0.0:
        for lane in range(LANES):
            draw(memory, lane, keys[lane], np.uint64(tick))
        for lane in range(LANES):
            disturb(memory, lane, craft.air, craft.motor_noise)


def fly_step(memory: FloatArray, craft: Craft, lifts: bool) -> None:
    """One Runge-Kutta step."""
    for lane in range(LANES):
        first_stage(memory, lane, craft.air, craft.step_s, lifts)
    for lane in range(LANES):
        spin(memory, lane, craft.air, craft.motor_decay)
    for lane in range(LANES):
        second_stage(memory, lane, craft.air, craft.step_s, lifts)
    for lane in range(LANES):
        third_stage(memory, lane, craft.air, craft.step_s, lifts)
    for lane in range(LANES):
        last_stage(memory, lane, craft.air, craft.step_s, lifts)


def judge_tick(memory: FloatArray, tick: int) -> None:
    """Sample the plans, and say how far off the vehicles are."""
    for lane in range(LANES):
        refer(memory, lane, float(tick))
    for lane in range(LANES):
        judge_position(memory, lane, float(tick))
    for lane in range(LANES):
        judge_yaw(memory, lane)
        count_clips(memory, lane)


def command_tick(memory: FloatArray, tick: int, craft: Craft, has_gaps: bool) -> None:
    """Let the law act on what it sees."""
    if has_gaps:
        for lane in range(LANES):
            look(memory, lane, float(tick))
        command(memory, craft, rows.SEEN)
    else:
        command(memory, craft, rows.MOTION)


def command(memory: FloatArray, craft: Craft, seen: int) -> None:
    """The law of the loop that is flown. seen: the row of the motion that it is given."""
    if craft.flight_loop:
        for lane in range(LANES):
            command_attitude(memory, lane, seen, craft.law, craft.onboard)
        return
    ask(memory, craft.law, seen)
    if craft.law.form == AGAINST_DRAG:
        for lane in range(LANES):
            command_rotors_in_airflow(memory, lane, seen, craft.law, craft.air)
    else:
        for lane in range(LANES):
            command_rotors(memory, lane, craft.law, craft.air)


def ask(memory: FloatArray, law: Law, seen: int) -> None:
    """The paper's loop down to thrust and moment, in the law's form."""
    if law.form == AGAINST_DRAG:
        for lane in range(LANES):
            ask_force_against_drag(memory, lane, seen, law)
    elif law.form == ADAPTIVE:
        for lane in range(LANES):
            ask_force_adaptively(memory, lane, seen, law)
    else:
        for lane in range(LANES):
            ask_force(memory, lane, seen, law)
    if law.form == FEED_FORWARD:
        for lane in range(LANES):
            ask_wrench(memory, lane, seen, law, True)
    else:
        for lane in range(LANES):
            ask_wrench(memory, lane, seen, law, False)
