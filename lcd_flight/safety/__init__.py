"""Judging a flight: monitors, the transmit gate, pre-flight checks. Pure; it decides nothing and sends nothing.

`evidence` gathers what is known in a tick, `monitors` is the table it is judged by, `gate` is the last clamp before a
link, `preflight` is what must hold before motors turn. What a finding leads to stands in `lcd_flight.flight.phases`.
"""
