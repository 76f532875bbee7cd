"""How large each effect may still be, on runs that do not show it, and from what size it is named.

Law and known effects are refitted: what their sensitivities can absorb does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np

from ..comparison.predictions import rms
from ..core.arrays import Array
from ..core.progress import Count
from ..identification.problem import Expected, Problem, absorbed, residuals, steady
from ..identification.search import in_threads, loss
from ..identification.start_grid import Search, initial_guesses, refine
from ..model.model import Model
from ..physics.effect import EFFECTS, effects_of
from .effect_size import (
    ONE_SIDED,
    TWO_SIDED,
    Sized,
    SizeSearch,
    largest_allowed,
    named_size,
    resolved,
)
from .rule import BENCH, DecisionRule
from .trials import joinable

ABSORBED = 1e-3
"""Share of a change that must be left; below that it is the error of the sensitivities."""

NO_AMOUNT = "its class names no amount: no parameter is its size"
"""Why an effect has no limit."""

LOOK = 0.1
"""How many standard deviations a change has at which an effect is looked at first."""


@dataclass(frozen=True)
class EffectLimit:
    """What runs say of the size of an effect that they do not show.

    `largest` is the size of `parameter` [SI] that they still allow at 95 %, its lower limit where
    the effect vanishes as it grows (`falls`); `share` the part of the force RMS that such an effect
    leaves once law and known effects are fitted again. `named` and `named_share` are those from
    which 9 of 10 verdicts would name the effect, at least those that the runs still allow; None
    beyond the parameter's bounds. `coarse`: the steps of the integration tell no smaller size, and
    shares have no meaning. `others` are the values of the effect's other parameters for which all
    this holds, and `moved` says by how much [SI] such an effect moves the model's own parameters in
    a fit. `profiled`: the model was fitted again at the limit. `why` says why the runs cannot show
    the effect; the sizes are then None.
    """

    effect: str
    parameter: str = ""
    unit: str = "1"
    falls: bool = False
    largest: float | None = None
    share: float | None = None
    named: float | None = None
    named_share: float | None = None
    coarse: bool = False
    others: tuple[tuple[str, float], ...] = ()
    why: str = ""
    moved: tuple[tuple[str, float], ...] = ()
    profiled: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds."""
        if self.why:
            return {"effect": self.effect, "why": self.why}
        return {
            "effect": self.effect, "parameter": self.parameter, "unit": self.unit,
            "side": "above" if self.falls else "below", "limit95": self.largest,
            "share": self.share, "named_from": self.named, "named_share": self.named_share,
            "coarse": self.coarse, "others": dict(self.others), "moved": dict(self.moved),
            "profiled": self.profiled,
        }  # fmt: skip


def effect_limits(
    known: SizeSearch, names: Sequence[str], hidden: Sequence[str] = ()
) -> tuple[EffectLimit, ...]:
    """Return what runs allow of each effect, by name; of those without an `amount` that it lacks.

    Parameters
    ----------
    known : the runs, the fitted model, what a true model would show
    names : of effects that can join the model
    hidden : those of them that the runs cannot show
    """
    known.basis, known.noise, known.size, known.taken, known.lowest  # noqa: B018  # before threads ask for them

    def found(name: str) -> EffectLimit:
        if not EFFECTS[name].amount:
            return EffectLimit(name, why=NO_AMOUNT)
        one = Sized(name, known)
        return EffectLimit(name, why=_why_hidden(one)) if name in hidden else limit_of(one)

    return tuple(in_threads(found, sorted(names)))


def limit_of(sized: Sized) -> EffectLimit:
    """Return what runs allow of one effect."""
    known, effect = sized.known, EFFECTS[sized.name]
    first = sized.change(1.0)
    kept = float(np.linalg.norm(known.beyond(first)))
    if kept <= ABSORBED * float(np.linalg.norm(first)):
        return EffectLimit(sized.name, why=_why_hidden(sized))
    least = resolved(sized, LOOK / kept)
    size = largest_allowed(sized, least)
    coarse = size == least
    change = sized.change(size)
    share = float(np.linalg.norm(known.beyond(change))) / known.size
    others = tuple(
        (name, sized.model.value(f"{sized.name}.{name}"))
        for name in effect.parameters
        if name != sized.parameter and sized.model.value(f"{sized.name}.{name}")
    )
    return EffectLimit(
        sized.name, sized.parameter, sized.unit, sized.falls,
        sized.value(size), None if coarse else share,
        *((None, None) if coarse else named_size(sized, size)), coarse, others, "",
        known.moved(change),
    )  # fmt: skip


