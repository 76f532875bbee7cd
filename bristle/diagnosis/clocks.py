"""Loggers whose clocks differ: the force drifts against the motion, or starts apart from it.

What a damper does late, it does as late at the end of a run as at its begin. In windows of each run
the lateness of the measured force follows from its slope: to first order a force that is late by
tau differs from the model's by -tau dF/dt. A straight line through these, with one slope for all
runs, is a clock's rate; a begin that differs from those of the other runs is a start apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array
from ..core.finding import Finding
from ..core.text import plain
from ..data.corrections import LEFT_OUT
from ..data.left_out import MISSING, merged
from ..identification.fit import refine
from ..identification.problem import Problem, Run, robust_z
from ..model.model import Model
from .model_faults import ModelBasedFaults
from .rule import SENSOR
from .trials import Trial, judge

WINDOW = 250
"""Samples of a window at the least, longer than a residual's correlation."""

WINDOWS = 12
"""Windows of a run at the most."""

TURNS = 15
"""How often at the most the lateness is estimated anew with runs set right and the law refitted:
it is linear only where small, and a law bends to be late with the runs."""

LOOKED, TAKEN = 3, 0.3
"""Turns after which the clocks must have taken that share of the excess: `_explain` asks for more
than twice as much in the end."""

UNFITTED = 0.2
"""Share of `rule.clocks_promise` that clocks must take before the law is refitted to them."""

SETTLED = 0.03
"""Share of a sampling step by which no run may move any more."""

SMOOTH = 21
"""Samples of the bell that both forces are smoothed with: between two samples a jump has no slope.
"""


HUBER = 6.0
"""Residuals beyond so many robust deviations count less."""


@dataclass(frozen=True)
class Clocks:
    """The rate [s/s] by which the force's clock gains, and by how much it is late at each begin.

    `late`, `late_std` (runs,) [s]; `rate_std` [s/s].
    """

    rate: float
    rate_std: float
    late: Array
    late_std: Array

    def plus(self, more: Clocks) -> Clocks:
        """Return these clocks corrected by what was left, with its deviations."""
        return replace(more, rate=self.rate + more.rate, late=self.late + more.late)


def clock_faults(before: Trial, train: Problem, held_out: Problem) -> ModelBasedFaults | None:
    """Return the faults of clocks that explain what a model leaves; None where they do not.

    Parameters
    ----------
    before : the model without further effects, fitted to `train` and judged on `held_out`
    train, held_out : runs to fit to, and those that decide
    """
    runs = [*train.runs, *held_out.runs]
    if max(before.z, before.train) < 1.0 + SENSOR.gain:
        return None
    model, clocks = before.model, clocks_of(before.model, train.of(runs))
    if clocks is None or not _differ(clocks, runs):
        return None
    count = len(train.runs)
    for turn in range(TURNS):
        moved = [_set_right(run, clocks, k) for k, run in enumerate(runs)]
        if turn == 0 and _hopeless(moved[:count], model, train, before, UNFITTED):
            return None
        model = refine(model, train.of(moved[:count]), 4)
        left = clocks_of(model, train.of(moved))
        if left is None:
            return None
        clocks = clocks.plus(left)
        if turn == 0 and _hopeless(moved[:count], model, train, before, 1.0):
            return None
        if _largest(left, runs) < SETTLED:
            break
        if turn + 1 == LOOKED:
            both = train.of(moved[:count]), held_out.of(moved[count:])
            if _taken([robust_z(one, model) for one in both], before) < TAKEN:
                return None
    moved = [_set_right(run, clocks, k) for k, run in enumerate(runs)]
    right = train.of(moved[:count]), held_out.of(moved[count:])
    trial = judge(refine(model, right[0]), *right)
    faults = _faults(clocks, runs)
    if not faults or not _explain(trial, before):
        return None
    return ModelBasedFaults(faults, *right, trial)


