"""An ensemble of small fully connected networks, forward and backward.

A network with `skips` is fed its inputs at every layer, too. Where the weights between its layers are not negative and
the activation is convex and never falls (elu, relu), it is convex in its inputs (Amos, Xu, Kolter 2017): the paper's
future work.

The members are stacked, so that one call serves all of them. The arithmetic is that of the weights: float32 for
planning, float64 where a test wants the last digit. A row's outputs depend on that row alone, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from lcd_flight.jit import Compiler
from lcd_flight.planning.cost import network_kernel

Activation: TypeAlias = Literal["silu", "elu", "relu"]
ACTIVATIONS: tuple[Activation, ...] = get_args(Activation)
Array: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """One layer of every member.

    weights: (M, inputs, outputs); transposed: (M, outputs, inputs), for the way back; biases: (M, outputs).
    """

    weights: Array
    transposed: Array
    biases: Array
    skip: Layer | None = None
    """From the network's inputs straight to this layer; without biases of its own (zeros)."""

    @staticmethod
    def of(weights: Array, biases: Array, skip: Array | None = None) -> Layer:
        """From weights (M, inputs, outputs), biases (M, outputs) and a skip (M, network's inputs, outputs)."""
        transposed = np.ascontiguousarray(weights.transpose(0, 2, 1))
        around = None if skip is None else Layer.of(skip, np.zeros_like(biases))
        return Layer(np.ascontiguousarray(weights), transposed, np.ascontiguousarray(biases), around)

    def forward(self, x: Array, inputs: Array) -> Array:
        """Before the activation: (M, B, outputs) of the layer before (M or 1, B, .) and the network's inputs."""
        out = _affine(x, self.weights, self.biases)
        return out if self.skip is None else out + _affine(inputs, self.skip.weights, self.skip.biases)

    def backward(self, grad: Array) -> Array:
        """The gradient by the layer before, from that before the activation."""
        return _affine(grad, self.transposed, np.zeros(self.weights.shape[:2], self.weights.dtype))


@dataclass(frozen=True, slots=True, eq=False)
class Tape:
    """What a backward pass needs of the forward pass: the slopes of each hidden layer's activation."""

    slopes: tuple[Array, ...]
    """(M, B, width) for each hidden layer."""


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """M networks with one output each; every layer but the last is followed by the activation."""

    layers: tuple[Layer, ...]
    activation: Activation

    @staticmethod
    def of(
        weights: Sequence[Array], biases: Sequence[Array], activation: Activation, skips: Sequence[Array] = ()
    ) -> Network:
        """From weights (M, inputs, outputs) and biases (M, outputs), input layer first; the last has one output.

        skips: (M, network's inputs, outputs) of every layer but the first, or none at all.
        """
        around = (None, *skips) if skips else (None,) * len(weights)
        return Network(tuple(Layer.of(w, b, s) for w, b, s in zip(weights, biases, around, strict=True)), activation)

    @property
    def members(self) -> int:
        """How many networks there are."""
        return int(self.layers[0].weights.shape[0])

    @property
    def inputs(self) -> int:
        """How many inputs they take."""
        return int(self.layers[0].weights.shape[1])

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the weights, and so of all arithmetic."""
        return self.layers[0].weights.dtype

    def astype(self, dtype: type[np.floating[Any]]) -> Network:
        """The same networks in another precision."""
        weights = [layer.weights.astype(dtype) for layer in self.layers]
        biases = [layer.biases.astype(dtype) for layer in self.layers]
        return Network.of(weights, biases, self.activation, [skip.astype(dtype) for skip in self.skips])

    @property
    def skips(self) -> list[Array]:
        """(M, inputs, outputs) of every layer but the first; empty for a network without."""
        return [layer.skip.weights for layer in self.layers if layer.skip is not None]

    def forward(self, inputs: Array) -> tuple[Array, Tape]:
        """Outputs (M, B) for inputs (B, inputs), and what `backward` needs."""
        first = np.ascontiguousarray(inputs, dtype=self.dtype)[None]
        x, slopes = first, []
        for layer in self.layers[:-1]:
            x, slope = activate(layer.forward(x, first), self.activation)
            slopes.append(slope)
        return self.layers[-1].forward(x, first)[..., 0], Tape(tuple(slopes))

    def backward(self, tape: Tape, grad_outputs: Array) -> Array:
        """From a function's gradient by the outputs (M, B) to its gradient by the inputs (B, inputs)."""
        grad = np.asarray(grad_outputs, dtype=self.dtype)[..., None]
        around: list[Array] = []
        for layer, slope in zip(reversed(self.layers), (*reversed(tape.slopes), None), strict=True):
            if layer.skip is not None:
                around.append(layer.skip.backward(grad))
            grad = layer.backward(grad) if layer.weights.shape[2] > 1 else grad * layer.transposed
            if slope is not None:
                grad *= slope
        return np.asarray(sum(around, grad).sum(axis=0))


def _affine(x: Array, weights: Array, biases: Array) -> Array:
    """x (M or 1, B, inputs) @ weights + biases: (M, B, outputs)."""
    out = np.empty((len(weights), x.shape[1], weights.shape[2]), weights.dtype)
    _kernel()(x, weights, biases, out)
    return out


@cache
def _kernel() -> Callable[[Array, Array, Array, Array], None]:
    compiler = Compiler(Path(network_kernel.__file__), nogil=True, error_model="numpy", fastmath={"contract"})
    return compiler.kernel(network_kernel.affine)


def activate(x: Array, activation: Activation) -> tuple[Array, Array]:
    """The activation of `x` and its slope there."""
    if activation == "silu":
        share = 0.5 * x  # then, in place: the logistic function, without overflow
        np.tanh(share, out=share)
        share *= 0.5
        share += 0.5
        value = x * share
        slope = 1.0 - share
        slope *= value
        slope += share
        return value, slope
    if activation == "elu":
        decay = np.exp(np.minimum(x, 0.0))
        return np.maximum(x, 0.0) + (decay - 1.0), decay
    return np.maximum(x, 0.0), (x > 0.0).astype(x.dtype)
