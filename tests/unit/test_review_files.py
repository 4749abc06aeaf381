"""A flight for other programs: what is read back is what was flown."""

from __future__ import annotations

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_flight
from synthetic_flight import log_of

from lcd_flight.model import Finding, InputError, PoseReport, RefusedError, Severity
from lcd_flight.record import FlightLog
from lcd_flight.review import write_csv, write_parquet, write_rerun
from lcd_flight.review.series_file import columns


@pytest.fixture(scope="module")
def log() -> FlightLog:
    """With a gap in the pose and a finding."""
    gap = Finding("pose_gap", Severity.WARN, "pose gap 42 ms (limit 300 ms)")
    pairs = [
        (replace(i, pose=PoseReport(None, None)) if 600 <= i.sequence < 610 else i, t)
        for i, t in synthetic_flight.with_finding(synthetic_flight.flight(), 600, 609, gap)
    ]
    return log_of(pairs)


def test_every_series_is_a_column(log: FlightLog) -> None:
    named = columns(log.series)
    for name in ("time_s", "phase", "p_WB_x", "q_WB_w", "pose_counts_rejected", "link_counts_lost", "motor_shares_4"):
        assert name in named
    assert all(values.shape == (len(log.series),) for values in named.values())
    assert len(named) == sum(
        1 if getattr(log.series, name).ndim == 1 else getattr(log.series, name).shape[1]
        for name in type(log.series).__slots__
    ) + len(["error_m"])


def test_csv_reads_back_to_the_bit(log: FlightLog, tmp_path: Path) -> None:
    with write_csv(log, tmp_path / "flight.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(log.series)
    assert [row["phase"] for row in rows] == log.series.phase.tolist()
    for name in ("time_s", "p_WB_y", "reference_a_W_z", "error_m"):
        back = np.array([float(row[name] or "nan") for row in rows])
        np.testing.assert_array_equal(back, columns(log.series)[name])
    assert rows[600]["p_WB_x"] == ""
    assert {row["saturated"] for row in rows} == {"0", "1"}


def test_parquet_reads_back_to_the_bit(log: FlightLog, tmp_path: Path) -> None:
    from pyarrow import parquet

    table = parquet.read_table(write_parquet(log, tmp_path / "flight.parquet"))
    assert table.schema.metadata[b"mission"] == b"four-waypoint test"
    assert table.column_names == list(columns(log.series))
    assert table["p_WB_x"].null_count == 10
    np.testing.assert_array_equal(table["now_ns"].to_numpy(), log.series.now_ns)
    np.testing.assert_array_equal(table["saturated"].to_numpy(), log.series.saturated)
    np.testing.assert_array_equal(table["p_WB_x"].to_numpy(), log.series.p_WB[:, 0])


def test_a_recording_for_rerun_is_whole(log: FlightLog, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    path = write_rerun(log, tmp_path / "flight.rrd")
    program = Path(sys.executable).with_name("rerun")
    at_home = {"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "RERUN_ANALYTICS_ENABLED": "0"}

    def tell(action: str) -> str:
        done = subprocess.run(
            [program, "rrd", action, path], check=True, capture_output=True, text=True, env=at_home, timeout=120
        )
        return done.stdout

    tell("verify")
    told = tell("print")
    for entity in ("/world/vehicle", "/world/reference", "/world/fence", "/world/waypoints", "/error_m", "/findings"):
        assert entity in told


@pytest.mark.parametrize(
    ("package", "write", "remedy"),
    [("pyarrow", write_parquet, "lcd-flight[tables]"), ("rerun", write_rerun, "lcd-flight[rerun]")],
)
def test_what_is_not_installed_is_named(
    log: FlightLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, write: object, remedy: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(RefusedError, match="pip install") as caught:
        write(log, tmp_path / "file")  # type: ignore[operator]
    assert remedy in str(caught.value)
    assert not (tmp_path / "file").exists()


@pytest.mark.parametrize("write", [write_csv, write_parquet, write_rerun])
def test_a_place_that_cannot_be_written_is_named(log: FlightLog, tmp_path: Path, write: object) -> None:
    pytest.importorskip("rerun")
    (tmp_path / "no").touch()
    with pytest.raises(InputError, match=r"such/folder: cannot be written .* choose another place"):
        write(log, tmp_path / "no" / "such" / "folder")  # type: ignore[operator]
