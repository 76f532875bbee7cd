"""What one site lacks: a damper, an isolation layer, a storey.

There the model is a line and equilibrium gives the force, with white noise of known size. So the
effects of the structure are few and distinct, and each is judged by held-out runs alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..comparison.patterns import ResidualPattern
from ..core.finding import Finding
from ..core.progress import tell
from ..identification.building_sites import StructureProblem, StructureRun
from ..identification.fit import fit, is_rough, refine
from ..identification.histories import Effort, left
from ..identification.problem import Expected, Problem, Run, has_offset, moved_by, zero_of
from ..identification.rig import acts_at
from ..identification.rig_fit import fit_damper, fit_line, joined
from ..identification.search import in_threads
from ..model.model import Model
from ..physics.effect import EFFECTS, effects_of
from ..physics.laws import law_of_part
from .by_label import try_labels
from .decision import (
    NOISE,
    OTHER_FORM,
    Decision,
    as_noise,
    decide,
    decide_by_gains,
    force_in,
    gained,
    in_part,
    missing,
    named,
    suffices,
    unexplained,
)
from .prepared import Prepared, of_layer
from .remaining import patterns_of
from .rule import BENCH, SENSOR, SITE, DecisionRule
from .site_diagnosis import SiteDiagnosis, of_decision
from .trials import (
    BESIDE,
    SECONDS,
    End,
    KeptFits,
    Trial,
    judge,
    missed_by,
    paired,
    try_all,
    try_members,
)


def diagnose_line(site: str, prepared: Prepared) -> SiteDiagnosis:
    """Return what a layer's or storey's line lacks.

    Parameters
    ----------
    site : "layer", "storey1", "storey2" ...
    prepared : its runs and its model; see `prepare_line`
    """
    before, rule = prepared.before, prepared.rule
    train, held_out = prepared.problem, prepared.held_out
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


def prepare_line(
    site: str,
    train: StructureProblem,
    held_out: StructureProblem,
    present: Model | None = None,
    faults: tuple[Finding, ...] = (),
    noise: Mapping[str, float] | None = None,
) -> Prepared:
    """Return the runs of a layer or storey with its present model, fitted: a line with its effects.

    Parameters
    ----------
    site : "layer", "storey1", "storey2" ...
    train, held_out : the site's runs to fit to, and those that decide
    present : the effects that the model has at this site already, with their values; None if none
    faults, noise : what is known of the channels
    """
    linear = law_of_part(site)
    base = fit_line(train, linear.name)
    if present is not None and present.effects:
        values = {**base.model.values, **present.values}
        limits = {**base.model.limits, **present.limits}
        start = replace(present, law=linear.name, values=values, limits=limits)
        base = fit(train, start, with_std=False)
    before = judge(base.model, train, held_out)
    return Prepared(before, train, held_out, faults, noise or {}, rule=SITE, bench=False)


def joinable_at(site: str, base: Model) -> list[str]:
    """Return the effects of the structure that can join a layer's or storey's model."""
    taken = set(base.effects).union(*(EFFECTS[name].excludes for name in base.effects))
    able = [effect.key("structure") for effect in effects_of("structure")]
    return [name for name in able if name not in taken and acts_at(name, base, site, (site,))]


def try_effect(effect: str, base: Model, train: Problem, held_out: Problem) -> Trial:
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
    if all(len(run.remembered[0].x) * run.dt <= seconds for run in problem.runs):
        return problem
    cut = [_first_samples(run, round(seconds / run.dt)) for run in problem.runs]
    moving: list[Run] = [run for run in cut if len(run.force)]
    return problem.of(moving) if moving else problem


def _first_samples(run: Run, samples: int) -> StructureRun:
    """Return the first samples of a run, from rest: what a law remembers begins there."""
    assert isinstance(run, StructureRun)
    keep = run.keep[run.keep < samples]
    return replace(run.of(slice(len(keep))), whole=run.whole.of(slice(samples)))


def decide_site(before: Trial, trials: Sequence[Trial], rule: DecisionRule = SITE) -> Decision:
    """Return the decision that the trials of a site, best first, lead to; held-out runs decide."""
    if not trials or not lowers(before, trials[0], rule):
        if before.z <= rule.clean:
            return as_noise(before, trials)
        return Decision("unknown", (), before, 0.0, (unexplained(before, rule),))
    best = trials[0]
    name = best.effects[-1]
    share = rule.explained(before.z, best.z)
    reasons = [gained(name, before, best, share)]
    if best.z > rule.clean:
        if share < rule.share:
            return Decision("unknown", (), before, share, (in_part(name, best, share),))
        reasons.append(OTHER_FORM)
    rivals = [t.effects[-1] for t in trials[1:] if _rivals(best, t, rule)]
    return named([name, *rivals], best, share, reasons, rule)


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
    if paired(first.losses, second.losses, rule.chance) > 0.0:
        return True
    gain = float(np.sum(first.losses - second.losses))
    return second.z <= rule.clean and gain > rule.likelihood


# The trials of effects at the damper: single ones, and pairs as far as they are asked for.

CONTENDERS, NEAR = 3, 1.03
"""How many trials at most are fitted to all that was recorded, and up to which z as a multiple of
the best one's: rivals are told apart on equal terms."""


