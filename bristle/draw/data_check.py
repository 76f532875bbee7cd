"""The picture of the data check: channels over time, force over velocity and displacement."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ..data.channels import DRIVE
from ..data.checks.motion import velocity_of_run
from ..data.measurement import Measurement
from ..data.table import Array

_SCALES = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}
_SHOWN = 4000  # samples per line: more are not seen
_ROWS = 8


def data_check_png(runs: list[Measurement], level: str = "") -> bytes:
    """Return a PNG: the channels of the longest run, and force over motion in all runs."""
    from matplotlib.figure import Figure

    longest = max(runs, key=lambda run: run.duration)
    channels = _rows(longest)
    forced = [run for run in runs if "force" in run.channels]
    figure = Figure(figsize=(12.0, 1.6 * max(len(channels), 3) + 0.6), layout="constrained")
    # Parts of their own: the loops' titles would open gaps between the channels.
    parts: Any = figure.subfigures(1, 2, width_ratios=[2, 1]) if forced else [figure]
    first = None
    for row, channel in enumerate(channels):
        axes = parts[0].add_subplot(len(channels), 1, row + 1, sharex=first)
        first = first or axes
        _line(axes, longest, channel)
        last = row == len(channels) - 1
        axes.tick_params(labelbottom=last)
        axes.set_xlabel("time [s]" if last else "")
    assert first is not None
    first.set_title(f"{longest.name}: {longest.sampling.rate:.4g} Hz, {longest.duration:.4g} s")
    if forced:
        over = ("velocity", "displacement")[: len(channels)]
        for row, one in enumerate(over):
            _loops(parts[1].add_subplot(len(over), 1, row + 1), forced, level, one)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=110)
    return file.getvalue()


def _rows(run: Measurement) -> list[str]:
    """Return the channels to show, the damper's first."""
    first = ["ground_acceleration", "displacement", "velocity", "acceleration", "force", *DRIVE]
    first += [f"base_{one}" for one in ("displacement", "velocity", "acceleration_absolute")]
    named = [channel for channel in first if channel in run.channels]
    return [*named, *(channel for channel in run.channels if channel not in named)][:_ROWS]


def _line(axes, run: Measurement, channel: str) -> None:  # type: ignore[no-untyped-def]
    factor, unit = _SCALES.get(run.units[channel], (1.0, run.units[channel]))
    every = max(1, len(run.time) // _SHOWN)
    axes.plot(run.time[::every], factor * run[channel][::every], lw=0.7)
    missing = ~run.measured
    if missing.any():
        axes.plot(run.time[missing], factor * run[channel][missing], ".", ms=3, color="tab:red")
    axes.set_ylabel(f"{channel.replace('_', ' ')}\n[{unit}]", fontsize=8)
    axes.grid(alpha=0.3)


def _loops(axes, runs: list[Measurement], level: str, over: str) -> None:  # type: ignore[no-untyped-def]
    """Draw force over velocity or displacement, coloured by the voltage where there is one."""
    x, force, drive = _gathered(runs, level, over)
    if not len(x):
        axes.set_axis_off()
        return
    unit = "mm/s" if over == "velocity" else "mm"
    dots = {"s": 1.5, "alpha": 0.6, "lw": 0}
    if len(drive) == len(x) and np.ptp(drive) > 0.0:
        points = axes.scatter(1e3 * x, force, c=drive, cmap="viridis", **dots)
        axes.figure.colorbar(points, ax=axes, label=_drive_label(runs))
    else:
        axes.scatter(1e3 * x, force, **dots)
    axes.set_xlabel(f"{over} [{unit}]")
    axes.set_ylabel("force [N]")
    axes.set_title(f"force over {over}, {len(runs)} run{'s' * (len(runs) > 1)}", fontsize=9)
    axes.grid(alpha=0.3)


def _drive_label(runs: list[Measurement]) -> str:
    """Return what colours the loops: the drive's name and unit, all of them where runs differ."""
    found = [next((d for d in DRIVE if d in run.channels), "") for run in runs]
    units = {d: run.units[d] for d, run in zip(found, runs, strict=True) if d}
    return " or ".join(f"{name} [{unit}]" for name, unit in units.items())


def _gathered(runs: list[Measurement], level: str, over: str) -> tuple[Array, Array, Array]:
    xs, forces, drives = [], [], []
    for run in runs:
        if over == "velocity":
            x = velocity_of_run(run, level)
        else:
            x = run.channels.get(f"{level}_displacement" if level else "displacement")
        if x is None:
            continue
        every = max(1, len(x) * len(runs) // (3 * _SHOWN))
        xs.append(x[::every])
        forces.append(run["force"][::every])
        drive = next((run[one] for one in DRIVE if one in run.channels), None)
        if drive is not None:
            drives.append(drive[::every])
    empty = np.zeros(0)
    join = [np.concatenate(parts) if parts else empty for parts in (xs, forces, drives)]
    return join[0], join[1], join[2]
