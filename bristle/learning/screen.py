"""Which curves promise to explain a residual: penalised splines, linear in the model as it is.

The law's parameters move along, to first order, and the smoothness of a curve is what predicts
stretches of the training runs that it was not fitted to.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..core.arrays import Array
from .curve import Curve, inside, may_change
from .normal import Hats, Normal, Residual, hats_at
from .rule import LEARN
from .signals import (
    ALONG,
    GIVEN,
    RING,
    SHARES,
    SLIP,
    Along,
    frequencies,
    measured_signals,
    ringing,
    signal_of,
)

# What a curve promises before it is fitted inside a model, and which promises differ.


@dataclass(frozen=True)
class Promise:
    """A curve with what it promises: `loss` the mean squared residual where it was not fitted."""

    curve: Curve
    loss: float


def distinct(found: Sequence[Promise], count: int, near: float = LEARN.near) -> list[Promise]:
    """Return the best promises of different parts and signals, those near the best one alone.

    A curve that contains a better one of the same part is left out.

    Parameters
    ----------
    found : the best first
    count : how many at most
    near : times the loss of the best one
    """
    first: dict[tuple[str, str, str], Promise] = {}
    for one in found:
        special = (one.curve.part, one.curve.signal.contains, "")
        if one.loss <= near * found[0].loss and special not in first:
            first.setdefault(one.curve.kind, one)
    return list(first.values())[:count]


# Which mode of what holds the load cell promises to explain a residual.

DAMPINGS = (0.01, 0.03, 0.1)
"""Damping ratios at which the scan looks."""

MODE_STEPS = (1.06, 1.02, 1.005)
"""Factors by which the frequency is changed afterwards, one after the other."""

WIDER = (0.6, 1.0, 1.6)
"""Factors by which the damping ratio is changed with it."""


def best_mode(known: Normal) -> Promise | None:
    """Return the mode of what holds the load cell that promises most; None where none does."""
    residual = known.residual
    if not residual.shown:
        return None
    nodes = product(
        map(float, frequencies(residual.coarsest_step, residual.shortest_length)), DAMPINGS
    )
    found = [one for one in (_rings_at(known, *node) for node in nodes) if one is not None]
    if not found:
        return None
    best = min(found, key=lambda one: one.loss)
    for step in MODE_STEPS:
        for factor, damping in product((1.0 / step, 1.0, step), WIDER):
            at = dict(best.curve.memory)
            tried = _rings_at(known, at["frequency"] * factor, at["damping"] * damping)
            if tried is not None and tried.loss < best.loss:
                best = tried
    return best


def _rings_at(known: Normal, frequency: float, damping: float) -> Promise | None:
    """Return a mode with the share that fits best; None where that is none."""
    residual = known.residual
    column = np.concatenate(
        [
            ringing(force, run.dt, frequency, damping)[keep]
            for force, run, keep in zip(residual.shown, residual.runs, residual.keeps, strict=True)
        ]
    )
    normal = known.with_columns((column / residual.sigma)[:, None])
    none = np.zeros_like(normal.grams[0])
    gram, side = normal.grams.sum(axis=0) + normal.ridge(), normal.sides.sum(axis=0)
    share = float(np.linalg.solve(gram, side)[-1])
    if not 0.0 < share < 1.0:
        return None
    memory = (("frequency", frequency), ("damping", damping))
    curve = Curve(RING, RING, memory, (0.0,), (share,), drive=residual.drive)
    return Promise(curve, normal.left_out(none))


FINE = 13
"""Knots of the spline that is looked at."""

RIPPLED = 65
"""The same along displacement, where a force may ripple: some 20 periods in the stroke."""

MANY = {"displacement": RIPPLED, "stroke": 2 * RIPPLED - 1}
"""Knots of the spline that is looked at, along signals that need more than `FINE`."""

SMOOTH = tuple(10.0**k for k in range(-6, 5))
"""Weights of the second differences that are tried, in terms of the curve's own information."""

FEWEST = 4
"""Knots of a curve at the least."""

APART = 0.03
"""Share of a signal's range without a sample that parts two levels."""

NARROW = 0.25
"""Share of a signal's range that its levels cover at the most, noise included."""

NEAR_REST = 0.5
"""Displacement, or velocity, over its RMS up to which a line's slope counts as that near rest."""

TUNED = 4
"""Curves along a memory, the best ones, whose times and travels are sought between the grid's."""

STEPS = (2.0, 1.4, 1.2)
"""Factors by which such a time or travel is changed, one after the other."""


