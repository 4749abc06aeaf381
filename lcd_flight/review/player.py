"""The bar at the foot of the page: plays the flight, and zooms all charts and the path to one window of time."""

from __future__ import annotations

from lcd_flight.drawing.html import Html, tag
from lcd_flight.review.chart import Flag, Timeline, phase_name

_SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)
MINUS, PLAY, EARLIER, LATER = (
    "\N{MINUS SIGN}",
    "\N{BLACK RIGHT-POINTING TRIANGLE}",
    "\N{LEFTWARDS ARROW}",
    "\N{RIGHTWARDS ARROW}",
)


def player_html(timeline: Timeline) -> Html:
    """Shown once the script lives; its strip is always the whole flight."""
    axis = timeline.axis
    slider = tag(
        "input",
        type="range",
        min=repr(axis.low),
        max=repr(axis.high),
        step="0.01",
        value=repr(axis.low),
        aria_label="time in the flight",
    )
    strip = tag(
        "div",
        *(phase_name(band, timeline) for band in timeline.phases),
        *(_flag(flag, timeline) for flag in timeline.flags),
        tag("i", class_="window"),
        slider,
        class_="strip",
    )
    return tag("nav", strip, _controls(), class_="player", aria_label="time")


def space_buttons() -> Html:
    """For the path's drawing: what a finger or a keyboard cannot do otherwise."""
    return tag(
        "div",
        _button("space-in", "+", "nearer"),
        _button("space-out", MINUS, "farther"),
        _button("space-top", "top", "seen from above"),
        _button("space-side", "side", "seen from the side"),
        _button("space-home", "reset", "as at first"),
        class_="buttons",
    )


def _controls() -> Html:
    speeds = [
        tag("option", f"{speed:g}\N{MULTIPLICATION SIGN}", value=f"{speed:g}", selected=speed == 1.0)
        for speed in _SPEEDS
    ]
    return tag(
        "div",
        _button("play", PLAY, "play or pause (space)"),
        tag("select", *speeds, class_="speed", aria_label="speed"),
        tag("output", class_="clock"),
        tag("span", class_="story"),
        tag(
            "span",
            _button("earlier", EARLIER, "earlier (shift and left)"),
            _button("out", MINUS, "zoom out (-)"),
            _button("in", "+", "zoom in (+)"),
            _button("later", LATER, "later (shift and right)"),
            _button("whole", "whole flight", "all of the time (0)"),
            _button("fit", "fit values", "fit each chart's values to the window (f)", pressed=False),
            class_="buttons",
        ),
        class_="controls",
    )


def _button(action: str, text: str, title: str, *, pressed: bool | None = None) -> Html:
    state = None if pressed is None else str(pressed).lower()
    return tag("button", text, type="button", data_do=action, title=title, aria_label=title, aria_pressed=state)


def _flag(flag: Flag, timeline: Timeline) -> Html:
    return tag(
        "i",
        class_=f"flag {flag.style}",
        title=flag.name,
        style=f"left:{100.0 * timeline.across(flag.begin_s):.2f}%",
        data_begin=f"{flag.begin_s:.3f}",
        data_end=f"{flag.end_s:.3f}",
    )
