"""A second scan, with the law that was fitted beside the first curve; short ripples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.trials import Trial, judge
from bristle.identification.fit import fit
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.learning import fit as learned_fit
from bristle.learning.closed_forms import closed_forms
from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.learning.fit import Fitted, with_law_of
from bristle.learning.normal import residual_of
from bristle.learning.rule import LEARN
from bristle.learning.screen import promises
from bristle.model.model import Model
from bristle.user_code.load import defined

STEP = 0.002  # s
T = STEP * np.arange(6000)
VALUES = {"f_c": 1.25, "f_v": 0.78, "c_0": 107.0, "c_v": 21.8, "v_n": 0.0188}
NOISE = 0.04  # N
NOWHERE = np.zeros((0, len(T), 4))


def sweeps(hidden):
    """Return two sweeps from 0.3 Hz up and back within 0.178 m/s and 8.8 m/s2."""
    out = []
    for number, top in enumerate((8.0, 5.0)):
        f = np.exp(np.interp(T, [0.0, 6.0, 12.0], np.log([0.3, top, 0.3])))
        w, angle = 2.0 * np.pi * f, 2.0 * np.pi * STEP * np.cumsum(f)
        x = np.minimum(0.0153, np.minimum(0.178 / w, 8.8 / w**2)) * np.sin(angle)
        v = np.gradient(x, STEP)
        a = np.gradient(v, STEP)
        V = np.array([0.0, 2.7, 5.3, 8.0, 5.3, 2.7])[(T / 0.28).astype(int) % 6]
        force = hidden(x, DamperForces("bingham", []).force(x, v, a, V, STEP, VALUES))
        force = force + NOISE * np.random.default_rng(number).standard_normal(len(T))
        out.append(Run(f"sweep{number}", STEP, x, v, a, V, force, NOISE, NOWHERE))
    return Problem(out)


def fitted_alone(problem):
    return fit(problem, Model("bingham", (), VALUES), with_std=False).model


def test_beside_a_curve_the_law_is_nearer_and_so_is_the_scan():
    def worn(x, F):
        return (1.0 - 0.47 * np.exp(-((x / 4e-3) ** 2))) * F

    problem = sweeps(worn)
    base = fitted_alone(problem)
    first = promises(residual_of(problem, base), parts=["fluid"])[0]
    curve = first.curve
    beside = replace(base, effects=("learned_1",), values={**VALUES, "learned_1.curve[1]": 0.5})
    none = np.zeros(0)
    trial = Trial(beside, 1.2, 1.2, 0.1, none, none)
    near = with_law_of(base, Fitted(curve, (), trial, 1.2))
    assert near.effects == ()
    assert near.values == VALUES
    second = promises(residual_of(problem, near), parts=["fluid"])[0]
    assert first.loss > 1.2  # the law alone took up a part of the wear
    assert second.loss == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("pitch", [pytest.param(1.8e-3, marks=pytest.mark.slow), 2.5e-3])  # 1 s
def test_a_ripple_of_a_dozen_periods_in_the_stroke_is_found_with_its_pitch(pitch):
    problem = sweeps(lambda x, F: F + 0.9 * np.sin(2.0 * np.pi * x / pitch))
    best = promises(residual_of(problem, fitted_alone(problem)))[0].curve
    assert (best.part, best.along) == ("force", "displacement")
    form = closed_forms(best, tuple(0.01 for _ in best.knots))[0]
    assert form.form.name == "ripple"
    assert form.left < 0.5 * LEARN.follows
    assert form.values[2] == pytest.approx(pitch, rel=0.02)


@pytest.mark.slow  # an effect is compiled
def test_a_fit_that_the_second_scan_misleads_begins_from_the_present_model(monkeypatch):
    problem = sweeps(lambda x, F: F)
    present = Model("bingham", (), VALUES)
    far = replace(present, values={**VALUES, "f_c": 20.0})
    curve = Curve("force", "displacement", (), (-0.01, 0.0, 0.01), (5.0, 0.0, 5.0))
    monkeypatch.setattr(learned_fit, "refine", lambda start, train, sweeps: start)
    with defined({"learned_9": effect_text("learned_9", curve, "made for a test, 2026")}):
        opened = Prepared(judge(present, problem, problem), problem, problem)
        found = learned_fit._inside(curve, "learned_9", far, opened)
    assert found.trial.train == pytest.approx(1.0, abs=0.05)
    assert found.curve.values == (0.0, 0.0, 0.0)