class Trials:
    """The trials of single effects, and of `pairs` as far as they are asked for.

    Parameters
    ----------
    prepared : the runs and the present model
    earlier : the same trials by other weights or of fewer runs, whose ends are where these begin
    free : those with the zero of the force fitted along, where they were made of fewer runs
    kept, law : where trials that are made from the very start are kept, and taken up, as those of
        which law
    effort : once it is spent no pairs are tried any more

    Attributes
    ----------
    closed : whether no further pairs are tried, neither here nor in trials that go on from these
    """

    def __init__(
        self,
        prepared: Prepared,
        earlier: Trials | None = None,
        free: Trials | None = None,
        kept: KeptFits | None = None,
        law: str = "",
        effort: Effort | None = None,
    ) -> None:
        self.prepared = prepared
        self.before = prepared.before
        self.pairs: list[Trial] = []
        self.closed = False
        self._found: dict[tuple[str, ...], list[Trial]] = {}
        self._alone: dict[tuple[str, ...], list[Trial]] = {}
        self._earlier = earlier
        self._kept, self._law = kept, law
        self._effort = effort
        self._begun_free = free or (earlier._freed if earlier else None)
        self._freed: Trials | None = None
        self._weighed: dict[float, Trials] = {}
        if earlier is None:
            try_labels(prepared)
        tell("trying every effect inside the model")
        self.single = self._all(self.before, None)

    @property
    def best(self) -> Trial:
        """The trial that leaves least, the present model among them."""
        return min((self.before, *self.single, *self.pairs), key=lambda trial: trial.z)

    def with_excess(self, excess: float) -> Trials:
        """Return the trials fitted and judged anew; see `Prepared.with_excess`."""
        if excess not in self._weighed:
            prepared = self.prepared.with_excess(excess)
            before = refine(self.before.model, prepared.problem)
            prepared = replace(prepared, before=judge(before, prepared.problem, prepared.held_out))
            self._weighed[excess] = Trials(prepared, self)
        return self._weighed[excess]

    @property
    def freed(self) -> Trials:
        """The trials with the zero of the force fitted along, made once."""
        if self._freed is None:
            tell("the zero of the force is fitted along with every effect")
            self._freed = Trials(self.prepared.freed, self._begun_free, effort=self._effort)
        return self._freed

    @cached_property
    def patterns(self) -> list[ResidualPattern]:
        """Along which coordinates the present model's residual is organised."""
        return patterns_of(self.before, self.prepared.held_out)

    def grow(self, first: Trial) -> list[Trial]:
        """Return the trials of all effects added to a trial's model."""
        tell(f"no single effect suffices: adding a second one to {first.effects[-1]}")
        grown = self._all(first, SECONDS)
        self.pairs += grown
        return grown

    def reduce(self, pair: Trial) -> list[Trial]:
        """Return the trials of a pair's members alone."""
        if pair.effects not in self._alone:
            prepared = self.prepared
            tell(f"each of {' and '.join(pair.effects)} alone, as they were fitted together")
            alone = try_members(pair, self.before.model, prepared.searched, prepared.held_out)
            lesser = min(one.z for one in alone) < min(one.z for one in self.single)
            self._alone[pair.effects] = self._on_all_runs(alone) if lesser else alone
        return self._alone[pair.effects]

    def _all(self, first: Trial, most: int | None) -> list[Trial]:
        if first.effects in self._found:
            return [*self._found[first.effects]]
        prepared = self.prepared
        held_out = prepared.held_out
        known = self._known(first)
        if known:
            self._noise  # noqa: B018  # before threads ask for it
            trials = in_threads(self._again, known)
        elif most is not None and (self._ended or (is_rough(first.model) and left() < 0.0)):
            return []  # behind a joint each simulation costs many times as much
        else:
            trials = try_all(
                first.model, prepared.searched, held_out, shown=prepared.shown, most=most
            )
            trials = [*trials, *self._of_layer(first)]
        trials.sort(key=lambda trial: trial.z)
        if most is None or self._may_be_needed(trials[0]):
            trials = self._on_all_runs(trials)
        self._found[first.effects] = trials
        if self._kept and not known:
            self._kept.keep(self._named(first), trials)
        return [*trials]

    @property
    def _ended(self) -> bool:
        """Whether no further pairs are tried."""
        spent = self._effort is not None and self._effort.spent
        return self.closed or spent or (self._earlier is not None and self._earlier._ended)

    def _known(self, first: Trial) -> Sequence[Trial | End]:
        """Return where the trials of effects beside a model ended before, none if they are new."""
        if self._earlier and first.effects in self._earlier._found:
            return self._earlier._found[first.effects]
        kept = self._kept.found(self._named(first)) if self._kept else ()
        defined = all(name in EFFECTS for end in kept for name in end.model.effects)
        return kept if defined else ()

    def _named(self, first: Trial) -> str:
        """Return the name by which the trials of effects beside a model are kept."""
        return " + ".join((self._law, *first.effects)) + BESIDE

    def _may_be_needed(self, pair: Trial) -> bool:
        """Return whether two effects leave as little as `decide` asks of them, or nearly so."""
        rule, single = self.prepared.rule, min(trial.z for trial in self.single)
        return rule.excess(pair.z / NEAR) <= rule.pair_left * rule.excess(single)

    def _on_all_runs(self, trials: list[Trial]) -> list[Trial]:
        """Return trials, the best first, those that contend fitted to all runs."""
        prepared = self.prepared
        trials = sorted(trials, key=lambda trial: trial.z)
        if prepared.searched is not prepared.problem:
            best = trials[0].z
            for k, one in enumerate(trials[:CONTENDERS]):
                if one.refined and one.z <= NEAR * best:
                    fitted = refine(one.model, prepared.problem)
                    trials[k] = judge(fitted, prepared.problem, prepared.held_out)
        return sorted(trials, key=lambda trial: trial.z)

    def _again(self, trial: Trial | End) -> Trial:
        """Return a trial fitted and judged by these runs' weights, from where it ended before."""
        train, held_out = self.prepared.searched, self.prepared.held_out
        if trial.refined:
            return judge(refine(trial.model, train), train, held_out)
        return judge(trial.model, train, held_out, self._noise)

    @cached_property
    def _noise(self) -> tuple[Expected, Expected]:
        """What a true model would show, drawn for the present model."""
        runs = self.prepared.searched, self.prepared.held_out
        return runs[0].expectation(self.before.model), runs[1].expectation(self.before.model)

    def _of_layer(self, first: Trial) -> list[Trial]:
        """Return the trials of the layer's effects, of which a reconstructed force has a share."""
        problem, held_out = self.prepared.problem, self.prepared.held_out
        return [
            try_effect(name, first.model, problem, held_out)
            for name in of_layer(first.model, problem)
        ]


