"""What a rig can do: limits of its actuator, its amplifier and its recorder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from ..errors import StudyError
from ..identify.model import Run
from .motions import COMMANDS

RESERVE = 0.9
"""Part of each limit that a planned test uses: a controller overshoots, a model errs."""

SECONDS, RUNS = 12.0, 4
"""Length [s] and number of planned tests."""

SLOWEST = 0.2
"""Lowest frequency [Hz] of a planned motion where no band is given."""

SPAN = 40.0
"""Highest over lowest frequency of a band where none is given, at the most."""

ZERO = 0.02
"""Share of the largest command below which the smallest is zero, but for its noise."""

SIZES = {
    "stroke": "m", "speed": "m/s", "acceleration": "m/s2", "force": "N", "heat": "J",
    "duration": "s", "pause": "s", "rate": "Hz", "damper_stroke": "m", "drift": "m",
}  # fmt: skip
"""Units of the limits that are quantities, by the names that rig.toml gives them."""


@dataclass(frozen=True)
class RigLimits:
    """What a rig can do, in SI; infinite where nothing is known.

    Attributes
    ----------
    stroke, speed, acceleration : float
        Of the motion, to either side [m, m/s, m/s2]; of the table, where a building stands on it.
    force : float
        Of the actuator [N].
    band : tuple of float
        Lowest and highest frequency [Hz].
    command : tuple of float
        Least and largest value of the command, in its unit.
    slew : float
        How fast the command can change, in its unit per second.
    levels : tuple of float
        The values that the command can take, where it can take these alone.
    duration, pause : float
        Longest test, and the rest between two of them [s].
    runs : int
        How many tests.
    heat : float
        Energy that the damper may absorb in a test [J].
    rate : float
        Samples per second of the controller.
    motions, commands : tuple of str
        The waveforms that the controller has: of `motions.MOTIONS` and `motions.COMMANDS`.
    damper_stroke, drift : float
        Of a building: the motion of its damper, and of its storeys, to either side [m].
    """

    stroke: float
    speed: float
    acceleration: float = inf
    force: float = inf
    band: tuple[float, float] = (0.0, inf)
    command: tuple[float, float] = (0.0, 0.0)
    slew: float = inf
    levels: tuple[float, ...] = ()
    duration: float = SECONDS
    pause: float = 0.0
    runs: int = RUNS
    heat: float = inf
    rate: float = 500.0
    motions: tuple[str, ...] = ("sine", "sweep", "triangle", "multisine")
    commands: tuple[str, ...] = tuple(COMMANDS)
    damper_stroke: float = inf
    drift: float = inf

    def check(self) -> None:
        """Refuse limits that allow no test.

        Raises
        ------
        StudyError
            Saying which limit, and what would be right.
        """
        for name, unit in SIZES.items():
            if name != "pause" and not getattr(self, name) > 0.0:
                raise StudyError(
                    f"{name} = {getattr(self, name):g} {unit}: these limits allow no motion; more "
                    "than 0 is right."
                )
        if not 0.0 <= self.band[0] < self.band[1]:
            raise StudyError(
                f"band = {self.band[0]:g} to {self.band[1]:g} Hz allows no motion; the lowest "
                "frequency first, then a higher one."
            )
        if self.command[0] > self.command[1]:
            raise StudyError(
                f"command = {self.command[0]:g} to {self.command[1]:g}: the least value first."
            )
        if not self.slew > 0.0:
            raise StudyError(f"slew = {self.slew:g}: a command that cannot change has one level.")
        if self.runs < 1:
            raise StudyError(f"runs = {self.runs}: 1 or more is right.")
        if self.duration < 2.0:
            raise StudyError(f"duration = {self.duration:g} s: 2 s or more is right.")
        if not self.pause >= 0.0:
            raise StudyError(f"pause = {self.pause:g} s: 0 or more is right.")
        if self.band[1] * self.duration < 1.0:
            raise StudyError(
                f"band = {self.band[0]:g} to {self.band[1]:g} Hz: a test of {self.duration:g} s "
                "holds not one period of it; a longer duration, or a higher band, is right."
            )
        if self.rate * self.duration < 400.0:
            raise StudyError(
                f"{self.rate:g} samples per second in {self.duration:g} s are "
                f"{self.rate * self.duration:.0f} samples; a fit needs 400 or more."
            )

    @property
    def usable_band(self) -> tuple[float, float]:
        """The frequencies [Hz] that tests use: those at which the rig moves by a fair amount."""
        low = max(self.band[0], SLOWEST, 3.0 / self.duration)
        low = min(low, max(0.5 * self.band[1], self.band[0]))
        # Above this the speed leaves a twentieth of the stroke.
        fastest = self.speed / (2.0 * np.pi * 0.05 * self.stroke)
        high = min(self.band[1], SPAN * low, 0.05 * self.rate, max(fastest, 2.0 * low))
        return low, max(high, low)

    def nearest(self, value: float) -> float:
        """Return the value that the command can take nearest to one that is wanted."""
        value = min(max(value, self.command[0]), self.command[1])
        return min(self.levels, key=lambda level: abs(level - value)) if self.levels else value


def limits_of_runs(runs: Sequence[Run]) -> RigLimits:
    """Return what a rig has done already: the limits of a plan where nobody gives others."""
    low = min(float(run.V.min()) for run in runs)
    high = max(float(run.V.max()) for run in runs)
    return RigLimits(
        max(float(np.ptp(run.x)) for run in runs) / 2.0 / RESERVE,
        max(float(np.max(np.abs(run.v))) for run in runs) / RESERVE,
        max(float(np.quantile(np.abs(run.a), 0.999)) for run in runs) / RESERVE,
        command=(0.0 if abs(low) < ZERO * high else low, high),
        duration=max(2.0, min(SECONDS, max(len(run.x) * run.dt for run in runs))),
        rate=1.0 / min(run.dt for run in runs),
    )


def with_given(limits: RigLimits, given: Mapping[str, Any]) -> RigLimits:
    """Return limits with those that were given in their place, checked.

    Raises
    ------
    StudyError
        If they allow no test.
    """
    out = replace(limits, **given)
    out.check()
    if not out.levels:
        return out
    low, high = out.command if "command" in given else (min(out.levels), max(out.levels))
    levels = tuple(level for level in out.levels if low <= level <= high)
    if not levels:
        wrong = ", ".join(f"{level:g}" for level in out.levels)
        raise StudyError(f"levels = {wrong}: none of them is in command = {low:g} to {high:g}.")
    return replace(out, levels=levels, command=(min(levels), max(levels)))
