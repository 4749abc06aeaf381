"""The parameter protocol, in both flavours' ways of putting a whole number into a float.

Source: mavlink.io, "Parameter Protocol": PX4 puts the bytes of an int into the float, ArduPilot converts (C cast).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

REAL = common.MAV_PARAM_TYPE_REAL32
INT8, INT16, INT32 = common.MAV_PARAM_TYPE_INT8, common.MAV_PARAM_TYPE_INT16, common.MAV_PARAM_TYPE_INT32
_RANGES = {INT8: 2**7, INT16: 2**15, INT32: 2**31}
Value = int | float


@dataclass(frozen=True, slots=True)
class Parameter:
    """What is known of one: its type (MAV_PARAM_TYPE) and its value as the firmware comes."""

    name: str
    kind: int
    default: Value


class Bytewise:
    """PX4: the four bytes of an int stand in the float."""

    @staticmethod
    def to_float(value: Value, kind: int) -> float:
        """What stands in the message."""
        if kind == REAL:
            return float(value)
        told: float = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return told

    @staticmethod
    def from_float(told: float, kind: int) -> Value | None:
        """What is meant; None: nothing that such a parameter can be."""
        if kind != REAL:
            meant: int = struct.unpack("<i", struct.pack("<f", told))[0]
            return meant
        return told if math.isfinite(told) else None


class Cast:
    """ArduPilot: an int is converted."""

    @staticmethod
    def to_float(value: Value, _: int) -> float:
        """What stands in the message."""
        return float(value)

    @staticmethod
    def from_float(told: float, kind: int) -> Value | None:
        """What is meant, within the type's range; None: not a finite number."""
        if not math.isfinite(told):
            return None
        if kind == REAL:
            return told
        most = _RANGES[kind]
        return max(-most, min(most - 1, round(told)))


class Parameters:
    """One vehicle's; they outlive a reboot."""

    def __init__(
        self, table: Iterable[Parameter], coding: type[Bytewise] | type[Cast], values: Mapping[str, Value]
    ) -> None:
        self._table = tuple(table)
        self._index = {parameter.name: n for n, parameter in enumerate(self._table)}
        self._coding = coding
        self._values = {p.name: values.get(p.name, p.default) for p in self._table}
        self._stuck: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, name: str) -> float:
        """The value of one that there is."""
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._index

    def put(self, name: str, value: float) -> None:
        """Set one from inside; whole numbers stay whole."""
        kind = self._table[self._index[name]].kind
        self._values[name] = float(value) if kind == REAL else round(value)

    def hold_fast(self, names: Iterable[str]) -> None:
        """These keep their values, whatever is written."""
        self._stuck = frozenset(names)

    def find(self, name: str, index: int) -> int | None:
        """Number of the parameter that is meant, by index where that is not negative; None: there is none."""
        if index >= 0:
            return index if index < len(self._table) else None
        return self._index.get(name)

    def write(self, name: str, told: float, kind: int) -> bool:
        """Write one as it came in PARAM_SET; whether it can be."""
        parameter = self._table[self._index[name]]
        if self._coding is Bytewise and kind != parameter.kind:
            return False
        value = self._coding.from_float(told, parameter.kind)
        if value is None:
            return False
        if name not in self._stuck:
            self._values[name] = value
        return True

    def message(self, index: int) -> common.MAVLink_param_value_message:
        """PARAM_VALUE of one."""
        parameter = self._table[index]
        return self._message(index, self._coding.to_float(self._values[parameter.name], parameter.kind))

    def hash_message(self, name: str) -> common.MAVLink_param_value_message:
        """PARAM_VALUE of a checksum over all of them, by which a ground station knows what it has kept."""
        told = ",".join(self._values).encode()
        values = struct.pack(f"<{len(self._table)}d", *map(float, self._values.values()))
        # The lower bits alone, so that its bytes are no special float, which would not come out as they went in.
        bits = zlib.crc32(told + values) & 0x3FFFFFFF
        value: float = struct.unpack("<f", struct.pack("<I", bits))[0]
        kind = common.MAV_PARAM_TYPE_UINT32
        return common.MAVLink_param_value_message(name.encode(), value, kind, len(self._table), 2**16 - 1)

    def echo(self, index: int, told: float) -> common.MAVLink_param_value_message:
        """PARAM_VALUE after writing; one that does not hold says that it does."""
        return self._message(index, told) if self._table[index].name in self._stuck else self.message(index)

    def _message(self, index: int, told: float) -> common.MAVLink_param_value_message:
        parameter = self._table[index]
        return common.MAVLink_param_value_message(
            parameter.name.encode(), told, parameter.kind, len(self._table), index
        )
