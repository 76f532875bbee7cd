"""Each effect tried inside the model: refitted on training runs, judged on held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Protocol

import numpy as np

from ..core.arrays import Array
from ..core.progress import Count
from ..identification.error import ForceError, judged_errors
from ..identification.fit import Search, is_rough, refine
from ..identification.problem import (
    EXPLAINS,
    Expected,
    Problem,
    excess_of,
    in_noises,
    noise_of,
    residuals,
)
from ..identification.search import (
    HUBER_AT_ONE,
    in_threads,
    loss,
    losses,
    mean_loss,
    z_of,
    z_scale,
)
from ..identification.start_grid import (
    Candidate,
    Scored,
    ScreeningData,
    SearchContext,
    ranked_guesses,
    scored_guesses,
)
from ..model.model import Model
from ..physics.effect import CLOSURE, EFFECTS, effects_of, exclude
from .rule import BENCH

SCORED, ABLE = 0.04, 4
"""Share of the best score from which on an effect is screened from all its starts, and how many are
whatever they score; the others begin at their best start. None is that scores so little beside what
a verdict asks for: that is chance."""

SCREENING = 3
"""Jacobians of the search that decides which effects could win, from the best start of each."""

POSSIBLE = 0.15
"""Share of the best gain then below which an effect is not searched further: `PROMISING` at the end
is more than twice as much."""

QUICK = 8
"""Jacobians of the first, short search from each start."""

ROUGH = 24
"""The same where impacts make the way rough."""

OUTSET, CARRIED = 4, 2
"""Jacobians from each of several starts, and how many of them go on."""

LONG = 20
"""Jacobians of the second search, of those that promise enough."""

SECONDS = 4
"""How many effects are searched as the second one of a pair."""

WORTH = 0.005
"""Share of the loss that a candidate must gain at least to be refined."""

FEW = 0.005
"""Share of the samples that may hold nearly all of a plain error: at a reversal dry friction is on
the wrong side at once."""

SHOWN = ("force",)
"""Channels whose instrument's effects are tried where nothing else is known of them."""

PROMISING = 0.4
"""Share of the best gain on the training runs below which a candidate is not refined."""


@dataclass(frozen=True)
class Trial:
    """A model tried: fitted on the training runs, judged on the held-out ones.

    `train`, `z` the robust RMS of residual over expected noise there; `losses` (n,) the robust loss
    per held-out sample, by the weights of the fit; `residual` (n,) the residuals over the noise;
    `rms` [N] the error over the samples that decide: where a law of dry friction is at rest its
    force may be any, and no effect is judged by that; `rms_bulk` [N] that of all but the `FEW`
    worst, NaN where nobody asked. `error` is that over all samples, None where nobody asked.
    `refined` is False where the first, short search already showed that it gains too little.
    """

    model: Model
    train: float
    z: float
    rms: float
    losses: Array
    residual: Array
    refined: bool = True
    error: ForceError | None = None
    rms_bulk: float = float("nan")

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects of the model."""
        return self.model.effects

    def beyond(self, before: Trial) -> tuple[str, ...]:
        """Return the effects that the model has and that of another trial has not."""
        return tuple(name for name in self.effects if name not in before.effects)


@dataclass(frozen=True)
class End:
    """Where a fit ended, as it is kept; see `Trial`."""

    model: Model
    refined: bool


BESIDE = " + one more"
"""Behind a law, with its effects, of which one effect more was tried; see `KeptFits`."""


class KeptFits(Protocol):
    """Where a search for the law keeps its fits, and takes up those of one that was interrupted.

    They are of a law, straight and bent, or of one effect more beside a law: see `BESIDE`.
    """

    def found(self, of: str) -> Sequence[End]:
        """Return the fits that are kept, none if they are new."""

    def keep(self, of: str, ends: Sequence[End | Trial]) -> None:
        """Keep fits."""

    def stands(self, law: str, effects: Sequence[str], z: float) -> None:
        """Take note of what comes nearest so far, and its z on held-out runs."""


def judge(
    model: Model, train: Problem, held_out: Problem, noise: tuple[Expected, Expected] | None = None
) -> Trial:
    """Return how a fitted model does on the runs that it was fitted to and on the others.

    Parameters
    ----------
    model : the model as fitted
    train, held_out : runs that it was fitted to, and those that decide
    noise : what a true model would show on `train` and on `held_out`, where it is not worth drawing
        for this model; None draws it
    """
    fitted, expected = noise or (train.expectation(model), held_out.expectation(model))
    r = residuals(held_out, model, expected)
    z = in_noises(held_out, r, expected)
    own = in_noises(train, residuals(train, model, fitted), fitted)
    decides, told = judged_errors(held_out, model, expected)
    return Trial(
        model, z_scale(own), z_of(mean_loss(losses(z))), decides.rms, losses(r), z, noise is None,
        told, _rms_bulk(held_out, r, expected),
    )  # fmt: skip


def _rms_bulk(problem: Problem, r: Array, expected: Expected) -> float:
    """Return the RMS [N] of an error, normalised (n,), but for its `FEW` worst samples.

    NaN where no sample is judged.
    """
    size = np.sort(np.abs(r * noise_of(problem, expected))[r != 0.0])
    kept = size[: len(size) - round(FEW * len(size))]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else np.nan


def missed_by(trial: Trial, train: Problem) -> float:
    """Return the variance [N2] beside the noise that a trial's model misses, 0 where little."""
    return excess_of(train, trial.model) if trial.train > EXPLAINS else 0.0


