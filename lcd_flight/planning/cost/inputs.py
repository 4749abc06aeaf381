"""What a network sees of a plan, by name: rows of features, and how they are laid out for it.

`windows` (ours) has a row for each segment and serves any number of them; `knots` and `coefficients` have one row for
the whole trajectory, as the paper's network, and serve the number of segments that they were trained on.
"""

from __future__ import annotations

from typing import Literal, Protocol, TypeAlias, get_args

import numpy as np

from lcd_flight.model import COEFFICIENTS, FloatArray
from lcd_flight.planning.cost.features import FEATURE_NAMES, segment_features, segment_features_pullback
from lcd_flight.planning.cost.network import Array
from lcd_flight.planning.segments import AXES

InputsName: TypeAlias = Literal["windows", "knots", "coefficients"]
INPUTS_NAMES: tuple[InputsName, ...] = get_args(InputsName)


class Inputs(Protocol):
    """One way to show plans to a network. N plans of S segments give R rows each: S, or one for the whole."""

    name: InputsName

    def names(self, segments: int) -> tuple[str, ...]:
        """What the F features of a row are, for plans of so many segments."""
        ...

    def features(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N, R, F) of plans (N, S), (N, 4, S, 8)."""
        ...

    def pullback(
        self, durations_s: FloatArray, coefficients: FloatArray, grad_features: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Reverse mode of `features`: the gradients by durations and coefficients, each with the other held."""
        ...

    def arrange(self, normalised: Array) -> Array:
        """Normalised features (N, R, F) as a network's inputs (N, R, W)."""
        ...

    def arrange_pullback(self, grad_inputs: Array) -> Array:
        """Reverse mode of `arrange`."""
        ...


class Windows:
    """Physical features of each segment between its neighbours."""

    name: InputsName = "windows"

    def names(self, segments: int) -> tuple[str, ...]:  # noqa: ARG002 - the same however many there are
        """Those of a segment."""
        return FEATURE_NAMES

    def features(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N, S, 114)."""
        return segment_features(durations_s, coefficients)

    def pullback(
        self, durations_s: FloatArray, coefficients: FloatArray, grad_features: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `Inputs`."""
        return segment_features_pullback(durations_s, coefficients, grad_features)

    def arrange(self, normalised: Array) -> Array:
        """(N, S, F) -> (N, S, 3 F + 2).

        Previous, this and next segment, zeros where there is none, then 1 in a plan's first segment and 1 in its last.
        """
        tasks, segments, width = normalised.shape
        out = np.zeros((tasks, segments, 3 * width + 2), dtype=normalised.dtype)
        out[:, 1:, :width] = normalised[:, :-1]
        out[:, :, width : 2 * width] = normalised
        out[:, :-1, 2 * width : 3 * width] = normalised[:, 1:]
        out[:, 0, 3 * width] = 1.0
        out[:, -1, 3 * width + 1] = 1.0
        return out

    def arrange_pullback(self, grad_inputs: Array) -> Array:
        """(N, S, 3 F + 2) -> (N, S, F)."""
        width = (grad_inputs.shape[2] - 2) // 3
        grad = grad_inputs[:, :, width : 2 * width].copy()
        grad[:, :-1] += grad_inputs[:, 1:, :width]
        grad[:, 1:] += grad_inputs[:, :-1, 2 * width : 3 * width]
        return grad


class _Whole:
    """One row for the trajectory, seen as it is."""

    def arrange(self, normalised: Array) -> Array:
        """As they are."""
        return normalised

    def arrange_pullback(self, grad_inputs: Array) -> Array:
        """As they are."""
        return grad_inputs


class Coefficients(_Whole):
    """Every coefficient of x, y, z and yaw: the released code's inputs, 96 for three segments."""

    name: InputsName = "coefficients"

    def names(self, segments: int) -> tuple[str, ...]:
        """Axis by axis, segment by segment."""
        return tuple(f"c{k} of {axis} {s + 1}" for axis in _AXIS_NAMES for s in range(segments) for k in range(8))

    def features(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:  # noqa: ARG002 - blind to them
        """(N, 1, 32 S)."""
        return coefficients.reshape(len(coefficients), 1, -1)

    def pullback(
        self, durations_s: FloatArray, coefficients: FloatArray, grad_features: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `Inputs`."""
        return np.zeros(durations_s.shape), grad_features.reshape(coefficients.shape)


class Knots(_Whole):
    """The least numbers that say which trajectory it is: 39 for three segments.

    Waypoints relative to the first, then velocity, acceleration and jerk at the inner knots, then the durations.
    """

    name: InputsName = "knots"

    def names(self, segments: int) -> tuple[str, ...]:
        """In the order of `features`."""
        waypoints = [f"{axis} of waypoint {k + 2}" for axis in _AXIS_NAMES for k in range(segments)]
        inner = [f"{rate} of {a} at knot {k + 2}" for a in _AXIS_NAMES for k in range(segments - 1) for rate in _RATES]
        return (*waypoints, *inner, *(f"duration {k + 1}" for k in range(segments)))

    def features(self, durations_s: FloatArray, coefficients: FloatArray) -> FloatArray:
        """(N, 1, 17 S - 12)."""
        count = len(durations_s)
        powers = durations_s[..., None] ** np.arange(COEFFICIENTS)
        ends = np.einsum("nask,nsk->nas", coefficients, powers) - coefficients[:, :, :1, 0]
        inner = coefficients[:, :, 1:, 1:4] * _FACTORIALS
        return np.concatenate([ends.reshape(count, -1), inner.reshape(count, -1), durations_s], axis=1)[:, None]

    def pullback(
        self, durations_s: FloatArray, coefficients: FloatArray, grad_features: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `Inputs`; waypoints stand still whatever a planner does, so nothing is passed through them."""
        count, segments = durations_s.shape
        inner = grad_features[:, 0, AXES * segments : -segments].reshape(count, AXES, segments - 1, 3)
        grad_coefficients = np.zeros(coefficients.shape)
        grad_coefficients[:, :, 1:, 1:4] = inner * _FACTORIALS
        return grad_features[:, 0, -segments:].astype(np.float64), grad_coefficients


_AXIS_NAMES = ("x", "y", "z", "yaw")
_RATES = ("velocity", "acceleration", "jerk")
_FACTORIALS = np.array([1.0, 2.0, 6.0])
INPUTS: dict[InputsName, Inputs] = {"windows": Windows(), "knots": Knots(), "coefficients": Coefficients()}
