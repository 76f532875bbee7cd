"""Errors of laws as Shirazi et al. (2012), section III-C, judge them; what makes the force.

The quadratic error of the force, measured and predicted force low-passed alike, is minimised from
several starting points; standard laws lack the exponential. The low-pass leaves little above its
cut-off, so the searches from the starts take a part of the samples. What they end at is fitted
once more to all samples.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.progress import Count
from ..errors import RecordError
from ..model.model import Model
from ..physics.laws import base_and_variant, law_names
from .error import ForceError, force_error
from .problem import Problem, Run, steady, suited, without
from .search import descend, in_threads
from .start_grid import Search
from .starts import start_models

CUTOFF = 18.0
"""Hz, of the paper's low-pass (section III-C)."""

ORDER = 4
"""Of the Butterworth filter; run forth and back it has no phase and twice the steepness."""

REST = 1e-3
"""Speed [m/s] below which a law with a sign is not valid: the damper may be stuck there."""

THINNED = 8.0
"""Samples per period of the cut-off that searches from the starts keep, at the least."""

ENOUGH = 3000
"""Samples of all runs together that they keep, at the least."""

_ALIKE = 1e-3
_FIRST, _LAST = 1e-3, 1e-4  # relative gain at which a search on a part of the samples, on all, ends
_QUADRATIC = 1e3  # residuals divided by this stay where the search's loss is quadratic


@dataclass(frozen=True)
class LawError:
    """The error of one law, fitted to the training runs.

    `error_train`, `error` the error on the training runs, and on those that decide: held out, else
    for training. Of the low-passed force: `train`, `holdout` the RMS error [N], `nan` where there
    is no run; `moving` that of samples that decide faster than `REST`; `share` the error on them
    over the RMS of the force. `starts`, `agreed` how many
    starts were tried and how many came to the same end, judged on the samples that the searches
    from the starts take.
    """

    law: str
    model: Model
    error_train: ForceError
    error: ForceError
    train: float
    holdout: float
    moving: float
    share: float
    starts: int
    agreed: int
    cut_off: float

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        numbers = {key: getattr(self, key) for key in ("train", "holdout", "moving", "share")}
        finite = {key: value if np.isfinite(value) else None for key, value in numbers.items()}
        return {
            "law": self.law, "error_train": self.error_train.as_dict(),
            "error": self.error.as_dict(), "below": self.cut_off, **finite,
            "starts": self.starts, "agreed": self.agreed,
            "parameters": {name: self.model.value(name) for name in self.model.free()},
        }  # fmt: skip


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


def error_table(
    train: Problem,
    holdout: Problem | None,
    cutoff: float = CUTOFF,
    *,
    laws: tuple[str, ...] | None = None,
    starts: int = 4,
) -> list[LawError]:
    """Return the errors of the laws, in the order asked for.

    Parameters
    ----------
    train, holdout : the runs that laws are fitted to, and those they are judged on, if any
    cutoff : Hz, of the low-pass on measured and predicted force; 0 for none
    laws : names of laws and of their variants; None for those that suit the runs
    starts : how many starting points are tried for each
    """
    laws = suited(train, law_names()) if laws is None else laws
    # The law with the most parameters takes longest: begun last, it would keep one core waiting.
    order = sorted(laws, key=lambda law: -len(base_and_variant(law)[0].parameters))
    train.bench(Model(base_and_variant(laws[0])[0].name))  # compiled before threads ask for it
    count = Count("law of the table", len(laws))

    def error(law: str) -> LawError:
        found = _law_error(train, holdout, cutoff, law, starts)
        count.done(law)
        return found

    found = dict(zip(order, in_threads(error, order), strict=True))
    return [found[law] for law in laws]


def _law_error(
    train: Problem, holdout: Problem | None, cutoff: float, law: str, starts: int
) -> LawError:
    base, variant = base_and_variant(law)
    model = Model(base.name, (), dict(variant.values))
    if steady(train):
        model = without(model, base.driven())
    few = _thinned(train, cutoff) if base.exact() else train
    begins = start_models(few, model, starts)
    ends = in_threads(lambda one: _fit_filtered(few, one, cutoff, few is train), begins)
    ends = sorted(ends, key=lambda end: end[1])
    tried, cost = len(ends), ends[0][1]
    agreed = sum(end[1] <= cost * (1.0 + _ALIKE) for end in ends)
    if few is not train:
        # Of those that agree the first stands for all; the next one may still overtake it.
        leading = (ends[0], *ends[agreed:][:1])
        ends = in_threads(lambda end: _fit_filtered(train, end[0], cutoff), leading)
    best, _ = min(ends, key=lambda end: end[1])
    deciding = holdout if holdout is not None and holdout.runs else train
    errors = filtered_errors(deciding, best, cutoff)
    moving = [
        e[(np.abs(run.v[run.skip :]) >= REST) & run.judged]
        for e, run in zip(errors, deciding.runs, strict=True)
    ]
    held_out = error_rms(deciding, best, cutoff)
    return LawError(
        law, best, force_error([(train, best)]), force_error([(deciding, best)]),
        error_rms(train, best, cutoff), held_out if deciding is not train else float("nan"),
        _rms(moving), held_out / force_rms(deciding.runs, cutoff), tried, agreed, cutoff,
    )  # fmt: skip


def _thinned(problem: Problem, cutoff: float) -> Problem:
    """Return the runs with as few of their samples as tell a low-passed force."""
    samples = sum(len(run.force) for run in problem.runs)
    runs = []
    for run in problem.runs:
        every = int(1.0 / (THINNED * cutoff * run.dt)) if cutoff else 1
        every = max(1, min(every, samples // ENOUGH))
        runs.append(run.every(every))
    fewer = any(len(a.force) < len(b.force) for a, b in zip(runs, problem.runs, strict=True))
    return problem.of(runs) if fewer else problem


def filtered_errors(problem: Problem, model: Model, cutoff: float = CUTOFF) -> list[Array]:
    """Return per run the error (n - skip,) [N] of the force, both low-passed.

    A sample that was not measured has none, neither of its own nor through the low-pass.
    """
    errors = [_judged(run, run.force - problem.predict(model, run)) for run in problem.runs]
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


def _fit_filtered(
    problem: Problem, model: Model, cutoff: float, whole: bool = True
) -> tuple[Model, float]:
    """Return the least-squares fit of the low-passed force from one start, and its RMS error.

    Parameters
    ----------
    problem : the runs
    model : where the search begins
    cutoff : Hz
    whole : whether the problem has all samples, not a part of them
    """
    none = [(np.zeros(1), np.ones(1), np.zeros((1, 1))) for _ in problem.runs]
    scaled = Search(problem, model, none, model.free(), logarithms=False)
    unit = _QUADRATIC * force_rms(problem.runs, cutoff)

    def residuals(theta: Array) -> Array:
        errors = filtered_errors(problem, scaled.at(theta), cutoff)
        return np.nan_to_num(np.concatenate(errors) / unit, nan=1e3, posinf=1e3, neginf=-1e3)

    tolerance = _LAST if whole else _FIRST
    found = descend(residuals, scaled.start, scaled.low, scaled.high, 12, tolerance)
    best = scaled.at(found.theta)
    return replace(best, values=dict(best.values)), error_rms(problem, best, cutoff)


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
