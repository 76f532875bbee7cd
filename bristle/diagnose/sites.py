"""What one site of a building lacks: its isolation layer, a storey, or the load cell.

There the model is a line and equilibrium gives the force, with white noise of known size. So the
effects of the structure are few and distinct, and each is judged by held-out runs alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import fit
from ..identify.line import fit_line
from ..identify.model import Model, Problem, Run
from ..identify.site_fit import joined
from ..identify.structure import (
    StructureProblem,
    StructureRun,
)
from ..physics.effect import EFFECTS, effects_of
from ..physics.laws import law_of_part
from .candidates import Trial, judge
from .evidence import paired
from .finding import Finding
from .rule import SITE, DecisionRule

Array = NDArray[np.float64]


def look_at(
    site: str,
    train: StructureProblem,
    held_out: StructureProblem,
    present: Model | None = None,
    rule: DecisionRule = SITE,
) -> Finding:
    """Return what a layer's or storey's problem shows.

    Parameters
    ----------
    site : "layer", "storey1", "storey2" ...
    train, held_out : the site's runs to fit to, and those that decide
    present : the effects that the model has at this site already, with their values; None if none
    rule : the numbers that decide
    """
    linear = law_of_part(site)
    hook = "force" if site == "layer" else "spring"
    base = fit_line(train, linear.name)
    taken: set[str] = set()
    if present is not None and present.effects:
        values = {**base.model.values, **present.values}
        base = fit(train, replace(present, law=linear.name, values=values), with_std=False)
        taken = set(present.effects).union(*(EFFECTS[name].excludes for name in present.effects))
    before = judge(base.model, train, held_out)
    able = [e.key("structure") for e in effects_of("structure") if hook in e.hooks()]
    names = [name for name in able if name not in taken]
    if before.z <= rule.quiet and before.train <= rule.clean:
        names = []  # a line leaves nothing that a further effect could explain
    trials = [try_effect(name, base.model, train, held_out) for name in names]
    trials.sort(key=lambda trial: trial.z)
    return judge_site(site, before, trials, held_out, rule)


def try_effect(
    effect: str, base: Model, train: StructureProblem, held_out: StructureProblem
) -> Trial:
    """Refit a model with one more effect of the structure from several starts; judge the best.

    Parameters
    ----------
    effect : name of the effect
    base : the fitted model that it joins
    train, held_out : the site's runs to fit to, and those that decide
    """
    return judge(joined(effect, base, train), train, held_out)


def shortened(problem: StructureProblem, seconds: float) -> StructureProblem:
    """Return the problem with the first so many seconds of each run, itself if none is longer."""
    if all(len(_whole(run).x) * run.dt <= seconds for run in problem.runs):
        return problem
    return problem.of([_first_samples(run, round(seconds / run.dt)) for run in problem.runs])


def _whole(run: Run) -> Run:
    assert isinstance(run, StructureRun)
    assert run.whole is not None
    return run.whole


def _first_samples(run: Run, samples: int) -> StructureRun:
    """Return the first samples of a run, from rest: what a law remembers begins there."""
    assert isinstance(run, StructureRun)
    keep = run.keep[run.keep < samples]
    first, own = slice(samples), slice(len(keep))
    old = _whole(run)
    whole = replace(
        old, x=old.x[first], v=old.v[first], a=old.a[first], V=old.V[first],
        force=old.force[first], draws=old.draws[:, first],
    )  # fmt: skip
    return replace(
        run, x=run.x[own], v=run.v[own], a=run.a[own], V=run.V[own], force=run.force[own],
        draws=run.draws[:, own], whole=whole, keep=keep,
    )  # fmt: skip


def judge_site(
    site: str,
    before: Trial,
    trials: list[Trial],
    held_out: StructureProblem,
    rule: DecisionRule = SITE,
) -> Finding:
    """Return the finding that a site's trials lead to; held-out runs decide.

    Parameters
    ----------
    site : "layer", "storey1", "storey2" ...
    before : the trial of the model without a further effect
    trials : those of single effects, best first
    held_out : the site's runs that decide
    rule : the numbers that decide
    """
    kind, effects = decide_site(before, trials, rule)
    named = trials[0] if trials and lowers(before, trials[0], rule) else before
    share = 1.0 - rule.excess(named.z) / rule.excess(before.z)
    where = coordinate_of(named.residual, held_out) if kind == "unknown" else ""
    return Finding(
        site, kind, effects, before.z, named.z, share, detectable(held_out, rule), where,
        named.model, tuple(trials), before, named,
    )  # fmt: skip


def decide_site(
    before: Trial, trials: Sequence[Trial], rule: DecisionRule = SITE
) -> tuple[str, tuple[str, ...]]:
    """Return kind and effects that the trials of a site, best first, lead to."""
    if not trials or not lowers(before, trials[0], rule):
        return ("none" if before.z <= rule.clean else "unknown"), ()
    best = trials[0]
    share = 1.0 - rule.excess(best.z) / rule.excess(before.z)
    if best.z > rule.clean and share < rule.share:
        return "unknown", ()
    rivals = [best.effects[-1], *(t.effects[-1] for t in trials[1:] if _rivals(best, t, rule))]
    kind = "effect" if len(rivals) == 1 else "class"
    return kind, tuple(rivals[: rule.largest_class])


def lowers(before: Trial, after: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether an effect lowers the held-out error of a site by enough, and beyond chance."""
    return better(before, after, rule) and 1.0 - after.z / before.z >= rule.gain


