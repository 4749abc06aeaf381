"""PX4 and ArduPilot over MAVLink 2, on pymavlink's dialect; imports `lcd_flight.model` and `lcd_flight.wire`."""
