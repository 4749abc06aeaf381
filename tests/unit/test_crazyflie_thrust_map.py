"""Newtons to u16: the maps that ship, a user's own, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.crazyflie.thrust_map import LARGEST, SMALLEST, thrust_map
from lcd_flight.model import GRAVITY_M_PER_S2, InputError
from lcd_flight.worlds import load_vehicle
from sim_bridge.crazyflie.variants import linear_in_force, linear_in_pulse_width

VEHICLE = load_vehicle("crazyflie-2.1")
SHIPPED = ("cf2-plus-propellers", "cf2-thrust-upgrade", "cf21bl", "cf2-pwm-identified")


@pytest.mark.parametrize(
    ("name", "mass_kg", "hover"),
    [("cf2-plus-propellers", 0.029, 38842), ("cf2-thrust-upgrade", 0.0325, 29020), ("cf21bl", 0.0393, 31582)],
)
def test_hover_counts_are_those_of_the_platforms(name: str, mass_kg: float, hover: int) -> None:
    assert thrust_map(name, VEHICLE).counts(mass_kg * GRAVITY_M_PER_S2) == pytest.approx(hover, abs=2)


def test_the_vehicle_files_largest_thrust_is_the_default() -> None:
    chosen = thrust_map("vehicle", VEHICLE)
    assert chosen.full_scale_N == VEHICLE.max_thrust_N
    assert chosen.force_linear
    assert chosen.described(VEHICLE) == "thrust map vehicle version 1: hover at 38842 of 65535"
    assert thrust_map("vehicle", replace(VEHICLE, k_eta=2.0 * VEHICLE.k_eta)).counts(0.2) < chosen.counts(0.2)


def test_the_pulse_width_map_is_the_inverse_of_what_older_firmware_does() -> None:
    chosen = thrust_map("cf2-pwm-identified", VEHICLE)
    assert not chosen.force_linear
    for thrust_N in (0.1, 0.2, 0.3, 0.4):
        assert linear_in_pulse_width(chosen.counts(thrust_N), 1.0) == pytest.approx(thrust_N, rel=1e-3)


@pytest.mark.parametrize("name", ["vehicle", *SHIPPED])
@given(thrust_N=st.floats(-1.0, 10.0))
def test_counts_are_none_or_within_what_the_firmware_takes(name: str, thrust_N: float) -> None:
    counts = thrust_map(name, VEHICLE).counts(thrust_N)
    assert counts == 0 or SMALLEST <= counts <= LARGEST
    assert counts == 0 or thrust_N > 0.0


def test_counts_rise_with_thrust() -> None:
    for name in ("vehicle", *SHIPPED):
        chosen = thrust_map(name, VEHICLE)
        counts = [chosen.counts(0.01 * step) for step in range(60)]
        assert counts == sorted(counts)
    assert linear_in_force(thrust_map("vehicle", VEHICLE).counts(0.3), VEHICLE.max_thrust_N) == pytest.approx(
        0.3, rel=1e-4
    )


def test_a_map_from_a_file_carries_the_state_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine:\n  version: 3\n  kind: force-linear\n  full_scale_N: 0.6\n  source: a scale\n")
    first = thrust_map(str(file), VEHICLE)
    assert (first.version, first.source, first.counts(0.3)) == (3, "a scale", 32768)
    file.write_text(file.read_text().replace("0.6", "0.61"))
    assert thrust_map(str(file), VEHICLE).name != first.name


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("mine: {version: 1, kind: cubic, source: x}", "kind"),
        ("mine: {version: 1, kind: force-linear, source: x}", "needs full_scale_N"),
        ("mine: {version: 1, kind: square-root, source: x, c1: 0.1}", "needs c1, c2 and c3"),
        ("mine: {version: 1, kind: force-linear, source: x, full_scale_N: -1}", "full_scale_N"),
        ("mine: {version: 1, kind: force-linear, source: x, full_scale_N: 1, scale: 2}", "scale"),
        ("{", "mine.yaml"),
        ("a: {version: 1, kind: force-linear, source: x, full_scale_N: 1}\n"
         "b: {version: 1, kind: force-linear, source: x, full_scale_N: 1}", "one map is wanted"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_told(text: str, complaint: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=complaint):
        thrust_map(str(file), VEHICLE)


def test_an_unknown_name_lists_what_there_is() -> None:
    with pytest.raises(InputError, match="nor one of: vehicle, cf2-plus-propellers"):
        thrust_map("cf3", VEHICLE)
