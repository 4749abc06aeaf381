"""From pydantic's errors to lines that a user can act on: value, limit, remedy."""

from __future__ import annotations

import difflib
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from lcd_flight.mission.actions import ITEM_KINDS
from lcd_flight.mission.keys import Keys, Place, find_place, key_of
from lcd_flight.mission.problems import Key


def explanations(error: ValidationError, root: type[Keys]) -> Iterator[tuple[Key, str]]:
    """Key and text of everything that `root` found wrong."""
    for detail in error.errors(include_url=False):
        if detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]:
            continue  # long enough: pydantic counts valid items only, and the others are told of by themselves
        key = _key_in_file(detail["loc"])
        if detail["type"] in ("missing", "too_long") and key and _is_point(detail, key):
            yield _point_length(key, detail["input"], root)
            continue
        yield key, _explain(detail, key, root)


def did_you_mean(word: str, allowed: Iterable[str]) -> str:
    """The remedy for an unknown word."""
    allowed = tuple(allowed)
    near = difflib.get_close_matches(word, allowed, n=1)
    choice = f"one of {', '.join(allowed)}" if len(allowed) > 1 else f"only {''.join(allowed)}"
    return f"did you mean {near[0]}? ({choice})" if near else f"write {choice}"


def shown(value: Any) -> str:
    """A value as the user may have written it, short."""
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _key_in_file(loc: tuple[int | str, ...]) -> Key:
    """pydantic's place without what it adds: the kind of a plan item, and the mark of a bad key."""
    if len(loc) > 2 and loc[0] == "plan":
        loc = (*loc[:2], *loc[3:])
    return loc[:-1] if loc and loc[-1] == "[key]" else loc


def _is_point(detail: ErrorDetails, key: Key) -> bool:
    return isinstance(detail["input"], list | tuple) and (detail["type"] == "too_long" or isinstance(key[-1], int))


def _point_length(key: Key, values: list[Any], root: type[Keys]) -> tuple[Key, str]:
    """A position, or another vector, with too few or too many numbers."""
    own, place = key[:-1] if isinstance(key[-1], int) else key, find_place(root, key)
    unit = f" in {place.unit}" if place and place.unit else ""
    return own, f"has {len(values)} numbers, must have 3; write [x, y, z]{unit}"


def _explain(detail: ErrorDetails, key: Key, root: type[Keys]) -> str:
    place = find_place(root, key)
    if detail["type"] == "extra_forbidden":
        return _unknown_key(key, root)
    explain = _EXPLAIN.get(detail["type"])
    return explain(detail, place) if explain else f"{shown(detail['input'])}: {detail['msg']}"


def _unknown_key(key: Key, root: type[Keys]) -> str:
    parent = find_place(root, key[:-1])
    models = parent.models if parent else (root,)
    if key[0] == "plan" and len(key) == 3:
        return "is a second key in one item of the plan; indent it below the item's name, or begin a new item with `-`"
    allowed = [key_of(name) for model in models for name in model.model_fields]
    return f"is not a known key; {did_you_mean(str(key[-1]), allowed)}"


def _missing(detail: ErrorDetails, place: Place | None) -> str:
    key = str(detail["loc"][-1])
    example = f", e.g. `{key}: {shown_flow(place.example)}`" if place and place.info.examples else ""
    return f"is missing; add it{example}"


def shown_flow(value: Any) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {shown_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(shown_flow, value)) + "]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _wrong_type(what: str) -> Callable[[ErrorDetails, Place | None], str]:
    def explain(detail: ErrorDetails, place: Place | None) -> str:
        unit = f" in {place.unit}" if place and place.unit and what.endswith("number") else ""
        value = detail["input"]
        if value is None and place and place.attribute in ITEM_KINDS:
            return f"is empty; write `- {place.attribute}: {ITEM_KINDS[place.attribute]}`"
        if value is None:
            return f"is empty; write {what}{unit}, or remove the key"
        quoted = " without quotes" if isinstance(value, str) and _is_number(value) else ""
        return f"{shown(value)} is {_kind(value)}; write {what}{unit}{quoted}"

    return explain


def _kind(value: Any) -> str:
    kinds = ((bool, "true or false"), (int | float, "a number"), (str, "text"), (list, "a list"), (dict, "a mapping"))
    return next(word for kind, word in kinds if isinstance(value, kind))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _limit(name: str, broken: str, remedy: str) -> Callable[[ErrorDetails, Place | None], str]:
    """A number beyond one of its bounds."""

    def explain(detail: ErrorDetails, place: Place | None) -> str:
        unit = f" {place.unit}" if place and place.unit else ""
        bound = f"{detail['ctx'][name]:g}{unit}"
        return f"{shown(detail['input'])} is {broken} {bound}; write {remedy} {bound}"

    return explain


def _literal(detail: ErrorDetails, _: Place | None) -> str:
    allowed = detail["ctx"]["expected"].replace(" or ", ", ").replace("'", "").split(", ")
    return f"{shown(detail['input'])} is not possible here; {did_you_mean(str(detail['input']), allowed)}"


def _pattern(detail: ErrorDetails, place: Place | None) -> str:
    example = f"write e.g. {shown_flow(place.example)}" if place else f"it must match {detail['ctx']['pattern']}"
    return f"{shown(detail['input'])} has the wrong form; {example}"


def _length(detail: ErrorDetails, _: Place | None) -> str:
    ctx = detail["ctx"]
    least, most = ctx.get("min_length"), ctx.get("max_length")
    bound = f"at least {least}" if least is not None else f"at most {most}"
    what = "characters" if isinstance(detail["input"], str) else "items"
    return f"has length {len(detail['input'])}; write {bound} {what}"


def _no_item(detail: ErrorDetails, _: Place | None) -> str:
    value = detail["input"]
    if isinstance(value, str) and value in ITEM_KINDS:
        return f"{value} lacks its colon and what stands behind it; write `- {value}: {ITEM_KINDS[value]}`"
    word = next(iter(value), "") if isinstance(value, dict) else value
    shown_word = word if isinstance(value, dict) and word else shown(value)
    return f"{shown_word} is no item of a plan; {did_you_mean(str(word), ITEM_KINDS)}"


_EXPLAIN: dict[str, Callable[[ErrorDetails, Place | None], str]] = {
    "missing": _missing,
    "float_type": _wrong_type("a number"),
    "finite_number": _wrong_type("a finite number"),
    "int_type": _wrong_type("a whole number"),
    "string_type": _wrong_type("text"),
    "path_type": _wrong_type("a folder"),
    "bool_type": _wrong_type("true or false"),
    "tuple_type": _wrong_type("a list"),
    "dict_type": _wrong_type("keys with values"),
    "model_type": _wrong_type("keys with values"),
    "greater_than": _limit("gt", "not above", "more than"),
    "greater_than_equal": _limit("ge", "below", "at least"),
    "less_than": _limit("lt", "not below", "less than"),
    "less_than_equal": _limit("le", "above", "at most"),
    "literal_error": _literal,
    "string_pattern_mismatch": _pattern,
    "string_too_short": _length,
    "string_too_long": _length,
    "too_short": _length,
    "too_long": _length,
    "union_tag_not_found": _no_item,
}