# The zero of a load cell beside an effect: both are fitted together.
#
# A constant force is no effect by itself: the load cell's zero explains it as well as a preload,
# and needs nothing of the damper. Fitted alone, though, it absorbs part of what an effect does, and
# an effect fitted without it asks for a second one that has a constant force. So where a constant
# is left beside what was found, or was absorbed by a second effect, everything is tried once more
# with the zero free.


def free_zero(prepared: Prepared, decision: Decision) -> Prepared | None:
    """Return what a diagnosis begins with where the zero of the force is to be fitted along.

    Parameters
    ----------
    prepared : runs and the present model, the zero taken as right
    decision : what followed from that

    Returns
    -------
    Prepared or None
        None where a zero would explain nothing: no constant is left, or a single effect that has
        one says more than a zero would.
    """
    problem = prepared.problem
    known = problem.free_zero or problem.reconstructed
    if known or decision.kind in ("none", "insufficient"):
        return None
    if has_offset(prepared.before.model) or not _significant(problem, prepared.before.model):
        return None
    if not has_offset(decision.best.model):
        if not _significant(problem, decision.best.model):
            return None
        return prepared.freed
    alone = len(decision.effects) == 1
    return None if alone and missing(prepared.freed.before, decision.best) else prepared.freed


def with_zero_free(prepared: Prepared) -> Prepared:
    """Return what a search begins with, the zero of the force free where the model leaves one.

    So laws are compared in one pass: an effect that has a constant force of its own has no zero
    beside it there either.
    """
    problem, model = prepared.problem, prepared.before.model
    if problem.free_zero or problem.reconstructed or not prepared.held_out.noise_known:
        return prepared
    if has_offset(model) or not _significant(problem, model):
        return prepared
    return prepared.freed


