"""The base of all models that read a user's file, and the types of their values.

A key of the file is the attribute's name without its unit: `timeout: 0.3` in the file is `timeout_s` in the code, so
the unit is written once. Angles keep theirs (`yaw_deg`), because users write them in degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema
from pydantic.fields import FieldInfo

from lcd_flight.mission.problems import Key

UNITS = {"_m_per_s": "m/s", "_deg_per_s": "deg/s", "_deg": "deg", "_hz": "Hz", "_m": "m", "_s": "s", "_V": "V"}
"""Suffix of an attribute to its unit, longer ones first."""


def unit_of(attribute: str) -> str:
    """The unit that an attribute's name ends in; empty for numbers without one."""
    return next((unit for suffix, unit in UNITS.items() if attribute.endswith(suffix)), "")


def key_of(attribute: str) -> str:
    """The key under which an attribute stands in the file."""
    suffix = next((suffix for suffix in UNITS if attribute.endswith(suffix)), "")
    return attribute.removesuffix("_per_s") if suffix.startswith("_deg") else attribute.removesuffix(suffix)


def _describe(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Add the unit to each property of the JSON schema, where an editor shows it."""
    for attribute in model.model_fields:
        unit = unit_of(attribute)
        prop = schema["properties"][key_of(attribute)]
        if unit:
            prop["description"] = f"{prop['description']} Unit: {unit}."
        if "description" in prop:
            prop["description"] = " ".join(prop["description"].split())


class Keys(BaseModel):
    """A mapping of known keys; every other key is refused. Frozen."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        alias_generator=key_of,
        use_attribute_docstrings=True,
        json_schema_extra=_describe,
    )


@dataclass(frozen=True, slots=True)
class Place:
    """What stands at some key of a file."""

    attribute: str
    info: FieldInfo
    models: tuple[type[Keys], ...]
    """The models that may stand below it; empty for plain values."""

    @property
    def example(self) -> Any:
        """A value that is right there: the field's example, else its default."""
        return self.info.examples[0] if self.info.examples else self.info.get_default(call_default_factory=True)

    @property
    def unit(self) -> str:
        """Unit of the value; empty for none."""
        return unit_of(self.attribute)


def find_place(root: type[Keys], key: Key) -> Place | None:
    """What stands at `key` of a file that `root` reads; list positions do not matter. None for unknown keys."""
    place: Place | None = None
    models: tuple[type[Keys], ...] = (root,)
    for step in (part for part in key if isinstance(part, str)):
        fields = [(name, info) for model in models for name, info in model.model_fields.items() if key_of(name) == step]
        if not fields:
            return None
        attribute, info = fields[0]
        models = tuple(models_in(info.annotation))
        place = Place(attribute, info, models)
    return place


def models_in(annotation: Any) -> Iterator[type[Keys]]:
    """The models inside Annotated, unions and tuples."""
    if get_origin(annotation) is Annotated:
        yield from models_in(get_args(annotation)[0])
    elif get_args(annotation):
        for inner in get_args(annotation):
            yield from models_in(inner)
    elif isinstance(annotation, type) and issubclass(annotation, Keys):
        yield annotation


Real = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number; text that looks like one is refused."""
Whole = Annotated[int, Field(strict=True)]
Switch = Annotated[bool, Field(strict=True)]
Coordinate = Annotated[Real, Field(ge=-1000.0, le=1000.0)]
Point = Annotated[
    tuple[Coordinate, Coordinate, Coordinate],
    WithJsonSchema(
        {"type": "array", "items": {"type": "number", "minimum": -1000, "maximum": 1000}, "minItems": 3, "maxItems": 3}
    ),
]
"""x, y, z in the world frame (z up)."""
Word = Annotated[str, Field(min_length=1, max_length=200)]
