"""The error of a model: how it is computed and told, here alone.

Error = RMS(measured - predicted) / RMS(measured), both over the same samples, unfiltered, at the
rate of the fit. The prediction is the model's force from the smoothed motion, as its FMU gives it:
no mean of drawn errors is taken off. What is left out depends on the data (`data.left_out`), never
on the law.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan, sqrt
from typing import Any, Self

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import percent, quantity
from ..data.left_out import LOADED, NO_VALUE, SETTLING, WAYS_OUT, any_of
from ..errors import RecordError
from ..model.model import Model
from .problem import Expected, Problem, Run, zero_of

MENTIONED = 0.02
"""Share of samples left out above which the error over all samples is told as well."""

TOO_MANY = 0.2
"""The same above which that one is the error."""

MIN_SAMPLES = 100
"""Samples of all runs together that a fit, or a judgement, needs at the least."""

APART = 3.0
"""Ratio of the errors of held-out and training runs from which these are not of one kind."""

MUCH = 0.1
"""Share of the force below which it is not worth a word."""


@dataclass(frozen=True)
class ForceError:
    """How far a prediction is from what was measured, over the samples that count.

    `samples` of `total` count; `left_out` says how many do not, by reason. `rms`, `signal` the RMS
    of the error and of what was measured over those that count, `rms_all`, `signal_all` over all
    that hold a measured value, [N] or the unit of an output. An RMS is infinite where a prediction
    is not finite, and not a number over no sample.
    """

    samples: int
    total: int
    rms: float
    signal: float
    rms_all: float
    signal_all: float
    left_out: Mapping[str, int] = field(default_factory=dict)

    @property
    def share(self) -> float:
        """The error over the RMS of what was measured [1], both over the samples that count."""
        return self.rms / self.signal if self.signal > 0.0 else nan

    @property
    def share_all(self) -> float:
        """The same over all samples [1]."""
        return self.rms_all / self.signal_all if self.signal_all > 0.0 else nan

    @property
    def valued(self) -> int:
        """How many samples hold a measured value."""
        return self.total - sum(self.left_out.get(reason, 0) for reason in NO_VALUE)

    @property
    def share_left_out(self) -> float:
        """The share of the samples that is left out [1]."""
        return 1.0 - self.samples / self.total if self.total else nan

    @property
    def over_all(self) -> bool:
        """Whether so many measured values are left out that the error is that over all of them."""
        return self.valued - self.samples > TOO_MANY * self.valued

    @property
    def headline(self) -> tuple[float, float]:
        """The error that is told first: RMS, and share of the RMS of what was measured."""
        return (self.rms_all, self.share_all) if self.over_all else (self.rms, self.share)

    def text(self, unit: str = "N", size: float | None = None) -> str:
        """Return the error as every command prints it: "0.9732 N (21.1 %)".

        Parameters
        ----------
        unit : that of the output
        size : which decides between N and kN; that of the error itself by default
        """
        rms, share = self.headline
        size = size if size is not None else rms
        relative = f" ({percent(share)})" if isfinite(share) else ""
        return f"{quantity(rms, unit, 4, size)}{relative}"

    def counted(self) -> str:
        """Return how many samples are left out and why; "" where none is."""
        if not self.left_out:
            return ""
        out = self.total - self.samples
        ordered = sorted(self.left_out, key=list(WAYS_OUT).index)
        one = len(ordered) == 1
        why = ", ".join(r if one else f"{self.left_out[r]:,} {r}" for r in ordered)
        return f"{out:,} of {self.total:,} samples ({_few(self.share_left_out)}) left out: {why}"

    def beside(self, unit: str = "N") -> list[str]:
        """Return what is told beside the error: what is left out, the other error, the way out.

        Parameters
        ----------
        unit : that of the output
        """
        text = self.counted()
        every = "all samples" if self.valued == self.total else "all that hold a value"
        if not text or self.share_left_out <= MENTIONED:
            return [f"{text}."] if text else []
        most = max(self.left_out, key=lambda reason: self.left_out[reason])
        if self.over_all:
            few = f"{quantity(self.rms, unit, 4)} ({percent(self.share)})"
            text += f". So the error is that over {every}; over the {self.samples:,} that are left "
            text += f"it is {few if self.samples else 'unknown'}"
        elif self.valued > self.samples:
            over = f"{quantity(self.rms_all, unit, 4)} ({percent(self.share_all)})"
            text += f". Over {every} the error is {over}"
        if self.share_left_out > TOO_MANY:
            return [f"Warning: {text}. To change it: {WAYS_OUT[most]}."]
        return [f"{text}."]

    def as_dict(self) -> dict[str, Any]:
        """Return what JSON holds: `rms` and `share` are the error that is told."""
        rms, share = self.headline
        numbers = {
            "rms": rms, "share": share, "rms_counted": self.rms, "signal_counted": self.signal,
            "rms_all": self.rms_all, "signal_all": self.signal_all,
        }  # fmt: skip
        return {
            **{key: one if isfinite(one) else None for key, one in numbers.items()},
            "samples": self.samples, "total": self.total, "left_out": dict(self.left_out),
        }  # fmt: skip

    @classmethod
    def of(cls, told: Mapping[str, Any]) -> Self:
        """Return the error that `as_dict` has told."""
        keys = ("rms_counted", "signal_counted", "rms_all", "signal_all")
        a, b, c, d = (nan if told[key] is None else float(told[key]) for key in keys)
        return cls(int(told["samples"]), int(told["total"]), a, b, c, d, dict(told["left_out"]))


def refuse_empty(runs: Sequence[Run]) -> None:
    """Refuse runs of which too few samples count for a fit, or to judge one.

    Raises
    ------
    RecordError
        Saying how many are left out of which runs, why, and what to do.
    """
    every = [run.entire() for run in runs]
    counts = [error_of(run.force, run.force, reasons_of(run)) for run in every]
    whole = pooled(counts)
    if whole.samples >= MIN_SAMPLES:
        return
    told = [f"{run.name}: {one.counted()}" for run, one in zip(runs, counts, strict=True)]
    more = [f"and {len(told) - 3} more runs"] if len(told) > 3 else []
    ways = "; ".join(dict.fromkeys(WAYS_OUT[why] for one in counts for why in one.left_out))
    raise RecordError(
        f"{'; '.join([*told[:3], *more])}. {whole.samples:,} samples are left, and {MIN_SAMPLES} "
        f"are needed. To change it: {ways}."
    )


def force_error(pairs: Iterable[tuple[Problem, Model]]) -> ForceError:
    """Return the error of models over all runs of their problems: the one number that is told.

    Parameters
    ----------
    pairs : the runs of each site, and the model that predicts them; on a bench one
    """
    return pooled(error for problem, model in pairs for error in errors_by_run(problem, model))


def errors_by_run(problem: Problem, model: Model) -> list[ForceError]:
    """Return the error of a model on each run of a problem, whatever its fit left out."""
    return _errors_on([run.entire() for run in problem.runs], problem, model)


def judged_errors(
    problem: Problem, model: Model, expected: Expected
) -> tuple[ForceError, ForceError]:
    """Return the error of a model over the samples that a fit takes, and `force_error`.

    Parameters
    ----------
    problem, model : the runs, and what predicts them
    expected : what a true model would show on each run
    """
    entire = [run.entire() for run in problem.runs]
    taken = pooled(_errors_on(problem.runs, problem, model, expected))
    if all(one is run for one, run in zip(entire, problem.runs, strict=True)):
        return taken, taken
    return taken, pooled(_errors_on(entire, problem, model, expected))


def _errors_on(
    runs: Sequence[Run], problem: Problem, model: Model, expected: Expected | None = None
) -> list[ForceError]:
    zero = zero_on(problem, model, expected)
    return [error_on(run, problem.predict(model, run) + zero) for run in runs]


def zero_on(problem: Problem, model: Model, expected: Expected | None = None) -> float:
    """Return the zero of the load cell [N] with which a model was fitted: what it shows more.

    `expected` is what a true model would show on each run, None draws it for this model.
    """
    return zero_of(problem, model, expected)[0] if problem.fits_zero(model) else 0.0


def error_on(run: Run, predicted: Array) -> ForceError:
    """Return the error of any prediction (n,) [N] of a run's force, as that of its model's FMU."""
    return error_of(run.force, predicted, reasons_of(run))


def reasons_of(run: Run) -> dict[str, Flags]:
    """Return why samples (n,) of a run are left out, those at its start included."""
    n = len(run.force)
    place = np.arange(n)
    loaded = place < min(run.rest, run.skip)
    return {**run.left_out, LOADED: loaded, SETTLING: (place < run.skip) & ~loaded}


def error_of(measured: Array, predicted: Array, left_out: Mapping[str, Flags]) -> ForceError:
    """Return the error of a prediction.

    Parameters
    ----------
    measured, predicted : (n,) in one unit
    left_out : by reason (n,) True where a sample does not count; one with several reasons is
        counted under the first of `data.left_out.WAYS_OUT`
    """
    error = measured - predicted
    nothing = any_of({reason: left_out[reason] for reason in NO_VALUE if reason in left_out})
    valued = slice(None) if nothing is None else ~nothing
    counts, out = {}, np.zeros(len(measured), dtype=np.bool_)
    for reason in sorted(left_out, key=list(WAYS_OUT).index):
        new = left_out[reason] & ~out
        if new.any():
            counts[reason] = int(np.count_nonzero(new))
            out |= new
    kept = ~out
    return ForceError(
        int(np.count_nonzero(kept)), len(measured), _rms(error[kept]), _rms(measured[kept]),
        _rms(error[valued]), _rms(measured[valued]), counts,
    )  # fmt: skip


def pooled(errors: Iterable[ForceError]) -> ForceError:
    """Return the error over the samples of several."""
    errors = list(errors)
    counts: dict[str, int] = {}
    for one in errors:
        for reason, count in one.left_out.items():
            counts[reason] = counts.get(reason, 0) + count
    samples, valued = [one.samples for one in errors], [one.valued for one in errors]
    return ForceError(
        sum(samples), sum(one.total for one in errors),
        _mean(samples, [e.rms for e in errors]), _mean(samples, [e.signal for e in errors]),
        _mean(valued, [e.rms_all for e in errors]), _mean(valued, [e.signal_all for e in errors]),
        counts,
    )  # fmt: skip


def _mean(counts: Sequence[int], sizes: Sequence[float]) -> float:
    """Return the RMS over several parts from that of each."""
    known = [(n, size) for n, size in zip(counts, sizes, strict=True) if n]
    whole = sum(n for n, _ in known)
    return sqrt(sum(n * size**2 for n, size in known) / whole) if whole else nan


@np.errstate(over="ignore")  # what is not finite is told by who reads the error
def _rms(values: Array) -> float:
    if not len(values):
        return nan
    found = float(np.sqrt(np.mean(values * values)))
    return found if isfinite(found) else inf


def _few(share: float) -> str:
    """Return a share in per cent with two digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.1f} %"


def held_out_apart(train: float, holdout: float, share: float) -> str:
    """Return what to do where held-out runs err far more than training runs; "" where not so.

    Parameters
    ----------
    train, holdout : the errors, both over the force or over the noise
    share : that of the held-out runs over their force
    """
    if not (holdout > APART * train and share > MUCH):
        return ""
    return (
        "The held-out runs err far more than the training runs: they do what no training run does, "
        "in motion, command or device. bristle compare shows in which, bristle study roles makes "
        "it a training run."
    )
