"""JSON schemas of our records, generated from the dataclasses themselves and their attribute docstrings.

Viewers (Foxglove, Lichtblick) read a small subset: every property has one plain `type`, arrays have one `items`, and
alternatives are not understood. So everything is written in place, and what may be missing says `nullable`.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import textwrap
import types
import typing
from enum import Enum
from itertools import pairwise
from typing import Any

_PLAIN = {float: "number", int: "integer", bool: "boolean", str: "string"}
_NOT_FINITE = "A number that is not finite stands as the string NaN, Infinity or -Infinity."


def json_schema(record: type) -> dict[str, Any]:
    """The schema of a dataclass as a whole document."""
    schema = _object(record)
    schema["description"] = f"{schema['description']} {_NOT_FINITE}"
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": record.__name__, **schema}


def _object(record: type) -> dict[str, Any]:
    hints = typing.get_type_hints(record)
    notes = _attribute_docstrings(record)
    properties = {}
    for field in dataclasses.fields(record):
        properties[field.name] = _value(hints[field.name])
        if field.name in notes:
            properties[field.name]["description"] = notes[field.name]
    return {
        "type": "object",
        "description": inspect.cleandoc(record.__doc__ or ""),
        "properties": properties,
        "required": list(properties),
    }


def _value(hint: Any) -> dict[str, Any]:
    """The schema of one type: a scalar, an enumeration, a record, a tuple, or any of these or nothing."""
    if hint in _PLAIN:
        return {"type": _PLAIN[hint]}
    if dataclasses.is_dataclass(hint):
        return _object(typing.cast(type, hint))
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _choice(hint)
    arguments = typing.get_args(hint)
    if isinstance(hint, types.UnionType):
        (something,) = (argument for argument in arguments if argument is not type(None))
        return {**_value(something), "nullable": True}
    length = {} if arguments[-1] is Ellipsis else {"minItems": len(arguments), "maxItems": len(arguments)}
    return {"type": "array", "items": _value(arguments[0]), **length}


def _choice(enumeration: type[Enum]) -> dict[str, Any]:
    values = [member.value for member in enumeration]
    about = inspect.cleandoc(enumeration.__doc__ or "")
    if not isinstance(values[0], str):
        about += " " + ", ".join(f"{member.value}: {member.name}" for member in enumeration) + "."
    return {"type": "string" if isinstance(values[0], str) else "integer", "enum": values, "description": about}


def _attribute_docstrings(record: type) -> dict[str, str]:
    """The string that stands below each attribute in the source, by attribute."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(record))).body
    statements = typing.cast(ast.ClassDef, body).body
    return {
        attribute.target.id: inspect.cleandoc(note.value.value)
        for attribute, note in pairwise(statements)
        if isinstance(attribute, ast.AnnAssign)
        and isinstance(attribute.target, ast.Name)
        and isinstance(note, ast.Expr)
        and isinstance(note.value, ast.Constant)
        and isinstance(note.value.value, str)
    }
