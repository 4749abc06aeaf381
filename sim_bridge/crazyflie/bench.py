"""A vehicle behind its radio, with the faults that were asked for. No I/O: datagrams and time in, datagrams out."""

from __future__ import annotations

import math

from lcd_flight.model import LinkContext
from lcd_flight.model.frames import tilt_of
from sim_bridge.crazyflie.options import CrazyflieOptions
from sim_bridge.crazyflie.radio import Queue, Radio
from sim_bridge.crazyflie.supervisor import State
from sim_bridge.crazyflie.variants import variant
from sim_bridge.crazyflie.vehicle import SimulatedCrazyflie

_NS_PER_S = 1_000_000_000
_STATES = {
    State.READY_TO_FLY: "armed",
    State.FLYING: "flying",
    State.LANDED: "landed",
    State.LEVEL_OUT: "no setpoints: level, thrust kept",
    State.LOCKED: "locked until reboot",
    State.CRASHED: "crashed",
}


class Bench:
    """What a server serves.

    Raises:
        InputError: an unknown platform or firmware, or a vehicle without an onboard controller.
    """

    def __init__(self, options: CrazyflieOptions, context: LinkContext) -> None:
        self._options = options
        self.variant = variant(options.platform, options.firmware)
        self.vehicle = SimulatedCrazyflie(
            context.vehicle,
            self.variant,
            position_m=context.initial_position_m,
            yaw_rad=context.initial_yaw_rad,
            seed=context.seed,
            battery_V=options.battery_V,
        )
        self._radio = Radio(options, context.seed)
        self._up, self._down = Queue(), Queue()
        self._began_ns: int | None = None
        self._crashed_ns: int | None = None
        self._told: State | None = None
        self._said: list[str] = []

    def switch_on(self, now_ns: int) -> None:
        """Begin to live at `now_ns`."""
        self.vehicle.switch_on(now_ns)

    def receive(self, datagram: bytes, now_ns: int) -> None:
        """The client sends a datagram."""
        if self._radio.carries_up(now_ns, self._began_ns):
            self._up.push(self._radio.due_ns(now_ns), datagram)
        self.advance_to(now_ns)

    def advance_to(self, now_ns: int) -> None:
        """Live until `now_ns`."""
        while (arrived := self._up.pop(now_ns)) is not None:
            due_ns, datagram = arrived
            self.vehicle.receive(datagram, due_ns)
            self._send(due_ns)
        self.vehicle.advance_to(now_ns)
        self._send(now_ns)
        self._live(now_ns)

    def outgoing(self, now_ns: int) -> list[bytes]:
        """What reaches the client by `now_ns`."""
        arrived = []
        while (datagram := self._down.pop(now_ns)) is not None:
            arrived.append(datagram[1])
        return arrived

    def said(self) -> list[str]:
        """What a person at the bench sees happen, since the last time it was asked."""
        said, self._said = self._said, []
        return said

    def _send(self, now_ns: int) -> None:
        for datagram in self.vehicle.outgoing():
            if self._radio.carries_down(now_ns, self._began_ns):
                self._down.push(self._radio.due_ns(now_ns), datagram)

    def _live(self, now_ns: int) -> None:
        """What happens to a vehicle from outside: it dies, it is picked up."""
        if self._began_ns is None and self.vehicle.firmware.flies:
            self._began_ns = now_ns
        if self._is_due(self._began_ns, self._options.die_s, now_ns) and self.vehicle.alive:
            self.vehicle.die()
            self._said.append("all power lost")
        if not self.vehicle.body.broken:
            self._crashed_ns = None
        elif self._crashed_ns is None:
            self._crashed_ns = now_ns
            self._said.append(f"hit the floor, tilted by {math.degrees(tilt_of(self.vehicle.body.state.q_WB)):.0f} deg")
        elif self._is_due(self._crashed_ns, self._options.upright_s, now_ns):
            self.vehicle.body.put_upright()
            self._said.append("put upright")
        self._tell()

    def _tell(self) -> None:
        """The supervisor's state, where it is another than the last that was told: arming anew is no news."""
        state = self.vehicle.firmware.supervisor.state
        if state is not self._told and state in _STATES:
            self._told = state
            self._said.append(_STATES[state])

    @staticmethod
    def _is_due(since_ns: int | None, after_s: float | None, now_ns: int) -> bool:
        return since_ns is not None and after_s is not None and now_ns - since_ns >= after_s * _NS_PER_S
