"""Tasks from a file: what is written is read again, and whatever is wrong is one clear line."""

import re

import numpy as np
import pytest

from lcd_flight.learning.task_files import load_tasks, save_tasks
from lcd_flight.model import InputError, Tasks

WAYPOINTS = np.arange(24.0).reshape(2, 4, 3)
YAWS = np.zeros((2, 4))


def test_round_trip(tmp_path):
    path = tmp_path / "tasks.npz"
    save_tasks(path, Tasks(WAYPOINTS, YAWS + 4.0))
    loaded = load_tasks(path)
    assert np.array_equal(loaded.waypoints_m, WAYPOINTS)
    assert np.array_equal(loaded.yaws_rad, YAWS + 4.0)


def test_yaw_may_be_the_fourth_column(tmp_path):
    path = tmp_path / "tasks.npz"
    poses = np.concatenate([WAYPOINTS, YAWS[..., None] + 2.0], axis=2)
    np.savez(path, waypoints=poses)
    loaded = load_tasks(path)
    assert np.array_equal(loaded.poses, poses)
    np.savez(path, waypoints=poses, yaws=YAWS)
    with pytest.raises(InputError, match=r"waypoints has shape \(2, 4, 4\); give \(N, K, 3\)"):
        load_tasks(path)


def test_integers_are_numbers_too(tmp_path):
    path = tmp_path / "tasks.npz"
    np.savez(path, waypoints=WAYPOINTS.astype(int), yaws=YAWS.astype(int))
    assert load_tasks(path).waypoints_m.dtype == np.float64


NAN = WAYPOINTS.copy()
NAN[1, 2, 0] = np.nan
TWICE = WAYPOINTS.copy()
TWICE[1, 3] = TWICE[1, 2]


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"waypoints": WAYPOINTS}, "has no array `yaws` (N, K) in rad; it holds waypoints"),
        ({"yaws": YAWS}, "has no array `waypoints` (N, K, 3) in m; it holds yaws"),
        ({"waypoints": WAYPOINTS[0], "yaws": YAWS}, "waypoints is float64 of shape (4, 3); give numbers, (N, K, 3)"),
        ({"waypoints": WAYPOINTS.astype(str), "yaws": YAWS}, "waypoints is <U32 of shape (2, 4, 3); give numbers"),
        ({"waypoints": WAYPOINTS[:, :, :2], "yaws": YAWS}, "waypoints has shape (2, 4, 2); give (N, K, 3)"),
        ({"waypoints": WAYPOINTS[:, :1], "yaws": YAWS[:, :1]}, "waypoints has shape (2, 1, 3); give (N, K, 3)"),
        ({"waypoints": WAYPOINTS[:0], "yaws": YAWS[:0]}, "waypoints has shape (0, 4, 3); give (N, K, 3)"),
        (
            {"waypoints": WAYPOINTS, "yaws": YAWS[:, :3]},
            "yaws has shape (2, 3); give (2, 4), one yaw for each waypoint",
        ),
        ({"waypoints": NAN, "yaws": YAWS}, "waypoints[1, 2, 0] is nan; give finite numbers"),
        ({"waypoints": TWICE, "yaws": YAWS}, "task 1: waypoints 2 and 3 are the same; leave one out"),
        ({"waypoints": np.array([{}, 1]), "yaws": YAWS}, "not a NumPy .npz file of plain arrays"),
    ],
)
def test_wrong_arrays_are_named(tmp_path, arrays, message):
    path = tmp_path / "tasks.npz"
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=re.escape(f"{path}: {message}")):
        load_tasks(path)


def test_wrong_files_are_named(tmp_path):
    with pytest.raises(InputError, match=r"missing\.npz: no such file"):
        load_tasks(tmp_path / "missing.npz")
    text = tmp_path / "text.npz"
    text.write_text("waypoints")
    with pytest.raises(InputError, match=r"text\.npz: not a NumPy \.npz file"):
        load_tasks(text)
    empty = tmp_path / "empty.npz"
    empty.touch()
    with pytest.raises(InputError, match=r"empty\.npz: not a NumPy \.npz file"):
        load_tasks(empty)
    np.save(tmp_path / "bare.npy", WAYPOINTS)
    with pytest.raises(InputError, match=r"bare\.npy: one bare array"):
        load_tasks(tmp_path / "bare.npy")


def test_an_unwritable_place_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        save_tasks(tmp_path / "no" / "folder.npz", Tasks(WAYPOINTS, YAWS))
