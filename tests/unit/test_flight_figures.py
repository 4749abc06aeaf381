"""Pictures of single flights: flown once more they are the flights that were judged."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from lcd_flight.learning.evaluate import evaluate, tasks_of
from lcd_flight.learning.evaluation import EvaluationOptions
from lcd_flight.learning.flight_figures import PathTeller, flight_figure, fly_again, gallery_figure
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_world

WORLD = load_world("crazyflie-saturated")
METHODS = ("minimum-snap", "analytic")


@pytest.fixture(scope="module")
def sim():
    return simulator()


@pytest.fixture(scope="module", params=[1.0, 0.9])
def evaluated(request, sim):
    options = EvaluationOptions(seed=5, timing="fixed", drags=(4,), noise_seeds=2, thrust_share=request.param)
    tasks = tasks_of(WORLD, 6, options)
    return tasks, evaluate(WORLD, METHODS, tasks, sim, options)


def test_flown_again_it_is_the_flight_that_was_judged(sim, evaluated):
    tasks, evaluation = evaluated
    assert isinstance(sim, PathTeller)
    for method in METHODS:
        for row in (0, 3):
            flight = fly_again(WORLD, tasks, row, evaluation, sim, sim, method)
            reference = flight.plan.derivative(flight.path.times_s, 0)
            error = np.linalg.norm(flight.path.p_WB - reference[:, :3], axis=1).max()
            assert error == pytest.approx(evaluation.runs[method].max_error_m[row, 0, 0], abs=1e-9)


def test_yaw_is_told_unwrapped_from_where_the_plan_begins(sim, evaluated):
    tasks, evaluation = evaluated
    for row in range(6):
        flight = fly_again(WORLD, tasks, row, evaluation, sim, sim, "analytic")
        assert flight.path.yaw_rad[0] == pytest.approx(tasks.yaws_rad[row, 0], abs=1e-6)
        assert np.abs(np.diff(flight.path.yaw_rad)).max() < np.pi


def test_the_pictures_hold_every_flight_and_waypoint(sim, evaluated):
    tasks, evaluation = evaluated
    flights = [fly_again(WORLD, tasks, 0, evaluation, sim, sim, method) for method in METHODS]
    root = ET.fromstring(flight_figure("A flight", flights))  # noqa: S314 - our own
    said = "".join(root.itertext())
    assert all(name in said for name in (*METHODS, "x in m", "yaw in rad", "time in s"))
    assert len(root.findall("{http://www.w3.org/2000/svg}circle")) == 4 + 4 * 4
    for line in root.findall("{http://www.w3.org/2000/svg}polyline"):
        places = np.array([pair.split(",") for pair in line.get("points").split()], dtype=float)
        assert (places >= -1.0).all()
        assert (places <= 911.0).all()


def test_the_gallery_names_each_flight(sim, evaluated):
    tasks, evaluation = evaluated
    flights = [
        replace(fly_again(WORLD, tasks, row, evaluation, sim, sim, "minimum-snap"), name=f"task {row}")
        for row in (1, 2)
    ]
    said = "".join(ET.fromstring(gallery_figure("Three", flights)).itertext())  # noqa: S314 - our own
    assert "task 1" in said
    assert "task 2" in said
