"""Options of `radio://`, `usb://` and `udp://`, and what an address looks like."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated

import msgspec

from lcd_flight.model import InputError
from lcd_flight.wire.uri_options import read_options

_Seconds = Annotated[float, msgspec.Meta(gt=0.0, le=600.0)]


class CrazyflieOptions(msgspec.Struct, frozen=True):
    """How a Crazyflie is reached and spoken to."""

    thrust_map: str = "vehicle"
    """`vehicle`: linear in force up to the vehicle file's largest thrust (firmware of 2025 and later); a name from
    `thrust_maps.yaml`; or a YAML file with a map."""
    pose_rate_hz: Annotated[float, msgspec.Meta(ge=1.0, le=1000.0)] = 100.0
    """Poses go to the vehicle as they come, but no more than this."""
    connect_s: _Seconds = 30.0
    """Give up connecting after so long."""


_ADDRESSES: Mapping[str, tuple[str, str]] = {
    "radio": (r"[0-9A-Za-z]+/\d{1,3}/(250K|1M|2M)(/[0-9A-Fa-f]{1,10})?", "radio://0/80/2M/E7E7E7E7E7"),
    "usb": (r"\d+", "usb://0"),
    "udp": (r"[^/:\s]+:\d{1,5}", "udp://127.0.0.1:19850"),
}
MAX_PORT, MAX_CHANNEL = 65535, 125


def read(scheme: str, address: str, options: Mapping[str, str]) -> CrazyflieOptions:
    """The options, once the address has been found to be one.

    Raises:
        InputError: not an address of this kind of link, an unknown option, or a value out of its limits.
    """
    pattern, example = _ADDRESSES[scheme]
    if not re.fullmatch(pattern, address) or not _numbers_fit(scheme, address):
        raise InputError(f"link {scheme}://{address}: write it like {example}")
    return read_options(CrazyflieOptions, options, f"{scheme}://")


def _numbers_fit(scheme: str, address: str) -> bool:
    match scheme:
        case "udp":
            return 0 < int(address.rpartition(":")[2]) <= MAX_PORT
        case "radio":
            return int(address.split("/")[1]) <= MAX_CHANNEL
    return True
