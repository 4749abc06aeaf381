"""`lcd monitor --foxglove`: a WebSocket client sees the topics of the log, and what stands still again each second."""

from __future__ import annotations

import base64
import json
import os
import socket
import struct
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
import synthetic_flight

from lcd_flight.model import Finding, RefusedError, Severity
from lcd_flight.monitor.foxglove_server import FoxgloveServer
from lcd_flight.observers import LiveStream
from lcd_flight.record.live import live_flight
from lcd_flight.record.topics import TOPICS
from lcd_flight.wire.live_frame import decode, encode

pytest.importorskip("foxglove", reason="the extra `foxglove` is not installed")

GAP = Finding("pose_gap", Severity.WARN, "pose gap 42 ms", 0.042, 0.3)
PAIRS = synthetic_flight.with_finding(synthetic_flight.flight(), 303, 306, GAP)
TEXT, BINARY = 1, 2


class Client:
    """As much of RFC 6455 and of Foxglove's protocol as a viewer needs: subscribes to everything, keeps messages."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=20.0)
        key = base64.b64encode(os.urandom(16)).decode()
        self._socket.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
        )
        self._stream = self._socket.makefile("rb")
        assert b"101" in self._stream.readline()
        while self._stream.readline().strip():
            pass
        self.channels: dict[str, dict[str, Any]] = {}
        self._topics: dict[int, str] = {}

    def _frame(self) -> tuple[int, bytes]:
        first, second = self._stream.read(2)
        length = second & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", self._stream.read(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._stream.read(8))
        return first & 0x0F, self._stream.read(length)

    def _send(self, message: dict[str, Any]) -> None:
        data = json.dumps(message).encode()
        size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0x80 | 126]) + struct.pack(">H", len(data))
        self._socket.sendall(bytes([0x81]) + size + b"\0\0\0\0" + data)

    def subscribe(self) -> None:
        """To all channels of the table, once they are advertised."""
        while len(self.channels) < len(TOPICS):
            kind, data = self._frame()
            message = json.loads(data) if kind == TEXT else {}
            for channel in message.get("channels", []):
                self.channels[channel["topic"]] = channel
        wanted = [{"id": number, "channelId": c["id"]} for number, c in enumerate(self.channels.values())]
        self._topics = dict(enumerate(self.channels))
        self._send({"op": "subscribe", "subscriptions": wanted})

    def messages(self) -> Iterator[tuple[str, int, bytes]]:
        """Topic, stamp and data."""
        while True:
            kind, data = self._frame()
            if kind == BINARY and data[0] == 1:
                subscription, stamp_ns = struct.unpack_from("<IQ", data, 1)
                yield self._topics[subscription], stamp_ns, data[13:]

    def close(self) -> None:
        self._stream.close()
        self._socket.close()


def published() -> list[bytes]:
    taken: list[bytes] = []

    class Keeper:
        def __call__(self, data: bytes) -> None:
            taken.append(data)

        def close(self) -> None:
            pass

    stream = LiveStream(Keeper(), encode(live_flight(synthetic_flight.header())))
    for inputs, tick in PAIRS:
        stream.observe(inputs, tick)
    return taken


def wait_for_subscriptions(server: FoxgloveServer) -> None:
    latest_s = time.monotonic() + 20.0
    while not all(channel.has_sinks() for channel in server._channels.values()):
        assert time.monotonic() < latest_s
        time.sleep(0.01)


@pytest.fixture
def client() -> Iterator[tuple[FoxgloveServer, Client]]:
    with FoxgloveServer(0) as server:
        connected = Client(server.port)
        yield server, connected
        connected.close()


def test_a_viewer_sees_the_flight(client: tuple[FoxgloveServer, Client]) -> None:
    server, viewer = client
    viewer.subscribe()
    assert {t: c["schemaName"] for t, c in viewer.channels.items()} == {t.name: t.schema_name for t in TOPICS}
    assert {t: c["encoding"] for t, c in viewer.channels.items()} == {t.name: t.encoding for t in TOPICS}
    wait_for_subscriptions(server)
    for data in published():
        server.take(decode(data))
    seen: dict[str, int] = {}
    for topic, stamp_ns, data in viewer.messages():
        seen[topic] = seen.get(topic, 0) + 1
        if topic == "/tick" and b'"landed"' in data:
            assert stamp_ns == PAIRS[-1][1].now_ns
            break
    assert set(seen) == {topic.name for topic in TOPICS}
    assert seen["/tick"] == seen["/tick_inputs"] > 90
    assert seen["/scene"] == seen["/plan"] > 5  # again each second, for who comes late


def test_findings_of_ticks_that_were_not_sent_are_told_too(client: tuple[FoxgloveServer, Client]) -> None:
    server, viewer = client
    viewer.subscribe()
    wait_for_subscriptions(server)
    for data in published():
        server.take(decode(data))
    told = []
    for topic, _, data in viewer.messages():
        told += [data] if topic == "/log" else []
        if topic == "/tick" and b'"landed"' in data:
            break
    assert sum(b"pose gap 42 ms" in data for data in told) == 1
    assert sum(b"ready" in data for data in told) == 1


def test_a_port_in_use_is_refused() -> None:
    with (
        FoxgloveServer(0) as first,
        pytest.raises(RefusedError, match=f"--foxglove {first.port}: the port is not to be had"),
    ):
        FoxgloveServer(first.port)


def test_without_the_sdk_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(RefusedError, match=r"pip install 'lcd-flight\[foxglove\]'"):
        FoxgloveServer(0)
