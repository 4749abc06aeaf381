"""Whatever a client sends, the simulated Crazyflie lives on and takes no more memory (a million in `make campaign`)."""

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

from lcd_flight.worlds import load_vehicle
from sim_bridge.crazyflie.crtp import decode, encode
from sim_bridge.crazyflie.variants import variant
from sim_bridge.crazyflie.vehicle import SimulatedCrazyflie

CAMPAIGN = Path(__file__).parents[2] / "benchmarks" / "campaign_crazyflie_fuzz.py"


@pytest.fixture(scope="module")
def campaign() -> ModuleType:
    spec = importlib.util.spec_from_file_location("campaign_crazyflie_fuzz", CAMPAIGN)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@settings(derandomize=True, deadline=None)
@given(st.binary(max_size=40))
def test_any_bytes_are_a_packet_or_none(data: bytes) -> None:
    packet = decode(data)
    assert (packet is None) == (not 1 <= len(data) <= 31)
    if packet is not None:
        assert encode(packet) == bytes((data[0] | 0x0C,)) + data[1:]


def test_thousands_of_packets_leave_nothing_behind(campaign: ModuleType) -> None:
    """Live objects after 3,000 packets and after 6,000 more: a list of all that came would have 6,000."""
    vehicle = SimulatedCrazyflie(load_vehicle("crazyflie-2.1"), variant("2.1", "2026.08"))
    draws = random.Random(3)  # noqa: S311 - not a secret
    before, after = (_live_after(campaign, vehicle, count, draws) for count in (3_000, 6_000))
    assert after - before < 4_000


def _live_after(campaign: ModuleType, vehicle: SimulatedCrazyflie, count: int, draws: random.Random) -> int:
    campaign._fuzz_one(vehicle, count, draws)
    gc.collect()
    return sys.getallocatedblocks()


def test_every_kind_of_vehicle_is_fuzzed(campaign: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "EACH", 100)
    assert campaign.crazyflie_fuzz(count=800, seed=7)["packets"] == 800


def test_the_fuzz_sees_a_fault(campaign: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SimulatedCrazyflie, "outgoing", lambda self: [b""])
    with pytest.raises(AssertionError, match="was answered by"):
        campaign.crazyflie_fuzz(count=10)
