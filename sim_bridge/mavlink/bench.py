"""A vehicle behind its radio, with the faults that were asked for. No I/O: datagrams and time in, datagrams out."""

from __future__ import annotations

import math
from collections.abc import Callable

from lcd_flight.model import InputError, LinkContext
from lcd_flight.model.frames import tilt_of
from sim_bridge.mavlink.faults import Timed, kind_of
from sim_bridge.mavlink.intruder import Intruder
from sim_bridge.mavlink.mocap_view import MocapView
from sim_bridge.mavlink.options import MavlinkOptions
from sim_bridge.mavlink.radio import Way
from sim_bridge.mavlink.vehicle import SimulatedMavlink

LOW_V = 3.0
"""A cell that is nearly empty."""
HEARTBEAT, COMMAND_ACK = 0, 77


class Bench:
    """What a server serves.

    Raises:
        InputError: an option names a parameter or a mode that there is not.
    """

    def __init__(self, options: MavlinkOptions, context: LinkContext, key: bytes | None, unix_ns_at_zero: int) -> None:
        self._options = options
        self.view = MocapView(options, context.rigid_body, context.seed)
        self.vehicle = SimulatedMavlink(
            context.vehicle,
            options,
            position_m=self.view.true_place(context.initial_position_m),
            yaw_rad=context.initial_yaw_rad + math.radians(options.mocap_yaw_deg),
            seed=context.seed,
            key=key,
            unix_ns_at_zero=unix_ns_at_zero,
        )
        if options.pilot_act not in (*self.vehicle.firmware.pilot.modes, "disarm"):
            modes = ", ".join(self.vehicle.firmware.pilot.modes)
            raise InputError(f"pilot_act={options.pilot_act}: a pilot of {options.flavour} can do disarm, {modes}")
        self._up, self._down = Way(options, 2 * context.seed), Way(options, 2 * context.seed + 1)
        self._intruder = Intruder(options.system, options.foreign_system)
        self._began_ns: int | None = None
        self._lost_ack = False
        self._told = ""
        self._said: list[str] = []
        self._events = self._planned()

    def switch_on(self, now_ns: int) -> None:
        """Begin to live at `now_ns`."""
        self.vehicle.switch_on(now_ns)

    def receive(self, datagram: bytes, now_ns: int) -> None:
        """The client sends a datagram."""
        self._up.send(datagram, now_ns, self._began_ns)
        self.advance_to(now_ns)

    def advance_to(self, now_ns: int) -> None:
        """Live until `now_ns`."""
        while (arrived := self._up.arrived(now_ns)) is not None:
            due_ns, datagram = arrived
            self.vehicle.receive(datagram, due_ns)
            self._send(due_ns)
        self.vehicle.advance_to(now_ns)
        self._send(now_ns)
        self._live(now_ns)

    def outgoing(self, now_ns: int) -> list[bytes]:
        """What reaches the client by `now_ns`."""
        arrived = []
        while (datagram := self._down.arrived(now_ns)) is not None:
            arrived.append(datagram[1])
        return arrived

    def pose(self, now_ns: int) -> bytes | None:
        """What motion capture publishes now; None: nothing."""
        return self.view.frame(self.vehicle.body.state, self.vehicle.state_ns, now_ns, self.since_s(now_ns))

    def said(self) -> list[str]:
        """What a person at the bench sees happen, since the last time it was asked."""
        said, self._said = self._said, []
        return said

    def since_s(self, now_ns: int) -> float | None:
        """Since it was first armed; None: it was not yet."""
        return None if self._began_ns is None else (now_ns - self._began_ns) / 1e9

    def act_as_pilot(self, act: str) -> None:
        """The pilot takes over: a mode by its name, or `disarm`."""
        pilot = self.vehicle.firmware.pilot
        if act == "disarm":
            pilot.request_arm(False, True)
        else:
            pilot.request_mode(pilot.modes[act])
        self._said.append(f"the pilot: {act}")

    def _planned(self) -> list[Timed]:
        o, vehicle = self._options, self.vehicle
        plan: list[tuple[float | None, str, Callable[[], None]]] = [
            (o.die_s, "all power lost", vehicle.die),
            (o.reboot_s, "rebooted by itself", vehicle.reboot),
            (o.low_battery_s, "cell nearly empty", lambda: vehicle.body.set_battery(LOW_V)),
            (o.pilot_s, "", lambda: self.act_as_pilot(o.pilot_act)),
        ]
        return [Timed(at_s, text, act) for at_s, text, act in plan if at_s is not None]

    def _send(self, now_ns: int) -> None:
        for datagram in self.vehicle.outgoing():
            if not self._swallowed(datagram, now_ns):
                self._intruder.overhear(datagram)
                self._down.send(datagram, now_ns, self._began_ns)

    def _swallowed(self, datagram: bytes, now_ns: int) -> bool:
        """Whether this one packet is lost on purpose."""
        kind = kind_of(datagram)
        if kind == HEARTBEAT:
            return self._is_on(self._options.mute_heartbeat_s, now_ns)
        wanted = self._options.lose_ack
        if kind == COMMAND_ACK and wanted and not self._lost_ack and datagram[10:12] == wanted.to_bytes(2, "little"):
            self._lost_ack = True
            return True
        return False

    def _live(self, now_ns: int) -> None:
        """What happens to a vehicle from outside."""
        if self._began_ns is None and self.vehicle.firmware.pilot.armed:
            self._began_ns = now_ns
        since_s = self.since_s(now_ns)
        for event in [event for event in self._events if since_s is not None and since_s >= event.at_s]:
            self._events.remove(event)
            event.act()
            if event.text:
                self._said.append(event.text)
        forges, replays = (self._is_on(at_s, now_ns) for at_s in (self._options.forge_s, self._options.replay_s))
        for datagram in self._intruder.sends(now_ns, self.vehicle.ticks, forges=forges, replays=replays):
            self._down.send(datagram, now_ns, self._began_ns)
        self._tell()

    def _is_on(self, at_s: float | None, now_ns: int) -> bool:
        """Whether a fault that lasts has begun; one at 0 has from the start."""
        since_s = self.since_s(now_ns)
        return at_s == 0.0 or (at_s is not None and since_s is not None and since_s >= at_s)

    def _tell(self) -> None:
        """Armed or not, and in which mode, where it is another than what was told last."""
        pilot, body = self.vehicle.firmware.pilot, self.vehicle.body
        names = {number: name for name, number in pilot.modes.items()}
        state = f"{'armed' if pilot.armed else 'disarmed'}, {names.get(pilot.mode, pilot.mode)}"
        if body.broken:
            state = f"hit the floor, tilted by {math.degrees(tilt_of(body.state.q_WB)):.0f} deg"
        if state != self._told:
            self._told = state
            self._said.append(state)
