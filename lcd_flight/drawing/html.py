"""HTML and SVG built from values, so that every text is escaped unless it was built here."""

from __future__ import annotations

import html
from collections.abc import Iterable


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


_EMPTY_TAGS = frozenset({"meta", "input", "rect", "circle", "polyline"})


def tag(name: str, *children: str | None, **attributes: str | float | bool | None) -> Html:
    """An element: plain children are escaped, Html stands as it is, None is left out.

    attributes: `class_` for `class`, `data_t` for `data-t`; None and False are left out, True stands without a value.
    """
    words = "".join(_attribute(key, value) for key, value in attributes.items() if value is not None)
    if name in _EMPTY_TAGS:
        return Html(f"<{name}{words}/>")
    return Html(f"<{name}{words}>{joined(children)}</{name}>")


def joined(parts: Iterable[str | None]) -> Html:
    """Parts side by side: Html as it is, other text escaped."""
    return Html("".join(part if isinstance(part, Html) else html.escape(part) for part in parts if part is not None))


def _attribute(key: str, value: str | float | bool | None) -> str:
    name = key.rstrip("_").replace("_", "-")
    if value is True or value is False:
        return f" {name}" if value else ""
    return f' {name}="{html.escape(f"{value:g}" if isinstance(value, float) else str(value))}"'
