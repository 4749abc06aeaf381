"""Reading the options of a URI (`?delay_ms=12&drop=0.05`) into a typed record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import msgspec

from lcd_flight.errors import InputError

Options = TypeVar("Options", bound=msgspec.Struct)


def read_options(kind: type[Options], options: Mapping[str, str], where: str) -> Options:
    """The options as a `kind`, whose fields state their names, types, limits and defaults.

    where: what the options belong to, for the message, e.g. `sim://`.

    Raises:
        InputError: an unknown option, or a value out of its limits; says which options there are.
    """
    known = {field.name: field for field in msgspec.structs.fields(kind)}
    there_are = f"{where} has the options {', '.join(known)}" if known else f"{where} has no options"
    for name, text in options.items():
        if name not in known:
            raise InputError(f"{where}: unknown option {name}={text}; {there_are}")
        try:
            msgspec.convert(text, known[name].type, strict=False)
        except msgspec.ValidationError as error:
            raise InputError(f"{where}: option {name}={text}: {_plain(error)}; {there_are}") from None
    return msgspec.convert(dict(options), kind, strict=False)


def _plain(error: msgspec.ValidationError) -> str:
    """msgspec's reason without its markup, e.g. `expected float >= 0.0`."""
    text = str(error).replace("`", "")
    return text[:1].lower() + text[1:]
