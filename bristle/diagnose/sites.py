"""What one site of a building lacks: its isolation layer, a storey, or the load cell.

There the model is a line and equilibrium gives the force, with white noise of known size. So the
effects of the structure are few and distinct, and each is judged by held-out runs alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..identify.assigned import acts_at
from ..identify.fit import fit
from ..identify.line import fit_line
from ..identify.model import Model, Run
from ..identify.site_fit import joined
from ..identify.structure import (
    StructureProblem,
    StructureRun,
)
from ..physics.effect import EFFECTS, effects_of
from ..physics.laws import law_of_part
from .by_gains import decide_by_gains
from .candidates import Trial, judge
from .decision import OTHER_FORM, Decision, as_noise, gained, in_part, unexplained
from .evidence import paired
from .finding import Finding, of_decision
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
    before = present_at(site, train, held_out, present)
    names = joinable_at(site, before.model)
    if not held_out.noise_known:
        trials = [try_effect(name, before.model, train, held_out) for name in names]
        trials.sort(key=lambda trial: trial.rms)
        decision = decide_by_gains(before, trials, held_out, rule)
        return replace(of_decision(decision, before, tuple(trials), site), noise_known=False)
    if before.z <= rule.clean and before.train <= rule.clean:
        # Masses, springs and instruments leave so much; only a stop that few samples meet hides in
        # it. Friction acts in all of them, and its name is not made of so little.
        stops = [one for one in names if EFFECTS[one].contact and not EFFECTS[one].absorbed_by]
        names = [] if before.z <= rule.quiet else stops
    trials = [try_effect(name, before.model, train, held_out) for name in names]
    trials.sort(key=lambda trial: trial.z)
    return of_decision(decide_site(before, trials, rule), before, tuple(trials), site)


def present_at(
    site: str, train: StructureProblem, held_out: StructureProblem, present: Model | None = None
) -> Trial:
    """Return how the present model of a layer or storey does, fitted: a line with its effects.

    Parameters
    ----------
    site, train, held_out, present : as in `look_at`
    """
    linear = law_of_part(site)
    base = fit_line(train, linear.name)
    if present is not None and present.effects:
        values = {**base.model.values, **present.values}
        limits = {**base.model.limits, **present.limits}
        start = replace(present, law=linear.name, values=values, limits=limits)
        base = fit(train, start, with_std=False)
    return judge(base.model, train, held_out)


def joinable_at(site: str, base: Model) -> list[str]:
    """Return the effects of the structure that can join a layer's or storey's model."""
    taken = set(base.effects).union(*(EFFECTS[name].excludes for name in base.effects))
    able = [effect.key("structure") for effect in effects_of("structure")]
    return [name for name in able if name not in taken and acts_at(name, base, site, (site,))]


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
    """Return the problem with the first so many seconds of each run, itself if none is longer.

    A run whose base does not move within that time is left out.
    """
    if all(len(_whole(run).x) * run.dt <= seconds for run in problem.runs):
        return problem
    cut = [_first_samples(run, round(seconds / run.dt)) for run in problem.runs]
    moving: list[Run] = [run for run in cut if len(run.force)]
    return problem.of(moving) if moving else problem


def _whole(run: Run) -> Run:
    assert isinstance(run, StructureRun)
    assert run.whole is not None
    return run.whole


def _first_samples(run: Run, samples: int) -> StructureRun:
    """Return the first samples of a run, from rest: what a law remembers begins there."""
    assert isinstance(run, StructureRun)
    keep = run.keep[run.keep < samples]
    whole = _whole(run).of(slice(samples))
    return replace(run.of(slice(len(keep))), whole=whole)


def decide_site(before: Trial, trials: Sequence[Trial], rule: DecisionRule = SITE) -> Decision:
    """Return the decision that the trials of a site, best first, lead to; held-out runs decide."""
    if not trials or not lowers(before, trials[0], rule):
        if before.z <= rule.clean:
            return as_noise(before, trials)
        return Decision("unknown", (), before, 0.0, (unexplained(before, rule),))
    best = trials[0]
    name = best.effects[-1]
    share = 1.0 - rule.excess(best.z) / rule.excess(before.z)
    reasons = [gained(name, before, best, share)]
    if best.z > rule.clean:
        if share < rule.share:
            return Decision("unknown", (), before, share, (in_part(name, best, share),))
        reasons.append(OTHER_FORM)
    rivals = [name, *(t.effects[-1] for t in trials[1:] if _rivals(best, t, rule))]
    kind = "effect" if len(rivals) == 1 else "ambiguous"
    return Decision(kind, tuple(rivals[: rule.most_alternatives]), best, share, tuple(reasons))


def lowers(before: Trial, after: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether an effect lowers the held-out error of a site by enough, and beyond chance."""
    return better(before, after, rule) and 1.0 - after.z / before.z >= rule.gain


def _rivals(best: Trial, other: Trial, rule: DecisionRule) -> bool:
    if best.z > rule.clean:
        return rule.excess(other.z) < rule.rival * rule.excess(best.z)
    return equals(best, other, rule)


def equals(best: Trial, other: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether the data cannot distinguish another trial from the best one."""
    return other.z / best.z - 1.0 < rule.close or not better(other, best, rule)


def better(first: Trial, second: Trial, rule: DecisionRule = SITE) -> bool:
    """Return whether the second trial errs less than the first on held-out runs, beyond chance.

    A site's noise is white, so where the second model is adequate its gain in likelihood counts.
    """
    if paired(first.losses, second.losses, rule.chance).low > 0.0:
        return True
    gain = float(np.sum(first.losses - second.losses))
    return second.z <= rule.clean and gain > rule.likelihood
