"""Records as JSON and back: exact to the bit, also where a number is not finite."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
import synthetic_flight

from lcd_flight.model import AttitudeThrust, Finding, Severity, State, Telemetry, Tick, TickInputs
from lcd_flight.wire import json_records

STATE = State((0.1, -0.0, 5e-324), (1e308, 2.0 / 3.0, -1.5), (0.0, 0.0, 0.0, 1.0), (0.25, 0.5, 0.75))


def test_every_tick_of_a_flight_comes_back_equal() -> None:
    for inputs, tick in synthetic_flight.flight():
        assert json_records.decode(json_records.encode(inputs), TickInputs) == inputs
        assert json_records.decode(json_records.encode(tick), Tick) == tick


def test_negative_zero_and_the_smallest_numbers_keep_their_bits() -> None:
    back = json_records.decode(json_records.encode(STATE), State)
    assert back == STATE
    assert math.copysign(1.0, back.p_WB[1]) == -1.0


def test_what_is_not_finite_comes_back_as_it_was() -> None:
    state = replace(STATE, p_WB=(math.nan, math.inf, -math.inf))
    data = json_records.encode(state)
    assert json.loads(data)["p_WB"] == ["NaN", "Infinity", "-Infinity"]
    x, y, z = json_records.decode(data, State).p_WB
    assert math.isnan(x)
    assert (y, z) == (math.inf, -math.inf)


def test_nothing_and_not_a_number_stay_apart() -> None:
    nothing = Telemetry(stamp_ns=1, battery_V=None)
    unknown = Telemetry(stamp_ns=1, battery_V=math.nan)
    assert json_records.decode(json_records.encode(nothing), Telemetry) == nothing
    battery_V = json_records.decode(json_records.encode(unknown), Telemetry).battery_V
    assert battery_V is not None
    assert math.isnan(battery_V)


def test_words_are_not_taken_for_numbers() -> None:
    finding = Finding("NaN", Severity.WARN, "null Infinity", value=math.nan)
    back = json_records.decode(json_records.encode(finding), Finding)
    assert (back.code, back.message, back.severity) == ("NaN", "null Infinity", Severity.WARN)


def test_the_json_is_json_for_everybody() -> None:
    setpoint = AttitudeThrust(math.inf, (math.nan, 0.0, 0.0, 1.0))

    def refuse(word: str) -> float:
        raise AssertionError(f"{word} is not JSON")

    json.loads(json_records.encode(setpoint), parse_constant=refuse)


def test_numbers_of_numpy_are_written_as_numbers() -> None:
    state = replace(STATE, v_WB_W=(np.float64(0.1), np.float32(0.5), np.int64(3)))
    assert json_records.decode(json_records.encode(state), State).v_WB_W == (0.1, 0.5, 3.0)


def test_what_has_no_place_in_a_record_is_refused() -> None:
    with pytest.raises(NotImplementedError, match="object has no place in a record"):
        json_records.encode(replace(STATE, p_WB=(object(), 0.0, 0.0)))  # type: ignore[arg-type]


def test_other_json_is_refused() -> None:
    with pytest.raises(msgspec.ValidationError):
        json_records.decode(b'{"thrust_N": "much", "q_WB": [0, 0, 0, 1]}', AttitudeThrust)
