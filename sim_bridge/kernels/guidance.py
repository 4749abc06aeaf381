"""What one vehicle of a batch is told: its reference, the law's command, the onboard controller's; as in `lane`."""

from __future__ import annotations

from typing import NamedTuple

from lcd_flight.control.adaptive import Adaptation, Estimate, found_force, predicted_velocity
from lcd_flight.control.drag_compensation import DragModel, force_against_drag, rotor_speeds_in_airflow
from lcd_flight.control.flight_law import integrated, thrust_and_attitude
from lcd_flight.control.geometric import (
    Allocation,
    Row4,
    acceleration_setpoint,
    attitude_setpoint,
    clipped,
    dot,
    into_body,
    moment,
    moment_feed_forward,
    rotation_of,
    rotor_speeds,
    scaled,
)
from lcd_flight.model import FloatArray, Vector3
from sim_bridge.kernels import rows
from sim_bridge.kernels.elementary import cos_sin
from sim_bridge.kernels.lane import TICK_S, aim_rotors
from sim_bridge.kernels.multirotor import Airframe
from sim_bridge.kernels.onboard import (
    DEGREES,
    Onboard,
    PidMemory,
    Setpoint,
    cascade,
    mixed,
    received,
    roll_pitch_yaw,
    speed_of,
)
from sim_bridge.kernels.rows import LANES, load3, load4, load_motion, store3, store4

GEOMETRIC, FEED_FORWARD, AGAINST_DRAG, ADAPTIVE = range(4)
"""Forms of the law: RotorPy's, with the paper's last term, with its drag model, with the L1 estimate."""


class Law(NamedTuple):
    """What the controller believes of the vehicle and how it is tuned (`model.GeometricGains`)."""

    mass_kg: float
    inertia_kg_m2: Vector3
    position_gain: Vector3
    velocity_gain: Vector3
    attitude_gain: float
    rate_gain: float
    allocation: Allocation
    form: int
    """GEOMETRIC, FEED_FORWARD, AGAINST_DRAG or ADAPTIVE; in the flight loop, GEOMETRIC."""
    drag: DragModel
    adaptation: Adaptation
    integral_gain: Vector3
    integral_limit: float
    thrust_limit_N: float


class Sample(NamedTuple):
    """The reference at a tick, as the law needs it."""

    p_W: Vector3
    v_W: Vector3
    a_W: Vector3
    yaw_rad: float
    yaw_rate: float
    yaw_acceleration: float
    heading: tuple[float, float]
    """Cosine and sine of the yaw."""


def refer(memory: FloatArray, lane: int, tick: float) -> None:
    """Sample the plan at a tick; after its end, at rest there (plans end at rest)."""
    time = min(TICK_S * tick, memory[rows.DURATION * LANES + lane]) - memory[rows.SEGMENT_START * LANES + lane]
    x = horner(memory, rows.COEFFICIENTS, lane, time)
    y = horner(memory, rows.COEFFICIENTS + 8, lane, time)
    z = horner(memory, rows.COEFFICIENTS + 16, lane, time)
    yaw = horner(memory, rows.COEFFICIENTS + 24, lane, time)
    store3(memory, rows.REFERENCE, lane, (x[0], y[0], z[0]))
    store3(memory, rows.REFERENCE + 3, lane, (x[1], y[1], z[1]))
    store3(memory, rows.REFERENCE + 6, lane, (x[2], y[2], z[2]))
    store3(memory, rows.REFERENCE + 9, lane, yaw)
    cosine, sine = cos_sin(yaw[0])
    memory[(rows.REFERENCE + 12) * LANES + lane] = cosine
    memory[(rows.REFERENCE + 13) * LANES + lane] = sine


def horner(memory: FloatArray, row: int, lane: int, time: float) -> Vector3:
    """Value, first and second derivative of the polynomial of order 7 whose coefficients begin at `row`."""
    highest = memory[(row + 7) * LANES + lane]
    value = highest * time + memory[(row + 6) * LANES + lane]
    half_second, first = highest, highest * time + value
    value = value * time + memory[(row + 5) * LANES + lane]
    for k in range(4, -1, -1):
        half_second = half_second * time + first
        first = first * time + value
        value = value * time + memory[(row + k) * LANES + lane]
    return (value, first, 2.0 * half_second)


