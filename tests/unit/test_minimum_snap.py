"""Minimum snap: optimal by a dense solve and by two peers, smooth, at rest at both ends, refusing bad input."""

import math
import subprocess
import sys

import numpy as np
import pytest

from lcd_flight.model import InputError, Trajectories
from lcd_flight.planning.minimum_snap import minimum_snap, minimum_snap_batch, snap


def task(segments, seed=0, spread=(0.5, 2.0)):
    rng = np.random.default_rng(seed)
    waypoints = np.cumsum(rng.uniform(-2.0, 2.0, (segments + 1, 4)), axis=0)
    return waypoints, rng.uniform(*spread, segments)


def row(time, order):
    """The `order`-th derivative at `time` as a row on the eight coefficients."""
    return np.array([math.perm(k, order) * time ** (k - order) if k >= order else 0.0 for k in range(8)])


def gram(duration):
    """Snap of one segment as a quadratic form in its coefficients, by Gauss quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    rows = np.array([row(0.5 * duration * (1.0 + node), 4) for node in nodes])
    return 0.5 * duration * rows.T @ (weights[:, None] * rows)


def dense_constraints(waypoints, durations):
    """A c = b: waypoints, continuity to jerk, rest at both ends; nothing asks for continuity of snap."""
    segments = len(durations)
    rows, values = [], []

    def add(pairs, value):
        line = np.zeros(8 * segments)
        for segment, coefficients in pairs:
            line[8 * segment : 8 * segment + 8] += coefficients
        rows.append(line)
        values.append(value)

    for i, duration in enumerate(durations):
        add([(i, row(0.0, 0))], waypoints[i])
        add([(i, row(duration, 0))], waypoints[i + 1])
    for order in (1, 2, 3):
        add([(0, row(0.0, order))], np.zeros(4))
        add([(segments - 1, row(durations[-1], order))], np.zeros(4))
        for i in range(segments - 1):
            add([(i, row(durations[i], order)), (i + 1, -row(0.0, order))], np.zeros(4))
    return np.array(rows), np.array(values)


def dense_minimum_snap(waypoints, durations):
    """The paper's quadratic program in the coefficients, by its KKT system: (4, S, 8)."""
    segments = len(durations)
    a, b = dense_constraints(waypoints, durations)
    h = np.zeros((8 * segments, 8 * segments))
    for i, duration in enumerate(durations):
        h[8 * i : 8 * i + 8, 8 * i : 8 * i + 8] = gram(duration)
    kkt = np.block([[h, a.T], [a, np.zeros((len(a), len(a)))]])
    solution = np.linalg.lstsq(kkt, np.vstack([np.zeros((8 * segments, 4)), b]), rcond=1e-15)[0]
    return solution[: 8 * segments].T.reshape(4, segments, 8)


@pytest.mark.parametrize("segments", [1, 2, 3, 6])
def test_it_is_the_optimum_of_the_dense_program(segments):
    waypoints, durations = task(segments)
    ours = minimum_snap(waypoints, durations).coefficients
    dense = dense_minimum_snap(waypoints, durations)
    powers = durations[:, None] ** np.arange(8)
    np.testing.assert_allclose(ours * powers, dense * powers, atol=1e-6)


def test_a_single_segment_is_the_known_polynomial():
    plan = minimum_snap(np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 2.0, 0.0]]), np.array([2.0]))
    u = np.linspace(0.0, 1.0, 11)
    known = 35 * u**4 - 84 * u**5 + 70 * u**6 - 20 * u**7
    np.testing.assert_allclose(plan.derivative(2.0 * u, 0)[:, 2], 2.0 * known, atol=1e-14)


def test_it_agrees_with_rotorpy():
    rotorpy = pytest.importorskip("rotorpy.trajectories.minsnap")
    waypoints, _ = task(5, seed=3)
    # Bounds far out, so that RotorPy's speed limits at the midpoints do not bind and its problem is ours.
    peer = rotorpy.MinSnap(waypoints[:, :3], waypoints[:, 3], yaw_rate_max=1e3, v_max=1e3, v_avg=1.5, verbose=False)
    ours = minimum_snap(waypoints, np.asarray(peer.delta_t))
    for time in np.linspace(0.0, ours.duration_s - 1e-9, 41):
        flat = peer.update(time)
        np.testing.assert_allclose(ours.derivative(np.array([time]), 0)[0, :3], flat["x"], atol=2e-4)
        np.testing.assert_allclose(ours.derivative(np.array([time]), 0)[0, 3], flat["yaw"], atol=2e-4)


