"""How large each effect may still be, on runs that do not show it, and from what size it is named.

Law and known effects are refitted: what their sensitivities can take up does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..data.command_limits import jumps
from ..identify.model import Model, Problem, steady
from ..identify.residuals import Expected, residuals
from ..identify.search import loss
from ..identify.search_context import Search
from ..identify.start_grid import initial_guesses
from ..physics.effect import EFFECTS
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

CLIP = 2.0
"""Normalised residuals beyond this count as this, as in a fit."""

ABSORBED = 1e-3
"""Share of a change that must be left; below that it is the error of the sensitivities."""

LOOK = 0.1
"""How many standard deviations a change has at which an effect is looked at first."""

TURNS = 6
"""Sizes that are tried between two that a limit lies between."""

ALIKE = 0.05
"""Relative change of a size below which it is found."""

ONE_SIDED, TWO_SIDED = 1.645, 1.96
"""Standard deviations of a 95 % limit."""

NINE_OF_TEN = 1.282
"""Standard deviations above the mean that 9 of 10 stay below."""

GROWS, GROWS_ROUGH = 1.1, 1.3
"""By what factor a change must grow with twice the size to be the effect's own; of what makes the
force rough, as impacts in a joint do."""

STEP = 2.0
"""Factor by which a size is raised until it is beyond what is sought."""

AHEAD = 6
"""Sizes beyond the first one that are looked at where that one is excluded already."""

SMALLEST, LARGEST = 1e-4, 1e3
"""Sizes between which an effect is looked at, over that of a first guess."""

BLOCK = 250
"""Samples, longer than a residual's correlation."""


@dataclass(frozen=True)
class EffectLimit:
    """What runs say of the size of an effect that they do not show.

    `largest` is the size of `parameter` [SI] that they still allow at 95 %, its lower limit where
    the effect vanishes as it grows (`falls`); `share` the part of the force RMS that such an effect
    leaves once law and known effects are fitted again. `named` and `named_share` are those from
    which 9 of 10 verdicts would name the effect, None beyond the parameter's bounds. `coarse`: the
    steps of the integration tell no smaller size, and shares have no meaning. `others` are the
    values of the effect's other parameters for which all this holds. `why` says why the runs cannot
    show the effect; the sizes are then None.
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

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds."""
        if self.why:
            return {"effect": self.effect, "why": self.why}
        return {
            "effect": self.effect, "parameter": self.parameter, "unit": self.unit,
            "side": "above" if self.falls else "below", "limit95": self.largest,
            "share": self.share, "named_from": self.named, "named_share": self.named_share,
            "coarse": self.coarse, "others": dict(self.others),
        }  # fmt: skip


@dataclass(frozen=True)
class Known:
    """What all limits of some runs are found with: the model's residuals and sensitivities.

    `names` of the model's free parameters; `held_out` how many samples decide a verdict.
    """

    problem: Problem
    model: Model
    expected: Expected
    held_out: int
    rule: DecisionRule = BENCH

    @cached_property
    def search(self) -> Search:
        """The model with its free parameters."""
        return Search(self.problem, self.model, self.expected, self.model.free())

    @cached_property
    def left(self) -> Array:
        """The normalised residuals (n,) of the model, those far out clipped."""
        return np.clip(self.plain, -CLIP, CLIP)

    @cached_property
    def counts(self) -> Array:
        """1 for each sample (n,), 0 where the command jumps: no clock says on which side it is."""
        parts = [~jumps(run.V)[run.skip :] for run in self.problem.runs]
        return np.concatenate(parts).astype(float)

    @cached_property
    def plain(self) -> Array:
        """The normalised residuals (n,) of the model as they are, of the samples that count."""
        return self.counts * self.search.residuals(self.search.start)

    @cached_property
    def own(self) -> Array:
        """What the model's own parameters change (n, p), each column of length one."""
        if not self.search.names:
            return np.zeros((len(self.plain), 0))
        columns: Array = self.counts[:, None] * self.search.sensitivities()
        columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        return columns

    @cached_property
    def basis(self) -> Array:
        """Orthonormal columns (n, p) that span what the model's own parameters change."""
        return np.linalg.qr(self.own)[0]

    @cached_property
    def noise(self) -> tuple[Array, Array]:
        """The force's own noise (n,) and draws (d, n) of the motion's, as residuals have them."""
        pairs = list(zip(self.problem.runs, self.expected, strict=True))
        own = np.concatenate([run.noise / e[1][run.skip :] for run, e in pairs])
        count = min(len(e[2]) for _, e in pairs)
        drawn = [
            np.concatenate([e[2][d][run.skip :] / e[1][run.skip :] for run, e in pairs])
            for d in range(count)
        ]
        return self.counts * own, self.counts * np.array(drawn).reshape(count, len(own))

    @cached_property
    def size(self) -> float:
        """The norm of the normalised force."""
        parts = [
            (run.force / e[1])[run.skip :]
            for run, e in zip(self.problem.runs, self.expected, strict=True)
        ]
        return float(np.linalg.norm(np.concatenate(parts)))

    def beyond(self, change: Array) -> Array:
        """Return what of a change (n,) the model's own parameters do not take up."""
        kept: Array = change - self.basis @ (self.basis.T @ change)
        return kept

    def scatter(self, direction: Array) -> float:
        """Return the standard deviation of a direction's (n,) product with the residual."""
        if float(np.mean(np.minimum(self.plain**2, CLIP**2))) > self.rule.misfit**2:
            sums = np.add.reduceat(direction * self.left, np.arange(0, len(direction), BLOCK))
            return float(np.linalg.norm(sums))
        own, drawn = self.noise
        moved = np.clip(drawn, -CLIP, CLIP) @ direction
        more = float(np.var(moved, ddof=1)) if len(moved) > 1 else 0.0
        return sqrt(float(np.sum((direction * own) ** 2)) + more)


