"""Limits of effects by the profile of the likelihood: the model is fitted again at each size.

The limits that every verdict tells let sensitivities take up what they can of an effect. Where law
or effect are far from linear that is not exact; here every parameter is fitted at the limit, and
the limit moved until the likelihood has fallen as far as 95 % ask.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ..identify.model import Model
from ..identify.residuals import residuals
from ..identify.search import loss
from ..identify.search_context import refine
from ..identify.threads import in_threads
from ..progress import Count
from .allowed_size import ONE_SIDED, TWO_SIDED
from .effect_limits import EffectLimit
from .effect_size import Known, Sized

Array = NDArray[np.float64]

NEAR = 0.1
"""Relative change of a size at which a limit is found."""

TURNS = 3
"""Sizes at most at which a model is fitted again."""

FARTHEST = 4.0
"""Factor by which a size is moved in one turn at the most."""

SWEEPS = 6
"""Jacobians of such a fit, which begins at what the runs gave without the effect."""


def profiled(known: Known, limits: Sequence[EffectLimit]) -> tuple[EffectLimit, ...]:
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


def _checked(known: Known, limit: EffectLimit) -> EffectLimit:
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


def _scatter(known: Known, change: Array) -> float:
    """Return the standard deviation of a change's (n,) product with the residual, of length one."""
    length = float(np.linalg.norm(change))
    return known.scatter(change / length) if length > 0.0 else 1.0
