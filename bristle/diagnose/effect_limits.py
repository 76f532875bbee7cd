"""How large each effect may still be, on runs that do not show it, and from what size it is named.

Law and known effects are refitted: what their sensitivities can take up does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import sqrt
from os import cpu_count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..identify.model import steady
from ..identify.search import HUBER, loss
from ..physics.effect import EFFECTS
from .effect_size import Known, Sized
from .rule import BENCH, DecisionRule

Array = NDArray[np.float64]

ABSORBED = 1e-3
"""Share of a change that must be left; below that it is the error of the sensitivities."""

LOOK = 0.1
"""How many standard deviations a change has at which an effect is looked at first."""

TURNS = 4
"""Sizes that are tried between two that a limit lies between."""

ALIKE = 0.1
"""Relative change of a size below which it is found."""

ONE_SIDED, TWO_SIDED = 1.645, 1.96
"""Standard deviations of a 95 % limit."""

UNSHOWN = 0.05
"""What the runs that decide show of an effect at the least, over those that are fitted to."""

NINE_OF_TEN = 1.282
"""Standard deviations above the mean that 9 of 10 stay below."""

MARGIN = 1.2
"""Factor on the distance from which an effect is named: z is robust, so that large residuals count
less than their squares, and other effects take up a part. `python -m benchmarks limits --named`
counts what comes of it."""

GROWS, GROWS_ROUGH = 1.1, 1.3
"""By what factor a change must grow with twice the size to be the effect's own; of what makes the
force rough, as impacts in a joint do."""

STEP = 2.0
"""Factor by which a size is raised until it is beyond what is sought."""

NEARLY = 0.1
"""By how much a likelihood may differ, of its fall, from that of a change in proportion."""

STRAIGHT = 2
"""How often a size is sought in proportion to its change."""

AHEAD = 6
"""Sizes beyond the first one that are looked at where that one is excluded already."""

ROUGHEST = 1e-2
"""Size below which the impacts of a joint are those of the integration, over a first guess."""

SMALLEST, LARGEST = 1e-4, 1e3
"""Sizes between which an effect is looked at, over that of a first guess."""


@dataclass(frozen=True)
class EffectLimit:
    """What runs say of the size of an effect that they do not show.

    `largest` is the size of `parameter` [SI] that they still allow at 95 %, its lower limit where
    the effect vanishes as it grows (`falls`); `share` the part of the force RMS that such an effect
    leaves once law and known effects are fitted again. `named` and `named_share` are those from
    which 9 of 10 verdicts would name the effect, None beyond the parameter's bounds. `coarse`: the
    steps of the integration tell no smaller size, and shares have no meaning. `others` are the
    values of the effect's other parameters for which all this holds, and `moved` says by how much
    [SI] such an effect moves the model's own parameters in a fit. `profiled`: the model was fitted
    again at the limit. `why` says why the runs cannot show the effect; the sizes are then None.
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
    known: Known, names: Sequence[str], hidden: Sequence[str] = ()
) -> tuple[EffectLimit, ...]:
    """Return what runs allow of each effect, by name; those without an `amount` are left out.

    Parameters
    ----------
    known : the runs, the fitted model, what a true model would show
    names : of effects that can join the model
    hidden : those of them that the runs cannot show
    """
    known.basis, known.noise, known.size, known.taken  # noqa: B018  # before threads ask for them

    def found(name: str) -> EffectLimit:
        one = Sized(name, known)
        return EffectLimit(name, why=_why_hidden(one)) if name in hidden else limit_of(one)

    with ThreadPoolExecutor(cpu_count()) as pool:
        return tuple(pool.map(found, (name for name in sorted(names) if EFFECTS[name].amount)))


def limit_of(sized: Sized) -> EffectLimit:
    """Return what runs allow of one effect."""
    known, effect = sized.known, EFFECTS[sized.name]
    first = sized.change(1.0)
    kept = float(np.linalg.norm(known.beyond(first)))
    if kept <= ABSORBED * float(np.linalg.norm(first)):
        return EffectLimit(sized.name, why=_why_hidden(sized))
    least = resolved(sized, LOOK / kept)
    size = _allowed(sized, least)
    coarse = size == least
    change = sized.change(size)
    share = float(np.linalg.norm(known.beyond(change))) / known.size
    others = tuple(
        (name, sized.model.value(f"{sized.name}.{name}"))
        for name in effect.parameters
        if name != sized.parameter and sized.model.value(f"{sized.name}.{name}")
    )
    return EffectLimit(
        sized.name, sized.parameter, effect.parameters[sized.parameter].unit, sized.falls,
        sized.value(size), None if coarse else share,
        *((None, None) if coarse else _named(sized, size)), coarse, others, "",
        known.moved(change),
    )  # fmt: skip


