"""A limit as a figure, a table and text."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from ..core.text import install, plain
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import BLUE, GREY, INK, PALE, VERMILION, Page, look
from .bound import SOLVER
from .limit import AGREE, TRUST, Limit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BAR = 0.26
"""Height of a bar with the gap to the next [in]."""
_LETTER = 0.0125
"""Width of a letter beside a bar, as a share of the axes."""


@view_of(Limit)
def limit_view(found: Limit) -> View:
    """Return the view of a limit."""
    least = f"{plain(found.value, 4)} {found.unit}, {_below(found.value, found.best_constant[1])}"
    title = f"{found.title}: no {found.command} was found that brings the {found.statistic} of "
    title += f"{found.output} below {least}."
    rows = [[name, plain(value, 4), said] for name, value, said in compared(found)]
    return View(
        title,
        (
            *map(Text, confidence(found)),
            Table(("control", f"{found.statistic} [{found.unit}]", "note"), rows, (1,)),
        ),
        (Figure(lambda: draw_limit(found), title),),
    )


def compared(found: Limit) -> list[tuple[str, float, str]]:
    """Return what is compared: name, value, and what is to be said of it."""
    unit, (at, best) = found.command_unit, found.best_constant
    levels = sorted(found.constant)
    rows = [(f"constant {V:g} {unit}", found.constant[V], "") for V in (levels[0], levels[-1])]
    rows.append((f"the scenario's own {found.command}", found.as_it_is, ""))
    rows.append((f"best constant {found.command}, known in advance", best, f"{at:g} {unit}"))
    rows += [
        (f"receding horizon, {seconds:g} s of preview", value, _below(value, best))
        for seconds, value in found.previews.items()
    ]
    rows.append(
        (f"limit: any {found.command}, motion known", found.value, _below(found.value, best))
    )
    if found.bound is not None:
        said = f"any force up to {plain(found.most_force)} N that gives no energy"
        rows.append(("lower bound", found.bound, said))
    return rows


def confidence(found: Limit) -> list[str]:
    """Return how sure a limit is, a sentence each."""
    values = ", ".join(plain(start.value, 4) for start in found.starts)
    count = len(found.starts)
    said = [f"{found.agreeing} of {count} starts agree within {100 * AGREE:g} %: {values}."]
    apart = abs(found.value / found.searched - 1.0)
    word = "confirms" if apart <= TRUST else "does not confirm"
    said.append(
        f"The coupled engine {word} the value: {plain(found.value, 4)}, "
        f"the search's own {plain(found.searched, 4)}."
    )
    if found.bound is None:
        why = "the damper has effects, or the convex program failed."
        if find_spec(SOLVER) is None:
            why = f"it needs {SOLVER}, which is not installed:  {install('design')}"
        said.append(f"No lower bound: {why}")
    if not found.sure:
        said.append("Not sure: more starts (--starts 8) may find less.")
    return said


def _below(value: float, best: float) -> str:
    share = 100.0 * (1.0 - value / best)
    return f"{abs(share):.0f} % {'below' if share >= 0.0 else 'above'} the best constant"


def draw_limit(found: Limit) -> Page:
    """Return the picture of a limit, drawn and not yet written."""
    (at, best), unit = found.best_constant, found.command_unit
    what = {"rms": "RMS"}.get(found.statistic, found.statistic)
    shown = found.unit.replace("s2", "s²")
    title = (
        f"The limit of the {what} is {plain(found.value)} {shown}: "
        f"{100 * (1 - found.value / best):.0f} % below the best constant {found.command}"
    )
    subtitle = (
        f"{found.title}. {what[0].upper() + what[1:]} of {found.output}; the limit knows the "
        f"ground motion in advance. {found.agreeing} of {len(found.starts)} starts agree."
    )
    rows = compared(found)
    page = Page(8.6, 4.6 + _BAR * len(rows), title, subtitle)
    with look():
        grid = page.grid(3, 1, left=0.7, height_ratios=(1.6, 1.0, _BAR * len(rows)))
        response = page.figure.add_subplot(grid[0, 0])
        history = found.results[found.output]
        response.plot(history.index, history, color=BLUE, linewidth=0.9)
        for level in (-best, best):
            response.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        response.set_title(
            f"Response at the limit [{shown}]; dashed: {what} at constant {at:g} {unit}"
        )
        voltage = page.figure.add_subplot(grid[1, 0], sharex=response)
        voltage.plot(found.time, found.voltage, color=VERMILION, linewidth=0.7)
        voltage.set_title(f"{found.command.capitalize()} that reaches it [{unit}]")
        voltage.set_xlabel("time [s]", loc="right", labelpad=0)
        beside = page.grid(3, 1, left=2.6, height_ratios=(1.6, 1.0, _BAR * len(rows)))
        bars = page.figure.add_subplot(beside[2, 0])
        _bars(bars, rows, shown)
    return page


def _bars(axes: Axes, rows: list[tuple[str, float, str]], unit: str) -> None:
    """Draw what is compared as bars, in its order, the value beside each."""
    places = range(len(rows))
    colours = [PALE] * len(rows)
    for place, (name, _, _) in enumerate(rows):
        if name.startswith("receding"):
            colours[place] = GREY
        elif name.startswith("limit"):
            colours[place] = BLUE
    axes.barh(places, [value for _, value, _ in rows], color=colours, height=0.72)
    reach = 0.0  # such that every text ends within the axes
    for place, (_, value, said) in enumerate(rows):
        text = f" {plain(value)}" + (f"   {said}" if said else "")
        axes.text(value, place, text, va="center", fontsize=8, color=INK)
        reach = max(reach, value / (1.0 - _LETTER * len(text)))
    axes.set_yticks(places, [name for name, _, _ in rows], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, reach)
    axes.set_xlabel(unit, loc="right", labelpad=0)
