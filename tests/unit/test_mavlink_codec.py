"""Bytes to messages: what is damaged, unsigned, replayed or forged is left out, counted, and harms nothing after it."""

from __future__ import annotations

import hashlib
import random
import struct
from pathlib import Path

import pytest

from drivers.mavlink.codec import Codec
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.signing import Key, Timestamps

KEY = Key(hashlib.sha256(b"one").digest())
OTHER = Key(hashlib.sha256(b"two").digest())
MONTH = 30 * 24 * 3600 * 100_000
"""In tens of microseconds."""


@pytest.fixture
def stamps(tmp_path: Path) -> Timestamps:
    return Timestamps(KEY, tmp_path)


def heartbeat() -> Message:
    return mavlink.MAVLink_heartbeat_message(2, 12, 81, 393216, 4, 3)


def names(messages: list[Message]) -> list[str]:
    return [message.get_type() for message in messages]


class TestFraming:
    def test_what_was_encoded_with_numbers_in_order(self) -> None:
        sender, receiver = Codec(1, 1), Codec(245, 191)
        buffer = bytearray(b"".join(sender.encode(heartbeat(), 0) for _ in range(300)))
        messages = receiver.decode(buffer)
        assert [m.get_seq() for m in messages] == [n % 256 for n in range(300)]
        assert {(m.get_srcSystem(), m.get_srcComponent()) for m in messages} == {(1, 1)}
        assert buffer == b""

    def test_a_packet_in_pieces(self) -> None:
        data, receiver, buffer = Codec(1, 1).encode(heartbeat(), 0), Codec(245, 191), bytearray()
        found = []
        for byte in data:
            buffer.append(byte)
            found += receiver.decode(buffer)
        assert names(found) == ["HEARTBEAT"]

    def test_a_damaged_packet_costs_itself_alone(self) -> None:
        sender, receiver = Codec(1, 1), Codec(245, 191)
        first, second, third = (sender.encode(heartbeat(), 0) for _ in range(3))
        broken = bytearray(second)
        broken[1] = 200  # its length: pymavlink's parser would swallow the third as well
        found = receiver.decode(bytearray(first + broken + third + bytes(220)))
        assert [m.get_seq() for m in found] == [0, 2]
        assert receiver.rejected["damaged"] >= 1

    def test_the_older_protocol_is_understood(self) -> None:
        data = heartbeat().pack(mavlink.MAVLink(None, 1, 1), force_mavlink1=True)
        assert data[0] == 0xFE
        assert names(Codec(245, 191).decode(bytearray(data))) == ["HEARTBEAT"]

    def test_what_the_dialect_does_not_know_is_left_out(self) -> None:
        data = bytearray(Codec(1, 1).encode(heartbeat(), 0))
        data[7:10] = b"\xff\xff\xff"
        receiver = Codec(245, 191)
        assert receiver.decode(data) == []
        assert receiver.rejected == {"of an unknown kind": 1}

    def test_flags_that_nobody_knows_are_not_guessed_at(self) -> None:
        data = bytearray(Codec(1, 1).encode(heartbeat(), 0))
        data[2] = 0x02
        assert Codec(245, 191).decode(data) == []

    def test_rubbish_of_any_kind_raises_nothing_and_keeps_nothing(self) -> None:
        luck = random.Random(1)  # noqa: S311 - chance, not secrecy
        receiver, buffer = Codec(245, 191), bytearray()
        good = Codec(1, 1).encode(heartbeat(), 0)
        for _ in range(2_000):
            mutated = bytearray(good)
            mutated[luck.randrange(len(mutated))] ^= 1 << luck.randrange(8)
            buffer += mutated + luck.randbytes(luck.randrange(40))
            receiver.decode(buffer)
            assert len(buffer) <= 280

    def test_any_payload_under_a_good_checksum_raises_nothing(self) -> None:
        luck = random.Random(2)  # noqa: S311 - chance, not secrecy
        receiver = Codec(245, 191)
        for number, kind in list(mavlink.mavlink_map.items()):
            payload = luck.randbytes(kind.unpacker.size)
            head = struct.pack("<BBBBBBBHB", 0xFD, len(payload), 0, 0, 0, 1, 1, number & 0xFFFF, number >> 16)
            checksum = mavlink.x25crc(head[1:] + payload + bytes([kind.crc_extra])).crc
            receiver.decode(bytearray(head + payload + checksum.to_bytes(2, "little")))


