"""Which run would tell rivals apart: the motion and voltage in which their forces differ most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Model, Problem

Array = NDArray[np.float64]

LENGTH = 12.0
"""Length of a proposed run [s]."""


@dataclass(frozen=True)
class Experiment:
    """A proposed run: a sine or a chirp under a voltage.

    `amplitude` m, `low`, `high` Hz (equal for a sine), `voltage` V (low, high: equal where held,
    else switched every `switch` s), `contrast` the smallest difference between any two rivals'
    forces, in units of the force's noise.
    """

    amplitude: float
    low: float
    high: float
    voltage: tuple[float, float]
    switch: float
    contrast: float

    def words(self) -> str:
        """Return the run as a sentence of an experiment's plan."""
        motion = (
            f"a sine of {1e3 * self.amplitude:.3g} mm at {self.low:.3g} Hz"
            if self.low == self.high
            else f"a sweep of {1e3 * self.amplitude:.3g} mm from {self.low:.3g} to "
            f"{self.high:.3g} Hz"
        )
        low, high = self.voltage
        drive = (
            f"at {low:.3g} V"
            if low == high
            else f"with the voltage switched between {low:.3g} and {high:.3g} V every "
            f"{self.switch:.3g} s"
        )
        return (
            f"Run {motion} {drive} for {LENGTH:g} s: there the rivals' forces differ by "
            f"{self.contrast:.1f} times the noise."
        )

    def signals(self, dt: float) -> tuple[Array, Array, Array, Array]:
        """Return x, v, a (n,) [m, m/s, m/s2] and V (n,) [V] of the run."""
        t = np.arange(round(LENGTH / dt) + 1) * dt
        rate = 2.0 * np.pi * (self.high - self.low) / LENGTH
        speed = 2.0 * np.pi * self.low + rate * t
        phase = 2.0 * np.pi * self.low * t + 0.5 * rate * t * t
        x = self.amplitude * np.sin(phase)
        v = self.amplitude * speed * np.cos(phase)
        a = self.amplitude * (rate * np.cos(phase) - speed**2 * np.sin(phase))
        low, high = self.voltage
        V = (
            np.where((t // self.switch) % 2 == 0, low, high)
            if low != high
            else np.full_like(t, low)
        )
        return x, v, a, V


def separating(models: Sequence[Model], problem: Problem) -> Experiment:
    """Return the run that separates rival models best, within what the rig has done already.

    Amplitudes, speeds and voltages stay within those of the runs at hand.
    """
    x_top = max(float(np.max(np.abs(run.x - run.x.mean()))) for run in problem.runs)
    v_top = max(float(np.max(np.abs(run.v))) for run in problem.runs)
    V_low = min(float(run.V.min()) for run in problem.runs)
    V_top = max(float(run.V.max()) for run in problem.runs)
    noise = float(np.median([run.noise for run in problem.runs]))
    dt = problem.runs[0].dt
    best: Experiment | None = None
    for amplitude in (x_top, 0.3 * x_top, 0.1 * x_top):
        top = v_top / (2.0 * np.pi * amplitude)
        for low, high in ((0.05 * top, top), (0.1 * top, 0.1 * top), (top, top)):
            drives = [((V_low, V_low), 1.0), ((V_top, V_top), 1.0)]
            drives += [((V_low, V_top), 0.25), ((V_low, V_top), 2.0)] if V_top > V_low else []
            for voltage, switch in drives:
                plan = Experiment(amplitude, low, high, voltage, switch, 0.0)
                forces = [
                    problem.bench(model).force(*plan.signals(dt), dt, model.values)
                    for model in models
                ]
                contrast = min(
                    float(np.sqrt(np.mean((one - other) ** 2))) / noise
                    for i, one in enumerate(forces)
                    for other in forces[:i]
                )
                if best is None or contrast > best.contrast:
                    best = Experiment(amplitude, low, high, voltage, switch, contrast)
    assert best is not None
    return best
