"""From a measurement to a run that a model can be held against."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core.arrays import Array
from ..data.corrections import LEFT_OUT
from ..data.cut_off import derived_velocity
from ..data.decimate import slow
from ..data.measurement import Measurement
from ..errors import RecordError
from ..physics.drive import VOLTAGE
from .problem import Run
from .run_start import start_of
from .smoothing import posterior_draws, smooth, smooth_drive

SHORTEST = 200
"""Fewest samples of a run that a fit makes sense of."""

DIGITS = 1e-8
"""Share of a channel's standard deviation below which the smoother's covariances lose all digits:
where a simulation has no noise, the first samples of the velocity came out 300 times too large."""


def prepare(measurement: Measurement, draws: int = 24, seed: int = 0) -> Run:
    """Return a bench measurement as a run: one smoothed motion, its uncertainty, the force.

    Parameters
    ----------
    measurement : Measurement
        With the force, and displacement or velocity or both; a velocity that was computed from the
        displacement is left out. The command, a voltage or another one, may be missing (taken as
        0); it is smoothed, steps kept.
    draws : int
        How many draws of the motion's and the voltage's error to keep.

    Raises
    ------
    RecordError
        If a channel that is needed is missing, is not finite or does not change, or there are fewer
        than `SHORTEST` samples.
    """
    _refuse(measurement)
    n, dt = len(measurement.time), measurement.step
    noise = (_noise_of(measurement, "displacement"), _noise_of(measurement, "velocity"))
    x, v = _as_measured(measurement, "displacement"), _as_measured(measurement, "velocity")
    if derived_velocity(measurement):
        v = None  # it holds nothing that the displacement does not, and may be half a sample late
    have = (x is not None, v is not None)
    motion = smooth(x, v, dt, noise)
    error = np.zeros((draws, n, 4))
    error[:, :, :3] = posterior_draws(n, dt, noise, motion.jerk, have, draws, seed, motion)
    drive = measurement.drive
    V = np.zeros(n)
    if drive:
        V, error[:, :, 3] = smooth_drive(
            measurement[drive], measurement.noise.get(drive, 0.0), dt, draws, seed + 1
        )
    # Where one of two channels of the motion is lost, the other one tells it.
    alone = tuple(c for c in ("displacement", "velocity") if measurement.has(c))
    needed = ("force", drive, *(alone if len(alone) == 1 else ()))
    force = measurement["force"]
    start = start_of(motion.x, motion.v, force, dt)
    return Run(
        measurement.name, dt, motion.x, motion.v, motion.a, V, force,
        _noise_of_force(measurement), error, start.first, measurement.left_out(*needed),
        drive or VOLTAGE.name, measurement.labels, start.rest, start.opening, measurement.extra,
        finer=measurement.finer or slow(motion.v, motion.a, dt),
        untold=untold(measurement, ("force",)),
    )  # fmt: skip


def _as_measured(measurement: Measurement, channel: str) -> Array | None:
    """Return a channel with NaN where a sample was filled in or lost, None if it is not there."""
    if not measurement.has(channel):
        return None
    return np.where(measurement.valid(channel), measurement[channel], np.nan)


def _noise_of(measurement: Measurement, channel: str) -> float:
    """Return the noise of a channel of the motion; one without any has what the smoother can do."""
    if not measurement.has(channel):
        return 0.0
    least = DIGITS * float(np.std(measurement[channel]))
    return max(measurement.noise.get(channel, 0.0), least)


def untold(measurement: Measurement, channels: Iterable[str]) -> tuple[str, ...]:
    """Return those of some channels whose noise nobody knows, neither stated nor to be told."""
    facts = {name: measurement.noise_facts.get(name) for name in channels}
    return tuple(name for name, one in facts.items() if one is not None and not one.known)


def _noise_of_force(measurement: Measurement) -> float:
    """Return the force's noise [N]; one without any gets what rounding leaves."""
    noise = measurement.noise.get("force", 0.0)
    return max(noise, 1e-6 * float(np.std(measurement["force"])))


def refuse_short(measurement: Measurement) -> None:
    """Refuse a run, or a piece between gaps, of fewer than `SHORTEST` samples."""
    if len(measurement.time) < SHORTEST:
        raise RecordError(
            f"{measurement.name}: {len(measurement.time)} samples; a fit needs {SHORTEST} or more "
            f"without a gap. Record longer runs without gaps, or {LEFT_OUT}."
        )


def _refuse(measurement: Measurement) -> None:
    """Refuse a run that no model can be held against."""
    name = measurement.name
    if not measurement.has("force"):
        raise RecordError(f"{name}: no force was measured; a bench run needs one.")
    if not (measurement.has("displacement") or measurement.has("velocity")):
        raise RecordError(f"{name}: neither displacement nor velocity was measured.")
    refuse_short(measurement)
    for channel in ("force", "displacement", "velocity"):
        if not measurement.has(channel):
            continue
        values = measurement[channel]
        if not np.isfinite(values).all():
            raise RecordError(
                f"{name}: {channel} holds {np.count_nonzero(~np.isfinite(values))} values that are "
                "not finite; cut the run there, or leave the fields empty."
            )
        if np.ptp(values) == 0.0:
            raise RecordError(
                f"{name}: {channel} is {values[0]:g} {measurement.units.get(channel, '')} "
                "throughout; nothing can be identified from it. Leave the run or the channel out."
            )