def _rivals(best: Trial, other: Trial, rule: DecisionRule) -> bool:
    if best.z > rule.clean:
        return rule.excess(other.z) < rule.rival * rule.excess(best.z)
    return equals(best, other, rule)


def equals(best: Trial, other: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether the data cannot tell another trial from the best one."""
    return other.z / best.z - 1.0 < rule.close or not better(other, best, rule)


def better(first: Trial, second: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether the second trial errs less than the first on held-out runs, beyond chance.

    A site's noise is white, so where the second model is adequate its gain in likelihood counts.
    """
    if paired(first.losses, second.losses, rule.chance).low > 0.0:
        return True
    gain = float(np.sum(first.losses - second.losses))
    return second.z <= rule.clean and gain > rule.likelihood


def detectable(held_out: StructureProblem, rule: DecisionRule = SITE) -> float:
    """Return the smallest share of a site's force that lowers z by `rule.gain` when explained."""
    noise = float(np.mean([run.noise for run in held_out.runs]))
    excess = np.sqrt(1.0 / (1.0 - rule.gain) ** 2 - 1.0)
    return float(excess * noise / max(held_out.size("N"), 1e-300))


def coordinate_of(residual: Array, problem: Problem) -> str:
    """Return the coordinate along which a residual is organised the most, "time" if along none."""
    runs = problem.runs
    shown: dict[str, list[Array]] = {
        "displacement": [run.x for run in runs],
        "velocity": [run.v for run in runs],
        "acceleration": [run.a for run in runs],
        "time": [run.dt * np.arange(len(run.x), dtype=np.float64) for run in runs],
    }
    shares = {}
    for name, parts in shown.items():
        values = np.concatenate([p[r.skip :] for p, r in zip(parts, runs, strict=True)])
        shares[name] = _organised(residual, values)
    return max(shares, key=lambda name: shares[name])


def _organised(residual: Array, coordinate: Array, bins: int = 24) -> float:
    """Return the share of a residual's power that its means in bins of equal count hold."""
    label = np.empty(len(residual), dtype=np.int64)
    label[np.argsort(coordinate, kind="stable")] = np.arange(len(residual)) * bins // len(residual)
    cut = np.clip(residual, -8.0, 8.0)
    sums = np.bincount(label, weights=cut, minlength=bins)
    counts = np.maximum(np.bincount(label, minlength=bins), 1)
    return float(np.sum(sums**2 / counts) / max(float(np.sum(cut**2)), 1e-300))
