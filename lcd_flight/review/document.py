"""What every page is made of: one HTML file that loads nothing, its styles, its scripts and its data."""

from __future__ import annotations

from collections.abc import Sequence

from lcd_flight.drawing import colors
from lcd_flight.drawing.html import Html, joined, tag
from lcd_flight.review.assets import asset
from lcd_flight.review.chart import Panel, Timeline
from lcd_flight.review.detail import packed
from lcd_flight.review.player import player_html

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""Nothing is ever loaded, whatever a log may hold."""

_STYLES = ("space.css", "page.css", "chart.css", "player.css")
_SCRIPTS = ("time.js", "samples.js", "scale.js", "charts.js", "gestures.js", "space.js", "player.js")
"""One after another in one scope, each on those before it."""


def document(title: str, content: Sequence[Html], panels: Sequence[Panel], timeline: Timeline) -> Html:
    """A page around its content; `panels` are those of the content, in its order."""
    traces = [trace for panel in panels for chart in panel.charts for trace in chart.traces]
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        tag("title", title),
        tag("style", Html(colors() + "".join(map(asset, _STYLES)))),
    )
    body = tag(
        "body",
        tag("main", *content),
        player_html(timeline),
        tag("script", Html(packed(traces)), type="application/octet-stream", id="samples"),
        tag("script", _script()),
        data_begin=repr(timeline.axis.low),
        data_end=repr(timeline.axis.high),
    )
    return joined([Html("<!DOCTYPE html>\n"), tag("html", head, body, lang="en")])


def _script() -> Html:
    """Closed in itself: a browser's own names are none of ours."""
    return Html('(() => {\n"use strict";\n' + "\n".join(map(asset, _SCRIPTS)) + "})();")