def zero_fault(prepared: Prepared, decision: Decision) -> Finding | None:
    """Return the zero of the force beside what was decided with the zero free, None without one.

    A zero that was found before any effect is part of it. None where the model has a constant force
    of its own.
    """
    problem, model = prepared.problem, decision.best.model
    first = [one for one in prepared.faults if (one.channel, one.kind) == ("force", "bias")]
    if not problem.fits_zero(model) or not (first or _significant(problem, model)):
        return None
    more, std = zero_of(problem, model)
    return _fault(first[0].value + more if first else more, std, decision, problem)


def _with_zero(found: SiteDiagnosis, prepared: Prepared, decision: Decision) -> SiteDiagnosis:
    """Return a diagnosis with the zero of the force beside it, where there is one."""
    zero = zero_fault(prepared, decision)
    return replace(found, sensors=(zero,) if zero else ())


def _fault(zero: float, std: float, decision: Decision, problem: Problem) -> Finding:
    beside = f" beside {' and '.join(decision.effects)}" if decision.kind == "effect" else ""
    return Finding(
        "bias", "warning",
        f"Force shows {zero:.3g} N{beside} whatever the {moved_by(problem)}: the zero of the "
        "load cell is off. A static preload on the rod would look the same.",
        channel="force", value=zero, std=std,
    )  # fmt: skip


def _significant(problem: Problem, model: Model) -> bool:
    """Return whether a model leaves a constant force that is large enough to matter."""
    zero, std = zero_of(problem, model)
    force = np.concatenate([run.force for run in problem.runs])
    least = SENSOR.least_bias * float(np.sqrt(np.mean(force**2)))
    return abs(zero) > max(SENSOR.fault_sigma * std, least)


# What the law of a damper lacks, on a bench or inside a building.


def diagnose_damper(
    prepared: Prepared,
    made: Trials | None = None,
    *,
    pairs: bool = True,
    excess: float | None = None,
) -> tuple[SiteDiagnosis, Prepared]:
    """Return what a damper's law lacks, by `prepared.rule`.

    Parameters
    ----------
    prepared : what the look begins with
    made : the trials of single effects, where they were made before
    pairs : whether two effects are tried where no single one suffices
    excess : variance [N2] that counts beside the noise, see `problem.excess_of`; None for what
        the best of these models misses

    Returns
    -------
    finding; and what the look began with: with the zero of the force free where that is off, and
    with the excess
    """
    before, rule = prepared.before, prepared.rule
    if noise_is_all(prepared):
        decision = as_noise(before, ())
        return _with_zero(of_decision(decision, before), prepared, decision), prepared
    made, decision = _decided(prepared, made, pairs)
    freed = free_zero(prepared, decision)
    if freed is not None:
        again, other = _decided(freed, made.freed, pairs)
        decided = other.kind not in ("unknown", "insufficient")
        if decided and zero_fault(freed, other) is not None:
            prepared, made, decision = freed, again, other
    if excess is None:
        excess = missed_by(made.best, prepared.problem)
    if excess:
        tell("what no effect explains counts beside the noise")
        made = made.with_excess(excess)
        prepared = made.prepared
        made, decision = _decided(prepared, made, pairs)
    before = prepared.before
    if not decision.effects and prepared.held_out.noise_known:
        decision = _rare(before, made.single, rule) or decision
    found = of_decision(decision, before, tuple(made.single))
    best_pair = min(made.pairs, key=lambda pair: pair.z, default=None)
    found = _with_zero(replace(found, together=best_pair), prepared, decision)
    patterns = tuple(made.patterns) if rule.organised < 1.0 else ()
    found = replace(found, patterns=patterns, noise_known=prepared.held_out.noise_known)
    return found, prepared


