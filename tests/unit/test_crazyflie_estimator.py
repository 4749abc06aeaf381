"""What the simulated Crazyflie believes of itself, by what it logs and how it flies."""

from __future__ import annotations

import math
import struct

import pytest
from virtual_crazyflie import HOVER, Client, rpyt

from lcd_flight.model.frames import angle_between, from_yaw, tilt_of, yaw_of
from sim_bridge.crazyflie.crtp import Packet, Port
from sim_bridge.crazyflie.estimator import Estimator
from sim_bridge.crazyflie.poses import compressed, decode_pose, decompressed

KALMAN = 2
NO_TURN = (0.0, 0.0, 0.0, 1.0)
QUARTER_TURN = from_yaw(math.pi / 2.0)


@pytest.fixture
def client() -> Client:
    client = Client(position_m=(1.0, -2.0, 0.0), yaw_rad=math.pi / 2.0)
    client.wait(200.0)
    client.set("stabilizer.estimator", KALMAN)
    client.wait(10.0)
    return client


def seen(client: Client, duration_ms: float) -> None:
    """Motion capture at 100 Hz."""
    for _ in range(round(duration_ms / 10.0)):
        client.show(client.state.p_WB, client.state.q_WB)
        client.wait(10.0)


def estimator(client: Client) -> Estimator:
    return client.vehicle.firmware.estimator


def test_poses_bring_it_to_where_it_is_and_make_it_sure(client: Client) -> None:
    assert max(estimator(client).position_variance) > 0.9
    seen(client, 500.0)
    assert estimator(client).state.p_WB == pytest.approx((1.0, -2.0, 0.0), abs=0.01)
    assert angle_between(estimator(client).attitude, client.state.q_WB) < math.radians(1.0)
    assert max(estimator(client).position_variance) < 1e-4


def test_without_poses_it_drifts_away(client: Client) -> None:
    seen(client, 500.0)
    client.wait(30_000.0)
    assert math.dist(estimator(client).state.p_WB, client.state.p_WB) > 1.0
    assert max(estimator(client).position_variance) > 1.0


def test_far_away_it_begins_anew_and_says_so(client: Client) -> None:
    client.set("kalman.initialX", 99.99)
    client.set("kalman.resetEstimation", 1)
    client.wait(60_000.0)
    assert "State out of bounds, resetting" in client.text


def test_a_reset_forgets_and_takes_its_parameter_back(client: Client) -> None:
    seen(client, 500.0)
    number, _ = client.parameter("kalman.resetEstimation")
    client.set("kalman.resetEstimation", 1)
    told = b"\x2f\x01" + struct.pack("<HB", number, 0)
    assert told in client.wait(10.0)
    assert client.get("kalman.resetEstimation") == 0
    assert max(estimator(client).position_variance) > 1e3
    seen(client, 300.0)
    assert estimator(client).state.p_WB == pytest.approx((1.0, -2.0, 0.0), abs=0.01)


def test_a_reset_begins_where_the_parameters_say(client: Client) -> None:
    for name, value in (("kalman.initialX", 3.0), ("kalman.initialYaw", 1.0), ("kalman.initialZ", math.nan)):
        client.set(name, value)
    client.set("kalman.resetEstimation", 1)
    client.wait(2.0)
    state = estimator(client).state
    assert state.p_WB[0] == pytest.approx(3.0, abs=1e-3)
    assert angle_between(state.q_WB, from_yaw(1.0)) < 0.01
    assert all(map(math.isfinite, state.p_WB))


def test_choosing_the_filter_begins_it_anew() -> None:
    client = Client()
    client.set("kalman.initialX", 3.0)
    client.wait(10.0)
    assert estimator(client).state.p_WB[0] == 0.0
    client.set("stabilizer.estimator", KALMAN)
    client.wait(10.0)
    assert estimator(client).state.p_WB[0] == pytest.approx(3.0, abs=1e-3)


def test_a_position_alone_says_nothing_of_the_attitude(client: Client) -> None:
    for _ in range(50):
        client.ask(b"\x6c" + struct.pack("<fff", 1.0, -2.0, 0.0))
        client.wait(10.0)
    assert estimator(client).state.p_WB == pytest.approx((1.0, -2.0, 0.0), abs=0.01)
    assert angle_between(estimator(client).attitude, NO_TURN) < math.radians(1.0)


def test_poses_are_ignored_where_the_other_filter_runs() -> None:
    client = Client()
    for _ in range(50):
        client.show((1.0, 1.0, 1.0), QUARTER_TURN)
        client.wait(10.0)
    assert estimator(client).state.p_WB == (0.0, 0.0, 0.0)
    assert angle_between(estimator(client).attitude, NO_TURN) < math.radians(1.0)


