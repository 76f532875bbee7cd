"""From trials to a verdict: none, an effect, a pair, a class of rivals, or something unknown.

Only numbers on held-out runs decide. z is RMS(residual)/noise expected; z^2 - 1 is the excess, the
part of the residual's power that noise does not account for. An effect explains the share of the
excess that goes when it is added and everything refitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .candidates import Trial
from .evidence import paired

GAIN = 0.02
"""Smallest share by which an effect must lower z to be missing."""

MOST_RMS = 1.1
"""What an effect may leave of the plain error, for its weights are not those of z."""

CLEAN = 1.15
"""z of a base model above which something is missing, whether an effect explains it or not."""

LOUD = 0.9
"""z of a base model below which the noise was estimated too high to judge anything by it."""

ADEQUATE = 1.08
"""z up to which a model with an effect leaves nothing that matters."""

SHARE = 0.75
"""Share of the excess that an effect must explain where its model is not adequate: its form may
differ from ours, and then the name is right and a residual remains."""

FIRST = 0.2
"""Share of the excess that the first effect of a pair must explain by itself."""

PAIR_LEFT = 0.5
"""What a second effect may leave, as a share of the excess that the first one leaves."""

PAIR_PART = 0.05
"""Smallest part of the first excess that the lesser effect of a pair must account for: a misfit of
form is lowered by many effects."""

COMPLETE = 1.04
"""z up to which a pair counts whatever its lesser effect accounts for, where the best one leaves
more than `CLEAN`: no effect closes a misfit of another one's form."""

REST = 0.03
"""Share of what the first effect leaves that may remain for the same where a pair is adequate."""

RIVAL = 1.25
"""Where the best model is not adequate, others rival it up to this many times its excess: a misfit
of form cannot decide between what is nearly as wrong."""

CLOSE = 0.004
"""Share of z within which two adequate models are equal whatever the statistics say."""

MOST = 3
"""Most members of a class."""

FAMILY = ("presliding", "mount_compliance", "backlash")
"""Series elements before the sliding: at small travel they are one and the same."""


@dataclass(frozen=True)
class Decision:
    """What follows from the trials.

    `kind` as in verdict.json; `effects` the new ones, all missing ("effect") or one of them
    ("class"); `best` the trial that goes with it, the model before for "none" and "unknown";
    `explained` the share of the excess; `reasons` sentences.
    """

    kind: str
    effects: tuple[str, ...]
    best: Trial
    explained: float
    reasons: tuple[str, ...]


def excess(trial: Trial) -> float:
    """Return z^2 - 1, never below a hundredth: noise is not known better."""
    return max(trial.z**2 - 1.0, 0.01)


