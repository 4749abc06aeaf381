"""The single flights that the page of results shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lcd_flight.files import write_whole
from lcd_flight.learning.evaluate import tasks_of
from lcd_flight.learning.flight_figures import Flight, PathTeller, flight_figure, fly_again, gallery_figure
from lcd_flight.learning.reproduce import Reproduction
from lcd_flight.model import Simulator

_EXAMPLE = "crazyflie-saturated-fixed"
_PICTURED = ("minimum-snap", "learned")
_QUANTILES = (("low cost", 0.05), ("medium cost", 0.5), ("high cost", 0.95))


def write_flights(result: Reproduction, folder: Path, simulator: Simulator, teller: PathTeller) -> list[str]:
    """Pictures of flights in the first drag configuration with the first noise; returns how a page shows them.

    Raises:
        InputError: a file cannot be written.
    """
    experiment = next(e for e in result.experiments if e.name == _EXAMPLE)
    evaluation = result.evaluations[_EXAMPLE]
    tasks = tasks_of(experiment.world, result.settings.count, evaluation.options)
    minimum, learned = (evaluation.runs[name] for name in _PICTURED)

    def flown(row: int, method: str) -> Flight:
        return fly_again(experiment.world, tasks, row, evaluation, simulator, teller, method)

    order = np.argsort(minimum.max_error_m[:, 0, 0], kind="stable")
    flights = []
    for name, share in _QUANTILES:
        row = int(order[int(share * (len(order) - 1))])
        words = f"{name}: task {row}, largest error {minimum.max_error_m[row, 0, 0]:.2f} m"
        flights.append(replace(flown(row, "minimum-snap"), name=words))
    title = "Minimum snap: flights at the 5th, 50th and 95th percentile of the largest error"
    write_whole(folder / "low-medium-high.svg", gallery_figure(title, flights))
    shown = ["![Minimum-snap flights of low, medium and high cost](low-medium-high.svg)"]
    saved = np.flatnonzero(minimum.crashed[:, 0, 0] & ~learned.crashed[:, 0, 0])
    if len(saved):
        title = f"Task {saved[0]}, the first that minimum snap crashes on and the learned plan does not"
        write_whole(folder / "flight.svg", flight_figure(title, [flown(int(saved[0]), name) for name in _PICTURED]))
        shown.append("![One task, planned and flown by minimum snap and by the learned planner](flight.svg)")
    return shown
