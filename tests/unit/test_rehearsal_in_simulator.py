"""Rehearsals in the real simulator: the verdict follows the speed, the noise and the gaps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lcd_flight import plugins
from lcd_flight.mission import Mission
from lcd_flight.mission.plan_mission import plan_mission
from lcd_flight.model import RefusedError
from lcd_flight.rehearsal import Rehearsal, rehearse
from lcd_flight.worlds import load_vehicle

VEHICLE = load_vehicle("crazyflie")
WAYPOINTS = [[0, 0, 1], [1.5, 0.5, 1.2], [2.5, 2, 1.8], [1, 2.5, 1]]


def rehearsed(speed: float, faults: list[str], runs: int = 40, seed: int = 3) -> Rehearsal:
    """The four waypoints by minimum snap, limits wide open."""
    data: dict[str, Any] = {
        "version": 1,
        "name": "t",
        "seed": seed,
        "vehicle": {"type": "crazyflie"},
        "planner": {
            "type": "minimum-snap",
            "speed": speed,
            "limits": {"max_velocity": 20, "max_thrust_ratio": 3, "max_tilt_deg": 180, "max_body_rate_deg": 7200},
        },
        "plan": [
            {"takeoff": {"height": 1}},
            {"trajectory": {"waypoints": [{"position": point} for point in WAYPOINTS]}},
            {"land": {}},
        ],
        "safety": {"geofence": {"min": [-30, -30, -30], "max": [30, 30, 30]}},
        "rehearse": {"runs": runs, "faults": faults},
    }
    mission = Mission.model_validate(data)
    plan = plan_mission(mission, VEHICLE).plan
    return rehearse(plan, mission, VEHICLE, plugins.simulator())


def test_a_gentle_flight_passes_with_all_faults() -> None:
    found = rehearsed(1.0, ["motor_noise", "mocap_dropout"])
    found.require()
    assert found.max_error_m < 0.4
    assert found.longest_saturation_s < 0.05


def test_a_flight_beyond_the_motors_is_refused_where_it_is_fast() -> None:
    found = rehearsed(3.5, ["motor_noise"])
    assert found.longest_saturation_s > 0.1
    with pytest.raises(RefusedError, match=r"refused; trouble begins in plan\[1\]\.trajectory at .* between waypoints"):
        found.require()


def test_errors_grow_with_the_speed() -> None:
    errors = [rehearsed(speed, [], runs=1).max_error_m for speed in (0.5, 1.0, 1.5, 2.0)]
    assert errors == sorted(errors)


def test_without_faults_all_runs_are_one() -> None:
    assert np.ptp(rehearsed(1.5, [], runs=5).errors_m) == 0.0
    assert np.ptp(rehearsed(1.5, ["motor_noise"], runs=5).errors_m) > 0.0


def test_gaps_in_the_poses_are_felt_and_survived() -> None:
    clean, gaps = rehearsed(2.0, [], runs=60), rehearsed(2.0, ["mocap_dropout"], runs=60)
    assert np.ptp(gaps.errors_m) > 0.0
    assert gaps.max_error_m > clean.max_error_m
    assert gaps.completed.all()


def test_the_same_seed_gives_the_same_runs_whatever_their_number() -> None:
    few = rehearsed(1.5, ["motor_noise", "mocap_dropout"], runs=7)
    many = rehearsed(1.5, ["motor_noise", "mocap_dropout"], runs=50)
    other = rehearsed(1.5, ["motor_noise", "mocap_dropout"], runs=7, seed=4)
    assert np.array_equal(few.errors_m, many.errors_m[:7])
    assert not np.array_equal(few.errors_m, other.errors_m)