def _why_hidden(sized: Sized) -> str:
    """Return why the runs cannot show an effect: what does not move, or what takes it up."""
    known = sized.known
    change = sized.change(1.0)
    if np.linalg.norm(change) > known.rule.silent * known.size and known.search.names:
        alike = np.abs(known.own.T @ change)
        return f"{known.search.names[int(np.argmax(alike))]} of the model takes it up"
    problem = known.problem
    held = all(steady(problem.of([run])) for run in problem.runs)
    still = held and "V" in EFFECTS[sized.name].needs
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

    first = known.beyond(sized.change(sign * least))
    if not first.any() and not sized.change(sign).any():
        return 0.0  # it has one sign alone
    straight, lowest_there = _if_linear(known, first / least, apart)
    if least < straight < LARGEST and abs(above(straight) - lowest_there - 1.0) <= NEARLY:
        return straight
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


def _if_linear(known: Known, slope: Array, apart: float) -> tuple[float, float]:
    """Return where a likelihood ends, and its best, if the change is in proportion to the size.

    Parameters
    ----------
    known : the runs
    slope : (n,) change per size
    apart : twice the fall of the logarithm of the likelihood, the unit of what is returned
    """
    near = slope[np.abs(known.plain) <= HUBER]  # beyond, the robust loss is straight
    sharp, size = float(near @ near), float(np.linalg.norm(slope))
    if sharp == 0.0:
        return LARGEST, 0.0
    unit = apart * known.scatter(slope / size) ** 2
    push = float(slope @ known.left)
    lowest = -(push**2) / sharp if push < 0.0 else 0.0
    return (-push + sqrt(push**2 + sharp * (lowest + unit))) / sharp, lowest / unit


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


def resolved(sized: Sized, size: float) -> float:
    """Return a size, raised to where the effect's change grows with it.

    Below that the steps of the integration decide: a lag of less than half a sample, a play that
    the rod crosses within one.
    """
    known, rough = sized.known, bool(EFFECTS[sized.name].joint)
    grows, smallest = (GROWS_ROUGH, ROUGHEST) if rough else (GROWS, SMALLEST)
    size = float(np.clip(size, smallest, 1.0))
    half = np.linalg.norm(known.beyond(sized.change(0.5 * size)))
    while size < 1.0:
        whole = np.linalg.norm(known.beyond(sized.change(size)))
        if whole >= grows * half:
            break
        size, half = 2.0 * size, whole
    return size


def named_distance(samples: int, held_out: int, rule: DecisionRule = BENCH) -> float:
    """Return the distance, in standard deviations, from which 9 of 10 verdicts name an effect.

    A verdict asks that z on held-out runs falls by `rule.gain`, which scatters with the noise.

    Parameters
    ----------
    samples : over which the distance is taken
    held_out : samples that decide
    rule : the numbers that decide
    """
    asked = held_out * ((1.0 + rule.gain) ** 2 - 1.0)
    whole = NINE_OF_TEN + sqrt(NINE_OF_TEN**2 + asked)
    return MARGIN * whole * sqrt(samples / held_out)


def _named(sized: Sized, least: float) -> tuple[float | None, float | None]:
    """Return the value and the share of the force from which 9 of 10 verdicts name an effect.

    Parameters
    ----------
    sized : the effect
    least : where it is looked at first
    """
    known = sized.known
    wanted = named_distance(len(known.plain), known.held_out, known.rule)
    size = _distant(sized, least, wanted)
    if size is not None and known.judging is not None:
        wanted /= max(_shown_there(sized, size), UNSHOWN)
        size = _distant(sized, size, wanted)
    return (None, None) if size is None else (sized.value(size), wanted / known.size)


def _shown_there(sized: Sized, size: float) -> float:
    """Return what a sample that decides shows of an effect, over one that is fitted to."""
    there = sized.change_there(size)
    here = sized.known.beyond(sized.change(size))
    return float(np.linalg.norm(there) / np.linalg.norm(here) * sqrt(len(here) / len(there)))


def _distant(sized: Sized, least: float, wanted: float) -> float | None:
    """Return the size at which an effect is so many standard deviations from none.

    None beyond the parameter's bounds; `least` is the size that is looked at first.
    """
    known, size = sized.known, least

    def beyond(size: float) -> float:
        return float(np.linalg.norm(known.beyond(sized.change(size)))) / wanted - 1.0

    for _ in range(STRAIGHT):  # in proportion, as a rule
        size = float(np.clip(size / (1.0 + beyond(size)), SMALLEST, LARGEST))
        off = beyond(size)
        if not sized.ended(size) and abs(off) <= ALIKE:
            return size / (1.0 + off)
    low = size = least
    while beyond(size) < 0.0:
        if sized.ended(size) or size >= LARGEST:
            return None
        low, size = size, STEP * size
    size = _crossing(beyond, low, size) if low < size else size
    return None if sized.ended(size) else size
