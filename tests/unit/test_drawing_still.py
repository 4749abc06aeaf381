"""Still plots: values stand where the axis says, words are escaped, and both colour schemes are inside."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from lcd_flight.drawing.scale import Axis
from lcd_flight.drawing.still import Panel, Stroke, document, legend, words

PANEL = Panel(100.0, 50.0, 200.0, 80.0, Axis(0.0, 10.0), Axis(0.0, 4.0))


def test_values_stand_where_the_axes_say():
    places = PANEL.at(np.array([0.0, 10.0, 5.0]), np.array([0.0, 4.0, 1.0]))
    assert places.tolist() == [[100.0, 130.0], [300.0, 50.0], [200.0, 110.0]]


def test_what_is_beyond_an_axis_stands_at_its_end():
    assert PANEL.at(np.array([99.0]), np.array([-1.0])).tolist() == [[300.0, 130.0]]


def test_a_frame_has_a_number_for_each_tick():
    texts = [part for part in PANEL.frame("height in m", "time in s", ticks=(2, 2)) if part.startswith("<text")]
    said = [ET.fromstring(text).text for text in texts]  # noqa: S314 - our own
    assert said == ["height in m", "0", "5", "10", "0", "2", "4", "time in s"]


def test_rows_with_names_of_their_own_have_no_numbers_up():
    texts = [part for part in PANEL.frame("", "crashes", ticks=(2, 0)) if part.startswith("<text")]
    assert [ET.fromstring(text).text for text in texts] == [None, "0", "5", "10", "crashes"]  # noqa: S314 - our own


def test_a_line_goes_through_its_values():
    assert 'points="100.0,130.0 300.0,50.0"' in PANEL.line(np.array([0.0, 10.0]), np.array([0.0, 4.0]), Stroke("a"))


def test_a_dot_for_each_value():
    dots = PANEL.dots(np.array([0.0, 5.0]), np.array([4.0, 0.0]), Stroke("b"), 2.0)
    assert [(ET.fromstring(d).get("cx"), ET.fromstring(d).get("cy")) for d in dots] == [  # noqa: S314 - our own
        ("100.0", "50.0"),
        ("200.0", "130.0"),
    ]
    assert PANEL.dots(np.array([]), np.array([]), Stroke("b")) == []


def test_keys_stand_in_rows():
    parts = legend(10.0, 20.0, [(name, Stroke("a", "2 2")) for name in "abc"], columns=2, step=50.0)
    places = [(ET.fromstring(p).get("x"), ET.fromstring(p).get("y")) for p in parts[1::2]]  # noqa: S314 - our own
    assert places == [("43.0", "20.0"), ("93.0", "20.0"), ("43.0", "40.0")]
    assert "stroke-dasharray:2 2" in parts[0]


def test_the_document_is_svg_in_light_and_dark_and_says_what_it_shows():
    text = document(300.0, 200.0, [words(1.0, 2.0, "a < b & c")], "what <it> shows")
    root = ET.fromstring(text)  # noqa: S314 - our own
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert root.findtext("{http://www.w3.org/2000/svg}title") == "what <it> shows"
    assert "a < b & c" in "".join(root.itertext())
    assert "prefers-color-scheme: dark" in text


@pytest.mark.parametrize("name", ["a", "b", "flown", "waypoint", "reference", "ink"])
def test_the_palette_has_the_colours_that_plots_use(name):
    assert f"--{name}:" in document(1.0, 1.0, [], "")
