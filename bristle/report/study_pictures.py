"""The pictures of a study's report: staircase, loops and maps before and after, the error now."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compare.loops import OneCycle, chosen_cycles, under
from ..compare.names import name_of
from ..compare.panels import (
    draw_loop,
    draw_map,
    draw_pattern,
    draw_regimes,
    draw_spectrum,
    residual_map,
)
from ..compare.view import LOOPS, loop_panels, telling_patterns
from ..draw.style import Page, look, short_z

if TYPE_CHECKING:
    from ..compare.comparison import Comparison

_WIDTH = 9.2


def loops_page(before: Comparison | None, now: Comparison, names: tuple[str, str]) -> Page:
    """Return loops before and after the last added effect: single cycles by the command's level.

    Of a run without cycles all of its loops are drawn.
    """
    both = [one for one in (before, now) if one is not None]
    labels = names if before else names[1:]
    shown = chosen_cycles(now.predictions)
    if shown:
        return _cycles_page(both, labels, shown)
    chosen = before.worst.name if before else now.worst.name
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
                along = name_of(over, prediction.site)
                if column == 0:
                    axes.set_title(f"{name}: force [{prediction.unit}] over {along}")
                else:
                    axes.set_title(f"over {along}; z = {short_z(z)} on {prediction.name}")
        return page


def _cycles_page(
    both: Sequence[Comparison], labels: Sequence[str], shown: Sequence[OneCycle]
) -> Page:
    """Return the same cycles under each of several models, over velocity and displacement."""
    with look():
        page = Page(_WIDTH, (LOOPS + 0.1) * len(both), "")
        for row, (one, name) in enumerate(zip(both, labels, strict=True)):
            loop_panels(page, (LOOPS + 0.1) * row, under(shown, one.predictions), name)
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