def decide(
    before: Trial,
    trials: Sequence[Trial],
    grow: Callable[[Trial], list[Trial]],
    organised: bool = False,
    reduce: Callable[[Trial], list[Trial]] | None = None,
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
    """
    ranked = sorted(trials, key=lambda trial: trial.z)
    if not ranked or not missing(before, ranked[0]):
        return _without_effect(before, ranked, organised)
    best = ranked[0]
    if before.z < LOUD:
        return _too_loud(before, best)
    explained = 1.0 - excess(best) / excess(before)
    single = best.z <= ADEQUATE or explained >= SHARE
    if best.z > ADEQUATE:
        pair = _pair(before, ranked, grow, single)
        if pair is not None and reduce is not None:
            alone = min(reduce(pair.best), key=lambda trial: trial.z)
            if alone.z < best.z:
                rest = [trial for trial in ranked if trial.effects != alone.effects]
                again = decide(before, [alone, *rest], lambda _first: [], organised)
                if not _needed(alone, pair.best):
                    return again
        if pair is not None:
            return pair
    if not single:
        return Decision(
            "unknown", (), before, explained,
            (
                f"The best effect of the library, {_new(best, before)[0]}, explains "
                f"{explained:.0%} of what is missing and leaves z = {best.z:.2f}.",
            ),
        )  # fmt: skip
    return _effect_or_class(before, best, ranked[1:], explained)


def missing(before: Trial, after: Trial) -> bool:
    """Return whether an effect lowers the held-out error by enough, and beyond chance.

    An effect that serves the many samples near rest at the cost of all others is none.
    """
    if 1.0 - after.z / before.z < GAIN or after.rms > MOST_RMS * before.rms:
        return False
    return paired(before.losses, after.losses).low > 0.0


def _without_effect(before: Trial, ranked: Sequence[Trial], organised: bool) -> Decision:
    if before.z <= CLEAN and not organised:
        reason = f"On runs it has not seen the model errs by {before.z:.2f} times the noise"
        if ranked:
            gain = max(0.0, 1.0 - ranked[0].z / before.z)
            reason += f", and no effect lowers that by more than {gain:.1%}"
        return Decision("none", (), before, 0.0, (reason + ".",))
    return Decision(
        "unknown", (), before, 0.0,
        (f"z = {before.z:.2f}, and no effect of the library lowers it by {GAIN:.0%}.",),
    )  # fmt: skip


def _too_loud(before: Trial, best: Trial) -> Decision:
    return Decision(
        "insufficient", (), before, 0.0,
        (
            f"The model errs by {before.z:.2f} times the noise: that was estimated too high, as "
            "happens where a force turns within a few samples. "
            f"{_new(best, before)[0].capitalize()} lowers the error further, which this noise "
            "cannot judge. State the noise of the channels in study.toml, or sample faster.",
        ),
    )  # fmt: skip


def _pair(
    before: Trial, ranked: Sequence[Trial], grow: Callable[[Trial], list[Trial]], single: bool
) -> Decision | None:
    """Return the decision for two effects, None where two do not explain it much better."""
    best = ranked[0]
    alone = {_new(trial, before)[0]: trial for trial in ranked}
    grown: list[Trial] = []
    for first in ranked[: 1 if single else 2]:
        if missing(before, first) and excess(first) <= (1.0 - FIRST) * excess(before):
            grown += grow(first)
    if not grown:
        return None
    pair = min(grown, key=lambda trial: trial.z)
    names = _new(pair, before)
    if not _needed(best, pair):
        return None
    without = [alone[name] for name in names if name in alone]
    parts = [(excess(other) - excess(pair)) / excess(before) for other in without]
    explained = 1.0 - excess(pair) / excess(before)
    closes = best.z > CLEAN and (
        pair.z <= COMPLETE or (pair.z <= ADEQUATE and excess(pair) <= REST * excess(best))
    )
    if min(parts, default=0.0) < PAIR_PART and not closes:
        return None
    if pair.z > ADEQUATE and explained < SHARE:
        return None
    return Decision(
        "effect", names, pair, explained,
        (
            f"No single effect explains it: the best, {_new(best, before)[0]}, leaves "
            f"z = {best.z:.2f}; {names[0]} and {names[1]} together leave {pair.z:.2f}.",
        ),
    )  # fmt: skip


def _needed(single: Trial, pair: Trial) -> bool:
    """Return whether a second effect takes a fair share of what the first one leaves."""
    return excess(pair) <= PAIR_LEFT * excess(single) and missing(single, pair)


def _effect_or_class(
    before: Trial, best: Trial, others: Sequence[Trial], explained: float
) -> Decision:
    name = _new(best, before)[0]
    rivals = [
        other
        for other in others
        if missing(before, other) and _rivals(best, other) and not _same(name, other, before)
    ]
    names = (name, *(_new(other, before)[0] for other in rivals))[:MOST]
    reasons = [
        f"With {name} the error on runs not seen falls from {before.z:.2f} to {best.z:.2f} times "
        f"the noise: {explained:.0%} of what noise does not account for."
    ]
    if best.z > ADEQUATE:
        reasons.append("A residual remains: the rig's effect has another form than ours.")
    if len(names) > 1:
        reasons.append("These data cannot tell: " + ", ".join(names) + ".")
        return Decision("class", names, best, explained, tuple(reasons))
    return Decision("effect", names, best, explained, tuple(reasons))


def _rivals(best: Trial, other: Trial) -> bool:
    if best.z > ADEQUATE:
        return excess(other) <= RIVAL * excess(best)
    if other.z / best.z - 1.0 < CLOSE:
        return True
    return other.z <= ADEQUATE and paired(other.losses, best.losses).low <= 0.0


def _same(name: str, other: Trial, before: Trial) -> bool:
    return name in FAMILY and _new(other, before)[0] in FAMILY


def _new(trial: Trial, before: Trial) -> tuple[str, ...]:
    return tuple(name for name in trial.effects if name not in before.effects)
