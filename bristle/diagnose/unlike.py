"""Runs that one model cannot explain together with the others."""

from __future__ import annotations

from collections.abc import Sequence

from ..identify.fit import Model, Problem
from ..identify.search import z_scale
from .search import residuals

MISFIT = 1.15
"""z of training runs above which a model that explains the held-out ones still has not fitted."""


def unlike(model: Model, train: Problem, held_out: Problem) -> str:
    """Return, in words, which runs a model leaves unexplained and which it explains.

    For a model that the held-out runs do not contradict, while those that it was fitted to do: two
    rigs mixed, a setting changed between runs, or an effect that acts in some of them alone.
    """
    z = {
        run.name: z_scale(residuals(problem.of([run]), model, problem.of([run]).expectation(model)))
        for problem in (train, held_out)
        for run in problem.runs
    }
    bad = [name for name, size in z.items() if size > MISFIT]
    good = [name for name in z if name not in bad]
    if not bad:
        return ""
    told = ", ".join(f"{name} ({z[name]:.3g})" for name in bad)
    return (
        f"One model does not explain all runs: its error in times the noise is largest in {told}, "
        f"while {_list(good)} it explains. Were they taken on one rig, with one setting?"
    )


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"
