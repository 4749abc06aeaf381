"""Where each number of a rollout stands in a kernel's memory: one flat array, LANES vehicles side by side.

Number r of lane i is at r * LANES + i. One array with offsets known at compile time lets the compiler see that
neighbouring lanes do not touch each other, which is what it needs to run eight of them in one instruction.
"""

from __future__ import annotations

from lcd_flight.control.geometric import Row4
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels.multirotor import LinearSums, Motion, RotorSums, Stage

LANES = 32
"""Vehicles side by side: a multiple of the widest vector, so that no lane is computed by other instructions, and as
many as leave what a tick touches in the first-level cache (decision 0083)."""

MOTION = 0
"""13: position, velocity, attitude, body rates."""
STAGE = MOTION + 13
"""10: velocity, attitude and body rates at the next Runge-Kutta stage."""
STAGES = STAGE + 10
"""10: second stage, twice the third, and the fourth, added up."""
SPEEDS = STAGES + 10
"""4: rotor speeds, rad/s."""
COMMANDS = SPEEDS + 4
"""4: commanded rotor speeds within the limits, rad/s."""
ROTORS_NOW = COMMANDS + 4
"""10: `RotorSums` of the speeds."""
ROTORS_MIDDLE = ROTORS_NOW + 10
"""10: likewise, in the middle of a Runge-Kutta step."""
GOAL = ROTORS_MIDDLE + 10
"""6: `LinearSums` of the commands."""
NOISE = GOAL + 6
"""4: standard normal numbers of this tick."""
FORCE = NOISE + 4
"""3: N, world, that the law asks for."""
WRENCH = FORCE + 3
"""4: collective thrust in N and moment in N m, body, that the law asks for."""
REFERENCE = WRENCH + 4
"""14: position, velocity, acceleration; yaw in rad, its rate and acceleration; cosine and sine of the yaw."""
COUNTS = REFERENCE + 14
"""1 where this tick counts for the labels."""
COEFFICIENTS = COUNTS + 1
"""32: of the current segment, axis by axis, ascending."""
SEGMENT_START = COEFFICIENTS + 32
"""s, of the current segment."""
DURATION = SEGMENT_START + 1
"""s, of the plan."""
LAST_TICK = DURATION + 1
END_TICK = LAST_TICK + 1
"""First tick at or after the current segment's end; none is infinite."""
CLIPS = END_TICK + 1
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
LABELS = SEGMENT_LARGEST + 1 - ALIVE
"""How many of them are the results."""

BEFORE = SEGMENT_LARGEST + 1
"""6: position and velocity one tick ago, where a knot lies between. From here on: what only some rollouts use."""
SEEN = BEFORE + 6
"""13: the motion as the controller is given it, where the pose has gaps; it coasts while the pose is missing."""
GAP_START = SEEN + 13
"""First tick without pose."""
GAP_END = GAP_START + 1
"""First tick with pose again."""
ESTIMATE = GAP_END + 1
"""6: `control.adaptive.Estimate`."""
INTEGRAL = ESTIMATE + 6
"""3: acceleration in m/s^2 that the flight loop's integral asks for."""
SETPOINT = INTEGRAL + 3
"""4: thrust in counts; roll, pitch, yaw in deg."""
PID = SETPOINT + 4
"""12: integrals of attitude and rates, attitude and rates one period ago; deg."""
ROWS = PID + 12


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
    stage = load_stage(memory, row + 3, lane)
    return Motion(load3(memory, row, lane), stage.v_WB_W, stage.q_WB, stage.w_WB_B)


def load_stage(memory: FloatArray, row: int, lane: int) -> Stage:
    """Ten numbers of a lane."""
    return Stage(load3(memory, row, lane), load4(memory, row + 3, lane), load3(memory, row + 7, lane))


def load_linear(memory: FloatArray, row: int, lane: int) -> LinearSums:
    """Six sums of a lane."""
    total, x, y = load3(memory, row, lane)
    xx, xy, yy = load3(memory, row + 3, lane)
    return LinearSums(total, x, y, xx, xy, yy)


def load_rotors(memory: FloatArray, row: int, lane: int) -> RotorSums:
    """Ten sums of a lane."""
    return RotorSums(memory[row * LANES + lane], load3(memory, row + 1, lane), load_linear(memory, row + 4, lane))


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
    store_stage(memory, row + 3, lane, Stage(motion.v_WB_W, motion.q_WB, motion.w_WB_B))


def store_stage(memory: FloatArray, row: int, lane: int, stage: Stage) -> None:
    """Set ten numbers of a lane."""
    store3(memory, row, lane, stage.v_WB_W)
    store4(memory, row + 3, lane, stage.q_WB)
    store3(memory, row + 7, lane, stage.w_WB_B)


def store_linear(memory: FloatArray, row: int, lane: int, sums: LinearSums) -> None:
    """Set six sums of a lane."""
    store3(memory, row, lane, (sums.total, sums.x, sums.y))
    store3(memory, row + 3, lane, (sums.xx, sums.xy, sums.yy))


def store_rotors(memory: FloatArray, row: int, lane: int, sums: RotorSums) -> None:
    """Set ten sums of a lane."""
    memory[row * LANES + lane] = sums.thrust
    store3(memory, row + 1, lane, sums.turn)
    store_linear(memory, row + 4, lane, sums.linear)
