"""The pictures of a study: its data, and how the error fell."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.arrays import Array
from ..core.text import percent, plural
from ..data.channels import DRIVE
from ..data.checks.motion import velocity_of_run
from ..data.measurement import Measurement
from ..view.style import BLUE, GREEN, GREY, VERMILION, Page, label, look
from .history import CLOSE, HistoryStep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SCALES = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}
_SHOWN = 12000  # samples per line: more are not seen
_ROWS = 8
_TIME = "time, runs one after the other [s]"
_NAMES = 12
"""Part of the width that the name of a run takes: names of shorter runs are left out."""


def draw_data_check(runs: list[Measurement], level: str = "") -> Page:
    """Return the picture of a data check, drawn and not yet written.

    Parameters
    ----------
    runs : one or more
    level : what stands before the damper's displacement and velocity in a building, "" on a bench
    """
    channels = _rows(runs)
    forced = [run for run in runs if "force" in run.channels]
    with look():
        height = max(1.15 * len(channels), 4.6 if forced else 2.0) + 0.3
        page = Page(12.0, height, _heading(runs), _subtitle(runs))
        side = 4.3 if forced else 0.25
        grid = page.grid(
            len(channels), 1, top=0.62, bottom=0.45, left=0.7, right=side, row_gap=0.36
        )
        first = None
        for row, channel in enumerate(channels):
            axes = page.figure.add_subplot(grid[row, 0], sharex=first)
            first = first or axes
            _strip(axes, runs, channel, named=row == 0)
            last = row == len(channels) - 1
            axes.tick_params(labelbottom=last)
            if last:
                axes.set_xlabel(_TIME if len(runs) > 1 else "time [s]", loc="right", labelpad=0)
        if forced:
            over = ("velocity", "displacement")[: max(len(channels), 1)]
            grid = page.grid(len(over), 1, top=0.62, bottom=0.5, left=8.45, right=0.4, row_gap=0.75)
            for row, one in enumerate(over):
                _loops(page.figure.add_subplot(grid[row, 0]), forced, level, one)
    return page


def _heading(runs: list[Measurement]) -> str:
    total = sum(run.duration for run in runs)
    return f"{plural(len(runs), 'run')}, {total:.4g} s together"


def _subtitle(runs: list[Measurement]) -> str:
    rates = sorted({round(run.sampling.rate, 3) for run in runs})
    told = f"{rates[0]:.4g}" if len(rates) == 1 else f"{rates[0]:.4g} to {rates[-1]:.4g}"
    gaps = any(not run.measured.all() for run in runs)
    marked = " Red: not measured, filled in." if gaps else ""
    return f"All runs, one after the other; {told} Hz.{marked}"


def _rows(runs: list[Measurement]) -> list[str]:
    """Return the channels to show, the damper's first."""
    there = dict.fromkeys(channel for run in runs for channel in run.channels)
    first = ["ground_acceleration", "displacement", "velocity", "acceleration", "force", *DRIVE]
    first += [f"base_{one}" for one in ("displacement", "velocity", "acceleration_absolute")]
    named = [channel for channel in first if channel in there]
    return [*named, *(channel for channel in there if channel not in named)][:_ROWS]


def _strip(axes: Axes, runs: list[Measurement], channel: str, *, named: bool) -> None:
    """Draw a channel of all runs, one after the other; above them their names where asked."""
    unit_si = next(run.units[channel] for run in runs if channel in run.channels)
    factor, unit = _SCALES.get(unit_si, (1.0, unit_si))
    total, begin = sum(run.duration for run in runs), 0.0
    every = max(1, sum(len(run.time) for run in runs) // _SHOWN)
    for run in runs:
        time = begin + run.time - run.time[0]
        if channel in run.channels:
            axes.plot(time[::every], factor * run[channel][::every], lw=0.7, color=BLUE)
            missing = ~run.measured
            axes.plot(time[missing], factor * run[channel][missing], ".", ms=3, color=VERMILION)
        if begin > 0.0:
            axes.axvline(begin, color=GREY, lw=0.7)
        if named and run.duration > total / _NAMES:
            axes.annotate(
                run.name, (begin, 1.0), (2, 20), xycoords=axes.get_xaxis_transform(),
                textcoords="offset points", fontsize=8, color=GREY,
            )  # fmt: skip
        begin += run.duration
    axes.set_xlim(0.0, max(total, 1e-9))
    axes.set_title(f"{channel.replace('_', ' ')} [{unit}]", fontsize=9)


def _loops(axes: Axes, runs: list[Measurement], level: str, over: str) -> None:
    """Draw force over velocity or displacement, coloured by the voltage where there is one."""
    x, force, drive = _gathered(runs, level, over)
    if not len(x):
        axes.set_axis_off()
        return
    unit = "mm/s" if over == "velocity" else "mm"
    dots: dict[str, Any] = {"s": 1.5, "alpha": 0.6, "lw": 0}
    if len(drive) == len(x) and np.ptp(drive) > 0.0:
        points = axes.scatter(1e3 * x, force, c=drive, cmap="viridis", **dots)
        bar: Any = axes.figure.colorbar(points, ax=axes, pad=0.03, aspect=25)
        bar.set_label(_drive_label(runs), fontsize=8.5)
        bar.outline.set_visible(False)
    else:
        axes.scatter(1e3 * x, force, color=BLUE, **dots)
    axes.set_xlabel(f"{over} [{unit}]")
    axes.set_title(f"force [N] over {over}", fontsize=9)


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
        every = max(1, len(x) * len(runs) // _SHOWN)
        xs.append(x[::every])
        forces.append(run["force"][::every])
        drive = next((run[one] for one in DRIVE if one in run.channels), None)
        if drive is not None:
            drives.append(drive[::every])
    empty = np.zeros(0)
    join = [np.concatenate(parts) if parts else empty for parts in (xs, forces, drives)]
    return join[0], join[1], join[2]


def draw_staircase(history_steps: Sequence[HistoryStep]) -> Page | None:
    """Return the picture of how the held-out error fell; None with fewer than two errors."""
    steps = [one for one in history_steps if one.share]
    if len(steps) < 2:
        return None
    shares = [100.0 * (one.share or 0.0) for one in steps]
    with look():
        page = Page(9.2, 2.9, "")
        grid = page.grid(1, 1, top=0.25, bottom=0.4, left=0.6, right=0.9)
        axes = page.figure.add_subplot(grid[0, 0])
        axes.stairs(shares, np.arange(len(steps) + 1) - 0.5, baseline=None, color=BLUE, lw=2.6)
        for k, share in enumerate(shares):
            told = percent(share / 100.0)
            label(axes, told, k, share, BLUE, xytext=(0, 5), ha="center", va="bottom")
        if (last := steps[-1].z) and last < CLOSE:  # far from noise z tells no share of it
            axes.axhline(shares[-1] / last, color=GREEN, lw=1.3)
            label(axes, "noise", len(steps) - 0.5, shares[-1] / last, GREEN, xytext=(5, 0))
        axes.set(xlim=(-0.5, len(steps) - 0.5), ylim=(0.0, 1.2 * max(shares)))
        named = [textwrap.fill(f"{one.number}  {one.what}", 92 // len(steps)) for one in steps]
        axes.set_xticks(range(len(steps)), named)
        axes.tick_params(axis="x", length=0)
        axes.grid(visible=False, axis="x")
        axes.set_title("error on held-out runs [% of the force]")
    return page
