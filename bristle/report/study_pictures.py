"""The pictures of a study's report: staircase, loops and maps before and after, the error now."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compare.names import name_of
from ..draw.style import (
    BLUE,
    FLOOR,
    GREEN,
    GREY,
    INK,
    MINUS,
    PALE,
    VERMILION,
    Page,
    label,
    look,
    short_z,
)
from ..quantity import quantity
from .panels import (
    draw_loop,
    draw_map,
    draw_pattern,
    draw_regimes,
    draw_spectrum,
    residual_map,
)
from .residuals import telling_patterns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..compare.comparison import Comparison
    from .staircase import HistoryStep

_WIDTH = 9.2
SMALL = 0.1
"""Change of z below which a riser of the staircase carries no label."""


def staircase_page(history_steps: Sequence[HistoryStep], unit: str = "N") -> Page:
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
            _step_marks(axes, i, one, steps[i - 1].z if i else None, unit)
        axes.set_xlim(-0.5, len(steps) - 0.5)
        axes.set_ylim(0.75, 2.2 * top)
        names = [textwrap.fill(f"{one.number}  {one.what}", 20) for one in steps]
        axes.set_xticks(range(len(steps)), names, fontsize=9, color=INK)
        axes.tick_params(axis="x", length=0)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_formatter(lambda value, _: "")
        axes.grid(visible=False, axis="x")
        axes.set_title("z: error over what noise explains")
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


def _step_marks(axes: Axes, i: int, one: HistoryStep, before: float | None, unit: str) -> None:
    """Write z and error over a step, and at its riser by how much the error fell."""
    assert one.z is not None
    z = short_z(one.z)
    rms = "" if one.rms is None else f"  {quantity(one.rms, unit, 2)}"
    label(axes, f"z = {z}{rms}", i, one.z, INK, xytext=(0, 7), ha="center", va="bottom")
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


def loops_page(before: Comparison | None, now: Comparison, names: tuple[str, str]) -> Page:
    """Return loops of the run that was worst: before and after the last added effect."""
    chosen = before.worst.name if before else now.worst.name
    both = [one for one in (before, now) if one is not None]
    labels = names if before else names[1:]
    with look():
        page = Page(_WIDTH, 3.0 * len(both) + 0.1, "")
        grid = page.grid(len(both), 2, top=0.4, bottom=0.5, row_gap=0.9, column_gap=0.75)
        for row, (one, name) in enumerate(zip(both, labels, strict=True)):
            prediction = next(h for h in one.predictions if h.name == chosen)
            z = next(run.z for run in one.runs if run.name == chosen)
            for column, over in enumerate(("displacement", "velocity")):
                if over not in prediction.coordinates:
                    continue
                axes = page.figure.add_subplot(grid[row, column])
                draw_loop(axes, prediction, over)
                if column == 0:
                    along = name_of(over, prediction.site)
                    axes.set_title(f"{name}: force [{prediction.unit}] over {along}")
                else:
                    along = name_of(over, prediction.site)
                    axes.set_title(f"over {along}; z = {short_z(z)} on {prediction.name}")
        return page


def maps_page(before: Comparison | None, now: Comparison, names: tuple[str, str]) -> Page | None:
    """Return where over displacement and velocity the error is, before and after; None without."""
    both = [one for one in (before, now) if one is not None]
    found = [residual_map(one) for one in both]
    if any(one is None for one in found):
        return None
    labels = names if before else names[1:]
    limit = max(float(np.nanquantile(np.abs(one[2]), 0.97)) for one in found if one is not None)
    limit = max(limit, 1.0)
    with look():
        page = Page(_WIDTH, 3.5, "")
        grid = page.grid(1, 2, top=0.35, bottom=0.5, right=1.0, column_gap=0.75)
        image: Any = None
        for column, (one, name) in enumerate(zip(both, labels, strict=True)):
            axes = page.figure.add_subplot(grid[0, column])
            image = draw_map(axes, one, limit)
            axes.set_title(f"{name}: z = {short_z(one.z)}")
        height = page.height
        room = page.figure.add_axes(
            ((_WIDTH - 0.72) / _WIDTH, 0.75 / height, 0.14 / _WIDTH, (height - 1.5) / height)
        )
        bar = page.figure.colorbar(image, cax=room)
        bar.set_label("mean error over noise", fontsize=8.5)
        bar.outline.set_visible(False)
    return page


def error_page(now: Comparison) -> Page:
    """Return where the error of the present model lives: two coordinates, spectrum, regimes."""
    telling = telling_patterns(now)
    first = telling[0] if now.second else None
    with look():
        rows = 1 + bool(telling)
        page = Page(_WIDTH, 3.1 * rows, "")
        grid = page.grid(rows, 2, top=0.4, bottom=0.55, row_gap=0.95, column_gap=1.15)
        for column, pattern in enumerate(telling):
            axes = page.figure.add_subplot(grid[0, column])
            draw_pattern(axes, now, pattern, first if column else None)
        draw_spectrum(page.figure.add_subplot(grid[rows - 1, 0]), now)
        if now.regimes:
            draw_regimes(page.figure.add_subplot(grid[rows - 1, 1]), now)
    return page
