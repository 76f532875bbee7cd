"""Values of several candidates as bars, over the band that noise explains."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from ..core.text import short_z
from .style import BLUE, FLOOR, GREY, INK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW = 0.27
"""Height of a candidate's row [in]."""
_SHORT = 0.05
"""Distance of a value from 1 below which its bar would not be seen: a dot is."""


def draw_ranking(
    axes: Axes,
    names: Sequence[str],
    values: Sequence[float],
    before: float,
    strong: Collection[str] = (),
    *,
    band: tuple[float, float] = (0.9, 1.1),
) -> None:
    """Draw what each candidate leaves of a value: a bar from what noise explains to the value.

    Parameters
    ----------
    axes : where to draw
    names : of the candidates
    values : one per candidate, positive
    before : the value without any candidate, a line
    strong : names that are drawn in colour
    band : the values that noise explains
    """
    axes.set_xscale("log")
    axes.axvspan(*band, color=FLOOR, lw=0.0)
    axes.axvline(before, color=GREY, lw=0.9, linestyle=(0, (3, 2)))
    for row, (name, value) in enumerate(zip(names, values, strict=True)):
        colour = BLUE if name in strong else PALE
        if abs(value - 1.0) < _SHORT:
            axes.plot([value], [row], "o", ms=5.0, color=colour)
        else:
            axes.barh(row, value - 1.0, left=1.0, height=0.62, color=colour)
        axes.text(
            1.02, row, short_z(value), transform=axes.get_yaxis_transform(), va="center",
            fontsize=8.5, color=INK if name in strong else GREY,
        )  # fmt: skip
    axes.set_yticks(range(len(names)), names, fontsize=9, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(names) - 0.4, -0.6)
    low, high = min([*values, before, 0.8]), max([*values, before, 2.0])
    axes.set_xlim(0.93 * low, 1.1 * high)
    steps = [z for z in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1e3) if low <= z <= high]
    axes.set_xticks(steps, [f"{z:g}" for z in steps])
    axes.xaxis.set_minor_formatter(lambda _value, _place: "")
    axes.grid(visible=False, axis="y")
