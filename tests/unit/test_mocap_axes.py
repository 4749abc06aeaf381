"""Axes of motion capture systems, by vectors written out by hand.

Each case is a vehicle somebody can picture: where it stands, where its nose and its left side point.
"""

from __future__ import annotations

import math

import pytest

from lcd_flight.model import MocapAxes, Quaternion, RawPose, Vector3
from lcd_flight.model.frames import rotate
from lcd_flight.wire.mocap_frame import MocapFrame
from mocap.axes import to_world

ROOT = math.sqrt(0.5)
EAST, NORTH, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
WEST, SOUTH, DOWN = (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)
NOSE, LEFT, TOP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
ALL_AXES: tuple[MocapAxes, ...] = ("enu", "ned", "y_up")


def in_world(
    axes: MocapAxes,
    position: Vector3 = (0.0, 0.0, 0.0),
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0),
    velocity: Vector3 | None = None,
    body_rates: Vector3 | None = None,
) -> RawPose:
    frame = MocapFrame(
        body="b",
        sequence=3,
        frame_number=4,
        source_time_ns=5,
        send_time_ns=6,
        clock_id="c",
        axes=axes,
        position=position,
        quaternion=quaternion,
        velocity=velocity,
        body_rates=body_rates,
    )
    return to_world(frame, 7)


@pytest.mark.parametrize(
    ("axes", "given", "expected"),
    [
        ("enu", (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
        ("ned", (1.0, 2.0, -3.0), (2.0, 1.0, 3.0)),
        ("y_up", (1.0, 3.0, -2.0), (1.0, 2.0, 3.0)),
    ],
)
def test_position_and_velocity(axes: MocapAxes, given: Vector3, expected: Vector3) -> None:
    pose = in_world(axes, position=given, velocity=given)
    assert pose.p_WB == expected
    assert pose.v_WB_W == expected


@pytest.mark.parametrize(
    ("axes", "quaternion", "nose", "left", "top"),
    [
        ("enu", (0.0, 0.0, 0.0, 1.0), EAST, NORTH, UP),
        ("enu", (0.0, 0.0, ROOT, ROOT), NORTH, WEST, UP),
        ("enu", (ROOT, 0.0, 0.0, ROOT), EAST, UP, SOUTH),  # rolled to its right
        # North-east-down, body forward-right-down: the identity looks north.
        ("ned", (0.0, 0.0, 0.0, 1.0), NORTH, WEST, UP),
        ("ned", (0.0, 0.0, ROOT, ROOT), EAST, NORTH, UP),  # heading 90 degrees, clockwise from north
        ("ned", (0.0, ROOT, 0.0, ROOT), UP, WEST, SOUTH),  # nose straight up
        ("ned", (ROOT, 0.0, 0.0, ROOT), NORTH, UP, EAST),  # rolled to its right
        # y up, body axes named likewise: the identity looks along x.
        ("y_up", (0.0, 0.0, 0.0, 1.0), EAST, NORTH, UP),
        ("y_up", (0.0, ROOT, 0.0, ROOT), NORTH, WEST, UP),  # a quarter turn to the left about the vertical
        ("y_up", (0.0, 0.0, ROOT, ROOT), UP, NORTH, WEST),  # nose straight up
        ("y_up", (ROOT, 0.0, 0.0, ROOT), EAST, UP, SOUTH),  # rolled to its right
    ],
)
def test_attitude(axes: MocapAxes, quaternion: Quaternion, nose: Vector3, left: Vector3, top: Vector3) -> None:
    q_WB = in_world(axes, quaternion=quaternion).q_WB
    assert rotate(q_WB, NOSE) == pytest.approx(nose, abs=1e-12)
    assert rotate(q_WB, LEFT) == pytest.approx(left, abs=1e-12)
    assert rotate(q_WB, TOP) == pytest.approx(top, abs=1e-12)


@pytest.mark.parametrize(
    ("axes", "given", "expected"),
    [
        ("enu", (0.1, 0.2, 0.3), (0.1, 0.2, 0.3)),
        ("ned", (0.1, -0.2, -0.3), (0.1, 0.2, 0.3)),
        ("y_up", (0.1, 0.3, -0.2), (0.1, 0.2, 0.3)),
    ],
)
def test_body_rates(axes: MocapAxes, given: Vector3, expected: Vector3) -> None:
    assert in_world(axes, body_rates=given).w_WB_B == expected


@pytest.mark.parametrize("axes", ALL_AXES)
def test_maps_are_right_handed_rotations(axes: MocapAxes) -> None:
    x, y, z = (in_world(axes, position=p).p_WB for p in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    cross = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    assert cross == pytest.approx(z)
    assert math.hypot(*in_world(axes, quaternion=(0.5, -0.5, 0.5, 0.5)).q_WB) == pytest.approx(1.0)


@pytest.mark.parametrize("axes", ALL_AXES)
def test_velocity_turns_with_the_body_that_flies_forward(axes: MocapAxes) -> None:
    """A body that moves along its own nose does so in every naming: world and body maps belong together."""
    quaternion = (0.1, -0.2, 0.3, math.sqrt(1.0 - 0.14))
    pose = in_world(axes, quaternion=quaternion, velocity=rotate(quaternion, NOSE))
    assert pose.v_WB_W == pytest.approx(rotate(pose.q_WB, NOSE))


def test_stamps_and_count_are_kept() -> None:
    pose = in_world("ned")
    assert (pose.sequence, pose.source_stamp_ns, pose.arrival_ns) == (3, 5, 7)
    assert pose.v_WB_W is None
    assert pose.w_WB_B is None
