"""Which run separates rivals: what a refit absorbs is no difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_starts import LAW, recorded_rig

from bristle.diagnosis.experiments import _contrast, _plans, _run, separating
from bristle.diagnosis.prepared import corrected
from bristle.identification.prepare import prepare
from bristle.identification.problem import Model, Problem, Run

N = 1000
FORCE, SLOPE = np.random.default_rng(3).standard_normal((2, N))
FORCE -= SLOPE * (SLOPE @ FORCE) / (SLOPE @ SLOPE)


class Rival:
    """A force with one parameter, `SLOPE` its derivative, known to 1/sqrt(`held`)."""

    def __init__(self, force: np.ndarray, held: float) -> None:
        self.force, self.information = force, np.array([[held]])

    def on(self, _run: object) -> tuple[np.ndarray, np.ndarray]:
        """Return force and sensitivities."""
        return self.force, SLOPE[:, None]


@pytest.mark.parametrize(
    ("held", "left"), [(0.0, 0.0), (float(SLOPE @ SLOPE), 0.5), (1e9 * float(SLOPE @ SLOPE), 1.0)]
)
def test_a_difference_along_a_parameter_counts_as_far_as_it_is_known(held, left):
    rivals = [Rival(FORCE, held), Rival(FORCE + 2.0 * SLOPE, held)]
    run = _run_of(N)
    expected = np.sqrt(left * np.mean((2.0 * SLOPE) ** 2))
    assert _contrast(rivals, run) == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_a_difference_across_all_parameters_counts_whole():
    rivals = [Rival(SLOPE, 0.0), Rival(SLOPE + FORCE, 0.0)]
    assert _contrast(rivals, _run_of(N)) == pytest.approx(np.sqrt(np.mean(FORCE**2)))


def test_a_plan_stays_within_what_the_rig_has_done():
    runs = recorded_rig((), {})
    problem = Problem([prepare(one) for one in corrected(runs, [])])
    rivals = [
        Model("bingham", ("gas_spring",), {**LAW, "gas_spring.k": 100.0}),
        Model("bingham", ("asymmetry",), {**LAW, "asymmetry.ratio": 0.1}),
    ]
    plan = separating(rivals, problem)
    x, v, _, V = plan.signals(problem.runs[0].dt)
    assert plan.contrast > 1.0
    assert np.max(np.abs(x)) <= max(np.max(np.abs(r.x - r.x.mean())) for r in problem.runs) * 1.001
    assert np.max(np.abs(v)) <= max(np.max(np.abs(r.v)) for r in problem.runs) * 1.001
    assert V.min() >= min(0.0, *(r.V.min() for r in problem.runs))
    assert V.max() <= max(r.V.max() for r in problem.runs)
    assert plan.sentence().startswith("Run a s")
    assert "Use a wider range" in replace(plan, deviations=1.0).sentence()


@pytest.mark.parametrize(("steps", "highest"), [((0.01, 0.01), 5.0), ((0.01, 0.001), 25.3)])
def test_no_plan_is_faster_than_its_samples_or_than_the_rig_was(steps, highest):
    runs = [_sine(0.01, 8.0, dt) for dt in steps]
    plans = _plans(Problem(runs))
    assert max(plan.high for plan in plans) == pytest.approx(highest, rel=1e-2)
    top = max(float(np.abs(run.a).max()) for run in runs)
    for plan in plans:
        assert np.abs(plan.signals(0.001)[2]).max() <= 1.001 * top


def _sine(amplitude: float, frequency: float, dt: float) -> Run:
    """Return a run of a sine [m, Hz]."""
    t, w = np.arange(0.0, 12.0, dt), 2.0 * np.pi * frequency
    x = amplitude * np.sin(w * t)
    v = amplitude * w * np.cos(w * t)
    return Run("r", dt, x, v, -w * w * x, np.ones_like(x), 90.0 * v, 0.05, np.zeros((0, len(x), 4)))


def _run_of(samples: int):
    from bristle.diagnosis.experiments import Experiment

    whole = _run(Experiment(0.01, 1.0, 1.0, (0.0, 0.0), 1.0), 12.0 / (samples - 1), 1.0)
    assert len(whole.x) == samples
    return whole
