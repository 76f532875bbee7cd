"""The pictures of planned tests, on a bench and of a building."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..core.arrays import Array
from ..physics.drive import DRIVES
from ..view.style import BLUE, GREEN, VERMILION, Page, look

if TYPE_CHECKING:
    from .folder import PlannedRun
    from .limits import PrescribedSignals


SHOWN = 4000
"""Samples per line: more are not seen."""


def draw_test(run: PlannedRun, signals: PrescribedSignals, drive: str) -> Page:
    """Return the picture of a planned test: motion and command over time, speed over stroke."""
    every = max(1, len(signals.time) // SHOWN)
    commanded = drive in DRIVES
    with look():
        page = Page(9.2, 3.2 if commanded else 2.2, f"{run.name}: {run.about}", "")
        rows = 2 if commanded else 1
        grid = page.grid(
            rows, 2, top=0.4, bottom=0.5, left=0.7, row_gap=0.5, column_gap=0.8,
            width_ratios=[2.2, 1.0],
        )  # fmt: skip
        axes = page.figure.add_subplot(grid[0, 0])
        axes.plot(signals.time[::every], 1e3 * signals.x[::every], color=BLUE, lw=0.8)
        axes.set_title("displacement [mm]")
        axes.margins(x=0.0)
        if commanded:
            axes.tick_params(labelbottom=False)
            axes = page.figure.add_subplot(grid[1, 0], sharex=axes)
            axes.plot(signals.time[::every], signals.V[::every], color=VERMILION, lw=0.8)
            axes.set_title(f"{DRIVES[drive].name} [{DRIVES[drive].unit}]")
        axes.set_xlabel("time [s]", loc="right", labelpad=0)
        axes = page.figure.add_subplot(grid[:, 1])
        axes.plot(1e3 * signals.x[::every], 1e3 * signals.v[::every], color=BLUE, lw=0.6)
        axes.set_title("velocity [mm/s]")
        axes.set_xlabel("displacement [mm]")
    return page


def draw_shaking(run: PlannedRun, moved: Array, drive: str, level: str) -> Page:
    """Return the picture of a planned test: ground, first level as predicted, command over time.

    Parameters
    ----------
    run : as the plan's folder holds it
    moved : (n,) displacement of the first level [m]
    level : the first level in words
    drive : the channel of the command, "" where there is none
    """
    every = max(1, len(run.time) // SHOWN)
    rows = [
        ("ground acceleration [m/s2]", run.signals["ground_acceleration"], BLUE),
        (f"displacement of {level}, predicted [mm]", 1e3 * moved, GREEN),
    ]
    if drive in DRIVES:
        name, unit = DRIVES[drive].name, DRIVES[drive].unit
        rows.append((f"{name} [{unit}]", run.signals[name], VERMILION))
    with look():
        page = Page(9.2, 1.5 * len(rows), f"{run.name}: {run.about}", "")
        grid = page.grid(len(rows), 1, top=0.4, bottom=0.5, left=0.7, row_gap=0.5)
        first = None
        for k, (title, values, colour) in enumerate(rows):
            axes = page.figure.add_subplot(grid[k, 0], sharex=first)
            first = first or axes
            axes.plot(run.time[::every], values[::every], color=colour, lw=0.8)
            axes.set_title(title)
            axes.margins(x=0.0)
            axes.tick_params(labelbottom=k == len(rows) - 1)
        axes.set_xlabel("time [s]", loc="right", labelpad=0)
    return page
