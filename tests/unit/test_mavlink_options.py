"""Addresses and options of the three kinds of link, and where a signing key may stand."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from drivers.mavlink import options, signing
from lcd_flight.model import InputError, RefusedError
from lcd_flight.plugins.links import parse_uri

PX4 = {"autopilot": "px4"}


@pytest.mark.parametrize(
    "uri",
    [
        "mavlink+udp://0.0.0.0:14540?autopilot=px4",
        "mavlink+udp://10.0.0.2:14580?autopilot=px4&role=call&allow=10.0.0.2,127.0.0.1",
        "mavlink+tcp://127.0.0.1:5760?autopilot=ardupilot&mode=guided_nogps",
        "mavlink+serial:///dev/ttyACM0?baud=921600&autopilot=ardupilot",
    ],
)
def test_links_as_they_are_written(uri: str) -> None:
    parsed = parse_uri(uri)
    chosen = options.read(parsed.link, parsed.address, parsed.link_options())
    assert chosen.autopilot in uri  # type: ignore[operator]


def test_layers_come_after_it() -> None:
    parsed = parse_uri("mavlink+udp+delay://0.0.0.0:14540?autopilot=px4&delay_ms=3")
    assert (parsed.link, parsed.layers) == ("mavlink+udp", ("delay",))


@pytest.mark.parametrize(
    ("scheme", "address", "given", "message"),
    [
        ("mavlink+udp", "14540", PX4, "write it like mavlink"),
        ("mavlink+udp", "localhost:0", PX4, "write it like mavlink"),
        ("mavlink+udp", "localhost:70000", PX4, "write it like mavlink"),
        ("mavlink+serial", "ttyACM0", PX4, "mavlink+serial:///dev/ttyACM0"),
        ("mavlink+udp", "localhost:14540", {}, "say which autopilot"),
        ("mavlink+udp", "localhost:14540", {"autopilot": "betaflight"}, "autopilot=betaflight"),
        ("mavlink+udp", "localhost:14540", {**PX4, "pose_rate_hz": "100"}, "pose_rate_hz=100"),
        ("mavlink+udp", "localhost:14540", {**PX4, "system": "0"}, "system=0"),
        ("mavlink+udp", "localhost:14540", {**PX4, "hover": "1.2"}, "hover=1.2"),
        ("mavlink+udp", "localhost:14540", {**PX4, "baud": "921600"}, "option baud belongs to mavlink"),
        ("mavlink+tcp", "localhost:5760", {**PX4, "role": "call"}, "option role belongs to mavlink"),
        ("mavlink+serial", "/dev/ttyACM0", {**PX4, "baud": "57600"}, "baud=57600"),
        ("mavlink+udp", "localhost:14540", {**PX4, "origin": "47.4"}, "write latitude,longitude,height"),
        ("mavlink+udp", "localhost:14540", {**PX4, "origin": "97,8,0"}, "write latitude,longitude,height"),
        ("mavlink+udp", "localhost:14540", {**PX4, "allow": "drone.local"}, "drone.local is not an IP address"),
        ("mavlink+udp", "localhost:14540", {**PX4, "colour": "red"}, "unknown option colour"),
    ],
)
def test_what_is_wrong_is_named(scheme: str, address: str, given: dict[str, str], message: str) -> None:
    with pytest.raises(InputError) as refused:
        options.read(scheme, address, given)
    assert message in str(refused.value)


class TestKey:
    @pytest.fixture
    def file(self, tmp_path: Path) -> Path:
        path = tmp_path / "key"
        path.write_text("correct horse\n")
        path.chmod(0o600)
        return path

    def test_none_is_wanted(self) -> None:
        assert signing.key_from("") is None

    def test_a_passphrase_in_a_file(self, file: Path) -> None:
        key = signing.key_from(f"file:{file}")
        assert key is not None
        assert key.secret == hashlib.sha256(b"correct horse").digest()
        assert key.secret.hex() not in repr(key)

    def test_32_bytes_in_the_environment(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("A_KEY", "0f" * 32)
        key = signing.key_from("env:A_KEY")
        assert key is not None
        assert key.secret == b"\x0f" * 32

    @pytest.mark.parametrize("mode", [0o640, 0o604, 0o644, 0o660])
    def test_a_file_that_others_may_read_is_refused(self, file: Path, mode: int) -> None:
        file.chmod(mode)
        with pytest.raises(RefusedError, match="others may read it: chmod 600"):
            signing.key_from(f"file:{file}")

    @pytest.mark.parametrize("place", ["correct horse", "0f" * 32, "file:", "env:", "keyring:x"])
    def test_a_key_in_the_uri_itself_is_refused_and_not_repeated(self, place: str) -> None:
        with pytest.raises(InputError, match="write signing=env:NAME or signing=file:PATH") as refused:
            signing.key_from(place)
        assert "0f0f" not in str(refused.value)
        assert "horse" not in str(refused.value)

    def test_nothing_there(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("NO_KEY", raising=False)
        with pytest.raises(InputError, match="no environment variable NO_KEY"):
            signing.key_from("env:NO_KEY")
        with pytest.raises(InputError, match="cannot be read"):
            signing.key_from(f"file:{tmp_path}/none")
        empty = tmp_path / "empty"
        empty.touch(0o600)
        with pytest.raises(InputError, match="it is empty"):
            signing.key_from(f"file:{empty}")
