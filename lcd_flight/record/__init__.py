"""The flight log: MCAP files, written so that nothing is lost and read even where they were cut."""

from lcd_flight.record.flight_log import FlightLog, Series, TimedFinding
from lcd_flight.record.header import FlightHeader
from lcd_flight.record.paths import log_path
from lcd_flight.record.plan_file import Prediction
from lcd_flight.record.reader import read_log, read_ticks
from lcd_flight.record.writer import LogWriter

__all__ = [
    "FlightHeader",
    "FlightLog",
    "LogWriter",
    "Prediction",
    "Series",
    "TimedFinding",
    "log_path",
    "read_log",
    "read_ticks",
]
