"""Buildings: frequencies, modes, damping, and every mistake that a building file can hold."""

from __future__ import annotations

from math import pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from published import MODEL
from scipy.linalg import eigh

from bristle.data.building_file import read_building
from bristle.errors import PhysicsError
from bristle.physics.building import (
    Building,
    frequencies,
    from_data,
    modes,
    paper_building,
)

STRUCTURE = MODEL["structure"]
DAMPING = MODEL["damping"]

GOOD = """
schema = 1
name = "my building"
masses = [1.969, 1.232, 1.232]
stiffnesses = [1057.0, 1366.5, 1366.5]
base = "isolated"
damping_ratio = 0.01
"""


def chain(
    masses: list[float], stiffnesses: list[float], *, base: str = "isolated", **damping: Any
) -> Building:
    data = {"schema": 1, "masses": masses, "stiffnesses": stiffnesses, "base": base}
    return from_data({**data, **(damping or {"damping_ratio": 0.0})})


def damping_ratios(building: Building) -> list[float]:
    """Return phi^T C phi / (2 omega) of each undamped mode, and see that no mode feeds another."""
    omega_squared, shapes = eigh(np.array(building.K), np.array(building.M))
    modal = shapes.T @ np.array(building.C) @ shapes
    assert np.abs(modal - np.diag(np.diag(modal))).max() <= 1e-9 * np.abs(modal).max()
    return (np.diag(modal) / (2.0 * np.sqrt(omega_squared))).tolist()


# -- the model of the paper


def test_frequencies_are_those_of_the_text() -> None:
    assert frequencies(paper_building()) == pytest.approx(MODEL["text"]["frequencies"], abs=1e-9)


def test_the_frequencies_fix_the_masses_uniquely() -> None:
    l1, l2, l3 = ((2.0 * pi * f) ** 2 for f in MODEL["text"]["frequencies"])
    e1, e2, e3 = l1 + l2 + l3, l1 * l2 + l2 * l3 + l1 * l3, l1 * l2 * l3
    roots = sorted(np.roots([5.0, -2.0 * e1, e2, -e3]).real, reverse=True)
    assert roots == pytest.approx(STRUCTURE["a"], rel=1e-9)
    for a, listed in zip(roots, STRUCTURE["floor_mass"], strict=True):
        r = e3 / a**2
        mu = (e1 - r - 3.0 * a) / a
        base = MODEL["text"]["isolation_stiffness"] / r
        assert mu * base == pytest.approx(listed, rel=1e-6)
        if mu > 0.0:
            model = paper_building()
            assert model.M[0][0] == pytest.approx(base, rel=1e-12)
            assert model.M[1][1] == pytest.approx(mu * base, rel=1e-12)
            assert model.stiffnesses[1] == pytest.approx(a * mu * base, rel=1e-12)
    assert sum(mass > 0.0 for mass in STRUCTURE["floor_mass"]) == 1


@pytest.mark.parametrize(("name", "table"), [("K", STRUCTURE), ("C", DAMPING)])
def test_matrices(name: str, table: dict[str, Any]) -> None:
    np.testing.assert_allclose(getattr(paper_building(), name), table[name], atol=5e-13, rtol=1e-12)


def test_the_mass_matrix_is_diagonal() -> None:
    model = paper_building()
    np.testing.assert_array_equal(model.M, np.diag(STRUCTURE["masses"]))
    assert model.isolated
    assert model.levels() == ["base", "floor1", "floor2"]
    assert model.stiffnesses == tuple(STRUCTURE["stiffnesses"])


def test_modes_are_those_listed_up_to_sign() -> None:
    model = paper_building()
    for m, (omega, shape) in enumerate(modes(model.M, model.K)):
        assert omega == pytest.approx(STRUCTURE["omegas"][m], abs=1e-9)
        listed = [row[m] for row in STRUCTURE["modes"]]
        sign = np.sign(shape[0] * listed[0])
        assert [sign * value for value in shape] == pytest.approx(listed, abs=1e-9)


