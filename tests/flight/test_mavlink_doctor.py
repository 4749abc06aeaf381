"""`lcd doctor` looks at a simulated autopilot, says what it finds and changes nothing."""

from __future__ import annotations

import pytest
from mavlink_bench import CLOCK, Bench, bench, kind_of, run

from drivers.mavlink import options
from drivers.mavlink.inspection import look
from lcd_flight.model import Inspection, RefusedError
from lcd_flight.plugins.entry_points import names

FLAVOURS = ["px4", "ardupilot"]


async def looked_at(made: Bench, given: str = "") -> Inspection:
    pairs = dict(pair.split("=", 1) for pair in given.split("&") if pair)
    chosen = options.read("mavlink+udp", "127.0.0.1:14540", {"autopilot": made.flavour, **pairs})
    return await look("mavlink+udp://127.0.0.1:14540", chosen, CLOCK, made.air)


@pytest.mark.parametrize(("flavour", "name"), [("px4", "PX4 1.16.0"), ("ardupilot", "ArduPilot 4.6.3")])
def test_it_lists_what_is_there(flavour: str, name: str) -> None:
    async def main() -> None:
        async with bench(flavour) as made:
            found = await looked_at(made)
        facts = dict(found.facts)
        assert found.description == name
        assert facts["autopilot"] == name
        assert facts["mode"].endswith(", disarmed")
        assert facts["battery"].endswith(" V")
        assert facts["signing"] == "none"
        assert facts["reports"].endswith(" a second, 0% lost")
        assert facts["left out"] == "nothing"
        assert facts["estimator"].startswith("no ")  # nobody tells it poses
        assert found.differences == ()
        assert found.problems == ()

    run(main)


def test_wrong_parameters_are_problems_or_what_flight_would_set() -> None:
    async def main() -> None:
        async with bench("px4", wrong="COM_OF_LOSS_T:1,EKF2_HGT_REF:1") as made:
            found = await looked_at(made)
            assert [problem.split()[0] for problem in found.problems] == ["COM_OF_LOSS_T", "EKF2_HGT_REF"]
            found = await looked_at(made, "set_parameters=true")
            assert [problem.split()[0] for problem in found.problems] == ["EKF2_HGT_REF"]
            assert found.differences == (
                "COM_OF_LOSS_T is 1, flight sets 0.5: s; so long it goes on with the last setpoint after the stream "
                "has stopped",
            )

    run(main)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_it_changes_nothing(flavour: str) -> None:
    """Heartbeats, answers to TIMESYNC, requests to read; no parameter, no mode, no setpoint, no pose, no origin."""

    async def main() -> None:
        async with bench(flavour) as made:
            await looked_at(made)
            kinds = {kind_of(data) for _, data in made.air.ups}
            assert kinds <= {0, 20, 76, 111}
            asked = {int.from_bytes(data[38:40], "little") for _, data in made.air.sent(76)}
            assert asked == {511, 512}

    run(main)


def test_nobody_there() -> None:
    async def main() -> None:
        async with bench(tampers=lambda _data, _up, _now_ns: []) as made:
            with pytest.raises(RefusedError, match="no heartbeat from system 1"):
                await looked_at(made, "connect_s=1")
            assert made.air.receive is None

    run(main)


def test_every_kind_of_link_can_be_looked_at() -> None:
    assert {"mavlink+udp", "mavlink+tcp", "mavlink+serial"} <= set(names("link_inspectors")) & set(names("links"))