@pytest.mark.parametrize("sigma", [math.nan, 0.0, -1.0, math.inf])
def test_a_senseless_standard_deviation_does_no_harm(client: Client, sigma: float) -> None:
    client.set("locSrv.extPosStdDev", sigma)
    client.set("locSrv.extQuatStdDev", sigma)
    seen(client, 200.0)
    assert all(map(math.isfinite, (*estimator(client).state.p_WB, *estimator(client).attitude)))
    assert "out of bounds" not in client.text


def test_without_poses_the_heading_drifts_and_the_tilt_does_not() -> None:
    """The accelerometer sees up and no north."""
    client = Client(seed=2)
    client.wait(60_000.0)
    attitude = estimator(client).attitude
    assert 0.1 < abs(math.degrees(yaw_of(attitude))) < 5.0
    assert math.degrees(tilt_of(attitude)) < 0.5


def test_the_estimate_follows_a_flight(client: Client) -> None:
    seen(client, 300.0)
    client.ask(rpyt(0))
    for step in range(150):
        client.ask(rpyt(45_000 if step < 50 else HOVER, roll=5.0, pitch=-5.0))
        seen(client, 10.0)
        state = estimator(client).state
        assert math.dist(state.p_WB, client.state.p_WB) < 0.03
        assert math.dist(state.v_WB_W, client.state.v_WB_W) < 0.15
        assert angle_between(state.q_WB, client.state.q_WB) < math.radians(2.0)
    assert client.height_m > 0.3


def test_poses_in_wrong_axes_flip_it_at_take_off() -> None:
    """What a rigid body with its x and y axes mixed up leads to: it leans the wrong way, further and further."""
    client = Client()
    client.wait(200.0)
    client.set("stabilizer.estimator", KALMAN)
    client.ask(rpyt(0))
    for _ in range(300):
        x, y, z, w = client.state.q_WB
        client.show(client.state.p_WB, (-x, -y, z, w))  # half a turn about z
        client.ask(rpyt(45_000, roll=1.0))
        client.wait(10.0)
    assert client.vehicle.body.broken


class TestPosePackets:
    def test_a_pose(self) -> None:
        position, attitude = "0000803F 00000040 0000003F", "00000000 00000000 00000000 0000803F"
        pose = decode_pose(Packet(Port.LOCALIZATION, 1, bytes.fromhex(f"08 {position} {attitude}")), 0xE7)
        assert pose is not None
        assert (pose.p_WB, pose.q_WB) == ((1.0, 2.0, 0.5), (0.0, 0.0, 0.0, 1.0))

    def test_a_position(self) -> None:
        pose = decode_pose(Packet(Port.LOCALIZATION, 0, bytes.fromhex("0000803F 00000040 0000003F")), 0xE7)
        assert pose is not None
        assert (pose.p_WB, pose.q_WB) == ((1.0, 2.0, 0.5), None)

    def test_packed_positions_of_several_vehicles(self) -> None:
        """Number and millimetres; the vehicle finds itself by its number."""
        packet = Packet(Port.LOCALIZATION, 2, bytes.fromhex("01 E803 0000 0000  E7 E803 30F8 F401"))
        pose = decode_pose(packet, 0xE7)
        assert pose is not None
        assert pose.p_WB == pytest.approx((1.0, -2.0, 0.5))
        assert decode_pose(packet, 0x55) is None

    def test_a_packed_pose(self) -> None:
        """The largest component of no turn is w, the fourth: 3 << 30, the others zero."""
        packet = Packet(Port.LOCALIZATION, 1, bytes.fromhex("09 E7 E803 30F8 F401 000000C0"))
        pose = decode_pose(packet, 0xE7)
        assert pose is not None
        assert pose.q_WB == pytest.approx(NO_TURN)

    @pytest.mark.parametrize(
        ("q", "bits"),
        [
            (NO_TURN, 0xC0000000),
            ((0.1, 0.2, -0.3, 0.92736185), 0xC48246D9),
            ((-0.8, 0.6, 0.0, 0.0), 0x3B280200),
        ],
    )
    def test_attitudes_in_32_bits(self, q: tuple[float, float, float, float], bits: int) -> None:
        """As cflib compresses them (utils/encoding.py); a quaternion and its opposite are one attitude."""
        assert compressed(q) == bits
        sign = math.copysign(1.0, max(q, key=abs))
        assert decompressed(bits) == pytest.approx([sign * x for x in q], abs=2e-3)

    @pytest.mark.parametrize(
        ("channel", "payload"),
        [
            (0, "0000803F 00000040"),
            (0, "0000C07F 00000040 0000003F"),  # not a number
            (1, "08 0000803F 00000040 0000003F 00000000 00000000 00000000 00000000"),  # no rotation
            (1, "08 0000803F"),
            (1, "07 0000803F"),
            (1, ""),
            (2, "E7 E803"),
            (3, "00"),
        ],
    )
    def test_what_is_no_pose(self, channel: int, payload: str) -> None:
        assert decode_pose(Packet(Port.LOCALIZATION, channel, bytes.fromhex(payload)), 0xE7) is None
