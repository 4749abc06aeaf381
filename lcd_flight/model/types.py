"""Names for the shapes that travel everywhere.

What travels through a flight is immutable: tuples of floats. Whole trajectories and batches are numpy arrays.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Vector3: TypeAlias = tuple[float, float, float]
"""Three components; the frame and the unit stand in the name of the variable that holds them."""

Quaternion: TypeAlias = tuple[float, float, float, float]
"""Unit quaternion (x, y, z, w). Other orders live in `*_wire` files only."""

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
SeedArray: TypeAlias = NDArray[np.uint64]

Loop: TypeAlias = Literal["paper", "flight"]
"""`paper`: the SE(3) law to rotor speeds. `flight`: collective thrust and attitude to an onboard PID."""

LinkLossPolicy: TypeAlias = Literal["vehicle", "cut"]
"""Once a vehicle hears nothing any more: `vehicle`: what its firmware does by default; `cut`: motors off within 1 s."""

GRAVITY_M_PER_S2 = 9.81

MocapAxes: TypeAlias = Literal["enu", "ned", "y_up"]
"""How a motion capture system names its axes. `enu`: z up, body forward-left-up (ours). `ned`: z down, body
forward-right-down. `y_up`: y up and the body's axes named likewise (x forward, y up, z right)."""