def _hopeless(
    moved: list[Run],
    model: Model,
    train: Problem,
    before: Trial,
    share: float,
) -> bool:
    """Return whether a first correction takes less than a share of what is asked of a large excess.

    A small excess says nothing: one run apart hardly shows in it.
    """
    if before.train < SENSOR.clocks_large:
        return False
    problem = train.of(moved)
    z = robust_z(problem, model)
    excess = before.train**2 - 1.0
    return excess - max(z**2 - 1.0, 0.0) < share * SENSOR.clocks_promise * excess


def _largest(clocks: Clocks, runs: list[Run]) -> float:
    """Return by how many steps these clocks move a sample at the most."""
    each = zip(runs, clocks.late, strict=True)
    return max(abs(clocks.rate) * len(run.force) + abs(float(late)) / run.dt for run, late in each)


def clocks_of(model: Model, problem: Problem) -> Clocks | None:
    """Return the clocks of runs by what a fitted model leaves; None where too little moves.

    Parameters
    ----------
    model : as fitted
    problem : the runs
    """
    rows, late, info = [], list[float](), list[float]()
    count = len(problem.runs)
    bell = np.hanning(SMOOTH + 2) / np.sum(np.hanning(SMOOTH + 2))
    for k, run in enumerate(problem.runs):
        predicted = problem.predict(model, run)
        gone = run.force - predicted
        if run.measured is not None:
            gone = np.where(run.measured, gone, 0.0)
        left = np.convolve(gone, bell, "same") / run.noise
        slope = np.gradient(np.convolve(predicted, bell, "same"), run.dt) / run.noise
        size = max(WINDOW, -(-len(left) // WINDOWS))
        for begin in range(max(run.skip, SMOOTH), len(left) - WINDOW + 1, size):
            part = slice(begin, begin + size)
            found = _lateness(left[part], slope[part])
            if found is not None:
                middle = run.dt * (begin + 0.5 * (min(begin + size, len(left)) - begin))
                rows.append([middle, *(float(k == other) for other in range(count))])
                late.append(found[0])
                info.append(found[1])
    A, y, weight = np.array(rows), np.array(late), np.array(info)
    if len(rows) < count + 3 or np.any(A[:, 1:].sum(axis=0) < 2.0):
        return None
    gram = A.T @ (A * weight[:, None])
    inverse = np.linalg.inv(gram)
    theta = inverse @ (A.T @ (weight * y))
    scatter = float(np.sum(weight * (y - A @ theta) ** 2)) / (len(rows) - count - 1)
    std = np.sqrt(scatter * np.diag(inverse))
    return Clocks(float(theta[0]), float(std[0]), theta[1:], std[1:])


def _lateness(left: Array, slope: Array) -> tuple[float, float] | None:
    """Return by how much a window is late [s], and its information [1/s2]; None without a slope.

    Parameters
    ----------
    left, slope : (n,) residual and slope of the prediction [1/s], over the noise
    """
    weight = np.ones(len(left))
    late = info = 0.0
    for _ in range(3):
        info = float(np.sum(weight * slope**2))
        if not info > 0.0:
            return None
        late = -float(np.sum(weight * left * slope)) / info
        z = np.abs(left + late * slope)
        scale = max(1e-9, float(np.median(z)) / 0.6745)
        weight = np.minimum(1.0, HUBER * scale / np.maximum(z, 1e-12))
    return late, info


def _set_right(run: Run, clocks: Clocks, k: int) -> Run:
    """Return run `k` with the motion as it was when each sample of the force was measured.

    The motion is smooth and the force noisy: taking the force between samples would lower its
    noise. Samples for which no motion is on record count as not measured.
    """
    at = np.arange(len(run.force), dtype=float)
    when = (at - clocks.late[k] / run.dt) / (1.0 + clocks.rate)
    known = (when >= 0.0) & (when <= at[-1])

    def then(values: Array) -> Array:
        return np.asarray(np.interp(when, at, values))

    draws = run.draws
    if draws.size:
        draws = np.apply_along_axis(then, 1, draws)
    return replace(
        run, x=then(run.x), v=then(run.v), a=then(run.a), V=then(run.V), draws=draws,
        left_out=merged(run.left_out, MISSING, ~known),
    )  # fmt: skip


def _explain(trial: Trial, before: Trial) -> bool:
    """Return whether runs set right lack nearly nothing of what the model left before.

    A run apart may be one that the model was fitted to, so that runs held out show nothing of it.
    """
    return _taken([trial.train, trial.z], before) > SENSOR.share_when_clean


def _taken(z: list[float], before: Trial) -> float:
    """Return the share of the excess that is gone where z is this on runs to fit to and held out.

    Nothing of an excess that is none.
    """
    was, now = (sum(one**2 for one in each) / 2.0 - 1.0 for each in ((before.train, before.z), z))
    return 1.0 - max(now, 0.0) / was if was > SENSOR.gain else 0.0


def _rate_matters(clocks: Clocks, runs: list[Run]) -> bool:
    longest = max(len(run.force) for run in runs)
    least = SENSOR.least_delay / longest
    return abs(clocks.rate) > max(SENSOR.fault_sigma * clocks.rate_std, least)


def _apart(clocks: Clocks, runs: list[Run]) -> tuple[float, list[int]]:
    """Return how late the force is in most runs [s], and which runs began apart from that."""
    usual = float(np.median(clocks.late))
    if len(runs) < 3:
        usual = float(clocks.late[np.argmin(np.abs(clocks.late))])
    off = [
        k
        for k, run in enumerate(runs)
        if abs(clocks.late[k] - usual)
        > max(SENSOR.fault_sigma * clocks.late_std[k], SENSOR.least_delay * run.dt)
    ]
    return usual, off


def _differ(clocks: Clocks, runs: list[Run]) -> bool:
    return _rate_matters(clocks, runs) or bool(_apart(clocks, runs)[1])


def _faults(clocks: Clocks, runs: list[Run]) -> tuple[Finding, ...]:
    """Return the faults that clocks are; what all runs share is one, each run apart another."""
    out: list[Finding] = []
    rated = _rate_matters(clocks, runs)
    usual, off = _apart(clocks, runs)
    if rated:
        length = max(run.dt * len(run.force) for run in runs)
        way = "fast" if clocks.rate > 0.0 else "slow"
        out.append(
            Finding(
                "clock", "warning",
                f"The clock of the force's logger runs {plain(1e6 * abs(clocks.rate), 2)} ppm "
                f"(± {plain(1.96e6 * clocks.rate_std, 1)}) {way} relative to that of the motion: "
                f"{plain(1e3 * abs(clocks.rate) * length, 2)} ms in {plain(length, 3)} s. Record "
                "both on one logger, or set it right in study.toml: correct = "
                f'[{{channel = "force", fault = "clock", value = {clocks.rate:.3g}}}].',
                channel="force", value=clocks.rate, std=clocks.rate_std,
            )
        )  # fmt: skip
    coarsest = max(run.dt for run in runs)
    if (rated or off) and abs(usual) > max(
        SENSOR.fault_sigma * float(np.median(clocks.late_std)), SENSOR.least_delay * coarsest
    ):
        out.append(_late(usual, float(np.median(clocks.late_std)), "In every run", ""))
    for k in off:
        late = float(clocks.late[k]) - usual
        where = f"In {runs[k].name}"
        out.append(_late(late, float(clocks.late_std[k]), where, runs[k].name))
    return tuple(out)


def _late(late: float, std: float, where: str, run: str) -> Finding:
    """Return the fault of a force that is late throughout a run."""
    way = "late" if late > 0.0 else "early"
    than = " than in the other runs" if run else ""
    late_words = f"{plain(1e3 * abs(late), 3)} ms {'later' if late > 0.0 else 'earlier'}{than}"
    words = (
        f"{where} the force is on record {late_words}: the two loggers did not start together. "
        f'Set it right in study.toml: correct = [{{channel = "force", fault = "delay", value = '
        f"{late:.3g}}}], or {LEFT_OUT}."
        if run
        else f"{where} the force is {plain(1e3 * abs(late), 3)} ms {way} relative to the motion."
    )
    return Finding("delay", "warning", words, channel="force", value=late, std=std, run=run)
