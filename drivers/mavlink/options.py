"""Options of `mavlink+udp://`, `mavlink+tcp://` and `mavlink+serial://`, and what an address looks like."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import msgspec

from lcd_flight.model import InputError
from lcd_flight.wire.uri_options import read_options

Id: TypeAlias = Annotated[int, msgspec.Meta(ge=1, le=255)]
Frame: TypeAlias = Literal["enu", "flu"]
Flavour: TypeAlias = Literal["px4", "ardupilot"]

MAX_PORT = 65535
LEAST_BAUD = 230_400
"""Setpoints at 100 Hz and poses at 50 Hz are 18 kB a second, signed 20 kB; 115,200 baud carry 11.5 kB."""


class MavlinkOptions(msgspec.Struct, frozen=True):
    """How an autopilot is reached and spoken to."""

    autopilot: Flavour | None = None
    """`px4` or `ardupilot`; must be given, and must be what the vehicle says of itself."""
    system: Id = 1
    """The vehicle's system id; nobody else is listened to."""
    component: Id = 1
    """The autopilot's component id."""
    our_system: Id = 245
    our_component: Id = 191
    """An onboard computer."""
    role: Literal["listen", "call"] = "listen"
    """UDP only. `listen`: the address is ours, the vehicle speaks first; `call`: it is the vehicle's, heard alone."""
    allow: str = ""
    """IP addresses that may be the vehicle, separated by commas; empty: whoever sends its heartbeat first."""
    frame: Frame = "enu"
    """`enu`: x of motion capture points east and y north; `flu`: it is z up and points anywhere."""
    pose_rate_hz: Annotated[float, msgspec.Meta(ge=30.0, le=50.0)] = 50.0
    """Poses go to the vehicle as they come, but no more than this."""
    hover: Annotated[float, msgspec.Meta(ge=0.05, le=0.9)] | None = None
    """Thrust that hovers, as a share of full; without it, what the autopilot's parameter says."""
    thrust_slope: Annotated[float, msgspec.Meta(ge=0.2, le=3.0)] | None = None
    """Specific force gained for thrust gained, both relative to hover; without it 1, on ArduPilot 0.87."""
    mode: Literal["guided", "guided_nogps"] = "guided"
    """ArduPilot's mode that takes setpoints."""
    origin: str = "47.397742,8.545594,488"
    """ArduPilot: latitude and longitude in deg and height in m that motion capture's origin is said to be at."""
    set_parameters: bool = False
    """Whether to set parameters that are not as flight needs them, where no restart is needed; otherwise refuse."""
    signing: str = ""
    """`env:NAME` or `file:PATH`: where the key for MAVLink 2 signing is; empty: unsigned."""
    connect_s: Annotated[float, msgspec.Meta(gt=0.0, le=600.0)] = 30.0
    """Give up waiting for a heartbeat after so long."""
    baud: Annotated[int, msgspec.Meta(ge=LEAST_BAUD, le=12_500_000)] = 921_600
    """Serial only."""


@dataclass(frozen=True, slots=True)
class Origin:
    """A place on earth."""

    latitude_deg: float
    longitude_deg: float
    height_m: float


_ADDRESSES: Mapping[str, tuple[str, str]] = {
    "mavlink+udp": (r"[^/:\s]+:\d{1,5}", "mavlink+udp://0.0.0.0:14540?autopilot=px4"),
    "mavlink+tcp": (r"[^/:\s]+:\d{1,5}", "mavlink+tcp://127.0.0.1:5760?autopilot=ardupilot"),
    "mavlink+serial": (r"/\S+", "mavlink+serial:///dev/ttyACM0?baud=921600&autopilot=ardupilot"),
}


def read(scheme: str, address: str, given: Mapping[str, str]) -> MavlinkOptions:
    """The options, once the address has been found to be one.

    Raises:
        InputError: not an address of this kind of link, an unknown option, or a value out of its limits.
    """
    pattern, example = _ADDRESSES[scheme]
    if not re.fullmatch(pattern, address) or not _port_fits(scheme, address):
        raise InputError(f"link {scheme}://{address}: write it like {example}")
    options = read_options(MavlinkOptions, given, f"{scheme}://")
    if options.autopilot is None:
        raise InputError(f"link {scheme}://{address}: say which autopilot it is, ?autopilot=px4 or ardupilot")
    _only_for(scheme, "mavlink+udp", given, ("role", "allow"))
    _only_for(scheme, "mavlink+serial", given, ("baud",))
    origin_of(options)
    allowed_hosts(options)
    return options


def origin_of(options: MavlinkOptions) -> Origin:
    """The place that `origin` names.

    Raises:
        InputError: not three numbers of a place on earth.
    """
    try:
        latitude_deg, longitude_deg, height_m = (float(part) for part in options.origin.split(","))
    except ValueError:
        latitude_deg = longitude_deg = height_m = float("nan")
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(height_m) < 10_000.0):
        raise InputError(f"option origin={options.origin}: write latitude,longitude,height, e.g. 47.4,8.5,488")
    return Origin(latitude_deg, longitude_deg, height_m)


def allowed_hosts(options: MavlinkOptions) -> frozenset[str]:
    """The addresses that `allow` names; empty: any.

    Raises:
        InputError: one of them is no IP address.
    """
    hosts = [part.strip() for part in options.allow.split(",") if part.strip()]
    for host in hosts:
        try:
            ipaddress.ip_address(host)
        except ValueError:
            raise InputError(f"option allow={options.allow}: {host} is not an IP address") from None
    return frozenset(hosts)


def _port_fits(scheme: str, address: str) -> bool:
    return scheme == "mavlink+serial" or 0 < int(address.rpartition(":")[2]) <= MAX_PORT


def _only_for(scheme: str, wanted: str, given: Mapping[str, str], names: tuple[str, ...]) -> None:
    for name in names:
        if name in given and scheme != wanted:
            raise InputError(f"{scheme}://: option {name} belongs to {wanted}://")
