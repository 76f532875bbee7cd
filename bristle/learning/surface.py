"""Which surfaces over two signals promise to explain a residual: tensor products of broken lines.

As in the scan of curves the model's parameters move along, to first order, and what decides are
stretches of the training runs that were not fitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from .curve import Curve, inside, may_change
from .normal import Hats, Normal, Residual, hats_at, products
from .rule import LEARN
from .screen import SMOOTH, Promise, distinct, knots_of, signals, smoothest
from .signals import Along

PARTS_OF_SURFACE = ("force", "friction", "yield", "viscous", "fluid")
"""Parts that a surface may change. Those in proportion to the command are special cases."""

FINE = (9, 6)
"""Knots and levels of the surface that is looked at."""

GRIDS = tuple(product((4, 6, 9, 13), (3, 4, 6, 9)))
"""Knots and levels among which that of the fit is chosen."""

ROUGH = SMOOTH[:3]
"""Weights of the penalty at which these are compared: the fit inside the model has none."""

SPARE = 1.05
"""Times the least mean squared residual that the surface with the fewest values may leave."""

RESOLVED = 4
"""Surfaces, the best ones, whose knots and levels are chosen."""

FEWEST = 3
"""Knots, and levels, at the least."""

FEW = 20
"""Samples whose shares in a knot determine its value; with fewer it continues those beside it."""

WEAK = 1e-3
"""The same as a share of what the samples tell of a knot on average."""

FLAT = 1e-2
"""Weight of first differences over that of second ones: beyond the data a surface levels off."""


_SAME = ({"velocity", "speed"}, {"acceleration", "slowing"})
"""Signals that say nearly the same."""

_LAST = ("voltage", "recent_voltage")
"""Signals that a surface has as its second one: of a command there are few levels."""


class _Pair(NamedTuple):
    """Two signals, their values (n,) at the samples, and the parameters of their memory."""

    first: Along
    second: Along
    x: Array
    y: Array
    memory: dict[str, float]


def surfaces(
    residual: Residual, parts: Sequence[str] = (), along: Sequence[str] = ()
) -> list[Promise]:
    """Return the surfaces that lower the residual of a damper where they were not fitted.

    The best first; none in a layer or a storey.

    Parameters
    ----------
    residual : of a fitted model
    parts, along : names of `PARTS` and `ALONG` that are looked at; empty for all, and then for
        signals without a time or travel of their own
    """
    if residual.place.is_line:
        return []
    known, found = Normal(residual), []
    without = known.without_curve()
    for pair in _pairs(residual, along):
        for part in (one for one in PARTS_OF_SURFACE if one in residual.parts):
            allowed = all(may_change(part, one.name) for one in (pair.first, pair.second))
            if allowed and (not parts or part in parts):
                promise = _promise(known, part, pair, FINE, SMOOTH)
                if promise is not None and promise.loss < without:
                    found.append((promise, pair))
    found.sort(key=lambda one: one[0].loss)
    best = distinct([promise for promise, _ in found], RESOLVED)
    pairs = [next(pair for one, pair in found if one is promise) for promise in best]
    resolved = [_resolved(known, *one) for one in zip(best, pairs, strict=True)]
    return sorted(resolved, key=lambda one: LEARN.weighed(one.loss, one.curve))


def _pairs(residual: Residual, names: Sequence[str]) -> Iterator[_Pair]:
    """Yield the pairs of signals that a surface may have."""
    offered = [
        one for one in signals(residual, names) if not one[0].value and (names or not one[1])
    ]
    for (one, memory, x), (other, more, y) in combinations(offered, 2):
        remember = bool(one.advance and other.advance)
        alike = one.name == other.name or {one.name, other.name} in _SAME
        if remember or alike or (one.measured and other.measured):
            continue
        if one.measured or (one.name in _LAST and not other.measured):
            one, other, x, y = other, one, y, x
        yield _Pair(one, other, x, y, {**memory, **more})


def _promise(
    known: Normal, part: str, pair: _Pair, size: tuple[int, int], weights: Sequence[float]
) -> Promise | None:
    """Return the best surface of a part over a pair of signals; None where it has too little.

    Parameters
    ----------
    known : equations of the model alone
    part, pair : of the surface
    size : knots and levels at the most
    weights : of the penalty, the best of which is taken
    """
    knots, levels = knots_of(pair.x, size[0]), knots_of(pair.y, size[1])
    if min(len(knots), len(levels)) < FEWEST:
        return None
    residual, kind = known.residual, _empty(known.residual, part, pair, knots, levels)
    hats = products(hats_at(pair.x, knots), hats_at(pair.y, levels))
    column = residual.parts[part]
    count, own = _felt(hats, residual.weight, column)
    weak = np.flatnonzero((count < FEW) | (own < WEAK * np.mean(own)))
    if len(weak) > len(own) // 2:
        return None
    zero = [int(np.argmax(own))] if kind.of.level else []
    free = [k for k in range(hats.knots) if k not in zero]
    bend = _bending(len(knots), len(levels))[np.ix_(free, free)]
    normal = known.with_curve(column, hats, free)
    smooth = smoothest(normal, known.grams.shape[1], bend, weights)
    if smooth is None:
        return None
    loss, found, _ = smooth
    values = np.zeros(hats.knots)
    values[free] = found
    held = (*zero, *(int(k) for k in weak if k not in zero))
    return Promise(replace(kind, values=inside(kind.of, values), held=held), loss)


def _empty(residual: Residual, part: str, pair: _Pair, knots: Array, levels: Array) -> Curve:
    """Return a surface without values."""
    return Curve(
        part, pair.first.name, tuple(pair.memory.items()), tuple(map(float, knots)), (),
        slow=residual.slow, top=residual.top, drive=residual.drive, at=residual.at,
        measured=pair.second.unit if pair.second.measured else "",
        across=pair.second.name, levels=tuple(map(float, levels)),
    )  # fmt: skip


def _felt(hats: Hats, weight: Array, column: Array) -> tuple[Array, Array]:
    """Return how many samples feel each knot (k,), by their shares, and how much they tell of it.

    A sample at which the part does nothing, such as a friction at rest, feels no knot.
    """
    count, own = np.zeros(hats.knots), np.zeros(hats.knots)
    for at, share in zip(hats.at.T, hats.share.T, strict=True):
        count += np.bincount(at, share * weight * (column != 0.0), hats.knots)
        own += np.bincount(at, weight * (share * column) ** 2, hats.knots)
    return count, own


def _resolved(known: Normal, promise: Promise, pair: _Pair) -> Promise:
    """Return a promise with the number of knots and levels that predicts what it has not seen."""
    part = promise.curve.part
    tried = [_promise(known, part, pair, size, ROUGH) for size in GRIDS]
    able = [one for one in tried if one is not None]
    if not able:
        return promise
    least = min(one.loss for one in able)
    near = [one for one in able if one.loss <= SPARE * least]
    return min(near, key=lambda one: (len(one.curve.values), one.loss))


def _bending(knots: int, levels: int) -> Array:
    """Return the quadratic form (k, k) of a surface's differences along both signals."""
    along, across = _differences(knots), _differences(levels)
    return np.asarray(np.kron(np.eye(levels), along) + np.kron(across, np.eye(knots)))


def _differences(count: int) -> Array:
    second, first = (np.diff(np.eye(count), order, axis=0) for order in (2, 1))
    return np.asarray(second.T @ second + FLAT * first.T @ first)


def continues(surface: Curve) -> tuple[int, ...]:
    """Return the knots (from 0) without data of a surface, whose values continue those beside."""
    return surface.held[1:] if surface.of.level else surface.held


def continued(surface: Curve) -> Curve:
    """Return a surface whose values at knots without data continue those beside them.

    They are those at which it bends least.
    """
    weak = list(continues(surface))
    if not weak:
        return surface
    values = np.array(surface.values)
    free = [k for k in range(len(values)) if k not in weak]
    bend = _bending(len(surface.knots), len(surface.levels))
    pull = -bend[np.ix_(weak, free)] @ values[free]
    values[weak] = np.linalg.solve(bend[np.ix_(weak, weak)], pull)
    return replace(surface, values=inside(surface.of, values))