def promises(
    residual: Residual, parts: Sequence[str] = (), along: Sequence[str] = ()
) -> list[Promise]:
    """Return the curves that lower the residual where they were not fitted, the best first.

    Parameters
    ----------
    residual : of a fitted model
    parts, along : names of `PARTS` and `ALONG` that are looked at; empty for all
    """
    known = Normal(residual)
    found = []
    for signal, memory, values in signals(residual, along):
        spline = _spline(signal, values, residual.place.is_line)
        for part in residual.parts:
            asked = not parts or part in parts
            if spline is not None and asked and may_change(part, signal.name, residual.place):
                found.append(_promise(known, part, (signal, memory), spline, values))
    if SLIP in (parts or (SLIP,)) and SLIP in (along or (SLIP,)):
        found.append(_slipping(known))
    if RING in (parts or (RING,)) and RING in (along or (RING,)):
        found.append(best_mode(known))
    without = known.without_curve()
    kept = sorted((p for p in found if p is not None and p.loss < without), key=lambda p: p.loss)
    remembering = [
        one
        for one in distinct(kept, len(kept), np.inf)
        if set(dict(one.curve.memory)).difference(GIVEN) and one.curve.part != RING
    ][:TUNED]
    kept += [_tuned(known, one) for one in remembering]
    return sorted(kept, key=lambda one: LEARN.weighed(one.loss, one.curve))


def _tuned(known: Normal, one: Promise) -> Promise:
    """Return a promise with the times and travels of its memory at which it promises most."""
    limits = one.curve.signal.limits(known.residual.coarsest_step, _stroke(known.residual))
    for step, name, factor in product(STEPS, limits, (1.0, -1.0)):
        low, high = limits[name]
        while True:
            memory = dict(one.curve.memory)
            memory[name] *= step**factor
            tried = None
            if low <= memory[name] <= high:
                tried = _at_memory(known, one.curve, memory)
            if tried is None or tried.loss > 0.999 * one.loss:
                break
            one = tried
    return one


def _at_memory(known: Normal, curve: Curve, memory: dict[str, float]) -> Promise | None:
    """Return the best curve of the same part and signal with other parameters of its memory."""
    values = _values(known.residual, curve.signal, memory)
    spline = _spline(curve.signal, values, curve.place.is_line)
    if spline is None:
        return None
    return _promise(known, curve.part, (curve.signal, memory), spline, values)


def _spline(along: Along, values: Array, rest: bool) -> tuple[Array, Hats] | None:
    """Return the knots for a signal (n,) and their hat functions; None where it hardly varies.

    With `rest` a knot stands at zero, where a signal of both signs has it.
    """
    if not float(np.ptp(values)) > 1e-9 * max(1e-300, float(np.max(np.abs(values)))):
        return None
    knots = knots_of(values, MANY.get(along.name, FINE))
    if rest and len(knots) > 2 and knots[1] < 0.0 < knots[-2]:
        knots[np.argmin(np.abs(knots))] = 0.0
    return (knots, hats_at(values, knots)) if len(knots) >= FEWEST else None


def signals(
    residual: Residual, names: Sequence[str] = ()
) -> Iterator[tuple[Along, dict[str, float], Array]]:
    """Yield the signals with the parameters of their memory and their values (n,).

    Parameters
    ----------
    residual : of a fitted model
    names : of those that are wanted; empty for all
    """
    step, length = residual.coarsest_step, residual.shortest_length
    top = max(float(np.max(run.x)) for run in residual.runs)
    offered = [one for one in ALONG.values() if residual.place.offers(one.needs)]
    offered += measured_signals(residual.runs) if not residual.place.is_line else []
    for along in (one for one in offered if not names or one.name in names):
        for memory in along.memories(step, length, _stroke(residual), top):
            yield along, memory, _values(residual, along, memory)


def _values(residual: Residual, along: Along, memory: dict[str, float]) -> Array:
    """Return a signal at the samples (n,); (n, k) where it has several columns."""
    pairs = zip(residual.runs, residual.keeps, strict=True)
    return np.concatenate([along.history(run, memory)[keep] for run, keep in pairs])


def _stroke(residual: Residual) -> float:
    """Return the RMS displacement [m]."""
    return float(np.std(np.concatenate([run.x for run in residual.runs])))


def knots_of(values: Array, count: int) -> Array:
    """Return up to `count` knots for values (n,): between equal steps and equal shares of samples.

    At levels that a signal holds, such as those of a command, stands a knot and none between. So it
    does where every run has a temperature of its own and noise on it: nothing tells what lies
    between, and the curve is straight there.
    """
    levels, counts = np.unique(
        np.round(values / max(np.ptp(values), 1e-300), 4), return_counts=True
    )
    if len(levels) <= count and counts.min() > 20:
        return np.asarray(levels * np.ptp(values))
    held = _held_levels(values)
    if 1 < len(held) <= count:
        return held
    low, high = np.quantile(values, [0.003, 0.997])
    even = np.linspace(low, high, count)
    shares = np.quantile(values, np.linspace(0.003, 0.997, count))
    knots = 0.6 * even + 0.4 * shares
    apart = np.append(True, np.diff(knots) > 1e-3 * (high - low))
    return np.asarray(knots[apart])


def _held_levels(values: Array) -> Array:
    """Return the levels about which values (n,) lie within narrow bands, none where they do not."""
    ordered = np.sort(values)
    span = float(ordered[-1] - ordered[0])
    bands = np.split(ordered, 1 + np.flatnonzero(np.diff(ordered) > APART * span))
    if min(map(len, bands)) <= 20 or sum(map(np.ptp, bands)) > NARROW * span:
        return np.zeros(0)
    return np.array([np.median(band) for band in bands])


