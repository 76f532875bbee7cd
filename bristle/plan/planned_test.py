"""A planned test: a motion and a command, as large as the rig's limits allow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..data.command_limits import limited
from ..physics.drive import Drive
from ..quantity import quantity
from .motions import Command, Waveform, command_of, shape_of
from .rig_limits import RESERVE, RigLimits

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Signals:
    """What a test prescribes: `time`, `x`, `v`, `a`, `V` (n,) [s, m, m/s, m/s2, the command]."""

    time: Array
    x: Array
    v: Array
    a: Array
    V: Array

    @property
    def dt(self) -> float:
        """The sampling step [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Test:
    """A motion under a command.

    `share` of what the limits of the motion allow; `seconds` its length.
    """

    __test__ = False  # pytest takes a class of this name for tests

    motion: Waveform
    command: Command
    share: float = 1.0
    seconds: float = 12.0

    def signals(self, limits: RigLimits, rate: float = 0.0) -> Signals:
        """Return what the test prescribes within the limits, but for those of force and heat.

        Parameters
        ----------
        limits : of the rig
        rate : samples per second; 0 for that of the limits
        """
        t = np.arange(round(self.seconds * (rate or limits.rate)) + 1) / (rate or limits.rate)
        x, v, a = shape_of(self.motion, t)
        size = self.share * RESERVE * min(
            limits.stroke,
            limits.speed / float(np.max(np.abs(v))),
            limits.acceleration / float(np.max(np.abs(a))),
        )  # fmt: skip
        V = command_of(self.command, t)
        if limits.levels:
            levels = np.array(sorted(limits.levels))
            V = levels[np.argmin(np.abs(V[:, None] - levels), axis=1)]
        V = limited(V, float(t[1]), "slew", RESERVE * limits.slew)
        return Signals(t, size * x, size * v, size * a, V)

    def words(self, signals: Signals, drive: Drive | None) -> str:
        """Return the test in words; `drive` is the command's channel, None where there is none."""
        motion = self.motion.words(quantity(float(np.max(np.abs(signals.x))), "m"))
        if drive is None:
            return motion
        return f"{motion}, {self.command.words(drive.name, drive.unit)}"

    def smaller(self, factor: float) -> Test:
        """Return the test with a smaller motion."""
        return replace(self, share=self.share * factor)
