"""The generalized plant and its norms, against published numbers and closed forms."""

from __future__ import annotations

from math import inf, sqrt

import control
import numpy as np
import pytest

from bristle.errors import DesignError
from bristle.physics.building import Building, frequencies, from_data, paper_building
from bristle.synthesis.analysis import gains, hinf_norm, least_gamma
from bristle.synthesis.damper import DesignDamper, coefficients, stiffness
from bristle.synthesis.plant import (
    Plant,
    StateSpace,
    balancing,
    check_building,
    family,
    generalized,
    structure,
)
from bristle.synthesis.weights import Weight, Weights

GRID = np.array([0.0, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3])


@pytest.fixture(scope="module")
def plant() -> Plant:
    return generalized(paper_building(), Weights())


def full_mass_building() -> Building:
    """Return a building whose mass matrix couples: the force reaches the top floor directly."""
    paper = paper_building()
    M = [list(row) for row in paper.M]
    M[0][2] = M[2][0] = 0.3
    data = {"schema": 1, "M": M, "C": [list(r) for r in paper.C], "K": [list(r) for r in paper.K]}
    return from_data(data)


def test_open_loop_norm(plant: Plant) -> None:
    # The published 62.412 is read off a frequency grid: the peak of the 1 % mode lies between.
    assert hinf_norm(plant.open_loop()) == pytest.approx(62.5639, rel=1e-5)
    assert hinf_norm(plant.open_loop()) == pytest.approx(62.412, rel=3e-3)
    peak = 2.0 * np.pi * 2.1 * np.linspace(0.99, 1.01, 20_001)
    assert gains(plant.open_loop(), peak).max() == pytest.approx(62.5639, rel=1e-5)


def test_least_gamma(plant: Plant) -> None:
    assert least_gamma(plant) == pytest.approx(4.90007, rel=1e-5)


def test_least_gamma_does_not_depend_on_the_states(plant: Plant) -> None:
    balanced = plant.transformed(balancing(plant))
    assert least_gamma(balanced) == pytest.approx(least_gamma(plant), rel=1e-7)
    assert hinf_norm(balanced.open_loop()) == pytest.approx(hinf_norm(plant.open_loop()), rel=3e-6)


def test_balanced_states_have_equal_diagonal_gramians(plant: Plant) -> None:
    b = plant.transformed(balancing(plant))
    B, C = np.hstack([b.B1, b.B2]), np.vstack([b.C1, b.C2])
    reach = control.lyap(b.A, B @ B.T)
    seen = control.lyap(b.A.T, C.T @ C)
    assert reach == pytest.approx(seen, abs=1e-8 * np.abs(reach).max())
    assert reach == pytest.approx(np.diag(np.diag(reach)), abs=1e-8 * np.abs(reach).max())
    assert np.all(np.diff(np.diag(reach)) < 0.0)


def test_damping_and_gain_over_speed() -> None:
    d, b = coefficients(DesignDamper(), GRID, 0.005)
    published_d = [360, 147.31973, 88.78794, 42.42242, 17.12568, 8.44241, 4.26233]
    published_b = [0, 0.67464, 0.81115, 0.84605, 0.81048, 0.80489, 0.8164]
    assert d == pytest.approx(published_d, abs=6e-6)
    assert b == pytest.approx(published_b, abs=6e-6)


def test_both_laws_slide_alike() -> None:
    bingham = coefficients(DesignDamper("bingham"), GRID, 0.005)
    assert np.allclose(coefficients(DesignDamper("lugre"), GRID, 0.005), bingham, rtol=1e-12)


def test_a_design_takes_the_form_of_the_command_from_the_model() -> None:
    line = coefficients(DesignDamper("bingham"), GRID, 0.005)
    table = coefficients(DesignDamper("bingham[table 0 8]"), GRID, 0.005)
    assert np.allclose(table, line, rtol=1e-12)  # its defaults lie on the line
    bent = DesignDamper("bingham[quadratic]", {"yield_force_bend": -0.05})
    d, b = coefficients(bent, GRID, 0.005)
    assert np.allclose(d, line[0])
    assert (b[1:] < 0.7 * line[1][1:]).all()
    with pytest.raises(DesignError, match="law"):
        DesignDamper("nobody[quadratic]")


