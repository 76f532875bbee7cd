"""How large each effect may still be, on runs that do not show it, and from what size it is named.

Law and known effects are refitted: what their sensitivities can absorb does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..comparison.predictions import rms
from ..core.arrays import Array
from ..identification.fit import Search
from ..identification.problem import Expected, Problem, absorbed, noise_of, steady
from ..identification.search import in_threads
from ..identification.start_grid import initial_guesses
from ..model.model import Model
from ..physics.effect import EFFECTS, effects_of
from .effect_size import Sized, SizeSearch, largest_allowed, named_size, resolved
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
    a fit. `why` says why the runs cannot show the effect; the sizes are then None.
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

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds."""
        if self.why:
            return {"effect": self.effect, "why": self.why}
        return {
            "effect": self.effect, "parameter": self.parameter, "unit": self.unit,
            "side": "above" if self.falls else "below", "limit95": self.largest,
            "share": self.share, "named_from": self.named, "named_share": self.named_share,
            "coarse": self.coarse, "others": dict(self.others), "moved": dict(self.moved),
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
    force, weight = (
        one[problem.judged] for one in (problem.force, 1.0 / noise_of(problem, expected))
    )
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
    size = rms(problem.force / noise_of(problem, expected))
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
    """Return by how much an effect changes the normalised residuals (n,), at most of its starts.

    Of those that differ in its amount alone the largest one is looked at.
    """
    amount = EFFECTS[name].amount
    key, sign = f"{name}.{amount.removeprefix('1/')}", -1.0 if amount.startswith("1/") else 1.0
    starts = initial_guesses(name, model, problem)
    starts.sort(key=lambda start: sign * abs(start.values.get(key, 0.0)))
    apart = {tuple(sorted({**start.values, key: 0.0}.items())): start for start in starts}
    found = []
    for start in apart.values():
        with_it = Search(problem, start, expected, [])
        found.append(with_it.residuals(with_it.start) - base)
    return max(found, key=rms)
