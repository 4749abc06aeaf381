"""Who listens to a flight's ticks. Bounded, and never in the loop's way."""

from lcd_flight.observers.live import LivePublisher, LiveStream
from lcd_flight.observers.log_thread import LogStatistics, LogThread, TickSink

__all__ = ["LivePublisher", "LiveStream", "LogStatistics", "LogThread", "TickSink"]
