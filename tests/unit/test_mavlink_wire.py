"""Frames, setpoints, poses and thrust as they go over the wire, against rotation matrices written out here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink import frames_wire, odometry_wire, setpoint_wire
from drivers.mavlink.odometry_wire import Odometry
from drivers.mavlink.options import Frame
from drivers.mavlink.thrust import ThrustMap
from lcd_flight.model import FloatArray, Quaternion
from lcd_flight.model.frames import normalized

FRAMES: list[Frame] = ["enu", "flu"]
WORLD = {
    "enu": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "flu": np.diag([1.0, -1.0, -1.0]),
}
"""Columns: our axes, seen in theirs."""
BODY = np.diag([1.0, -1.0, -1.0])
FORWARD, LEFT, UP = np.eye(3)

parts = st.floats(-1.0, 1.0, allow_nan=False)
attitudes = st.tuples(parts, parts, parts, parts).filter(lambda q: math.hypot(*q) > 0.1).map(normalized)


def matrix(x: float, y: float, z: float, w: float) -> FloatArray:
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def wire_matrix(q: frames_wire.WireQuaternion) -> FloatArray:
    w, x, y, z = q
    return matrix(x, y, z, w)


@pytest.mark.parametrize("frame", FRAMES)
@given(q_WB=attitudes)
def test_an_attitude_is_the_product_of_three_rotations(frame: Frame, q_WB: Quaternion) -> None:
    found = wire_matrix(frames_wire.attitude(q_WB, frame))
    np.testing.assert_allclose(found, WORLD[frame] @ matrix(*q_WB) @ BODY, atol=1e-12)
    np.testing.assert_allclose(
        matrix(*frames_wire.attitude_from(frames_wire.attitude(q_WB, frame), frame)), matrix(*q_WB), atol=1e-12
    )


@pytest.mark.parametrize("frame", FRAMES)
def test_vectors(frame: Frame) -> None:
    for v in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.3, -0.5, 0.7)):
        np.testing.assert_allclose(frames_wire.vector(v, frame), WORLD[frame] @ np.array(v), atol=1e-15)
        np.testing.assert_allclose(frames_wire.vector(frames_wire.vector(v, frame), frame), v, atol=1e-15)
        np.testing.assert_allclose(frames_wire.body(v), BODY @ np.array(v), atol=1e-15)


def test_in_words() -> None:
    """East stays east, up becomes minus down; nose east in `enu` is yaw +90 deg, in `flu` yaw 0."""
    assert frames_wire.vector((1.0, 2.0, 3.0), "enu") == (2.0, 1.0, -3.0)
    assert frames_wire.vector((1.0, 2.0, 3.0), "flu") == (1.0, -2.0, -3.0)
    nose_east = frames_wire.attitude((0.0, 0.0, 0.0, 1.0), "enu")
    assert nose_east == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    assert frames_wire.attitude((0.0, 0.0, 0.0, 1.0), "flu") == pytest.approx((1.0, 0.0, 0.0, 0.0))


class TestSetpoint:
    def message(self, q_WB: Quaternion = (0.0, 0.0, 0.0, 1.0), thrust: float = 0.5, now_ns: int = 0) -> object:
        return setpoint_wire.attitude_target(q_WB, thrust, now_ns=now_ns, target=(1, 1), frame="flu")

    @pytest.mark.parametrize("thrust", [math.nan, math.inf, -0.001, 1.001])
    def test_thrust_out_of_range_is_refused(self, thrust: float) -> None:
        with pytest.raises(ValueError, match="thrust"):
            self.message(thrust=thrust)

    @pytest.mark.parametrize(
        "q", [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.001), (0.0, 0.0, math.nan, 1.0), (math.inf, 0.0, 0.0, 1.0)]
    )
    def test_what_is_no_rotation_is_refused(self, q: Quaternion) -> None:
        with pytest.raises(ValueError, match="unit quaternion"):
            self.message(q)

    def test_a_length_that_is_nearly_one_is_made_one(self) -> None:
        found = self.message((0.0, 0.0, 0.0, 1.0004))
        assert found.q == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-12)  # type: ignore[attr-defined]

    def test_time_wraps(self) -> None:
        assert setpoint_wire.time_boot_ms((1 << 32) * 1_000_000 + 7_000_000) == 7
        assert self.message(now_ns=(1 << 70)).time_boot_ms < 1 << 32  # type: ignore[attr-defined]

    def test_the_mask_is_one_that_both_flavours_take(self) -> None:
        assert self.message().type_mask == 7  # type: ignore[attr-defined]


class TestOdometry:
    def test_velocity_is_in_the_body_and_the_rest_as_both_flavours_fuse_it(self) -> None:
        half = math.sqrt(0.5)
        nose_north = (0.0, 0.0, half, half)  # in enu, north is y
        given_odometry = Odometry(
            5_000_000_999, (1.0, 2.0, 3.0), nose_north, (0.0, 2.0, 0.5), (0.1, 0.2, 0.3), resets=257
        )
        found = odometry_wire.message(given_odometry, "enu")
        assert found.time_usec == 5_000_000
        assert (found.frame_id, found.child_frame_id, found.estimator_type) == (20, 12, 2)
        assert (found.x, found.y, found.z) == (2.0, 1.0, -3.0)
        assert tuple(found.q) == pytest.approx((1.0, 0.0, 0.0, 0.0))
        assert (found.vx, found.vy, found.vz) == pytest.approx((2.0, 0.0, -0.5))
        assert (found.rollspeed, found.pitchspeed, found.yawspeed) == (0.1, -0.2, -0.3)
        assert (found.reset_counter, found.quality) == (1, 100)
        assert [i for i, value in enumerate(found.pose_covariance) if value] == [0, 6, 11, 15, 18, 20]
        assert found.pose_covariance[0] == odometry_wire.POSITION_SIGMA_M**2
        assert found.velocity_covariance[0] == odometry_wire.VELOCITY_SIGMA**2

    def test_what_is_not_finite_is_refused(self) -> None:
        bad = Odometry(0, (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        with pytest.raises(ValueError, match="not finite"):
            odometry_wire.message(bad, "flu")


class TestThrust:
    def test_hovering_is_the_hover_point_whatever_the_slope(self) -> None:
        for slope in (0.5, 0.87, 1.0, 2.0):
            assert ThrustMap(0.369, slope, 4.9).share(4.9) == pytest.approx(0.369)

    def test_with_slope_one_it_is_proportional(self) -> None:
        assert ThrustMap(0.5, 1.0, 4.0).share(2.0) == pytest.approx(0.25)
        assert ThrustMap(0.5, 1.0, 4.0).share(6.0) == pytest.approx(0.75)

    def test_ardupilots_slope_gives_what_was_seen(self) -> None:
        """0.8 of hover gives 0.824 g, 1.2 gives 1.172 g."""
        thrust_map = ThrustMap(0.369, 0.87, 1.0)
        assert thrust_map.share(0.824) == pytest.approx(0.8 * 0.369, abs=0.002)
        assert thrust_map.share(1.172) == pytest.approx(1.2 * 0.369, abs=0.002)

    @pytest.mark.parametrize(("thrust_N", "share"), [(0.0, 0.0), (-1.0, 0.0), (0.001, 0.0), (1e9, 1.0)])
    def test_what_is_out_of_reach_is_the_limit(self, thrust_N: float, share: float) -> None:
        assert ThrustMap(0.4, 0.8, 4.9).share(thrust_N) == share
