"""The pictures of a study: its data check, a run, and how the error fell."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from ..comparison.names import effect_name
from ..comparison.predictions import run_predictions
from ..comparison.view import OneCycle, chosen_cycles
from ..core.arrays import Array
from ..core.text import percent, quantity, scale, short_z
from ..data.channels import DRIVE
from ..data.checks.motion import velocity_of_run
from ..data.measurement import Measurement
from ..identification.error_table import ForceShare, force_budget
from ..physics.forms import shown_law
from ..physics.laws import LAWS
from ..view.style import (
    BLUE,
    FLOOR,
    GREEN,
    GREY,
    INK,
    MINUS,
    PALE,
    PURPLE,
    VERMILION,
    Page,
    label,
    look,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..identification.problem import Problem
    from ..model.model import Model
    from .history import HistoryStep

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
    return f"{len(runs)} run{'s' * (len(runs) > 1)}, {total:.4g} s together"


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


# The picture of a study's history: the error of each model, a step per change.

_WIDTH = 9.2
SMALL = 0.1
"""Change of z below which a riser of the staircase carries no label."""


def staircase_page(history_steps: Sequence[HistoryStep]) -> Page:
    """Return the staircase: z of each model on training and held-out runs over the noise floor."""
    steps = [one for one in history_steps if one.z is not None]
    with look():
        page = Page(_WIDTH, 3.5, "")
        grid = page.grid(1, 1, top=0.25, bottom=0.5, left=0.6, right=1.0)
        axes = page.figure.add_subplot(grid[0, 0])
        top = max([one.z or 1.0 for one in steps] + [one.z_train or 1.0 for one in steps] + [2.0])
        axes.set_yscale("log")
        axes.axhspan(0.9, 1.1, color=FLOOR, lw=0.0)
        _stairs(axes, [one.z_train for one in steps], PALE, 1.6)
        _stairs(axes, [one.z for one in steps], BLUE, 2.6)
        for i, one in enumerate(steps):
            assert one.z is not None
            _step_marks(axes, i, one, steps[i - 1].z if i else None)
        axes.set_xlim(-0.5, len(steps) - 0.5)
        axes.set_ylim(0.75, 2.2 * top)
        names = [textwrap.fill(f"{one.number}  {one.what}", 20) for one in steps]
        axes.set_xticks(range(len(steps)), names, fontsize=9, color=INK)
        axes.tick_params(axis="x", length=0)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_formatter(lambda value, _: "")
        axes.grid(visible=False, axis="x")
        axes.set_title("error / noise (z)")
        last = steps[-1]
        ends = [
            ("noise floor", 1.0, GREEN),
            ("held-out", last.z, BLUE),
            ("training", last.z_train, GREY),
        ]
        _name_ends(axes, [(name, y, c) for name, y, c in ends if y is not None], len(steps) - 0.5)
    return page


def _name_ends(axes: Axes, ends: list[tuple[str, float, str]], x: float) -> None:
    """Write the names of lines at their right ends, pushed apart where they are close."""
    low, high = np.log(axes.get_ylim())
    height = axes.get_position().height * axes.figure.get_figheight() * 72.0  # type: ignore[union-attr]
    before = -np.inf
    for name, y, colour in sorted(ends, key=lambda end: (end[1], end[0] == "held-out")):
        at = (np.log(y) - low) / (high - low) * height
        up = max(at, before + 12.0)
        before = up
        label(axes, name, x, y, colour, xytext=(6, up - at), va="center")


def _stairs(axes: Axes, heights: Sequence[float | None], colour: str, width: float) -> None:
    """Draw steps with risers between them."""
    x, y = [], []
    for i, height in enumerate(heights):
        if height is not None:
            x += [i - 0.5, i + 0.5]
            y += [height, height]
    axes.plot(x, y, color=colour, lw=width, solid_joinstyle="miter")


def _step_marks(axes: Axes, i: int, one: HistoryStep, before: float | None) -> None:
    """Write z and error over a step, and at its riser by how much the error fell."""
    assert one.z is not None
    told = [f"z = {short_z(one.z)}"]
    if one.rms is not None:
        share = "" if one.share is None else f" ({percent(one.share)})"
        told.insert(0, f"{quantity(one.rms, 'N')}{share}")
    # Above the higher of both lines, so that neither strikes it through.
    height = max(one.z, one.z_train or 0.0)
    label(axes, ",  ".join(told), i, height, BLUE, xytext=(0, 7), ha="center", va="bottom")
    if before is None or before <= 0.0:
        return
    change = one.z / before - 1.0
    if abs(change) < SMALL:
        return  # its riser is too low for a label
    # In units of the noise: what there was above it, and what is left of that.
    text = f"{100.0 * change:+.0f} %".replace("-", MINUS)
    colour = GREEN if change < 0.0 else VERMILION
    axes.annotate(
        text, (i - 0.5, float(np.sqrt(one.z * before))), xytext=(5, 0), textcoords="offset points",
        color=colour, fontsize=10, fontweight="bold", ha="left", va="center",
    )  # fmt: skip


# The picture of a force budget: the parts of a model's force, stacked over single cycles.

Budgets = dict[str, list[ForceShare]]

_RUNS = 6
_WIDTH, _PANELS, _BAR = 9.2, 2.7, 0.27
"""Width of the figure, heights of a row of cycles and of a bar [in]."""
_LEFT = 0.85  # in, beside the panels: -1500 and the axis label need it
_OF_LAW = {
    "yield": BLUE, "viscous": "#7db8dc", "damping of the bristles": "#bcd9ea", "spring": GREEN,
    "rest of the law": PALE,
}  # fmt: skip
_OF_EFFECTS = (VERMILION, PURPLE, "#e69f00", "#8c6bb1", "#b15928")


def budgets(problem: Problem, model: Model) -> Budgets:
    """Return the force budget of a damper's model in each run, by its name.

    Empty for a law that is no damper's.
    """
    if LAWS[model.law].site != "damper":
        return {}
    return {run.name: force_budget(problem, model, run) for run in problem.runs[:_RUNS]}


def shares(found: Budgets) -> list[tuple[str, float]]:
    """Return the parts with their RMS over that of the force, in all runs together."""
    powers: dict[str, float] = {}
    total = 0.0
    for one in found.values():
        total += float(np.sum(np.sum([part.force for part in one], axis=0) ** 2))
        for part in one:
            powers[part.name] = powers.get(part.name, 0.0) + float(np.sum(part.force**2))
    if not total > 0.0:
        return []
    return [(name, float(np.sqrt(power / total))) for name, power in powers.items()]


def sentence(found: Budgets) -> str:
    """Return the parts with their shares in words, the largest first; "" where there are none."""
    parts = sorted(shares(found), key=lambda one: -one[1])
    told = ", ".join(f"{effect_name(name)} {percent(share, 0)}" for name, share in parts)
    return f"The force consists of (RMS over that of the force): {told}." if told else ""


def draw_budget(problem: Problem, model: Model) -> Page | None:
    """Return the figure of a force budget, drawn and not yet written; None for no damper's law.

    Parameters
    ----------
    problem : Problem
        Runs with what predicts them.
    model : Model
        Law and effects with their values.
    """
    found = budgets(problem, model)
    if not found:
        return None
    predictions = run_predictions(problem.of(problem.runs[:_RUNS]), model)
    cycles, parts = chosen_cycles(predictions), shares(found)
    colours = colours_of([name for name, _ in parts])
    with look():
        bars = _BAR * len(parts) + 0.75
        above = _PANELS if cycles else 0.0
        names = [shown_law(model.law), *map(effect_name, model.effects)]
        heading = f"{' + '.join(names)}: the parts of its force"
        said = "Stacked over single cycles; the line is their sum, the model's force."
        page = Page(_WIDTH, above + bars, heading, said if cycles else "")
        if cycles:
            grid = page.grid(1, len(cycles), top=0.4, bottom=bars + 0.5, left=_LEFT, column_gap=0.2)
            panels = [page.figure.add_subplot(grid[0, k]) for k in range(len(cycles))]
            _stacks(panels, cycles, found, colours)
        grid = page.grid(1, 1, top=above + 0.3, bottom=0.4, left=2.0, right=0.9)
        _bars(page.figure.add_subplot(grid[0, 0]), parts, colours)
    return page


def colours_of(names: list[str]) -> dict[str, str]:
    """Return the colour of each part: those of the law have their own, effects the others."""
    effects = [name for name in names if name not in _OF_LAW]
    own = {name: _OF_EFFECTS[k % len(_OF_EFFECTS)] for k, name in enumerate(effects)}
    return {name: _OF_LAW.get(name) or own[name] for name in names}


def _stacks(
    panels: list[Axes], cycles: list[OneCycle], found: Budgets, colours: dict[str, str]
) -> None:
    """Draw the parts of each cycle on each other, those that push back and those that pull."""
    length = max(float(np.ptp(one.prediction.time[one.part])) for one in cycles)
    times, in_unit = scale("s", length, fine=True)
    size = max(float(np.abs(one.prediction.measured[one.part]).max()) for one in cycles)
    factor, unit = scale("N", size)
    low, high = 0.0, 0.0
    for axes, one in zip(panels, cycles, strict=True):
        of = one.prediction
        time = times * (of.time[one.part] - of.time[one.part.start])
        parts = found[of.name]
        forces = factor * np.array([part.force[one.part] for part in parts])
        fills = [colours[part.name] for part in parts]
        axes.stackplot(time, np.maximum(forces, 0.0), colors=fills, lw=0.0)
        axes.stackplot(time, np.minimum(forces, 0.0), colors=fills, lw=0.0)
        axes.plot(time, forces.sum(axis=0), color="white", lw=2.4)
        axes.plot(time, forces.sum(axis=0), color=INK, lw=1.2)
        axes.set_title(one.text, fontsize=9.5)
        axes.set_title(of.name, loc="right", fontsize=7, color=GREY)
        axes.set_xlabel(f"time in the cycle [{in_unit}]", fontsize=8)
        # A label at the right edge would run into the first one of the next panel.
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
        axes.tick_params(labelsize=8)
        axes.set_xlim(time[0], time[-1])
        low, high = min(low, axes.get_ylim()[0]), max(high, axes.get_ylim()[1])
    for number, axes in enumerate(panels):
        axes.set_ylim(low, high)
        if number:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel(f"force [{unit}]", fontsize=8)


def _bars(axes: Axes, parts: list[tuple[str, float]], colours: dict[str, str]) -> None:
    """Draw the parts' shares as bars, which are the key of the colours as well."""
    places = range(len(parts))
    axes.barh(
        places, [share for _, share in parts], color=[colours[name] for name, _ in parts],
        height=0.7,
    )  # fmt: skip
    for place, (_, share) in zip(places, parts, strict=True):
        axes.text(share, place, f" {percent(share, 0)}", va="center", fontsize=8.5, color=INK)
    axes.set_yticks(places, [effect_name(name) for name, _ in parts], fontsize=9, color=INK)
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    axes.set_title("RMS over that of the force, in all of these runs", fontsize=9)
    axes.grid(visible=False, axis="y")
