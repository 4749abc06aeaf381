"""The table of topics: schemas that viewers understand and that say what every number means."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import synthetic_flight
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool

from lcd_flight.model import LinkReport, PoseReport, Reference, State, Tick, TickInputs
from lcd_flight.record.schema import json_schema
from lcd_flight.record.topics import TICK, TICK_INPUTS, TOPICS, Topic
from lcd_flight.wire import json_records

PROTOBUF = [topic for topic in TOPICS if topic.encoding == "protobuf"]


def properties(schema: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every property at every depth, with its path."""
    for name, value in schema["properties"].items():
        yield f"{path}/{name}", value
        inner = value.get("items", value)
        if inner.get("type") == "object":
            yield from properties(inner, f"{path}/{name}")


def strict(schema: Any) -> Any:
    """The schema with `nullable` and the spelled-out numbers as a validator understands them."""
    if isinstance(schema, list):
        return [strict(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    schema = {key: strict(value) for key, value in schema.items()}
    kind = schema.get("type")
    if kind == "number":
        schema["type"] = ["number", "string"]
    if schema.pop("nullable", False):
        return {"anyOf": [schema, {"type": "null"}]}
    return schema


def test_names_are_unique_and_every_row_says_when_and_in_which_unit() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)
    assert all(topic.name.startswith("/") and topic.rate and topic.units for topic in TOPICS)


@pytest.mark.parametrize("topic", [TICK_INPUTS, TICK], ids=lambda topic: topic.name)
def test_viewers_understand_our_schemas(topic: Topic) -> None:
    schema = json.loads(topic.schema_data())
    assert schema["type"] == "object"
    for path, value in properties(schema):
        assert isinstance(value["type"], str), path
        assert not {"anyOf", "oneOf", "$ref", "prefixItems"} & set(value), path
        if value["type"] == "array":
            assert isinstance(value["items"]["type"], str), path


def test_attributes_carry_what_the_source_says_of_them() -> None:
    inputs = dict(properties(json_schema(TickInputs)))
    assert inputs["/now_ns"]["description"] == "Host's monotonic time at which the tick began."
    assert inputs["/pose/state/p_WB"]["description"] == "Position in m."
    assert inputs["/pose/state"]["nullable"] is True
    assert inputs["/pose/state/q_WB"]["minItems"] == 4
    tick = dict(properties(json_schema(Tick)))
    assert "land_now" in tick["/phase"]["enum"]
    assert "5: KILL" in tick["/findings/severity"]["description"]


@pytest.mark.parametrize("record", [State, Reference, PoseReport, LinkReport, TickInputs, Tick])
def test_every_attribute_has_its_place(record: type) -> None:
    fields = [field.name for field in dataclasses.fields(record)]
    assert list(json_schema(record)["properties"]) == fields


def test_ticks_are_what_the_schemas_say() -> None:
    validators = [jsonschema.Draft202012Validator(strict(json_schema(record))) for record in (TickInputs, Tick)]
    for pair in synthetic_flight.flight()[::50]:
        for validator, record in zip(validators, pair, strict=True):
            validator.validate(json.loads(json_records.encode(record)))


@pytest.mark.parametrize("topic", PROTOBUF, ids=lambda topic: topic.name)
def test_protobuf_schemas_are_whole(topic: Topic) -> None:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(topic.schema_data()).file:
        pool.Add(file)  # fails where a dependency does not come first
    assert pool.FindMessageTypeByName(topic.schema_name).full_name.startswith("foxglove.")


def test_the_documentation_has_the_same_table() -> None:
    text = (Path(__file__).parents[2] / "docs" / "flight_log.md").read_text(encoding="utf-8")
    for topic in TOPICS:
        row = f"| `{topic.name}` | `{topic.schema_name}` | {topic.encoding} | {topic.rate} | {topic.units} |"
        assert row in text
