"""Links by URI: `sim://`, `sim+delay+drop://?delay_ms=12&drop=0.05`, `mavlink+udp://0.0.0.0:14540?autopilot=px4`.

The scheme is the name of a link (which may itself hold a plus) and then the layers around it, from the vehicle
outwards: of `sim+delay+drop`, a setpoint meets the drop first, then the delay, then the simulator. An option whose name
is that of a layer, or begins with it and an underscore, is that layer's; all others are the link's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from lcd_flight.model import Clock, InputError, Inspection, Link, LinkContext
from lcd_flight.plugins.entry_points import load, names


@dataclass(frozen=True, slots=True)
class LinkUri:
    """A link's URI, taken apart."""

    link: str
    """Name of the entry point."""
    layers: tuple[str, ...]
    """From the vehicle outwards."""
    address: str
    """Between `://` and `?`."""
    options: Mapping[str, str]

    def options_of(self, layer: str) -> dict[str, str]:
        """The options that belong to one layer."""
        return {key: value for key, value in self.options.items() if _belongs(key, layer)}

    def link_options(self) -> dict[str, str]:
        """The options that belong to no layer."""
        return {k: v for k, v in self.options.items() if not any(_belongs(k, layer) for layer in self.layers)}


def parse_uri(uri: str) -> LinkUri:
    """Take a link's URI apart.

    Raises:
        InputError: not a URI, an unknown link, or an option twice or without a value.
    """
    scheme, separator, rest = uri.partition("://")
    if not separator:
        raise InputError(f"link {uri!r} is not a URI such as sim://; there are: {', '.join(names('links'))}")
    address, _, query = rest.partition("?")
    link, layers = _split_scheme(scheme)
    return LinkUri(link, layers, address, _options(uri, query))


def open_link(uri: str, context: LinkContext) -> Link:
    """The link that a URI names, in its layers; connecting is `async with`.

    Raises:
        InputError: unknown link, layer or option; says what there is.
        RefusedError: a package that it needs is not installed.
    """
    parsed = parse_uri(uri)
    wrappers = [(load("link_layers", name, "link layer"), name) for name in parsed.layers]
    link = load("links", parsed.link, "link")(parsed.address, parsed.link_options(), context)
    for wrap, name in wrappers:
        link = wrap(link, parsed.options_of(name), context)
    return cast(Link, link)


async def inspect_link(uri: str, clock: Clock) -> Inspection:
    """Look at what is at the other end of a link, and change nothing there.

    Raises:
        InputError: unknown link or option, or a link that cannot be looked at.
        RefusedError: nobody answers, or a package that it needs is not installed.
    """
    parsed = parse_uri(uri)
    inspect = load("link_inspectors", parsed.link, "link to look at")
    return cast(Inspection, await inspect(parsed.address, parsed.link_options(), clock))


def _split_scheme(scheme: str) -> tuple[str, tuple[str, ...]]:
    """The longest beginning that is a link's name, and the layers after it."""
    parts = scheme.split("+")
    known = names("links")
    for end in range(len(parts), 0, -1):
        name = "+".join(parts[:end])
        if name in known:
            return name, tuple(parts[end:])
    raise InputError(f"unknown link {parts[0]!r}; there are: {', '.join(known)}")


def _options(uri: str, query: str) -> dict[str, str]:
    from urllib.parse import parse_qsl

    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise InputError(f"link {uri!r}: options are written ?name=value&name=value") from None
    options = dict(pairs)
    if len(options) < len(pairs):
        twice = next(key for key, _ in pairs if sum(key == other for other, _ in pairs) > 1)
        raise InputError(f"link {uri!r}: option {twice} is given twice")
    return options


def _belongs(key: str, layer: str) -> bool:
    return key == layer or key.startswith(f"{layer}_")
