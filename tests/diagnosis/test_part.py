"""On which part of many samples effects are searched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bristle.data.decimate import Finer
from bristle.diagnosis.prepared import COARSE, ENOUGH, FEWEST, MANY, part_of
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model


def runs(count, samples):
    """Return runs at five levels of the command, from slow to fast."""
    out = []
    for k in range(count):
        v = (1.0 + k) * np.sin(0.01 * np.arange(samples))
        V, none = np.full(samples, float(k % 5)), np.zeros((0, samples, 4))
        out.append(Run(f"run{k}", 0.002, v, v, v, V, v, 0.1, none))
    return Problem(out)


def test_few_samples_are_all_searched():
    assert part_of(runs(10, MANY // 10)) is None


def test_of_many_samples_the_begins_of_runs_of_every_level_are_searched():
    problem = runs(30, 20_000)
    part = part_of(problem)
    assert len(part.runs) == FEWEST
    assert len({run.name for run in part.runs}) == FEWEST
    assert 0.9 * ENOUGH < sum(len(run.force) for run in part.runs) <= ENOUGH
    assert {float(run.V[0]) for run in part.runs} == {0.0, 1.0, 2.0, 3.0, 4.0}
    slow, fast = (choose(float(np.std(run.v)) for run in part.runs) for choose in (min, max))
    assert fast > 3.0 * slow
    first = part.runs[0]
    whole = next(run for run in problem.runs if run.name == first.name)
    assert np.array_equal(first.force, whole.force[: len(first.force)])
    assert first.draws.shape[1] == len(first.force)


def test_runs_without_a_command_and_one_long_run_have_a_part_too():
    problem = runs(30, 20_000)
    for run in problem.runs:
        run.V[:] = 0.0
    assert len(part_of(problem).runs) == FEWEST
    assert len(part_of(runs(1, 2 * MANY)).runs[0].force) == ENOUGH


def test_of_many_moments_per_sample_few_serve_and_the_force_hardly_changes():
    problem = runs(10, MANY // 20)
    finer = [replace(one, finer=Finer(6, np.full(len(one.x), 3.5))) for one in problem.runs]
    part = part_of(problem.of(finer))
    assert [len(run.force) for run in part.runs] == [MANY // 20] * 10
    assert {run.finer.parts for run in part.runs} == {COARSE}
    model = Model("lugre")
    for coarse, fine in zip(part.runs, finer, strict=True):
        exact = problem.predict(model, fine)
        assert np.std(problem.predict(model, coarse) - exact) < 1e-2 * np.std(exact)
