"""The picture of a study's history: the error of each model, a step per change."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

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
)
from ..quantity import quantity, short_z

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def _step_marks(axes: Axes, i: int, one: HistoryStep, before: float | None, unit: str) -> None:
    """Write z and error over a step, and at its riser by how much the error fell."""
    assert one.z is not None
    z = short_z(one.z)
    rms = "" if one.rms is None else f"  {quantity(one.rms, unit, 4)}"
    rms += f" below {one.cut_off:g} Hz" if rms and one.cut_off else ""
    # Above the higher of both lines, so that neither strikes it through.
    height = max(one.z, one.z_train or 0.0)
    label(axes, f"z = {z}{rms}", i, height, BLUE, xytext=(0, 7), ha="center", va="bottom")
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
