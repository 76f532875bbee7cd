"""The force budget: its parts sum up to the force, and each is what the model's own law gives."""

from dataclasses import replace

import numpy as np
import pytest

from bristle.identification.low_passed import force_budget
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model
from bristle.physics.laws import laws_of
from bristle.study.view import budget_text

DT = 0.002
T = np.arange(0.0, 3.0, DT)
X, V = 0.01 * np.sin(9.0 * T), 0.09 * np.cos(9.0 * T)


def run() -> Run:
    force = np.zeros_like(T)
    return Run("sine", DT, X, V, -0.81 * np.sin(9.0 * T), np.full_like(T, 3.0), force, 0.05,
               np.zeros((1, len(T), 4)))  # fmt: skip


def budget(model: Model):
    problem = Problem([run()])
    return force_budget(problem, model, run()), problem.predict(model, run())


@pytest.mark.parametrize("law", [law.name for law in laws_of()])
def test_the_parts_of_every_law_sum_up_to_its_force(law):
    parts, whole = budget(Model(law))
    total = np.sum([part.force for part in parts], axis=0)
    assert np.max(np.abs(total - whole)) <= 1e-9 * np.max(np.abs(whole))


def test_the_parts_of_bingham_are_its_two_terms():
    values = {"f_c": 1.5, "f_v": 0.7, "c_0": 40.0, "c_v": 5.0, "exponent": 0.0}
    parts, _ = budget(Model("bingham", (), values))
    found = {part.name: part.force for part in parts}
    assert list(found) == ["yield", "viscous"]
    moving = np.abs(V) > 1e-3
    assert found["yield"][moving] == pytest.approx((1.5 + 3 * 0.7) * np.sign(V)[moving])
    assert found["viscous"] == pytest.approx((40.0 + 3 * 5.0) * V)


def test_an_effect_is_what_the_force_loses_without_it():
    values = {"gas_spring.k": 100.0, "gas_spring.preload": 0.5}
    parts, whole = budget(Model("bingham", ("gas_spring",), values))
    spring = parts[-1]
    assert spring.name == "gas_spring"
    rest = whole - Problem([run()]).predict(Model("bingham"), run())
    assert spring.force == pytest.approx(rest)
    assert spring.share == pytest.approx(np.sqrt(np.mean(rest**2) / np.mean(whole**2)))


def test_effects_on_the_command_and_on_the_force_sum_up_as_well():
    model = Model("lugre", ("saturation", "stribeck"), {"saturation.V_s": 4.0})
    parts, whole = budget(model)
    assert [part.name for part in parts[-2:]] == ["saturation", "stribeck"]
    assert np.sum([part.force for part in parts], axis=0) == pytest.approx(whole, abs=1e-9)


def test_a_model_without_force_has_no_part_of_the_law():
    silent = dict.fromkeys(("f_c", "f_v", "c_0", "c_v"), 0.0)
    assert budget(Model("bingham", (), silent))[0] == []


def test_the_parts_are_told_with_their_shares_the_largest_first():
    problem = Problem([run(), replace(run(), name="again")])
    said = budget_text(problem, Model("bingham", ("gas_spring",), {"gas_spring.k": 10.0}))
    shares = [int(part.split()[-2]) for part in said.partition("): ")[2].split(", ")]
    assert "gas spring" in said
    assert shares == sorted(shares, reverse=True)
