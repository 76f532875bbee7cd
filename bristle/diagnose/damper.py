"""What the law of a damper lacks, on a bench or inside a building."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..identify.fit import Model
from ..identify.site_fit import fit_damper
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS
from .by_gains import decide_by_gains
from .candidates import Trial, judge, missed_by
from .decision import Decision, Z, as_noise, decide, force_in, gained
from .finding import Finding, of_decision
from .opening import Opening, Progress, silent
from .rule import BENCH, SITE, DecisionRule
from .sites import better, equals
from .trials import Trials
from .zero import free_zero, renewed_zero, zero_fault


def look_at_damper(
    opened: Opening,
    say: Progress = silent,
    made: Trials | None = None,
    *,
    pairs: bool = True,
    excess: float | None = None,
) -> tuple[Finding, Opening]:
    """Return what a damper's law lacks, by `opened.rule`.

    Parameters
    ----------
    opened : what the look begins with
    say : is told what is being done
    made : the trials of single effects, where they were made before
    pairs : whether two effects are tried where no single one suffices
    excess : variance [N2] that counts beside the noise, see `residuals.excess_of`; None for what
        the best of these models misses

    Returns
    -------
    finding; and what the look began with: with the zero of the force free where that is off, and
    with the excess
    """
    before, rule = opened.before, opened.rule
    if noise_is_all(opened):
        return of_decision(as_noise(before, ()), before), opened
    made, decision = _decided(opened, say, made, pairs)
    zero, freed = None, free_zero(opened, decision)
    if freed is not None:
        say("the zero of the force is fitted along with every effect")
        again, other = _decided(freed, say, None, pairs)
        zero = zero_fault(freed.problem, other)
        if zero is not None:
            opened, made, decision = freed, again, other
    if excess is None:
        excess = missed_by(made.best, opened.problem)
    if excess:
        say("what no effect explains counts beside the noise")
        made = made.with_excess(excess)
        opened = made.opened
        made, decision = _decided(opened, say, made, pairs)
    before = opened.before
    if zero is not None:
        sensors = tuple(filter(None, (zero_fault(opened.problem, decision),)))
    else:
        sensors = renewed_zero(opened, decision)
    if not decision.effects and opened.held_out.noise_known:
        decision = _rare(before, made.single, rule) or decision
    found = of_decision(decision, before, tuple(made.single))
    best_pair = min(made.pairs, key=lambda pair: pair.z, default=None)
    found = replace(found, sensors=sensors, together=best_pair)
    patterns = tuple(made.patterns) if rule.organised < 1.0 else ()
    return replace(found, patterns=patterns, noise_known=opened.held_out.noise_known), opened


def noise_is_all(opened: Opening) -> bool:
    """Return whether a model leaves nothing that an effect could lower, and none is ranked then."""
    before = opened.before
    known = opened.held_out.noise_known
    return known and not opened.scope.rank_all and max(before.z, before.train) <= opened.rule.quiet


def _decided(
    opened: Opening, say: Progress, made: Trials | None, pairs: bool
) -> tuple[Trials, Decision]:
    """Return the trials of effects at a damper, and the decision that they lead to."""
    made, rule = made or Trials(opened, say), opened.rule
    if not opened.held_out.noise_known:
        return made, decide_by_gains(opened.before, made.single, opened.held_out, rule)
    organised = rule.organised < 1.0 and bool(made.patterns)
    if organised:
        organised = is_organised(made.patterns[0].share, made.patterns[0].p, rule)
    grow, reduce = (made.grow, made.reduce) if pairs else (_no_pairs, None)
    where = force_in(opened.held_out)
    return made, decide(opened.before, made.single, grow, organised, reduce, rule, where)


def _no_pairs(_first: Trial) -> list[Trial]:
    return []


def is_organised(share: float, p: float, rule: DecisionRule = BENCH) -> bool:
    """Return whether a residual depends strongly on a coordinate, and beyond chance.

    `share` of its power lies along the coordinate; `p` is the probability that chance does that.
    """
    return p <= rule.chance and share > rule.organised


def excused_by_sensor(
    found: Finding, most: float, reason: str, rule: DecisionRule = BENCH
) -> Finding:
    """Return a damper's finding, not unknown where an instrument already known explains it.

    What an effect of the library lowers is not excused.

    Parameters
    ----------
    found : the finding at the damper, with its trial before
    most : z that the instrument accounts for
    reason : what the instrument does, as a sentence for the verdict
    rule : the numbers that decide
    """
    before = found.before
    assert before is not None
    gains = any(1.0 - trial.z / before.z >= rule.gain for trial in found.trials)
    if found.kind != "unknown" or gains or max(before.z, before.train) > most:
        return found
    why = f"{reason} This explains the {Z} of {before.z:.2f}."
    return replace(found, kind="none", reasons=(why,))


def left_by_filter(
    law: str, train: StructureProblem, held_out: StructureProblem, rule: DecisionRule = BENCH
) -> float:
    """Return the z that a late and rounded force may leave once our delay is in the model.

    As for any effect of another form: it must explain `rule.share` of the excess without.

    Parameters
    ----------
    law : name of the damper's law
    train, held_out : the damper's runs to fit to, and those that decide
    rule : the numbers that decide
    """
    bare = judge(fit_damper(train, Model(law)).model, train, held_out)
    return float(np.sqrt(1.0 + (1.0 - rule.share) * rule.excess(bare.z)))


def _rare(
    before: Trial, trials: list[Trial], rule: DecisionRule = BENCH, site: DecisionRule = SITE
) -> Decision | None:
    """Return the decision for an effect of the layer or a stop that acts in a few samples, if any.

    A stop that is met once or twice is seen in no resampling of blocks; its likelihood tells, where
    the model with it is adequate.
    """
    best = trials[0]
    name = best.effects[-1]
    if not (EFFECTS[name].site == "structure" or EFFECTS[name].contact) or best.z > site.clean:
        return None
    if 1.0 - best.z / before.z < rule.gain or not better(before, best, site):
        return None
    rivals = [other.effects[-1] for other in trials[1:] if equals(best, other, site)]
    explained = 1.0 - rule.excess(best.z) / rule.excess(before.z)
    kind = "ambiguous" if rivals else "effect"
    names = (name, *rivals)[: rule.most_alternatives]
    return Decision(kind, names, best, explained, (gained(name, before, best, explained),))
