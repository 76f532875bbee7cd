"""From trials to a verdict: none, an effect, a pair, alternatives, or something unknown.

Only numbers on held-out runs decide. z is RMS(residual)/noise expected; z^2 - 1 is the excess, the
part of the residual's power that noise does not account for. An effect explains the share of the
excess that goes when it is added and everything refitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..comparison.names import effect_name
from ..core.text import joined, percent, plain
from ..errors import StudyError
from ..identification.building_sites import StructureProblem
from ..identification.error import held_out_apart
from ..identification.problem import Problem
from ..identification.rig import DAMPER
from ..physics.effect import EFFECTS
from .rule import BENCH, DecisionRule
from .trials import Trial, paired

NOISE = "times the noise (z)"
"""What stands behind z in a sentence: "the error is 1.02 times the noise (z)"."""

TOLD = 3
"""Runs that a sentence names one by one."""

OTHER_FORM = "A part of the error remains: the effect in the rig follows another formula."


def in_runs(names: Sequence[str], samples: int) -> str:
    """Return where something is: "in a, b, c and 2 more (9,000 samples)"."""
    more = f" and {len(names) - TOLD} more" if len(names) > TOLD else ""
    return f"in {', '.join(names[:TOLD])}{more} ({samples:,} samples)"


def force_in(problem: Problem, site: str = DAMPER) -> str:
    """Return which force was judged, and in which runs and how many samples of them."""
    measured = not isinstance(problem, StructureProblem) or (
        site == DAMPER and not problem.reconstructed
    )
    samples = sum(int(np.count_nonzero(run.judged)) for run in problem.runs)
    what = "the force" if measured else "the force that equilibrium gives"
    return f"{what} {in_runs([run.name for run in problem.runs], samples)}"


@dataclass(frozen=True)
class Decision:
    """What follows from the trials.

    `kind` as in verdict.json; `effects` the new ones, all missing ("effect") or one of them
    ("ambiguous"); `best` the trial that goes with it, the model before for "none" and "unknown";
    `explained` the share of the excess; `reasons` sentences.
    """

    kind: str
    effects: tuple[str, ...]
    best: Trial
    explained: float
    reasons: tuple[str, ...]


def decide(
    before: Trial,
    trials: Sequence[Trial],
    grow: Callable[[Trial], list[Trial]],
    organised: bool = False,
    reduce: Callable[[Trial], list[Trial]] | None = None,
    rule: DecisionRule = BENCH,
    where: str = "the force",
) -> Decision:
    """Return the decision that the trials of single effects lead to.

    Parameters
    ----------
    before : the fitted model without a further effect
    trials : one per effect, any order
    grow : returns the trials of all effects added to a trial's model; called where no single one
        explains the residual
    organised : whether a coordinate organises the residual of `before` strongly
    reduce : returns the trials of a pair's members alone, searched from the pair's values: a search
        of their own may have ended in a lesser minimum
    rule : the numbers that decide
    where : which force was judged, and in which runs
    """
    ranked = sorted(trials, key=lambda trial: trial.z)
    if not ranked or not missing(before, ranked[0], rule):
        if before.z <= rule.clean and not organised:
            return as_noise(before, ranked)
        return Decision("unknown", (), before, 0.0, (unexplained(before, rule),))
    best = ranked[0]
    if before.z < rule.noise_overestimated:
        return _too_loud(before, best, where)
    explained = rule.explained(before.z, best.z)
    if best.z > rule.adequate:
        pair = _pair(before, ranked, grow, rule)
        if pair is not None and reduce is not None:
            alone = min(reduce(pair.best), key=lambda trial: trial.z)
            if alone.z < best.z:
                rest = [trial for trial in ranked if trial.effects != alone.effects]
                again = decide(
                    before, [alone, *rest], lambda _first: [], organised, rule=rule, where=where
                )
                if not _needed(alone, pair.best, rule):
                    return again
        if pair is not None:
            return pair
    if not suffices(before, best, rule):
        return Decision(
            "unknown", (), before, explained, (in_part(best.beyond(before)[0], best, explained),)
        )
    return _effect_or_ambiguous(before, best, ranked[1:], rule)


def suffices(before: Trial, best: Trial, rule: DecisionRule) -> bool:
    """Return whether one effect is enough, be its form another one."""
    return best.z <= rule.adequate or rule.explained(before.z, best.z) >= rule.share


def missing(before: Trial, after: Trial, rule: DecisionRule = BENCH) -> bool:
    """Return whether an effect lowers the held-out error by enough, and beyond chance.

    An effect that serves the many samples near rest at the cost of all others is none; of a few
    samples beside reversals the plain error says nothing. Nor is one that gains nothing where it
    was fitted.
    """
    if 1.0 - after.z / before.z < rule.gain:
        return False
    if before.z <= rule.clean and after.train > (1.0 - rule.learned * rule.gain) * before.train:
        return False
    larger = after.rms > rule.most_rms * before.rms
    if larger and not after.rms_bulk <= rule.most_rms * before.rms_bulk:
        return False
    return paired(before.losses, after.losses, rule.chance) > 0.0


def as_noise(before: Trial, ranked: Sequence[Trial]) -> Decision:
    """Return the decision that nothing is missing, `ranked` being the trials, best first."""
    reason = f"The error on held-out runs is {before.z:.2f} {NOISE}"
    if ranked:
        gain = 100.0 * max(0.0, 1.0 - ranked[0].z / before.z)
        more = f" by more than {gain:.1f} %" if gain >= 0.05 else ""
        reason += f", and no effect of the library lowers it{more}"
    return Decision("none", (), before, 0.0, (reason + ".",))


def unexplained(before: Trial, rule: DecisionRule) -> str:
    """Return the sentence that no effect gains enough."""
    return (
        f"The error on held-out runs is {before.z:.2f} {NOISE}; no effect of the library lowers "
        f"it by {percent(rule.gain, 0)}."
    )


def in_part(name: str, best: Trial, explained: float) -> str:
    """Return the sentence that the best effect explains too little."""
    return (
        f"The best effect of the library, {effect_name(name)}, explains only "
        f"{percent(explained, 0)} of what is missing: with it the error is {best.z:.2f} {NOISE}."
    )


def gained(name: str, before: Trial, best: Trial, explained: float) -> str:
    """Return the sentence that an effect lowers the error.

    Parameters
    ----------
    name : of the effect
    before, best : the trials of the model without it and with it
    explained : the effect's share of the excess
    """
    return (
        f"With {effect_name(name)} the error on held-out runs falls from {before.z:.2f} to "
        f"{best.z:.2f} {NOISE}: it explains {percent(explained, 0)} of the error beyond noise."
    )


def _too_loud(before: Trial, best: Trial, where: str) -> Decision:
    return Decision(
        "insufficient", (), before, 0.0,
        (
            f"The error on held-out runs is {before.z:.2f} {NOISE}: the noise of {where} was "
            "estimated too high, as happens where a force turns within a few samples. With "
            f"{effect_name(best.beyond(before)[0])} the error is lower still, but against this "
            "noise that proves nothing. State the noise in study.toml, noise = ... in "
            "[channels.NAME] of what was measured, or sample faster.",
        ),
    )  # fmt: skip


def _pair(
    before: Trial,
    ranked: Sequence[Trial],
    grow: Callable[[Trial], list[Trial]],
    rule: DecisionRule,
) -> Decision | None:
    """Return the decision for two effects, None where two do not explain it much better."""
    best = ranked[0]
    single = suffices(before, best, rule)
    alone = {trial.beyond(before)[0]: trial for trial in ranked}
    grown: list[Trial] = []
    for first in ranked[: 1 if single else 2]:
        if missing(before, first, rule) and rule.excess(first.z) <= (
            1.0 - rule.first
        ) * rule.excess(before.z):
            grown += grow(first)
    if not grown:
        return None
    pair = min(grown, key=lambda trial: trial.z)
    names = pair.beyond(before)
    if not _needed(best, pair, rule):
        return None
    without = [alone[name] for name in names if name in alone]
    parts = [
        (rule.excess(other.z) - rule.excess(pair.z)) / rule.excess(before.z) for other in without
    ]
    explained = rule.explained(before.z, pair.z)
    nearly = pair.z <= rule.adequate and rule.excess(pair.z) <= rule.rest * rule.excess(best.z)
    closes = best.z > rule.clean and (pair.z <= rule.complete or nearly)
    if min(parts, default=0.0) < rule.pair_part and not closes:
        return None
    if not suffices(before, pair, rule):
        return None
    return Decision(
        "effect", names, pair, explained,
        (
            f"No single effect explains the error on held-out runs, {before.z:.2f} {NOISE}: the "
            f"best, {effect_name(best.beyond(before)[0])}, leaves {best.z:.2f}; "
            f"{effect_name(names[0])} and {effect_name(names[1])} together leave {pair.z:.2f}.",
        ),
    )  # fmt: skip


def _needed(single: Trial, pair: Trial, rule: DecisionRule) -> bool:
    """Return whether a second effect takes a fair share of what the first one leaves."""
    left = rule.pair_left * rule.excess(single.z)
    return rule.excess(pair.z) <= left and missing(single, pair, rule)


def _effect_or_ambiguous(
    before: Trial, best: Trial, others: Sequence[Trial], rule: DecisionRule
) -> Decision:
    name = best.beyond(before)[0]
    explained = rule.explained(before.z, best.z)
    rivals = [
        other
        for other in others
        if missing(before, other, rule)
        and _rivals(best, other, rule)
        and not _same(name, other, before)
    ]
    reasons = [gained(name, before, best, explained)]
    if best.z > rule.adequate:
        reasons.append(OTHER_FORM)
    return named([name, *(o.beyond(before)[0] for o in rivals)], best, explained, reasons, rule)


def named(
    names: Sequence[str], best: Trial, explained: float, reasons: Sequence[str], rule: DecisionRule
) -> Decision:
    """Return the decision for the first of some effects, the others being its rivals.

    Parameters
    ----------
    names : the effects
    best : the trial of the first
    explained : what it explains of the excess [1]
    reasons : what the verdict says besides
    rule : how many alternatives a decision names
    """
    kind = "ambiguous" if len(names) > 1 else "effect"
    return Decision(kind, (*names[: rule.most_alternatives],), best, explained, (*reasons,))


def _rivals(best: Trial, other: Trial, rule: DecisionRule) -> bool:
    if best.z > rule.adequate:
        return rule.excess(other.z) <= rule.rival * rule.excess(best.z)
    if other.z / best.z - 1.0 < rule.close:
        return True
    if other.z > rule.adequate:
        return False
    return paired(other.losses, best.losses, rule.chance) <= 0.0


def _same(name: str, other: Trial, before: Trial) -> bool:
    """Return whether small motion cannot tell an effect from that of another trial."""
    first, second = (
        EFFECTS[one].family if one in EFFECTS else "" for one in (name, other.beyond(before)[0])
    )
    return bool(first) and first == second


# The decision where the force's noise is not known: by what effects gain on held-out runs.
#
# No z can be told then, and nothing says how much of an error is noise. So an effect is named for
# the part of the whole error that it takes, beyond chance, and "none" is not among the answers.


def decide_by_gains(
    before: Trial, trials: Sequence[Trial], held_out: Problem, rule: DecisionRule
) -> Decision:
    """Return the decision that gains over held-out runs lead to; see `decision.decide`.

    Parameters
    ----------
    before : the fitted model without a further effect
    trials : one per effect, any order
    held_out : the runs that decide
    rule : the numbers that decide
    """
    size = float(np.sqrt(np.mean(held_out.force[held_out.judged] ** 2)))

    def share(trial: Trial) -> str:
        return f"{plain(100.0 * trial.rms / size, 2)} %"

    not_known = noise_not_known(held_out)
    able = sorted((one for one in trials if _gains(before, one, rule)), key=lambda trial: trial.rms)
    if not able:
        apart = held_out_apart(before.train, before.z, before.rms / size)
        return Decision(
            "insufficient", (), before, 0.0,
            (
                f"No effect of the library lowers the error; {share(before)} of the force is "
                f"unexplained, noise included. {apart or not_known}",
            ),
        )  # fmt: skip
    best = able[0]
    name, explained = best.effects[-1], 1.0 - (best.rms / before.rms) ** 2
    gained = (
        f"With {effect_name(name)} the error on held-out runs falls from {share(before)} to "
        f"{share(best)} of the force, noise included."
    )
    if explained < rule.part:
        return Decision(
            "insufficient", (), before, explained,
            (f"{gained} How much of the rest is noise cannot be told. {not_known}",),
        )  # fmt: skip
    rivals = [one.effects[-1] for one in able[1:] if _equals(best, one, rule)]
    return named([name, *rivals], best, explained, [gained, not_known], rule)


def noise_not_known(problem: Problem) -> str:
    """Return the sentence that says of which channels the noise is not known, and what to do."""
    blind = [run for run in problem.runs if run.untold]
    names = list(dict.fromkeys(name for run in blind for name in run.untold))
    where = in_runs([run.name for run in blind], sum(len(run.force) for run in blind))
    one = len(names) == 1
    return (
        f"The noise of {joined(names)} is not known {where}: {'it' if one else 'they'} "
        f"{'was' if one else 'were'} low-passed and never rest{'s' if one else ''}. Give "
        f"{'its standard deviation' if one else 'their standard deviations'} in study.toml, "
        f"noise = ... in {joined([f'[channels.{name}]' for name in names])}, from a record at rest."
    )


def refuse_unknown_noise(folder: Path, problem: Problem) -> None:
    """Raise StudyError where no test can be planned: how much one tells is a matter of noise."""
    if not problem.noise_known:
        raise StudyError(f"{folder}: no test can be planned. {noise_not_known(problem)}")


def _gains(before: Trial, after: Trial, rule: DecisionRule) -> bool:
    """Return whether an effect lowers the held-out error by enough, and beyond chance."""
    if after.rms > (1.0 - rule.gain) * before.rms:
        return False
    return paired(before.losses, after.losses, rule.chance) > 0.0


def _equals(best: Trial, other: Trial, rule: DecisionRule) -> bool:
    """Return whether the runs cannot distinguish another effect from the best one."""
    if other.rms <= (1.0 + rule.close) * best.rms:
        return True
    return paired(other.losses, best.losses, rule.chance) <= 0.0
