"""Plans in files come back to the bit, and whatever is damaged is refused in one line or does not matter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_bench import VEHICLE, mission, plan_file

from lcd_flight.mission.plan_cache import PlanCache
from lcd_flight.mission.plan_file import planned_from_file
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.mission.planned import PlannedMission
from lcd_flight.model import COEFFICIENTS, InputError, RefusedError, Trajectory
from lcd_flight.wire.polynomial_csv import decode, encode

Result = TypeVar("Result")
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
SHARES = st.floats(0.0, 1.0)
DURATIONS = st.floats(min_value=0.0, exclude_min=True, allow_infinity=False)


def outcome(act: Callable[[], Result]) -> tuple[list[str], Result | None]:
    """The lines with which something is refused, or what comes of it."""
    try:
        return [], act()
    except (ValueError, InputError, RefusedError) as error:
        return str(error).splitlines(), None


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    """Any finite numbers, sound or not."""
    segments = draw(st.integers(1, 4))
    durations = draw(st.lists(DURATIONS, min_size=segments, max_size=segments))
    size = 4 * segments * COEFFICIENTS
    coefficients = draw(st.lists(NUMBERS, min_size=size, max_size=size))
    return Trajectory(np.array(durations), np.array(coefficients).reshape(4, segments, COEFFICIENTS))


@settings(deadline=None, max_examples=50)
@given(trajectories())
def test_csv_keeps_every_bit(trajectory: Trajectory) -> None:
    found = decode(encode(trajectory))
    assert np.array_equal(found.durations_s, trajectory.durations_s)
    assert np.array_equal(found.coefficients, trajectory.coefficients)


@settings(deadline=None, max_examples=200)
@given(st.text(alphabet="0123456789.,eE+-# \nxnaif", max_size=400))
def test_any_text_is_a_trajectory_or_one_line(text: str) -> None:
    told, found = outcome(lambda: decode(text))
    assert len(told) == 1 if found is None else np.isfinite(found.coefficients).all()


@dataclass(frozen=True)
class Kept:
    """A plan in a file and in the cache."""

    file: Path
    cache: Path
    plan: PlannedMission


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Kept:
    folder = tmp_path_factory.mktemp("plans")
    plan = plan_mission(mission(), VEHICLE, cache=PlanCache(folder / "cache"))
    return Kept(plan_file(folder), next((folder / "cache").iterdir()), plan)


@contextmanager
def damaged(path: Path, share: float, other: bytes) -> Iterator[None]:
    """The file with one byte replaced by some others."""
    whole = path.read_bytes()
    place = min(int(share * len(whole)), len(whole) - 1)
    path.write_bytes(whole[:place] + other + whole[place + 1 :])
    try:
        yield
    finally:
        path.write_bytes(whole)


def apart_m(one: PlannedMission, other: PlannedMission) -> float:
    """How far two flights are from each other, also in rad of yaw."""
    times = np.linspace(0.0, one.plan.duration_s, 300)
    return float(np.abs(one.plan.joined().derivative(times, 0) - other.plan.joined().derivative(times, 0)).max())


@settings(deadline=None, max_examples=300)
@given(SHARES, st.binary(max_size=2))
def test_a_damaged_plan_is_refused_or_flies_the_same_path(kept: Kept, share: float, other: bytes) -> None:
    with damaged(kept.file, share, other):
        told, found = outcome(lambda: planned_from_file(kept.file, mission(), VEHICLE))
    assert len(told) == 1 if found is None else apart_m(kept.plan, found) < 1e-4


@settings(deadline=None, max_examples=60)
@given(SHARES, st.binary(max_size=3))
def test_a_damaged_cache_never_hurts(kept: Kept, share: float, other: bytes) -> None:
    with damaged(kept.cache, share, other):
        again = plan_mission(mission(), VEHICLE, cache=PlanCache(kept.cache.parent))
    assert apart_m(kept.plan, again) < 1e-4
    assert len(again.notes) == (not again.summaries[0].cached)