def test_it_agrees_with_minsnap_trajectories():
    peer = pytest.importorskip("minsnap_trajectories")
    waypoints, durations = task(6, seed=4)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    rest = np.zeros(4)
    references = [peer.Waypoint(time=t, position=w) for t, w in zip(times, waypoints, strict=True)]
    for end in (0, -1):
        references[end] = peer.Waypoint(times[end], waypoints[end], velocity=rest, acceleration=rest, jerk=rest)
    theirs = peer.generate_trajectory(
        references, degree=7, idx_minimized_orders=(4,), num_continuous_orders=4, algorithm="closed-form"
    )
    ours = minimum_snap(waypoints, durations)
    samples = np.linspace(0.0, ours.duration_s - 1e-9, 200)
    derivatives = peer.compute_trajectory_derivatives(theirs, samples, 4)
    for order in range(4):
        np.testing.assert_allclose(ours.derivative(samples, order), derivatives[order], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("order", range(1, 7))
def test_it_is_continuous_up_to_the_sixth_derivative(order):
    waypoints, durations = task(8, seed=1)
    coefficients = minimum_snap(waypoints, durations).coefficients
    ends = np.array([[c @ row(t, order) for c, t in zip(axis, durations, strict=True)] for axis in coefficients])
    starts = coefficients @ row(0.0, order)
    np.testing.assert_allclose(ends[:, :-1], starts[:, 1:], rtol=1e-8, atol=1e-8)


def test_two_hundred_uneven_segments_hold_their_waypoints():
    waypoints, durations = task(200, seed=2, spread=(0.1, 3.0))
    plan = minimum_snap(waypoints, durations)
    assert np.abs(plan.waypoints() - waypoints).max() < 1e-9
    ends = [plan.coefficients[:, i] @ row(t, 0) for i, t in enumerate(durations)]
    assert np.abs(ends - waypoints[1:]).max() < 1e-9


def test_a_row_does_not_depend_on_its_batch():
    tasks = [task(4, seed) for seed in range(5)]
    batch = minimum_snap_batch(np.stack([w for w, _ in tasks]), np.stack([d for _, d in tasks]))
    for together, (waypoints, durations) in zip(batch, tasks, strict=True):
        np.testing.assert_array_equal(together.coefficients, minimum_snap(waypoints, durations).coefficients)


def test_inputs_are_left_alone_and_may_be_lists_or_read_only():
    waypoints, durations = task(3)
    kept = waypoints.copy()
    waypoints.flags.writeable = durations.flags.writeable = False
    plan = minimum_snap(waypoints, durations)
    np.testing.assert_array_equal(waypoints, kept)
    again = minimum_snap(waypoints.tolist(), durations.tolist())
    np.testing.assert_array_equal(again.coefficients, plan.coefficients)


def test_snap_is_the_integral_of_the_squared_fourth_derivative():
    waypoints, durations = task(3, seed=5)
    plan = minimum_snap(waypoints, durations)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    total = np.zeros(4)
    for start, duration in zip(plan.knot_times_s[:-1], durations, strict=True):
        times = start + 0.5 * duration * (1.0 + nodes)
        total += 0.5 * duration * weights @ plan.derivative(times, 4) ** 2
    np.testing.assert_allclose(snap(Trajectories.stack([plan]))[0], total, rtol=1e-10)


GOOD = [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.5]]


@pytest.mark.parametrize(
    ("waypoints", "durations", "message"),
    [
        (GOOD[:1], [], "1 waypoint"),
        ([*GOOD[:2], GOOD[1]], [1.0, 1.0], "waypoint 2 and the next are equal"),
        ([GOOD[0], [1.0, math.nan, 1.0, 0.0]], [1.0], "waypoint 2 is not finite"),
        ([GOOD[0], [1.0, math.inf, 1.0, 0.0]], [1.0], "waypoint 2 is not finite"),
        (GOOD, [1.0, 0.0], "duration after waypoint 2 is 0 s"),
        (GOOD, [-1.0, 1.0], "duration after waypoint 1 is -1 s"),
        (GOOD, [1.0, math.nan], "duration after waypoint 2 is nan s"),
        (GOOD, [1.0], "3 waypoints need 2 durations"),
        ([p[:3] for p in GOOD], [1.0, 1.0], "x, y, z, yaw"),
        (GOOD, [1e-3, 100.0], "too uneven|cannot hold"),
        (GOOD, [1e-100, 1e100], "too uneven|cannot hold"),
    ],
)
def test_bad_input_is_refused_in_one_clear_line(waypoints, durations, message):
    with pytest.raises(InputError, match=message) as caught:
        minimum_snap(np.array(waypoints), np.array(durations))
    assert "\n" not in str(caught.value)


def test_a_bad_task_in_a_batch_is_named():
    waypoints = np.array([GOOD, GOOD, GOOD])
    waypoints[2, 1, 0] = math.nan
    with pytest.raises(InputError, match="task 2, waypoint 2"):
        minimum_snap_batch(waypoints, np.ones((3, 2)))


def test_a_turn_on_the_spot_is_planned():
    plan = minimum_snap(np.array([GOOD[0], [0.0, 0.0, 1.0, 1.5]]), np.array([2.0]))
    assert np.abs(plan.waypoints()[1] - [0.0, 0.0, 1.0, 1.5]).max() < 1e-12


def test_importing_the_planner_does_not_import_numba():
    code = "import sys, lcd_flight.planning.knots, lcd_flight.planning.search; print('numba' in sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "False"