def _why_hidden(sized: Sized) -> str:
    """Return why the runs cannot show an effect: what does not move, or what absorbs it."""
    known = sized.known
    change = sized.change(1.0)
    if np.linalg.norm(change) > known.rule.silent * known.size and known.search.names:
        alike = np.abs(known.own.T @ change)
        return f"{known.search.names[int(np.argmax(alike))]} hides it"
    problem = known.problem
    held = all(steady(problem.of([run])) for run in problem.runs)
    still = held and "V" in EFFECTS[sized.name].needs
    return "the command is constant" if still else "this motion does not excite it"


# What these data could not show: the smallest visible share, and effects that leave no trace.


BELOW = 0.9
"""A z below this is no chance: the noise expected was too large, as of the layer of a base that has
no accelerometer, where room is left for jumps."""


def detectable(
    problem: Problem, expected: Expected, rule: DecisionRule = BENCH, z: float = 1.0
) -> float:
    """Return the smallest share of the force RMS that a missing effect must leave to be seen.

    It is what raises z by `rule.gain` over the noise expected of a true model.

    Parameters
    ----------
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`
    rule : the numbers that decide
    z : error over noise of the model; where it is below `BELOW`, the expected noise is too large
        and hides more
    """
    pairs = zip(problem.runs, expected, strict=True)
    force = np.concatenate([run.force[run.skip :][run.judged] for run in problem.runs])
    weight = np.concatenate([1.0 / one[1][run.skip :][run.judged] for run, one in pairs])
    # Noise as the residual sees it: a residual of share s has the excess s^2 mean(F^2/sigma^2).
    ratio = float(np.sqrt(np.mean(force**2) * np.mean(weight**2)))
    noise = z if z < BELOW else 1.0
    left = float(np.sqrt((1.0 + rule.gain) ** 2 - noise**2))
    return left / ratio if ratio > 0.0 else float("inf")


def untestable(
    model: Model,
    problem: Problem,
    expected: Expected,
    visible: float,
    rule: DecisionRule = BENCH,
    able: Sequence[str] | None = None,
) -> list[str]:
    """Return the effects that these runs do not excite, or that refitting the model absorbs.

    Those that a part of the law absorbs entirely, on whatever runs, are among them.

    Each effect is added at default size and scaled to `rule.typical`; what the sensitivities to the
    model's own parameters cannot absorb must reach `visible`.

    Parameters
    ----------
    model : the fitted model that effects join
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`
    visible : the detectable share of the force RMS; see `detectable`
    rule : the numbers that decide
    able : names of the effects that can join; None for those of a damper on a bench
    """
    free = model.free()
    search = Search(problem, model, expected, free)
    base = search.residuals(search.start)
    own = search.sensitivities() if free else np.zeros((len(base), 0))
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
    sigma = np.concatenate(
        [s[run.skip :] for run, (_, s, _) in zip(problem.runs, expected, strict=True)]
    )
    force = np.concatenate([run.force[run.skip :] for run in problem.runs])
    size = rms(force / sigma)
    out = []
    for name in joinable(model) if able is None else able:
        change = _change(name, model, problem, expected, base)
        raw = rms(change) / size
        left = rms(change - basis @ (basis.T @ change)) / size
        if raw < rule.silent or rule.typical * left / raw < visible:
            out.append(name)
    law = model.base_law
    taken_up = [e.name for e in effects_of("damper", law) if absorbed(e, law)]
    return sorted({*out, *(name for name in taken_up if name not in model.effects)})


def _change(name: str, model: Model, problem: Problem, expected: Expected, base: Array) -> Array:
    """Return by how much an effect changes the normalised residuals (n,), at most of its starts."""
    found = []
    for start in initial_guesses(name, model, problem):
        with_it = Search(problem, start, expected, [])
        found.append(with_it.residuals(with_it.start) - base)
    return max(found, key=rms)


