"""How large each effect may still be, on runs that do not show it, and from what size it is named.

Law and known effects are refitted: what their sensitivities can absorb does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..identify.model import steady
from ..identify.threads import in_threads
from ..physics.effect import EFFECTS
from .allowed_size import largest_allowed
from .effect_size import Known, Sized
from .named_size import named_size
from .resolved_size import resolved

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
    known: Known, names: Sequence[str], hidden: Sequence[str] = ()
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
        return f"{known.search.names[int(np.argmax(alike))]} of the model absorbs it"
    problem = known.problem
    held = all(steady(problem.of([run])) for run in problem.runs)
    still = held and "V" in EFFECTS[sized.name].needs
    return "the command is constant" if still else "this motion does not excite it"
