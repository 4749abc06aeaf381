"""From newtons to the u16 thrust of a setpoint: named, versioned configuration, never a constant in code."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import yaml

from lcd_flight.model import GRAVITY_M_PER_S2, InputError, Vehicle

FULL_SCALE = 65535
LARGEST = 60000
"""crtp_commander_rpyt.c, MAX_THRUST: more is clipped."""
SMALLEST = 1000
"""crtp_commander_rpyt.c, MIN_THRUST: less is none."""
FORCE_LINEAR_PROTOCOL = 11
"""CRTP protocol of the oldest firmware that is taken to have thrust linear in force."""

_FILE = Path(__file__).with_name("thrust_maps.yaml")
_Positive = Annotated[float, msgspec.Meta(gt=0.0)]


class _Data(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    version: int
    kind: Literal["force-linear", "square-root"]
    source: str
    full_scale_N: _Positive | None = None
    c1: float | None = None
    c2: _Positive | None = None
    c3: _Positive | None = None


@dataclass(frozen=True, slots=True)
class ThrustMap:
    """One map. A force-linear one has `full_scale_N`, a square-root one the three coefficients."""

    name: str
    version: int
    source: str
    full_scale_N: float | None = None
    coefficients: tuple[float, float, float] | None = None

    def counts(self, thrust_N: float) -> int:
        """The u16 for a collective thrust; 0 where it is less than the firmware takes."""
        if thrust_N <= 0.0:
            return 0
        wanted = round(self._unclipped(thrust_N))
        return 0 if wanted < SMALLEST else min(wanted, LARGEST)

    def described(self, vehicle: Vehicle) -> str:
        """For the log: which map, and what hovering takes."""
        return (
            f"thrust map {self.name} version {self.version}: hover at {self.counts(vehicle.weight_N)} of {FULL_SCALE}"
        )

    @property
    def force_linear(self) -> bool:
        """Whether it is for firmware whose thrust is linear in force."""
        return self.full_scale_N is not None

    def _unclipped(self, thrust_N: float) -> float:
        if self.full_scale_N is not None:
            return thrust_N / self.full_scale_N * FULL_SCALE
        assert self.coefficients is not None  # noqa: S101 - one of the two is always there
        c1, c2, c3 = self.coefficients
        return 60000.0 * (c1 + c2 * math.sqrt(c3 + 1000.0 * thrust_N / GRAVITY_M_PER_S2))


def thrust_map(name: str, vehicle: Vehicle) -> ThrustMap:
    """The map of the option `thrust_map`.

    Raises:
        InputError: neither `vehicle`, nor a map that ships, nor a file with one.
    """
    if name == "vehicle":
        source = f"linear in force up to {vehicle.max_thrust_N:.3f} N, the largest thrust of vehicle {vehicle.name}"
        return ThrustMap("vehicle", 1, source, full_scale_N=vehicle.max_thrust_N)
    shipped = _read(_FILE)
    if name in shipped:
        return _built(name, shipped[name], name)
    path = Path(name)
    if path.suffix in (".yaml", ".yml") and path.is_file():
        maps = _read(path)
        if len(maps) == 1:
            ((found, data),) = maps.items()
            return _built(f"{found} ({_digest(path)})", data, name)
        raise InputError(f"thrust map {name}: one map is wanted in the file, not {len(maps)}")
    raise InputError(f"thrust map {name!r} is neither a file (*.yaml) nor one of: vehicle, {', '.join(shipped)}")


def _read(path: Path) -> Mapping[str, _Data]:
    try:
        return msgspec.convert(yaml.safe_load(path.read_text(encoding="utf-8")), dict[str, _Data])
    except (OSError, UnicodeDecodeError, yaml.YAMLError, msgspec.ValidationError) as error:
        raise InputError(f"thrust map {path}: {error}") from None


def _built(name: str, data: _Data, where: str) -> ThrustMap:
    if data.kind == "force-linear" and data.full_scale_N is not None:
        return ThrustMap(name, data.version, data.source, full_scale_N=data.full_scale_N)
    if data.kind == "square-root" and data.c1 is not None and data.c2 is not None and data.c3 is not None:
        return ThrustMap(name, data.version, data.source, coefficients=(data.c1, data.c2, data.c3))
    wanted = "full_scale_N" if data.kind == "force-linear" else "c1, c2 and c3"
    raise InputError(f"thrust map {where}: a {data.kind} map needs {wanted}")


def _digest(path: Path) -> str:
    """Eight digits by which a log tells one state of a file from another."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:8]