class TestSigning:
    def test_signed_both_ways(self, stamps: Timestamps) -> None:
        sender, receiver = Codec(1, 1, KEY, stamps), Codec(245, 191, KEY)
        for n in range(10):
            assert names(receiver.decode(bytearray(sender.encode(heartbeat(), n * 1_000_000)))) == ["HEARTBEAT"]
        assert not receiver.rejected

    def test_the_signature_is_as_the_protocol_has_it(self, stamps: Timestamps) -> None:
        data = Codec(1, 1, KEY, stamps).encode(heartbeat(), 0)
        assert data[2] == 1
        assert data[-13] == 0  # link id
        assert data[-6:] == hashlib.sha256(KEY.secret + data[:-6]).digest()[:6]

    @pytest.mark.parametrize("case", ["unsigned", "older protocol"])
    def test_unsigned_is_left_out(self, case: str) -> None:
        receiver = Codec(245, 191, KEY)
        data = heartbeat().pack(mavlink.MAVLink(None, 1, 1), force_mavlink1=case == "older protocol")
        assert receiver.decode(bytearray(data)) == []
        assert receiver.rejected == {"unsigned": 1}

    def test_another_key_is_left_out(self, stamps: Timestamps) -> None:
        receiver = Codec(245, 191, KEY)
        assert receiver.decode(bytearray(Codec(1, 1, OTHER, stamps).encode(heartbeat(), 0))) == []
        assert receiver.rejected == {"forged": 1}

    def test_a_replay_is_left_out(self, stamps: Timestamps) -> None:
        sender, receiver = Codec(1, 1, KEY, stamps), Codec(245, 191, KEY)
        old = [sender.encode(heartbeat(), 0) for _ in range(3)]
        for data in old:
            receiver.decode(bytearray(data))
        for data in old:
            assert receiver.decode(bytearray(data)) == []
        assert receiver.rejected == {"replayed": 3}

    def test_a_forged_packet_from_the_far_future_changes_nothing(self, stamps: Timestamps) -> None:
        """pymavlink alone keeps its timestamp before it has verified it, and then refuses all that is good."""
        sender, receiver = Codec(1, 1, KEY, stamps), Codec(245, 191, KEY)
        receiver.decode(bytearray(sender.encode(heartbeat(), 0)))
        forged = bytearray(sender.encode(heartbeat(), 1_000_000))
        forged[-12:-6] = b"\xff" * 6
        assert receiver.decode(bytearray(forged)) == []
        assert names(receiver.decode(bytearray(sender.encode(heartbeat(), 2_000_000)))) == ["HEARTBEAT"]

    def test_nor_does_one_that_comes_first(self, stamps: Timestamps) -> None:
        sender, receiver = Codec(1, 1, KEY, stamps), Codec(245, 191, KEY)
        forged = bytearray(sender.encode(heartbeat(), 0))
        forged[-12:-6] = b"\xff" * 6
        receiver.decode(bytearray(forged))
        assert names(receiver.decode(bytearray(sender.encode(heartbeat(), 1_000_000)))) == ["HEARTBEAT"]

    def test_pymavlink_alone_would_fail_there(self, stamps: Timestamps) -> None:
        """The reason for the guard; should this ever pass without it, the guard can go."""
        plain = mavlink.MAVLink(None)
        plain.signing.secret_key = KEY.secret
        plain.robust_parsing = True
        sender = Codec(1, 1, KEY, stamps)
        plain.parse_buffer(sender.encode(heartbeat(), 0))
        forged = bytearray(sender.encode(heartbeat(), 1_000_000))
        forged[-12:-6] = b"\xff" * 6
        plain.parse_buffer(forged)
        (found,) = plain.parse_buffer(sender.encode(heartbeat(), 2_000_000))
        assert found.get_type() == "BAD_DATA"

    def test_senders_that_are_made_up_do_not_fill_the_memory(self, stamps: Timestamps) -> None:
        receiver = Codec(245, 191, KEY)
        for system in range(1, 200):
            receiver.decode(bytearray(Codec(system, 1, KEY, stamps).encode(heartbeat(), 0)))
        assert len(receiver._signing.stream_timestamps) == 64


class TestTimestamps:
    def test_they_follow_real_time_and_never_stand_still(self, stamps: Timestamps) -> None:
        codec = Codec(245, 191, KEY, stamps)
        seen = [int.from_bytes(codec.encode(heartbeat(), at)[-12:-6], "little") for at in (0, 0, 0, 50_000_000)]
        assert seen[1:3] == [seen[0] + 1, seen[0] + 2]
        assert seen[3] == seen[0] + 5_000

    def test_a_restart_goes_on_after_the_newest_though_the_clock_went_back(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        first = Timestamps(KEY, tmp_path)
        newest = first.at(0) + MONTH
        first.keep(newest)
        again = Timestamps(KEY, tmp_path)
        assert again.at(0) == newest + 1

    def test_each_key_has_its_own(self, tmp_path: Path) -> None:
        first = Timestamps(KEY, tmp_path)
        first.keep(first.at(0) + MONTH)
        assert Timestamps(OTHER, tmp_path).at(0) < first.at(0) + MONTH

    def test_what_is_kept_does_not_tell_the_key(self, tmp_path: Path) -> None:
        Timestamps(KEY, tmp_path).keep(5)
        (file,) = tmp_path.iterdir()
        assert KEY.secret.hex() not in file.name + file.read_text()

    def test_a_damaged_file_counts_as_none(self, tmp_path: Path) -> None:
        Timestamps(KEY, tmp_path).keep(5)
        next(iter(tmp_path.iterdir())).write_text("rubbish")
        assert Timestamps(KEY, tmp_path).at(0) > MONTH
