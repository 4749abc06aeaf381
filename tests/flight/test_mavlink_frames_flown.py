"""Frames by flight: a step along an axis of motion capture's frame moves the vehicle there, whatever the frame.

The simulated vehicle turns what it is told into its own frames by its own code; nothing of the link's is used there.
"""

from __future__ import annotations

import math

import pytest
from mavlink_bench import CLOCK, VEHICLE, Bench, bench, run, wait_s

from drivers.mavlink.link import MavlinkLink
from lcd_flight.control import flight_law
from lcd_flight.model import Reference, Vector3
from lcd_flight.model.frames import rotate, wrapped, yaw_of

ZERO = (0.0, 0.0, 0.0)
STEP_M, STEP_RAD = 0.4, 0.5


class Holder:
    """Holds places with the flight's own law, on motion capture's pose."""

    def __init__(self, made: Bench, link: MavlinkLink) -> None:
        self._made, self._link = made, link
        self._integral: Vector3 = ZERO

    async def hold(self, place: Vector3, yaw_rad: float, seconds: float) -> None:
        reference = Reference(place, ZERO, ZERO, ZERO, ZERO, yaw_rad, 0.0, 0.0)
        for _ in range(round(seconds * 100)):
            now_ns = CLOCK.now_ns()
            self._link.report(now_ns)
            state = self._made.pose.report(now_ns).state
            assert state is not None
            setpoint, self._integral = flight_law.command(state, reference, VEHICLE, self._integral, 0.01)
            self._link.send(setpoint, now_ns)
            await wait_s(0.01)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize(("frame", "mocap_yaw_rad"), [("enu", 0.0), ("flu", 0.9), ("flu", -2.2)])
def test_a_step_moves_it_there(flavour: str, frame: str, mocap_yaw_rad: float) -> None:
    async def main() -> None:
        where = {"start_m": (0.7, -0.4, 0.0), "yaw_rad": 0.6}  # in the true world
        async with bench(flavour, mocap_yaw_rad=mocap_yaw_rad, **where) as made:
            start = made.state
            async with made.link(f"frame={frame}", initial_position_m=start.p_WB) as link:
                telemetry = link.report(CLOCK.now_ns()).telemetry
                assert telemetry is not None
                assert telemetry.p_WB == pytest.approx(start.p_WB, abs=0.02)
                assert telemetry.q_WB is not None
                assert yaw_of(telemetry.q_WB) == pytest.approx(yaw_of(start.q_WB), abs=0.02)
                await link.arm()
                holder, home = Holder(made, link), (start.p_WB[0], start.p_WB[1], 0.6)
                yaw_rad = yaw_of(start.q_WB)
                await holder.hold(home, yaw_rad, 2.0)
                assert math.dist(made.state.p_WB, home) < 0.12
                for axis in range(3):
                    goal = tuple(p + STEP_M * (n == axis) for n, p in enumerate(home))
                    await holder.hold(goal, yaw_rad, 1.5)  # type: ignore[arg-type]
                    moved = [b - a for a, b in zip(home, made.state.p_WB, strict=True)]
                    assert moved[axis] == pytest.approx(STEP_M, abs=0.15)
                    assert all(abs(m) < 0.15 for n, m in enumerate(moved) if n != axis)
                await holder.hold(home, yaw_rad + STEP_RAD, 1.5)
                assert wrapped(yaw_of(made.state.q_WB) - yaw_rad) == pytest.approx(STEP_RAD, abs=0.1)
                link.stop_motors()

    run(main)


def test_poses_and_setpoints_in_different_frames_would_be_noticed() -> None:
    """The test above can fail: with one frame for poses and the other for setpoints, it does not go where it should."""

    async def main() -> None:
        async with bench("px4") as made, made.link() as link:
            await link.arm()
            holder = Holder(made, link)
            await holder.hold((0.0, 0.0, 0.6), 0.0, 2.0)
            link._options = type(link._options)(**{**_fields(link), "frame": "flu"})
            await holder.hold((STEP_M, 0.0, 0.6), 0.0, 1.0)
            moved = rotate((0.0, 0.0, 0.0, 1.0), made.state.p_WB)
            heading = yaw_of(made.state.q_WB)
            assert abs(moved[0] - STEP_M) > 0.15 or abs(heading) > 0.5
            link.stop_motors()

    run(main)


def _fields(link: MavlinkLink) -> dict[str, object]:
    return {name: getattr(link._options, name) for name in link._options.__struct_fields__}