def _promise(
    known: Normal, part: str, signal: tuple[Along, dict[str, float]], spline: tuple[Array, Hats],
    values: Array,
) -> Promise | None:  # fmt: skip
    """Return the best curve of a part along a signal, None where it has too little to go by."""
    (along, memory), (knots, hats) = signal, spline
    residual = known.residual
    unit = along.unit if along.measured else ""
    kind = Curve(part, along.name, tuple(memory.items()), (), (), at=residual.at, measured=unit)
    held = _held(kind, knots, values)
    free = [k for k in range(len(knots)) if k not in held]
    normal = known.with_curve(residual.parts[part], hats, free)
    bend = np.diff(np.eye(len(knots)), 2, axis=0)[:, free]
    smooth = smoothest(normal, known.grams.shape[1], bend.T @ bend)
    if smooth is None:
        return None
    loss, found, freedom = smooth
    fine = np.zeros(len(knots))
    fine[free] = found
    most = RIPPLED if len(knots) > FINE else FINE
    count = int(np.clip(round(freedom) + 2, FEWEST, most))
    if len(knots) > count:
        knots, fine, held = _fewer(kind, knots, fine, count, values)
    curve = replace(
        kind, knots=tuple(map(float, knots)), values=inside(kind.of, fine), held=held,
        slow=residual.slow, top=residual.top, drive=residual.drive,
    )  # fmt: skip
    return Promise(curve, loss)


def smoothest(
    normal: Normal, p: int, shape: Array, weights: Sequence[float] = SMOOTH
) -> tuple[float, Array, float] | None:
    """Return what the best smoothness leaves, with the curve's values and their freedom.

    None where the samples say nothing of the curve.

    Parameters
    ----------
    normal : equations with a curve
    p : how many of their unknowns are the law's
    shape : (k, k) whose quadratic form is the penalty
    weights : of the penalty that are tried, in terms of the curve's own information
    """
    gram = normal.grams.sum(axis=0)
    own = float(np.trace(gram[p:, p:])) / max(len(shape), 1)
    if not own > 0.0:
        return None
    best, penalty = np.inf, np.zeros_like(gram)
    for weight in weights:
        tried = np.zeros_like(gram)
        tried[p:, p:] = weight * own * shape
        loss = normal.left_out(tried)
        if loss < best:
            best, penalty = loss, tried
    inverse = np.linalg.inv(gram + penalty + normal.ridge())
    theta = inverse @ normal.sides.sum(axis=0)
    return best, theta[p:], float(np.trace((inverse @ gram)[p:, p:]))


def _fewer(
    kind: Curve, knots: Array, fine: Array, count: int, values: Array
) -> tuple[Array, Array, tuple[int, ...]]:
    """Return a curve at fewer of its knots: these, its values there, and which stay at zero."""
    at = knots[np.unique(np.round(np.linspace(0, len(knots) - 1, count)).astype(int))]
    if kind.place.is_line and 0.0 in knots[1:-1] and 0.0 not in at:
        at[1 + np.argmin(np.abs(at[1:-1]))] = 0.0
    held = _held(kind, at, values)
    fine = np.interp(at, knots, fine)
    if len(held) == 1:
        fine -= fine[held[0]] * (1.0 if kind.of.level else at / at[held[0]])
    elif kind.of_line:
        first, second = held
        slope = (fine[second] - fine[first]) / (at[second] - at[first])
        fine -= fine[first] + slope * (at - at[first])
    for k in held:
        fine[k] = 0.0
    return at, fine, held


def _held(kind: Curve, knots: Array, values: Array) -> tuple[int, ...]:
    """Return which knots (from 0) stay at zero: what the model has already.

    A law has its own strength; the line of a layer or a storey a constant, and a slope: so the
    curve is what is added to the stiffness near rest.
    """
    if not (kind.of.level or kind.of_line):
        return ()
    if kind.part == "command":
        return (0, len(knots) - 1)
    if not kind.rests:
        return (int(np.argmin(np.abs(knots - np.median(values)))),)
    rest = int(np.argmin(np.abs(knots)))
    if not kind.of_line:
        return (rest,)
    aside = np.abs(knots - NEAR_REST * float(np.std(values)))
    aside[rest] = np.inf
    return (rest, int(np.argmin(aside)))


def _slipping(known: Normal) -> Promise | None:
    """Return parallel elastic-slip elements; None where no force of theirs would be positive.

    Those whose force comes out negative are left out one by one.
    """
    residual, p = known.residual, known.grams.shape[1]
    travels = [_stroke(residual) * share for share in SHARES]
    shown = _values(residual, signal_of(travels), {}) * residual.parts["force"][:, None]
    left = list(range(len(travels)))
    while len(left) > 1:  # a table has two knots at least
        smooth = smoothest(known.with_columns(shown[:, left]), p, np.eye(len(left)))
        if smooth is None:
            return None
        loss, found, _ = smooth
        if found.min() >= 0.0:
            given = tuple(travels[k] for k in left), tuple(map(float, found))
            made = Curve(SLIP, SLIP, (), *given, drive=residual.drive, at=residual.at)
            return Promise(made, loss)
        left.pop(int(np.argmin(found)))
    return None
