"""Given plans: read from a file, visited in turn, jittered around; whatever is wrong is one clear line."""

import re

import numpy as np
import pytest

from lcd_flight.learning.given import JITTER, jittered, load_plans
from lcd_flight.learning.rollouts import Plans, Source
from lcd_flight.learning.sources import turns_short
from lcd_flight.model import InputError
from lcd_flight.worlds import load_world

SAMPLER = load_world("crazyflie-saturated").sampler
TASK = np.array([3, 9, 4])
Z = np.random.default_rng(0).normal(size=(3, 24))
THETA = np.array([[0.1, 0.0, -0.1], [0.0, 0.0, 0.0], [0.2, 0.2, 0.2]])


def load(path, **arrays):
    np.savez(path, **arrays)
    return load_plans(path, SAMPLER, 5, 0.5)


def test_a_file_of_plans(tmp_path):
    given = load(tmp_path / "plans.npz", task=TASK, z=Z, theta=THETA)
    assert np.array_equal(given.plans.task, TASK)
    assert np.array_equal(given.plans.z, Z.astype(np.float32))
    assert np.array_equal(given.plans.short_yaw, turns_short(5, TASK, 0.5))
    assert set(given.plans.source) == {Source.GIVEN}
    assert given.visit(np.arange(5)).task.tolist() == [3, 9, 4, 3, 9]
    told = load(tmp_path / "plans.npz", task=TASK, z=Z, theta=THETA, short_yaw=np.array([True, False, True]))
    assert told.plans.short_yaw.tolist() == [True, False, True]


def test_the_hash_is_of_the_contents(tmp_path):
    first = load(tmp_path / "a.npz", task=TASK, z=Z, theta=THETA).sha256
    assert load(tmp_path / "b.npz", theta=THETA, z=Z.astype(np.float32), task=TASK.astype(float)).sha256 == first
    assert load(tmp_path / "b.npz", task=TASK, z=Z + 0.1, theta=THETA).sha256 != first
    assert load(tmp_path / "b.npz", task=TASK + 1, z=Z, theta=THETA).sha256 != first


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"task": TASK, "z": Z}, "has no array `theta` (N, S); it holds task, z"),
        ({"task": TASK, "z": Z[:, :12], "theta": THETA}, "z has shape (3, 12); 3 plans of 3 segments have (3, 24)"),
        ({"task": TASK, "z": Z, "theta": THETA[:2]}, "theta has shape (2, 3); 3 plans of 3 segments have (3, 3)"),
        ({"task": TASK[:0], "z": Z[:0], "theta": THETA[:0]}, "no plan in it"),
        ({"task": TASK + 0.5, "z": Z, "theta": THETA}, "task must hold whole numbers from 0"),
        ({"task": TASK - 4, "z": Z, "theta": THETA}, "task must hold whole numbers from 0"),
        ({"task": TASK, "z": np.where(Z > 1.0, np.nan, Z), "theta": THETA}, "is nan; give finite numbers"),
        ({"task": TASK, "z": Z, "theta": THETA, "short_yaw": np.ones(2, bool)}, "short_yaw has 2 rows and task 3"),
    ],
)
def test_what_is_wrong_with_a_file(tmp_path, arrays, message):
    path = tmp_path / "plans.npz"
    with pytest.raises(InputError, match=re.escape(f"{path}: ") + ".*" + re.escape(message)):
        load(path, **arrays)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_plans(tmp_path / "none.npz", SAMPLER, 5, 0.5)


def plans(rows):
    task = np.arange(rows)
    z = np.ones((rows, 24), np.float32)
    theta = np.where(task[:, None] % 2 == 0, 0.1, 0.0).astype(np.float32) * np.ones((1, 3), np.float32)
    return Plans(task, task % 3 == 0, np.full(rows, Source.RANDOM), z, theta)


def test_jitter_is_log_uniform_and_leaves_the_first_and_the_papers_times_alone():
    first = np.arange(4_000) % 16 == 0
    moved = jittered(plans(4_000), np.arange(4_000), first, seed=2)
    size = np.linalg.norm(moved.z - 1.0, axis=1) / np.sqrt(2.0)
    assert np.array_equal(moved.z[first], np.ones_like(moved.z[first]))
    assert np.all(size[~first] > 0.3 * JITTER[0])
    assert np.median(size[~first]) == pytest.approx(np.sqrt(JITTER[0] * JITTER[1]), rel=0.1)
    even = np.arange(4_000) % 2 == 0
    assert np.all(moved.theta[~even] == 0.0)
    assert np.all(np.abs(moved.theta[even & ~first] - 0.1).max(axis=1) > 0.0)
    assert set(moved.source) == {Source.GIVEN}


def test_jitter_is_keyed_by_the_row():
    whole = jittered(plans(50), np.arange(50), np.zeros(50, bool), seed=2)
    part = jittered(plans(50).take(np.array([31])), np.array([31]), np.zeros(1, bool), seed=2)
    assert np.array_equal(part.z[0], whole.z[31])
    assert not np.array_equal(jittered(plans(50), np.arange(50), np.zeros(50, bool), seed=3).z, whole.z)
