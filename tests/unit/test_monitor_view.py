"""What `lcd monitor` shows: every figure of the newest report, and what needs the eye in red."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from typing import Any

import pytest
import synthetic_flight
from rich.console import Console

from lcd_flight.cli import monitor as command
from lcd_flight.cli.main import app, run
from lcd_flight.model import Finding, Phase, Severity
from lcd_flight.monitor.picture import Picture
from lcd_flight.monitor.view import render, rows, status
from lcd_flight.observers import LiveStream
from lcd_flight.record.live import live_flight
from lcd_flight.wire.live_frame import LiveFlight, LiveReport, decode, encode

GAP = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)", 0.042, 0.3)
PAIRS = synthetic_flight.with_finding(synthetic_flight.flight(), 303, 330, GAP)
HEADER = synthetic_flight.header()
Frames = list[LiveReport | LiveFlight]


def frames(pairs: list[synthetic_flight.Pair]) -> Frames:
    """What these ticks publish."""

    class Keeper:
        def __init__(self) -> None:
            self.taken: Frames = []

        def __call__(self, data: bytes) -> None:
            self.taken.append(decode(data))

        def close(self) -> None:
            pass

    keeper = Keeper()
    stream = LiveStream(keeper, encode(live_flight(HEADER)))
    for inputs, tick in pairs:
        stream.observe(inputs, tick)
    return keeper.taken


def seen(taken: Frames) -> Picture:
    picture = Picture()
    for number, frame in enumerate(taken):
        picture.take(frame, 0.1 * number)
    return picture


def text_of(picture: Picture, now_s: float) -> str:
    console = Console(file=io.StringIO(), width=120, no_color=True)
    console.print(render(picture, now_s))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def row(picture: Picture, label: str, now_s: float | None = None) -> Any:
    assert picture.report is not None
    return dict(rows(picture, picture.report, picture.received_s if now_s is None else now_s))[label]


def with_newest(**changes: Any) -> Picture:
    """A picture whose newest report is of tick 400, changed."""
    picture = seen(frames(PAIRS[:400]))
    inputs, tick = PAIRS[400]
    telemetry = inputs.link.telemetry
    assert telemetry is not None
    link = replace(inputs.link, **{k: v for k, v in changes.items() if hasattr(inputs.link, k)})
    pose = replace(inputs.pose, **{k: v for k, v in changes.items() if hasattr(inputs.pose, k) and k != "age_ns"})
    tick = replace(tick, **{k: v for k, v in changes.items() if hasattr(tick, k)})
    report = LiveReport(replace(inputs, link=link, pose=pose), tick, 10, changes.get("missed", 0), 200_000, 0.1)
    picture.take(report, 50.0)
    return picture


def test_before_a_flight_it_waits() -> None:
    assert "waiting for a flight" in text_of(Picture(), 0.0)


def test_everything_is_there() -> None:
    picture = seen(frames(PAIRS[:500]))
    text = text_of(picture, picture.received_s)
    for part in (
        "four-waypoint test  crazyflie  sim://",
        "TRACK  trajectory 1.7/4.5 s  leg 3 of 4",
        "0.100 m  (largest 0.100, limit 1.50)",
        "4.05 V",
        "age 4 ms  loss 0.0%",
        "100 Hz  age 3 ms  lost 0  late 0  rejected 0",
        "100.0 Hz  latest 0.13 ms  missed 0",
        "3.0 s  WARN pose gap 42 ms (limit 300 ms)",
        "0.0 s  ready",
    ):
        assert part in text, part


def test_a_stream_that_falls_silent_is_told() -> None:
    picture = seen(frames(PAIRS[:300]))
    assert "stream" not in text_of(picture, picture.received_s + 0.9)
    assert "silent for 3 s" in text_of(picture, picture.received_s + 3.0)


@pytest.mark.parametrize(
    ("label", "changes", "text"),
    [
        ("phase", {"phase": Phase.LAND_NOW}, "LAND_NOW"),
        ("position", {"state": None}, "no valid pose"),
        ("error", {"position_error_W": (0.8, 0.0, 0.0)}, "0.800 m"),
        ("link", {"connected": False}, "not connected"),
        ("link", {"loss_share": 0.2}, "loss 20.0%"),
        ("link", {"fallback_active": True}, "FALLBACK"),
        ("loop", {"missed": 2}, "missed 2"),
    ],
)
def test_what_needs_the_eye_is_red(label: str, changes: dict[str, Any], text: str) -> None:
    found = row(with_newest(**changes), label)
    assert text in found.plain
    assert "red" in f"{found.style} {[span.style for span in found.spans]}"
    calm = row(with_newest(), label)
    assert "red" not in f"{calm.style} {[span.style for span in calm.spans]}"


def test_what_is_not_known_is_said() -> None:
    picture = with_newest(telemetry=None, position_error_W=None)
    assert row(picture, "battery").plain == "not known"
    assert row(picture, "error").plain == "no reference"


def test_the_timing_is_that_of_the_last_seconds_and_counts_all_that_was_missed() -> None:
    late = [(replace(i, deadline_ns=i.now_ns - 9_000_000) if i.sequence == 100 else i, t) for i, t in PAIRS[:750]]
    late = [(replace(i, missed=2) if i.sequence == 100 else i, t) for i, t in late]
    taken = frames(late)
    until = [n for n, frame in enumerate(taken) if isinstance(frame, LiveReport) and frame.tick.sequence < 300]
    assert seen(taken[: until[-1]]).timing.max_lateness_s == pytest.approx(9e-3)
    later = seen(taken).timing
    assert later.max_lateness_s == pytest.approx(0.13e-3)
    assert later.missed == 2
    assert later.rate_hz == pytest.approx(100.0, abs=0.5)


def test_the_next_flight_begins_anew() -> None:
    picture = seen([*frames(PAIRS[:500]), *frames(PAIRS[:100])])
    assert picture.time_s < 1.0
    assert [line.text for line in picture.lines] == ["ready"]
    assert picture.timing.rate_hz == pytest.approx(100.0, abs=1.0)


def test_one_line_for_a_pipe() -> None:
    picture = seen(frames(PAIRS[:500]))
    assert picture.report is not None
    text = status(picture, picture.report)
    assert "\n" not in text
    assert "TRACK" in text
    assert "4.05 V" in text


# The command


class Scripted:
    """A source that hands out frames, then falls silent or is interrupted."""

    def __init__(self, taken: Frames, interrupt: bool) -> None:
        self._taken, self._interrupt = list(taken), interrupt

    def __call__(self, _endpoint: str) -> Scripted:
        return self

    def __enter__(self) -> Scripted:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def receive(self, _wait_s: float) -> LiveReport | LiveFlight | None:
        if self._taken:
            return self._taken.pop(0)
        if self._interrupt:
            raise KeyboardInterrupt
        return None


def watch(monkeypatch: pytest.MonkeyPatch, taken: Frames, *arguments: str, interrupt: bool = False) -> int:
    monkeypatch.setattr("lcd_flight.monitor.source.LiveSource", Scripted(taken, interrupt))
    monkeypatch.setattr(command, "OVER_S", 0.0)
    return run(app, ["monitor", *arguments])


def test_it_tells_changes_and_ends_with_the_flight(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert watch(monkeypatch, frames(PAIRS), "--until-end", "--json") == 0
    told = capsys.readouterr()
    facts = json.loads(told.out)
    assert (facts["outcome"], facts["name"], facts["phase"]) == ("ok", "four-waypoint test", "landed")
    assert facts["max_position_error_m"] == pytest.approx(0.1)
    assert [word in told.err for word in ("PREFLIGHT", "TAKEOFF", "LANDED", "pose gap 42 ms", "ready")] == [True] * 5
    assert told.err.count("pose gap 42 ms") == 1


def test_the_lines_of_the_next_flight_are_told_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert watch(monkeypatch, [*frames(PAIRS), *frames(PAIRS)], interrupt=True) == 0
    told = capsys.readouterr().out
    assert (told.count("pose gap 42 ms"), told.count("ready")) == (2, 2)


def test_ctrl_c_is_the_way_to_quit(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert watch(monkeypatch, frames(PAIRS[:300]), "--json", interrupt=True) == 0
    assert json.loads(capsys.readouterr().out)["phase"] == "hold"
    assert watch(monkeypatch, [], "--json", interrupt=True) == 0
    assert json.loads(capsys.readouterr().out)["reports"] == 0


def test_a_description_of_another_version_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert watch(monkeypatch, [LiveFlight({}, {})], "tcp://127.0.0.1:9") == 2
    assert capsys.readouterr().err.startswith("error: tcp://127.0.0.1:9: the flight's description is not as")
