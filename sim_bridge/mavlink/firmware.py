"""One boot of the autopilot: what it hears is done, what it says is due. Packets stay outside."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink import telemetry
from sim_bridge.mavlink.ardupilot import ArduPilot
from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.codec import Heard
from sim_bridge.mavlink.command_service import CommandService, Reluctance, acknowledgement
from sim_bridge.mavlink.parameter_service import ParameterService
from sim_bridge.mavlink.parameters import Parameters
from sim_bridge.mavlink.px4 import Px4
from sim_bridge.mavlink.vocabulary import Result

COMPONENT = common.MAV_COMP_ID_AUTOPILOT1
EVERYBODY = 0
MOST_WAITING = 500
"""Answers that are not sent yet; more are lost."""
REBOOT_NS = 100_000_000
"""Until a reboot begins."""
SHORTEST_NS, LONGEST_US = 1_000_000, 2.0**31 - 1.0
"""Between two messages of a kind; the longest is what MESSAGE_INTERVAL can say."""
LONGEST_TEXT = 50


class Firmware:
    """One boot: an autopilot, its streams and its services."""

    def __init__(
        self,
        pilot: Autopilot,
        parameters: Parameters,
        unix_ns: Callable[[int], int],
        *,
        system: int,
        param_error: bool,
        reluctance: Reluctance,
    ) -> None:
        """param_error: whether it has PARAM_ERROR."""
        self.pilot = pilot
        self._parameters = ParameterService(parameters, pilot, self._answer, param_error)
        self._commands = CommandService(self, self._answer, reluctance)
        self._system = system
        self._unix_ns = unix_ns
        px4 = isinstance(pilot, Px4)
        self._builders = dict(telemetry.PX4_BUILDERS if px4 else telemetry.ARDUPILOT_BUILDERS)
        self._builders[common.MAVLINK_MSG_ID_SYSTEM_TIME] = self._system_time
        self._rates = telemetry.PX4_RATES if px4 else telemetry.ARDUPILOT_RATES
        self._intervals = {kind: round(1e9 / rate) for kind, rate in self._rates.items()}
        self._due = dict.fromkeys(self._intervals, pilot.now_ns)
        self._later: list[tuple[int, int, Any]] = []
        self._numbers = itertools.count()
        self._texts = itertools.count(1)
        self.reboot_ns: int | None = None
        """When it is going to reboot."""
        self.key: bytes | None = None
        """A key that came in SETUP_SIGNING; all zeros remove the one there is."""
        self._acts: dict[int, Callable[[Heard], None]] = {
            common.MAVLINK_MSG_ID_COMMAND_LONG: self._commands.take_long,
            common.MAVLINK_MSG_ID_COMMAND_INT: self._commands.take_int,
            common.MAVLINK_MSG_ID_SET_MODE: self._set_mode,
            common.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._parameters.list_all,
            common.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._parameters.read,
            common.MAVLINK_MSG_ID_PARAM_SET: self._parameters.write,
            common.MAVLINK_MSG_ID_TIMESYNC: self._timesync,
            common.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: lambda heard: self.pilot.take_attitude(heard.message),
            common.MAVLINK_MSG_ID_ODOMETRY: lambda heard: self.pilot.take_odometry(heard.message),
            common.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE: lambda heard: self.pilot.take_vision(heard.message),
            common.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: self._set_origin,
            common.MAVLINK_MSG_ID_SETUP_SIGNING: self._setup_signing,
        }

    def take(self, heard: Heard) -> None:
        """A message for this vehicle, or for all of them."""
        message = heard.message
        system = getattr(message, "target_system", EVERYBODY)
        component = getattr(message, "target_component", EVERYBODY)
        act = self._acts.get(heard.kind)
        if act is not None and system in (EVERYBODY, self._system) and component in (EVERYBODY, COMPONENT):
            act(heard)

    def step(self, now_ns: int) -> list[Any]:
        """Live one period; the messages that go out."""
        self.pilot.step(now_ns)
        self._commands.finish(now_ns)
        due = [kind for kind, due_ns in self._due.items() if due_ns <= now_ns]
        for kind in due:
            self._due[kind] += self._intervals[kind] * (1 + (now_ns - self._due[kind]) // self._intervals[kind])
        messages = [self._builders[kind](self.pilot) for kind in due]
        told = [message for message in messages if message is not None]
        return [*told, *self._texted(), *self._waiting(now_ns), *self._parameters.listed()]

    def set_interval(self, kind: int, interval_us: float) -> bool:
        """0: as after a boot; negative: never."""
        if kind not in self._builders:
            return False
        self._due.pop(kind, None)
        if interval_us == 0.0 and kind in self._rates:
            interval_us = 1e6 / self._rates[kind]
        if interval_us > 0.0:
            self._intervals[kind] = max(SHORTEST_NS, round(min(interval_us, LONGEST_US) * 1e3))
            self._due[kind] = self.pilot.now_ns
        return True

    def send_once(self, kind: int) -> bool:
        """A message that has nothing to say is not sent; it is there all the same."""
        builder = self._builders.get(kind)
        if builder is None:
            return False
        message = builder(self.pilot)
        if message is not None:
            self._answer(message)
        return True

    def send_interval(self, kind: int) -> bool:
        """MESSAGE_INTERVAL; -1: not sent."""
        if kind not in self._builders:
            return False
        interval_us = self._intervals[kind] // 1000 if kind in self._due else -1
        self._answer(common.MAVLink_message_interval_message(kind, interval_us))
        return True

    def reboot_soon(self) -> None:
        """Once the acknowledgement is out."""
        self.reboot_ns = self.pilot.now_ns + REBOOT_NS

    def _answer(self, message: Any, after_ns: int = 0) -> None:
        if len(self._later) < MOST_WAITING:
            heapq.heappush(self._later, (self.pilot.now_ns + after_ns, next(self._numbers), message))

    def answers(self) -> list[Any]:
        """What is to be sent at once."""
        return self._waiting(self.pilot.now_ns)

    def _waiting(self, now_ns: int) -> list[Any]:
        ready = []
        while self._later and self._later[0][0] <= now_ns:
            ready.append(heapq.heappop(self._later)[2])
        return ready

    def _texted(self) -> list[Any]:
        """Texts that wait; long ones in pieces of 50 bytes with a number of their own."""
        said, self.pilot.said = self.pilot.said, []
        messages = []
        for severity, text in said:
            data = text.encode()
            number = next(self._texts) % 2**16 if len(data) > LONGEST_TEXT else 0
            for piece, start in enumerate(range(0, max(1, len(data)), LONGEST_TEXT)):
                part = data[start : start + LONGEST_TEXT]
                messages.append(common.MAVLink_statustext_message(severity, part, number, piece))
        return messages

    def _set_mode(self, heard: Heard) -> None:
        """The older way; not acknowledged by PX4, by ArduPilot with a COMMAND_ACK of message 11."""
        result = Result.DENIED
        if heard.message.base_mode & telemetry.CUSTOM:
            result = self.pilot.request_mode(heard.message.custom_mode)
        if isinstance(self.pilot, ArduPilot):
            kind = common.MAVLINK_MSG_ID_SET_MODE
            self._answer(acknowledgement(kind, result, heard.system, heard.component))

    def _timesync(self, heard: Heard) -> None:
        if heard.message.tc1 == 0:
            since_boot_ns = max(1, self.pilot.now_ns - self.pilot.boot_ns)  # 0 would be another question
            self._answer(common.MAVLink_timesync_message(since_boot_ns, heard.message.ts1))

    def _set_origin(self, heard: Heard) -> None:
        m = heard.message
        if isinstance(self.pilot, ArduPilot) and self.pilot.set_origin(m.latitude, m.longitude, m.altitude):
            self.send_once(common.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)

    def _setup_signing(self, heard: Heard) -> None:
        self.key = bytes(heard.message.secret_key)

    def _system_time(self, pilot: Autopilot) -> Any:
        return common.MAVLink_system_time_message(self._unix_ns(pilot.now_ns) // 1000, telemetry.boot_ms(pilot))