def test_with_the_damper_locked_the_floors_swing_on_a_fixed_base() -> None:
    locked = chain(STRUCTURE["masses"][1:], STRUCTURE["stiffnesses"][1:], base="fixed")
    assert frequencies(locked) == pytest.approx(STRUCTURE["fixed_base_frequencies"], abs=1e-6)
    assert locked.levels() == ["floor1", "floor2"]


def test_rayleigh_damping_reaches_its_ratio_in_two_modes() -> None:
    assert damping_ratios(paper_building()) == pytest.approx(DAMPING["ratios"], abs=1e-6)


def test_rayleigh_by_modes_gives_the_same_as_by_its_coefficients() -> None:
    masses, stiffnesses = STRUCTURE["masses"], STRUCTURE["stiffnesses"]
    by_modes = chain(masses, stiffnesses, rayleigh={"ratio": 0.01, "modes": [1, 3]})
    np.testing.assert_allclose(by_modes.C, paper_building().C, rtol=1e-10, atol=1e-12)
    backwards = chain(masses, stiffnesses, rayleigh={"ratio": 0.01, "modes": [3, 1]})
    np.testing.assert_allclose(backwards.C, by_modes.C, rtol=1e-14)


def test_the_other_choice_of_rayleigh_modes() -> None:
    listed = DAMPING["modes_1_and_2"]
    masses, stiffnesses = STRUCTURE["masses"], STRUCTURE["stiffnesses"]
    other = chain(masses, stiffnesses, rayleigh={"ratio": 0.01, "modes": [1, 2]})
    ratios = damping_ratios(other)
    assert ratios == pytest.approx([0.01, 0.01, listed["third_ratio"]], abs=1e-6)
    c_12, k_12 = other.C[0][1], other.K[0][1]
    assert c_12 / k_12 == pytest.approx(listed["beta"], rel=1e-8)
    alpha = (other.C[0][0] - listed["beta"] * other.K[0][0]) / other.M[0][0]
    assert alpha == pytest.approx(listed["alpha"], rel=1e-6)


# -- any building


@pytest.mark.parametrize("ratio", [0.0, 0.01, 0.2])
def test_one_ratio_holds_in_every_mode(ratio: float) -> None:
    building = chain([2.0, 1.0, 3.0, 0.5], [900.0, 400.0, 700.0, 50.0], damping_ratio=ratio)
    assert damping_ratios(building) == pytest.approx([ratio] * 4, abs=1e-10)


def test_modal_ratios_come_in_the_order_of_the_frequencies() -> None:
    ratios = [0.01, 0.03, 0.005]
    building = chain([2.0, 1.0, 1.0], [900.0, 400.0, 700.0], modal=ratios)
    assert damping_ratios(building) == pytest.approx(ratios, abs=1e-10)
    np.testing.assert_allclose(building.C, np.transpose(building.C), rtol=0, atol=1e-14)


@pytest.mark.parametrize("floors", [1, 2, 5, 20])
def test_frequencies_of_a_uniform_building_in_closed_form(floors: int) -> None:
    # omega_j = 2 sqrt(k/m) sin((2j - 1) pi / (4n + 2)): Blevins 2016, Formulas for Dynamics.
    m, k = 1000.0, 4e6
    building = chain([m] * floors, [k] * floors, base="fixed")
    expected = [
        2.0 * (k / m) ** 0.5 * sin((2 * j - 1) * pi / (4 * floors + 2)) / (2.0 * pi)
        for j in range(1, floors + 1)
    ]
    assert frequencies(building) == pytest.approx(expected, rel=1e-11)
    assert len(building.levels()) == floors


@pytest.mark.parametrize("floors", [1, 7, 20])
def test_an_isolated_building_has_a_base_below_its_floors(floors: int) -> None:
    building = chain([1.0] * (floors + 1), [1e3] * (floors + 1))
    assert building.levels() == ["base", *(f"floor{i}" for i in range(1, floors + 1))]


