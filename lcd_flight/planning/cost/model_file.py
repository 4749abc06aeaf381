"""Models of the tracking cost as files: one safetensors file each, checked from end to end when it is loaded.

The metadata holds one JSON text: the card, the feature version, inputs and activation, and a SHA-256 over all of
that and every tensor. The tensors `test.*` are plans with the cost that the model gave them when it was saved: a
machine, a library or a feature that computes something else is found out at loading, not in the air.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lcd_flight.files import write_whole
from lcd_flight.model import InputError, Loop, Trajectories
from lcd_flight.planning.cost.features import FEATURE_VERSION
from lcd_flight.planning.cost.inputs import INPUTS
from lcd_flight.planning.cost.network import ACTIVATIONS, Network
from lcd_flight.planning.cost.tracking_cost import CostModel

if TYPE_CHECKING:
    from lcd_flight.planning.cost.model_card import ModelCard

MODELS = Path(__file__).parent.parent / "models"
"""Where the models that ship are."""
SUFFIX = ".safetensors"
TEST_TOLERANCE = 1e-4
"""Largest difference in the test plans' costs (logarithms of m) that rounding may make."""

_KEY = "lcd_flight"
_FORMAT = 1
_RANGES = ("feature_mean", "feature_spread", "feature_low", "feature_high")

Tensors = dict[str, NDArray[Any]]


def model_names() -> tuple[str, ...]:
    """The names of the models that ship."""
    return tuple(sorted(path.stem for path in MODELS.glob(f"*{SUFFIX}")))


def save_model(path: Path, model: CostModel, card: ModelCard, test_plans: Trajectories) -> CostModel:
    """Write a model, whole or not at all; the same model and card give the same bytes.

    Args:
        path: `*.safetensors`.
        model: as trained.
        card: what it is good for.
        test_plans: a few plans of the kind that it will judge; every load computes their costs again.

    Returns:
        The model with its card.

    Raises:
        InputError: the model cannot be saved: numbers that are not finite, or a folder that cannot be written.
    """
    from safetensors.numpy import save

    value, _, _ = model.value_and_gradient(test_plans.durations_s, test_plans.coefficients)
    tensors: Tensors = {name: getattr(model, name) for name in _RANGES}
    for i, layer in enumerate(model.network.layers):
        tensors |= {f"layer{i}.weights": layer.weights, f"layer{i}.biases": layer.biases}
        tensors |= {} if layer.skip is None else {f"layer{i}.skip": layer.skip.weights}
    tensors |= {"test.durations_s": test_plans.durations_s, "test.coefficients": test_plans.coefficients}
    tensors = {name: np.ascontiguousarray(t) for name, t in sorted((tensors | {"test.value": value}).items())}
    _check_finite(path, tensors)
    about = {
        "format": _FORMAT,
        "feature_version": FEATURE_VERSION,
        "inputs": model.inputs.name,
        "activation": model.network.activation,
        "card": card.model_dump(mode="json"),
    }
    metadata = json.dumps(about | {"sha256": _digest(tensors, about)}, sort_keys=True)
    write_whole(path, save(tensors, {_KEY: metadata}))
    return replace(model, card=card)


def load_model(name_or_path: str | Path) -> CostModel:
    """A model that ships, by name, or one from a file; checked for damage, and that it computes what it did when saved.

    Raises:
        InputError: there is no such model, the file is damaged, or it was made for other features.
    """
    path = _find(name_or_path)
    tensors, about = _read(path)
    if about.get("format") != _FORMAT:
        raise InputError(f"{path}: model format {about.get('format')}, this version reads {_FORMAT}; train it anew")
    if about.pop("sha256", None) != _digest(tensors, about):
        raise InputError(f"{path}: the checksum does not match: the file was damaged or changed; copy it again")
    if about["feature_version"] != FEATURE_VERSION:
        version = about["feature_version"]
        raise InputError(f"{path}: made for feature version {version}, this is {FEATURE_VERSION}; train it anew")
    _check_finite(path, tensors)
    model = replace(_model(path, tensors, about), card=_card(path, about))
    _check_reproduces(path, model, tensors)
    return model


