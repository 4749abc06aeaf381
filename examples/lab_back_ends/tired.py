"""A simulator of one's own: the shipped one with tired propellers, which the controller does not know of."""

from __future__ import annotations

from dataclasses import replace

from lcd_flight import plugins
from lcd_flight.model import RolloutLabels, RolloutOptions, SeedArray, Trajectories, Vehicle


class TiredSimulator:
    """`lcd_flight.model.Simulator`."""

    def rollout(
        self, plans: Trajectories, vehicle: Vehicle, seeds: SeedArray, options: RolloutOptions
    ) -> RolloutLabels:
        """Fly with 5 % less thrust than the controller believes."""
        believed = replace(options, nominal=options.nominal or vehicle)
        return plugins.simulator("multirotor").rollout(plans, vehicle.weaker(0.95), seeds, believed)