class Sized:
    """An effect in a model with one number for its size: 1 is that of a first guess, 0 is none."""

    def __init__(self, name: str, known: Known) -> None:
        effect, self.known = EFFECTS[name], known
        self.name, self.parameter = name, effect.amount.removeprefix("1/")
        self.falls = effect.amount.startswith("1/")
        self.key = f"{name}.{self.parameter}"
        self.model = _first_guess(name, known.model, known.problem)
        self.one = self.model.value(self.key)
        self.low, self.high = self.model.bounds(self.key)
        self.signed = self.low < 0.0 and not self.falls
        at_zero = not self.falls and self.low <= 0.0
        self._without = self._counted(self._with(0.0)) if at_zero else known.plain

    def value(self, size: float) -> float:
        """Return the parameter's value [SI] at a size, within its bounds."""
        return float(np.clip(self._wanted(size), self.low, self.high))

    def change(self, size: float) -> Array:
        """Return by how much the effect changes the normalised residuals (n,) at a size."""
        return self._counted(self._with(self.value(size))) - self._without

    def _counted(self, model: Model) -> Array:
        known = self.known
        return known.counts * residuals(known.problem, model, known.expected)

    def ended(self, size: float) -> bool:
        """Return whether a bound keeps the parameter from a size."""
        return not self.low <= self._wanted(size) <= self.high

    def _wanted(self, size: float) -> float:
        return self.one / size if self.falls else self.one * size

    def _with(self, value: float) -> Model:
        return replace(self.model, values={**self.model.values, self.key: value})


def effect_limits(
    known: Known, names: Sequence[str], hidden: Sequence[str] = ()
) -> tuple[EffectLimit, ...]:
    """Return what runs allow of each effect, by name; those without an `amount` are left out.

    Parameters
    ----------
    known : the runs, the fitted model, what a true model would show
    names : of effects that can join the model
    hidden : those of them that the runs cannot show
    """
    sizes = (Sized(name, known) for name in sorted(names) if EFFECTS[name].amount)
    return tuple(
        EffectLimit(one.name, why=_why_hidden(one)) if one.name in hidden else limit_of(one)
        for one in sizes
    )


def limit_of(sized: Sized) -> EffectLimit:
    """Return what runs allow of one effect."""
    known, effect = sized.known, EFFECTS[sized.name]
    first = sized.change(1.0)
    kept = float(np.linalg.norm(known.beyond(first)))
    if kept <= ABSORBED * float(np.linalg.norm(first)):
        return EffectLimit(sized.name, why=_why_hidden(sized))
    least = _resolved(sized, LOOK / kept)
    size = _allowed(sized, least)
    coarse = size == least
    share = float(np.linalg.norm(known.beyond(sized.change(size)))) / known.size
    others = tuple(
        (name, sized.model.value(f"{sized.name}.{name}"))
        for name in effect.parameters
        if name != sized.parameter and sized.model.value(f"{sized.name}.{name}")
    )
    return EffectLimit(
        sized.name, sized.parameter, effect.parameters[sized.parameter].unit, sized.falls,
        sized.value(size), None if coarse else share,
        *((None, None) if coarse else _named(sized, size)), coarse, others,
    )  # fmt: skip


def _why_hidden(sized: Sized) -> str:
    """Return why the runs cannot show an effect: what does not move, or what takes it up."""
    known = sized.known
    change = sized.change(1.0)
    if np.linalg.norm(change) > known.rule.silent * known.size and known.search.names:
        alike = np.abs(known.own.T @ change)
        return f"{known.search.names[int(np.argmax(alike))]} of the model takes it up"
    still = steady(known.problem) and "V" in EFFECTS[sized.name].needs
    return "the command does not move" if still else "this motion does not excite it"


