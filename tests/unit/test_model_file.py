"""Model files: what is saved is loaded, and nothing that is damaged, foreign or strange is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cost_models
import numpy as np
import pytest
import tracking_cost_torch as reference
from safetensors.numpy import load_file, save_file

from lcd_flight.model import InputError, Trajectories
from lcd_flight.planning.cost import model_file
from lcd_flight.planning.cost.model_file import check_fits, load_model, model_names, save_model
from lcd_flight.planning.cost.tracking_cost import CostModel

PLANS = Trajectories(*reference.random_plans(4, 3, seed=1))
FINGERPRINT = cost_models.CARD.vehicle_fingerprint


def single_model() -> CostModel:
    model = cost_models.random_model()
    return replace(model, network=model.network.astype(np.float32))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "model.safetensors"
    save_model(path, single_model(), cost_models.CARD, PLANS)
    return path


def rewrite(path: Path, change: Callable[[dict[str, Any], dict[str, Any]], None], sign: bool = True) -> None:
    """Change tensors and metadata of a model file, as somebody who knows the checksum would."""
    tensors = load_file(path)
    about = read_metadata(path)
    about.pop("sha256")
    change(tensors, about)
    if sign:
        about["sha256"] = model_file._digest(tensors, about)
    save_file(tensors, path, {"lcd_flight": json.dumps(about)})


def read_metadata(path: Path) -> dict[str, Any]:
    size = int.from_bytes(path.read_bytes()[:8], "little")
    header = json.loads(path.read_bytes()[8 : 8 + size])
    return dict(json.loads(header["__metadata__"]["lcd_flight"]))


def refusal(path: Path) -> str:
    """The one line with which a file is refused."""
    with pytest.raises(InputError) as caught:
        load_model(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_saved_is_loaded(tmp_path: Path, dtype: type) -> None:
    model = cost_models.random_model(members=3, activation="elu")
    model = replace(model, network=model.network.astype(dtype))
    path = tmp_path / "m.safetensors"
    saved = save_model(path, model, cost_models.CARD, PLANS)
    loaded = load_model(path)
    assert saved.card == loaded.card == cost_models.CARD
    assert loaded.network.dtype == dtype
    plans = reference.random_plans(7, 5, seed=2)
    for got, wanted in zip(loaded.value_and_gradient(*plans), model.value_and_gradient(*plans), strict=True):
        assert np.array_equal(got, wanted)
    assert loaded.out_of_range(*plans) == model.out_of_range(*plans)


def test_the_same_model_gives_the_same_bytes(path: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.safetensors"
    save_model(again, single_model(), cost_models.CARD, PLANS)
    assert again.read_bytes() == path.read_bytes()


def test_nothing_else_is_left_in_the_folder(path: Path) -> None:
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_model_of_the_default_size_is_below_a_megabyte(tmp_path: Path) -> None:
    model = cost_models.random_model(members=2, sizes=(128, 128, 32))
    path = tmp_path / "m.safetensors"
    save_model(path, replace(model, network=model.network.astype(np.float32)), cost_models.CARD, PLANS)
    assert path.stat().st_size < 1_000_000


def test_every_flipped_byte_is_found_out(path: Path) -> None:
    whole = path.read_bytes()
    header = int.from_bytes(whole[:8], "little") + 8
    rng = np.random.default_rng(3)
    places = np.concatenate([np.arange(8), rng.integers(8, header, 60), rng.integers(header, len(whole), 60)])
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        assert refusal(path)


def test_a_changed_weight_is_named_as_damage(path: Path) -> None:
    whole = bytearray(path.read_bytes())
    whole[-100] ^= 1
    path.write_bytes(whole)
    assert "checksum does not match" in refusal(path)


def test_a_changed_card_is_named_as_damage(path: Path) -> None:
    rewrite(path, lambda tensors, about: about["card"].update(vehicle="hummingbird"), sign=False)
    assert "checksum does not match" in refusal(path)


@pytest.mark.parametrize("keep", [0, 4, 100, 5000])
def test_a_file_cut_short_is_refused(path: Path, keep: int) -> None:
    path.write_bytes(path.read_bytes()[:keep])
    assert "not a readable model file" in refusal(path)


def test_another_safetensors_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    save_file({"x": np.zeros(3)}, path)
    assert "model format None" in refusal(path)


@pytest.mark.parametrize("text", ["[]", "3", '"x"', "{"])
def test_strange_metadata_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "other.safetensors"
    save_file({"x": np.zeros(3)}, path, {"lcd_flight": text})
    assert refusal(path)


def test_weights_that_are_not_finite_are_neither_saved_nor_loaded(path: Path) -> None:
    broken = cost_models.random_model()
    broken.network.layers[1].weights[0, 3, 2] = np.nan
    with pytest.raises(InputError, match=r"layer1\.weights holds numbers that are not finite"):
        save_model(path, broken, cost_models.CARD, PLANS)
    rewrite(path, lambda tensors, about: tensors["layer0.biases"].__setitem__((0, 0), np.inf))
    assert "layer0.biases holds numbers that are not finite" in refusal(path)


def test_other_features_are_refused(path: Path) -> None:
    rewrite(path, lambda tensors, about: about.update(feature_version=0))
    assert "made for feature version 0" in refusal(path)


def test_a_newer_format_is_refused(path: Path) -> None:
    rewrite(path, lambda tensors, about: about.update(format=2))
    assert "model format 2" in refusal(path)


def test_an_unknown_activation_is_refused(path: Path) -> None:
    rewrite(path, lambda tensors, about: about.update(activation="gelu"))
    assert "another version" in refusal(path)


def test_a_card_of_another_version_is_refused(path: Path) -> None:
    rewrite(path, lambda tensors, about: about["card"].pop("loop"))
    assert "card is of another version (loop: " in refusal(path)


def test_test_plans_that_cost_something_else_are_refused(path: Path) -> None:
    rewrite(path, lambda tensors, about: tensors["test.value"].__iadd__(2e-4))
    assert "test plans cost something else" in refusal(path)


def test_rounding_in_the_test_plans_is_forgiven(path: Path) -> None:
    rewrite(path, lambda tensors, about: tensors["test.value"].__iadd__(5e-5))
    load_model(path)


def test_a_missing_name_lists_what_ships(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_file, "MODELS", tmp_path)
    with pytest.raises(InputError, match="no model `nope`; shipped: none"):
        load_model("nope")
    for name in ("b", "a"):
        save_model(tmp_path / f"{name}.safetensors", single_model(), cost_models.CARD, PLANS)
    assert model_names() == ("a", "b")
    with pytest.raises(InputError, match="no model `nope`; shipped: a, b; or give the path"):
        load_model("nope")
    assert load_model("a").card == cost_models.CARD


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    assert "there is no such model file" in refusal(tmp_path / "gone.safetensors")


def test_a_folder_in_place_of_a_file_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "m.safetensors"
    folder.mkdir()
    assert refusal(folder)
    with pytest.raises(InputError, match="is a folder; name a file in it"):
        save_model(folder, single_model(), cost_models.CARD, PLANS)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written"):
        save_model(tmp_path / "file" / "m.safetensors", single_model(), cost_models.CARD, PLANS)


def test_a_model_fits_its_own_vehicle_and_loop_only(path: Path) -> None:
    model = load_model(path)
    check_fits(model, FINGERPRINT, "paper")
    with pytest.raises(InputError, match=r"test-model: trained for another vehicle \(crazyflie, .*this one has beef"):
        check_fits(model, "beef", "paper")
    with pytest.raises(InputError, match="trained for the paper loop, not for the flight loop; train one with"):
        check_fits(model, FINGERPRINT, "flight")


def test_a_model_without_a_card_fits_nothing() -> None:
    with pytest.raises(InputError, match="no card"):
        check_fits(single_model(), FINGERPRINT, "paper")


@pytest.mark.parametrize("name", model_names())
def test_models_that_ship_load_and_are_small(name: str) -> None:
    model = load_model(name)
    assert model.card is not None
    assert model.card.name == name
    assert (model_file.MODELS / f"{name}.safetensors").stat().st_size < 1_000_000