@pytest.mark.parametrize(("base", "most"), [("isolated", 21), ("fixed", 20)])
def test_twenty_floors_are_the_most(base: str, most: int) -> None:
    assert chain([1.0] * most, [1.0] * most, base=base).size == most
    with pytest.raises(PhysicsError, match="at most 20 floors, found 21"):
        chain([1.0] * (most + 1), [1.0] * (most + 1), base=base)


def matrices_of(building: Building) -> dict[str, Any]:
    return {name: [list(row) for row in getattr(building, name)] for name in ("M", "C", "K")}


def test_full_matrices_give_the_same_building_as_masses_and_stiffnesses() -> None:
    model = paper_building()
    full = from_data({"schema": 1, "name": model.name, **matrices_of(model)})
    assert (full.M, full.C, full.K, full.isolated) == (model.M, model.C, model.K, True)
    assert full.stiffnesses == pytest.approx(model.stiffnesses, rel=1e-12)


def test_a_consistent_mass_matrix_is_taken() -> None:
    M = [[4.0, 1.0, 0.0], [1.0, 4.0, 1.0], [0.0, 1.0, 2.0]]
    K = [[300.0, -100.0, 0.0], [-100.0, 200.0, -100.0], [0.0, -100.0, 100.0]]
    building = from_data({"schema": 1, "M": M, "C": [[0.0] * 3] * 3, "K": K})
    expected = np.sqrt(eigh(np.array(K), np.array(M), eigvals_only=True)) / (2.0 * pi)
    assert frequencies(building) == pytest.approx(expected, rel=1e-12)
    for omega, shape in modes(M, K):
        assert np.array(shape) @ np.array(M) @ np.array(shape) == pytest.approx(1.0, rel=1e-12)
        residual = (np.array(K) - omega**2 * np.array(M)) @ np.array(shape)
        assert np.abs(residual).max() <= 1e-9 * np.abs(K).max()


@pytest.mark.parametrize("scale", [0.0, 1e-200, 1.0, 1e200])
def test_damping_that_leaves_a_motion_alone_is_taken(scale: float) -> None:
    """Dampers between floors: the building as one moves without them; files round the entries."""
    C = [[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0 - 1e-10]]
    table = {"schema": 1, **matrices_of(paper_building()), "C": [[scale * c for c in r] for r in C]}
    assert from_data(table).C[1][1] == 2.0 * scale
    table["C"][2][2] = scale * (1.0 - 1e-6)
    if scale:
        with pytest.raises(PhysicsError, match="not positive semidefinite"):
            from_data(table)


def test_attached_mass_adds_to_the_first_level_and_only_there() -> None:
    model = paper_building()
    heavier = model.with_attached_mass(0.5)
    assert heavier.M[0][0] == model.M[0][0] + 0.5
    assert heavier.M[0][1:] == model.M[0][1:]
    assert heavier.M[1:] == model.M[1:]
    assert (heavier.C, heavier.K) == (model.C, model.K)
    assert all(f < g for f, g in zip(frequencies(heavier), frequencies(model), strict=True))
    assert model == paper_building()


# -- building files


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "building.toml"


def test_a_file_is_read(file: Path) -> None:
    file.write_text(GOOD, encoding="utf-8")
    building = read_building(file)
    assert building.name == "my building"
    assert building.stiffnesses == (1057.0, 1366.5, 1366.5)