def reference(memory: FloatArray, lane: int) -> Sample:
    """The plan at this tick."""
    return Sample(
        load3(memory, rows.REFERENCE, lane),
        load3(memory, rows.REFERENCE + 3, lane),
        load3(memory, rows.REFERENCE + 6, lane),
        memory[(rows.REFERENCE + 9) * LANES + lane],
        memory[(rows.REFERENCE + 10) * LANES + lane],
        memory[(rows.REFERENCE + 11) * LANES + lane],
        (memory[(rows.REFERENCE + 12) * LANES + lane], memory[(rows.REFERENCE + 13) * LANES + lane]),
    )


def geometric_force(memory: FloatArray, lane: int, seen: int, law: Law) -> Vector3:
    """The force that the geometric law wants, in N, world."""
    p, v, _, _ = load_motion(memory, seen, lane)
    ref = reference(memory, lane)
    return scaled(
        acceleration_setpoint(p, v, ref.p_W, ref.v_W, ref.a_W, law.position_gain, law.velocity_gain), law.mass_kg
    )


def ask_force(memory: FloatArray, lane: int, seen: int, law: Law) -> None:
    """The paper's loop: the force that the law wants."""
    store3(memory, rows.FORCE, lane, geometric_force(memory, lane, seen, law))


def ask_force_against_drag(memory: FloatArray, lane: int, seen: int, law: Law) -> None:
    """The same, and what the model of drag adds."""
    v, heading = load3(memory, seen + 3, lane), reference(memory, lane).heading
    force = force_against_drag(geometric_force(memory, lane, seen, law), v, heading, law.drag)
    store3(memory, rows.FORCE, lane, force)


def ask_force_adaptively(memory: FloatArray, lane: int, seen: int, law: Law) -> None:
    """The same without the force that has been found; nothing is learned from a tick with a motor clipped."""
    v, b3 = load3(memory, seen + 3, lane), rotation_of(load4(memory, seen + 6, lane))[2]
    estimate = Estimate(load3(memory, rows.ESTIMATE, lane), load3(memory, rows.ESTIMATE + 3, lane))
    found = found_force(estimate, v, memory[rows.CLIPS * LANES + lane] > 0.0, law.adaptation)
    wanted = geometric_force(memory, lane, seen, law)
    force = (wanted[0] - found[0], wanted[1] - found[1], wanted[2] - found[2])
    store3(memory, rows.FORCE, lane, force)
    store3(memory, rows.ESTIMATE, lane, predicted_velocity(estimate, v, dot(force, b3), b3, law.adaptation))
    store3(memory, rows.ESTIMATE + 3, lane, found)


def ask_wrench(memory: FloatArray, lane: int, seen: int, law: Law, feed_forward: bool) -> None:
    """The paper's loop: thrust and moment for the force that is asked for."""
    _, _, q, w = load_motion(memory, seen, lane)
    ref, force, R_WB = reference(memory, lane), load3(memory, rows.FORCE, lane), rotation_of(q)
    R_WD = attitude_setpoint(force, ref.heading)
    turn = moment(R_WB, R_WD, w, ref.yaw_rate, law.inertia_kg_m2, law.attitude_gain, law.rate_gain)
    if feed_forward:
        desired, change = (0.0, 0.0, ref.yaw_rate), (0.0, 0.0, ref.yaw_acceleration)
        more = moment_feed_forward(R_WB, R_WD, w, desired, change, law.inertia_kg_m2)
        turn = (turn[0] + more[0], turn[1] + more[1], turn[2] + more[2])
    store4(memory, rows.WRENCH, lane, (dot(force, R_WB[2]), turn[0], turn[1], turn[2]))


def command_rotors(memory: FloatArray, lane: int, law: Law, air: Airframe) -> None:
    """The paper's loop: rotor speeds for thrust and moment, within their limits."""
    thrust_N, x, y, z = load4(memory, rows.WRENCH, lane)
    give_rotors(memory, lane, rotor_speeds(thrust_N, (x, y, z), law.allocation), air)


