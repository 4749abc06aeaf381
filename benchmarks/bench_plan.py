"""What a plan costs: minimum snap against RotorPy's and minsnap-trajectories', the same tasks on both sides.

Processor time on one thread, so that a busy machine and idle BLAS threads that spin do not count for anybody.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import minsnap_trajectories as peer_trajectories
import numpy as np
from rotorpy.trajectories.minsnap import MinSnap
from threadpoolctl import threadpool_limits

from benchmarks.released_planner import planner
from lcd_flight.model import FloatArray, RolloutOptions, Tasks, Trajectory
from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features, segment_features_pullback
from lcd_flight.planning.cost.model_file import load_model
from lcd_flight.planning.cost.tracking_cost import CostModel
from lcd_flight.planning.knots import Whitening
from lcd_flight.planning.minimum_snap import minimum_snap, minimum_snap_batch
from lcd_flight.planning.planner import plan_batch
from lcd_flight.planning.polish import candidates_of, polish
from lcd_flight.planning.search import Arena
from lcd_flight.planning.times import allocate
from lcd_flight.worlds import load_world
from sim_bridge.rollouts import MultirotorSimulator

SPEED = 2.0
MODEL = "crazyflie-paper"
SECONDS = 0.5
"""Each side is repeated for about this long, and at least twice."""
BATCH = 20_000
SAME = 1e-3
"""Both sides must plan the same path, m; RotorPy's interior-point solver is this exact."""

LEARNED = ((1, 3), (500, 3), (1, 9), (1, 25), (1, 50), (1, 100))
"""Tasks at once, and segments of each."""
POLISHED = ((1, 3), (200, 3), (1, 9), (1, 25), (1, 50), (1, 100))
RELEASED = "jaxopt on the released objective"

Report = Callable[[str], None]
Row = dict[str, Any]


def rows(report: Report) -> list[Row]:
    """All rows of `lcd bench plan`."""
    with threadpool_limits(1):
        return [*minimum_snap_rows(report), *learned_rows(report), *polished_rows(report), *released_rows(report)]


def minimum_snap_rows(report: Report) -> list[Row]:
    """One task of 3 to 200 segments, and many tasks at once."""
    measured = []
    for segments in (3, 10, 50):
        measured.append(_one_task(segments, "RotorPy MinSnap", _rotorpy, report))
        measured.append(_one_task(segments, "minsnap-trajectories", _trajectories, report))
    measured.append(_one_task(200, "minsnap-trajectories", _trajectories, report))
    measured.append(_batched(report))
    return measured


def learned_rows(report: Report) -> list[Row]:
    """What the learned tracking cost takes; the planner's rows need a model that ships."""
    durations, coefficients = _segments(BATCH)
    report("features of a segment")
    forward = _least_s(lambda: segment_features(durations, coefficients)) / BATCH
    grad = np.ones((BATCH, 1, len(FEATURE_NAMES)))
    backward = _least_s(lambda: segment_features_pullback(durations, coefficients, grad)) / BATCH
    measured = [
        _row_alone("features of a segment", "us", 1e6 * forward),
        _row_alone("pullback of the features of a segment", "us", 1e6 * backward),
    ]
    model = load_model(MODEL)
    return measured + [_learned(model, tasks, segments, report) for tasks, segments in LEARNED]


def polished_rows(report: Report) -> list[Row]:
    """The default of missions: solve, check, search in the simulator, check again."""
    world = load_world("crazyflie-saturated")
    arena = Arena(MultirotorSimulator(), world.vehicle(3), RolloutOptions(threads=1))
    return [_polished(load_model(MODEL), arena, tasks, segments, report) for tasks, segments in POLISHED]


def released_rows(report: Report) -> list[Row]:
    """One plan of three segments, beside the released code's solver; without a peer where jaxopt is not installed."""
    what = "learned plan, 3 segments, one task, beside the released planner"
    report(what)
    waypoints = _waypoints(1, 3)[0]
    durations = allocate(waypoints, SPEED)
    tasks, model = Tasks(waypoints[None, :, :3], waypoints[None, :, 3]), load_model(MODEL)
    ours = _least_s(lambda: plan_batch(tasks, durations[None], model))
    try:
        released = planner(minimum_snap(waypoints, durations).coefficients)
    except ImportError:
        report("jaxopt is not installed: pip install 'lcd-flight[jaxopt]'")
        return [_row_alone(what, "CPU ms", 1e3 * ours)]
    return [_row(what, "CPU ms", 1e3 * ours, 1e3 * _least_s(lambda: released(waypoints, durations)), RELEASED)]