FULL = """
schema = 1
M = [[2.0, 0.0], [0.0, 1.0]]
C = [[0.1, 0.0], [0.0, 0.1]]
K = [[3.0, -1.0], [-1.0, 1.0]]
"""
RATIO = "damping_ratio = 0.01"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (GOOD + "colour = 3\n", "unknown key 'colour'; there are .*'masses'"),
        (GOOD.replace("isolated", "floating"), 'base = \'floating\'; "isolated" or "fixed"'),
        (GOOD.replace("[1057.0", "[0.0"), r"stiffnesses\[0\] = 0.0 must be positive"),
        (GOOD.replace("[1.969", "[nan"), "masses must be a finite number, found nan"),
        (GOOD.replace("[1.969", "[inf"), "masses must be a finite number, found inf"),
        (GOOD.replace("[1.969", "[true"), "masses must be a finite number, found True"),
        (GOOD.replace("[1.969", '["2 kg"'), "masses must be a finite number, found '2 kg'"),
        (GOOD.replace("[1.969, 1.232, 1.232]", "[]"), "masses must be a list of numbers"),
        (GOOD.replace("masses", "#"), "masses must be a list of numbers"),
        (GOOD.replace("stiffnesses", "#"), "stiffnesses must be a list of numbers"),
        (GOOD.replace(RATIO, ""), "give one of damping_ratio, modal, rayleigh; found none"),
        (GOOD + "modal = [0.01, 0.01, 0.01]\n", r"found \['damping_ratio', 'modal'\]"),
        (GOOD.replace("0.01", "1.0"), r"damping_ratio = 1.0 must lie in \[0, 1\)"),
        (GOOD.replace("0.01", "-0.01"), r"damping_ratio = -0.01 must lie in \[0, 1\)"),
        (GOOD.replace(RATIO, "modal = [0.01]"), "modal needs one ratio for each of 3 modes"),
        (GOOD.replace(RATIO, "modal = [0.01, 0.01, 2]"), r"modal = 2.0 must lie in \[0, 1\)"),
        (GOOD.replace(RATIO, "rayleigh = 0.01"), r"rayleigh = \{ ratio, modes = \[1, 3\] \} or"),
        (GOOD.replace(RATIO, "rayleigh = { alpha = 1.0 }"), r"rayleigh = \{ ratio, modes"),
        (GOOD.replace(RATIO, "rayleigh = { alpha = -1.0, beta = 0 }"), "must not be negative"),
        (GOOD.replace(RATIO, "rayleigh = { ratio = 0.01, modes = [1, 4] }"), "numbers of 1 to 3"),
        (GOOD.replace(RATIO, "rayleigh = { ratio = 0.01, modes = [0, 1] }"), "numbers of 1 to 3"),
        (GOOD.replace(RATIO, "rayleigh = { ratio = 0.01, modes = [2, 2] }"), "two different"),
        (GOOD.replace(RATIO, "rayleigh = { ratio = 0.01, modes = [1] }"), "two different"),
        (GOOD.replace(RATIO, "rayleigh = { ratio = 7, modes = [1, 2] }"), r"rayleigh.ratio = 7.0"),
        (FULL + "masses = [1.0, 2.0]\n", "either M, C, K or masses, not both"),
        (FULL + "damping_ratio = 0.1\n", "either M, C, K or damping_ratio, not both"),
        (FULL.replace("C =", "#"), "C must be a square matrix, a list of rows"),
        (FULL.replace("C = [[0.1, 0.0], [0.0, 0.1]]", "C = [[0.1]]"), "M, C and K differ in size"),
        (FULL.replace("[[2.0, 0.0], [0.0, 1.0]]", "[[2.0, 0.0], [1.0]]"), "M must be square"),
        (FULL.replace("[-1.0, 1.0]", "[-1.1, 1.0]"), "K is not symmetric"),
        (FULL.replace("[[2.0", "[[-2.0"), "M is not positive definite"),
        (FULL.replace("[-1.0, 1.0]", "[-1.0, 0.2]"), "K is not positive definite"),
        (FULL.replace("0.1", "-50.0"), "C is not positive semidefinite: its least .* is -50 N s/m"),
        (FULL.replace("0.0, 0.1]", "0.2, 0.1]").replace("[0.1, 0.0", "[0.1, 0.2"), "is -0.1 N s/m"),
    ],
)
def test_a_wrong_file_says_where_and_what(file: Path, text: str, says: str) -> None:
    file.write_text(text, encoding="utf-8")
    with pytest.raises(PhysicsError, match=says) as caught:
        read_building(file)
    assert str(file) in str(caught.value)


def test_a_file_that_is_not_there(file: Path) -> None:
    with pytest.raises(PhysicsError, match=r"building\.toml: there is no such file"):
        read_building(file)