def noise_is_all(prepared: Prepared) -> bool:
    """Return whether a model leaves nothing that an effect could lower, and none is ranked then."""
    before = prepared.before
    known = prepared.held_out.noise_known
    return known and not prepared.bench and max(before.z, before.train) <= prepared.rule.quiet


def _decided(prepared: Prepared, made: Trials | None, pairs: bool) -> tuple[Trials, Decision]:
    """Return the trials of effects at a damper, and the decision that they lead to."""
    made, rule = made or Trials(prepared), prepared.rule
    if not prepared.held_out.noise_known:
        return made, decide_by_gains(prepared.before, made.single, prepared.held_out, rule)
    organised = rule.organised < 1.0 and bool(made.patterns)
    if organised:
        organised = is_organised(made.patterns[0].share, made.patterns[0].p, rule)
    grow, reduce = (made.grow, made.reduce) if pairs else (lambda _first: [], None)
    where = force_in(prepared.held_out)
    decision = decide(prepared.before, made.single, grow, organised, reduce, rule, where)
    if prepared.problem.joined_with_layer:
        decision = beside_yield(decision, prepared.before, made.single, rule)
    return made, decision


def beside_yield(
    decision: Decision, before: Trial, trials: Sequence[Trial], rule: DecisionRule
) -> Decision:
    """Return a decision on a force of layer and damper, friction of the layer with its rivals.

    The law's yield force absorbs such friction but for its form, and forms differ: whatever effect
    suffices by itself is a rival.

    Parameters
    ----------
    decision : what the trials lead to
    before, trials : the model without an effect, and with each one
    rule : the numbers that decide
    """
    if len(decision.effects) != 1 or not EFFECTS[decision.effects[0]].absorbed_by:
        return decision
    able = [one for one in trials if missing(before, one, rule) and suffices(before, one, rule)]
    names = dict.fromkeys([*decision.effects, *(one.effects[-1] for one in able)])
    return named([*names], decision.best, decision.explained, decision.reasons, rule)


def is_organised(share: float, p: float, rule: DecisionRule = BENCH) -> bool:
    """Return whether a residual depends strongly on a coordinate, and beyond chance.

    `share` of its power lies along the coordinate; `p` is the probability that chance does that.
    """
    return p <= rule.chance and share > rule.organised


def excused_by_sensor(found: SiteDiagnosis, most: float, reason: str) -> SiteDiagnosis:
    """Return a damper's finding, none where an instrument already known explains it.

    Neither unknown nor, for what it leaves of some runs, contradicted. What an effect of the
    library lowers is not excused.

    Parameters
    ----------
    found : the finding at the damper, with its trial before
    most : z that the instrument accounts for
    reason : what the instrument does, as a sentence for the verdict
    """
    before = found.before
    assert before is not None
    worst = max(before.z, before.train)
    gains = found.kind == "unknown" and any(
        1.0 - trial.z / before.z >= BENCH.gain for trial in found.trials
    )
    if found.kind not in ("unknown", "none") or gains or not BENCH.clean < worst <= most:
        return found
    why = f"{reason} This explains the error, {worst:.2f} {NOISE}."
    return replace(found, kind="none", reasons=(why,))


def left_by_filter(law: str, train: StructureProblem, held_out: StructureProblem) -> float:
    """Return the z that a late and rounded force may leave once our delay is in the model.

    As for any effect of another form: it must explain `rule.share` of the excess without.

    Parameters
    ----------
    law : name of the damper's law
    train, held_out : the damper's runs to fit to, and those that decide
    """
    bare = judge(fit_damper(train, Model(law)).model, train, held_out)
    return float(np.sqrt(1.0 + (1.0 - BENCH.share) * BENCH.excess(bare.z)))


def _rare(before: Trial, trials: list[Trial], rule: DecisionRule = BENCH) -> Decision | None:
    """Return the decision for an effect of the layer or a stop that acts in a few samples, if any.

    A stop that is met once or twice is seen in no resampling of blocks; its likelihood tells, where
    the model with it is adequate.
    """
    best = trials[0]
    name = best.effects[-1]
    if not (EFFECTS[name].site == "structure" or EFFECTS[name].contact) or best.z > SITE.clean:
        return None
    if 1.0 - best.z / before.z < rule.gain or not better(before, best, SITE):
        return None
    rivals = [other.effects[-1] for other in trials[1:] if equals(best, other, SITE)]
    explained = rule.explained(before.z, best.z)
    reasons = [gained(name, before, best, explained)]
    return named([name, *rivals], best, explained, reasons, rule)
