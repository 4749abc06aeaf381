"""Where a log goes: a telling name, never one that is taken, and a refusal before the flight where nothing can go."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest

from lcd_flight.model import RefusedError
from lcd_flight.record import log_path

STARTED = datetime(2026, 11, 22, 10, 31, 7)


def test_the_name_tells_when_and_what(tmp_path: Path) -> None:
    path = log_path(tmp_path / "flights", "demo", STARTED)
    assert path == tmp_path / "flights" / "2026-11-22T10-31-07_demo.mcap"
    assert list((tmp_path / "flights").iterdir()) == []


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("figure eight", "figure-eight"),
        ("../../etc/passwd", "etc-passwd"),
        ("<script>", "script"),
        ("höhe", "höhe"),
        ("...", "flight"),
        ("x" * 300, "x" * 80),
    ],
)
def test_what_does_not_belong_into_a_file_name_is_replaced(tmp_path: Path, name: str, stem: str) -> None:
    path = log_path(tmp_path, name, STARTED)
    assert path.parent == tmp_path
    assert path.name == f"2026-11-22T10-31-07_{stem}.mcap"


def test_flights_of_the_same_second_are_numbered(tmp_path: Path) -> None:
    names = []
    for _ in range(3):
        path = log_path(tmp_path, "demo", STARTED)
        path.touch()
        names.append(path.name)
    assert names == [f"2026-11-22T10-31-07_demo{end}.mcap" for end in ("", "-2", "-3")]


def test_a_report_without_its_log_keeps_its_name_too(tmp_path: Path) -> None:
    (tmp_path / "2026-11-22T10-31-07_demo.html").touch()
    assert log_path(tmp_path, "demo", STARTED).name == "2026-11-22T10-31-07_demo-2.mcap"


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RefusedError, match=r"cannot write flight logs to .*file.*: Not a directory; choose another"):
        log_path(tmp_path / "file" / "flights", "demo", STARTED)


def test_a_folder_that_cannot_be_written_is_refused() -> None:
    with pytest.raises(RefusedError, match=r"cannot write flight logs to /proc: .*--log DIR"):
        log_path(Path("/proc"), "demo", STARTED)
