from __future__ import annotations

import pytest

from sim_bridge.crazyflie.crtp import Packet, Port, decode, encode


@pytest.mark.parametrize(
    ("packet", "datagram"),
    [
        (Packet(Port.COMMANDER, 0, bytes.fromhex("0000 0000")), "3C 0000 0000"),
        (Packet(Port.LOG, 1, b"\x05"), "5D 05"),
        (Packet(Port.PARAMETERS, 2, b"\x01\x00\x02"), "2E 010002"),
        (Packet(Port.SUPERVISOR, 0, b"\x0c"), "9C 0C"),
        (Packet(Port.LOCALIZATION, 1, b"\x08"), "6D 08"),
        (Packet(Port.LINK, 3), "FF"),
        (Packet(Port.CONSOLE, 0, b"up"), "0C 7570"),
    ],
)
def test_packets_and_their_bytes(packet: Packet, datagram: str) -> None:
    assert encode(packet) == bytes.fromhex(datagram)
    assert decode(bytes.fromhex(datagram)) == packet


def test_the_two_bits_between_port_and_channel_are_the_links_own() -> None:
    assert decode(bytes.fromhex("90 0C")) == decode(bytes.fromhex("9C 0C")) == Packet(Port.SUPERVISOR, 0, b"\x0c")


@pytest.mark.parametrize("datagram", [b"", bytes(32), bytes(2000)])
def test_what_is_no_packet(datagram: bytes) -> None:
    assert decode(datagram) is None


def test_the_longest_packet() -> None:
    assert decode(bytes(31)) == Packet(0, 0, bytes(30))


@pytest.mark.parametrize("packet", [Packet(16, 0), Packet(-1, 0), Packet(0, 4), Packet(0, 0, bytes(31))])
def test_what_cannot_be_sent(packet: Packet) -> None:
    with pytest.raises(ValueError, match="not a packet"):
        encode(packet)
