"""A log of schema 1, written once, stays readable: a flight of last year must open with the program of today.

`flight_log_schema_1.mcap` was written by `LogWriter` with `synthetic_flight.header()` and every 200th tick of
`synthetic_flight.flight()`. It is made anew only with a new schema, and then the old one stays beside it.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from lcd_flight.model import LegKind, MotorRequest, Phase
from lcd_flight.record import read_log, read_ticks

LOG = Path(__file__).parent / "flight_log_schema_1.mcap"


def test_ticks() -> None:
    ticks = read_ticks(LOG)
    assert [tick.sequence for _, tick in ticks] == [0, 200, 400, 600, 800]
    inputs, tick = ticks[2]
    assert (inputs.now_ns, inputs.deadline_ns, inputs.missed) == (5_004_000_130_000, 5_004_000_000_000, 0)
    assert (inputs.pose.age_ns, inputs.pose.rate_hz, inputs.pose.received) == (3_000_000, 100.0, 401)
    assert inputs.pose.raw is not None
    assert inputs.pose.raw.source_stamp_ns == 1_003_997_130_000
    assert inputs.link.telemetry is not None
    assert inputs.link.telemetry.motor_shares == (0.5, 0.52, 0.48, 0.5)
    assert (tick.phase, tick.leg, tick.leg_time_s) == (Phase.TRACK, 2, 0.8)
    assert (tick.motors, tick.saturated) == (MotorRequest.NONE, True)
    assert tick.position_error_W == pytest.approx((-0.0653643621, -0.0756802495, 0.0), abs=1e-9)
    assert tick.reference is not None
    assert tick.reference.p_W == pytest.approx((0.8588, 0.2863, 1.1145), abs=1e-4)


def test_the_description() -> None:
    log = read_log(LOG)
    header = log.header
    assert log.complete
    assert (header.name, header.link, header.seed, header.planner) == ("four-waypoint test", "sim://", 7, "learned")
    assert header.started == datetime(2026, 11, 22, 10, 31, 7, tzinfo=UTC)
    assert header.mission_text == "version: 1\nname: four-waypoint test\n"
    assert header.predicted_max_error_m == 0.25
    assert header.model_card == {"name": "crazyflie-flight", "hash": "0123abcd"}
    assert header.vehicle.mass_kg == 0.03
    assert header.limits.geofence.high_m == (4.0, 4.0, 3.0)
    assert [leg.kind for leg in header.plan.legs] == [LegKind.TAKEOFF, LegKind.HOLD, LegKind.TRAJECTORY, LegKind.LAND]
    assert header.plan.legs[2].waypoints is not None
    assert header.plan.legs[2].waypoints[2].tolist() == [2.5, 2.0, 1.8, 1.5]
