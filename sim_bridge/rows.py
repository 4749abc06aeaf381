"""Where each number of a rollout stands in a kernel's memory: one flat array, LANES vehicles side by side.

Number r of lane i is at r * LANES + i. One array with offsets known at compile time lets the compiler see that
neighbouring lanes do not touch each other, which is what it needs to run eight of them in one instruction.
"""

from __future__ import annotations

from lcd_flight.control.geometric import Row4
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.multirotor import Motion

LANES = 32
"""Vehicles side by side; a multiple of the widest vector, so that no lane is computed by other instructions."""

MOTION = 0
"""13: position, velocity, attitude, body rates."""
SPEEDS = 13
"""4: rotor speeds, rad/s."""
COMMANDS = 17
"""4: commanded rotor speeds within the limits, rad/s."""
SEEN = 21
"""13: the motion as the controller is given it; it coasts while the pose is missing."""
BEFORE = 34
"""6: position and velocity one tick ago."""
COEFFICIENTS = 40
"""32: of the current segment, axis by axis, ascending."""
SEGMENT_START = 72
"""s, of the current segment."""
DURATION = 73
"""s, of the plan."""
LAST_TICK = 74
GAP_START, GAP_END = 75, 76
"""Ticks between which the pose is missing."""
ALIVE = 77
"""1 until the rollout leaves the model's validity."""
SAMPLES = 78
"""Ticks counted so far."""
LARGEST, LARGEST_TICK = 79, 80
"""Largest squared error and its tick."""
SEGMENT_LARGEST = 81
"""Largest squared error within the current segment; -1 before its first tick."""
SUM, SUM_2, SUM_8 = 82, 83, 84
"""Of the error, its square and its eighth power."""
YAW_COST, PAPER_COST, RELEASED_COST = 85, 86, 87
"""Sums over ticks."""
CLIPPED = 88
"""Motor commands that were clipped."""
RUN, LONGEST_RUN = 89, 90
"""Unbroken ticks with a motor clipped: now, and at most."""
ROWS = 91


def load3(memory: FloatArray, row: int, lane: int) -> Vector3:
    """Three numbers of a lane."""
    at = row * LANES + lane
    return memory[at], memory[at + LANES], memory[at + 2 * LANES]


def load4(memory: FloatArray, row: int, lane: int) -> Row4:
    """Four numbers of a lane."""
    at = row * LANES + lane
    return memory[at], memory[at + LANES], memory[at + 2 * LANES], memory[at + 3 * LANES]


def load_motion(memory: FloatArray, row: int, lane: int) -> Motion:
    """Thirteen numbers of a lane."""
    return Motion(
        load3(memory, row, lane),
        load3(memory, row + 3, lane),
        load4(memory, row + 6, lane),
        load3(memory, row + 10, lane),
    )


def store3(memory: FloatArray, row: int, lane: int, values: Vector3) -> None:
    """Set three numbers of a lane."""
    at = row * LANES + lane
    memory[at], memory[at + LANES], memory[at + 2 * LANES] = values


def store4(memory: FloatArray, row: int, lane: int, values: Row4) -> None:
    """Set four numbers of a lane."""
    at = row * LANES + lane
    memory[at], memory[at + LANES], memory[at + 2 * LANES], memory[at + 3 * LANES] = values


def store_motion(memory: FloatArray, row: int, lane: int, motion: Motion) -> None:
    """Set thirteen numbers of a lane."""
    store3(memory, row, lane, motion.p_WB)
    store3(memory, row + 3, lane, motion.v_WB_W)
    store4(memory, row + 6, lane, motion.q_WB)
    store3(memory, row + 10, lane, motion.w_WB_B)
