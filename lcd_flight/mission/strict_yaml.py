"""A strict reader of YAML: plain data, the line of every key, and every problem at once.

It stands on PyYAML's parser (events with their places) and resolves the words itself (`scalars`). Refused: duplicate
keys, anchors, aliases, merge keys, tags, several documents, tabs, and words that YAML readers disagree about.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml
from yaml.events import (
    AliasEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
)

from lcd_flight.mission.problems import Key, Problem
from lcd_flight.mission.scalars import read_word

DEEPEST = 20
"""Levels of nesting; a mission needs six."""


@dataclass(slots=True)
class Document:
    """What a file holds. `data` is what could be read, also where there are problems."""

    data: Any = None
    lines: dict[Key, int] = field(default_factory=dict)
    """Line of each mapping key and list item, counted from 1."""
    problems: list[Problem] = field(default_factory=list)
    complete: bool = True
    """Whether all of the file could be read as YAML."""

    def line_of(self, key: Key) -> int:
        """The line of `key`, or of the nearest thing around it that stands in the file."""
        while key and key not in self.lines:
            key = key[:-1]
        return self.lines.get(key, 1)


def read_document(text: str) -> Document:
    """Read the one YAML document in `text`; never raises."""
    reader = _Reader(text)
    try:
        reader.read()
    except (yaml.YAMLError, _TooDeepError) as error:
        reader.document.complete = False
        reader.document.problems += [Problem(line, (), what) for line, what in _syntax_problems(error, text)]
    return reader.document


class _TooDeepError(Exception):
    def __init__(self, line: int) -> None:
        super().__init__()
        self.line = line


class _Reader:
    """Turns the parser's events into a `Document`."""

    def __init__(self, text: str) -> None:
        self.document = Document()
        self._text = text
        self._events: Iterator[Event] = iter(())

    def note(self, line: int, key: Key, text: str) -> None:
        self.document.problems.append(Problem(line, key, text))

    def read(self) -> None:
        self._events = yaml.parse(self._text, Loader=yaml.SafeLoader)
        documents = 0
        for event in self._events:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    return self.note(_line(event), (), "a second document begins here; keep one mission in one file")
                self.document.data = self._value(next(self._events), (), 0)
        return None

    def _value(self, event: Event, key: Key, depth: int) -> Any:
        """The data that begins with `event`."""
        if isinstance(event, AliasEvent):
            self.note(_line(event), key, f"*{event.anchor} is an alias; write the value out")
            return None
        self._refuse_decorations(event, key)
        if isinstance(event, ScalarEvent):
            return self._scalar(event, key)
        if depth >= DEEPEST:
            raise _TooDeepError(_line(event))
        return (self._mapping if isinstance(event, MappingStartEvent) else self._sequence)(key, depth + 1)

    def _refuse_decorations(self, event: Event, key: Key) -> None:
        """Anchors and tags."""
        assert isinstance(event, ScalarEvent | CollectionStartEvent)  # noqa: S101 - narrows the type
        if event.anchor:
            self.note(_line(event), key, f"&{event.anchor} is an anchor; write the value out wherever it is used")
        if event.tag:
            self.note(_line(event), key, f"{event.tag} is a tag; write the plain value")

    def _scalar(self, event: ScalarEvent, key: Key) -> Any:
        if event.style:
            return event.value
        word = read_word(event.value)
        if word.trap:
            self.note(_line(event), key, word.trap)
        return word.value

    def _sequence(self, key: Key, depth: int) -> list[Any]:
        items: list[Any] = []
        while not isinstance(event := next(self._events), SequenceEndEvent):
            item = (*key, len(items))
            self.document.lines.setdefault(item, _line(event))
            items.append(self._value(event, item, depth))
        return items

    def _mapping(self, key: Key, depth: int) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        while not isinstance(event := next(self._events), MappingEndEvent):
            name = self._name(event, key, depth)
            if name in mapping:
                first = self.document.lines[(*key, name)]
                self.note(_line(event), (*key, name), f"is given twice, first on line {first}; keep one of them")
                self._value(next(self._events), (*key, name), depth)
                continue
            self.document.lines.setdefault((*key, name), _line(event))
            mapping[name] = self._value(next(self._events), (*key, name), depth)
        return mapping

    def _name(self, event: Event, key: Key, depth: int) -> str:
        """A mapping's key, as written."""
        if isinstance(event, ScalarEvent) and not event.tag and not event.anchor:
            if event.value == "<<" and not event.style:
                self.note(_line(event), (*key, "<<"), "is a merge key; write the keys out")
            return event.value
        self.note(_line(event), key, "a key must be a plain word")
        self._value(event, key, depth)
        return ""


def _line(event: Event) -> int:
    """Counted from 1."""
    return event.start_mark.line + 1 if event.start_mark else 1


def _syntax_problems(error: Exception, text: str) -> list[tuple[int, str]]:
    """Line and explanation of what the parser stumbled over; every line that is indented with tabs."""
    if isinstance(error, _TooDeepError):
        return [(error.line, f"nested more than {DEEPEST} levels deep; a mission needs six")]
    if isinstance(error, yaml.reader.ReaderError):
        line = text.count("\n", 0, error.position) + 1
        return [(line, f"not YAML: the character #x{error.character:04x} is not allowed; remove it")]
    assert isinstance(error, yaml.MarkedYAMLError)  # noqa: S101 - all that is left of PyYAML's errors
    mark = error.problem_mark or error.context_mark
    line = mark.line + 1 if mark else 1
    problem = error.problem or error.context or "unreadable"
    if "'\\t'" in problem:
        tabs = {n for n, written in enumerate(text.splitlines(), 1) if "\t" in written[: _indentation(written)]}
        return [(n, "a tab; YAML is indented with spaces: replace it by spaces") for n in sorted(tabs | {line})]
    context = f" {error.context}" if error.context and error.context != problem else ""
    return [(line, f"not YAML: {problem}{context}; check indentation, colons, quotes and brackets here")]


def _indentation(line: str) -> int:
    """Characters of white space before the first word."""
    return len(line) - len(line.lstrip())
