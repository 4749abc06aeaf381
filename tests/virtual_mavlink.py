"""A simulated MAVLink vehicle and its client in virtual time: packets to and fro, no sockets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import msgspec
from pymavlink.dialects.v20 import ardupilotmega as dialect

from lcd_flight.model import State
from lcd_flight.worlds import load_vehicle
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.vehicle import SimulatedMavlink

MS = 1_000_000
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
ARM, SET_MODE, INTERVAL, REQUEST, REBOOT, LAND_HERE = 400, 176, 511, 512, 246, 21
PX4_OFFBOARD, PX4_LOITER, PX4_LAND, PX4_POSCTL, PX4_ALTCTL = (
    6 << 16,
    4 << 16 | 3 << 24,
    4 << 16 | 6 << 24,
    3 << 16,
    2 << 16,
)
GUIDED, GUIDED_NOGPS, LAND, STABILIZE = 4, 20, 9, 0
HOVER = {"px4": 0.5, "ardupilot": 0.369}
Quaternion = tuple[float, float, float, float]
"""w, x, y, z: FRD in NED."""


class Client:
    """Sends messages to one vehicle and lets time pass. It boots at once, unless told otherwise."""

    def __init__(self, flavour: str = "px4", *, seed: int = 0, yaw_rad: float = math.pi / 2, **options: Any) -> None:
        chosen = {"boot_s": 0.0, "own_mocap": True, **options}
        self.flavour = flavour
        self.vehicle = SimulatedMavlink(
            load_vehicle("hummingbird"),
            MavlinkOptions(flavour=flavour, **chosen),  # type: ignore[arg-type]
            seed=seed,
            yaw_rad=yaw_rad,
        )
        self.now_ns = 0
        self.heard: list[Any] = []
        """All that was heard since `forget`."""
        self._out = dialect.MAVLink(None, srcSystem=245, srcComponent=191)
        self._in = dialect.MAVLink(None)

    @property
    def state(self) -> State:
        """Where it truly is, ENU."""
        return self.vehicle.body.state

    @property
    def pilot(self) -> Any:
        """The autopilot inside."""
        return self.vehicle.firmware.pilot

    @property
    def texts(self) -> list[str]:
        """STATUSTEXTs, their pieces put together."""
        texts: list[str] = []
        for message in self.of("STATUSTEXT"):
            if message.chunk_seq:
                texts[-1] += message.text
            else:
                texts.append(message.text)
        return texts

    def go_blind(self) -> None:
        """Its own motion capture stops."""
        self.vehicle.options = msgspec.structs.replace(self.vehicle.options, own_mocap=False)

    def of(self, kind: str) -> list[Any]:
        """Messages of a kind that were heard."""
        return [message for message in self.heard if message.get_type() == kind]

    def forget(self) -> None:
        """Begin to listen anew."""
        self.heard.clear()

    def send(self, message: Any) -> None:
        """One packet."""
        packet = message.pack(self._out)
        self._out.seq = (self._out.seq + 1) % 256
        self.vehicle.receive(packet, self.now_ns)
        self._hear()

    def wait(self, duration_ms: float) -> None:
        """Let time pass."""
        self.now_ns += round(duration_ms * MS)
        self.vehicle.advance_to(self.now_ns)
        self._hear()

    def command(self, command: int, *params: float, system: int = 1, component: int = 1) -> int | None:
        """COMMAND_LONG; the result that comes within 10 ms, None: none."""
        seven = [*params, *(0.0,) * (7 - len(params))]
        before = len(self.of("COMMAND_ACK"))
        self.send(dialect.MAVLink_command_long_message(system, component, command, 0, *seven))
        self.wait(10)
        answers = self.of("COMMAND_ACK")[before:]
        return answers[0].result if answers else None

    def mode(self, number: int) -> int | None:
        """DO_SET_MODE."""
        if self.flavour == "px4":
            return self.command(SET_MODE, 1, number >> 16 & 0xFF, number >> 24)
        return self.command(SET_MODE, 1, number)

    def target(self, thrust: float, q: Sequence[float] | None = None, mask: int = 7) -> None:
        """One SET_ATTITUDE_TARGET; level and north where nothing else is said."""
        told = [1.0, 0.0, 0.0, 0.0] if q is None else list(q)
        self.send(dialect.MAVLink_set_attitude_target_message(0, 1, 1, mask, told, 0.0, 0.0, 0.0, thrust))

    def fly(self, duration_ms: float, thrust: float, q: Sequence[float] | None = None) -> None:
        """Stream one at 50 Hz."""
        for _ in range(round(duration_ms / 20.0)):
            self.target(thrust, q)
            self.wait(20.0)

    def see(self, p: Sequence[float], q: Quaternion = (1.0, 0.0, 0.0, 0.0), **more: Any) -> None:
        """One ODOMETRY in LOCAL_FRD and BODY_FRD from vision, or as said otherwise."""
        told = {"frame": 20, "child": 12, "resets": 0, "kind": 2, "quality": 100, "v": (math.nan,) * 3, **more}
        unknown = [math.nan] + [0.0] * 20
        twist = (*told["v"], 0.0, 0.0, 0.0)
        about = (told["resets"], told["kind"], told["quality"])
        stamp_us = self.now_ns // 1000
        self.send(
            dialect.MAVLink_odometry_message(
                stamp_us, told["frame"], told["child"], *p, list(q), *twist, unknown, unknown, *about
            )
        )

    def watch(
        self, duration_ms: float, p: Sequence[float] = (0.0, 0.0, 0.0), rate_hz: float = 50.0, **more: Any
    ) -> None:
        """Stream the same ODOMETRY."""
        for _ in range(round(duration_ms * rate_hz / 1000.0)):
            self.see(p, **more)
            self.wait(1000.0 / rate_hz)

    def read(self, name: str, index: int = -1) -> Any | None:
        """PARAM_REQUEST_READ; the PARAM_VALUE that comes within 150 ms, None: none."""
        before = len(self.of("PARAM_VALUE"))
        self.send(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), index))
        self.wait(150)
        answers = self.of("PARAM_VALUE")[before:]
        return answers[0] if answers else None

    def write(self, name: str, value: float, kind: int) -> Any | None:
        """PARAM_SET; the PARAM_VALUE that comes within 30 ms, None: none."""
        before = len(self.of("PARAM_VALUE"))
        self.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
        self.wait(30)
        answers = self.of("PARAM_VALUE")[before:]
        return answers[0] if answers else None

    def take_off(self, climb_ms: float = 500.0) -> None:
        """Arm in the mode that flies attitudes, and rise for a moment; about 0.7 m, then hover thrust."""
        hover = HOVER[self.flavour]
        if self.flavour == "px4":
            self.fly(1200, 0.0)
            assert self.mode(PX4_OFFBOARD) == ACCEPTED
            assert self.command(ARM, 1) == ACCEPTED
            self.fly(1000, 0.0)
        else:
            self.wait(20)
            assert self.mode(GUIDED_NOGPS) == ACCEPTED
            assert self.command(ARM, 1) == ACCEPTED
            self.fly(2500, 0.0)
        self.fly(climb_ms, 1.2 * hover)
        self.fly(600, hover)

    def _hear(self) -> None:
        self.heard.extend(self._in.decode(bytearray(packet)) for packet in self.vehicle.outgoing())


def turned(roll_deg: float = 0.0, pitch_deg: float = 0.0, yaw_deg: float = 0.0) -> Quaternion:
    """A turn about one axis of FRD, as SET_ATTITUDE_TARGET has it."""
    halves = [math.radians(0.5 * angle) for angle in (roll_deg, pitch_deg, yaw_deg)]
    assert sum(half != 0.0 for half in halves) <= 1
    x, y, z = map(math.sin, halves)
    return (math.cos(sum(halves)), x, y, z)
