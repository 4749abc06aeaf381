from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from flight_bench import LIMITS, START_NS, TICK_NS, healthy, plan, with_link, with_telemetry

from lcd_flight.model import State, TickInputs
from lcd_flight.model.frames import from_yaw, multiply
from lcd_flight.model.types import Quaternion
from lcd_flight.safety.preflight import Check, preflight

PLAN = plan()
Change = Callable[[TickInputs], TickInputs]


def samples(
    sigma_m: float = 0.0003, at_m: Sequence[float] = (0.0, 0.0, 0.0), yaw_rad: float = 0.0, seed: int = 0
) -> list[TickInputs]:
    """Two seconds on the ground."""
    noise = np.random.default_rng(seed).normal(0.0, sigma_m, (200, 3)) + np.array(at_m)
    states = [State((x, y, z), (0.0, 0.0, 0.0), from_yaw(yaw_rad), (0.0, 0.0, 0.0)) for x, y, z in noise.tolist()]
    return [healthy(i, state, START_NS + i * TICK_NS) for i, state in enumerate(states)]


def failed(window: Sequence[TickInputs], **limits: float) -> dict[str, str]:
    checks = preflight(window, PLAN, replace(LIMITS, **limits))
    return {check.name: check.text for check in checks if not check.ok}


def each(change: Change) -> list[TickInputs]:
    return [change(inputs) for inputs in samples()]


def test_all_is_well() -> None:
    checks = preflight(samples(), PLAN, LIMITS)
    assert all(check.ok for check in checks)
    assert [check.name for check in checks] == [
        "pose rate", "pose age", "still", "start", "heading", "fence", "battery", "link", "vehicle", "estimator"
    ]  # fmt: skip


def test_texts_are_short_where_it_passes() -> None:
    texts = [check.text for check in preflight(samples(sigma_m=0.0), PLAN, LIMITS)]
    assert texts[:4] == ["pose 100.0 Hz", "age 3 ms", "still to 0.00 mm", "at start 0.00 m"]


@pytest.mark.parametrize(("rate", "ok"), [(94.0, False), (95.5, True), (104.5, True), (106.0, False)])
def test_pose_rate(rate: float, ok: bool) -> None:
    window = [replace(s, pose=replace(s.pose, received=round(i * rate / 100 + 0.4))) for i, s in enumerate(samples())]
    assert ("pose rate" not in failed(window)) is ok


def test_rejected_and_late_frames_do_not_count() -> None:
    window = [replace(s, pose=replace(s.pose, rejected=i // 20, late=i // 20)) for i, s in enumerate(samples())]
    assert "pose 91.0 Hz, not 95 to 105 Hz" in failed(window)["pose rate"]


def test_pose_age_is_its_95th_percentile() -> None:
    def aged(count: int) -> list[TickInputs]:
        return [
            replace(s, pose=replace(s.pose, age_ns=25_000_000)) if i < count else s for i, s in enumerate(samples())
        ]

    assert failed(aged(10)) == {}
    assert "25 ms" in failed(aged(11))["pose age"]


def test_no_pose_at_all() -> None:
    names = failed(each(lambda s: replace(s, pose=replace(s.pose, state=None, age_ns=None, raw=None, received=0))))
    assert set(names) == {"pose rate", "pose age", "still", "start", "heading"}
    assert "motion_capture.endpoint" in names["pose age"]


@pytest.mark.parametrize(("sigma_m", "ok"), [(0.0008, True), (0.0013, False)])
def test_still(sigma_m: float, ok: bool) -> None:
    assert ("still" not in failed(samples(sigma_m=sigma_m))) is ok


def test_a_frame_seen_twice_counts_once() -> None:
    window = samples(sigma_m=0.0008)
    held = [replace(s, pose=replace(s.pose, raw=window[0].pose.raw)) for s in window[:150]]
    assert "still" not in failed([*held, *window[150:]])
    assert "too few" in failed([*held, *held])["still"]


@pytest.mark.parametrize(("x_m", "ok"), [(0.099, True), (0.101, False)])
def test_start(x_m: float, ok: bool) -> None:
    assert ("start" not in failed(samples(sigma_m=0.0, at_m=(x_m, 0.0, 0.0)))) is ok


def test_start_says_where_and_what_to_do() -> None:
    text = failed(samples(sigma_m=0.0, at_m=(0.3, 0.4, 0.0)))["start"]
    assert (
        text == "vehicle at (0.30, 0.40, 0.00), 0.50 m from the start (0.00, 0.00, 0.00) (limit 0.1 m): carry it there"
    )


def test_start_tolerance_is_the_missions() -> None:
    assert failed(samples(at_m=(0.3, 0.0, 0.0)), initial_position_tolerance_m=0.4) == {}


@pytest.mark.parametrize(("yaw_deg", "ok"), [(4.9, True), (-4.9, True), (5.1, False), (180.0, False)])
def test_heading(yaw_deg: float, ok: bool) -> None:
    assert ("heading" not in failed(samples(yaw_rad=math.radians(yaw_deg)))) is ok


def test_fence_holds_the_start() -> None:
    inside = replace(LIMITS, geofence=replace(LIMITS.geofence, low_m=(0.1, -2.0, 0.0)))
    checks = {check.name: check for check in preflight(samples(), PLAN, inside)}
    assert not checks["fence"].ok
    assert "0.10 m outside safety.geofence" in checks["fence"].text


@pytest.mark.parametrize(("voltage_V", "ok"), [(3.8, True), (3.79, False), (None, False)])
def test_battery(voltage_V: float | None, ok: bool) -> None:
    assert ("battery" not in failed(each(lambda s: with_telemetry(s, battery_V=voltage_V)))) is ok


def test_link() -> None:
    assert "link" in failed(each(lambda s: with_link(s, connected=False)))
    assert "101 ms" in failed(each(lambda s: with_link(s, age_ns=101_000_000)))["link"]
    assert failed(each(lambda s: with_link(s, age_ns=100_000_000))) == {}


def test_a_vehicle_that_has_crashed_is_not_flown() -> None:
    assert "restart it" in failed(each(lambda s: with_telemetry(s, crashed=True)))["vehicle"]


@pytest.mark.parametrize(("angle_deg", "ok"), [(4.9, True), (5.1, False), (90.0, False)])
def test_onboard_attitude_agrees_with_motion_capture(angle_deg: float, ok: bool) -> None:
    half = math.radians(angle_deg) / 2
    onboard: Quaternion = multiply(from_yaw(0.0), (math.sin(half), 0.0, 0.0, math.cos(half)))
    assert ("estimator" not in failed(each(lambda s: with_telemetry(s, q_WB=onboard)))) is ok


def test_every_failure_is_reported_at_once() -> None:
    window = [with_telemetry(with_link(s, age_ns=10**9), battery_V=3.0) for s in samples(at_m=(1.0, 0.0, 0.0))]
    assert set(failed(window)) == {"start", "battery", "link"}


def test_check_is_a_value() -> None:
    assert Check("x", True, "y") == Check("x", True, "y")
