"""A file that is no flight log: one clear line and exit code 2 from every command that reads logs, no file written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import synthetic_flight
from mcap.writer import Writer

from lcd_flight.cli.main import app, run
from lcd_flight.record import LogWriter
from lcd_flight.record import header as header_module

COMMANDS = [["replay"], ["recover"], ["export", "--ros2"], ["review"]]


def log_at(path: Path) -> Path:
    writer = LogWriter(path, synthetic_flight.header())
    for inputs, tick in synthetic_flight.flight()[:5]:
        writer.write(inputs, tick)
    writer.close()
    return path


def not_mcap(path: Path) -> str:
    path.write_text("time,x,y,z\n0,0,0,1\n")
    return "is not an MCAP file; flight logs end in .mcap"


def empty(path: Path) -> str:
    path.touch()
    return "is empty"


def cut_in_the_header(path: Path) -> str:
    path.write_bytes(log_at(path).read_bytes()[:20])
    return "was cut before the flight's description: nothing can be had from it"


def cut_in_the_description(path: Path) -> str:
    data = log_at(path).read_bytes()
    path.write_bytes(data[: data.index(b"vehicle.json")])
    return "was cut within the flight's description ('vehicle.json' is missing)"


def of_another_program(path: Path) -> str:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="somebody's recorder 2.1")
        writer.finish()
    return "was written by another program (somebody's recorder 2.1), not by lcd-flight"


def of_a_newer_schema(path: Path) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(header_module, "LOG_SCHEMA", 2)
        log_at(path)
    return "has log schema 2, this version reads up to 1: update lcd-flight"


FILES = [not_mcap, empty, cut_in_the_header, cut_in_the_description, of_another_program, of_a_newer_schema]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize("make", FILES, ids=lambda make: make.__name__)
def test_one_line_and_exit_code_2(
    make: Callable[[Path], str], command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "flight.mcap"
    reason = make(path)
    assert run(app, [command[0], str(path), *command[1:], "--json"]) == 2
    told = capsys.readouterr()
    errors = [line for line in told.err.splitlines() if line.startswith("error:")]
    assert len(errors) == 1
    assert errors[0].startswith(f"error: {path}: {reason}")
    facts = json.loads(told.out)
    assert facts["outcome"] == "invalid_input"
    assert f"{path}: {reason}" in facts["error"]
    assert {file.name for file in tmp_path.iterdir()} <= {"flight.mcap"}
