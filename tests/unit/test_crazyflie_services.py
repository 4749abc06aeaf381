"""Link, platform, memories and supervisor, byte by byte, over a whole vehicle."""

from __future__ import annotations

import zlib

import pytest
from virtual_crazyflie import ARMED, AUTO_ARM, CAN_FLY, Client

from lcd_flight.model import InputError
from sim_bridge.crazyflie.variants import variant


@pytest.fixture
def client() -> Client:
    client = Client()
    client.wait(200.0)
    return client


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ("FD 00", b"\xfdBitcraze Crazyflie".ljust(31, b"\0")),
        ("DD 00", bytes.fromhex("DD 00 0C000000")),  # protocol 12
        ("DD 01", b"\xdd\x012026.08"),
        ("DD 02", b"\xdd\x02Crazyflie 2.1"),
        ("DC 03 01", bytes.fromhex("DC 03 01")),  # user notification: echo
        ("4C 01", bytes.fromhex("4C 01 00")),  # no memories
        ("4D 00 00000000 10", bytes.fromhex("4D 00 00000000 02")),
        ("FC 00 0102030405060708", bytes.fromhex("FC 00 0102030405060708")),  # ping
        ("FF", bytes.fromhex("FF")),  # a scan's null packet
        ("9C 0C", bytes((0x9C, 0x8C, ARMED | AUTO_ARM | CAN_FLY, 0))),
        ("9C 01", bytes.fromhex("9C 81 00")),  # can be armed: it is already
        ("9C 02", bytes.fromhex("9C 82 01")),
        ("9C 04", bytes.fromhex("9C 84 01")),
        ("9D 01 01", bytes.fromhex("9D 81 01 01")),
        ("9D 02", bytes.fromhex("9D 82 01 01")),
    ],
)
def test_answers(client: Client, request_: str, said: bytes) -> None:
    assert client.ask(request_) == [said]


@pytest.mark.parametrize("request_", ["FE 00", "FD", "DD 07", "DD", "9C", "9C 55", "9D 01", "9F 01", "1C 00", "8C 07"])
def test_silence(client: Client, request_: str) -> None:
    answers = client.ask(request_)
    assert answers == ([b"\xfdBitcraze Crazyflie".ljust(31, b"\0")] if request_ == "FD" else [])


def test_older_firmware_has_no_supervisor_port_and_arms_by_the_platforms(client: Client) -> None:
    older = Client("2.1-brushless", "2024.10")
    older.wait(200.0)
    assert older.ask("DD 00") == [bytes.fromhex("DD 00 08000000")]
    assert older.ask("9C 0C") == older.ask("9D 01 01") == []
    assert not older.vehicle.firmware.supervisor.armed
    assert older.ask("DC 01 01") == [bytes.fromhex("DC 01 01")]
    assert older.vehicle.firmware.supervisor.armed


def test_the_tables_of_contents_are_the_simulations_own() -> None:
    """A client caches tables by checksum alone: ours share one, and no plain checksum of the same table is equal."""
    (first,), (again,) = Client().ask("2C 03"), Client().ask("2C 03")
    assert first == again
    assert first[4:] == Client().vehicle.firmware.parameters.checksum.to_bytes(4, "little")
    (logs,) = Client().ask("5C 03")
    assert logs[4:8] != first[4:8]
    items = [Client().ask(b"\x2c\x02" + number.to_bytes(2, "little"))[0][4:] for number in range(first[2])]
    assert int.from_bytes(first[4:], "little") != zlib.crc32(b"".join(items))


def test_every_entry_of_both_tables_can_be_asked_for(client: Client) -> None:
    names = set()
    for port in (0x2C, 0x5C):
        ((_, _, *count, _, _, _, _),) = [list(client.ask(bytes((port, 3)))[0][:8])]
        for number in range(int.from_bytes(bytes(count), "little")):
            (item,) = client.ask(bytes((port, 2)) + number.to_bytes(2, "little"))
            assert item[:4] == bytes((port, 2)) + number.to_bytes(2, "little")
            group, name, end = item[5:].split(b"\0")
            assert group
            assert name
            assert end == b""
            names.add((port, group, name))
    assert len(names) > 80


@pytest.mark.parametrize(("platform", "firmware"), [("3.0", "2026.08"), ("2.1", "1999.01")])
def test_an_unknown_platform_or_firmware_says_which_there_are(platform: str, firmware: str) -> None:
    with pytest.raises(InputError, match=r"is not simulated; there are: 2"):
        variant(platform, firmware)
