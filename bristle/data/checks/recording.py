"""Looks at how channels were recorded: lines that nothing drives, averages before storing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from ...quantity import plain, quantity
from ..channels import DRIVE
from ..corrections import Correction
from ..interpolated import interpolated
from ..measurement import Measurement
from ..moving_average import moving_average
from ..spectral_lines import SpectralLine, of_one_mains, spectral_lines
from .finding import Finding


def check_recording(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield what the spectra of the channels of runs say of how they were recorded.

    Parameters
    ----------
    runs : with all samples of their files: fewer show neither nulls nor lines where they are
    """
    found = [spectral_lines(run.channels, run.step) for run in runs]
    found = of_one_mains(found, [run.step for run in runs], [len(run.time) for run in runs])
    # 300 Hz is a harmonic of either mains: only another line tells which.
    of_either = not any(one.mains and one.order * one.mains % 300.0 for one in chain(*found))
    for run, lines in zip(runs, found, strict=True):
        yield from _of_run(run, lines, "50 or 60 Hz" if of_either else "")


def _of_run(run: Measurement, lines: Sequence[SpectralLine], mains: str) -> Iterator[Finding]:
    for channel in dict.fromkeys(line.channel for line in lines):
        yield _of_lines(run, [line for line in lines if line.channel == channel], mains)
    if run.sampling.resampled:
        return  # its samples are means of others
    yield from _interpolated(run)
    for channel, values in run.channels.items():
        found = None if channel in DRIVE else moving_average(values, run.step)
        if found is not None:
            yield Finding(
                "averaged",
                "warning",
                f"{channel} is a moving average of {found.length} samples "
                f"({plain(1e3 * found.length * run.step)} ms): its spectrum has {found.nulls} "
                "nulls at equal distances. Jumps are rounded that long, and a delay or lag of "
                "that size may be the average's.",
                "Store the channel as it was sampled, and measure again if you can.",
                run.name,
                channel,
                found.length * run.step,
            )


def _interpolated(run: Measurement) -> Iterator[Finding]:
    """Yield the channels that were interpolated to the run's rate; a command may be straight."""
    for channel, values in run.channels.items():
        of_one = 0.0 if channel in DRIVE else interpolated(values)
        if of_one:
            rate = plain(run.sampling.rate / of_one, 3)
            yield Finding(
                "interpolated",
                "warning",
                f"{channel} is interpolated: {rate} samples per second were measured, those "
                "between lie on straight lines. Their noise is no measured one, and what is "
                f"faster than {plain(0.5 * run.sampling.rate / of_one, 3)} Hz is not in them.",
                f"Store what was measured, or set rate = {rate} in study.toml.",
                run.name,
                channel,
                of_one,
            )


def _of_lines(run: Measurement, lines: Sequence[SpectralLine], mains: str) -> Finding:
    """Return the finding of all lines on one channel, the largest first."""
    ordered = sorted(lines, key=lambda one: -one.amplitude)
    channel, unit = ordered[0].channel, run.units[ordered[0].channel]
    rms = float(np.std(run[channel])) or 1.0
    told = [
        f"{plain(one.frequency, 4)} Hz of {quantity(one.amplitude, unit, 2, fine=True)} "
        f"({_origin(one, run, mains)})"
        for one in ordered
    ]
    what = "a line at" if len(told) == 1 else "lines at"
    return Finding(
        "lines",
        "warning",
        f"{channel} has {what} {', '.join(told)}; the largest is "
        f"{plain(100.0 * ordered[0].amplitude / rms, 2)} % of its RMS, and no motion drives it.",
        "`bristle study check FOLDER --correct` takes it off. Look for a loop of the ground, or a "
        "shield that is open.",
        run.name,
        channel,
        ordered[0].amplitude,
        tuple(Correction(channel, "line", round(one.frequency, 4)) for one in ordered),
    )


def _origin(line: SpectralLine, run: Measurement, mains: str) -> str:
    """Return where a line is from, as far as its frequency tells: `mains` is of either, or ""."""
    if not line.mains:
        return "on this channel alone"
    whole = f"the mains of {mains or f'{line.mains:g} Hz'}"
    if line.order > 1:
        whole = f"{plain(line.order * line.mains, 4)} Hz of {whole}"
    if line.folded:
        return f"{whole}, aliased at {plain(run.sampling.rate, 4)} samples per second"
    return whole
