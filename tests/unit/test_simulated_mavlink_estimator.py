"""The simulated autopilot's estimator, fed by hand: time is in periods of 4 ms, axes are NED and FRD."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from virtual_mavlink import Client, turned

from lcd_flight.model import GRAVITY_M_PER_S2, Vector3
from sim_bridge.mavlink.body import PERIOD_NS, Inertial
from sim_bridge.mavlink.estimator import Estimator, SeenPose
from sim_bridge.mavlink.frames import Hamilton, angles, heading, level

STILL = Inertial((0.0, 0.0, -GRAVITY_M_PER_S2), (0.0, 0.0, 0.0))
ORIGIN = SeenPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), None, 0)


def live(
    estimator: Estimator,
    periods: int,
    pose: SeenPose | None = None,
    measured: Inertial = STILL,
    start: int = 0,
    every: int = 5,
) -> int:
    """Periods from `start` on, with a pose every so many; where it ends."""
    for period in range(start, start + periods):
        now_ns = period * PERIOD_NS
        estimator.predict(measured, now_ns, at_rest=False)
        if pose is not None and period % every == 0:
            estimator.see(pose, now_ns)
    return start + periods


def test_the_first_pose_is_taken_as_it_is() -> None:
    estimator = Estimator(yaw_rad=1.0)
    pose = SeenPose((1.0, 2.0, -3.0), level(-0.5), (0.2, 0.0, 0.0), 0)
    estimator.see(pose, 0)
    assert estimator.position == (1.0, 2.0, -3.0)
    assert heading(estimator.attitude) == pytest.approx(-0.5)
    assert estimator.velocity == pytest.approx((0.2 * math.cos(0.5), -0.2 * math.sin(0.5), 0.0))


def test_it_converges_on_a_pose_nearby() -> None:
    estimator = Estimator()
    start = live(estimator, 100, ORIGIN)
    live(estimator, 1000, replace(ORIGIN, position=(0.2, -0.1, 0.1), attitude=level(0.3)), start=start)
    assert estimator.position == pytest.approx((0.2, -0.1, 0.1), abs=1e-3)
    assert heading(estimator.attitude) == pytest.approx(0.3, abs=1e-3)
    assert angles(estimator.attitude)[:2] == pytest.approx((0.0, 0.0), abs=2e-3)


def test_roll_and_pitch_are_not_taken_from_a_pose() -> None:
    estimator = Estimator()
    live(estimator, 1000, replace(ORIGIN, attitude=turned(roll_deg=20.0)))
    assert angles(estimator.attitude)[:2] == pytest.approx((0.0, 0.0), abs=1e-3)


@pytest.mark.parametrize("tilt", [turned(roll_deg=5.0), turned(pitch_deg=5.0), turned(roll_deg=-5.0)])
def test_positions_put_a_wrong_tilt_right(tilt: Hamilton) -> None:
    """It stands still and level, and believes that it does not: positions say that it does not accelerate."""
    estimator = Estimator()
    start = live(estimator, 50, ORIGIN)
    estimator.attitude = tilt
    live(estimator, 1500, ORIGIN, start=start)
    assert angles(estimator.attitude)[:2] == pytest.approx((0.0, 0.0), abs=math.radians(0.3))
    assert estimator.position == pytest.approx((0.0, 0.0, 0.0), abs=0.02)


def test_a_far_pose_is_ignored_for_seven_seconds() -> None:
    estimator = Estimator()
    start = live(estimator, 100, ORIGIN)
    far = replace(ORIGIN, position=(30.0, 0.0, 0.0))
    start = live(estimator, 1700, far, start=start)
    assert estimator.position[0] < 1.0
    assert estimator.ratio > 1.0
    live(estimator, 100, far, start=start)
    assert estimator.position[0] == pytest.approx(30.0, abs=0.1)


def test_a_reset_is_followed_at_once() -> None:
    estimator = Estimator()
    start = live(estimator, 100, ORIGIN)
    estimator.see(replace(ORIGIN, position=(5.0, 0.0, 0.0), resets=1), start * PERIOD_NS)
    assert estimator.position == (5.0, 0.0, 0.0)


def test_without_poses_it_drifts() -> None:
    estimator = Estimator()
    biased = Inertial((0.02, 0.0, -GRAVITY_M_PER_S2), (0.0, 0.0, 0.0))
    start = live(estimator, 100, ORIGIN, biased)
    before = estimator.position[0]
    live(estimator, 1250, None, biased, start=start)
    assert estimator.position[0] - before > 0.05


def test_at_rest_the_accelerometer_shows_what_is_down() -> None:
    estimator = Estimator()
    estimator.attitude = turned(pitch_deg=10.0)
    for period in range(1000):
        estimator.predict(STILL, period * PERIOD_NS, at_rest=True)
    assert angles(estimator.attitude)[:2] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert estimator.velocity == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("velocity", [None, (0.5, 0.0, 0.0)])
def test_a_steady_speed_is_found_from_positions(velocity: Vector3 | None) -> None:
    estimator = Estimator()
    for period in range(1500):
        estimator.predict(STILL, period * PERIOD_NS, at_rest=False)
        if period % 5 == 0:
            seen = SeenPose((0.5 * period * PERIOD_NS * 1e-9, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), velocity, 0)
            estimator.see(seen, period * PERIOD_NS)
    assert estimator.velocity == pytest.approx((0.5, 0.0, 0.0), abs=0.02)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_in_flight_it_knows_where_it_is_to_centimetres(flavour: str) -> None:
    client = Client(flavour)
    client.take_off()
    client.fly(1500, 0.5 if flavour == "px4" else 0.369, turned(roll_deg=8.0))
    x, y, z = client.state.p_WB
    assert client.pilot.estimator.position == pytest.approx((y, x, -z), abs=0.02)


@pytest.mark.parametrize(
    ("bits", "moved", "turned_too"), [(15, True, True), (7, True, False), (0, False, False), (1, False, False)]
)
def test_px4s_bits_say_what_is_taken(bits: int, moved: bool, turned_too: bool) -> None:
    client = Client(own_mocap=False, wrong=f"EKF2_EV_CTRL:{bits}", yaw_rad=math.pi / 2)
    client.see((1.0, 0.0, 0.0), turned(yaw_deg=30.0))
    assert (client.pilot.estimator.position[0] == 1.0) == moved
    assert (heading(client.pilot.estimator.attitude) > 0.1) == turned_too


@pytest.mark.parametrize(
    ("more", "taken"),
    [
        ({}, True),
        ({"frame": 1}, True),
        ({"frame": 21}, False),
        ({"kind": 3}, True),
        ({"kind": 8}, False),
        ({"child": 1}, False),
    ],
)
def test_which_odometry_px4_takes(more: dict[str, int], taken: bool) -> None:
    client = Client(own_mocap=False)
    client.see((1.0, 0.0, 0.0), **more)
    assert (client.pilot.estimator.taken_ns is not None) == taken


@pytest.mark.parametrize(
    "wrong",
    [
        {"p": (math.nan, 0.0, 0.0)},
        {"p": (1e30, 0.0, 0.0)},
        {"q": (math.nan, 0.0, 0.0, 0.0)},
        {"q": (0.0, 0.0, 0.0, 0.0)},
        {"q": (2.0, 0.0, 0.0, 0.0)},
        {"quality": -1},
    ],
)
def test_what_is_no_pose_is_ignored(wrong: dict[str, tuple[float, ...]]) -> None:
    client = Client(own_mocap=False)
    client.see(**{"p": (0.0, 0.0, 0.0), **wrong})  # type: ignore[arg-type]
    assert client.pilot.estimator.taken_ns is None


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_vision_position_estimate_is_taken_and_att_pos_mocap_is_not(flavour: str) -> None:
    from pymavlink.dialects.v20 import common

    client = Client(flavour, own_mocap=False)
    client.send(common.MAVLink_att_pos_mocap_message(0, [1.0, 0.0, 0.0, 0.0], 1.0, 2.0, 3.0))
    assert client.pilot.estimator.taken_ns is None
    client.send(common.MAVLink_vision_position_estimate_message(0, 1.0, 2.0, -3.0, 0.0, 0.0, 0.5))
    assert client.pilot.estimator.position == (1.0, 2.0, -3.0)
    assert heading(client.pilot.estimator.attitude) == pytest.approx(0.5)
