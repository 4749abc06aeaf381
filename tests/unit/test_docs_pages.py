"""What the documentation says, held to the code: tables, figures, links, commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer
from docs_pages import PAGES, ROOT, blocks, monitors_table, page, table
from flight_bench import LIMITS, TICK_NS, healthy, plan
from typer.exceptions import TyperException

from lcd_flight.cli.main import app, flyer
from lcd_flight.flight.manoeuvres import BLIND_MARGIN
from lcd_flight.flight.operator import INTERRUPTS, KEYS
from lcd_flight.flight.phases import LANDING_GRACE_S, TIME_LIMITS_S, as_table
from lcd_flight.learning.collect import Mix
from lcd_flight.learning.dataset_card import column_table
from lcd_flight.learning.mix import SOURCES
from lcd_flight.learning.recipes import RECIPES
from lcd_flight.learning.rollouts import Source
from lcd_flight.learning.schema import SCHEMA_VERSION
from lcd_flight.model import Command, Outcome, State
from lcd_flight.model.frames import IDENTITY
from lcd_flight.planning.cost.features import FEATURE_NAMES
from lcd_flight.safety.preflight import preflight
from lcd_flight.worlds import load_world, world_names
from lcd_flight.worlds.vehicles import VehicleData

HERE = sorted([*PAGES, *(ROOT / "docs" / "decisions").glob("*.md")])


@pytest.mark.parametrize("path", HERE, ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)\)", path.read_text(encoding="utf-8"))
    assert [t for t in targets if "://" not in t and not (path.parent / t).exists()] == []


def test_the_index_names_every_page() -> None:
    assert {path.name for path in PAGES} - {"README.md"} == set(re.findall(r"\]\((\w+\.md)\)", page("README.md")))


def commands() -> list[str]:
    found = {
        line.partition(" #")[0].strip() for p in PAGES for b in blocks(p.name, "sh") for line in b.text.splitlines()
    }
    return sorted(line for line in found if line.startswith(("lcd ", "lcd-fly ")))


@pytest.mark.parametrize("line", commands())
def test_documented_commands_are_understood(line: str) -> None:
    program, *arguments = shlex.split(line)
    command = typer.main.get_command(app if program == "lcd" else flyer)
    context = command.make_context(program, arguments)
    if program == "lcd":
        name, *rest = arguments
        command.get_command(context, name).make_context(name, rest, parent=context)  # type: ignore[attr-defined]


def test_a_wrong_command_would_be_noticed() -> None:
    with pytest.raises(TyperException):
        test_documented_commands_are_understood("lcd train --loop flight")


def test_phases() -> None:
    assert as_table() in page("safety.md"), as_table()


def test_time_limits() -> None:
    text = page("safety.md").partition("| phase | lasts at most |")[2].partition("\n\n")[0]
    told = {name: float(limit_s) for name, limit_s in re.findall(r"^\| (\w+) \| (\d+) s \|$", text, re.MULTILINE)}
    assert told == {str(phase): limit_s for phase, limit_s in TIME_LIMITS_S.items()}
    assert f"| land, land_now | its path, and {LANDING_GRACE_S:g} s |" in text
    assert f"| descend_blind | {BLIND_MARGIN:g} times what the height takes |" in text


def test_monitors() -> None:
    assert monitors_table() in page("safety.md"), monitors_table()


def test_preflight_checks() -> None:
    at_rest = State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), IDENTITY, (0.0, 0.0, 0.0))
    checks = preflight([healthy(i, at_rest, i * TICK_NS) for i in range(200)], plan(), LIMITS)
    assert [check.name for check in checks] == [row[0] for row in table("safety.md", "check")]


def test_outcomes() -> None:
    told = {name: int(code) for name, code, _ in table("safety.md", "outcome")}
    assert told == {outcome.value: outcome.exit_code for outcome in Outcome}


def test_keys_and_signals() -> None:
    words = {
        "land now": Command.LAND,
        "go on after a brake": Command.RESUME,
        "stop the motors": Command.STOP_MOTORS,
        "descend level": Command.DESCEND,
    }
    told = {key: words[text] for key, text in table("safety.md", "key or signal")}
    names = {b" ": "space"}
    assert told == {
        **{names.get(key, key.decode()): command for key, command in KEYS.items()},
        **{f"{n} Ctrl-C": command for n, command in zip(("first", "second", "third"), INTERRUPTS, strict=True)},
        "SIGTERM, SIGHUP": Command.LAND,
    }


def test_worlds() -> None:
    told = {name: (vehicle, float(speed), loop) for name, vehicle, speed, loop in table("simulator.md", "world")}
    worlds = [load_world(name) for name in world_names()]
    assert told == {w.name: (w.base_vehicle.name, w.speed, w.loop) for w in worlds}
    assert all(w.start_aligned and w.sampler.waypoints == 4 for w in worlds)
    assert all(w.sampler.box_m == (10.0, 10.0, 10.0) and w.sampler.margin_m == 2.0 for w in worlds)
    assert all(w.base_vehicle.motor_time_constant_s == 0.005 and w.base_vehicle.motor_noise == 100.0 for w in worlds)


def test_drag_configurations() -> None:
    told = tuple((float(xy), float(xy), float(z)) for _, xy, z in table("simulator.md", "configuration"))
    assert all(load_world(name).drag_configurations == told for name in world_names())


def test_keys_of_a_vehicle_file() -> None:
    told = [name for row in table("simulator.md", "key") for name in row[0].split(", ")]
    assert told == list(VehicleData.model_fields)


def test_features() -> None:
    """Each row's columns, in order, and each row's first words among the names of these columns."""
    next_column = 0
    for columns, text in table("method.md", "columns"):
        first, _, last = columns.partition("-")
        assert int(first) == next_column
        next_column = int(last or first) + 1
        names = " ".join(FEATURE_NAMES[int(first) : next_column])
        assert text.partition(":")[0].partition(",")[0].removesuffix(" x and y").partition(" over")[0] in names
    assert next_column == len(FEATURE_NAMES)


def test_recipes_and_mix() -> None:
    world, mix = load_world("crazyflie-flight"), Mix()
    assert [row[0] for row in table("method.md", "recipe")] == list(RECIPES)
    for name, *figures in table("method.md", "recipe"):
        config = RECIPES[name]("x", (world,))
        wanted = (config.count, config.rounds, config.policy_tasks, config.members, config.capacity)
        assert tuple(int(figure.replace(",", "")) for figure in figures) == wanted
    rows = {source: count for source, _, count in table("method.md", "source")}
    for name, source in (("searches", Source.SEARCH), ("random", Source.RANDOM), ("optima", Source.OPTIMUM)):
        assert rows[name] == f"{mix.tasks_in_a_shard(source) * mix.rows_of_a_task(source):,}"
    assert f"a shard of {mix.rows:,}" in page("method.md")
    assert mix.search == pytest.approx(7 / 8, abs=0.01)


def test_columns_and_sources_of_data() -> None:
    assert column_table() in page("data.md")
    assert f"Schema version {SCHEMA_VERSION}." in page("data.md")
    shares = {row[0]: float(row[-1]) for row in table("data.md", "name")}
    assert shares == {name: getattr(Mix(), name) for name in SOURCES}
