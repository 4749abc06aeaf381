"""Any record that the types allow comes back from its JSON, to the bit."""

from __future__ import annotations

import dataclasses
import struct
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from lcd_flight.model import Tick, TickInputs
from lcd_flight.wire import json_records

st.register_type_strategy(int, st.integers(-(2**63), 2**63 - 1))


def bits(value: Any) -> Any:
    """The value with every float as its bytes; all NaNs are one."""
    if isinstance(value, float):
        return b"NaN" if value != value else struct.pack("<d", value)  # noqa: PLR0124 - the test for NaN
    if dataclasses.is_dataclass(value):
        return tuple(bits(getattr(value, field.name)) for field in dataclasses.fields(value))
    return tuple(map(bits, value)) if isinstance(value, tuple) else value


@settings(deadline=None, max_examples=150)
@given(st.from_type(TickInputs))
def test_inputs(inputs: TickInputs) -> None:
    assert bits(json_records.decode(json_records.encode(inputs), TickInputs)) == bits(inputs)


@settings(deadline=None, max_examples=150)
@given(st.from_type(Tick))
def test_ticks(tick: Tick) -> None:
    assert bits(json_records.decode(json_records.encode(tick), Tick)) == bits(tick)
