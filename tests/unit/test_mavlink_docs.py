"""The page for users says what the link does: options, parameters and times are compared with the code."""

from __future__ import annotations

import msgspec
import pytest
from docs_pages import page, table

from drivers.mavlink import arming, commands, connection, custody, estimator, link, outbox, parameters
from drivers.mavlink.ardupilot import ArduPilot
from drivers.mavlink.autopilot import Autopilot
from drivers.mavlink.options import LEAST_BAUD, MavlinkOptions
from drivers.mavlink.px4 import Px4

PAGE = "mavlink.md"


def told(cell: str) -> list[str]:
    return [part.strip("` ") for part in cell.split(",")]


def test_options_and_their_defaults() -> None:
    rows = {name: row[1] for row in table(PAGE, "option") for name in told(row[0])}
    fields = {field.name: field.default for field in msgspec.structs.fields(MavlinkOptions)}
    assert set(rows) == set(fields)
    for name, default in fields.items():
        if name in ("system", "component", "our_system", "our_component"):
            assert str(default) in told(rows[name])
        elif isinstance(default, bool):
            assert told(rows[name]) == [str(default).lower()]
        elif isinstance(default, int | float) or default in ("listen", "enu", "guided"):
            assert told(rows[name]) == [f"{default:g}" if isinstance(default, float) else str(default)]


@pytest.mark.parametrize("autopilot", [Px4(), ArduPilot()])
def test_parameters(autopilot: Autopilot) -> None:
    section = page(PAGE).partition(f"\n{autopilot.name}:\n")[2].strip().partition("\n\n")[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    rows = {line.split("|")[1].strip(" `"): line.split("|")[2:5] for line in lines}
    required = {r.name: r for r in autopilot.requirements("vehicle")}
    assert set(rows) == set(required)
    for name, (value, restart, _) in rows.items():
        assert f"{required[name].value:g}" in value
        assert (restart.strip() == "yes") is required[name].restart


def test_times() -> None:
    text = " ".join(page(PAGE).split())
    for words in (
        f"{link.STREAM_S:g} s of setpoints",
        f"Arming, after pre-flight and consent, in {link.ARMING_S:g} s at most",
        f"each second for {arming.LIMIT_S:g} s",
        f"repeated after {commands.ANSWER_S:g} s",
        f"IN_PROGRESS gives it {commands.PROGRESS_S:g} s more",
        f"after {arming.LAND_LIMIT_S:g} s an ordinary disarm",
        f"each {outbox.STOP_PERIOD_NS / 1e6:.0f} ms until",
        f"at most {outbox.MAX_AGE_NS / 1e6:.0f} ms old",
        f"right for {estimator.SETTLED_NS / 1e9:g} s, within {estimator.LIMIT_NS / 1e9:g} s",
        f"for up to {connection.CHECKS_S:g} s",
        f"PX4 {Px4().settles_s:g} s after its boot, ArduPilot {ArduPilot().settles_s:g} s",
        f"PX4 {Px4().motors_off_s:g} s; ArduPilot {ArduPilot().motors_off_s:g} s, then {ArduPilot().ramp_s:g} s",
        f"five times at {parameters.ANSWER_S:g} s",
        f"for {link.POSES_S:g} s at most",
        f"{link.HEARTBEAT_LOST_NS / 1e9:g} s",
        f"{LEAST_BAUD:,} baud",
        f"{outbox.FALLBACK_NS / 1e6:.0f} ms",
    ):
        assert words in text, words
    assert (commands.ATTEMPTS, parameters.ATTEMPTS) == (5, 5)
    assert custody.__doc__ is not None
