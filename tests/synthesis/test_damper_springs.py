"""A damper with springs in a design: in its law, as a gas spring, in the measured force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from bristle.physics.building import paper_building
from bristle.synthesis import Task, design
from bristle.synthesis.damper import DesignDamper, coefficients
from bristle.synthesis.kinds import plants_at
from bristle.synthesis.plant import structure

GRID = np.array([0.0, 0.01, 0.1, 0.3])
GAS = DesignDamper("lugre", {"gas_spring.k": 400.0}, ("gas_spring",))


@pytest.mark.parametrize("law", ["bouc_wen", "tanh"])
def test_the_force_of_an_accumulator_at_mid_stroke_damps_nothing(law: str) -> None:
    plain, offset = (
        coefficients(DesignDamper(law, {"f_0": f_0}), GRID, 0.005) for f_0 in (0.0, 2.0)
    )
    assert np.allclose(offset, plain, rtol=1e-6, atol=1e-6)


def test_a_voltage_meets_the_spring_of_the_law_a_force_does_not() -> None:
    damper = DesignDamper("bouc_wen", {"k": 150.0, "f_0": 1.0})
    assert [Task(kind, damper=damper).stiffness for kind in ("lpv", "hinf", "lqg")] == [
        pytest.approx(150.0), 0.0, 0.0,
    ]  # fmt: skip
    plant = plants_at(Task("lpv", damper=damper), GRID)[0]
    free = structure(paper_building())
    assert free.A[3, 0] - plant.A[3, 0] == pytest.approx(150.0 / paper_building().M[0][0])


def test_the_springs_of_effects_are_in_the_plant_of_a_commanded_force() -> None:
    assert [Task(kind, damper=GAS).stiffness for kind in ("lpv", "hinf")] == pytest.approx(
        [400.0] * 2
    )


def test_an_estimator_that_is_given_the_force_follows_a_damper_with_a_gas_spring() -> None:
    # The measured force holds the spring's share: in the plant as well it would count twice.
    made = design(Task("lqg", damper=GAS)).controller
    s = structure(paper_building())
    n, h = len(s.A), made.sample_period
    together = np.zeros((n + 1, n + 1))
    together[:n, :n], together[:n, n:] = s.A, s.B[:, :1]
    stepped = linalg.expm(together * h)
    A, B, W = np.reshape(made.A, (n, n)), np.array(made.B), np.array(made.W)
    x, estimate = np.zeros(n), np.zeros(n)
    errors, states = [], []
    for k in range(1000):
        force = float(400.0 * (s.C[1] @ x) + np.sin(20.0 * h * k))
        y = float(s.C[0] @ x + s.D[0, 0] * force)
        estimate = A @ estimate + B * y + W * force
        x = stepped[:n, :n] @ x + stepped[:n, n] * force
        errors.append(estimate - x)
        states.append(x)
    share = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(np.square(states), axis=0))
    assert share.max() < 0.1
