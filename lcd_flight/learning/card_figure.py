"""A model's card as a picture: how it learned, and how what it predicts compares with what was measured."""

from __future__ import annotations

import numpy as np

from lcd_flight.drawing.html import Html
from lcd_flight.drawing.scale import Axis
from lcd_flight.drawing.still import Panel, Stroke, document, legend, words
from lcd_flight.model import FloatArray
from lcd_flight.planning.cost.model_card import CalibrationBin, ModelCard

_WIDTH, _HEIGHT = 920.0, 400.0
_TRAINING, _HELD_OUT = Stroke("muted"), Stroke("a")
_SOURCES = {"optima": Stroke("b"), "planned": Stroke("a")}
_SOURCE_WORDS = {"optima": "minimum-snap trajectories", "planned": "what earlier rounds planned, and around it"}


def card_figure(card: ModelCard) -> Html:
    """One SVG: the learning curve of the last round, and the calibration on tasks that were never trained on."""
    parts = [words(24, 30, f"{card.name}: {card.rollouts:,} rollouts of {', '.join(card.worlds)}", "title")]
    if card.learning_curve:
        parts += _curve(np.array(card.learning_curve))
    if card.calibration:
        parts += _calibration(card)
    return document(_WIDTH, _HEIGHT, parts, f"Learning curve and calibration of the model {card.name}")


def _curve(points: FloatArray) -> list[Html]:
    learned, losses = points[:, 0] / 1e6, points[:, 1:]
    up = Axis(0.8 * float(losses.min()), 1.05 * float(losses.max()), log=losses.max() > 10.0 * losses.min())
    panel = Panel(70.0, 76.0, 330.0, 220.0, Axis(0.0, float(learned[-1])), up)
    keys = [("training", _TRAINING), ("held-out tasks", _HELD_OUT)]
    return [
        *panel.frame("Huber loss", "millions of rollouts learned from"),
        panel.line(learned, losses[:, 0], _TRAINING),
        panel.line(learned, losses[:, 1], _HELD_OUT),
        *legend(70.0, 366.0, keys, columns=2, step=150.0),
    ]


def _calibration(card: ModelCard) -> list[Html]:
    """Medians, and from the tenth to the ninetieth percentile, bin by bin; the diagonal is a perfect model."""
    values = np.exp(np.concatenate([np.array(bins)[:, :4].ravel() for bins in card.calibration.values()]))
    axis = Axis(float(values.min()), float(values.max()), log=True)
    panel = Panel(500.0, 76.0, 370.0, 220.0, axis, axis)
    what = "largest error in m" if card.target == "error" else "released code's cost"
    ends = np.array([axis.low, axis.high])
    parts = [*panel.frame(f"measured {what}", "predicted"), panel.line(ends, ends, class_="rule")]
    keys = []
    for source, bins in card.calibration.items():
        parts += _bins(panel, bins, _SOURCES[source])
        keys.append((_SOURCE_WORDS[source], _SOURCES[source]))
    return [*parts, *legend(500.0, 366.0, keys, columns=1, step=200.0)]


def _bins(panel: Panel, bins: tuple[CalibrationBin, ...], stroke: Stroke) -> list[Html]:
    predicted, low, median, high = np.exp(np.array(bins)[:, :4]).T
    thin = Stroke(stroke.color, width=1.0)
    spans = [panel.line(np.full(2, x), np.array([a, b]), thin) for x, a, b in zip(predicted, low, high, strict=True)]
    return [*spans, *panel.dots(predicted, median, stroke, radius=3.5)]
