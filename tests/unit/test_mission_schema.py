"""The JSON schema and the key reference: up to date, valid, and of one mind with the loader."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from lcd_flight.mission import MissionError, load_mission
from lcd_flight.mission.__main__ import main
from lcd_flight.mission.reference import MARK, PAGE, with_tables
from lcd_flight.mission.schema import SCHEMA_FILE, mission_schema, schema_text

ROOT = Path(__file__).parents[2]
VALIDATOR = jsonschema.Draft202012Validator(mission_schema())


def demo() -> dict[str, Any]:
    data = yaml.safe_load((ROOT / "missions" / "four_waypoints.yaml").read_text(encoding="utf-8"))
    assert isinstance(data, dict)
    return data


def test_the_files_in_the_repository_are_up_to_date() -> None:
    remedy = "run `python -m lcd_flight.mission`"
    assert (ROOT / SCHEMA_FILE).read_text(encoding="utf-8") == schema_text(), remedy
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert with_tables(page) == page, remedy


def test_the_command_writes_both_files(tmp_path: Path) -> None:
    (tmp_path / "missions").mkdir()
    (tmp_path / "docs").mkdir()
    (tmp_path / PAGE).write_text(f"# Head\n{MARK}obsolete\n", encoding="utf-8")
    main(tmp_path)
    assert (tmp_path / SCHEMA_FILE).read_text(encoding="utf-8") == schema_text()
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert page.startswith(f"# Head\n{MARK}\n### The whole file\n")
    assert "obsolete" not in page


def test_it_is_a_valid_schema_that_describes_every_key_with_its_unit() -> None:
    schema = mission_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    for model in schema["$defs"].values():
        for key, prop in model["properties"].items():
            assert "description" in prop or "$ref" in prop, key
    planner = schema["$defs"]["Planner"]["properties"]
    assert planner["speed"]["description"] == "Mean speed over each segment between waypoints. Unit: m/s."


def test_every_key_stands_in_the_reference() -> None:
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert "| `voltage_critical` | V | `3.0` | above 0 to 100 | In flight, below it for 2 s: " in page
    keys = {key for model in mission_schema()["$defs"].values() for key in model["properties"]}
    plan_items = {"takeoff", "hold", "trajectory", "land"}
    assert not [key for key in keys - plan_items if f"| `{key}` |" not in page]


@pytest.mark.parametrize("path", sorted((ROOT / "missions").glob("*.yaml")), ids=lambda path: path.stem)
def test_missions_of_the_repository_are_valid_by_the_schema(path: Path) -> None:
    VALIDATOR.validate(yaml.safe_load(path.read_text(encoding="utf-8")))


WRONG_VALUES: tuple[Any, ...] = (None, True, -1, 1e9, "text", [], {}, [1], {"a": 1}, [None])


def places(value: Any, key: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every key of nested data."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [key, *(place for step, below in inner for place in places(below, (*key, step)))]


def replaced(data: Any, key: tuple[Any, ...], value: Any) -> Any:
    if not key:
        return value
    target = data
    for step in key[:-1]:
        target = target[step]
    target[key[-1]] = value
    return data


@pytest.mark.parametrize("place", places(demo()), ids=lambda place: ".".join(map(str, place)) or "root")
def test_what_the_schema_refuses_the_loader_refuses(place: tuple[Any, ...], tmp_path: Path) -> None:
    """Each value of a right mission in turn becomes one that is probably wrong."""
    path = tmp_path / "x.yaml"
    for wrong in WRONG_VALUES:
        data = replaced(copy.deepcopy(demo()), place, wrong)
        path.write_text(yaml.safe_dump(data), encoding="utf-8")
        if VALIDATOR.is_valid(data):
            continue
        with pytest.raises(MissionError):
            load_mission(path)