def test_the_standard_law_does_not_fall_with_speed() -> None:
    d, b = coefficients(DesignDamper("bingham_standard"), GRID, 0.005)
    assert d == pytest.approx(1.3 / (GRID + 0.005) + 100.0)
    assert b == pytest.approx(GRID * (0.83 / (GRID + 0.005) + 20.0))


def test_open_loop_norms_over_speed() -> None:
    published = [6.0234, 2.9185, 2.4998, 3.7119, 7.6941, 13.639, 22.170]
    d, b = coefficients(DesignDamper(), GRID, 0.005)
    norms = [hinf_norm(p.open_loop()) for p in family(paper_building(), Weights(), b, d)]
    assert norms == pytest.approx(published, rel=1e-3)


def test_a_family_is_its_members() -> None:
    building = full_mass_building()
    d, b = coefficients(DesignDamper(), GRID, 0.005)
    for plant, damping, gain in zip(family(building, Weights(), b, d, 80.0), d, b, strict=True):
        alone = generalized(building, Weights(), float(gain), float(damping), 80.0)
        for one, other in zip(plant, alone, strict=True):
            assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_structure_has_the_buildings_frequencies_and_statics() -> None:
    s = structure(paper_building())
    poles = np.linalg.eigvals(s.A)
    found = sorted(np.abs(poles[poles.imag > 0]) / (2 * np.pi))
    assert found == pytest.approx(frequencies(paper_building()), rel=1e-9)
    still = -np.linalg.solve(s.A, s.B[:, 0])
    assert still[:3] == pytest.approx([-1.0 / 1057.0] * 3)  # 1 N against +x
    assert s.D[0, 0] == 0.0
    assert structure(full_mass_building()).D[0, 0] != 0.0


def test_effects_of_a_damper_enter_its_sliding() -> None:
    plain = coefficients(DesignDamper("lugre"), GRID, 0.005)
    gas = DesignDamper("lugre", {"gas_spring.k": 60.0, "gas_spring.preload": 2.0}, ("gas_spring",))
    assert np.allclose(coefficients(gas, GRID, 0.005), plain, rtol=1e-6, atol=1e-9)
    assert stiffness(gas) == pytest.approx(60.0, rel=1e-6)
    assert stiffness(DesignDamper()) == 0.0
    lag = DesignDamper("lugre", {}, ("coil_lag", "mount_compliance"))  # neither matters in sliding
    assert np.allclose(coefficients(lag, GRID, 0.005), plain, rtol=1e-6, atol=1e-9)
    stuck = coefficients(DesignDamper("bingham", {}, ("stribeck",)), GRID, 0.005)
    assert stuck[0][0] > 1.05 * plain[0][0]
    assert stuck[0][-1] == pytest.approx(plain[0][-1], rel=0.02)


@pytest.mark.parametrize("zeta", [0.001, 0.02, 0.3])
def test_norm_of_an_oscillator(zeta: float) -> None:
    A = np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]])
    B, C = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    peak = 1.0 / (2.0 * zeta * sqrt(1.0 - zeta**2))
    assert hinf_norm(StateSpace(A, B, C, np.zeros((1, 1)))) == pytest.approx(peak, rel=3e-6)


def test_norm_of_limits() -> None:
    one, none = np.eye(1), np.zeros((1, 1))
    assert hinf_norm(StateSpace(one, one, one, none)) == inf
    assert hinf_norm(StateSpace(-one, one, none, none)) == 0.0
    assert hinf_norm(StateSpace(-one, none, one, 3.0 * one)) == pytest.approx(3.0, rel=3e-6)
    assert hinf_norm(StateSpace(-one, one, -one, 3.0 * one)) == pytest.approx(3.0, rel=3e-6)


