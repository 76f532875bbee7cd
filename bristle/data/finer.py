"""Between the samples of a decimated run: where a model is evaluated, and the filter behind it.

A force jumps where the motion turns or the command switches, and the measured one went through a
short filter before samples were left out. So does a model's: it is evaluated at several moments per
sample, on the motion between them, and what the same filter leaves is held against the measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from .command_limits import jumps
from .table import Array

MOST = 10
"""Moments per sample at most, for a model costs as many times more. Up to here they are the samples
as recorded, and a model is exact; beyond, one that jumps where the motion turns is off by up to 1 %
of its RMS, others by less than a tenth of that."""


@cache
def hann(parts: int) -> Array:
    """Return the filter of a force (2 parts - 1,), as short as a step of so many parts; sum 1."""
    taps = np.hanning(2 * parts + 1)[1:-1]
    return np.asarray(taps / taps.sum(), dtype=float)


def between(y: Array, rate: Array | None, dt: float, parts: int = 2) -> Array:
    """Return samples (parts (n - 1) + 1,), of which every so many are those of y (n,).

    Parameters
    ----------
    y : (n,) samples, `dt` [s] apart
    rate : (n,) their derivative, for Hermite's cubic; None for a line
    dt : s
    parts : into how many the steps are cut
    """
    s = np.arange(parts) / parts
    shares = [1.0 - s, s]
    columns = [y[:-1], y[1:]]
    if rate is not None:
        bend = s * s * (3.0 - 2.0 * s)
        shares = [1.0 - bend, bend, dt * s * (1.0 - s) ** 2, -dt * s * s * (1.0 - s)]
        columns += [rate[:-1], rate[1:]]
    out = np.empty(parts * (len(y) - 1) + 1)
    out[:-1] = (np.column_stack(columns) @ np.array(shares)).ravel()
    out[::parts] = y
    return out


@dataclass(frozen=True, eq=False)
class Finer:
    """How a model of a decimated run is evaluated: at `parts` moments per sample.

    `since` (n,) says at how many of the moments up to each sample the command had gone over to its
    value there, should it jump: a part of one where it jumped about a moment.
    """

    parts: int
    since: Array

    def of(self, part: slice) -> Finer:
        """Return that of some neighbouring samples."""
        return replace(self, since=self.since[part])

    def halved(self) -> Finer:
        """Return the same with twice as many moments."""
        return Finer(2 * self.parts, 2.0 * self.since - 0.5)

    def motion(self, x: Array, v: Array, a: Array, dt: float) -> tuple[Array, Array, Array]:
        """Return a motion (n,) at all moments (m,): Hermite's cubics, that of `a` by its slope.

        Parameters
        ----------
        x, v, a : (n,) displacement, velocity, acceleration [m, m/s, m/s2]
        dt : s between samples
        """
        slope = np.gradient(a, dt)
        return (
            between(x, v, dt, self.parts), between(v, a, dt, self.parts),
            between(a, slope, dt, self.parts),
        )  # fmt: skip

    def command(self, V: Array) -> Array:
        """Return a command (n,) at all moments (m,): held until it jumps, else on a line."""
        out, moments = between(V, None, 1.0, self.parts), np.arange(self.parts + 1)
        k = np.flatnonzero(jumps(V))[:, None]
        share = np.clip(moments - self.parts + self.since[k], 0.0, 1.0)
        out[self.parts * (k - 1) + moments] = (1.0 - share) * V[k - 1] + share * V[k]
        return out

    def filtered(self, force: Array) -> Array:
        """Return what the filter leaves at the samples (n,) of a force at all moments (m,)."""
        half = self.parts - 1
        begin = 2.0 * force[0] - force[half:0:-1]
        end = 2.0 * force[-1] - force[-2 : -half - 2 : -1]
        around = np.concatenate([begin, force, end])
        rows = np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1)[:: self.parts]
        return np.asarray(rows @ hann(self.parts))
