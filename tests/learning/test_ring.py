"""A mode of what holds the load cell: its law, its effect's file, and that a scan finds it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim
from test_screen import STEP, VALUES, T, runs

from bristle.identification.fit import fit
from bristle.identification.histories import DamperForces
from bristle.identification.problem import shown_force
from bristle.learning.curve import Curve
from bristle.learning.effect_file import effect_text
from bristle.learning.normal import residual_of
from bristle.learning.screen import promises
from bristle.learning.signals import RING, frequencies, response, ringing
from bristle.model.model import Model
from bristle.user_code.load import defined

FREQUENCY, DAMPING, SHARE = 9.3, 0.03, 0.2  # Hz, 1, 1
MODE = Curve(RING, RING, (("frequency", FREQUENCY), ("damping", DAMPING)), (0.0,), (SHARE,))


def shown_by(force):
    """Return what a load cell on the mode shows, by another solver: scipy's, force linear."""
    w = 2.0 * np.pi * FREQUENCY
    system = ([w * w], [1.0, 2.0 * DAMPING * w, w * w])
    _, r, _ = lsim(system, force, T[: len(force)], X0=[0.0, force[0] / w**2])
    return (1.0 - SHARE) * force + SHARE * r


def test_at_resonance_the_mode_shows_the_force_by_one_over_twice_its_damping():
    (peak,) = response(1.0, FREQUENCY, DAMPING, np.array([FREQUENCY]))
    assert peak == pytest.approx(1.0 / (2.0 * DAMPING))
    slow, fast = response(SHARE, FREQUENCY, DAMPING, np.array([0.01, 1e4]))
    assert slow == pytest.approx(1.0, abs=1e-5)
    assert fast == pytest.approx(1.0 - SHARE, abs=1e-5)


def test_the_steps_are_those_of_another_solver():
    force = np.sin(2.0 * np.pi * 7.0 * T) + 0.4
    mine = force + SHARE * ringing(force, STEP, FREQUENCY, DAMPING)
    # The trapezoidal rule shifts the mode by (w dt)^2/12 = 0.1 %, felt beside the resonance.
    assert mine == pytest.approx(shown_by(force), abs=0.01 * np.max(np.abs(mine)))


def test_the_effect_s_file_does_what_the_scan_looked_for():
    x, v, V = 0.004 * np.sin(18.0 * T), 0.072 * np.cos(18.0 * T), 0.0 * T
    given = (x, v, np.gradient(v, STEP), V, STEP)
    force = DamperForces("bingham", []).force(*given, VALUES)
    with defined({"learned_1": effect_text("learned_1", MODE, "a test")}):
        shown = shown_force(("learned_1",), VALUES, force, STEP)
    rung = force + SHARE * ringing(force, STEP, FREQUENCY, DAMPING)
    assert shown == pytest.approx(rung, abs=1e-9 * np.max(np.abs(rung)))


def test_a_scan_finds_the_mode_and_no_other_part_is_nearer():
    problem = runs(lambda x, v, V, F: shown_by(F))
    base = fit(problem, Model("bingham", (), VALUES), with_std=False).model
    best = promises(residual_of(problem, base))[0]
    assert best.curve.part == RING
    mode = dict(best.curve.memory)
    assert mode["frequency"] == pytest.approx(FREQUENCY, rel=0.01)
    assert mode["damping"] == pytest.approx(DAMPING, rel=0.35)
    assert best.curve.values[0] == pytest.approx(SHARE, rel=0.15)


def test_runs_too_short_for_a_cycle_have_no_frequencies():
    assert not len(frequencies(0.01, 0.2))
