"""Every label of a rollout against a plain numpy recomputation from the recorded flight."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulator_plans import minimum_snap_plans, seeds

from lcd_flight.model import InputError, Loop, RolloutOptions, Trajectories, Trajectory
from lcd_flight.worlds import load_vehicle
from sim_bridge.kernels.judge import MAX_RATE, MAX_SPEED
from sim_bridge.rollouts import MultirotorSimulator
from sim_bridge.trace import RolloutTrace, trace

CRAZYFLIE, HUMMINGBIRD = load_vehicle("crazyflie"), load_vehicle("hummingbird")


def runs(clipped: np.ndarray) -> int:
    """Longest unbroken run of True."""
    longest = now = 0
    for value in clipped:
        now = now + 1 if value else 0
        longest = max(longest, now)
    return longest


def check(flight: RolloutTrace, plan: Trajectory) -> None:
    labels = flight.labels
    error = np.linalg.norm(flight.p_WB - flight.p_ref_W, axis=1)
    yaw = Rotation.from_quat(flight.q_WB).as_euler("ZYX")[:, 0]
    e_yaw = yaw - flight.yaw_ref_rad
    wrapped = np.angle(np.exp(1j * e_yaw))
    e_v = np.linalg.norm(flight.v_WB_W - flight.v_ref_W, axis=1)
    assert labels.max_error_m[0] == pytest.approx(error.max())
    assert labels.max_error_time_s[0] == pytest.approx(flight.times_s[error.argmax()])
    assert labels.mean_error_m[0] == pytest.approx(error.mean())
    assert labels.rms_error_m[0] == pytest.approx(np.sqrt((error**2).mean()))
    assert labels.p8_error_m[0] == pytest.approx((error**8).mean() ** 0.125)
    assert labels.yaw_cost[0] == pytest.approx((2.0 * (1.0 - np.cos(e_yaw))).mean())
    assert labels.paper_cost[0] == pytest.approx((error**2 + wrapped**2).sum())
    assert labels.released_cost[0] == pytest.approx((error**2 + e_v**2 + e_yaw**2).sum())
    clipped = flight.clipped[1:]
    assert labels.saturation_share[0] == pytest.approx(clipped.mean() / 4.0)
    assert labels.longest_saturation_s[0] == pytest.approx(0.01 * runs(clipped > 0.0))
    segment = np.clip(np.searchsorted(plan.knot_times_s, flight.times_s, side="right") - 1, 0, plan.segments - 1)
    for s in range(plan.segments):
        reached = segment == s
        expected = error[reached].max() if reached.any() else np.nan
        assert labels.segment_max_error_m[0, s] == pytest.approx(expected, nan_ok=True)
    for k, time_s in enumerate(plan.knot_times_s):
        inside = time_s <= flight.times_s[-1] + 1e-9
        position = [np.interp(time_s, flight.times_s, flight.p_WB[:, axis]) for axis in range(3)]
        expected = np.linalg.norm(position - plan.waypoints()[k, :3]) if inside else np.nan
        assert labels.waypoint_error_m[0, k] == pytest.approx(expected, abs=2e-3, nan_ok=True)


@pytest.mark.parametrize(("loop", "speed"), [("paper", 2.0), ("paper", 2.8), ("flight", 1.5), ("flight", 2.8)])
def test_labels_are_what_the_flight_says(loop: Loop, speed: float) -> None:
    plans = minimum_snap_plans(6, speed, seed=2)
    for index, plan in enumerate(plans):
        flight = trace(plan, CRAZYFLIE, index, RolloutOptions(loop=loop))
        assert len(flight.times_s) == int(np.ceil(plan.duration_s / 0.01)) + 1
        check(flight, plan)


def test_references_are_the_plans() -> None:
    plan = minimum_snap_plans(1, 1.5, seed=3)[0]
    flight = trace(plan, CRAZYFLIE, 0, RolloutOptions())
    assert np.allclose(flight.p_ref_W, plan.derivative(flight.times_s, 0)[:, :3], atol=1e-9)
    assert np.allclose(flight.v_ref_W, plan.derivative(flight.times_s, 1)[:, :3], atol=1e-8)
    assert np.allclose(flight.yaw_ref_rad, plan.derivative(flight.times_s, 0)[:, 3], atol=1e-9)


def test_a_rollout_that_leaves_the_models_validity_ends_there() -> None:
    """About one Hummingbird in two hundred spins beyond 100 rad/s: errors until then, the rest never reached."""
    plans = minimum_snap_plans(1000, 2.0, seed=4)
    labels = MultirotorSimulator().rollout(plans, HUMMINGBIRD, seeds(1000), RolloutOptions())
    left = np.nonzero(~labels.valid)[0]
    assert len(left) > 0
    assert (MAX_SPEED, MAX_RATE) == (20.0, 100.0)
    assert labels.crashed[left].all()
    for index in left[:5]:
        plan = plans[int(index)]
        flight = trace(plan, HUMMINGBIRD, int(index), RolloutOptions())
        assert len(flight.times_s) < int(np.ceil(plan.duration_s / 0.01)) + 1
        assert np.abs(flight.v_WB_W).max() <= MAX_SPEED
        assert np.abs(flight.w_WB_B).max() <= MAX_RATE
        check(flight, plan)
        assert np.isnan(flight.labels.waypoint_error_m[0, -1])


def test_the_start_is_aligned_or_at_yaw_zero() -> None:
    plan = minimum_snap_plans(1, 1.0, seed=5)[0]
    yaw = plan.waypoints()[0, 3]
    aligned = trace(plan, CRAZYFLIE, 0, RolloutOptions(start_aligned=True)).q_WB[0]
    zero = trace(plan, CRAZYFLIE, 0, RolloutOptions(start_aligned=False)).q_WB[0]
    assert aligned == pytest.approx([0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])
    assert zero == pytest.approx([0.0, 0.0, 0.0, 1.0])


def test_waypoint_errors_between_ticks_are_interpolated_well() -> None:
    """Knots that fall between ticks: a hundredth of a millimetre off for a smooth flight."""
    plan = minimum_snap_plans(1, 1.1, seed=6)[0]
    flight = trace(plan, CRAZYFLIE, 0, RolloutOptions())
    from scipy.interpolate import CubicSpline

    position = CubicSpline(flight.times_s, flight.p_WB)(plan.knot_times_s[1:-1])
    expected = np.linalg.norm(position - plan.waypoints()[1:-1, :3], axis=1)
    assert flight.labels.waypoint_error_m[0, 1:-1] == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"controller": "mystery"}, "controller 'mystery' is not known to the simulator; it has: geometric, "),
        ({"loop": "both"}, "loop 'both' is not known to the simulator; it has: paper, flight"),
        *(
            ({"loop": "flight", "controller": name}, f"controller '{name}' flies in the paper's loop only")
            for name in ("geometric-feed-forward", "geometric-drag", "geometric-l1")
        ),
    ],
)
def test_unknown_options_are_refused(change: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        MultirotorSimulator().rollout(minimum_snap_plans(1, 1.0), CRAZYFLIE, seeds(1), RolloutOptions(**change))


def test_what_cannot_be_flown_is_refused() -> None:
    simulator, plans = MultirotorSimulator(), minimum_snap_plans(2, 1.0)
    broken = Trajectories(plans.durations_s, np.where(np.arange(8) == 3, np.nan, plans.coefficients))
    for bad in (broken, Trajectories(-plans.durations_s, plans.coefficients)):
        with pytest.raises(InputError, match="a plan has durations that are not positive or coefficients"):
            simulator.rollout(bad, CRAZYFLIE, seeds(2), RolloutOptions())
    with pytest.raises(InputError, match="2 plans need as many seeds, got 3"):
        simulator.rollout(plans, CRAZYFLIE, seeds(3), RolloutOptions())
    with pytest.raises(InputError, match="vehicle hummingbird has no onboard controller"):
        simulator.rollout(plans, HUMMINGBIRD, seeds(2), RolloutOptions(loop="flight"))
