"""The figure of a comparison: how wrong a prediction is, where, and where not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..draw.style import GREY, Page, look
from ..quantity import plain, scale
from .loops import OVERS, OneCycle, chosen_cycles, draw_loops
from .names import name_of
from .panels import (
    draw_error,
    draw_history,
    draw_loop,
    draw_pattern,
    draw_regimes,
    draw_spectrum,
    worst_window,
)
from .site_pictures import draw_sites, sites_height

if TYPE_CHECKING:
    from .comparison import Comparison
    from .patterns import ResidualPattern

_HISTORY, _PANELS = 3.1, 3.2
"""Heights of the history with its error, and of a row of two panels [in]."""
LOOPS = 4.6
"""Height of two rows of loops of single cycles [in]."""


def draw_comparison(comparison: Comparison, title: str = "") -> Page:
    """Return the figure of a comparison, drawn and not yet written.

    Panels: z at every site of a building; the worst stretch of the worst run, measured and
    predicted, with the error under it; loops of single cycles by the level of the command, or the
    loops of that run where it has no cycles; the error along the two most telling coordinates; its
    spectrum against that of the noise; z in classes of speed and command.
    """
    prediction = comparison.worst
    window = worst_window(prediction)
    cycles = chosen_cycles(comparison.predictions)
    loops = [name for name in ("displacement", "velocity") if name in prediction.coordinates]
    telling = telling_patterns(comparison)
    first = telling[0] if comparison.second else None
    rows = [bool(loops) and not cycles, bool(telling), True]
    with look():
        sites = comparison.sites
        begin = sites_height(len(sites)) if sites else 0.0
        height = begin + _HISTORY + LOOPS * bool(cycles) + _PANELS * sum(rows)
        page = Page(9.6, height, title or headline(comparison), " ".join(comparison.sentences))
        if sites:
            above = page.grid(1, 1, top=0.35, bottom=height - begin + 0.5, left=1.35, right=2.9)
            draw_sites(page.figure.add_subplot(above[0, 0]), sites)
        grid = page.grid(
            2, 1, top=begin + 0.35, bottom=height - begin - _HISTORY + 0.45, row_gap=0.4,
            height_ratios=[1.6, 1.0],
        )  # fmt: skip
        upper = page.figure.add_subplot(grid[0, 0])
        draw_history(upper, prediction, window)
        lower = page.figure.add_subplot(grid[1, 0], sharex=upper)
        upper.tick_params(labelbottom=False)
        draw_error(lower, prediction, window)
        at = begin + _HISTORY
        if cycles:
            loop_panels(page, at, cycles)
            at += LOOPS
        elif loops:
            _row(page, at, [lambda axes, o=one: draw_loop(axes, prediction, o) for one in loops])
            at += _PANELS
        if telling:
            draws = [lambda axes, p=one: draw_pattern(axes, comparison, p) for one in telling[:1]]
            draws += [lambda a, p=one: draw_pattern(a, comparison, p, first) for one in telling[1:]]
            _row(page, at, draws)
            at += _PANELS
        last = [lambda axes: draw_spectrum(axes, comparison)]
        if comparison.regimes:
            last.append(lambda axes: draw_regimes(axes, comparison))
        _row(page, at, last)
    return page


def loop_panels(page: Page, top: float, cycles: Sequence[OneCycle], name: str = "") -> None:
    """Draw loops of single cycles over velocity and displacement, `LOOPS` high, into a page.

    Parameters
    ----------
    page : where to draw
    top : from the upper edge of the room for panels [in]
    cycles : those that are shown side by side
    name : of the model, "" where there is one alone
    """
    inner, one = page.height - page.head - page.foot, cycles[0].prediction
    grid = page.grid(
        len(OVERS), len(cycles), top=top + 0.55, bottom=inner - top - LOOPS + 0.5, row_gap=0.5,
        column_gap=0.2,
    )  # fmt: skip
    rows = {
        over: [page.figure.add_subplot(grid[row, column]) for column in range(len(cycles))]
        for row, over in enumerate(OVERS)
    }
    size = max(float(abs(each.prediction.measured[each.part]).max()) for each in cycles)
    force = scale(one.unit, size)
    draw_loops(rows, cycles, force=force)
    page.figure.text(
        0.65 / page.width, (page.foot + inner - top - 0.14) / page.height,
        f"{f'{name}: ' if name else ''}{one.quantity.replace('_', ' ')} [{force[1]}] in single "
        "cycles, measured (black) and model (blue). Band: 95 % of a true model's samples.",
        fontsize=9, color=GREY, va="center",
    )  # fmt: skip


def _row(page: Page, top: float, draws: list) -> None:  # type: ignore[type-arg]
    inner = page.height - page.head - page.foot
    grid = page.grid(
        1, len(draws), top=top + 0.4, bottom=inner - top - _PANELS + 0.5, column_gap=1.1
    )
    for column, draw in enumerate(draws):
        draw(page.figure.add_subplot(grid[0, column]))


def telling_patterns(comparison: Comparison) -> list[ResidualPattern]:
    """Return the two coordinates to draw the error along: the first, and what is left's."""
    if not comparison.patterns:
        return []
    first = comparison.patterns[0]
    rest = [one for one in comparison.patterns[1:] if one.coordinate not in first.alike]
    chosen = comparison.second or (rest[0] if rest else None)
    return [first, chosen] if chosen else [first]


def headline(comparison: Comparison) -> str:
    """Return the finding in one line."""
    what, z = comparison.quantity.replace("_", " "), comparison.z
    if comparison.right:
        if comparison.sites and not any(one.fails for one in comparison.sites):
            return "The model is right within its noise at every site"
        return f"The model's {what} is right within its noise (z = {z:.2f})"
    times = plain(z, 2 if z < 100.0 else 3)
    text = f"The model's {what} is wrong by {times} times what noise explains"
    if not comparison.noise_known:
        text = (
            f"The model misses {100.0 * comparison.total.share:.1f} % of the {what}, noise included"
        )
    if comparison.first:
        along = name_of(comparison.first.coordinate, comparison.site)
        text += f"; the error depends mainly on {along}"
    return text
