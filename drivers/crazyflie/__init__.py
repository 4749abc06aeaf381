"""Crazyflie over radio, USB and UDP, on cflib; imports `lcd_flight.model` and `lcd_flight.wire`."""
