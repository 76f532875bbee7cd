"""The pictures of a building's planned tests, and its table as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.text import quantity
from ..physics.drive import DRIVES
from ..view.style import BLUE, GREEN, VERMILION, Page, look, png
from .added_sensors import place_of
from .outcome import OUTCOMES
from .pictures import SHOWN, outcomes_json, plan_text

if TYPE_CHECKING:
    from .building import BuildingPlan
    from .folder import PlannedRun

Array = NDArray[np.float64]


def building_files(plan: BuildingPlan) -> dict[str, str | bytes]:
    """Return the further files of a plan's folder by name: pictures, and plan.md."""
    files: dict[str, str | bytes] = {
        f"{run.name}.png": png(draw_shaking(run, moved, plan.drive, plan.level), 110)
        for run, moved in zip(plan.runs(), plan.predicted, strict=True)
    }
    text = plan_text(plan, _limits(plan))
    if plan.sensors:
        lines = [f"- {one.sentence()}" for one in plan.sensors]
        text += "\n".join(["", "## Sensors to add", "", *lines, ""])
    return {**files, "plan.md": text, OUTCOMES: outcomes_json(plan)}


def _limits(plan: BuildingPlan) -> list[str]:
    """Return what the largest motion asks of table and building."""
    peaks = [
        max(float(np.max(np.abs(values))) for values in column)
        for column in zip(*((one.x, one.v, one.a) for one in plan.signals), strict=True)
    ]
    moved = max(float(np.max(np.abs(one))) for one in plan.predicted)
    asked = [quantity(peak, unit) for peak, unit in zip(peaks, ("m", "m/s", "m/s2"), strict=True)]
    return [
        f"The tests ask the table for {asked[0]} to either side, {asked[1]} and {asked[2]} at the "
        f"most, and move {place_of(plan.level)} by {quantity(moved, 'm')}, as the model predicts: "
        "nine tenths of what the rig can do, or less. Each begins and ends at rest. Command the "
        "table by its acceleration, or integrate it twice: the displacement comes back to zero."
    ]


def draw_shaking(run: PlannedRun, moved: Array, drive: str, level: str) -> Page:
    """Return the picture of a planned test: ground, first level as predicted, command over time.

    Parameters
    ----------
    run : as the plan's folder holds it
    moved : (n,) displacement of the first level [m]
    level : its name
    drive : the channel of the command, "" where there is none
    """
    every = max(1, len(run.time) // SHOWN)
    rows = [
        ("ground acceleration [m/s2]", run.signals["ground_acceleration"], BLUE),
        (f"displacement of {place_of(level)}, predicted [mm]", 1e3 * moved, GREEN),
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