def _segments(count: int) -> tuple[FloatArray, FloatArray]:
    """`count` segments of minimum snap, each a plan of its own: (N, 1) and (N, 4, 1, 8)."""
    waypoints = _waypoints(-(-count // 3), 3)
    plans = minimum_snap_batch(waypoints, allocate(waypoints, SPEED))
    coefficients = plans.coefficients.transpose(0, 2, 1, 3).reshape(-1, 4, 1, 8)
    return plans.durations_s.reshape(-1, 1)[:count], coefficients[:count]


def _learned(model: CostModel, tasks: int, segments: int, report: Report) -> Row:
    """A whole plan: 40 steps, and the judgement of what they led to."""
    what = f"learned plan, {segments} segments, " + ("one task" if tasks == 1 else f"{tasks} tasks at once")
    report(what)
    poses = _waypoints(tasks, segments)
    some = Tasks(poses[..., :3], poses[..., 3])
    durations = some.durations_s(SPEED)
    took = _least_s(lambda: plan_batch(some, durations, model)) / tasks
    return _row_alone(what, "CPU ms" if tasks == 1 else "CPU ms a task", 1e3 * took)


def _polished(model: CostModel, arena: Arena, tasks: int, segments: int, report: Report) -> Row:
    """As `learned-polished` plans."""
    what = f"learned-polished plan, {segments} segments, " + ("one task" if tasks == 1 else f"{tasks} tasks at once")
    report(what)
    poses = _waypoints(tasks, segments)
    some = Tasks(poses[..., :3], poses[..., 3])
    durations = some.durations_s(SPEED)

    def work() -> None:
        solved, space = plan_batch(some, durations, model), Whitening.of(poses, durations)
        polish(space, candidates_of(space, solved), arena, seed=0, tasks=np.arange(tasks))

    return _row_alone(what, "CPU ms" if tasks == 1 else "CPU ms a task", 1e3 * _least_s(work) / tasks)


def _row_alone(what: str, unit: str, ours: float) -> Row:
    """Of something that no peer has."""
    return {"what": what, "unit": unit, "ours": ours, "peer": None, "peer_name": None, "ratio": None}


def _one_task(segments: int, peer_name: str, peer: Callable[[FloatArray], Trajectory], report: Report) -> Row:
    report(f"minimum snap, {segments} segments, {peer_name}")
    waypoints = _waypoints(1, segments)[0]
    _check_same(_ours(waypoints), peer(waypoints), peer_name)
    ours = _least_s(lambda: _ours(waypoints))
    theirs = _least_s(lambda: peer(waypoints))
    return _row(f"minimum snap, {segments} segments", "CPU ms", 1e3 * ours, 1e3 * theirs, peer_name)


def _batched(report: Report) -> Row:
    """Per task of 3 segments; the peers plan one at a time, so the faster of them stands for both."""
    report(f"minimum snap, 3 segments, {BATCH} tasks at once")
    waypoints = _waypoints(BATCH, 3)
    minimum_snap_batch(waypoints[:2], allocate(waypoints[:2], SPEED))
    ours = _least_s(lambda: minimum_snap_batch(waypoints, allocate(waypoints, SPEED))) / BATCH
    some = waypoints[:50]
    theirs = _least_s(lambda: [_trajectories(w) for w in some]) / len(some)
    name = "minsnap-trajectories, one by one"
    return _row(f"minimum snap, 3 segments, in a batch of {BATCH}", "CPU us a task", 1e6 * ours, 1e6 * theirs, name)


def _row(what: str, unit: str, ours: float, theirs: float, peer_name: str) -> Row:
    return {"what": what, "unit": unit, "ours": ours, "peer": theirs, "peer_name": peer_name, "ratio": theirs / ours}


def _waypoints(tasks: int, segments: int) -> FloatArray:
    """(N, K, 4) steps of 1 to 3 m with turns of up to half a right angle, the same in every run."""
    rng = np.random.default_rng(0)
    steps = rng.normal(size=(tasks, segments, 3))
    steps *= rng.uniform(1.0, 3.0, (tasks, segments, 1)) / np.linalg.norm(steps, axis=2, keepdims=True)
    turns = rng.uniform(-0.8, 0.8, (tasks, segments, 1))
    way = np.cumsum(np.concatenate([steps, turns], axis=2), axis=1)
    return np.concatenate([np.zeros((tasks, 1, 4)), way], axis=1)


def _ours(waypoints: FloatArray) -> Trajectory:
    return minimum_snap(waypoints, allocate(waypoints, SPEED))


def _rotorpy(waypoints: FloatArray) -> Trajectory:
    """RotorPy's, with its speed bounds out of the way so that it solves the same problem."""
    plan = MinSnap(waypoints[:, :3], waypoints[:, 3], yaw_rate_max=1e3, v_max=1e3, v_avg=SPEED, verbose=False)
    coefficients = np.concatenate([plan.x_poly, plan.yaw_poly], axis=1)[:, :, ::-1]
    return Trajectory(np.asarray(plan.delta_t), coefficients.transpose(1, 0, 2))


def _trajectories(waypoints: FloatArray) -> Trajectory:
    """minsnap-trajectories' closed form, its faster one."""
    times = np.concatenate([[0.0], np.cumsum(allocate(waypoints, SPEED))])
    rest = np.zeros(4)
    references = [peer_trajectories.Waypoint(t, w) for t, w in zip(times, waypoints, strict=True)]
    for end in (0, -1):
        references[end] = peer_trajectories.Waypoint(times[end], waypoints[end], rest, rest, rest)
    plan = peer_trajectories.generate_trajectory(
        references, degree=7, idx_minimized_orders=(4,), num_continuous_orders=4, algorithm="closed-form"
    )
    return Trajectory(np.diff(times), plan.coefficients.transpose(2, 0, 1))


def _check_same(ours: Trajectory, theirs: Trajectory, peer_name: str) -> None:
    """A comparison of different problems would mean nothing."""
    times = np.linspace(0.0, ours.duration_s, 500)
    apart = np.abs(ours.derivative(times, 0) - theirs.derivative(times, 0)).max()
    if not apart < SAME:
        raise AssertionError(f"{peer_name} plans another path: {apart:.2g} m apart")


def _least_s(work: Callable[[], Any]) -> float:
    """The least processor time of repeated calls of `work`, in s: what else the machine does only ever adds."""
    durations: list[float] = []
    began = time.perf_counter()
    while len(durations) < 2 or (time.perf_counter() - began < SECONDS and len(durations) < 1000):
        start = time.process_time()
        work()
        durations.append(time.process_time() - start)
    return min(durations)