def _allowed(sized: Sized, least: float) -> float:
    """Return the largest size that the runs allow at 95 %: the profile of the likelihood over it.

    Parameters
    ----------
    sized : the effect
    least : where it is looked at first, resolved
    """
    apart = (TWO_SIDED if sized.signed else ONE_SIDED) ** 2
    return max(
        _end(sized, least, sign, apart) for sign in ((1.0, -1.0) if sized.signed else (1.0,))
    )


def _end(sized: Sized, least: float, sign: float, apart: float) -> float:
    """Return the size at which a likelihood has fallen so far below its best.

    Parameters
    ----------
    sized, least : the effect, and the size at which it is looked at first
    sign : of the effect
    apart : twice the fall of the logarithm of the likelihood
    """
    known, lowest = sized.known, 0.0

    def above(size: float) -> float:
        """Return twice the logarithm of the likelihood, over `apart`, with its sign turned."""
        change = known.beyond(sized.change(sign * size))
        length = float(np.linalg.norm(change))
        if length == 0.0:
            return 0.0
        rise = 2.0 * float(np.sum(loss(known.plain + change) - loss(known.plain)))
        return rise / (apart * known.scatter(change / length) ** 2)

    if not sized.change(sign).any():
        return 0.0  # it has one sign alone
    size = low = least
    found = above(least)
    if found >= 1.0:  # a rough likelihood may fall again
        ahead = [least * STEP**k for k in range(1, AHEAD + 1)]
        beyond = [above(one) for one in ahead]
        best = int(np.argmin(beyond))
        if beyond[best] < lowest:
            size, found = ahead[best], beyond[best]
    while found < lowest + 1.0:
        if size >= LARGEST:
            return LARGEST
        lowest, low, size = min(lowest, found), size, min(STEP * size, LARGEST)
        found = above(size)
    if low == size:
        return least
    return _crossing(lambda at: above(at) - lowest - 1.0, low, size)


def _crossing(rising: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function between two sizes is zero: regula falsi (Illinois) in logarithms."""
    at_low, at_high = rising(low), rising(high)
    for _ in range(TURNS):
        share = -at_low / (at_high - at_low) if at_high > at_low else 0.5
        size = low * (high / low) ** min(max(share, 0.05), 0.95)
        at = rising(size)
        if at < 0.0:
            low, at_low, at_high = size, at, 0.5 * at_high
        else:
            high, at_high, at_low = size, at, 0.5 * at_low
        if high / low <= 1.0 + ALIKE:
            break
    return high


def _resolved(sized: Sized, size: float) -> float:
    """Return a size, raised to where the effect's change grows with it.

    Below that the steps of the integration decide: a lag of less than half a sample, a play that
    the rod crosses within one.
    """
    known, size = sized.known, float(np.clip(size, SMALLEST, 1.0))
    grows = GROWS_ROUGH if EFFECTS[sized.name].joint else GROWS
    half = np.linalg.norm(known.beyond(sized.change(0.5 * size)))
    while size < 1.0:
        whole = np.linalg.norm(known.beyond(sized.change(size)))
        if whole >= grows * half:
            break
        size, half = 2.0 * size, whole
    return size


def _named(sized: Sized, size: float) -> tuple[float | None, float | None]:
    """Return the value and the share of the force from which 9 of 10 verdicts name an effect.

    A verdict asks that z on held-out runs falls by `rule.gain`, which scatters with the noise.

    Parameters
    ----------
    sized : the effect
    size : where it is looked at first
    """
    known = sized.known
    asked = known.held_out * ((1.0 + known.rule.gain) ** 2 - 1.0)
    wanted = NINE_OF_TEN + sqrt(NINE_OF_TEN**2 + asked)
    wanted *= sqrt(len(known.plain) / known.held_out)

    def beyond(size: float) -> float:
        return float(np.linalg.norm(known.beyond(sized.change(size)))) / wanted - 1.0

    low = size
    while beyond(size) < 0.0:
        if sized.ended(size) or size >= LARGEST:
            return None, None
        low, size = size, STEP * size
    size = _crossing(beyond, low, size) if low < size else size
    return (None, None) if sized.ended(size) else (sized.value(size), wanted / known.size)


def _first_guess(name: str, model: Model, problem: Problem) -> Model:
    """Return a model with an effect at its default shape, scaled to the rig."""
    guess, effect = initial_guesses(name, model, problem)[0], EFFECTS[name]
    if effect.start_shares:
        return guess
    scaled = {
        f"{name}.{own}": problem.scaled(model.law, f"{name}.{own}") for own in effect.parameters
    }
    return replace(guess, values={**guess.values, **model.values, **scaled})
