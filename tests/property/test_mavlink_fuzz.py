"""Whatever a client sends, the simulated MAVLink vehicle lives on and takes no more memory (more: `make campaign`)."""

from __future__ import annotations

import gc
import importlib.util
import random
import sys
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bridge.mavlink.framing import LONGEST, split
from sim_bridge.mavlink.vehicle import SimulatedMavlink

CAMPAIGN = Path(__file__).parents[2] / "benchmarks" / "campaign_mavlink_fuzz.py"


@pytest.fixture(scope="module")
def campaign() -> ModuleType:
    spec = importlib.util.spec_from_file_location("campaign_mavlink_fuzz", CAMPAIGN)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@settings(derandomize=True, deadline=None)
@given(st.binary(max_size=700))
def test_any_bytes_are_packets_and_a_short_rest(data: bytes) -> None:
    packets, rest = split(data)
    assert len(rest) <= LONGEST + 12
    for packet in packets:
        assert packet[0] in (0xFD, 0xFE)
        assert split(packet) == ([packet], b"")


@settings(derandomize=True, deadline=None)
@given(st.binary(max_size=300), st.integers(min_value=0, max_value=300))
def test_a_stream_is_cut_alike_wherever_it_is_broken(data: bytes, at: int) -> None:
    """As bytes come over TCP."""
    first, rest = split(data[:at])
    second, last = split(rest + data[at:])
    assert (first + second, last) == split(data)


def test_thousands_of_packets_leave_nothing_behind(campaign: ModuleType) -> None:
    """Live blocks after 3,000 packets and after 6,000 more: a list of all that came would have 6,000."""
    vehicle = campaign.fuzzed_vehicle(1)
    draws = random.Random(3)  # noqa: S311 - not a secret
    before, after = (_live_after(campaign, vehicle, count, draws) for count in (3_000, 6_000))
    assert after - before < 4_000


def _live_after(campaign: ModuleType, vehicle: SimulatedMavlink, count: int, draws: random.Random) -> int:
    campaign.fuzz_one(vehicle, count, draws)
    gc.collect()
    return sys.getallocatedblocks()


def test_every_kind_of_vehicle_is_fuzzed(campaign: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "EACH", 500)
    assert campaign.mavlink_fuzz(count=6_000, seed=7)["packets"] == 6_000


def test_the_fuzz_takes_it_into_the_air(campaign: ModuleType) -> None:
    """Otherwise it would only be fuzzed on the floor."""
    vehicles = [campaign.fuzzed_vehicle(number) for number in range(3)]
    for vehicle in vehicles:
        campaign.fuzz_one(vehicle, 2_000, random.Random(1))  # noqa: S311 - not a secret
    assert any(vehicle.body.height_m > 0.1 for vehicle in vehicles)


def test_the_fuzz_sees_a_fault(campaign: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SimulatedMavlink, "outgoing", lambda self: [b"\xfd"])
    with pytest.raises(AssertionError, match="was answered by"):
        campaign.mavlink_fuzz(count=10)
