"""`lcd train` as typed: what is refused, in one line; and the picture of a model's card."""

from xml.etree import ElementTree

import cost_models
import numpy as np
import pytest
from typer.testing import CliRunner

from lcd_flight.cli.main import app
from lcd_flight.learning.card_figure import card_figure


def refusal(*words):
    result = CliRunner().invoke(app, ["train", "--out", "m.safetensors", *words])
    return str(result.exception)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ((), "give --worlds NAME,NAME or --vehicle NAME_OR_FILE, one of the two"),
        (("--worlds", "crazyflie-paper", "--vehicle", "crazyflie"), "one of the two"),
        (("--worlds", "crazyflie-paper", "--loop", "paper"), "--loop paper: worlds have their own"),
        (("--vehicle", "crazyflie", "--loop", "open"), "--loop open: flight or paper"),
        (("--vehicle", "my.yaml"), "my.yaml"),
        (("--worlds", "crazyfly"), "world 'crazyfly' is not known"),
        (("--worlds", "crazyflie-paper", "--recipe", "huge"), "--recipe huge: choose one of small"),
        (("--worlds", "crazyflie-paper", "--out", "m.pt"), "--out m.pt: a model's file ends in .safetensors"),
    ],
)
def test_what_cannot_be_trained_is_one_clear_line(words, line):
    said = refusal(*words)
    assert line in said
    assert "\n" not in said


def test_the_card_is_drawn_with_its_curve_and_its_calibration():
    curve = tuple((float(n), 0.5 / n, 0.6 / n) for n in range(1, 30))
    bins = tuple((float(p), p - 0.4, p + 0.1, p + 0.5, 100.0) for p in np.linspace(-2.0, 1.0, 12))
    card = cost_models.CARD.model_copy(update={"learning_curve": curve, "calibration": {"optima": bins}})
    picture = ElementTree.fromstring(card_figure(card))  # noqa: S314 - it is our own
    name = "{http://www.w3.org/2000/svg}"
    texts = [node.text for node in picture.iter(f"{name}text")]
    assert "measured largest error in m" in texts
    assert "minimum-snap trajectories" in texts
    assert "what earlier rounds planned, and around it" not in texts
    assert len(list(picture.iter(f"{name}circle"))) == 12
