"""Worlds: `data/worlds/*.yaml`. A change of a figure is a new version, since results name world and version."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from lcd_flight.model import InputError, TaskSampler, World
from lcd_flight.worlds.data_file import Strict, read
from lcd_flight.worlds.vehicles import Amounts, NotNegative, Positive, load_vehicle

_DATA = Path(__file__).parent / "data" / "worlds"


class SamplerData(Strict):
    """See `model.TaskSampler`."""

    waypoints: Annotated[int, Field(ge=2)]
    box_m: tuple[Positive, Positive, Positive]
    margin_m: NotNegative
    distance_m: tuple[Positive, Positive]
    yaw_span_rad: NotNegative


class WorldData(Strict):
    """A world file; keys are those of `model.World`."""

    name: str
    version: Annotated[int, Field(ge=1)]
    vehicle: str
    motor_time_constant_s: Positive
    motor_noise: NotNegative
    drag_configurations: Annotated[tuple[Amounts, ...], Field(min_length=1)]
    speed: Positive
    sampler: SamplerData
    loop: Literal["paper", "flight"]
    start_aligned: bool
    source: str


def world_names() -> list[str]:
    """The worlds that ship."""
    return sorted(path.stem for path in _DATA.glob("*.yaml"))


@cache
def load_world(name: str) -> World:
    """A world by name; `NAME@SPEED` is the same world at another mean speed in m/s, e.g. `crazyflie-flight@1.5`.

    Raises:
        InputError: there is none of this name, or the speed is not a positive number.
    """
    base, at, speed = name.partition("@")
    if base not in world_names():
        raise InputError(f"world {name!r} is not known; worlds: {', '.join(world_names())}")
    world = _shipped_world(base)
    return replace(world, name=name, speed=_speed(name, speed)) if at else world


def _speed(name: str, text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 < speed < math.inf:
        raise InputError(f"world {name!r}: {text!r} is no speed; write a positive number of m/s after the @")
    return speed


def _shipped_world(name: str) -> World:
    data = read(_DATA / f"{name}.yaml", WorldData)
    vehicle = replace(
        load_vehicle(data.vehicle),
        motor_time_constant_s=data.motor_time_constant_s,
        motor_noise=data.motor_noise,
    )
    return World(
        name=data.name,
        version=data.version,
        base_vehicle=vehicle,
        drag_configurations=data.drag_configurations,
        speed=data.speed,
        sampler=TaskSampler(**data.sampler.model_dump()),
        loop=data.loop,
        start_aligned=data.start_aligned,
        source=data.source,
    )
