"""Which run separates rivals: what a refit absorbs is no difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_starts import LAW, recorded_rig

from bristle.diagnosis.experiments import separating
from bristle.diagnosis.prepared import corrected
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import Model

N = 1000
FORCE, SLOPE = np.random.default_rng(3).standard_normal((2, N))
FORCE -= SLOPE * (SLOPE @ FORCE) / (SLOPE @ SLOPE)


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
