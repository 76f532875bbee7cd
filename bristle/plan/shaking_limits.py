"""What a shaking table and the building on it have done already: the limits of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..bridge.in_building import House
from ..data.measurement import Measurement
from ..diagnose.opening import Opening
from ..identify.drive import smooth_steps
from ..physics.building import frequencies
from .building_sites import largest_motion
from .ground import displacement_of
from .rig_limits import RESERVE, SLOWEST, ZERO, RigLimits

LONGEST = 30.0
"""Longest test [s] where nobody says."""

NEARLY = 0.02
"""Share of a run for which a command is at its largest level, or its least, at the least."""

BELOW, ABOVE = 0.3, 1.3
"""Band of the table, over the first and the last natural frequency."""


def limits_of_shaking(
    runs: Sequence[Measurement], sites: Mapping[str, Opening], house: House
) -> RigLimits:
    """Return what table, building and amplifier have done already.

    Parameters
    ----------
    runs : that were measured
    sites : of the building, with their runs
    house : the building
    """
    tones = frequencies(house.building)
    low = max(SLOWEST, BELOW * tones[0])
    grounds = [(run["ground_acceleration"], run.step) for run in runs]
    x = [displacement_of(one, step, low) for one, step in grounds]
    v = [np.gradient(one, step) for one, (_, step) in zip(x, grounds, strict=True)]
    reached = {
        site: largest_motion([*one.problem.runs, *one.held_out.runs])[0] / RESERVE
        for site, one in sites.items()
    }
    drifts = [most for site, most in reached.items() if site.startswith("storey")]
    strokes = [most for site, most in reached.items() if not site.startswith("storey")]
    return RigLimits(
        max(float(np.max(np.abs(one))) for one in x) / RESERVE,
        max(float(np.max(np.abs(one))) for one in v) / RESERVE,
        max(float(np.quantile(np.abs(one), 0.999)) for one, _ in grounds) / RESERVE,
        band=(low, max(ABOVE * tones[-1], 2.0 * low)), command=_commands(runs),
        duration=min(LONGEST, max(run.duration for run in runs)), rate=1.0 / runs[0].step,
        motions=("sweep", "multisine"), commands=("held", "switched", "random"),
        damper_stroke=max(strokes, default=np.inf), drift=max(drifts, default=np.inf),
    )  # fmt: skip


def _commands(runs: Sequence[Measurement]) -> tuple[float, float]:
    """Return the least and the largest command of runs, without the noise on their record."""
    lows, highs = [0.0], [0.0]
    for run in runs:
        if run.drive:
            noise = run.noise.get(run.drive, 0.0)
            command, _ = smooth_steps(run[run.drive], noise, run.step)
            lows.append(float(np.quantile(command, NEARLY)) + noise)
            highs.append(float(np.quantile(command, 1.0 - NEARLY)) - noise)
    low, high = min(lows[1:], default=0.0), max(highs)
    return (0.0 if abs(low) < ZERO * high else low), high
