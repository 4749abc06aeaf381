"""`lcd review` as a user gives it: pages, numbers, files, and errors that say what to do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import synthetic_flight

from lcd_flight.cli.main import app, run
from lcd_flight.record import LogWriter


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two logs."""
    folder = tmp_path_factory.mktemp("flights")
    paths = [folder / "a.mcap", folder / "b.mcap"]
    for number, path in enumerate(paths, start=1):
        writer = LogWriter(path, synthetic_flight.header())
        for inputs, tick in synthetic_flight.flight(synthetic_flight.beside(0.1 * number)):
            writer.write(inputs, tick)
        writer.close()
    return paths


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict[str, Any], str]:
    """Exit code, the JSON object, and what a person saw."""
    code = run(app, ["review", *map(str, arguments), "--json"])
    captured = capsys.readouterr()
    return code, json.loads(captured.out.strip().splitlines()[-1]), captured.err


def test_one_flight_has_a_page_and_numbers(flights: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    code, facts, told = said(capsys, flights[0])
    assert code == 0
    assert (facts["outcome"], facts["flight_outcome"]) == ("ok", "landed")
    assert facts["report"] == str(flights[0].with_suffix(".html"))
    assert Path(facts["report"]).read_text().startswith("<!DOCTYPE html>")
    assert facts["overall_max_error_m"] == pytest.approx(0.1)
    assert [row["name"] for row in facts["phases"]][-1] == "landed"
    assert len(facts["segments"]) == 3
    assert "overall_max_error_m" in told


def test_several_flights_have_a_page_and_numbers_each(
    flights: list[Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    code, facts, told = said(capsys, *flights, "--out", tmp_path / "two.html")
    assert code == 0
    assert [row["overall_max_error_m"] for row in facts["flights"]] == pytest.approx([0.1, 0.2])
    assert [row["log"] for row in facts["flights"]] == [str(path) for path in flights]
    assert "2 flights" in (tmp_path / "two.html").read_text()
    assert f"2: {flights[1]}" in told


def test_the_page_of_several_does_not_replace_that_of_the_first(
    flights: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    _, one, _ = said(capsys, flights[0])
    _, both, _ = said(capsys, *flights)
    assert both["report"] == str(flights[0].with_name("a_and_1_more.html")) != one["report"]


def test_series_and_pictures_where_asked_for(
    flights: list[Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    files = {name: tmp_path / name for name in ("csv", "parquet", "picture")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    code, _, told = said(capsys, flights[0], "--out", tmp_path / "page.html", *options)
    assert code == 0
    for name, path in files.items():
        assert path.stat().st_size > 10_000
        assert f"{name.upper():<11}{path}" in told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no/such.mcap"], ["no/such.mcap", "no such file", "give the .mcap file of a flight"]),
        (["{folder}/c.mcap"], ["no such file", "the newest log in {folder} is {folder}/b.mcap"]),
        (["{folder}"], ["is a folder", "the newest log in {folder} is {folder}/b.mcap"]),
        (["{a}", "{b}", "--csv", "x.csv"], ["--csv x.csv", "one file, 2 logs", "one by one"]),
        (["{a}", "--csv", "{a}/x.csv"], ["{a}/x.csv", "cannot be written", "choose another place"]),
        (["{a}", "--out", "{folder}"], ["{folder}", "is a folder", "name a file in it"]),
        ([], ["LOG"]),
    ],
)
def test_what_is_wrong_is_said_with_its_remedy(
    flights: list[Path], capsys: pytest.CaptureFixture[str], arguments: list[str], words: list[str]
) -> None:
    places = {"folder": flights[0].parent, "a": flights[0], "b": flights[1]}
    code, facts, told = said(capsys, *(word.format(**places) for word in arguments))
    assert code == 2
    assert facts["outcome"] == "invalid_input"
    for word in words:
        assert word.format(**places) in told
    assert "Traceback" not in told


def test_a_cut_log_is_reviewed_and_told(
    flights: list[Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    whole = flights[0].read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    code, facts, told = said(capsys, tmp_path / "cut.mcap")
    assert (code, facts["outcome"], facts["flight_outcome"]) == (0, "ok", None)
    assert "cut.mcap was cut" in told
    assert "None" not in told


def test_a_file_that_is_no_log_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for content in (b"", b"hello", b"\x89MCAP0\r\n"):
        path = tmp_path / "x.mcap"
        path.write_bytes(content)
        code, _, told = said(capsys, path)
        assert code == 2
        assert len(told.strip().splitlines()) == 1
        assert str(path) in told
