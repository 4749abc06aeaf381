"""Which autopilot is built for a flavour, with which parameters and setup."""

from __future__ import annotations

from sim_bridge.mavlink.ardupilot import ArduPilot
from sim_bridge.mavlink.autopilot import Autopilot
from sim_bridge.mavlink.body import Body
from sim_bridge.mavlink.faults import spoil
from sim_bridge.mavlink.options import Flavour, MavlinkOptions
from sim_bridge.mavlink.parameter_tables import ARDUPILOT, ARDUPILOT_READY, PX4, PX4_READY
from sim_bridge.mavlink.parameters import Bytewise, Cast, Parameters
from sim_bridge.mavlink.px4 import Px4
from sim_bridge.mavlink.vocabulary import Setup

_BOOT_S: dict[Flavour, float] = {"px4": 2.0, "ardupilot": 20.0}
_HOVER: dict[Flavour, float] = {"px4": 0.5, "ardupilot": 0.369}


def parameters_of(options: MavlinkOptions) -> Parameters:
    """The parameters before the first boot.

    Raises:
        InputError: `wrong` or `stuck` name a parameter that there is not.
    """
    ready = options.defaults == "ready"
    if options.flavour == "px4":
        parameters = Parameters(PX4, Bytewise, PX4_READY if ready else {})
        parameters.put("MAV_SYS_ID", options.system)
    else:
        parameters = Parameters(ARDUPILOT, Cast, ARDUPILOT_READY if ready else {})
        parameters.put("SYSID_THISMAV", options.system)
    spoil(parameters, options)
    return parameters


def setup_of(options: MavlinkOptions) -> Setup:
    """How the vehicle is to be."""
    boot_s = _BOOT_S[options.flavour] if options.boot_s is None else options.boot_s
    hover = _HOVER[options.flavour] if options.hover_thrust is None else options.hover_thrust
    return Setup(hover_thrust=hover, boot_s=boot_s, rc=options.rc)


def boot(options: MavlinkOptions, body: Body, parameters: Parameters, now_ns: int) -> Autopilot:
    """A fresh autopilot."""
    kind = Px4 if options.flavour == "px4" else ArduPilot
    pilot: Autopilot = kind(body, parameters, setup_of(options), now_ns)
    pilot.announce()
    return pilot