# Limits of effects by the profile of the likelihood: the model is fitted again at each size.
#
# The limits that every verdict tells let sensitivities take up what they can of an effect. Where
# law
# or effect are far from linear that is not exact; here every parameter is fitted at the limit, and
# the limit moved until the likelihood has fallen as far as 95 % ask.

NEAR = 0.1
"""Relative change of a size at which a limit is found."""

TURNS = 3
"""Sizes at most at which a model is fitted again."""

FARTHEST = 4.0
"""Factor by which a size is moved in one turn at the most."""

SWEEPS = 6
"""Jacobians of such a fit, which begins at what the runs gave without the effect."""


def profiled(known: SizeSearch, limits: Sequence[EffectLimit]) -> tuple[EffectLimit, ...]:
    """Return limits with each size checked by fits; those without a size as they are.

    Parameters
    ----------
    known : the runs, the fitted model, what a true model would show
    limits : of effects, as `effect_limits` has found them
    """
    known.basis, known.noise  # noqa: B018  # made before threads ask for them
    count = Count("limit", len(limits))

    def checked(limit: EffectLimit) -> EffectLimit:
        found = limit if limit.largest is None or limit.coarse else _checked(known, limit)
        count.done(limit.effect)
        return found

    return tuple(in_threads(checked, limits))


def _checked(known: SizeSearch, limit: EffectLimit) -> EffectLimit:
    """Return a limit at which the likelihood of a model fitted there has fallen far enough.

    Of an effect that may have either sign it is the larger one of both.
    """
    sized = Sized(limit.effect, known)
    assert limit.largest is not None
    first = sized.size_of(limit.largest)
    signs = (1.0, -1.0) if sized.signed else (1.0,)
    none = _fitted(sized, sized.without())
    size = max(abs(_end(sized, none, sign * first)) for sign in signs) or first
    share = None if limit.share is None else limit.share * size / first
    moved = known.moved(sized.change(size))
    found = replace(limit, largest=sized.value(size), share=share, moved=moved, profiled=True)
    if limit.named is not None and sized.size_of(limit.named) < size:
        return replace(found, named=found.largest, named_share=share)
    return found


def _end(sized: Sized, none: Array, size: float) -> float:
    """Return the size at which a likelihood has fallen so far below its best, on one side of none.

    Twice its logarithm is a parabola over the size, through none of the effect, half the size and
    the size; its end is the next size.

    Parameters
    ----------
    sized : the effect
    none : (n,) residuals without it
    size : looked at first, negative for the other sign
    """
    apart = (TWO_SIDED if sized.signed else ONE_SIDED) ** 2
    size = sized.size_of(sized.value(size))  # bounds may differ from side to side
    for _ in range(TURNS):
        half, whole = (
            _fitted(sized, sized.with_value(sized.value(part * size))) for part in (0.5, 1.0)
        )
        if np.array_equal(whole, none):
            return 0.0  # it has one sign alone
        asked = apart * _scatter(sized.known, whole - none) ** 2
        rises = [2.0 * float(np.sum(loss(left) - loss(none))) for left in (half, whole)]
        bend = 2.0 * (rises[1] - 2.0 * rises[0])
        slope = rises[1] - bend
        if bend <= 0.0:
            break  # no parabola: impacts decide
        # Where the likelihood falls from none on, none is the best of this side.
        fallen = 4.0 * bend * asked + max(slope, 0.0) ** 2
        end = (sqrt(fallen) - slope) / (2.0 * bend)
        if abs(end - 1.0) <= NEAR or sized.ended(size * end):
            break
        size *= float(np.clip(end, 1.0 / FARTHEST, FARTHEST))
    return size


def _fitted(sized: Sized, model: Model) -> Array:
    """Return the residuals (n,) of a model fitted with the effect as it stands there."""
    known = sized.known
    own = tuple(name for name in model.free() if name.startswith(f"{sized.name}."))
    fitted = refine(replace(model, fixed=(*model.fixed, *own)), known.problem, SWEEPS)
    left: Array = known.counts * residuals(known.problem, fitted, known.expected)
    return left


def _scatter(known: SizeSearch, change: Array) -> float:
    """Return the standard deviation of a change's (n,) product with the residual, of length one."""
    length = float(np.linalg.norm(change))
    return known.scatter(change / length) if length > 0.0 else 1.0
