"""Errors of the force behind a low-pass on both forces; what makes the force."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..errors import RecordError
from ..model.model import Model
from .error import zero_on
from .problem import Problem, Run, without

CUTOFF = 18.0
"""Hz, of the low-pass of Shirazi et al. (2012), section III-C."""

ORDER = 4
"""Of the Butterworth filter; run forth and back it has no phase and twice the steepness."""


def low_pass(y: Array, dt: float, cutoff: float = CUTOFF) -> Array:
    """Return a signal low-passed without phase: Butterworth of order `ORDER`, forth and back.

    Parameters
    ----------
    y : (n,), or several of the same length (m, n)
    dt : sampling step [s]
    cutoff : Hz; 0, or half the sampling rate and above, leaves the signal as it is

    Raises
    ------
    RecordError
        If the cut-off is negative or not a number.
    """
    from scipy.signal import sosfiltfilt

    if not cutoff >= 0.0:
        raise RecordError(f"cut-off {cutoff} Hz; 0 for none, or a positive number is right.")
    if cutoff == 0.0 or cutoff >= 0.5 / dt:
        return np.asarray(y, dtype=float)
    sections = _sections(float(cutoff), float(dt))
    pad = min(np.shape(y)[-1] - 1, max(30, int(1.0 / (cutoff * dt))))
    return np.asarray(sosfiltfilt(sections, y, padlen=pad), dtype=float)


def low_passed(signals: Sequence[Array], steps: Sequence[float], cutoff: float) -> list[Array]:
    """Return signals (n,) as `low_pass` does; those alike in step and length go through it at once.

    Parameters
    ----------
    signals : sequence of arrays
    steps : sampling step [s] of each
    cutoff : Hz
    """
    alike: dict[tuple[float, int], list[int]] = defaultdict(list)
    for k, (signal, dt) in enumerate(zip(signals, steps, strict=True)):
        alike[dt, len(signal)].append(k)
    found: dict[int, Array] = {}
    for (dt, _), places in alike.items():
        rows = low_pass(np.array([signals[k] for k in places]), dt, cutoff)
        found |= dict(zip(places, rows, strict=True))
    return [found[k] for k in range(len(signals))]


@cache
def _sections(cutoff: float, dt: float) -> Array:
    from scipy.signal import butter

    return np.asarray(butter(ORDER, cutoff, fs=1.0 / dt, output="sos"))


def filtered_errors(problem: Problem, model: Model, cutoff: float = CUTOFF) -> list[Array]:
    """Return per run the error (n - skip,) [N] of the force, both low-passed.

    A sample that was not measured has none, neither of its own nor through the low-pass.
    """
    zero = zero_on(problem, model)
    errors = [_judged(run, run.force - problem.predict(model, run) - zero) for run in problem.runs]
    passed = low_passed(errors, [run.dt for run in problem.runs], cutoff)
    return [error[run.skip :] for error, run in zip(passed, problem.runs, strict=True)]


def _judged(run: Run, error: Array) -> Array:
    return error if run.measured is None else np.where(run.measured, error, 0.0)


def force_rms(runs: list[Run], cutoff: float = CUTOFF) -> float:
    """Return the RMS of the low-passed force over what was measured of runs [N]."""
    return _rms([low_pass(run.force, run.dt, cutoff)[run.skip :][run.judged] for run in runs])


def error_rms(problem: Problem, model: Model, cutoff: float = CUTOFF) -> float:
    """Return the RMS of the low-passed error of the force over what was measured of all runs [N].

    The error that is told is another one: `error.force_error`.
    """
    pairs = zip(filtered_errors(problem, model, cutoff), problem.runs, strict=True)
    return _rms([error[run.judged] for error, run in pairs])


@np.errstate(over="ignore")  # the error of a law that is not finite on a run is none
def _rms(parts: list[Array]) -> float:
    whole = np.concatenate(parts)
    return float(np.sqrt(np.mean(whole * whole))) if len(whole) else float("nan")


# The force budget: what each part of a law and each effect makes of a model's force.

PARTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("spring", ("elastic",)),
    ("viscous", ("viscous",)),
    ("damping of the bristles", ("damping",)),
    ("yield", ("limit", "yielding")),
)
"""Parts of a law by name, with the hooks that make them, in the order in which they are taken."""


class ForceShare(NamedTuple):
    """A part of a model's force: `force` (n,) [N], and its RMS over that of the whole."""

    name: str
    force: Array
    share: float


def force_budget(problem: Problem, model: Model, run: Run) -> list[ForceShare]:
    """Return what the parts of a model make of its force in a run; they sum up to the force.

    The force loses them one after the other: first the effects, the last one first, then the parts
    of the law, each with all parameters that it alone is linear in at zero. What an effect makes of
    the force is so what it loses without it, the law and the effects before it unchanged.

    Parameters
    ----------
    problem : Problem
        What predicts the runs of the model.
    model : Model
        Law and effects with their values.
    run : Run
        One of the problem's.

    Returns
    -------
    list of ForceShare
        Parts of the law, then effects in the order of the model. "rest of the law" is what none of
        the parts takes, left out where there is none.
    """
    whole = problem.predict(model, run)
    size = float(np.sqrt(np.mean(whole**2)))
    out, before = [], whole
    for name, then in _less_and_less(model):
        after = problem.predict(then, run)
        out.append(_share(name, before - after, size))
        before = after
    out.append(_share("rest of the law", before, size))
    effects = len(model.effects)
    parts = [one for one in reversed(out[effects:]) if one.share > 1e-9]
    return [*parts, *reversed(out[:effects])]


def _share(name: str, force: Array, size: float) -> ForceShare:
    own = float(np.sqrt(np.mean(force**2)))
    return ForceShare(name, force, own / size if size > 0.0 else 0.0)


def _less_and_less(model: Model) -> Iterator[tuple[str, Model]]:
    """Yield what is taken from a model, and what is left of it then."""
    left = model
    for name in reversed(model.effects):
        left = left.only(tuple(one for one in left.effects if one != name))
        yield name, left
    law, taken = model.law_class, set[str]()
    for name, hooks in PARTS:
        own = [one for one in law.linear_in(hooks) if one not in taken]
        if own:
            taken.update(own)
            left = without(left, tuple(own))
            yield name, left
