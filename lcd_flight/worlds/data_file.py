"""Strict reading of the YAML files of this room: one clear line for each thing that is wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from lcd_flight.model import InputError

Model = TypeVar("Model", bound=BaseModel)


class Strict(BaseModel):
    """Numbers are numbers, nothing is unknown, nothing is NaN."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _UniqueKeys(yaml.SafeLoader):
    """PyYAML keeps the last of two equal keys and takes anything as a key; here both are errors."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str) or key in seen:
                problem = f"key {key!r} stands twice" if isinstance(key, str) else f"key {key!r} is not a word"
                raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


def read(path: Path, model: type[Model]) -> Model:
    """The file's contents as a validated model.

    Raises:
        InputError: not to be read, not YAML, or wrong: a line for each key with its value and what it should be.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    try:
        content = yaml.load(text, Loader=_UniqueKeys)  # noqa: S506 - a SafeLoader
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not valid YAML: {_one_line(error)}") from error
    if not isinstance(content, dict):
        raise InputError(f"{path}: a mapping of keys to values is expected")
    try:
        return model.model_validate(_tuples(content))
    except ValidationError as error:
        raise InputError("\n".join(f"{path}: {_problem(e)}" for e in error.errors())) from error


def _tuples(value: Any) -> Any:
    """YAML's lists as tuples, which is what the vocabulary holds."""
    if isinstance(value, dict):
        return {k: _tuples(v) for k, v in value.items()}
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value


def _one_line(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or "cannot be parsed"
    return f"line {mark.line + 1}: {problem}" if mark else str(problem)


def _problem(error: Any) -> str:
    """One of pydantic's errors in our words."""
    key = ".".join(str(part) for part in error["loc"])
    value = error["input"]
    if not key:  # of the file as a whole
        return str(error["msg"].removeprefix("Value error, "))
    if error["type"] == "missing":
        return f"{key}: this key is missing"
    if error["type"] == "extra_forbidden":
        return f"{key}: unknown key; remove it or correct its spelling"
    if error["type"] == "float_type" and _looks_like_number(value):
        return f"{key}: {value!r} is text to YAML; write {yaml.safe_dump(float(value)).split()[0]}"
    return f"{key}: {value!r}: {error['msg'].removeprefix('Value error, ')}"


def _looks_like_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return isinstance(value, str)
