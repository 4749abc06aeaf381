"""The faults of the simulated MAVLink vehicle's bench, in virtual time; times count from arming."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

from lcd_flight.flight.virtual_time import VirtualClock
from lcd_flight.model import InputError, LinkContext, State
from lcd_flight.model.frames import yaw_of
from lcd_flight.wire.mocap_frame import decode
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.bench import Bench
from sim_bridge.mavlink.mocap_view import MocapView
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.radio import MOST_UNDER_WAY, Way

MS = 1_000_000
KEY = b"k" * 32
ARM, SET_MODE, VERSION = 400, 176, 148


class Line:
    """A client at a bench in virtual time."""

    def __init__(self, key: bytes | None = None, place: tuple[float, float, float] = (0.0, 0.0, 0.0), **options: Any):
        context = LinkContext(
            vehicle=load_vehicle("hummingbird"),
            clock=VirtualClock(),
            initial_position_m=place,
            initial_yaw_rad=0.0,
            seed=5,
            rigid_body="body",
        )
        chosen = MavlinkOptions(**{"boot_s": 0.0, "own_mocap": True, **options})
        self.bench = Bench(chosen, context, key, 1_767_225_600_000_000_000)
        self.bench.switch_on(0)
        self.now_ns = 0
        self.said: list[str] = []
        self.heard: list[Any] = []
        self.raw: list[bytes] = []
        self._out, self._in = common.MAVLink(None, srcSystem=245, srcComponent=191), common.MAVLink(None)
        self._out.signing.secret_key, self._out.signing.sign_outgoing = key, key is not None
        self._out.signing.timestamp = 347_155_200_000_00 + 10**9

    @property
    def pilot(self) -> Any:
        return self.bench.vehicle.firmware.pilot

    def send(self, message: Any) -> None:
        self.bench.receive(message.pack(self._out), self.now_ns)
        self._out.seq = (self._out.seq + 1) % 256
        self._hear()

    def wait(self, ms: float) -> None:
        for _ in range(round(ms / 4.0)):
            self.now_ns += 4 * MS
            self.bench.advance_to(self.now_ns)
            self.said += self.bench.said()
            self._hear()

    def command(self, command: int, *params: float) -> list[int]:
        """Results that come within 60 ms."""
        self.heard.clear()
        seven = [*params, *(0.0,) * (7 - len(params))]
        self.send(common.MAVLink_command_long_message(1, 1, command, 0, *seven))
        self.wait(60)
        return [ack.result for ack in self.of("COMMAND_ACK")]

    def arm(self) -> None:
        self.wait(100)
        self.command(ARM, 1, 21196)
        assert self.pilot.armed

    def of(self, kind: str) -> list[Any]:
        return [message for message in self.heard if message.get_type() == kind]

    def _hear(self) -> None:
        packets = self.bench.outgoing(self.now_ns)
        self.raw += packets
        self.heard += [self._in.decode(bytearray(packet)) for packet in packets]


def test_without_faults_everything_arrives_once_and_in_order() -> None:
    line = Line()
    line.wait(2000)
    numbers = [packet[4] for packet in line.raw]
    assert numbers == [number % 256 for number in range(len(numbers))]
    assert line.said == ["disarmed, loiter"]


@pytest.mark.parametrize("share", [0.01, 0.3])
def test_packets_are_lost_both_ways(share: float) -> None:
    line = Line(drop=share)
    line.wait(20)
    for _ in range(500):
        line.send(common.MAVLink_timesync_message(0, 1))
    line.wait(100)
    answered = sum(message.tc1 != 0 for message in line.of("TIMESYNC")) / 500
    assert answered == pytest.approx((1.0 - share) ** 2, abs=0.06)


def test_packets_come_twice_and_out_of_order() -> None:
    line = Line(duplicate=0.2, reorder=0.2)
    line.wait(4000)
    numbers = [packet[4] for packet in line.raw]
    assert max(Counter(line.raw).values()) == 2
    steps = [(b - a) % 256 for a, b in pairwise(numbers)]
    assert any(step > 128 for step in steps)


def test_packets_are_late() -> None:
    line = Line(delay_ms=20.0)
    line.send(common.MAVLink_timesync_message(0, 1))
    line.wait(36)
    assert not [message for message in line.of("TIMESYNC") if message.tc1]
    line.wait(8)
    assert [message for message in line.of("TIMESYNC") if message.tc1]


def test_silence_both_ways_for_a_while() -> None:
    line = Line(freeze_s=1.0, freeze_ms=500.0)
    line.arm()
    line.wait(1000)
    line.raw.clear()
    line.wait(400)
    assert not line.raw
    line.wait(200)
    assert line.raw


def test_heartbeats_stop_and_nothing_else() -> None:
    line = Line(mute_heartbeat_s=1.0)
    line.arm()
    line.wait(1100)
    line.heard.clear()
    line.wait(3000)
    assert not line.of("HEARTBEAT")
    assert line.of("ATTITUDE")


def test_there_is_no_heartbeat_at_all() -> None:
    line = Line(mute_heartbeat_s=0.0)
    line.wait(3000)
    assert not line.of("HEARTBEAT")
    assert line.of("ATTITUDE")


def test_another_systems_heartbeats_come_in_between() -> None:
    line = Line(foreign_system=42)
    line.wait(3000)
    assert {message.get_srcSystem() for message in line.of("HEARTBEAT")} == {1, 42}


def test_the_first_acknowledgement_of_a_command_is_lost() -> None:
    line = Line(lose_ack=512)
    assert line.command(512, VERSION) == []
    assert line.of("AUTOPILOT_VERSION"), "it was done"
    assert line.command(512, VERSION) == [0]


def test_a_command_is_rejected_over_a_reboot() -> None:
    line = Line(reject=ARM)
    line.wait(100)
    assert line.command(ARM, 1, 21196) == [2]
    assert line.command(246, 1) == [0]
    line.wait(300)
    assert line.command(ARM, 1, 21196) == [2]


def test_a_command_is_temporarily_rejected_once() -> None:
    line = Line(busy=512)
    assert [line.command(512, VERSION) for _ in range(2)] == [[1], [0]]


def test_a_command_is_in_progress_before_it_is_done() -> None:
    line = Line(slow=512)
    assert line.command(512, VERSION) == [5]
    line.wait(900)
    assert not line.of("AUTOPILOT_VERSION")
    line.wait(100)
    assert line.of("AUTOPILOT_VERSION")
    assert [ack.result for ack in line.of("COMMAND_ACK")] == [5, 0]


def test_parameters_are_wrong() -> None:
    line = Line(wrong="COM_OBL_RC_ACT:0,COM_OF_LOSS_T:3.5")
    assert line.bench.vehicle.parameters["COM_OBL_RC_ACT"] == 0
    assert line.bench.vehicle.parameters["COM_OF_LOSS_T"] == 3.5


def test_a_parameter_does_not_hold_though_it_says_so() -> None:
    line = Line(stuck="COM_OF_LOSS_T")
    line.send(common.MAVLink_param_set_message(1, 1, b"COM_OF_LOSS_T", 0.75, 9))
    line.send(common.MAVLink_param_request_read_message(1, 1, b"COM_OF_LOSS_T", -1))
    line.wait(20)
    assert [value.param_value for value in line.of("PARAM_VALUE")] == [0.75, 0.5]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"wrong": "NO_SUCH:1"}, "no parameter 'NO_SUCH'"),
        ({"wrong": "COM_OF_LOSS_T"}, "not NAME:VALUE"),
        ({"wrong": "COM_OF_LOSS_T:x"}, "not NAME:VALUE"),
        ({"stuck": "NO_SUCH"}, "no parameter 'NO_SUCH'"),
        ({"pilot_act": "sleep"}, "a pilot of px4 can do disarm, manual"),
    ],
)
def test_faults_that_cannot_be(options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Line(**options)


def test_it_reboots_in_flight() -> None:
    line = Line(reboot_s=0.5)
    line.arm()
    line.wait(600)
    assert "rebooted by itself" in line.said
    assert not line.pilot.armed
    assert line.pilot.age_s < 0.3


@pytest.mark.parametrize(("act", "armed", "mode"), [("posctl", True, 3 << 16), ("disarm", False, 4 << 16 | 3 << 24)])
def test_the_pilot_acts(act: str, armed: bool, mode: int) -> None:
    line = Line(pilot_s=0.5, pilot_act=act)
    line.arm()
    line.wait(600)
    assert (line.pilot.armed, line.pilot.mode) == (armed, mode)
    assert f"the pilot: {act}" in line.said


def test_power_is_lost() -> None:
    line = Line(die_s=0.5)
    line.arm()
    line.wait(600)
    line.raw.clear()
    line.wait(2000)
    assert not line.raw
    assert "all power lost" in line.said


def test_the_cell_is_nearly_empty() -> None:
    line = Line(low_battery_s=0.5)
    line.arm()
    line.wait(1500)
    assert line.of("SYS_STATUS")[-1].battery_remaining == 0
    assert "cell nearly empty" in line.said


def test_forged_packets_come_in_its_name_from_the_future() -> None:
    line = Line(key=KEY, forge_s=0.2)
    line.arm()
    line.raw.clear()
    line.wait(1500)
    stamps = [int.from_bytes(packet[-12:-6], "little") for packet in line.raw]
    assert max(stamps) - min(stamps) > 10**11
    believed = common.MAVLink(None)
    believed.signing.secret_key = KEY
    forged = max(line.raw, key=lambda packet: int.from_bytes(packet[-12:-6], "little"))
    with pytest.raises(common.MAVError):
        believed.decode(bytearray(forged))


def test_old_packets_come_again() -> None:
    line = Line(key=KEY, replay_s=0.2)
    line.arm()
    line.wait(1500)
    assert max(Counter(line.raw).values()) >= 2


def frames(line: Line, ms: float) -> list[Any]:
    """What motion capture publishes at 100 Hz."""
    seen = []
    for _ in range(round(ms / 20.0)):
        line.wait(20)
        data = line.bench.pose(line.now_ns)
        seen.append(None if data is None else decode(data))
    return seen


def test_motion_capture_freezes_and_goes_on() -> None:
    """It moves at 1 m/s; frames go on while the pose stands."""
    view = MocapView(MavlinkOptions(mocap_freeze_s=0.2, mocap_fault_ms=300.0, noise_mm=0.001), "body", 0)
    seen = []
    for n in range(10):
        state = State((0.1 * n, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
        data = view.frame(state, n, n, since_s=0.1 * n)
        assert data is not None
        seen.append(decode(data).position[0])
    assert seen == pytest.approx([0.0, 0.1, 0.2, 0.2, 0.2, 0.5, 0.6, 0.7, 0.8, 0.9], abs=1e-3)


def test_motion_capture_has_a_gap() -> None:
    line = Line(mocap_gap_s=0.2, mocap_fault_ms=300.0)
    line.arm()
    seen = frames(line, 1000)
    assert 12 <= sum(frame is None for frame in seen) <= 17
    assert seen[-1] is not None


def test_motion_capture_may_point_elsewhere() -> None:
    """Its x is true north: what it calls (1, 2) lies 2 m west and 1 m north."""
    line = Line(place=(1.0, 2.0, 0.0), mocap_yaw_deg=90.0)
    assert line.bench.vehicle.body.state.p_WB == pytest.approx((-2.0, 1.0, 0.0))
    assert yaw_of(line.bench.vehicle.body.state.q_WB) == pytest.approx(math.pi / 2)
    (frame,) = frames(line, 20)
    assert frame.position == pytest.approx((1.0, 2.0, 0.0), abs=0.005)
    assert abs(frame.quaternion[3]) == pytest.approx(1.0, abs=1e-3)


def test_velocities_are_turned_too_and_body_rates_are_not() -> None:
    view = MocapView(MavlinkOptions(mocap_yaw_deg=90.0), "body", 0)
    seen = view.seen(State((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), (4.0, 5.0, 6.0)))
    assert seen.v_WB_W == pytest.approx((2.0, -1.0, 3.0))
    assert seen.w_WB_B == (4.0, 5.0, 6.0)


def test_a_crash_is_told() -> None:
    line = Line(flavour="ardupilot")
    line.arm()
    line.bench.vehicle.body.broken = True
    line.wait(100)
    assert line.said[-1] == "hit the floor, tilted by 0 deg"


def test_what_is_under_way_is_bounded() -> None:
    way = Way(MavlinkOptions(delay_ms=1000.0), 0)
    for number in range(MOST_UNDER_WAY + 100):
        way.send(number.to_bytes(4, "little"), 0, None)
    arrived = 0
    while way.arrived(2_000_000_000) is not None:
        arrived += 1
    assert arrived == MOST_UNDER_WAY
