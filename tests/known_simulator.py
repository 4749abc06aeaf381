"""A simulator whose every answer is known, and tasks to go with it."""

from __future__ import annotations

import numpy as np

from lcd_flight.model import RolloutLabels, Tasks


class KnownSimulator:
    """Errors that are a plain function of the plan: its largest error is |x| of the first waypoint, in m.

    broken_from: error in m from which a rollout leaves the model's validity.
    interrupted_in: the call, counted from 1, in which Ctrl-C comes.

    Calls are kept, but for those of one thread: flights that only try a method out.
    """

    def __init__(self, broken_from: float | None = None, interrupted_in: int | None = None) -> None:
        self.broken_from, self.interrupted_in = broken_from, interrupted_in
        self.calls: list = []

    def rollout(self, plans, vehicle, seeds, options):
        if options.threads != 1 and len(self.calls) + 1 == self.interrupted_in:
            raise KeyboardInterrupt
        if options.threads != 1:
            self.calls.append((plans, vehicle, seeds, options))
        n, segments = plans.durations_s.shape
        error = np.abs(plans.coefficients[:, 0, 0, 0])
        waypoint = np.tile(error[:, None], (1, segments + 1)) * 0.5
        waypoint[:, -1] = np.nan
        flat = np.zeros(n)
        valid = np.ones(n, bool) if self.broken_from is None else error < self.broken_from
        return RolloutLabels(
            error, flat, flat, flat, flat, np.zeros((n, segments)), waypoint, flat, flat, flat, flat + 0.25, flat, valid
        )


def tasks_with_errors(errors) -> Tasks:
    """One task for each error in m that `KnownSimulator` is to answer."""
    waypoints = np.zeros((len(errors), 4, 3))
    waypoints[:, :, 0] = np.asarray(errors)[:, None]
    waypoints[:, :, 1] = np.arange(4) * 2.0
    return Tasks(waypoints, np.zeros((len(errors), 4)))
