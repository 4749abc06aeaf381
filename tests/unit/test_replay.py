"""Replay: the same flight to the bit, where another law would have gone, and logs that miss ticks."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import flight_bench
import pytest
import synthetic_flight

from lcd_flight.cli.main import app, run
from lcd_flight.control import flight_law
from lcd_flight.flight.replay import compare
from lcd_flight.flight.setup import FlightSetup
from lcd_flight.model import AttitudeThrust, InputError, Reference, State, Vector3, Vehicle
from lcd_flight.plugins import controller
from lcd_flight.record import LogWriter
from lcd_flight.worlds import load_vehicle
from lcd_flight.worlds.gains import load_gains

GREATEST_N = load_vehicle("crazyflie").max_thrust_N


@cache
def flight() -> flight_bench.Flight:
    return flight_bench.fly()


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return written(tmp_path / "flight.mcap", flight())


def written(path: Path, ticks: flight_bench.Flight) -> Path:
    header = synthetic_flight.header(plan=flight_bench.plan(), limits=flight_bench.LIMITS)
    writer = LogWriter(path, header)
    for inputs, tick in ticks:
        writer.write(inputs, tick)
    writer.close()
    return path


def with_law(law: object) -> FlightSetup:
    return FlightSetup.of(flight_bench.plan(), load_vehicle("crazyflie"), flight_bench.LIMITS, law)  # type: ignore[arg-type]


def last_bit(
    state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
) -> tuple[AttitudeThrust, Vector3]:
    """The flight's law on a machine that rounds the last bit otherwise."""
    setpoint, integral = flight_law.command(state, reference, vehicle, integral, dt_s)
    x, y, z, w = setpoint.q_WB
    turned = (math.nextafter(x, 2.0), math.nextafter(y, -2.0), z, math.nextafter(w, 0.0))
    return replace(setpoint, thrust_N=math.nextafter(setpoint.thrust_N, 9.0), q_WB=turned), integral


def stronger(
    state: State, reference: Reference, vehicle: Vehicle, integral: Vector3, dt_s: float
) -> tuple[AttitudeThrust, Vector3]:
    setpoint, integral = flight_law.command(state, reference, vehicle, integral, dt_s)
    return replace(setpoint, thrust_N=setpoint.thrust_N + 0.001), integral


def test_the_same_flight_to_the_bit() -> None:
    found = compare(flight(), flight_bench.setup())
    assert found.equal
    assert found.agrees(GREATEST_N)
    assert (len(found.pairs), found.thrust_N, found.angle_rad, found.missing_after) == (len(flight()), 0.0, 0.0, None)


def test_a_machine_that_rounds_the_last_bit_otherwise_agrees() -> None:
    found = compare(flight(), with_law(last_bit))
    assert not found.equal
    assert found.agrees(GREATEST_N)
    assert found.thrust_N > 0.0


def test_another_law_does_not() -> None:
    found = compare(flight(), with_law(stronger))
    assert not found.agrees(GREATEST_N)
    assert found.thrust_N == pytest.approx(0.001)
    assert found.angle_rad < 1e-6


def test_a_phase_that_comes_out_otherwise_is_no_rounding() -> None:
    logged = [(i, replace(t, phase=flight()[400][1].phase) if n == 1 else t) for n, (i, t) in enumerate(flight())]
    found = compare(logged, flight_bench.setup())
    assert [d.logged.sequence for d in found.different] == [1]
    assert (found.thrust_N, found.angle_rad) == (0.0, 0.0)
    assert not found.agrees(GREATEST_N)


def test_after_missing_ticks_there_is_nothing_to_compare() -> None:
    found = compare([*flight()[:300], *flight()[310:]], flight_bench.setup())
    assert found.equal
    assert (len(found.pairs), found.missing_after) == (300, 299)


# The command


def test_the_command_finds_the_same_flight(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["replay", str(log), "--json"]) == 0
    told = capsys.readouterr()
    facts = json.loads(told.out)
    assert (facts["outcome"], facts["equal"], facts["ticks"]) == ("ok", True, len(flight()))
    assert "every one the same to the bit" in told.err


