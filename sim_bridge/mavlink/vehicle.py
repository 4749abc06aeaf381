"""A simulated MAVLink vehicle without I/O: datagrams and time in, datagrams out."""

from __future__ import annotations

from typing import Any

from lcd_flight.model import State, Vector3, Vehicle
from lcd_flight.model.frames import from_yaw
from sim_bridge.mavlink.ardupilot import ArduPilot
from sim_bridge.mavlink.body import PERIOD_NS, Body
from sim_bridge.mavlink.codec import Codec
from sim_bridge.mavlink.command_service import Reluctance
from sim_bridge.mavlink.estimator import SeenPose
from sim_bridge.mavlink.firmware import Firmware
from sim_bridge.mavlink.frames import ned_attitude, swapped
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.signing import EPOCH_2015_S, Signatures
from sim_bridge.mavlink.variants import boot, parameters_of

MOST_OUTGOING = 10_000
"""Datagrams that wait to be fetched; more are lost."""
FED_EVERY = 5
"""Periods: its own motion capture at 50 Hz."""
SOME_DAY_S = 1_767_225_600
"""2026-01-01: the date at time 0 where none is given."""
_NS_PER_S = 1_000_000_000
_NS_PER_TICK = 10_000


class SimulatedMavlink:
    """One vehicle on the floor; it is switched on at `switch_on` and again after each reboot."""

    def __init__(
        self,
        vehicle: Vehicle,
        options: MavlinkOptions,
        *,
        position_m: Vector3 = (0.0, 0.0, 0.0),
        yaw_rad: float = 0.0,
        seed: int = 0,
        key: bytes | None = None,
        unix_ns_at_zero: int = SOME_DAY_S * _NS_PER_S,
    ) -> None:
        rest = (0.0, 0.0, 0.0)
        standing = State(p_WB=position_m, v_WB_W=rest, q_WB=from_yaw(yaw_rad), w_WB_B=rest)
        self.options = options
        self.parameters = parameters_of(options)
        self.body = Body(vehicle, standing, seed, options.battery_V)
        self._unix_ns_at_zero = unix_ns_at_zero
        self._codec = Codec(options.system, 1, Signatures(key, options.unsigned))
        self._time_ns = self._periods = 0
        self._outgoing: list[bytes] = []
        self._reluctance = Reluctance(options.reject, options.busy, options.slow)
        self.firmware = self._booted()
        self.alive = True
        """Whether there is any power; without, nothing runs and nothing is heard of it."""

    @property
    def state_ns(self) -> int:
        """When `body.state` was true: it lives in whole periods."""
        return self._time_ns

    def switch_on(self, now_ns: int) -> None:
        """Begin to live at `now_ns`."""
        self._time_ns = now_ns
        self.reboot()

    def receive(self, datagram: bytes, now_ns: int) -> None:
        """A datagram arrives; what it is answered is in `outgoing`."""
        self.advance_to(now_ns)
        if not self.alive:
            return
        for heard in self._codec.decode(datagram, self.ticks):
            self.firmware.take(heard)
            self._say(self.firmware.answers())
            self._change_key()

    def advance_to(self, now_ns: int) -> None:
        """Live until `now_ns`, less what is no whole period."""
        while now_ns - self._time_ns >= PERIOD_NS:
            self._time_ns += PERIOD_NS
            self._periods += 1
            if not self.alive:
                self.body.advance()
                continue
            if self.options.own_mocap and self._periods % FED_EVERY == 0:
                self._show()
            self._say(self.firmware.step(self._time_ns))
            if self.firmware.reboot_ns is not None and self._time_ns >= self.firmware.reboot_ns:
                self.reboot()

    def outgoing(self) -> list[bytes]:
        """What it has sent since the last time it was asked."""
        sent, self._outgoing = self._outgoing, []
        return sent

    def die(self) -> None:
        """Lose all power."""
        self.alive = False
        self.body.command((0.0, 0.0, 0.0, 0.0))

    def reboot(self) -> None:
        """Begin anew: motors off, all forgotten but parameters and the key."""
        self.body.command((0.0, 0.0, 0.0, 0.0))
        self.firmware = self._booted()

    def seen(self) -> SeenPose:
        """Its true pose in NED, as its own motion capture tells it."""
        state = self.body.state
        return SeenPose(swapped(state.p_WB), ned_attitude(state.q_WB), None, 0)

    def _show(self) -> None:
        """Its own motion capture tells it where it is; an origin comes first, where one is needed."""
        pilot = self.firmware.pilot
        if isinstance(pilot, ArduPilot) and pilot.origin is None:
            pilot.set_origin(0, 0, 0)
        pilot.feed(self.seen())

    def _booted(self) -> Firmware:
        pilot = boot(self.options, self.body, self.parameters, self._time_ns)
        return Firmware(
            pilot,
            self.parameters,
            self._unix_ns,
            system=self.options.system,
            param_error=self.options.param_error,
            reluctance=self._reluctance,
        )

    def _change_key(self) -> None:
        """SETUP_SIGNING came: all zeros remove the key."""
        key, self.firmware.key = self.firmware.key, None
        if key is not None:
            self._codec.signatures.key = key if any(key) else None

    def _say(self, messages: list[Any]) -> None:
        for message in messages:
            if len(self._outgoing) < MOST_OUTGOING:
                self._outgoing.append(self._codec.encode(message, self.ticks))

    def _unix_ns(self, now_ns: int) -> int:
        return self._unix_ns_at_zero + now_ns

    @property
    def ticks(self) -> int:
        """10 us since 2015."""
        return (self._unix_ns(self._time_ns) - EPOCH_2015_S * _NS_PER_S) // _NS_PER_TICK
