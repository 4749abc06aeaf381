"""Signing timestamps that nobody may see twice, and vehicles whose own clock is behind."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import socket
import threading
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from drivers.mavlink import signing
from drivers.mavlink.codec import Codec
from drivers.mavlink.contact import Contact
from drivers.mavlink.dialect import Message, mavlink
from drivers.mavlink.options import MavlinkOptions
from drivers.mavlink.peer import Peer, Receiver
from drivers.mavlink.session import Session
from drivers.mavlink.signing import Key, Timestamps
from drivers.mavlink.transport import Udp
from lcd_flight.model import RefusedError

KEY = Key(hashlib.sha256(b"one").digest())
OTHER = Key(hashlib.sha256(b"two").digest())
OURS, VEHICLE = (245, 191), (1, 1)
S = 1_000_000_000
HOUR = 3_600 * 100_000
"""In tens of microseconds."""
DAY = 24 * HOUR
FILE = f"mavlink-signing-{KEY.fingerprint}"


def real_stamp() -> int:
    return round((time.time() - 1_420_070_400) * 100_000)


class Hands:
    """A clock that is moved by hand."""

    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        return self.ns

    async def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)
        await asyncio.sleep(0)


class Wire:
    """A transport that forgets what is sent."""

    stream = False
    faults = 0
    called = None

    async def open(self, receive: Receiver) -> None:
        """Nothing is heard here."""

    def send(self, _data: bytes, _peer: Peer | None, /) -> bool:
        return True

    def send_now(self, _data: bytes, _peer: Peer | None, /) -> bool:
        return True

    def close(self) -> None:
        """Nothing is held."""


class TestKept:
    def test_a_lower_one_never_replaces_what_was_there(self, tmp_path: Path) -> None:
        Timestamps(KEY, tmp_path).keep(1_000)
        Timestamps(KEY, tmp_path).keep(0)
        assert int((tmp_path / FILE).read_text()) == 1_000

    def test_what_was_noted_ahead_is_exact_after_closing(self, tmp_path: Path) -> None:
        stamps = Timestamps(KEY, tmp_path)
        stamps.keep(5_000)
        stamps.keep(700)
        assert int((tmp_path / FILE).read_text()) == 700

    def test_unless_another_program_with_this_key_is_further(self, tmp_path: Path) -> None:
        first, second = Timestamps(KEY, tmp_path), Timestamps(KEY, tmp_path)
        first.keep(5_000)
        second.keep(9_000)
        first.keep(700)
        assert int((tmp_path / FILE).read_text()) == 9_000

    @pytest.mark.parametrize("damaged", ["-5", str(1 << 48), "1e9", ""])
    def test_what_is_no_timestamp_counts_as_none(self, tmp_path: Path, damaged: str) -> None:
        (tmp_path / FILE).write_text(damaged)
        assert abs(Timestamps(KEY, tmp_path).at(0) - real_stamp()) < HOUR

    def test_nothing_else_is_left_in_the_folder(self, tmp_path: Path) -> None:
        Timestamps(KEY, tmp_path).keep(5)
        assert [path.name for path in tmp_path.iterdir()] == [FILE]


class TestCrash:
    @pytest.fixture
    def contact(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Contact:
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
        monkeypatch.setenv("LCD_TEST_KEY", "one")
        return self.connected()

    @staticmethod
    def connected() -> Contact:
        options = MavlinkOptions(autopilot="px4", signing="env:LCD_TEST_KEY", connect_s=0.1)
        return Contact("mavlink+udp://127.0.0.1:1", options, Hands(), Wire())

    @staticmethod
    def lives(contact: Contact, seconds: int) -> Iterator[int]:
        """Ten times a second the newest stamp that has been used, once the disk is done."""
        for tenth in range(10 * seconds):
            contact.clock.ns = tenth * S // 10  # type: ignore[attr-defined]
            contact.tend(contact.clock.now_ns())
            for thread in threading.enumerate():
                if thread is not threading.current_thread() and thread.daemon:
                    thread.join(5.0)
            yield contact.session.newest_stamp

    def test_whenever_it_ends_the_next_start_goes_on_later(
        self, contact: Contact, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Ten minutes, no closing, and a clock that says the day before: no stamp is used twice."""
        with contextlib.suppress(RefusedError):
            asyncio.run(contact.find())  # nobody is there; the stamps are noted all the same
        file = tmp_path / "lcd-flight" / FILE
        for used in self.lives(contact, 600):
            assert int(file.read_text()) >= used
        monkeypatch.setattr(signing, "_real_time", lambda: real_stamp() - DAY)
        assert self.connected().session.newest_stamp > used

    def test_the_disk_is_not_written_all_the_time(
        self, contact: Contact, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        kept: list[int] = []
        monkeypatch.setattr(Timestamps, "keep", lambda _self, newest: kept.append(newest))
        assert len(list(self.lives(contact, 60))) == 600
        assert len(kept) <= 4
        assert kept == sorted(kept)


class SignedVehicle:
    """pymavlink's own signing at a socket of its own, with a clock that may be wrong."""

    def __init__(self, stamp: int, key: Key = KEY) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.heard = 0
        self._mav = mavlink.MAVLink(None, *VEHICLE)
        self._mav.signing.secret_key = key.secret
        self._mav.signing.sign_outgoing = True
        self._mav.signing.timestamp = stamp

    @property
    def peer(self) -> Peer:
        host, port = self.socket.getsockname()
        return (host, port)

    def beat(self, port: int) -> None:
        """Its heartbeat; then it takes in what has come."""
        self.socket.sendto(mavlink.MAVLink_heartbeat_message(2, 12, 1, 0, 3, 3).pack(self._mav), ("127.0.0.1", port))
        self._mav.seq = (self._mav.seq + 1) % 256

    def listen(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                data = self.socket.recv(2048)
                self.heard += 1
                with contextlib.suppress(mavlink.MAVError):
                    self._mav.decode(bytearray(data))


@contextlib.asynccontextmanager
async def listening(tmp_path: Path) -> AsyncIterator[tuple[Session, int, Hands, list[Message]]]:
    """A session with the key, its port, its clock, and what it has believed."""
    clock, transport = Hands(), Udp("127.0.0.1", 0, call=False)
    session = Session(transport, Codec(*OURS, KEY, Timestamps(KEY, tmp_path)), clock, VEHICLE)
    heard: list[Message] = []
    session.listen(lambda message, _now_ns: heard.append(message))
    await session.open()
    try:
        yield session, transport.port, clock, heard
    finally:
        session.close()


async def meet(vehicle: SignedVehicle, session: Session, port: int, clock: Hands, beats: int = 4) -> None:
    """Heartbeats both ways, four a second of the clock."""
    for _ in range(beats):
        vehicle.beat(port)
        await asyncio.sleep(0.02)
        clock.ns += S // 4
        session.beat(clock.now_ns())
        await asyncio.sleep(0.02)
        vehicle.listen()


@pytest.mark.realtime
class TestOldClock:
    def test_it_is_told_the_time_and_then_heard(self, tmp_path: Path) -> None:
        async def main() -> None:
            vehicle = SignedVehicle(real_stamp() - HOUR)
            async with listening(tmp_path) as (session, port, clock, heard):
                with vehicle.socket:
                    await meet(vehicle, session, port, clock)
                    assert session.peer == vehicle.peer
                assert [message.get_type() for message in heard] == ["HEARTBEAT"] * 3
                assert session.rejected == {"too old": 1}  # and nothing of it was believed

        asyncio.run(main())

    def test_also_from_another_port_after_a_restart(self, tmp_path: Path) -> None:
        """The board has forgotten the time again, and the pinned port is gone."""

        async def main() -> None:
            first, second = SignedVehicle(real_stamp()), SignedVehicle(real_stamp() - HOUR)
            async with listening(tmp_path) as (session, port, clock, _heard):
                with first.socket, second.socket:
                    await meet(first, session, port, clock)
                    assert session.peer == first.peer
                    clock.ns += 3 * S
                    await meet(second, session, port, clock)
                    assert session.peer == second.peer

        asyncio.run(main())

    def test_who_does_not_have_the_key_gets_nothing(self, tmp_path: Path) -> None:
        async def main() -> None:
            stranger = SignedVehicle(real_stamp() - HOUR, OTHER)
            async with listening(tmp_path) as (session, port, clock, heard):
                with stranger.socket:
                    await meet(stranger, session, port, clock)
                assert (stranger.heard, heard, session.peer) == (0, [], None)

        asyncio.run(main())

    def test_old_packets_that_are_replayed_by_the_hundred_are_answered_once_a_second(self, tmp_path: Path) -> None:
        async def main() -> None:
            recorder = SignedVehicle(real_stamp() - HOUR)
            async with listening(tmp_path) as (session, port, clock, heard):
                with recorder.socket:
                    for _ in range(100):
                        recorder.beat(port)
                    await asyncio.sleep(0.05)
                    clock.ns += S
                    recorder.beat(port)
                    await asyncio.sleep(0.05)
                    recorder.listen()
                assert (recorder.heard, heard, session.peer) == (2, [], None)

        asyncio.run(main())
