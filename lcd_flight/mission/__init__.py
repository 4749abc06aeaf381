"""mission.yaml -> Mission -> flight plan; every error names file, line and key."""

from lcd_flight.mission.load import find_mission, load_mission, shipped_missions
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.problems import MissionError, Problem

__all__ = ["Mission", "MissionError", "Problem", "find_mission", "load_mission", "shipped_missions"]
