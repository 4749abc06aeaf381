"""The tables of docs/mission.md: every key with unit, default and range, written from the models."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from lcd_flight.mission.explain import shown_flow
from lcd_flight.mission.keys import Keys, key_of, models_in, unit_of
from lcd_flight.mission.mission import Mission
from lcd_flight.mission.problems import Key, dotted
from lcd_flight.mission.schema import mission_schema

PAGE = "docs/mission.md"
MARK = "<!-- Below this line the page is written by `python -m lcd_flight.mission`. -->\n"


def with_tables(page: str) -> str:
    """The page with everything below `MARK` written anew."""
    return page[: page.index(MARK) + len(MARK)] + "\n" + tables()


def tables() -> str:
    """One table for each mapping of a mission file, as Markdown."""
    definitions = mission_schema()["$defs"] | {Mission.__name__: mission_schema()}
    return "\n".join(_tables(Mission, (), definitions))


def _tables(model: type[Keys], key: Key, definitions: dict[str, Any]) -> Iterator[str]:
    """The table of `model` at `key`, then those of the mappings in it."""
    fields = [
        (key_of(name), name, info, tuple(models_in(info.annotation))) for name, info in model.model_fields.items()
    ]
    if not model.__name__.endswith("Item"):  # an item of the plan is its only key
        properties = definitions[model.__name__]["properties"]
        yield f"### {dotted(key) or 'The whole file'}\n\n{' '.join((inspect.getdoc(model) or '').split())}\n"
        yield "| key | unit | default | range | meaning |\n|---|---|---|---|---|"
        for own, name, info, inner in fields:
            allowed = "" if inner else _range(properties[own])
            yield f"| `{own}` | {unit_of(name)} | {_default(info)} | {allowed} | {_meaning(info)} |"
        yield ""
    for own, _, _, inner in fields:
        for found in inner:
            yield from _tables(found, (*key, own), definitions)


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    return "" if value is None or isinstance(value, Keys) else f"`{shown_flow(value)}`"


def _meaning(info: FieldInfo) -> str:
    return " ".join((info.description or "").split()).replace("|", "\\|")


def _range(schema: dict[str, Any]) -> str:
    """What the JSON schema allows, in words."""
    schema = schema.get("anyOf", [schema])[0]
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    if "pattern" in schema:
        return f"`{schema['pattern']}`".replace("|", "\\|")
    if "items" in schema and "minItems" in schema:
        return f"{schema['minItems']} numbers, each {_range(schema['items'])}"
    if "items" in schema:
        return f"any of {_range(schema['items'])}"
    words = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
    bounds = [f"{word} {str(schema[name]).removesuffix('.0')}" for name, word in words.items() if name in schema]
    return " ".join(bounds) or {"boolean": "`true`, `false`", "string": "text"}.get(schema.get("type", ""), "")
