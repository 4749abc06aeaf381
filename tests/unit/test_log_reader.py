"""Reading logs that were cut, damaged, or are none: what was flushed comes back, a refusal is one clear line."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
import synthetic_flight
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from synthetic_flight import Pair

from lcd_flight.model import Finding, InputError, LinkReport, Phase, PoseReport, Severity, Tick, TickInputs
from lcd_flight.model.tick import MotorRequest
from lcd_flight.record import LogWriter, read_log, read_ticks
from lcd_flight.record import header as header_module

EMPTY_INPUTS = TickInputs(3, 1_020_000_000, 1_019_000_000, 2, PoseReport(None, None), LinkReport(False, None))
EMPTY_TICK = Tick(3, 1_020_000_000, 0.01, Phase.PREFLIGHT, -1, 0.0, None, None, MotorRequest.NONE, None, False)


@pytest.fixture(scope="module")
def pairs() -> list[Pair]:
    return synthetic_flight.flight()[:400]


@pytest.fixture(scope="module")
def whole(pairs: list[Pair], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _written(tmp_path_factory.mktemp("log") / "whole.mcap", pairs)


def _written(path: Path, pairs: list[Pair]) -> Path:
    writer = LogWriter(path, synthetic_flight.header())
    for inputs, tick in pairs:
        writer.write(inputs, tick)
    writer.close()
    return path


def pairs_by_sequence(pairs: list[Pair]) -> Iterator[tuple[int, Pair]]:
    return ((tick.sequence, (inputs, tick)) for inputs, tick in pairs)


def _refusal(path: Path) -> str:
    """The one line that reading ends with."""
    with pytest.raises(InputError) as refused:
        read_log(path)
    text = str(refused.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


# Cut files


def test_a_file_cut_anywhere_gives_the_beginning_of_the_flight(whole: Path, pairs: list[Pair], tmp_path: Path) -> None:
    data = whole.read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for size in np.linspace(len(data) // 4, len(data) - 1, 40).astype(int):
        cut.write_bytes(data[:size])
        kept = read_ticks(cut)
        assert kept == pairs[: len(kept)]
        counts.append(len(kept))
    assert counts == sorted(counts)
    assert counts[-1] == len(pairs)


def test_a_file_cut_in_every_byte_of_its_description_is_refused_clearly(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    description = data.index(b"limits.json") + 100
    cut = tmp_path / "cut.mcap"
    for size in [*range(1, 200), *range(200, description, 97)]:
        cut.write_bytes(data[:size])
        text = _refusal(cut)
        assert any(words in text for words in ("is not an MCAP file", "was cut", "is damaged")), (size, text)


def test_a_cut_file_says_so(whole: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-10_000])
    assert not read_log(cut).complete
    assert read_log(whole).complete


def test_damage_in_the_middle_costs_its_chunk_alone(whole: Path, pairs: list[Pair], tmp_path: Path) -> None:
    data = whole.read_bytes()
    damaged, written = tmp_path / "damaged.mcap", dict(pairs_by_sequence(pairs))
    counts = []
    for place in range(len(data) // 3, len(data) // 3 * 2, len(data) // 50):
        damaged.write_bytes(data[:place] + bytes([data[place] ^ 0x55]) + data[place + 1 :])
        log, kept = read_log(damaged), read_ticks(damaged)
        assert all(written[tick.sequence] == (inputs, tick) for inputs, tick in kept)  # never a wrong number
        assert len(kept) + log.missing_ticks == kept[-1][1].sequence - kept[0][1].sequence + 1
        assert log.complete == (len(kept) == len(pairs))  # an index may be altered, too: nothing is lost then
        counts.append(len(kept))
    assert any(len(pairs) - 60 < count < len(pairs) for count in counts)  # a chunk holds half a second


def test_an_absurd_length_does_not_fill_the_memory(whole: Path, tmp_path: Path) -> None:
    path = tmp_path / "absurd.mcap"
    path.write_bytes(whole.read_bytes()[:8] + struct.pack("<BQ", 1, 2**60))
    assert "was cut before the flight's description" in _refusal(path)


@pytest.mark.parametrize("length", [2**40, 2**62, 2**64 - 1])
def test_an_absurd_length_within_a_chunk_does_not_either(whole: Path, tmp_path: Path, length: int) -> None:
    """Of its compressed data: what the library asks the file for before it looks at how large a record may be."""
    data = bytearray(whole.read_bytes())
    with whole.open("rb") as stream:
        chunks = [each for each in StreamReader(stream, emit_chunks=True).records if isinstance(each, Chunk)]
    struct.pack_into("<Q", data, data.index(chunks[len(chunks) // 2].data) - 8, length)
    path = tmp_path / "absurd.mcap"
    path.write_bytes(data)
    assert 0 < len(read_ticks(path)) < len(read_ticks(whole))
    assert not read_log(path).complete


# Files that are none


def test_no_file(tmp_path: Path) -> None:
    assert _refusal(tmp_path / "none.mcap") == "cannot be read: No such file or directory"


def test_a_folder(tmp_path: Path) -> None:
    assert _refusal(tmp_path) == "cannot be read: Is a directory"


def test_an_empty_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    path.touch()
    assert _refusal(path) == "is empty"


@pytest.mark.parametrize("content", [b"time,x,y\n0,1,2\n", b"\x89PNG\r\n\x1a\n" + b"\0" * 100, b"\0" * 3])
def test_another_format(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.mcap"
    path.write_bytes(content)
    assert _refusal(path) == "is not an MCAP file; flight logs end in .mcap"


def test_another_program(tmp_path: Path) -> None:
    path = tmp_path / "foreign.mcap"
    writer = Writer(str(path))
    writer.start(profile="ros2", library="somebody's recorder 2.1")
    writer.finish()
    assert _refusal(path) == "was written by another program (somebody's recorder 2.1), not by lcd-flight"


def test_a_newer_schema(tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(header_module, "LOG_SCHEMA", 2)
    path = _written(tmp_path / "newer.mcap", pairs[:2])
    assert "has log schema 2, this version reads up to 1: update lcd-flight" in _refusal(path)


def test_a_tick_of_another_shape(tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lcd_flight.wire.json_records.encode", lambda record: b'{"sequence": "first"}')
    monkeypatch.setattr(header_module, "_pretty", msgspec.json.encode)
    path = _written(tmp_path / "shape.mcap", pairs[:2])
    assert "a tick is not as this version of lcd-flight writes it" in _refusal(path)


def test_a_description_of_another_shape(tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(header_module, "_pretty", lambda value: b"{}")
    path = _written(tmp_path / "shape.mcap", pairs[:2])
    assert "the flight's description is damaged" in _refusal(path)


# Arrays


def test_columns_are_the_ticks(whole: Path, pairs: list[Pair]) -> None:
    series = read_log(whole).series
    assert len(series) == len(pairs)
    inputs, tick = pairs[380]
    assert inputs.pose.state is not None
    assert tick.reference is not None
    assert tick.setpoint is not None
    assert inputs.link.telemetry is not None
    assert tuple(series.p_WB[380]) == inputs.pose.state.p_WB
    assert tuple(series.q_WB[380]) == inputs.pose.state.q_WB
    assert tuple(series.w_WB_B[380]) == inputs.pose.state.w_WB_B
    assert tuple(series.reference_p_W[380]) == tick.reference.p_W
    assert series.setpoint_thrust_N[380] == tick.setpoint.thrust_N
    assert tuple(series.motor_shares[380]) == inputs.link.telemetry.motor_shares
    assert series.phase[380] == "track"
    assert series.time_s[380] == pytest.approx(3.8)
    assert series.lateness_s[380] == pytest.approx(130e-6)
    assert series.pose_age_s[380] == pytest.approx(3e-3)
    assert tuple(series.pose_counts[380]) == (381, 0, 0, 0)
    assert series.error_m[380] == pytest.approx(0.1)
    assert series.saturated[350]


def test_what_was_not_there_is_not_a_number(tmp_path: Path) -> None:
    series = read_log(_written(tmp_path / "bare.mcap", [(EMPTY_INPUTS, EMPTY_TICK)])).series
    for name in ("p_WB", "q_WB", "reference_p_W", "setpoint_thrust_N", "position_error_W", "pose_age_s", "battery_V"):
        assert np.isnan(getattr(series, name)).all(), name
    assert series.p_WB.shape == (1, 3)
    assert series.motor_shares.shape == (1, 0)
    assert (series.missed[0], series.leg[0]) == (2, -1)


# Findings


def test_a_finding_that_stays_is_one_stretch(tmp_path: Path, pairs: list[Pair]) -> None:
    gap = Finding("pose_gap", Severity.WARN, "pose gap 42 ms")
    low = Finding("battery_low", Severity.LAND, "battery 2.9 V")
    flown = synthetic_flight.with_finding(pairs, 10, 20, gap)
    flown = synthetic_flight.with_finding(flown, 15, 399, low)
    flown = synthetic_flight.with_finding(flown, 30, 30, gap)
    findings = read_log(_written(tmp_path / "findings.mcap", flown)).findings
    assert [(f.finding, round(f.begin_s, 3), round(f.end_s, 3)) for f in findings] == [
        (gap, 0.1, 0.2),
        (low, 0.15, 3.99),
        (gap, 0.3, 0.3),
    ]
