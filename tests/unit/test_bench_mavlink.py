"""The MAVLink rows of `lcd bench link`, small: all sides do the same work, and one that does not is no result."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = pytest.mark.realtime


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    for peer in ("mavsdk", "pymavlink"):
        pytest.importorskip(peer)
    from benchmarks import link_mavlink

    for name, number in (("ROUNDS", 3), ("SENDS", 4), ("BURSTS", 1), ("STREAM", 5)):
        monkeypatch.setattr(link_mavlink, name, number)
    return link_mavlink


@pytest.fixture
def sky(bench: Any) -> Iterator[Any]:
    one = bench.Sky()
    with contextlib.closing(one.socket):
        yield one


def test_rows(bench: Any) -> None:
    said: list[str] = []
    rows = bench.rows(said.append)
    assert len(said) == 4
    assert [row["peer_name"] for row in rows] == [*["pymavlink mavutil"] * 2, *["MAVSDK"] * 2] * 2 + [None] * 2
    assert all(row["unit"] == "us" and row["ours"] > 0.0 for row in rows)
    for row in rows[:-2]:
        assert row["ratio"] == pytest.approx(row["peer"] / row["ours"])
    assert rows[0]["what"] == "cost of a MAVLink setpoint in the loop, median"
    assert rows[4]["what"] == "MAVLink attitude, sent and parsed, 100 at once, median"
    assert (rows[-1]["peer"], rows[-1]["ratio"]) == (None, None)


def test_a_side_that_sends_nothing_is_no_result(bench: Any, sky: Any) -> None:
    class Silent:
        name = "silent"

        def send(self) -> None:
            pass

    with pytest.raises(RuntimeError, match="silent did not send all its setpoints"):
        bench._sent(Silent(), sky)


def test_a_side_that_leaves_packets_out_is_no_result(bench: Any, sky: Any) -> None:
    class Lazy:
        name, port = "lazy", bench.free_port()

        async def taken_in(self, number: int) -> int:
            return number - 1

    with pytest.raises(RuntimeError, match="lazy took in 99 of 100 attitudes"):
        asyncio.run(bench._burst(Lazy(), sky))


def test_all_sides_send_the_same_setpoint(bench: Any, sky: Any) -> None:
    """Level, at a heading of 72.8 deg from north, with thrust 0.5, to the autopilot of system 1."""
    from drivers.mavlink.codec import Codec

    async def heard() -> list[Any]:
        sky.socket.settimeout(1.0)
        ours = bench.Ours(bench.Udp(bench.HERE, bench.free_port(), call=False))
        await ours.open(sky)
        closing = contextlib.closing
        with closing(ours), closing(bench.Mavutil(sky)) as mavutil, closing(bench.Mavsdk(sky)) as mavsdk:
            return [sent(side) for side in (ours, mavutil, mavsdk)]

    def sent(side: Any) -> Any:
        side.send()
        while True:
            for message in Codec(1, 1).decode(bytearray(sky.socket.recv(2048))):
                if message.get_type() == "SET_ATTITUDE_TARGET":
                    return message

    for message in asyncio.run(heard()):
        assert (message.type_mask, message.thrust) == (7, 0.5)
        assert (message.target_system, message.target_component) == (1, 1)
        assert message.q == pytest.approx([0.8049, 0.0, 0.0, 0.5934], abs=1e-3)
