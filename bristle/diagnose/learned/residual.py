"""The residual of a fitted model, with what a curve of each part of its law would add to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...identify.fit import Model, Problem, Run
from ...identify.rig import DAMPER
from ...identify.search import HUBER
from ...identify.search_context import Search
from ...identify.structure import StructureProblem, StructureRun
from ...physics.inputs import Inputs
from .place import Place

Array = NDArray[np.float64]

FOLDS = 8
"""Stretches of the training runs that are left out in turn, at least."""


@dataclass(frozen=True)
class Residual:
    """The residual of a model on runs, with what the parts of its law do there.

    `r` (n,) normalised; `weight` (n,) robust; `fold` (n,) which stretch a sample belongs to;
    `known` (n, p) the sensitivities to the parameters; `parts` columns (n,) that a curve of each
    part is multiplied with, over the noise; `runs` of the samples, `keeps` which of each; `slow`
    [m/s], `top`, `drive` and `at` as of a `Curve`; `shown` the predicted force [N] of each run
    whose force a load cell showed, `sigma` (n,) [N] the noise that samples are divided by.
    """

    r: Array
    weight: Array
    fold: NDArray[np.int64]
    known: Array
    parts: dict[str, Array]
    runs: list[Run]
    keeps: list[NDArray[np.int64]]
    slow: float
    top: float
    drive: str
    shown: list[Array]
    sigma: Array
    at: str = DAMPER

    @property
    def place(self) -> Place:
        """The site of the rig whose model this is the residual of."""
        return Place(self.at)

    @property
    def coarsest_step(self) -> float:
        """The longest sampling step of the runs [s]: what that resolves, all of them resolve."""
        return max(run.dt for run in self.runs)

    @property
    def shortest_length(self) -> float:
        """The length of the shortest run [s]."""
        return min(run.dt * len(run.x) for run in self.runs)


def residual_of(problem: Problem, base: Model) -> Residual:
    """Return the residual of a fitted model, with what its law's parts do."""
    expected = problem.expectation(base)
    search = Search(problem, base, expected, base.free())
    r = search.residuals(search.start)
    scale = max(1.0, float(np.median(np.abs(r))) / 0.6745)
    sigma = _joined([noise for _, noise, _ in expected], problem.runs)
    slow = 0.03 * float(np.sqrt(np.mean(np.concatenate([run.v for run in problem.runs]) ** 2)))
    at = _site_of(problem, base)
    columns = _columns_of_line if Place(at).is_line else _columns
    parts = [columns(problem, base, run, slow) for run in problem.runs]
    return Residual(
        r,
        np.minimum(1.0, HUBER * scale / np.maximum(np.abs(r), 1e-12)),
        _folds(problem.runs),
        -search.sensitivities(),
        {name: _joined([one[name] for one in parts], problem.runs) / sigma for name in parts[0]},
        *_samples(problem.runs),
        slow,
        problem.size("V"),
        problem.runs[0].drive,
        [problem.predict(base, run) for run in problem.runs if not isinstance(run, StructureRun)],
        sigma,
        at,
    )


def _site_of(problem: Problem, base: Model) -> str:
    """Return the site of a rig whose runs and model these are."""
    of_line = isinstance(problem, StructureProblem) and base.law_class.site == "structure"
    if not of_line:
        return DAMPER
    assert isinstance(problem, StructureProblem)
    return f"storey{problem.storey}" if problem.storey else "layer"


def _joined(values: list[Array], runs: list[Run]) -> Array:
    """Return values (n,) per run, those that a fit skips left out, as one array."""
    pairs = zip(values, runs, strict=True)
    return np.concatenate([value[run.skip :] for value, run in pairs])


def _folds(runs: list[Run]) -> NDArray[np.int64]:
    """Return which stretch each sample belongs to; no stretch goes over a run's end."""
    each = max(2, -(-FOLDS // len(runs)))
    counts = [len(run.force) - run.skip for run in runs]
    return np.concatenate(
        [k * each + np.arange(n) * each // max(n, 1) for k, n in enumerate(counts)]
    )


def _samples(runs: list[Run]) -> tuple[list[Run], list[NDArray[np.int64]]]:
    """Return the whole runs, from which a memory follows, and which of their samples count."""
    wholes, keeps = [], []
    for run in runs:
        whole, keep = run, np.arange(len(run.force))
        if isinstance(run, StructureRun) and run.whole is not None:
            whole, keep = run.whole, run.keep
        wholes.append(whole)
        keeps.append(keep[run.skip :])
    return wholes, keeps


def _columns(problem: Problem, base: Model, run: Run, slow: float) -> dict[str, Array]:
    """Return what a unit of each part's curve adds to the force at the samples of a run [N]."""
    law, top = base.law_class, problem.size("V")
    whole = problem.predict(Model(base.law, (), base.values), run)
    viscous = _part(base, run, "viscous")
    out = {
        "force": np.ones(len(run.force)), "friction": np.tanh(run.v / slow), "fluid": whole,
        "fluid_field": whole * run.V / top,
    }  # fmt: skip
    if law.has("viscous"):
        out["viscous"] = viscous
    if law.has("yield"):
        out["yield"] = whole - viscous - _part(base, run, "elastic")
        out["yield_field"] = out["yield"] * run.V / top
    if law.has("command") and top > 1e-6:
        out["command"] = _by_command(problem, base, run, whole, 1e-3 * top)
    return out


def _columns_of_line(_problem: Problem, base: Model, run: Run, slow: float) -> dict[str, Array]:
    """Return what a unit of each part's curve adds to the force of a layer or a storey [N]."""
    law = base.law_class
    return {
        "force": np.ones(len(run.force)), "friction": np.tanh(run.v / slow),
        "spring": base.value(law.stiffness) * run.x, "damping": run.v,
    }  # fmt: skip


def _part(base: Model, run: Run, name: str) -> Array:
    """Return the force (n,) [N] of a part of a model's law, the states of the law at zero."""
    law = base.law_class
    hook = law.hook(name)
    if hook is None:
        return np.zeros(len(run.force))
    rest = law.State(*(0.0 for _ in law.states)) if law.states else ()
    return np.array(
        [
            hook(Inputs(x, v, a, V, 0.0, 0.0, 0.0, False), rest, law.at(base.values, V))
            for x, v, a, V in zip(run.x, run.v, run.a, run.V, strict=True)
        ]
    )


def _by_command(problem: Problem, base: Model, run: Run, whole: Array, nudge: float) -> Array:
    """Return what a `nudge` [V] of the command adds to the force `whole` (n,) [N], in N/V."""
    more: Run = replace(run, V=run.V + nudge)
    if isinstance(run, StructureRun) and run.whole is not None:
        more = replace(
            run, V=run.V + nudge, whole=replace(run.whole, V=run.whole.V + nudge)
        )  # fmt: skip
    return (problem.predict(Model(base.law, (), base.values), more) - whole) / nudge
