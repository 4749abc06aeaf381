"""Where each number of a rollout stands in a kernel's memory: one flat array, LANES vehicles side by side.

Number r of lane i is at r * LANES + i. One array with offsets known at compile time lets the compiler see that
neighbouring lanes do not touch each other, which is what it needs to run eight of them in one instruction.
"""

from __future__ import annotations

from lcd_flight.control.geometric import Row4
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels.multirotor import Motion

LANES = 32
"""Vehicles side by side; a multiple of the widest vector, so that no lane is computed by other instructions."""

MOTION = 0
"""13: position, velocity, attitude, body rates."""
SPEEDS = MOTION + 13
"""4: rotor speeds, rad/s."""
COMMANDS = SPEEDS + 4
"""4: commanded rotor speeds within the limits, rad/s."""
BEFORE = COMMANDS + 4
"""6: position and velocity one tick ago."""
SEEN = BEFORE + 6
"""13: the motion as the controller is given it; it coasts while the pose is missing."""
REFERENCE = SEEN + 13
"""12: position, velocity, acceleration; yaw in rad, its rate and acceleration."""
INTEGRAL = REFERENCE + 12
"""3: acceleration in m/s^2 that the law's integral asks for."""
SETPOINT = INTEGRAL + 3
"""4: thrust in counts; roll, pitch, yaw in deg."""
PID = SETPOINT + 4
"""12: integrals of attitude and rates, attitude and rates one period ago; deg."""
COEFFICIENTS = PID + 12
"""32: of the current segment, axis by axis, ascending."""
SEGMENT_START = COEFFICIENTS + 32
"""s, of the current segment."""
DURATION = SEGMENT_START + 1
"""s, of the plan."""
LAST_TICK = DURATION + 1
GAP_START = LAST_TICK + 1
"""First tick without pose."""
GAP_END = GAP_START + 1
"""First tick with pose again."""
CLIPS = GAP_END + 1
"""Motor commands clipped in this tick; 4 are all of them."""
RUN = CLIPS + 1
"""Unbroken ticks with a motor clipped, now."""

ALIVE = RUN + 1
"""1 until the rollout leaves the model's validity. From here on: the results."""
SAMPLES = ALIVE + 1
"""Ticks counted so far."""
LARGEST = SAMPLES + 1
"""Largest squared error."""
LARGEST_TICK = LARGEST + 1
SUM = LARGEST_TICK + 1
"""Of the error."""
SUM_2 = SUM + 1
"""Of its square."""
SUM_8 = SUM_2 + 1
"""Of its eighth power."""
YAW_COST = SUM_8 + 1
PAPER_COST = YAW_COST + 1
RELEASED_COST = PAPER_COST + 1
CLIPPED = RELEASED_COST + 1
"""Motor commands clipped so far."""
LONGEST_RUN = CLIPPED + 1
"""Most unbroken ticks with a motor clipped."""
SEGMENT_LARGEST = LONGEST_RUN + 1
"""Largest squared error within the current segment; -1 before its first tick."""
ROWS = SEGMENT_LARGEST + 1


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