def test_norm_agrees_with_python_control() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        n, m = rng.integers(1, 12), rng.integers(1, 4)
        A = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-2, 2)
        margin = 10.0 ** rng.uniform(-3, 1) * np.abs(A).max()
        A -= (np.linalg.eigvals(A).real.max() + margin) * np.eye(n)
        B, C = rng.normal(size=(n, m)), rng.normal(size=(m, n))
        system = StateSpace(A, B, C, rng.normal(size=(m, m)))
        theirs = control.norm(control.ss(*system), "inf", tol=1e-8, method="scipy")
        assert hinf_norm(system) == pytest.approx(theirs, rel=1e-5)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"masses": [1.0, 1.0], "stiffnesses": [100.0, 100.0], "damping_ratio": 0.0}, "not damped"),
        (
            {
                "M": [[1.0, 0.0], [0.0, 1.0]],
                "C": [[1.0, 0.0], [0.0, 0.0]],
                "K": [[100.0, -50.0], [-50.0, 80.0]],
            },
            None,  # damped by its neighbour all the same
        ),
        (
            {
                "M": [[1.0, 0.0], [0.0, 1.0]],
                "C": [[0.1, 0.0], [0.0, 0.1]],
                "K": [[100.0, 0.0], [0.0, 80.0]],
            },
            "not controllable",
        ),
    ],
)
def test_buildings_that_no_damper_can_damp_are_refused(
    data: dict[str, object], message: str | None
) -> None:
    building = from_data({"schema": 1, **data})
    if message is None:
        check_building(building)
        return
    with pytest.raises(DesignError, match=message):
        check_building(building)


@pytest.mark.parametrize(
    ("numerator", "denominator", "message"),
    [
        ((1.0, 0.0, 0.0), (1.0, 1.0), "improper"),
        ((1.0,), (1.0, -1.0), r"pole at 1 rad/s"),
        ((1.0,), (1.0, 0.0), r"pole at"),
        ((0.0,), (1.0, 1.0), "zero"),
        ((1.0,), (0.0, 1.0), "begins with zero"),
        ((float("nan"),), (1.0, 1.0), "finite"),
        ((), (1.0,), "finite"),
    ],
)
def test_weights_that_cannot_be_are_refused(
    numerator: tuple[float, ...], denominator: tuple[float, ...], message: str
) -> None:
    with pytest.raises(DesignError, match=message):
        Weight(numerator, denominator)


def test_weights_that_make_the_problem_singular_are_refused() -> None:
    with pytest.raises(DesignError, match="singular"):
        Weights(noise=0.0)
    with pytest.raises(DesignError, match="singular"):
        Weights(command=Weight.low_pass(2.0, 50.0))


@pytest.mark.parametrize(
    "weight",
    [
        Weight.low_pass(1.5, 12.0),
        Weight.lead(2.0, 15.0, 50.0),
        Weight((3.0,), (2.0,)),
        Weight((0.0, 2.0, 1.0), (4.0, 3.0, 2.0)),
        Weight((1.0, 2.0, 1.0), (1.0, 3.0, 2.0)),
    ],
)
def test_a_weights_state_space_has_its_response(weight: Weight) -> None:
    A, B, C, D = weight.state_space()
    for omega in (0.0, 0.3, 7.0, 1e3):
        s = 1j * omega
        states = C @ np.linalg.solve(s * np.eye(weight.order) - A, B) if weight.order else 0.0
        assert np.squeeze(states + D) == pytest.approx(weight.response(np.array([omega]))[0])


def test_a_weight_whose_poles_cancel_is_refused() -> None:
    cancelling = Weight((1.0, 3.0, 2.0), (1.0, 3.0, 2.0))
    plant = generalized(paper_building(), Weights(command=cancelling))
    with pytest.raises(DesignError, match="cancel"):
        balancing(plant)
