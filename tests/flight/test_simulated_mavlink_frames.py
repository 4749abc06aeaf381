"""Where attitude setpoints in NED and FRD take the vehicle in the world (x east, y north, z up)."""

from __future__ import annotations

import math

import pytest
from virtual_mavlink import HOVER, Client, Quaternion, turned

from lcd_flight.model.frames import yaw_of

BOTH = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
NORTH = math.pi / 2


def moved(flavour: str, q: Quaternion, yaw_rad: float = NORTH) -> tuple[float, float]:
    """East and north, m, that half a second of a setpoint adds to what the same time without it does."""
    ways = []
    for setpoint in (q, turned(yaw_deg=90.0 - math.degrees(yaw_rad))):
        client = Client(flavour, yaw_rad=yaw_rad)
        client.take_off()
        x, y, _ = client.state.p_WB
        client.fly(500, HOVER[flavour], setpoint)
        ways.append((client.state.p_WB[0] - x, client.state.p_WB[1] - y))
    return (ways[0][0] - ways[1][0], ways[0][1] - ways[1][1])


@BOTH
def test_pitch_up_moves_it_south(flavour: str) -> None:
    east, north = moved(flavour, turned(pitch_deg=10.0))
    assert north < -0.05
    assert abs(east) < 0.3 * abs(north)


@BOTH
def test_roll_right_moves_it_east(flavour: str) -> None:
    east, north = moved(flavour, turned(roll_deg=10.0))
    assert east > 0.05
    assert abs(north) < 0.3 * abs(east)


@BOTH
def test_yaw_of_90_degrees_heads_east(flavour: str) -> None:
    client = Client(flavour)
    client.take_off()
    client.fly(2500, HOVER[flavour], turned(yaw_deg=90.0))
    assert yaw_of(client.state.q_WB) == pytest.approx(0.0, abs=0.05)


@BOTH
def test_the_negative_of_a_quaternion_is_the_same_turn(flavour: str) -> None:
    w, x, y, z = turned(roll_deg=10.0)
    assert moved(flavour, (-w, -x, -y, -z)) == pytest.approx(moved(flavour, (w, x, y, z)), abs=1e-6)


def test_a_pitch_step_is_followed_as_fast_as_ardupilot_does() -> None:
    """63 % of a step after 0.21 s, as seen in flight experiments."""
    client = Client("ardupilot")
    client.take_off()
    goal = turned(pitch_deg=20.0)
    for periods in range(100):
        client.target(HOVER["ardupilot"], goal)
        client.wait(10)
        if client.pilot.estimator.attitude[2] > 0.63 * goal[2]:
            assert 0.15 < 0.01 * periods < 0.32
            return
    raise AssertionError("it was not followed")


@BOTH
def test_thrust_up_is_up(flavour: str) -> None:
    client = Client(flavour)
    client.take_off()
    before = client.state.v_WB_W[2]
    client.fly(300, 1.2 * HOVER[flavour])
    assert client.state.v_WB_W[2] > before + 0.3


@BOTH
def test_a_pose_frame_that_is_not_north_aligned_turns_the_setpoints_with_it(flavour: str) -> None:
    """Its x lies along east: what is 'north' to the client is east; it stands with its nose there, heading 0."""
    client = Client(flavour, own_mocap=False, yaw_rad=0.0)
    if flavour == "ardupilot":
        origin(client)
    for _ in range(200):
        see_in_east_frame(client)
        client.wait(20)
    hover = HOVER[flavour]
    if flavour == "px4":
        fly_seen(client, 60, 0.0)
        client.mode(6 << 16)
    else:
        client.mode(20)
    assert client.command(400, 1) == 0
    fly_seen(client, 125, 0.0)
    fly_seen(client, 25, 1.2 * hover)
    fly_seen(client, 30, hover)
    x, y, _ = client.state.p_WB
    fly_seen(client, 30, hover, turned(pitch_deg=-12.0))
    east, north = client.state.p_WB[0] - x, client.state.p_WB[1] - y
    assert east > 0.05
    assert abs(north) < 0.5 * east


@BOTH
def test_a_setpoint_for_another_frame_than_the_poses_leads_elsewhere(flavour: str) -> None:
    """Poses by one map, setpoints by another, a quarter turn off: 'forward' becomes sideways."""
    client = Client(flavour, own_mocap=False, yaw_rad=0.0)
    if flavour == "ardupilot":
        origin(client)
    for _ in range(200):
        see_in_east_frame(client)
        client.wait(20)
    fly_seen(client, 60, 0.0)
    client.mode(6 << 16 if flavour == "px4" else 20)
    assert client.command(400, 1) == 0
    hover, east = HOVER[flavour], turned(yaw_deg=90.0)
    fly_seen(client, 125, 0.0)
    fly_seen(client, 25, 1.2 * hover)
    fly_seen(client, 150, hover, east)
    assert abs(yaw_of(client.state.q_WB)) == pytest.approx(math.pi / 2, abs=0.1), "it turned away from where it looked"


def origin(client: Client) -> None:
    from pymavlink.dialects.v20 import common

    client.send(common.MAVLink_set_gps_global_origin_message(1, 473977420, 85455940, 488000))


def fly_seen(client: Client, count: int, thrust: float, q: Quaternion | None = None) -> None:
    for _ in range(count):
        see_in_east_frame(client)
        client.target(thrust, q)
        client.wait(20)


def see_in_east_frame(client: Client) -> None:
    """The client's map for a z-up frame whose x is forward: y and z change sign, and so do those of q."""
    x, y, z = client.state.p_WB
    qx, qy, qz, qw = client.state.q_WB
    client.see((x, -y, -z), (qw, qx, -qy, -qz))