def command_rotors_in_airflow(memory: FloatArray, lane: int, seen: int, law: Law, air: Airframe) -> None:
    """The same, with what the present airflow does to the thrust."""
    thrust_N, x, y, z = load4(memory, rows.WRENCH, lane)
    airspeed_B = into_body(rotation_of(load4(memory, seen + 6, lane)), load3(memory, seen + 3, lane))
    wanted = rotor_speeds_in_airflow(thrust_N, (x, y, z), law.allocation, airspeed_B, law.drag)
    give_rotors(memory, lane, wanted, air)


def give_rotors(memory: FloatArray, lane: int, wanted: Row4, air: Airframe) -> None:
    """Command what the rotors can do, and note what they cannot."""
    low, high = air.speed_min, air.speed_max
    given = (
        clipped(wanted[0], low, high),
        clipped(wanted[1], low, high),
        clipped(wanted[2], low, high),
        clipped(wanted[3], low, high),
    )
    aim_rotors(memory, lane, given, air)
    memory[rows.CLIPS * LANES + lane] = differing(wanted, given)


def command_attitude(memory: FloatArray, lane: int, seen: int, law: Law, controller: Onboard) -> None:
    """The flight loop: the law's thrust and attitude as the setpoint of the onboard controller."""
    p, v, q, _ = load_motion(memory, seen, lane)
    ref = reference(memory, lane)
    integral = load3(memory, rows.INTEGRAL, lane)
    acceleration = acceleration_setpoint(p, v, ref.p_W, ref.v_W, ref.a_W, law.position_gain, law.velocity_gain)
    thrust_N, R_WD = thrust_and_attitude(acceleration, integral, rotation_of(q)[2], ref.heading, law.mass_kg)
    dt_s = 0.0 if thrust_N > law.thrust_limit_N else TICK_S
    error = (p[0] - ref.p_W[0], p[1] - ref.p_W[1], p[2] - ref.p_W[2])
    store3(memory, rows.INTEGRAL, lane, integrated(integral, error, law.integral_gain, law.integral_limit, dt_s))
    setpoint = received(thrust_N, R_WD, rotation_of(load4(memory, rows.MOTION + 6, lane)), controller)
    memory[rows.SETPOINT * LANES + lane] = setpoint.thrust
    store3(memory, rows.SETPOINT + 1, lane, setpoint.attitude)
    memory[rows.CLIPS * LANES + lane] = 0.0


def stabilise(memory: FloatArray, lane: int, air: Airframe, controller: Onboard) -> None:
    """One period of the onboard controller: from its setpoint to commanded rotor speeds."""
    _, _, q, w = load_motion(memory, rows.MOTION, lane)
    setpoint = Setpoint(memory[rows.SETPOINT * LANES + lane], load3(memory, rows.SETPOINT + 1, lane))
    before = PidMemory(
        load3(memory, rows.PID, lane),
        load3(memory, rows.PID + 3, lane),
        load3(memory, rows.PID + 6, lane),
        load3(memory, rows.PID + 9, lane),
    )
    outputs, after = cascade(setpoint, roll_pitch_yaw(rotation_of(q)), scaled(w, DEGREES), before, controller)
    store3(memory, rows.PID, lane, after.attitude_integral)
    store3(memory, rows.PID + 3, lane, after.rate_integral)
    store3(memory, rows.PID + 6, lane, after.attitude)
    store3(memory, rows.PID + 9, lane, after.rates)
    asked, given = mixed(setpoint.thrust, outputs, controller)
    low, high = air.speed_min, air.speed_max
    speeds = (
        clipped(speed_of(given[0], high), low, high),
        clipped(speed_of(given[1], high), low, high),
        clipped(speed_of(given[2], high), low, high),
        clipped(speed_of(given[3], high), low, high),
    )
    aim_rotors(memory, lane, speeds, air)
    memory[rows.CLIPS * LANES + lane] += differing(asked, given) * (controller.period_s / TICK_S)


def differing(a: Row4, b: Row4) -> float:
    """How many of the four differ."""
    return (
        (1.0 if a[0] != b[0] else 0.0)
        + (1.0 if a[1] != b[1] else 0.0)
        + (1.0 if a[2] != b[2] else 0.0)
        + (1.0 if a[3] != b[3] else 0.0)
    )
