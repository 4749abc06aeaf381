"""Markup is built, never pasted: every text is escaped unless it was built."""

from __future__ import annotations

from lcd_flight.drawing.html import Html, joined, tag


def test_text_is_escaped_and_markup_is_not() -> None:
    assert tag("p", "a < b & c", tag("b", "<i>")) == "<p>a &lt; b &amp; c<b>&lt;i&gt;</b></p>"


def test_attributes_are_escaped() -> None:
    assert tag("i", title='"><script>') == '<i title="&quot;&gt;&lt;script&gt;"></i>'


def test_names_of_attributes_come_from_python() -> None:
    assert tag("i", class_="key a", data_low=0.25, x=3) == '<i class="key a" data-low="0.25" x="3"></i>'


def test_switches_stand_without_a_value() -> None:
    assert tag("svg", data_log=True, hidden=False, title=None) == "<svg data-log></svg>"


def test_nothing_is_left_out() -> None:
    assert tag("p", None, "a", None) == "<p>a</p>"


def test_empty_tags_close_themselves() -> None:
    assert tag("rect", x=1) == '<rect x="1"/>'


def test_what_is_joined_is_markup() -> None:
    assert isinstance(joined(["a<", Html("<br>")]), Html)
    assert joined(["a<", Html("<br>")]) == "a&lt;<br>"