def joinable(
    base: Model, shown: Sequence[str] = SHOWN, problem: Problem | None = None
) -> list[str]:
    """Return the effects that can join a damper's model, the slow ones first.

    Parameters
    ----------
    base : the model that they join
    shown : the channels whose instruments no redundancy of the channels has judged already
    problem : the damper's runs, which say what is offered; None for those of a test bench
    """
    instruments = [effect.name for effect in effects_of("sensor") if effect.shows in shown]
    names = [
        name
        for name in (*(problem or Problem([])).damper_effects(base.law), *instruments)
        if name not in base.effects and not any(exclude(name, one) for one in base.effects)
        if EFFECTS[name].changes.rpartition(".")[0] in ("", *base.effects)
        if EFFECTS[name].kind != CLOSURE  # no effect of physics, which alone a verdict names
    ]
    return sorted(names, key=lambda name: not EFFECTS[name].joint)


def guesses_of(names: Sequence[str], context: SearchContext) -> dict[str, list[Candidate]]:
    """Return the starts of effects, the best first, looked at the more the better they score."""
    found = in_threads(lambda name: scored_guesses(name, context), names)
    scores = dict(zip(names, found, strict=True))
    ranked = sorted((one.score for one in found), reverse=True)
    least = min(SCORED * ranked[0], ranked[min(ABLE, len(ranked)) - 1]) if ranked else 0.0
    least = max(least, SCORED * (1.0 - (1.0 - BENCH.gain) ** 2))

    def look(name: str) -> list[Candidate]:
        if scores[name].score < least:
            return ranked_guesses(name, context, scores[name], 1)
        return screened(name, context, scores[name])

    return dict(zip(names, in_threads(look, names), strict=True))


def promised(first: Trial, train: Problem, shown: Sequence[str]) -> float:
    """Return the z that one effect more may leave, as the score test tells it.

    Parameters
    ----------
    first : the trial of the model that it joins
    train, shown : as in `try_all`
    """
    context = SearchContext(first.model, train)
    names = joinable(first.model, shown, train)
    scores = in_threads(lambda name: scored_guesses(name, context).score, names)
    return first.z * sqrt(max(0.0, 1.0 - max(scores, default=0.0)))


def screened(effect: str, context: SearchContext, scored: Scored) -> list[Candidate]:
    """Return the starts of an effect; a very short search has begun at the best, which is first.

    One step is not enough where the present model's parameters hold each other: a fall with speed
    that went to its bound moves only together with what is to take its place.
    """
    first, *others = ranked_guesses(effect, context, scored)
    return [_searched(first, context.screening(effect), SCREENING), *others]


def _searched(start: Candidate, data: ScreeningData, sweeps: int) -> Candidate:
    """Return where a search from a start comes to: no further where one has ended there."""
    if start.settled:
        return start
    search = Search(data.problem, start.model, data.expected, start.model.free())
    model, ended = search.run(sweeps)
    return Candidate(model, ended.cost, settled=ended.sweeps < sweeps)


