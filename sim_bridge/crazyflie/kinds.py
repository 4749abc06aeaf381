"""C types as parameters and log variables have them: how a number becomes bytes and back.

Source: crazyflie-firmware, src/modules/interface/param_logic.h and log.h (the codes).
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """One C type."""

    format: str
    """As `struct` has it."""
    parameter_code: int
    log_code: int

    @property
    def size(self) -> int:
        """Bytes."""
        return struct.calcsize(self.format)

    @property
    def is_float(self) -> bool:
        """Whether it holds fractions."""
        return self.format[-1] in "fe"

    def pack(self, value: float) -> bytes:
        """The bytes of a number; what does not fit is brought to the nearest that does, what is no number to 0."""
        if self.is_float:
            return _packed_float(self.format, float(value))
        low, high = _limits(self)
        return struct.pack(self.format, _whole(value, low, high))

    def unpack(self, data: bytes) -> float | None:
        """The number at the beginning of some bytes; None where they are too few."""
        if len(data) < self.size:
            return None
        value: float = struct.unpack_from(self.format, data)[0]
        return value


U8 = Kind("<B", 0x08, 0x01)
U16 = Kind("<H", 0x09, 0x02)
U32 = Kind("<I", 0x0A, 0x03)
I8 = Kind("<b", 0x00, 0x04)
I16 = Kind("<h", 0x01, 0x05)
I32 = Kind("<i", 0x02, 0x06)
F32 = Kind("<f", 0x06, 0x07)
F16 = Kind("<e", 0x05, 0x08)

BY_LOG_CODE = {kind.log_code: kind for kind in (U8, U16, U32, I8, I16, I32, F32, F16)}
BY_PARAMETER_CODE = {kind.parameter_code: kind for kind in (U8, U16, U32, I8, I16, I32, F32)}


def _limits(kind: Kind) -> tuple[int, int]:
    bits = 8 * kind.size
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if kind.format[-1].islower() else (0, (1 << bits) - 1)


def _whole(value: float, low: int, high: int) -> int:
    """Cut towards zero, as C does, within the limits."""
    if math.isnan(value):
        return 0
    return low if value <= low else high if value >= high else int(value)


def _packed_float(form: str, value: float) -> bytes:
    try:
        return struct.pack(form, value)
    except OverflowError:
        return struct.pack(form, math.copysign(math.inf, value))
