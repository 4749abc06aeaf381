"""A mission that may be wrong in places: the parts that are right can still be checked against each other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from lcd_flight.mission.actions import ITEM_KINDS, Waypoint, kind_of
from lcd_flight.mission.keys import Keys
from lcd_flight.mission.problems import Key

Model = TypeVar("Model", bound=Keys)


def _is_kind(item: Any) -> bool:
    """Whether an item is a bare word that names a kind."""
    return isinstance(item, str) and item in ITEM_KINDS


class Draft:
    """Plain data from a mission file, read part by part; a part that is wrong is None, and is told of elsewhere."""

    def __init__(self, data: dict[str, Any], folder: Path) -> None:
        self._data = data
        self.folder = folder
        """The mission's own; files that it names are relative to it."""

    def part(self, model: type[Model], *key: str | int) -> Model | None:
        """The part at `key`, its defaults where it is left out."""
        data = self._at(key)
        try:
            return model.model_validate({} if data is None else data)
        except ValidationError:
            return None

    def item_kinds(self) -> list[str | None]:
        """What each item of the plan is, also of a bare word (`- land`); None for what is no item."""
        return [item if _is_kind(item) else kind_of(item) for item in self._list("plan")]

    def items(self, kind: str, model: type[Model]) -> Iterator[tuple[Key, Model]]:
        """The plan's items of one kind that are right, each with its key."""
        for index, found in enumerate(self.item_kinds()):
            key: Key = ("plan", index, kind)
            if found == kind and (item := self.part(model, *key)) is not None:
                yield key, item

    def trajectories(self) -> Iterator[tuple[Key, list[Waypoint | None]]]:
        """The waypoints of each trajectory, with the key of their list."""
        for index, kind in enumerate(self.item_kinds()):
            if kind == "trajectory":
                key: Key = ("plan", index, "trajectory", "waypoints")
                yield key, [self.part(Waypoint, *key, n) for n in range(len(self._list(*key)))]

    def waypoints(self) -> Iterator[tuple[Key, Waypoint]]:
        """Every waypoint that is right, with its key."""
        for key, waypoints in self.trajectories():
            yield from (((*key, n), waypoint) for n, waypoint in enumerate(waypoints) if waypoint)

    def _list(self, *key: str | int) -> list[Any]:
        found = self._at(key)
        return found if isinstance(found, list) else []

    def _at(self, key: Key) -> Any:
        data: Any = self._data
        for step in key:
            if isinstance(data, dict):
                data = data.get(str(step))
            elif isinstance(data, list) and isinstance(step, int) and step < len(data):
                data = data[step]
            else:
                return None
        return data