def short_search(
    effect: str, context: SearchContext, guesses: Sequence[Candidate], fewer: bool = False
) -> Candidate:
    """Search shortly from the best starts; return the best of the ends.

    Its loss is that on the training runs.

    All parameters move at once: with the law's held, an effect that the law has absorbed vanishes.
    The first step says little of a start, least where impacts make the way rough: of many all go a
    short way, and those that came farthest go on.

    Parameters
    ----------
    effect : name of the effect that joins
    context : the model that it joins, on its training runs
    guesses : starts of the search, the best first
    fewer : whether to go from half as many starts
    """
    data = context.screening(effect)
    rough = is_rough(guesses[0].model)
    some = [*guesses[: max(1, data.kept // 2) if fewer else data.kept]]
    if rough or len(some) > CARRIED:
        some = sorted((_searched(one, data, OUTSET) for one in some), key=lambda one: one.cost)
        some = some[: 1 if fewer else CARRIED]
    found = [_searched(one, data, ROUGH if rough else QUICK) for one in some]
    best = min(found, key=lambda one: one.cost).model
    return Candidate(best, mean_loss(loss(residuals(context.train, best, context.expected))))


def try_all(
    base: Model,
    train: Problem,
    held_out: Problem,
    shown: Sequence[str] = SHOWN,
    most: int | None = None,
) -> list[Trial]:
    """Try every effect that can join the model, on all cores; best on the held-out runs first.

    A score test and a very short search show which effects could win. These are searched shortly
    from their best starts, those with a joint that hardly could from one; those that gain a fair
    share of what the best one gains on the training runs are refined, where that is enough for a
    verdict.

    Parameters
    ----------
    base : the fitted model that effects join
    train, held_out : runs to fit to, and those that decide
    shown : channels whose instruments' effects are tried as well
    most : how many effects are searched, from fewer starts, the others left out: for a second
        effect; None for all
    """
    context = SearchContext(base, train)
    there = held_out.expectation(base)
    names = joinable(base, shown, train)
    guesses = guesses_of(names, context)
    first = {
        name: 1.0 - own[0].cost / (context.screening(name).cost or 1.0)
        for name, own in guesses.items()
    }
    # What takes less of the excess neither explains it nor is the first of two that do.
    asked = BENCH.first * max(0.0, 1.0 - HUBER_AT_ONE / context.cost) if context.cost else 0.0
    fair = max(*first.values(), asked)
    enough = max(POSSIBLE * fair, POSSIBLE * WORTH / PROMISING)
    able = sorted(names, key=lambda name: -first[name])[:most]
    able = [name for name in able if first[name] >= enough] or able[:1]
    ends: dict[str, float] = {}
    count = Count("effect", len(able))

    def look(name: str) -> Candidate:
        slight = first[name] < PROMISING * fair and is_rough(guesses[name][0].model)
        own = guesses[name][: 1 if slight else None]
        end = short_search(name, context, own, most is not None)
        ends[name] = end.cost
        share = 100.0 * end.cost / context.cost if context.cost > 0.0 else 100.0
        best = min(dict(ends), key=lambda one: ends[one])
        count.done(name, f"{share:.3g} % of the cost remains; best so far {best}")
        return end

    found = in_threads(look, able)
    gained = max(context.cost - one.cost for one in found)
    least = max(PROMISING * gained, PROMISING * asked * context.cost, WORTH * context.cost)
    promising = [one.model for one in found if context.cost - one.cost >= least]
    rest = [one.model for one in found if context.cost - one.cost < least]
    if most is None:
        rest += [guesses[name][0].model for name in names if name not in able]
    refined = Count("refining effect", len(promising))

    def finish(model: Model) -> Trial:
        trial = judge(refine(model, train, LONG), train, held_out)
        refined.done(model.effects[-1], f"z {trial.z:.3g} on held-out runs")
        return trial

    noise = context.expected, there
    trials = in_threads(finish, promising)
    trials += in_threads(lambda model: judge(model, train, held_out, noise), rest)
    return sorted(trials, key=lambda trial: trial.z)


def try_members(pair: Trial, base: Model, train: Problem, held_out: Problem) -> list[Trial]:
    """Try each new effect of a model alone, its search begun from the values found together.

    Parameters
    ----------
    pair : the trial of the model with all new effects
    base : the model without them
    train, held_out : runs to fit to, and those that decide
    """
    new = [name for name in pair.effects if name not in base.effects]

    def alone(name: str) -> Trial:
        others = [one for one in new if one != name]
        kept = tuple(e for e in pair.effects if e not in others)
        values = {
            key: value
            for key, value in pair.model.values.items()
            if key.partition(".")[0] not in others
        }
        begin = replace(pair.model, effects=kept, values=values)
        return judge(refine(begin, train, 2 * LONG), train, held_out)

    return in_threads(alone, new)


# Significance that accounts for correlation: blocks, not samples, are what is independent.

BLOCK = 250
"""Samples per block, longer than the residuals' correlation."""


DRAWS = 400
"""Resamplings of the blocks."""


def parts_of(losses: Array) -> list[Array]:
    """Return losses (n,) in blocks of about `BLOCK` samples, four at least."""
    return np.array_split(losses, max(4, len(losses) // BLOCK))


def paired(first: Array, second: Array, chance: float = BENCH.chance) -> float:
    """Return the lower end of the interval of the mean of first - second, by block bootstrap.

    Parameters
    ----------
    first, second : (n,) losses of two models on the same samples
    chance : probability left outside the interval, half on either side
    """
    blocks = np.array([part.mean() for part in parts_of(first - second)])
    picks = np.random.default_rng(0).integers(0, len(blocks), (DRAWS, len(blocks)))
    means = blocks[picks].mean(axis=1)
    return float(np.quantile(means, 0.5 * chance))
