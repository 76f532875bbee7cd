"""Runs held against predictions, and the coordinates of their samples."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from ..core.arrays import Array, Flags, Indices
from ..core.text import scale
from ..data.channels import Labels
from ..data.decimate import between
from ..data.left_out import MISSING, SETTLING
from ..identification.building_sites import StructureRun
from ..identification.error import ForceError, error_of, errors_by_run, zero_on
from ..identification.problem import LOST, Problem, Run, over_noise
from ..model.model import Model
from ..physics.drive import DRIVES, VOLTAGE

# The coordinates along which a residual may be organised, and the bins of each.

DRAWS = 12
"""Draws of the measured inputs' error that are carried through a model."""
RECENT = 0.05
"""Time over which a change of the voltage counts as its rate [s]."""
RESTED = 0.3
"""Time over which a motion counts as one of late [s]."""
BINS = 16
FINE = {"displacement": 40}
"""Bins of coordinates along which a force may ripple."""
SLOW = ("time", "dissipated_energy")
"""Coordinates that only grow over a run: few blocks of samples fall into each of their bins."""
_TIED = 1e-4  # share of the range below which two values are one level
_FEW = 0.4  # share of an equal count below which the last samples are no bin of their own

# (factor from SI, unit) in which an engineer reads a coordinate
SHOWN: dict[str, tuple[float, str]] = {
    "displacement": (1e3, "mm"),
    "velocity": (1e3, "mm/s"),
    "speed": (1e3, "mm/s"),
    "acceleration": (1.0, "m/s2"),
    **{one.name: (1.0, one.unit) for one in DRIVES.values()},
    **{f"{one.name}_rate": (1.0, f"{one.unit}/s") for one in DRIVES.values()},
    "amplitude": (1e3, "mm"),
    "temperature": (1.0, "°C"),
    "frequency": (1.0, "Hz"),
    "direction": (1.0, ""),
    "time": (1.0, "s"),
    "dissipated_energy": (1.0, "J"),
    "time_since_reversal": (1e3, "ms"),
}


def coordinates_of(
    dt: float,
    x: Array | None,
    v: Array | None,
    a: Array | None,
    V: Array | None,
    force: Array | None,
    drive: str = VOLTAGE.name,
) -> dict[str, Array]:
    """Return the coordinates (n,) of one run in SI that its signals allow.

    Parameters
    ----------
    dt : float, s
    x, v, a, V, force : (n,) m, m/s, m/s2, V, N or None; smoothed, for noise blurs the bins
    drive : the channel that V holds, in its own unit
    """
    found: dict[str, Array] = {}
    if x is not None:
        found["displacement"] = x
    if v is not None:
        found["velocity"] = v
        found["speed"] = np.abs(v)
        found["direction"] = np.where(v < 0.0, -1.0, 1.0)
        found["time_since_reversal"] = since_reversal(v, dt)
    if a is not None:
        found["acceleration"] = a
    if V is not None:
        found[drive] = V
        found[f"{drive}_rate"] = recent_rate(V, dt)
    if v is not None and force is not None:
        found["dissipated_energy"] = np.asarray(np.cumsum(np.abs(force * v)) * dt, dtype=float)
    given = next((y for y in (x, v, a, V, force) if y is not None), np.zeros(0))
    found["time"] = np.arange(len(given), dtype=np.float64) * np.float64(dt)
    return found


def shown(name: str, units: Mapping[str, str], size: float) -> tuple[float, str]:
    """Return the factor from SI and the unit in which an engineer reads a coordinate.

    Parameters
    ----------
    name : of the coordinate
    units : those of extra channels, by name
    size : how large its values are, in SI
    """
    if name in units:
        factor, unit = scale(units[name], size)
        return factor, {"1": "", "degC": "°C"}.get(unit, unit)
    return SHOWN.get(name, (1.0, ""))


def late_speed(v: Array, dt: float) -> Array:
    """Return the mean speed (n,) of late of a velocity (n,), with the sign of the motion now [m/s].

    What builds up at rest and is worn down by motion has a memory of this kind, where the speed of
    the moment has none.
    """
    fade = np.exp(-dt / RESTED)
    size = np.abs(v)
    mean = lfilter([1.0 - fade], [1.0, -fade], size, zi=[fade * size[0]])[0]
    return np.asarray(np.where(v < 0.0, -mean, mean), dtype=float)


def since_reversal(v: Array, dt: float) -> Array:
    """Return the time (n,) [s] since a velocity (n,) last changed sign."""
    turned = np.concatenate([[True], v[1:] * v[:-1] <= 0.0])
    index = np.arange(len(v))
    return np.asarray((index - np.maximum.accumulate(np.where(turned, index, 0))) * dt, dtype=float)


