"""Reports become a picture of the vehicle; what is missing is counted; what speaks against flying is said."""

from __future__ import annotations

import math

import pytest

from drivers.crazyflie import estimator, options
from drivers.crazyflie.picture import Picture
from drivers.crazyflie.status import Status
from lcd_flight.model import InputError, RawPose
from lcd_flight.model.frames import from_yaw

MS = 1_000_000
FLYABLE = Status.CAN_ARM | Status.ARMED | Status.CAN_FLY


def attitude(picture: Picture, vehicle_ms: int, arrival_ms: int | None = None, w: float = 1.0) -> None:
    values = {f"stateEstimate.q{axis}": 0.0 for axis in "xyz"} | {"stateEstimate.qw": w}
    values |= {f"motor.m{number}": 65535.0 * number / 10.0 for number in range(1, 5)}
    picture.take("attitude", vehicle_ms, values, (vehicle_ms if arrival_ms is None else arrival_ms) * MS)


def status(picture: Picture, word: Status, z: float = 0.0) -> None:
    values = {"pm.vbat": 4.0, "supervisor.info": float(word)}
    picture.take("status", 0, values | {f"stateEstimate.{a}": v for a, v in zip("xyz", (1.0, 2.0, z), strict=True)}, MS)


def slow(picture: Picture, variance: float = 1e-4) -> None:
    values = {"kalman.varX": variance / 2.0, "kalman.varY": variance, "kalman.varZ": variance / 3.0}
    picture.take("slow", 0, values | {"acc.x": 0.0, "acc.y": 0.0, "acc.z": 1.0}, MS)


def known() -> Picture:
    picture = Picture()
    attitude(picture, 1000)
    status(picture, FLYABLE)
    slow(picture)
    return picture


def test_it_is_complete_once_every_kind_of_report_has_come() -> None:
    picture = Picture()
    assert picture.telemetry(armed=False) is None
    attitude(picture, 1000)
    status(picture, FLYABLE)
    assert not picture.complete
    slow(picture)
    assert picture.complete
    told = picture.telemetry(armed=True)
    assert told is not None
    assert (told.battery_V, told.armed, told.airborne, told.crashed) == (4.0, True, False, False)
    assert told.motor_shares == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert told.specific_force_B == pytest.approx((0.0, 0.0, 9.81))
    assert told.status == FLYABLE


def test_armed_is_what_vehicle_and_link_agree_on() -> None:
    picture = known()
    for asked in (True, False):
        told = picture.telemetry(armed=asked)
        assert told is not None
        assert told.armed is asked


@pytest.mark.parametrize("bit", [Status.TUMBLED, Status.LOCKED, Status.CRASHED])
def test_trouble_is_a_crash_and_told_once(bit: Status) -> None:
    picture = known()
    for _ in range(3):
        status(picture, FLYABLE | bit)
    told = picture.telemetry(armed=True)
    assert told is not None
    assert told.crashed is True
    assert [text for text in told.messages if "trouble" in text] == [f"the vehicle reports trouble: {bit.trouble}"]
    again = picture.telemetry(armed=True)
    assert again is not None
    assert again.messages == ()


def test_lost_reports_are_counted_by_the_vehicles_stamps() -> None:
    picture = Picture()
    for step in range(100):
        if step % 4:
            attitude(picture, 1000 + 10 * step)
    assert picture.lost == 24
    assert picture.loss_share(1990 * MS) == pytest.approx(0.25, abs=0.01)
    assert picture.loss_share(5000 * MS) == 0.0


def test_the_vehicles_clock_wraps_and_jitters_without_losses() -> None:
    picture = Picture()
    for step in range(50):
        attitude(picture, (0xFFFF00 + 10 * step + (step * 7) % 5 - 2) % 0x1000000, arrival_ms=10 * step)
    assert picture.lost == 0


def test_one_that_comes_out_of_order_is_no_loss() -> None:
    picture = Picture()
    for stamp in (1000, 1010, 1030, 1020, 1040):
        attitude(picture, stamp)
    assert picture.lost == 1


def test_an_attitude_that_is_no_rotation_is_none() -> None:
    picture = Picture()
    attitude(picture, 1000, w=0.0)
    assert picture.q_WB is None
    attitude(picture, 1010, w=math.nan)
    assert picture.q_WB is None


def pose(now_ns: int, position: tuple[float, float, float] = (1.0, 2.0, 0.0), yaw: float = 0.0) -> RawPose:
    return RawPose(0, now_ns, now_ns, position, from_yaw(yaw))


def test_an_estimate_that_agrees_is_not_objected_to() -> None:
    assert estimator.objection(known(), pose(MS), MS) == ""


@pytest.mark.parametrize(
    ("change", "raw", "complaint"),
    [
        (None, None, "no pose from motion capture"),
        (None, pose(MS - 300 * MS), "no pose from motion capture"),
        (lambda p: slow(p, 2e-3), pose(MS), r"variance is 0\.002"),
        (lambda p: slow(p, math.nan), pose(MS), "variance is nan"),
        (lambda p: status(p, FLYABLE, z=-87.0), pose(MS), r"87\.00 m from motion capture"),
        (None, pose(MS, yaw=0.2), "attitude is 11 deg from motion capture"),
    ],
)
def test_what_speaks_against_an_estimate(change: object, raw: RawPose | None, complaint: str) -> None:
    picture = known()
    if callable(change):
        change(picture)
    import re

    assert re.search(complaint, estimator.objection(picture, raw, MS))


@pytest.mark.parametrize(
    ("scheme", "address"),
    [
        ("radio", "0/80/2M/E7E7E7E7E7"),
        ("radio", "0/80/250K"),
        ("radio", "A1B2C3D4E5/125/1M/E7"),
        ("usb", "0"),
        ("udp", "127.0.0.1:19850"),
        ("udp", "bench.local:1"),
    ],
)
def test_addresses(scheme: str, address: str) -> None:
    assert options.read(scheme, address, {}).pose_rate_hz == 100.0


@pytest.mark.parametrize(
    ("scheme", "address"),
    [
        ("radio", ""),
        ("radio", "0"),
        ("radio", "0/126/2M"),
        ("radio", "0/80/3M"),
        ("radio", "0/80/2M/XYZ"),
        ("usb", "a"),
        ("udp", "127.0.0.1"),
        ("udp", "127.0.0.1:0"),
        ("udp", "127.0.0.1:70000"),
        ("udp", ":19850"),
    ],
)
def test_what_is_no_address_is_shown_one(scheme: str, address: str) -> None:
    with pytest.raises(InputError, match=f"write it like {scheme}://"):
        options.read(scheme, address, {})


def test_options_have_limits() -> None:
    assert options.read("usb", "0", {"pose_rate_hz": "50", "thrust_map": "cf21bl"}).pose_rate_hz == 50.0
    with pytest.raises(InputError, match="pose_rate_hz"):
        options.read("usb", "0", {"pose_rate_hz": "0"})
    with pytest.raises(InputError, match="unknown option rate"):
        options.read("usb", "0", {"rate": "1"})
