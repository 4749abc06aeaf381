"""The boundary of the command line: what goes wrong becomes a line, an exit code and, if asked for, a JSON object."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated

import pytest
import typer

from lcd_flight.cli.main import app, flyer, run
from lcd_flight.cli.options import Json
from lcd_flight.cli.terminal import Terminal, following
from lcd_flight.errors import InputError, Outcome, RefusedError
from lcd_flight.learning.progress import Progress


def _app(error: BaseException | None) -> typer.Typer:
    """A program of one command that ends as told."""
    program = typer.Typer(pretty_exceptions_enable=False)

    @program.command()
    def act(count: Annotated[int, typer.Option()] = 1, json: Json = False) -> int:
        if error is not None:
            raise error
        return Terminal(json_line=json).finish(Outcome.LANDED, {"count": count})

    return program


def _last(text: str) -> dict[str, object]:
    return json.loads(text.strip().splitlines()[-1])


@pytest.mark.parametrize(
    ("error", "code", "outcome"),
    [
        (None, 0, "landed"),
        (InputError("x.yaml:3: name: 5 is no name; write a word"), 2, "invalid_input"),
        (RefusedError("rehearsal: no"), 3, "refused"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ZeroDivisionError("division by zero"), 70, "internal_error"),
    ],
)
def test_every_ending_has_its_code_and_its_json(
    error: BaseException | None, code: int, outcome: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(_app(error), ["--json"]) == code
    captured = capsys.readouterr()
    assert _last(captured.out)["outcome"] == outcome
    assert "Traceback" not in captured.out + captured.err
    assert (captured.err == "") == (error is None)


@pytest.mark.parametrize("arguments", [["--nope"], ["--count", "many"], ["--count"], ["surplus"]])
def test_wrong_usage_is_wrong_input(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(_app(None), [*arguments, "--json"]) == 2
    captured = capsys.readouterr()
    assert _last(captured.out)["outcome"] == "invalid_input"
    assert captured.err.startswith("error: ")
    assert "--help" in captured.err


def test_a_fault_of_ours_is_kept_in_a_file_for_a_report(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(_app(ZeroDivisionError("division by zero")), []) == 70
    message = capsys.readouterr().err
    path = re.search(r"(/\S+\.txt)", message)
    assert path is not None
    assert "ZeroDivisionError" in Path(path[1]).read_text()
    Path(path[1]).unlink()


def test_one_line_is_printed_for_each_problem(capsys: pytest.CaptureFixture[str]) -> None:
    run(_app(InputError("a.yaml:1: first\na.yaml:2: second")), [])
    assert capsys.readouterr().err.splitlines() == ["error: a.yaml:1: first", "error: a.yaml:2: second"]


def test_what_is_not_a_number_becomes_null(capsys: pytest.CaptureFixture[str]) -> None:
    Terminal(json_line=True).finish(Outcome.OK, {"a": float("nan"), "b": (1.5, float("inf")), "c": {"d": True}})
    assert _last(capsys.readouterr().out) == {
        "outcome": "ok",
        "error": None,
        "a": None,
        "b": [1.5, None],
        "c": {"d": True},
    }


def test_with_json_nothing_else_goes_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal(json_line=True)
    terminal.line("CHECK", "mission ok")
    terminal.warn("careful")
    terminal.finish(Outcome.OK, {})
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 1
    assert "mission ok" in captured.err
    assert "WARN careful" in captured.err


def test_quiet_keeps_warnings(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal(quiet=True)
    terminal.line("CHECK", "mission ok")
    terminal.warn("careful")
    out = capsys.readouterr().out
    assert "careful" in out
    assert "mission ok" not in out


def test_progress_for_a_pipe_is_silent_for_short_work(capsys: pytest.CaptureFixture[str]) -> None:
    with following(Terminal(), "COLLECT") as progress:
        progress(Progress(1, 2, "rollouts", 1.0))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(("program", "arguments"), [(app, ["fly", "--help"]), (flyer, ["--help"]), (app, ["--help"])])
def test_help_is_there(program: typer.Typer, arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(program, arguments) == 0
    assert "Usage" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "no/such.yaml"],
        ["plan", "no/such.yaml"],
        ["fly", "no/such.yaml"],
        ["review", "no/such.mcap"],
        ["bench", "no-such-benchmark"],
        ["evaluate", "--world", "no-such-world"],
        ["evaluate", "--world", "crazyflie-saturated", "--methods", "no-such-method"],
        ["evaluate", "--world", "crazyflie-saturated", "--timing", "sometimes"],
        ["evaluate", "--world", "crazyflie-saturated", "--tasks", "no/such.npz"],
        ["evaluate", "--world", "crazyflie-saturated", "--drag", "6"],
        ["collect", "--world", "no-such-world", "--out", "never"],
        ["train", "--worlds", "crazyflie-paper", "--out", "model.bin"],
        ["train", "--worlds", "crazyflie-paper", "--out", "m.safetensors", "--recipe", "huge"],
        ["fly", "demo", "--sim", "--link", "sim://"],
    ],
)
def test_wrong_arguments_end_with_one_line_and_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, [*arguments, "--json"]) == 2
    captured = capsys.readouterr()
    errors = [line for line in captured.err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert _last(captured.out)["error"] == errors[0].removeprefix("error: ")
