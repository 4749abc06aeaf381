"""Worlds for a vehicle of one's own: as hard as the paper's, whatever the vehicle."""

from dataclasses import replace

import pytest

from lcd_flight.learning.own_world import crash_share, worlds_of
from lcd_flight.learning.recipes import RECIPES
from lcd_flight.model import InputError
from lcd_flight.plugins import simulator
from lcd_flight.worlds import load_vehicle, load_world

SIMULATOR = simulator("multirotor")


def test_the_speed_of_a_known_vehicle_is_found_again():
    """At 2.37 m/s in the paper's loop minimum snap crashes in 40 % of the Crazyflie's tasks."""
    known = load_world("crazyflie-saturated")
    hardest, *slower = worlds_of(known.vehicle(3), "paper", SIMULATOR)
    assert hardest.speed == pytest.approx(known.speed, abs=0.11)
    assert [w.speed for w in slower] == sorted([w.speed for w in slower], reverse=True)
    assert crash_share(slower[-1], SIMULATOR) < 0.01


@pytest.mark.parametrize("loop", ["paper", "flight"])
def test_another_vehicle_gets_other_speeds_and_one_network_serves_its_worlds(loop):
    heavy = replace(load_vehicle("crazyflie-2.1"), name="laden", mass_kg=0.036)
    worlds = worlds_of(heavy, loop, SIMULATOR)
    assert 0.25 < crash_share(worlds[0], SIMULATOR) < 0.55
    assert {w.loop for w in worlds} == {loop}
    assert all(w.base_vehicle == heavy for w in worlds)
    RECIPES["small"]("laden", worlds)


def test_a_vehicle_without_drag_has_one_configuration():
    slick = replace(load_vehicle("crazyflie-2.1"), parasitic_drag=(0.0, 0.0, 0.0))
    assert {w.drag_configurations for w in worlds_of(slick, "flight", SIMULATOR)} == {((0.0, 0.0, 0.0),)}


def test_a_vehicle_that_cannot_fly_is_refused():
    brick = replace(load_vehicle("crazyflie-2.1"), name="brick", mass_kg=0.5)
    with pytest.raises(InputError, match="vehicle brick: crashes along minimum snap even at"):
        worlds_of(brick, "flight", SIMULATOR)
