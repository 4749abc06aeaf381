"""Commands: what is done about each, and with which result.

Sources: mavlink.io, "Command Protocol"; PX4 1.16, Commander.cpp, mavlink_receiver.cpp; ArduPilot 4.6, GCS_Common.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from pymavlink.dialects.v20 import common

from sim_bridge.mavlink.ardupilot import GUIDED, ArduPilot
from sim_bridge.mavlink.ardupilot import LAND as COPTER_LAND
from sim_bridge.mavlink.ardupilot import RTL as COPTER_RTL
from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.px4 import LAND, RTL, TAKEOFF, Px4, custom_mode
from sim_bridge.mavlink.vocabulary import Result

ARM_ANYWAY = 21196.0
"""The magic number that arms or disarms whatever the checks say."""
ARM_WITHOUT_CHECKS = 2989.0
"""ArduPilot's other magic number."""
REBOOT_ANYWAY = 20190226.0
Params = Sequence[float]


class Desk(Protocol):
    """What commands need besides the autopilot."""

    pilot: Autopilot

    def set_interval(self, kind: int, interval_us: float) -> bool:
        """How often a message is sent; whether there is one."""
        ...

    def send_once(self, kind: int) -> bool:
        """Send a message now; whether there is one."""
        ...

    def send_interval(self, kind: int) -> bool:
        """Say how often one is sent; whether there is one."""
        ...

    def reboot_soon(self) -> None:
        """Reboot once the acknowledgement is out."""
        ...


def execute(command: int, params: Params, desk: Desk) -> Result:
    """Do it. params: the seven, of which those that are whole numbers come as floats too."""
    act = _ACTS.get(command)
    return Result.UNSUPPORTED if act is None else act(params, desk)


def _arm(params: Params, desk: Desk) -> Result:
    if params[0] not in (0.0, 1.0):
        return Result.UNSUPPORTED
    arm, copter = params[0] == 1.0, isinstance(desk.pilot, ArduPilot)
    forced = params[1] == ARM_ANYWAY or (copter and arm and params[1] == ARM_WITHOUT_CHECKS)
    return desk.pilot.request_arm(arm, forced)


def _set_mode(params: Params, desk: Desk) -> Result:
    base, main, sub = (_whole(value) for value in params[:3])
    if base is None or not base & 1:
        return Result.UNSUPPORTED if isinstance(desk.pilot, Px4) else Result.DENIED
    if main is None or not 0 <= main < 2**8:
        return Result.DENIED
    if isinstance(desk.pilot, Px4):
        return desk.pilot.request_mode(custom_mode(main, (sub or 0) % 256))
    return desk.pilot.request_mode(main)


def _interval(params: Params, desk: Desk) -> Result:
    kind = _whole(params[0])
    known = kind is not None and math.isfinite(params[1]) and desk.set_interval(kind, params[1])
    return Result.ACCEPTED if known else Result.FAILED


def _get_interval(params: Params, desk: Desk) -> Result:
    kind = _whole(params[0])
    return Result.ACCEPTED if kind is not None and desk.send_interval(kind) else Result.FAILED


def _request(params: Params, desk: Desk) -> Result:
    kind = _whole(params[0])
    return Result.ACCEPTED if kind is not None and desk.send_once(kind) else Result.FAILED


def _request_version(_: Params, desk: Desk) -> Result:
    desk.send_once(common.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    return Result.ACCEPTED


def _reboot(params: Params, desk: Desk) -> Result:
    if params[0] not in (1.0, 3.0):
        return Result.UNSUPPORTED if params[0] == 0.0 else Result.DENIED
    if desk.pilot.armed and not (isinstance(desk.pilot, ArduPilot) and params[5] == REBOOT_ANYWAY):
        return Result.DENIED if isinstance(desk.pilot, Px4) else Result.FAILED
    desk.reboot_soon()
    return Result.ACCEPTED


def _land(_: Params, desk: Desk) -> Result:
    return desk.pilot.request_mode(LAND if isinstance(desk.pilot, Px4) else COPTER_LAND)


def _return(_: Params, desk: Desk) -> Result:
    return desk.pilot.request_mode(RTL if isinstance(desk.pilot, Px4) else COPTER_RTL)


def _take_off(_: Params, desk: Desk) -> Result:
    """ArduPilot takes it in GUIDED alone; there it is not simulated."""
    if isinstance(desk.pilot, Px4):
        return desk.pilot.request_mode(TAKEOFF)
    return Result.UNSUPPORTED if desk.pilot.mode == GUIDED else Result.FAILED


def _terminate(params: Params, desk: Desk) -> Result:
    if params[0] > 0.5:
        desk.pilot.disarm("Terminating flight")
    return Result.ACCEPTED


def _whole(value: float) -> int | None:
    """A number as a whole one; None: not finite, or one that no field holds."""
    return int(value) if math.isfinite(value) and abs(value) < 2**31 else None


_ACTS: dict[int, Callable[[Params, Desk], Result]] = {
    common.MAV_CMD_NAV_RETURN_TO_LAUNCH: _return,
    common.MAV_CMD_NAV_LAND: _land,
    common.MAV_CMD_NAV_TAKEOFF: _take_off,
    common.MAV_CMD_DO_SET_MODE: _set_mode,
    common.MAV_CMD_DO_FLIGHTTERMINATION: _terminate,
    common.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: _reboot,
    common.MAV_CMD_COMPONENT_ARM_DISARM: _arm,
    common.MAV_CMD_GET_MESSAGE_INTERVAL: _get_interval,
    common.MAV_CMD_SET_MESSAGE_INTERVAL: _interval,
    common.MAV_CMD_REQUEST_MESSAGE: _request,
    common.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _request_version,
}
