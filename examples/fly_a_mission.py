"""Plan a mission, rehearse it, fly it in virtual time: `python examples/fly_a_mission.py [MISSION]`."""

import sys

from lcd_flight import FlightOptions, fly, plan, rehearse

flight = plan(sys.argv[1] if len(sys.argv) > 1 else "demo")
rehearsal = rehearse(flight)
print(rehearsal.text)
flown = fly(flight, rehearsal, FlightOptions(fast=True))
print(flown.result.outcome, "largest error", flown.figures.overall_max_error_m, "m")
print(flown.log, flown.report)
sys.exit(flown.result.exit_code)
