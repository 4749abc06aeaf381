"""A simulated Crazyflie without I/O: datagrams and time in, datagrams out."""

from __future__ import annotations

from lcd_flight.model import State, Vector3, Vehicle
from lcd_flight.model.frames import from_yaw
from sim_bridge.crazyflie.body import PERIOD_NS, Body
from sim_bridge.crazyflie.crtp import Packet, Port, decode, encode
from sim_bridge.crazyflie.firmware import Firmware
from sim_bridge.crazyflie.parameter_table import parameter_table
from sim_bridge.crazyflie.parameters import Parameters
from sim_bridge.crazyflie.variants import Variant

_NULL_CHANNEL = 3
_POWER = 0xFE
_ALL_OFF, _OFF, _ON, _RESET = 0x01, 0x02, 0x03, 0xF0
_TO_FIRMWARE = 1
"""Commands to the radio's own processor, which powers the other one (cflib, utils/power_switch.py)."""


class SimulatedCrazyflie:
    """One vehicle on the floor; it is switched on at `switch_on` and again after each reboot."""

    def __init__(
        self,
        vehicle: Vehicle,
        variant: Variant,
        *,
        position_m: Vector3 = (0.0, 0.0, 0.0),
        yaw_rad: float = 0.0,
        seed: int = 0,
        battery_V: float | None = None,
    ) -> None:
        rest = (0.0, 0.0, 0.0)
        standing = State(p_WB=position_m, v_WB_W=rest, q_WB=from_yaw(yaw_rad), w_WB_B=rest)
        self._variant = variant
        self._parameters = Parameters(parameter_table())
        self._time_ns = 0
        self._outgoing: list[bytes] = []
        self._on = True
        self.body = Body(vehicle, variant, standing, seed, battery_V)
        self.firmware = Firmware(self.body, variant, self._parameters)
        self.alive = True
        """Whether there is any power; without, nothing runs and nothing is heard of it."""

    @property
    def state_ns(self) -> int:
        """When `body.state` was true: it lives in whole periods."""
        return self._time_ns

    def switch_on(self, now_ns: int) -> None:
        """Begin to live at `now_ns`."""
        self._time_ns = now_ns

    def receive(self, datagram: bytes, now_ns: int) -> None:
        """A datagram arrives; what it is answered is in `outgoing`."""
        self.advance_to(now_ns)
        packet = decode(datagram)
        if packet is None or not self.alive:
            return
        if packet.port == Port.LINK and packet.channel == _NULL_CHANNEL and packet.payload[:1] == bytes((_POWER,)):
            self._switch(packet.payload[1:])
            self._say([packet])
        elif self._on:
            self._say(self.firmware.take(packet))

    def advance_to(self, now_ns: int) -> None:
        """Live until `now_ns`, less what is no whole period."""
        while now_ns - self._time_ns >= PERIOD_NS:
            self._time_ns += PERIOD_NS
            if self._on:
                self._say(self.firmware.step())
                if self.firmware.shut_down:
                    self._cut()
            else:
                self.body.advance()

    def outgoing(self) -> list[bytes]:
        """What it has sent since the last time it was asked."""
        sent, self._outgoing = self._outgoing, []
        return sent

    def die(self) -> None:
        """Lose all power."""
        self.alive = False
        self._cut()

    def reboot(self) -> None:
        """Begin anew: what was locked is not any more."""
        self._cut()
        self._parameters.reboot()
        self.firmware = Firmware(self.body, self._variant, self._parameters)
        self._on = self.alive

    def _switch(self, command: bytes) -> None:
        """The boot loader is as silent as a vehicle that is off."""
        if command[:2] == bytes((_RESET, _TO_FIRMWARE)) or (command[:1] == bytes((_ON,)) and not self._on):
            self.reboot()
        elif command[:1] in (bytes((_OFF,)), bytes((_ALL_OFF,)), bytes((_RESET,))):
            self._cut()

    def _cut(self) -> None:
        self._on = False
        self.body.command(0.0, (0.0, 0.0, 0.0))

    def _say(self, packets: list[Packet]) -> None:
        self._outgoing.extend(map(encode, packets))
