"""Looking up and importing one entry point."""

from __future__ import annotations

from typing import Any

from lcd_flight.model import InputError, RefusedError


def names(group: str) -> list[str]:
    """What is installed under `lcd_flight.<group>`, sorted."""
    from importlib.metadata import entry_points

    return sorted({point.name for point in entry_points(group=f"lcd_flight.{group}")})


def load(group: str, name: str, what: str) -> Any:
    """Import the entry point `name` of `lcd_flight.<group>`.

    what: what it is for a user, e.g. `link`.

    Raises:
        InputError: there is no such name; lists those there are.
        RefusedError: it cannot be imported, for want of a package.
    """
    from importlib.metadata import entry_points

    found = tuple(entry_points(group=f"lcd_flight.{group}", name=name))
    if not found:
        raise InputError(f"unknown {what} {name!r}; there are: {', '.join(names(group)) or 'none'}")
    try:
        return found[0].load()
    except ImportError as error:
        raise RefusedError(f"{what} {name!r} cannot be loaded ({error}): install what it needs") from error