def recent_rate(V: Array, dt: float) -> Array:
    """Return how fast a drive signal (n,) has changed of late, per second.

    The change since its own first-order lag: a step shows for some `RECENT` seconds, where a
    difference from sample to sample shows it once.
    """
    keep = float(np.exp(-dt / RECENT))
    rest, _ = lfilter([1.0 - keep], [1.0, -keep], V[1:], zi=[keep * V[0]])
    lagged = np.concatenate([V[:1], np.asarray(rest, dtype=float)])
    return np.asarray((V - lagged) / RECENT, dtype=float)


@dataclass(frozen=True)
class Bins:
    """A coordinate cut into bins: `label` (n,) of each sample, `centre`, `low`, `high` (b,)."""

    label: Indices
    centre: Array
    low: Array
    high: Array

    @property
    def count(self) -> int:
        """How many bins there are."""
        return len(self.centre)


def cut(values: Array, bins: int = BINS) -> Bins | None:
    """Cut a coordinate (n,) into bins of about equal count; None where it does not vary.

    A level that holds more than its share, as a constant voltage does, is a bin of its own: ties
    that were spread over bins would be told apart by time.
    """
    span = float(np.ptp(values)) if len(values) else 0.0
    if not span > 1e-12 * max(float(np.max(np.abs(values), initial=0.0)), 1e-300):
        return None
    levels = np.round((values - values.min()) / (_TIED * span)).astype(np.int64)
    present, counts = np.unique(levels, return_counts=True)
    share = len(values) / bins
    begins = _begins(counts, share)
    if len(begins) > 1 and 0 < counts[begins[-1] :].sum() < _FEW * share:
        begins = begins[:-1]  # a few samples at the end are no bin
    group = np.searchsorted(begins, np.arange(len(present)), side="right") - 1
    label = group[np.searchsorted(present, levels)]
    label = np.unique(label, return_inverse=True)[1].astype(np.int64)
    count = np.bincount(label)
    if len(count) < 2:
        return None
    order = np.argsort(label, kind="stable")
    edges = np.concatenate([[0], np.cumsum(count)])
    parts = [values[order[begin:end]] for begin, end in itertools.pairwise(edges)]
    return Bins(
        label,
        np.array([part.mean() for part in parts]),
        np.array([part.min() for part in parts]),
        np.array([part.max() for part in parts]),
    )


def _begins(counts: Indices, share: float) -> Indices:
    """Return at which of the levels, by how often they occur (n,), a bin begins (b,).

    A level that holds a `share` of the samples by itself is a bin; of the others a bin takes so
    many that the middle of its last level is no further than that.
    """
    before = np.cumsum(counts) - counts
    middle = before + 0.5 * counts
    alone = counts >= share
    large = np.flatnonzero(alone)
    begins = [0]
    while True:
        at = begins[-1]
        full = at + 1 if alone[at] else int(np.searchsorted(middle, before[at] + share, "right"))
        later = large[np.searchsorted(large, at, "right") :]
        end = min([max(full, at + 1), *later[:1].tolist()])
        if end >= len(counts):
            return np.array(begins)
        begins.append(end)


@dataclass(frozen=True, eq=False)
class RunPrediction:
    """One output of one run, measured and predicted, in SI.

    `measured`, `predicted`, `sigma` (n,): `sigma` is the noise expected of a true model, the
    channel's own (`noise`) and that of the measured inputs carried through the model, of which
    `spread` (d, n) are draws. `coordinates` name to (n,). `numerical` (n,) is how far the
    prediction moves at half the step, None where that was not tried. The first `skip` samples do
    not count, for the model's states begin somewhere, nor do those where `known` (n,) is False:
    they were not measured but filled in. `site` of a building is "damper", "layer", "storey1" ...,
    "" on a bench. `index` (n,) numbers the samples where some were left out, None where none were.
    `drive` is the channel that commands the damper, `labels` what is known of the whole run,
    `units` those of the coordinates that are extra channels. `predicted` has the mean of the drawn
    errors in it, as z needs; `held` is the error of the prediction itself, None where both are one.
    `noise_known` is False where the output's noise cannot be told from its signal, so that no z
    says anything.
    """

    name: str
    dt: float
    measured: Array
    predicted: Array
    sigma: Array
    noise: float
    spread: Array
    coordinates: dict[str, Array] = field(default_factory=dict)
    numerical: Array | None = None
    quantity: str = "force"
    unit: str = "N"
    skip: int = 25
    known: Flags | None = None
    site: str = ""
    index: Indices | None = None
    drive: str = VOLTAGE.name
    labels: Labels = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    held: ForceError | None = None
    noise_known: bool = True

    @property
    def error(self) -> ForceError:
        """The error on the run, the same as everywhere: see `identification.error`."""
        if self.held is not None:
            return self.held
        early = np.arange(len(self.measured)) < self.skip
        return error_of(self.measured, self.predicted, {SETTLING: early, MISSING: ~self._there})

    @property
    def time(self) -> Array:
        """Time (n,) [s] from the run's begin."""
        index = np.arange(len(self.measured)) if self.index is None else self.index
        return np.asarray(index * self.dt, dtype=float)

    @property
    def residual(self) -> Array:
        """Measured less predicted, without the skipped samples, in the unit; 0 where not known."""
        error = self.measured - self.predicted
        return (error if self.known is None else np.where(self.known, error, 0.0))[self.skip :]

    @property
    def judged(self) -> Flags:
        """Which of the samples after the skipped ones count (n - skip,)."""
        return self._there[self.skip :]

    @property
    def _there(self) -> Flags:
        return np.ones(len(self.measured), dtype=bool) if self.known is None else self.known

    @property
    def normalised(self) -> Array:
        """The residual over the noise expected of a true model."""
        return over_noise(self.residual, self.sigma[self.skip :])

    @property
    def carried(self) -> Array:
        """The draws of the carried noise (d, n) without the skipped samples."""
        return self.spread[:, self.skip :]

    def along(self) -> dict[str, Array]:
        """Return the coordinates without the skipped samples."""
        return {name: values[self.skip :] for name, values in self.coordinates.items()}

    def only_judged(self, values: Array) -> Array:
        """Return those of values (n - skip,) that count: a mean over others would be too small."""
        return values if self.judged.all() else values[self.judged]

    def judged_along(self) -> dict[str, Array]:
        """Return the coordinates at the samples that count."""
        return {name: self.only_judged(values) for name, values in self.along().items()}


