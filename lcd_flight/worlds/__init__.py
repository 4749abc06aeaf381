"""Vehicles and worlds as data files, with their sources."""

from lcd_flight.worlds.vehicles import fingerprint, load_vehicle, vehicle_names
from lcd_flight.worlds.worlds import load_world, world_names

__all__ = ["fingerprint", "load_vehicle", "load_world", "vehicle_names", "world_names"]
