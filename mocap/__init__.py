"""Motion capture: ZeroMQ ingestor, pose filter, publishers; imports `lcd_flight.model` and `lcd_flight.wire` only."""
