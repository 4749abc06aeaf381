"""`lcd recover`: a cut or damaged log becomes an indexed one that other programs open, and what is lost is said."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
import synthetic_flight
from mcap.reader import make_reader

from lcd_flight.cli.main import app, run
from lcd_flight.model import InputError, RefusedError
from lcd_flight.record import LogWriter, read_log, read_ticks
from lcd_flight.record.recover import condition, recover

PAIRS = synthetic_flight.flight()[:400]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    writer = LogWriter(path, synthetic_flight.header())
    for inputs, tick in PAIRS:
        writer.write(inputs, tick)
    writer.close()
    return path


@pytest.fixture
def cut(whole: Path, tmp_path: Path) -> Path:
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    return path


def topics(path: Path) -> Counter[str]:
    """Messages by topic, by the library's indexed reader, which takes whole files only."""
    with path.open("rb") as stream:
        return Counter(channel.topic for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages())


def test_a_cut_file_becomes_an_indexed_one(cut: Path, tmp_path: Path) -> None:
    before, new = cut.read_bytes(), tmp_path / "new.mcap"
    found = condition(cut)
    recover(cut, new, found.lost)
    assert cut.read_bytes() == before
    assert found.cut
    assert found.ticks == len(read_ticks(cut)) == len(read_ticks(new))
    assert read_ticks(new) == PAIRS[: found.ticks]
    assert topics(new)["/tick"] == found.ticks
    assert topics(new)["/scene"] == 1
    assert found.duration_s == pytest.approx((found.ticks - 1) * 0.01)


def test_the_description_comes_along_and_the_new_file_does_not_pass_for_a_whole_flight(cut: Path) -> None:
    new = cut.with_name("new.mcap")
    recover(cut, new, condition(cut).lost)
    old, log = read_log(cut), read_log(new)
    assert not log.complete
    assert condition(new).whole
    assert log.header.predictions == old.header.predictions
    assert log.header.mission_text == old.header.mission_text
    assert log.header.versions == old.header.versions
    with new.open("rb") as stream:
        metadata = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert metadata["recovered"] == {"from": "cut.mcap", "lost": "what was flown after its last whole record"}


def test_a_damaged_chunk_is_left_out_and_told(whole: Path, tmp_path: Path) -> None:
    with whole.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[len(summary.chunk_indexes) // 2]
    data, place = bytearray(whole.read_bytes()), chunk.chunk_start_offset + chunk.chunk_length // 2
    data[place] ^= 0x55
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    found = condition(damaged)
    assert not found.cut
    assert found.ticks + found.missing_ticks == len(PAIRS)
    assert found.lost == f"1 damaged chunk, {found.missing_ticks} ticks in between"
    assert 0 < found.missing_ticks <= 50
    new = tmp_path / "new.mcap"
    recover(damaged, new, found.lost)
    assert len(read_ticks(new)) == found.ticks
    assert read_log(new).missing_ticks == found.missing_ticks


def test_ticks_that_were_never_written_need_no_recovery(tmp_path: Path) -> None:
    path = tmp_path / "dropped.mcap"
    writer = LogWriter(path, synthetic_flight.header())
    for inputs, tick in (*PAIRS[:10], *PAIRS[30:40]):
        writer.write(inputs, tick)
    writer.close()
    found = condition(path)
    assert (found.whole, found.ticks, found.missing_ticks) == (True, 20, 20)
    assert read_log(path).missing_ticks == 20


def test_nothing_is_overwritten(cut: Path, whole: Path) -> None:
    with pytest.raises(InputError, match=r"flight\.mcap: exists already; remove it or choose another name with --out"):
        recover(cut, whole, "")


def test_a_folder_that_is_not_there_is_refused_and_leaves_nothing(cut: Path) -> None:
    with pytest.raises(RefusedError, match="cannot be written: No such file or directory"):
        recover(cut, cut.parent / "none" / "new.mcap", "")
    assert [path.name for path in cut.parent.iterdir()] == ["cut.mcap"]


def test_an_interruption_leaves_nothing(cut: Path) -> None:
    def interrupt(_count: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        recover(cut, cut.with_name("new.mcap"), "", interrupt)
    assert [path.name for path in cut.parent.iterdir()] == ["cut.mcap"]


def test_progress_counts_the_bytes(cut: Path) -> None:
    counts: list[int] = []
    recover(cut, cut.with_name("new.mcap"), "", counts.append)
    assert 0 < sum(counts) <= cut.stat().st_size


# The command


def test_the_command_names_the_new_file(cut: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["recover", str(cut), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    new = cut.with_name("cut.recovered.mcap")
    assert facts["recovered"] == str(new)
    assert (facts["outcome"], facts["cut"], facts["ticks"]) == ("ok", True, len(read_ticks(new)))


def test_a_whole_file_is_left_alone(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["recover", str(whole)]) == 0
    assert "is whole: nothing to be done" in capsys.readouterr().out
    assert not whole.with_name("flight.recovered.mcap").exists()


def test_what_is_no_log_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "notes.mcap"
    path.write_text("no log")
    assert run(app, ["recover", str(path)]) == 2
    assert capsys.readouterr().err == f"error: {path}: is not an MCAP file; flight logs end in .mcap\n"
