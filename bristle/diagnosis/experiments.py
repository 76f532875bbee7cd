"""Which run would tell rivals apart: the motion and voltage in which their forces differ most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array
from ..identification.fit import Search
from ..identification.problem import Problem, Run, at_means
from ..model.model import Model
from ..physics.drive import DRIVES, VOLTAGE, Drive
from .rule import BENCH

LENGTH = 12.0
"""Length of a proposed run [s]."""

PER_PERIOD = 20.0
"""Samples in a period of the motion at the least, as tests of `bristle plan` have them."""

SPIKES = 0.999
"""Share of the samples whose acceleration the largest one is taken of: the others may be noise."""

ZERO = 0.02
"""Share of the largest voltage below which the smallest is zero, but for its noise."""


@dataclass(frozen=True)
class Experiment:
    """A proposed run: a sine or a chirp under a command.

    `amplitude` m, `low`, `high` Hz (equal for a sine), `levels` of the command `drive` in its unit
    (low, high: equal where held, else switched every `switch` s), `contrast` the
    smallest RMS difference between any two rivals' forces, each refitted, in units of the force's
    noise; `deviations` the same over the whole run, in standard deviations.
    """

    amplitude: float
    low: float
    high: float
    levels: tuple[float, float]
    switch: float
    contrast: float = 0.0
    deviations: float = 0.0
    drive: Drive | None = VOLTAGE

    def sentence(self) -> str:
        """Return the run as a sentence of an experiment's plan."""
        if self.deviations < BENCH.separating_sigma:
            levels = f" and levels of the {self.drive.name}" if self.drive else ""
            return (
                f"No run within the strokes, speeds{',' if self.drive else ' and'} accelerations"
                f"{levels} so far would distinguish them: at best the forces "
                f"differ by {self.deviations:.1f} standard deviations over "
                f"{LENGTH:g} s. Use a wider range."
            )
        motion = (
            f"a sine of {1e3 * self.amplitude:.3g} mm at {self.low:.3g} Hz"
            if self.low == self.high
            else f"a sweep of {1e3 * self.amplitude:.3g} mm from {self.low:.3g} to "
            f"{self.high:.3g} Hz"
        )
        return (
            f"Run {motion}{self._driven()} for {LENGTH:g} s: then the forces of the alternatives "
            f"differ by {self.contrast:.2g} times the noise, even if they are fitted again."
        )

    def _driven(self) -> str:
        """Return what the command does meanwhile."""
        if self.drive is None:
            return ""
        (low, high), unit = self.levels, self.drive.unit
        if low == high:
            return f" at {low:.3g} {unit}"
        switched = f"switched between {low:.3g} and {high:.3g} {unit} every {self.switch:.3g} s"
        return f" with the {self.drive.name} {switched}"

    def signals(self, dt: float) -> tuple[Array, Array, Array, Array]:
        """Return x, v, a (n,) [m, m/s, m/s2] and V (n,) [V] of the run."""
        t = np.arange(round(LENGTH / dt) + 1) * dt
        rate = 2.0 * np.pi * (self.high - self.low) / LENGTH
        speed = 2.0 * np.pi * self.low + rate * t
        phase = 2.0 * np.pi * self.low * t + 0.5 * rate * t * t
        x = self.amplitude * np.sin(phase)
        v = self.amplitude * speed * np.cos(phase)
        a = self.amplitude * (rate * np.cos(phase) - speed**2 * np.sin(phase))
        low, high = self.levels
        V = (
            np.where((t // self.switch) % 2 == 0, low, high)
            if low != high
            else np.full_like(t, low)
        )
        return x, v, a, V


def separating(models: Sequence[Model], problem: Problem) -> Experiment:
    """Return the run that separates rival models best, within what the rig has done already.

    Amplitudes, speeds, accelerations and levels of the command stay within those of the runs at
    hand, frequencies within what their sampling shows.
    """
    rivals = [_Rival(model, problem) for model in models]
    noise = float(np.median([run.noise for run in problem.runs]))
    dt = min(run.dt for run in problem.runs)
    plans = []
    for plan in _plans(problem):
        run = _run(plan, dt, noise)
        run = replace(run, extra=at_means([one.extra for one in problem.runs], len(run.x)))
        contrast = _contrast(rivals, run)
        far = contrast * float(np.sqrt(len(run.x)))
        plans.append(replace(plan, contrast=contrast, deviations=far))
    return max(plans, key=lambda plan: plan.contrast)


def _plans(problem: Problem) -> list[Experiment]:
    x_top = max(float(np.max(np.abs(run.x - run.x.mean()))) for run in problem.runs)
    V_low = min(float(run.V.min()) for run in problem.runs)
    V_top = max(float(run.V.max()) for run in problem.runs)
    V_low = 0.0 if abs(V_low) < ZERO * V_top else V_low
    drives = [((V_low, V_low), 1.0), ((V_top, V_top), 1.0)]
    drives += [((V_low, V_top), 0.25), ((V_low, V_top), 2.0)] if V_top > V_low else []
    plans = []
    for amplitude in (x_top, 0.3 * x_top, 0.1 * x_top):
        top = _highest(problem, amplitude)
        for low, high in ((0.05 * top, top), (0.1 * top, 0.1 * top), (top, top)):
            kind = DRIVES[problem.runs[0].drive] if V_top > 0.0 else None
            plans += [Experiment(amplitude, low, high, *drive, drive=kind) for drive in drives]
    return plans


def _highest(problem: Problem, amplitude: float) -> float:
    """Return the highest frequency [Hz] of a motion of an amplitude [m] that the rig can do."""
    v_top = max(float(np.max(np.abs(run.v))) for run in problem.runs)
    a_top = max(float(np.quantile(np.abs(run.a), SPIKES)) for run in problem.runs)
    rate = 1.0 / min(run.dt for run in problem.runs)
    moved = min(v_top / amplitude, float(np.sqrt(a_top / amplitude))) / (2.0 * np.pi)
    return min(moved, rate / PER_PERIOD)


def _run(plan: Experiment, dt: float, noise: float) -> Run:
    x, v, a, V = plan.signals(dt)
    return Run("plan", dt, x, v, a, V, np.zeros_like(x), noise, np.zeros((0, len(x), 4)), skip=0)


class _Rival:
    """A model, and how firmly the runs at hand hold its parameters."""

    def __init__(self, model: Model, problem: Problem) -> None:
        self.model = model
        known = Search(problem, model, problem.expectation(model), model.free()).sensitivities()
        self.information = known.T @ known

    def on(self, run: Run) -> tuple[Array, Array]:
        """Return the force (n,) of a planned run and its sensitivities (n, p), in noises."""
        nothing = np.zeros_like(run.x)
        expected = [(nothing, np.full_like(run.x, run.noise), np.zeros((0, len(run.x))))]
        search = Search(Problem([run]), self.model, expected, self.model.free())
        return -search.residuals(search.start), -search.sensitivities()


def _contrast(rivals: Sequence[_Rival], run: Run) -> float:
    """Return the smallest difference that any rival leaves to any other's force, in noises.

    The rival may move its parameters as far as the runs at hand allow: a difference that a refit
    absorbs separates nothing.
    """
    shown = [rival.on(run) for rival in rivals]
    least = np.inf
    for j, (own, J) in enumerate(shown):
        normal = J.T @ J + rivals[j].information
        for i, (other, _) in enumerate(shown):
            if i != j:
                apart = other - own
                gradient = J.T @ apart
                taken = float(gradient @ np.linalg.lstsq(normal, gradient, rcond=None)[0])
                least = min(least, max(0.0, float(apart @ apart) - taken))
    return float(np.sqrt(least / len(run.x)))