def test_a_flight_that_comes_out_otherwise_exits_with_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ticks = [(i, replace(t, setpoint=AttitudeThrust(0.1, t.setpoint.q_WB)) if t.setpoint else t) for i, t in flight()]
    assert run(app, ["replay", str(written(tmp_path / "other.mcap", ticks)), "--json"]) == 1
    told = capsys.readouterr()
    assert json.loads(told.out)["outcome"] == "different"
    assert "the tick decides otherwise than it did in flight" in told.err
    assert told.err.count("error:") == 1


def test_other_gains_answer_a_question(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "gains.yaml").write_text("position: [9.0, 9.0, 20.0]\n")
    table = tmp_path / "both.csv"
    command = ["replay", str(log), "--gains", str(tmp_path / "gains.yaml"), "--csv", str(table), "--json"]
    assert run(app, command) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["max_thrust_difference_N"] > 1e-3
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert len(rows) == len(flight())
    apart = [abs(float(r["logged_thrust_N"]) - float(r["replayed_thrust_N"])) for r in rows if r["logged_thrust_N"]]
    assert max(apart) == pytest.approx(facts["max_thrust_difference_N"])
    assert rows[0]["replayed_thrust_N"] == ""


def test_a_law_of_the_users_own(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    law = tmp_path / "law.py"
    law.write_text(
        "from lcd_flight.control.flight_law import command\n"
        "def softer(state, reference, vehicle, integral, dt_s):\n"
        "    setpoint, integral = command(state, reference, vehicle, integral, dt_s)\n"
        "    return type(setpoint)(0.9 * setpoint.thrust_N, setpoint.q_WB, setpoint.yaw_rate), integral\n"
    )
    assert run(app, ["replay", str(log), "--controller", f"{law}:softer", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["max_thrust_difference_N"] > 0.01


def test_a_log_without_its_first_tick_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "late.mcap", flight()[5:])
    assert run(app, ["replay", str(path)]) == 2
    assert "its first tick is missing: a replay begins with it" in capsys.readouterr().err


def test_a_log_that_misses_ticks_is_compared_until_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "gap.mcap", [*flight()[:300], *flight()[310:]])
    assert run(app, ["replay", str(path)]) == 0
    assert "ticks are missing after tick 299" in capsys.readouterr().out


# Laws and gains out of files


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def command(", r"law\.py: SyntaxError"),
        ("x = 1 / 0", r"law\.py: ZeroDivisionError: division by zero"),
        ("def other(): ...", r"law\.py: has no function 'command'; a controller is given as FILE\.py:FUNCTION"),
    ],
)
def test_a_file_that_holds_no_law(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "law.py").write_text(text)
    with pytest.raises(InputError, match=message):
        controller(f"{tmp_path / 'law.py'}:command")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("raise TypeError('what?')", r"controller .*law\.py:command: TypeError: what\?"),
        ("return 1, 2", r"controller .*law\.py:command: gave 1; \(AttitudeThrust, integral\) is wanted"),
        ("return None", r"controller .*law\.py:command: TypeError: "),
    ],
)
def test_a_law_that_does_wrong_is_named(tmp_path: Path, body: str, message: str) -> None:
    (tmp_path / "law.py").write_text(f"def command(state, reference, vehicle, integral, dt_s):\n    {body}\n")
    with pytest.raises(InputError, match=message):
        compare(flight(), with_law(controller(f"{tmp_path / 'law.py'}:command")))


def test_no_such_law(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown controller 'sliding'; there are: flight"):
        controller("sliding")
    with pytest.raises(InputError, match="there is no such file"):
        controller(f"{tmp_path}/none.py:command")


def test_gains_stand_in_for_those_given_alone(tmp_path: Path) -> None:
    base = load_vehicle("crazyflie").flight_gains
    (tmp_path / "gains.yaml").write_text("velocity: [1.0, 2.0, 3.0]\nintegral_limit: 0.5\n")
    assert load_gains(tmp_path / "gains.yaml", base) == replace(base, velocity=(1.0, 2.0, 3.0), integral_limit=0.5)
    (tmp_path / "gains.yaml").write_text("velocity: [1.0, 2.0]\nkp: 3\n")
    with pytest.raises(InputError) as refused:
        load_gains(tmp_path / "gains.yaml", base)
    assert len(str(refused.value).splitlines()) == 2