def run_predictions(problem: Problem, model: Model) -> list[RunPrediction]:
    """Return the runs of a problem held against a model's force.

    Parameters
    ----------
    problem : Problem
        Runs that the model was not fitted to, if it is to be judged.
    """
    out = []
    problem = problem.with_excess(0.0)
    zero = zero_on(problem, model)
    for run, (bias, sigma, spread), held in zip(
        problem.runs, problem.expectation(model, DRAWS), errors_by_run(problem, model), strict=True
    ):
        predicted = problem.predict(model, run)
        finer = at_half_the_step(problem, model, run)
        if run.measured is not None:
            sigma = np.where(run.measured, sigma, sigma / LOST)  # `known` says it instead
        out.append(
            RunPrediction(
                run.name, run.dt, run.force, predicted + bias + zero, sigma, run.noise, spread,
                coordinates_of_run(run), finer - predicted, skip=run.skip, known=run.measured,
                index=run.keep if isinstance(run, StructureRun) else None,
                drive=run.drive, labels=run.labels,
                units={name: one.unit for name, one in run.extra.items()}, held=held,
                noise_known=problem.noise_known,
            )
        )  # fmt: skip
    return out


def coordinates_of_run(run: Run) -> dict[str, Array]:
    """Return the coordinates (n,) of a run; time and history go on where samples are left out."""
    all_of, keep = run.remembered
    found = coordinates_of(
        all_of.dt, all_of.x, all_of.v, all_of.a, all_of.V, all_of.force, all_of.drive
    )
    numbers = {name: y for name, y in all_of.labels.items() if not isinstance(y, str)}
    constant = {name: np.full(len(all_of.x), y) for name, y in numbers.items()}
    measured = {name: one.values for name, one in all_of.extra.items()}
    return {name: y[keep] for name, y in {**constant, **measured, **found}.items()}


def at_half_the_step(problem: Problem, model: Model, run: Run) -> Array:
    """Return a model's force (n,) [N] at the samples of a run, evaluated twice as often."""
    whole, _ = run.remembered
    if whole.finer is None:
        return problem.predict(model, halved(run))[::2]
    often = replace(whole, finer=whole.finer.cut(2 * whole.finer.parts))
    again = replace(run, whole=often) if isinstance(run, StructureRun) else often
    return problem.predict(model, again)


def halved(run: Run) -> Run:
    """Return a run with a sample between any two: motion by Hermite's cubic, voltage by a line."""
    x, v, a = run.x, run.v, run.a
    whole: dict[str, Any] = {}
    if isinstance(run, StructureRun):
        keep = np.empty(2 * len(x) - 1, dtype=np.int64)
        keep[::2], keep[1::2] = 2 * run.keep, 2 * run.keep[:-1] + 1
        whole = {"whole": halved(run.whole), "keep": keep}
    return replace(
        run,
        **whole,
        dt=0.5 * run.dt,
        x=between(x, v, run.dt),
        v=between(v, a, run.dt),
        a=between(a, None, run.dt),
        V=between(run.V, None, run.dt),
        force=between(run.force, None, run.dt),
        draws=np.zeros((0, 2 * len(x) - 1, 4)),
        extra={
            name: replace(one, values=between(one.values, None, run.dt))
            for name, one in run.extra.items()
        },
        left_out={},
    )


def rms(values: Array) -> float:
    """Return the root of the mean square, 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