def check_fits(model: CostModel, vehicle_fingerprint: str, loop: Loop) -> None:
    """Refuse to plan for a vehicle or a loop that the model was not trained on.

    Args:
        model: as loaded.
        vehicle_fingerprint: of the vehicle that will fly, from `lcd_flight.worlds`.
        loop: that will fly it.

    Raises:
        InputError: it does not fit, or has no card.
    """
    card = model.card
    if card is None:
        raise InputError("this model has no card; save it first, so that what it is good for can be checked")
    if card.vehicle_fingerprint != vehicle_fingerprint:
        raise InputError(
            f"model {card.name}: trained for another vehicle ({card.vehicle}, fingerprint {card.vehicle_fingerprint}, "
            f"this one has {vehicle_fingerprint}); train one with `lcd train`, or plan with minimum-snap"
        )
    if card.loop != loop:
        raise InputError(
            f"model {card.name}: trained for the {card.loop} loop, not for the {loop} loop; "
            f"train one with `lcd train` on worlds of that loop, or plan with minimum-snap"
        )


def _find(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.suffix != SUFFIX and len(path.parts) == 1:
        path = MODELS / f"{path}{SUFFIX}"
        if not path.is_file():
            shipped = ", ".join(model_names()) or "none"
            raise InputError(f"no model `{name_or_path}`; shipped: {shipped}; or give the path of a *{SUFFIX} file")
    return path


def _read(path: Path) -> tuple[Tensors, dict[str, Any]]:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="numpy") as file:
            about = json.loads((file.metadata() or {}).get(_KEY, "{}"))
            tensors = {name: file.get_tensor(name) for name in sorted(file.keys())}
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such model file") from None
    except (SafetensorError, OSError, ValueError) as error:
        raise InputError(f"{path}: not a readable model file ({error}); copy it again") from None
    return tensors, about if isinstance(about, dict) else {}


def _model(path: Path, tensors: Tensors, about: Mapping[str, Any]) -> CostModel:
    """Put the tensors together; the checksum has shown that they are what was saved."""
    inputs = about.get("inputs", "windows")  # files from before there was a choice do not say
    if about["activation"] not in ACTIVATIONS or inputs not in INPUTS:
        raise InputError(f"{path}: a model of another version of this program; train it anew")
    numbers = range(sum(name.endswith(".weights") for name in tensors))
    weights, biases = ([tensors[f"layer{i}.{kind}"] for i in numbers] for kind in ("weights", "biases"))
    skips = [tensors[f"layer{i}.skip"] for i in numbers if f"layer{i}.skip" in tensors]
    network = Network.of(weights, biases, about["activation"], skips)
    mean, spread, low, high = (tensors[name] for name in _RANGES)
    return CostModel(network, mean, spread, low, high, INPUTS[inputs])


def _card(path: Path, about: Mapping[str, Any]) -> ModelCard:
    from pydantic import ValidationError

    from lcd_flight.planning.cost.model_card import ModelCard

    try:
        return ModelCard.model_validate(about["card"])
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise InputError(f"{path}: its card is of another version ({key}: {first['msg']}); train it anew") from None


def _check_finite(path: Path, tensors: Tensors) -> None:
    for name, tensor in tensors.items():
        if not np.isfinite(tensor).all():
            raise InputError(f"{path}: tensor {name} holds numbers that are not finite; train it anew")


def _check_reproduces(path: Path, model: CostModel, tensors: Tensors) -> None:
    value, _, _ = model.value_and_gradient(tensors["test.durations_s"], tensors["test.coefficients"])
    difference = float(np.abs(value - tensors["test.value"]).max())
    if not difference <= TEST_TOLERANCE:
        raise InputError(
            f"{path}: its test plans cost something else here (by {difference:.2g}, tolerance {TEST_TOLERANCE:g}); "
            "train it anew with this version"
        )


def _digest(tensors: Tensors, about: Mapping[str, Any]) -> str:
    """SHA-256 over everything in the file but itself."""
    sha = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
    for name in sorted(tensors):
        tensor = np.ascontiguousarray(tensors[name])
        sha.update(f"{name} {tensor.dtype.str} {tensor.shape}".encode() + tensor.tobytes())
    return sha.hexdigest()
