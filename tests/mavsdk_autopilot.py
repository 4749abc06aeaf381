"""mavsdk's server plugins as a PX4 behind UDP, in a process of its own.

`python mavsdk_autopilot.py PORT [NAME=VALUE ...]` speaks to 127.0.0.1:PORT until its standard input ends; then it
writes what it heard as a line of JSON (`Heard`). NAME=VALUE replaces a parameter; `armable=0` refuses to arm. It is
disarmed by force, or by itself after LAND.

mavsdk keeps mode and armed state, acknowledges commands, answers for parameters, and decodes and encodes all packets.
What its plugins have no call for is put in here: the autopilot's kind in its HEARTBEAT (always GENERIC), an attitude,
an estimator that believes each ODOMETRY, questions for the time, and the end of LAND.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

MAV_AUTOPILOT_PX4 = 12
HEARTBEAT, HEARTBEAT_CRC_EXTRA = 0, 50
AUTOPILOT_AT = 10 + 5
"""Of that field in the packet: a header of 10, custom_mode (4), type (1)."""
AIDED, UNAIDED = 0x33F, 0x85
"""Flags of ESTIMATOR_STATUS: all that there is; attitude and height alone, and that it is not aided."""
BOOTED_S = 60.0
"""So long ago, when it starts."""
PERIOD_S = 0.02
LAND_S = 0.5
EXIT_S = 20.0
PARAMETERS: dict[str, int | float] = {
    "COM_OBL_RC_ACT": 4,
    "COM_OF_LOSS_T": 0.5,
    "COM_FAIL_ACT_T": 0.0,
    "COM_RC_IN_MODE": 4,
    "COM_RCL_EXCEPT": 4,
    "EKF2_EV_CTRL": 15,
    "EKF2_EV_DELAY": 0.0,
    "EKF2_GPS_CTRL": 0,
    "EKF2_HGT_REF": 3,
    "MAV_FWDEXTSP": 1,
    "MPC_THR_HOVER": 0.45,
}
"""A PX4 that is set up for motion capture."""


@dataclass
class Heard:
    """What came, as mavsdk decoded it, in the order of arrival."""

    sequence: list[int] = field(default_factory=list)
    """Numbers of all packets."""
    lengths: dict[str, list[int]] = field(default_factory=dict)
    """Payload lengths by message number."""
    targets: list[dict[str, Any]] = field(default_factory=list)
    """SET_ATTITUDE_TARGET."""
    poses: list[dict[str, Any]] = field(default_factory=list)
    """ODOMETRY."""
    commands: list[dict[str, Any]] = field(default_factory=list)
    """COMMAND_LONG."""
    heartbeats: list[dict[str, Any]] = field(default_factory=list)
    times: list[dict[str, Any]] = field(default_factory=list)
    """TIMESYNC."""
    asked: list[int] = field(default_factory=list)
    """ts1 of our own questions for the time."""
    modes: list[str] = field(default_factory=list)
    """That it was put into."""


class Process:
    """The program, and what it heard once it is over."""

    def __init__(self, port: int, *changes: str) -> None:
        command = [sys.executable, str(Path(__file__)), str(port), *changes]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def heard(self) -> Heard:
        """End it."""
        written, _ = self._process.communicate(timeout=EXIT_S)
        return Heard(**json.loads(written.splitlines()[-1]))

    def kill(self) -> None:
        """End it, whatever it says."""
        self._process.kill()
        self._process.communicate()


@contextmanager
def autopilot(port: int, *changes: str) -> Iterator[Process]:
    """One that runs until `heard` or the end of the block."""
    process = Process(port, *changes)
    try:
        yield process
    finally:
        process.kill()


class Autopilot:
    """mavsdk on a socket."""

    def __init__(self, port: int, parameters: dict[str, int | float], *, armable: bool) -> None:
        import mavsdk
        from mavsdk.plugins.action_server import ActionServer, AllowableFlightModes
        from mavsdk.plugins.mavlink_direct_server import MavlinkDirectServer
        from mavsdk.plugins.param_server import ParamServer
        from mavsdk.plugins.telemetry_server import TelemetryServer

        self.heard = Heard()
        self._to = ("127.0.0.1", port)
        self._began_s = time.monotonic()
        self._odometry: dict[str, Any] | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._sdk = mavsdk.Mavsdk(mavsdk.Configuration.create_manual(1, 1, True))
        if self._sdk.add_any_connection("raw://") != mavsdk.ConnectionResult.SUCCESS:
            raise RuntimeError("mavsdk gives no raw connection")
        self._sdk.subscribe_raw_bytes_to_be_sent(self._send)
        component = self._sdk.server_component_by_type(mavsdk.ComponentType.AUTOPILOT, 0)
        self._action, self._direct = ActionServer(component), MavlinkDirectServer(component)
        self._telemetry, self._parameters = TelemetryServer(component), ParamServer(component)
        for name, value in parameters.items():
            whole = isinstance(value, int)
            (self._parameters.provide_param_int if whole else self._parameters.provide_param_float)(name, value)
        self._action.set_armable(armable, armable)
        self._action.set_disarmable(False, True)
        self._action.set_allowable_flight_modes(AllowableFlightModes(*(True,) * 7))
        self._action.subscribe_flight_mode_change(self._note_mode)
        for name, into in self._kept().items():
            self._direct.subscribe_message(name, lambda message, kept: kept(json.loads(message.fields_json)), into)

    def live(self, over: threading.Event) -> None:
        """Report until it is over."""
        while not over.wait(PERIOD_S):
            self._report()

    def receive(self) -> None:
        """Pass packets to mavsdk, one a datagram."""
        while data := self._socket.recv(2048):
            self.heard.sequence.append(data[4])
            self.heard.lengths.setdefault(str(int.from_bytes(data[7:10], "little")), []).append(data[1])
            self._sdk.pass_received_raw_bytes(data)

    def close(self) -> None:
        """No more packets; what is on the way to the callbacks arrives before."""
        time.sleep(5 * PERIOD_S)
        self._sdk.destroy()

    def _kept(self) -> dict[str, Any]:
        heard = self.heard
        return {
            "SET_ATTITUDE_TARGET": heard.targets.append,
            "ODOMETRY": self._believe,
            "COMMAND_LONG": heard.commands.append,
            "HEARTBEAT": heard.heartbeats.append,
            "TIMESYNC": heard.times.append,
        }

    def _believe(self, odometry: dict[str, Any]) -> None:
        self._odometry = odometry
        self.heard.poses.append(odometry)

    def _note_mode(self, _result: Any, mode: Any, _data: Any) -> None:
        self.heard.modes.append(mode.name)
        if mode.name == "LAND":
            threading.Timer(LAND_S, self._action.set_armed_state, (False,)).start()

    def _report(self) -> None:
        from mavsdk.plugins.telemetry_server import LandedState, VtolState

        boot_ms = round((BOOTED_S + time.monotonic() - self._began_s) * 1e3)
        seen = self._odometry
        w, x, y, z = [1.0, 0.0, 0.0, 0.0] if seen is None else seen["q"]
        self._tell("ATTITUDE_QUATERNION", time_boot_ms=boot_ms, q1=w, q2=x, q3=y, q4=z)
        if seen is not None:
            self._tell("LOCAL_POSITION_NED", time_boot_ms=boot_ms, x=seen["x"], y=seen["y"], z=seen["z"])
        self._tell("ESTIMATOR_STATUS", time_usec=1000 * boot_ms, flags=UNAIDED if seen is None else AIDED)
        self._tell("SYS_STATUS", voltage_battery=11_900, current_battery=-1, battery_remaining=90)
        self._telemetry.publish_extended_sys_state(VtolState.UNDEFINED, LandedState.ON_GROUND)
        self.heard.asked.append(time.monotonic_ns())
        self._tell("TIMESYNC", tc1=0, ts1=self.heard.asked[-1])

    def _tell(self, name: str, **fields: float) -> None:
        """Send a message; what is left out is 0."""
        from mavsdk.plugins.mavlink_direct_server import MavlinkMessage

        self._direct.send_message(MavlinkMessage(name, 1, 1, 0, 0, json.dumps(fields)))

    def _send(self, data: bytes) -> None:
        if int.from_bytes(data[7:10], "little") == HEARTBEAT:
            data = as_px4(data)
        self._socket.sendto(data, self._to)


def as_px4(heartbeat: bytes) -> bytes:
    """mavsdk's HEARTBEAT with another autopilot in it."""
    from pymavlink.generator.mavcrc import x25crc

    told = bytearray(heartbeat)
    told[AUTOPILOT_AT] = MAV_AUTOPILOT_PX4
    checked = x25crc(bytes(told[1:-2]) + bytes((HEARTBEAT_CRC_EXTRA,)))
    told[-2:] = checked.crc.to_bytes(2, "little")
    return bytes(told)


def main(port: str, *changes: str) -> None:
    """Serve until standard input ends."""
    import mavsdk

    mavsdk.log_subscribe(lambda *_: True)
    parameters = dict(PARAMETERS)
    armable = True
    for change in changes:
        name, _, value = change.partition("=")
        if name == "armable":
            armable = value != "0"
        else:
            parameters[name] = type(PARAMETERS[name])(value)
    vehicle, over = Autopilot(int(port), parameters, armable=armable), threading.Event()
    threading.Thread(target=vehicle.receive, daemon=True).start()
    living = threading.Thread(target=vehicle.live, args=(over,))
    living.start()
    sys.stdin.read()
    over.set()
    living.join()
    vehicle.close()
    sys.stdout.write("\n" + json.dumps(vars(vehicle.heard)) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
