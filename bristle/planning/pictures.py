"""The pictures of a plan's tests, and its table as text."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from ..core.text import quantity
from ..physics.drive import DRIVES
from ..view.style import BLUE, VERMILION, Page, look, png
from .outcome import HEADER, OUTCOMES

if TYPE_CHECKING:
    from .folder import PlannedRun
    from .limits import Signals
    from .plan import Plan

SHOWN = 4000
"""Samples per line: more are not seen."""


def plan_files(plan: Plan) -> dict[str, str | bytes]:
    """Return the further files of a plan's folder by name: pictures, and plan.md."""
    pictures: dict[str, str | bytes] = {
        f"{run.name}.png": png(draw_test(run, signals, plan.drive), 110)
        for run, signals in zip(plan.runs(), plan.signals, strict=True)
    }
    return {**pictures, "plan.md": plan_text(plan, _limits(plan)), OUTCOMES: outcomes_json(plan)}


def outcomes_json(plan: Plan) -> str:
    """Return the table of what the tests will show, as a report takes it."""
    told = {"header": HEADER, "rows": [one.cells() for one in plan.outcomes]}
    return json.dumps(told, indent=2, ensure_ascii=False) + "\n"


def plan_text(plan: Plan, limits: list[str]) -> str:
    """Return the plan as a page of text; `limits` says what it asks of the rig."""
    lines = [f"# Tests for {plan.study or 'a new rig'}", "", *limits]
    if plan.limits.pause:
        lines.append(f"The rig rests for {quantity(plan.limits.pause, 's')} between two of them.")
    lines += ["", "## Runs", ""]
    lines += ["| run | for | what |", "|---|---|---|"]
    lines += [
        f"| [{run.name}]({run.name}.csv) | {'training' if run.role == 'train' else 'held out'} | "
        f"{run.about} |"
        for run in plan.runs()
    ]
    lines += ["", "## What they will show", "", f"| {' | '.join(HEADER)} |", "|---|---|---|---|"]
    lines += [f"| {' | '.join(one.cells())} |" for one in plan.outcomes]
    return "\n".join([*lines, ""])


def _limits(plan: Plan) -> list[str]:
    """Return what the largest motion asks of the rig."""
    stroke = max(float(np.max(np.abs(one.x))) for one in plan.signals)
    speed = max(float(np.max(np.abs(one.v))) for one in plan.signals)
    acceleration = max(float(np.max(np.abs(one.a))) for one in plan.signals)
    return [
        f"The tests ask for {1e3 * stroke:.3g} mm to either side, {1e3 * speed:.3g} mm/s and "
        f"{acceleration:.3g} m/s2 at the most: nine tenths of what the rig can do, or less. Each "
        f"begins and ends at rest."
    ]


def draw_test(run: PlannedRun, signals: Signals, drive: str) -> Page:
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
