"""A simulated MAVLink vehicle: PX4 or ArduPilot Copter as a client sees it, on the multirotor model."""
