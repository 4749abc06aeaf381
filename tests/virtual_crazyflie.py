"""A simulated Crazyflie and its client in virtual time: bytes to and fro, no sockets."""

from __future__ import annotations

import struct
from typing import Any

from lcd_flight.model import Quaternion, State, Vector3
from lcd_flight.worlds import load_vehicle
from sim_bridge.crazyflie.supervisor import State as Supervision
from sim_bridge.crazyflie.variants import variant
from sim_bridge.crazyflie.vehicle import SimulatedCrazyflie

HOVER = 38_842
"""Counts that carry a Crazyflie 2.1 with 2.1+ propellers, by crazyflie-firmware's figures."""
CAN_ARM, ARMED, AUTO_ARM, CAN_FLY, FLYING, TUMBLED, LOCKED, CRASHED = (1 << bit for bit in range(8))
MS = 1_000_000


class Client:
    """Sends packets to one vehicle and lets time pass."""

    def __init__(self, platform: str = "2.1", firmware: str = "2026.08", **options: Any) -> None:
        self.vehicle = SimulatedCrazyflie(load_vehicle("crazyflie-2.1"), variant(platform, firmware), **options)
        self.now_ns = 0
        self.text = ""
        """What came over the console."""

    @property
    def state(self) -> State:
        """Where it truly is."""
        return self.vehicle.body.state

    @property
    def height_m(self) -> float:
        """Above the floor."""
        return self.state.p_WB[2]

    @property
    def info(self) -> int:
        """The supervisor's bit field, asked for over the radio."""
        (answer,) = self.ask("90 0C")
        return int.from_bytes(answer[2:4], "little")

    @property
    def supervision(self) -> Supervision:
        """The supervisor's state."""
        return self.vehicle.firmware.supervisor.state

    def ask(self, packet: str | bytes) -> list[bytes]:
        """Send one packet, as bytes or in hexadecimal; what comes back at once."""
        self.vehicle.receive(bytes.fromhex(packet) if isinstance(packet, str) else packet, self.now_ns)
        return self._heard()

    def wait(self, duration_ms: float) -> list[bytes]:
        """Let time pass; what the vehicle sends in it."""
        self.now_ns += round(duration_ms * MS)
        self.vehicle.advance_to(self.now_ns)
        return self._heard()

    def fly(self, duration_ms: float, thrust: int, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
        """Stream a setpoint at 100 Hz; the fields are cflib's, which negates the pitch on the wire."""
        for _ in range(round(duration_ms / 10.0)):
            self.ask(rpyt(thrust, roll, pitch, yaw))
            self.wait(10.0)

    def unlock(self) -> None:
        """Let it boot and take thrust."""
        self.wait(200.0)
        self.ask(rpyt(0))

    def take_off(self, duration_ms: float = 500.0, thrust: int = 45_000) -> None:
        """Up, and then a moment of hover; about half a metre."""
        self.unlock()
        self.fly(duration_ms, thrust)
        self.fly(100.0, HOVER)

    def set(self, name: str, value: float) -> None:
        """Write a parameter."""
        index, kind = self.parameter(name)
        (echo,) = self.ask(b"\x2e" + struct.pack("<H", index) + struct.pack(kind, value))
        assert echo[:3] == b"\x2e" + struct.pack("<H", index)

    def get(self, name: str) -> float:
        """Read a parameter."""
        index, kind = self.parameter(name)
        (answer,) = self.ask(b"\x2d" + struct.pack("<H", index))
        value: float = struct.unpack(kind, answer[4:])[0]
        return value

    def parameter(self, name: str) -> tuple[int, str]:
        """Number and `struct` format of a parameter, by the table of contents."""
        for index in range(1000):
            (answer,) = self.ask(b"\x2c\x02" + struct.pack("<H", index))
            assert len(answer) > 2, f"no parameter {name}"
            group, variable, _ = answer[5:].split(b"\0")
            if f"{group.decode()}.{variable.decode()}" == name:
                kinds = {0: "<b", 1: "<h", 2: "<i", 6: "<f", 8: "<B", 9: "<H", 10: "<I"}
                return index, kinds[answer[4] & 0x0F]
        raise AssertionError(name)

    def show(self, p_WB: Vector3, q_WB: Quaternion = (0.0, 0.0, 0.0, 1.0)) -> None:
        """Send a pose, as motion capture would have it."""
        self.ask(b"\x6d\x08" + struct.pack("<7f", *p_WB, *q_WB))

    def _heard(self) -> list[bytes]:
        heard = self.vehicle.outgoing()
        self.text += b"".join(packet[1:] for packet in heard if packet[0] == 0x0C).decode()
        return [packet for packet in heard if packet[0] != 0x0C]


def rpyt(thrust: int, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> bytes:
    """A setpoint as cflib's `send_setpoint` sends it."""
    return b"\x3c" + struct.pack("<fffH", roll, -pitch, yaw, thrust)


STOP = bytes.fromhex("7C 00")
NOTIFY = bytes.fromhex("7D 00 00 00 00 00")
