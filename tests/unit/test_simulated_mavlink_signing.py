"""Signed packets at the simulated MAVLink vehicle: good ones, unsigned, forged and old ones."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common
from virtual_mavlink import REQUEST

from lcd_flight.model import InputError
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.keys import VARIABLE, key_of
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.signing import MOST_STREAMS, Signatures, signed
from sim_bridge.mavlink.vehicle import SOME_DAY_S, SimulatedMavlink

KEY = hashlib.sha256(b"a passphrase").digest()
TICKS = (SOME_DAY_S - 1_420_070_400) * 100_000
"""10 us since 2015, at the vehicle's time 0."""
VERSION = 148


def vehicle(key: bytes | None = KEY, unsigned: bool = False, flavour: str = "px4") -> SimulatedMavlink:
    options = MavlinkOptions(flavour=flavour, unsigned=unsigned)  # type: ignore[arg-type]
    return SimulatedMavlink(load_vehicle("hummingbird"), options, key=key)


def client(key: bytes | None = KEY, ticks: int = TICKS) -> common.MAVLink:
    """pymavlink's own signing, which nobody here wrote."""
    mav = common.MAVLink(None, srcSystem=245, srcComponent=191)
    mav.signing.secret_key = key
    mav.signing.sign_outgoing = key is not None
    mav.signing.timestamp = ticks
    return mav


def ask(mav: common.MAVLink) -> bytes:
    request = common.MAVLink_command_long_message(1, 1, REQUEST, 0, VERSION, 0, 0, 0, 0, 0, 0)
    packet: bytes = request.pack(mav)
    return packet


def answers(simulated: SimulatedMavlink, packet: bytes) -> bool:
    simulated.outgoing()
    simulated.receive(packet, simulated.state_ns)
    return any(answer[7] == 77 for answer in simulated.outgoing())


def test_a_packet_signed_by_pymavlink_is_believed_and_its_answer_by_pymavlink() -> None:
    simulated, mav = vehicle(), client()
    simulated.receive(ask(mav), 0)
    heard = [mav.decode(bytearray(answer)) for answer in simulated.outgoing()]
    assert "COMMAND_ACK" in {message.get_type() for message in heard}
    assert all(message.get_signed() for message in heard)


def test_an_unsigned_packet_is_not_believed_unless_it_may_be() -> None:
    assert not answers(vehicle(), ask(client(None)))
    assert answers(vehicle(unsigned=True), ask(client(None)))


def test_a_packet_signed_with_another_key_is_not_believed_even_so() -> None:
    assert not answers(vehicle(), ask(client(b"x" * 32)))
    assert not answers(vehicle(unsigned=True), ask(client(b"x" * 32)))


def test_a_packet_that_was_changed_is_not_believed() -> None:
    packet = bytearray(ask(client()))
    packet[4] ^= 1
    assert not answers(vehicle(), bytes(packet))


def test_a_packet_is_believed_once() -> None:
    simulated, packet = vehicle(), ask(client())
    assert answers(simulated, packet)
    assert not answers(simulated, packet)


def test_an_older_packet_is_not_believed() -> None:
    simulated, mav = vehicle(), client()
    first, second = ask(mav), ask(mav)
    assert answers(simulated, second)
    assert not answers(simulated, first)


def test_a_new_stream_may_not_be_older_than_a_minute() -> None:
    assert answers(vehicle(), ask(client(ticks=TICKS - 59 * 100_000)))
    assert not answers(vehicle(), ask(client(ticks=TICKS - 61 * 100_000)))


def test_a_forged_packet_from_the_future_locks_nobody_out() -> None:
    """pymavlink stores a time stamp before it checks the signature; the vehicle does not."""
    simulated = vehicle()
    assert not answers(simulated, ask(client(b"x" * 32, ticks=TICKS + 10**12)))
    assert answers(simulated, ask(client()))


def test_streams_are_bounded() -> None:
    signatures = Signatures(KEY, accepts_unsigned=False)
    believed = 0
    for system in range(1, 100):
        mav = client()
        mav.srcSystem = system
        believed += signatures.accepts(ask(mav), TICKS)
    assert believed == MOST_STREAMS


def test_time_stamps_that_go_out_grow() -> None:
    signatures = Signatures(KEY, accepts_unsigned=False)
    told = [signatures.next_ticks(now) for now in (10, 10, 5, 20)]
    assert told == [10, 11, 12, 20]


def test_setup_signing_gives_a_key_and_takes_it_away() -> None:
    simulated, mav = vehicle(key=None), client(None)
    simulated.receive(common.MAVLink_setup_signing_message(1, 1, list(KEY), 0).pack(mav), 0)
    assert not answers(simulated, ask(mav))
    good = client(ticks=TICKS + 10)
    assert answers(simulated, ask(good))
    simulated.reboot()
    assert answers(simulated, ask(good)), "the key outlives a reboot"
    simulated.receive(common.MAVLink_setup_signing_message(1, 1, [0] * 32, 0).pack(good), 0)
    assert answers(simulated, ask(mav))


def test_the_bytes_of_a_signature() -> None:
    packet = bytes.fromhex("FD 01 01 00 00 01 01 00 00 00 00 12 34")
    told = signed(packet, KEY, 3, 0x0102030405)
    assert told[: len(packet)] == packet
    assert told[len(packet) : len(packet) + 7] == bytes.fromhex("03 05 04 03 02 01 00")
    assert told[-6:] == hashlib.sha256(KEY + told[:-6]).digest()[:6]


def test_a_key_comes_from_a_file_that_only_its_owner_reads(tmp_path: Path) -> None:
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    assert key_of(str(path)) == KEY
    path.write_bytes(KEY)
    assert key_of(str(path)) == KEY
    path.chmod(0o640)
    with pytest.raises(InputError, match="may be read by others"):
        key_of(str(path))


def test_a_key_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    assert key_of("") is None
    monkeypatch.setenv(VARIABLE, KEY.hex())
    assert key_of("") == KEY
    monkeypatch.setenv(VARIABLE, "12")
    with pytest.raises(InputError, match=VARIABLE):
        key_of("")


def test_what_is_no_key_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "key"
    with pytest.raises(InputError, match="No such file"):
        key_of(str(path))
    path.write_text("not a key")
    path.chmod(0o600)
    with pytest.raises(InputError, match="hexadecimal"):
        key_of(str(path))
