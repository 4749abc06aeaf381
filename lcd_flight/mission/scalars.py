"""What one unquoted word of YAML means, and where its readers disagree.

YAML 1.1 (PyYAML and most robotics tools) and 1.2 read `012`, `1e-3`, `12:30` and `on` differently; a mission must mean
the same to both, so such words are refused with the spelling that nobody can mistake.
Sources: yaml.org/type (int, float, bool, timestamp; YAML 1.1), yaml.org/spec/1.2.2 section 10.3 (core schema).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TypeAlias

Scalar: TypeAlias = bool | int | float | str | None

LONGEST_NUMBER = 40
"""Characters; Python reads integers of thousands of digits, no mission needs one."""

_NULLS = frozenset({"", "~", "null", "Null", "NULL"})
_BOOLEANS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_OTHER_BOOLEANS = {"yes": True, "on": True, "y": True, "no": False, "off": False, "n": False}
_INT = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_FLOAT = re.compile(r"([-+]?[0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?")
_LOOSE_FLOAT = re.compile(r"[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?")
_REFUSED = (
    (re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"), "is not a finite number; write a number"),
    (
        re.compile(r"[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?"),
        "is a number in base 60 to some YAML readers; write one number, or put text in quotes",
    ),
    (
        re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt ].*)?"),
        "is a date to some YAML readers; put text in quotes",
    ),
    (
        re.compile(r"[-+]?0[xXoObB][0-9a-fA-F_]+"),
        "is a number to some YAML readers and text to others; write the number in decimal",
    ),
)
"""Words without one likely meaning."""


@dataclass(frozen=True, slots=True)
class Word:
    """An unquoted word, read."""

    value: Scalar
    trap: str = ""
    """Why it is refused and what to write; empty where it is clear. `value` is then the likeliest meaning."""


def read_word(text: str) -> Word:
    """The meaning of an unquoted scalar, or the trap that it is."""
    if text in _NULLS:
        return Word(None)
    if text in _BOOLEANS:
        return Word(_BOOLEANS[text])
    if len(text) <= LONGEST_NUMBER:
        if _INT.fullmatch(text):
            return Word(int(text))
        if _FLOAT.fullmatch(text) and math.isfinite(float(text)):
            return Word(float(text))
    return _trap(text) or Word(text)


def _trap(text: str) -> Word | None:
    """The ambiguous words, or None for plain text."""
    if text.lower() in _OTHER_BOOLEANS:
        value = _OTHER_BOOLEANS[text.lower()]
        return Word(value, f"{text} is a truth value to some YAML readers and text to others; {_write(value, text)}")
    for pattern, why in _REFUSED:
        if pattern.fullmatch(text):
            return Word(None, f"{text} {why}")
    return _loose_number(text) if _LOOSE_FLOAT.fullmatch(text) else None


def _loose_number(text: str) -> Word:
    """`012`, `1e-3`, `1_000`, `-.5`: numbers to people, something else to some readers."""
    if len(text) > LONGEST_NUMBER:
        return Word(None, f"a number of {len(text)} characters; write at most {LONGEST_NUMBER}")
    value = float(text.replace("_", ""))
    if not math.isfinite(value):
        return Word(None, f"{text} is too large to be read; write a smaller number")
    whole = value.is_integer() and not set(text) & set(".eE")
    number = int(value) if whole else value
    octal = whole and text.lstrip("+-").startswith("0")
    reason = "is octal to some YAML readers" if octal else "is text to some YAML readers"
    return Word(number, f"{text} {reason}; {_write(number, text)}")


def _write(value: bool | float, text: str) -> str:
    """The remedy: the clear spelling, and the quoted one."""
    return f'write {_plain(value)}, or "{text}" for text'


def _plain(value: bool | float) -> str:
    """A value as every YAML reader understands it."""
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    return text if "e" not in text or "." in text else text.replace("e", ".0e")
