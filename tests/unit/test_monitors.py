"""Each row of the table: silent at its limit, found beyond it, with the severity and the debounce that it states."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from lcd_flight.model import Finding, Geofence, SafetyLimits, Severity, State, Telemetry
from lcd_flight.model.frames import IDENTITY
from lcd_flight.model.types import Quaternion
from lcd_flight.safety.evidence import Evidence, SafetyMemory, Scope
from lcd_flight.safety.monitors import Monitor, judge, monitors

LIMITS = SafetyLimits(geofence=Geofence((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0)))
TABLE = monitors(LIMITS)
STEP_NS = 10_000_000


def state(x: float = 0.0, vx: float = 0.0, z: float = 1.0, q_WB: Quaternion = IDENTITY) -> State:
    return State((x, 0.0, z), (vx, 0.0, 0.0), q_WB, (0.0, 0.0, 0.0))


def rolled(angle_deg: float) -> State:
    half = math.radians(angle_deg) / 2
    return state(q_WB=(math.sin(half), 0.0, 0.0, math.cos(half)))


def telemetry(**values: Any) -> Telemetry:
    return Telemetry(**{"stamp_ns": 0, "battery_V": 4.0, "crashed": False, **values})


HEALTHY = Evidence(
    now_ns=1_000_000_000,
    scope=Scope.AIRBORNE,
    lateness_s=0.0001,
    skipped_share=0.0,
    pose_gap_s=0.008,
    pose_rate_hz=100.0,
    rejected=0,
    reject_reason="",
    link_age_s=0.01,
    disconnected=False,
    taken_over="",
    loss_share=0.0,
    telemetry=telemetry(),
    state=state(),
    position_error_m=0.05,
    saturation_share=0.0,
    invalid_commands=0,
)

W, B, L, D, K = Severity.WARN, Severity.BRAKE, Severity.LAND, Severity.DESCEND, Severity.KILL
# code, severity, debounce in s, evidence at the limit (silent), evidence beyond it (found)
ROWS: list[tuple[str, Severity, float, dict[str, Any], dict[str, Any]]] = [
    ("pose_late", W, 0.0, {"pose_gap_s": 0.03}, {"pose_gap_s": 0.0301}),
    ("pose_gap", B, 0.0, {"pose_gap_s": 0.05}, {"pose_gap_s": 0.0501}),
    ("pose_lost", D, 0.0, {"pose_gap_s": 0.3}, {"pose_gap_s": 0.301}),
    ("pose_rejected", W, 0.0, {"rejected": 0}, {"rejected": 1, "reject_reason": "jump"}),
    ("pose_rate", B, 1.0, {"pose_rate_hz": 90.0}, {"pose_rate_hz": 89.0}),
    ("vehicle_crashed", K, 0.0, {"telemetry": telemetry(crashed=None)}, {"telemetry": telemetry(crashed=True)}),
    ("tumbled", K, 0.5, {"state": rolled(99.9)}, {"state": rolled(100.1)}),
    ("battery_low", W, 2.0, {"telemetry": telemetry(battery_V=3.2)}, {"telemetry": telemetry(battery_V=3.19)}),
    ("battery_critical", L, 2.0, {"telemetry": telemetry(battery_V=3.0)}, {"telemetry": telemetry(battery_V=2.99)}),
    ("link_closed", L, 0.0, {"disconnected": False}, {"disconnected": True}),
    ("taken_over", L, 0.0, {"taken_over": ""}, {"taken_over": "the pilot took over: mode POSCTL"}),
    ("link_age", B, 0.0, {"link_age_s": 0.1}, {"link_age_s": 0.101}),
    ("link_lost", L, 0.0, {"link_age_s": 1.0}, {"link_age_s": 1.01}),
    ("link_loss", W, 0.0, {"loss_share": 0.10}, {"loss_share": 0.11}),
    ("link_loss_high", B, 0.5, {"loss_share": 0.15}, {"loss_share": 0.16}),
    ("link_loss_severe", L, 0.5, {"loss_share": 0.25}, {"loss_share": 0.26}),
    ("position_error", B, 0.0, {"position_error_m": 0.75}, {"position_error_m": 0.751}),
    ("position_lost", L, 0.0, {"position_error_m": 1.5}, {"position_error_m": 1.501}),
    ("saturation", B, 0.0, {"saturation_share": 0.5}, {"saturation_share": 0.52}),
    ("controller_failed", B, 0.0, {"invalid_commands": 2}, {"invalid_commands": 3}),
    ("controller_lost", D, 0.0, {"invalid_commands": 5}, {"invalid_commands": 6}),
    ("fence_ahead", B, 0.0, {"state": state(x=1.5, vx=2.0)}, {"state": state(x=1.5, vx=2.01)}),
    ("fence_left", L, 0.0, {"state": state(x=2.0)}, {"state": state(x=2.001)}),
    ("fence_far", K, 0.0, {"state": state(x=3.0)}, {"state": state(x=3.001)}),
    ("loop_late", W, 0.0, {"lateness_s": 0.02}, {"lateness_s": 0.0201}),
    ("loop_slow", L, 0.0, {"skipped_share": 0.1}, {"skipped_share": 0.11}),
]  # fmt: skip


def found(changes: dict[str, Any], table: tuple[Monitor, ...] = TABLE, lasting_s: float = 0.0) -> dict[str, Finding]:
    """Findings once the evidence has lasted so long."""
    memory = SafetyMemory()
    findings: tuple[Finding, ...] = ()
    for step in range(round(lasting_s / 0.01) + 1):
        evidence = replace(HEALTHY, now_ns=HEALTHY.now_ns + step * STEP_NS, **changes)
        findings, memory = judge(table, evidence, memory)
    return {finding.code: finding for finding in findings}


def test_rows_are_all_tested_and_named_once() -> None:
    assert [row[0] for row in ROWS] == [monitor.code for monitor in TABLE]
    assert len({monitor.code for monitor in TABLE}) == len(TABLE)


def test_a_healthy_tick_finds_nothing() -> None:
    assert found({}, lasting_s=3.0) == {}


@pytest.mark.parametrize(("code", "severity", "debounce_s", "at", "beyond"), ROWS, ids=[row[0] for row in ROWS])
def test_row(code: str, severity: Severity, debounce_s: float, at: dict[str, Any], beyond: dict[str, Any]) -> None:
    assert code not in found(at, lasting_s=debounce_s + 0.1)
    assert code not in found(beyond, lasting_s=debounce_s - 0.01) or debounce_s == 0.0
    finding = found(beyond, lasting_s=debounce_s)[code]
    assert finding.severity is severity
    assert finding.limit == next(monitor.limit for monitor in TABLE if monitor.code == code)
    assert not {"{", "}"} & set(finding.message)


@pytest.mark.parametrize("name", ["pose_gap_s", "link_age_s", "loss_share", "position_error_m", "saturation_share"])
def test_what_is_not_a_number_is_beyond_every_limit(name: str) -> None:
    assert found({name: math.nan})


def test_a_break_starts_the_debounce_again() -> None:
    low, memory = {"telemetry": telemetry(battery_V=2.5)}, SafetyMemory()
    findings: tuple[Finding, ...] = ()
    for step in range(300):
        changes = {} if step == 150 else low
        findings, memory = judge(TABLE, replace(HEALTHY, now_ns=step * STEP_NS, **changes), memory)
        assert not findings
    for step in range(300, 352):
        findings, memory = judge(TABLE, replace(HEALTHY, now_ns=step * STEP_NS, **low), memory)
    assert {finding.code for finding in findings} == {"battery_low", "battery_critical"}


@pytest.mark.parametrize("missing", [None, telemetry(battery_V=None, crashed=None)])
def test_what_the_vehicle_does_not_report_is_not_judged(missing: Telemetry | None) -> None:
    assert found({"telemetry": missing}, lasting_s=3.0) == {}


def test_without_state_and_reference_only_the_pose_is_judged() -> None:
    assert set(found({"state": None, "position_error_m": None, "pose_gap_s": math.inf})) == {
        "pose_late",
        "pose_gap",
        "pose_lost",
    }


def test_scopes() -> None:
    everything = {key: value for row in ROWS for key, value in row[4].items() if key not in ("telemetry", "state")}
    everything |= {"telemetry": telemetry(crashed=True, battery_V=2.0), "state": rolled(120.0)}
    on_ground = found({**everything, "scope": Scope.ALWAYS}, lasting_s=3.0)
    armed = found({**everything, "scope": Scope.ARMED}, lasting_s=3.0)
    airborne = found(everything, lasting_s=3.0)
    assert set(on_ground) == {"vehicle_crashed"}
    assert set(on_ground) < set(armed) < set(airborne)
    assert {"pose_lost", "battery_critical", "link_lost", "link_closed"} <= set(armed)
    assert {"position_error", "saturation", "tumbled", "pose_gap"} <= set(airborne) - set(armed)


def test_the_mission_chooses_what_a_lost_pose_and_an_empty_battery_mean() -> None:
    choices = monitors(replace(LIMITS, on_mocap_lost="cut", on_battery_critical="warn"))
    assert found({"pose_gap_s": 0.4}, choices)["pose_lost"].severity is Severity.KILL
    empty = found({"telemetry": telemetry(battery_V=2.5)}, choices, lasting_s=2.0)
    assert empty["battery_critical"].severity is Severity.WARN


def test_a_slow_source_is_given_its_period() -> None:
    slow = monitors(replace(LIMITS, expected_pose_rate_hz=25.0))
    assert not found({"pose_gap_s": 0.08, "pose_rate_hz": 25.0}, slow)
    assert {"pose_late", "pose_gap"} == set(found({"pose_gap_s": 0.13, "pose_rate_hz": 25.0}, slow))


def test_messages_say_what_how_much_and_the_limit() -> None:
    assert found({"pose_gap_s": 0.062})["pose_gap"].message == "pose gap 62 ms (limit 50 ms)"
    assert found({"position_error_m": 1.6})["position_lost"].message == "position error 1.60 m (limit 1.50 m)"
    assert found(ROWS[3][4])["pose_rejected"].message == "1 pose frames rejected: jump"
