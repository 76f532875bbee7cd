"""What the law of a damper inside a building lacks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..identify.fit import Fit, Model, identify
from ..identify.search_context import refine
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS, effects_of
from .candidates import SECONDS, Trial, judge, try_all, try_members
from .decision import GAIN, SHARE, Decision, decide, excess
from .sites import CLEAN, NEARLY, better, shortened, try_effect

QUIET = 1.0 + 0.5 * GAIN
"""z of the damper's law up to which no effect can lower it by `GAIN`: noise is all there is."""

SEARCHED = 12.0
"""Seconds of each run, from its begin, on which the damper's effects are searched: the strongest
shaking is over. The best are then fitted to all that was recorded; held-out runs stay whole."""

CONTENDERS, NEAR = 3, 1.03
"""How many trials at most are fitted to all that was recorded, and up to which z as a multiple of
the best one's: rivals are told apart on equal terms."""


@dataclass(frozen=True)
class DamperVerdict:
    """What the damper's law lacks: the decision, and the trials that it rests on."""

    decision: Decision
    before: Trial
    trials: tuple[Trial, ...]


def fit_damper(problem: StructureProblem, present: Model) -> Fit:
    """Return the damper's law fitted anew, with the effects that the model has already."""
    effects = present.effects
    known = {n: v for n, v in present.values.items() if n.partition(".")[0] in effects}
    kept = {n: v for n, v in present.values.items() if n in present.held}
    return identify(
        problem, present.law, effects, values={**known, **kept}, held=present.held,
        limits=present.limits,
    )  # fmt: skip


def damper_verdict(base: Fit, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    """Return what the damper lacks; with a reconstructed force the layer's effects take part."""
    model = refine(base.model, train)
    before = judge(model, train, held_out)
    return _decided(before, train, held_out)


def _decided(before: Trial, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    # A force that no load cell shows cannot be late.
    instruments = () if train.reconstructed else ("delay",)

    brief = shortened(train, SEARCHED)

    def grow(first: Trial) -> list[Trial]:
        most = None if first is before else SECONDS
        trials = try_all(first.model, brief, held_out, instruments, most)
        if train.reconstructed:
            taken = first.model.effects
            trials += [
                try_effect(effect.name, first.model, train, held_out)
                for effect in effects_of("structure")
                if "force" in effect.hooks() and effect.name not in taken
            ]
        trials.sort(key=lambda trial: trial.z)
        if brief is not train:
            best = trials[0].z
            for k, one in enumerate(trials[:CONTENDERS]):
                if one.refined and one.z <= NEAR * best:
                    trials[k] = judge(refine(one.model, train), train, held_out)
        return sorted(trials, key=lambda trial: trial.z)

    def reduce(pair: Trial) -> list[Trial]:
        return try_members(pair, before.model, train, held_out)

    if max(before.z, before.train) <= QUIET:
        return DamperVerdict(decide(before, [], grow), before, ())
    trials = grow(before)
    decision = decide(before, trials, grow, reduce=reduce)
    if decision.kind in ("none", "unknown", "insufficient"):
        decision = _seldom(before, trials) or decision
    return DamperVerdict(decision, before, tuple(trials))


def forgiven(verdict: DamperVerdict, most: float, reason: str) -> DamperVerdict:
    """Return a verdict that does not call unknown what an instrument already known explains.

    `most` is the z that it accounts for; what an effect of the library lowers is not forgiven.
    """
    made, before = verdict.decision, verdict.before
    gains = any(1.0 - trial.z / before.z >= GAIN for trial in verdict.trials)
    if made.kind != "unknown" or gains or max(before.z, before.train) > most:
        return verdict
    words = f"{reason} z = {before.z:.2f} is no more than that."
    return replace(verdict, decision=replace(made, kind="none", reasons=(words,)))


def left_by_filter(law: str, train: StructureProblem, held_out: StructureProblem) -> float:
    """Return the z that a late and rounded force may leave once our delay is in the model.

    As for any effect of another form: it must explain `SHARE` of the excess that is there without.
    """
    bare = judge(fit_damper(train, Model(law)).model, train, held_out)
    return float(np.sqrt(1.0 + (1.0 - SHARE) * excess(bare)))


def _seldom(before: Trial, trials: list[Trial]) -> Decision | None:
    """Return the decision for an effect of the layer that acts in a few samples only, if any.

    A stop that is met once or twice is seen in no resampling of blocks; its likelihood tells, where
    the model with it is adequate.
    """
    best = trials[0]
    name = best.effects[-1]
    if EFFECTS[name].site != "structure" or best.z > CLEAN:
        return None
    if 1.0 - best.z / before.z < GAIN or not better(before, best):
        return None
    rivals = [
        other.effects[-1]
        for other in trials[1:]
        if other.z / best.z - 1.0 < NEARLY or not better(other, best)
    ]
    explained = 1.0 - excess(best) / excess(before)
    reason = f"With {name} the error on runs not seen falls from {before.z:.2f} to {best.z:.2f}."
    kind = "class" if rivals else "effect"
    return Decision(kind, (name, *rivals)[:3], best, explained, (reason,))
