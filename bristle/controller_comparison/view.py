"""A comparison of controllers as blocks: who is best, by how much, the tables of all motions."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.text import plain, scale
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import COLOURS, GREY, INK, PALE, Page, label, look
from .result import REFERENCES, ControllerComparison, beside, what, winner
from .setting import BEST, DAMPER, LIMIT, OFF, ON

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MORE = ("#E69F00", "#56B4E9", "#8a4a78", "#5b6770")
_MARKERS = "osD^vP<>"
_ROW = 0.2
"""Height of a controller's row in the summary [in]."""
_LEFT = 72.0 * 2.15
"""How far left of the axes a motion's heading begins [pt]."""
_LASTS = 16.0
"""Longest part of a run that is shown [s]."""
MARK = "†"
"""Behind a controller with which the displacement leaves the damper's stroke."""
_SHORT = {"passive off": "of 0 V", "passive on": "of full", BEST: "of best"}


@view_of(ControllerComparison)
def comparison_view(found: ControllerComparison) -> View:
    """Return the view of a comparison of controllers."""
    first, *others = found.verdict
    summary = Figure(
        lambda: draw_summary(found), "controllers beside the best constant voltage",
        f"All motions at a glance: {what(found)}.",
    )  # fmt: skip
    return View(
        first,
        (
            *map(Text, others), *(motion_table(found, motion) for motion in found.motions),
            *(Text(note, "note") for note in found.notes), summary,
        ),
        tone="blue",
    )  # fmt: skip


def motion_table(found: ControllerComparison, motion: str) -> Table:
    """Return the table of a motion, a row per controller; what its columns mean is below it."""
    titles = header(found)
    note = " ".join(footnotes(found))
    strong = (lowest(found, motion),)
    return Table(titles, rows(found, motion), range(1, len(titles)), motion, strong, note)


class ReportColumn(NamedTuple):
    """A column of numbers: heading and unit, and the outputs of which it shows the largest."""

    heading: str
    unit: str
    factor: float
    outputs: tuple[str, ...]


def columns(found: ControllerComparison) -> list[ReportColumn]:
    """Return the columns that every motion's table has."""
    site = found.setting.site
    shown: list[tuple[str, tuple[str, ...]]] = [
        (f"peak {site.building.levels()[-1]} acceleration", (f"peak {site.top}",))
    ]
    shown.append((f"RMS {site.building.levels()[-1]} acceleration", (f"rms {site.top}",)))
    if site.building.isolated:
        shown.append(("peak base drift", ("peak structure.base_displacement",)))
    shown.append(("peak storey drift", tuple(f"peak {name}" for name in site.drifts)))
    shown.append(("peak force", (f"peak {DAMPER}.force",)))
    shown.append(("RMS voltage", (f"rms {found.outputs[-1].column}",)))
    if not any(outputs == (found.setting.judged.name,) for _, outputs in shown):
        shown.insert(0, (what(found), (found.setting.judged.name,)))
    return [_column(found, heading, outputs) for heading, outputs in shown]


def _column(found: ControllerComparison, heading: str, outputs: tuple[str, ...]) -> ReportColumn:
    unit = found.units[outputs[0]]
    factor, said = scale(unit, float(found.table[list(outputs)].to_numpy().max()))
    return ReportColumn(heading, said.replace("s2", "s²"), factor, outputs)


def header(found: ControllerComparison) -> list[str]:
    """Return the titles of a motion's table, the controller's first."""
    titles = [f"{one.heading} [{one.unit}]" for one in columns(found)]
    titles += [f"{_SHORT[name]} [%]" for name in REFERENCES]
    if found.worst is not None:
        titles.append(f"worst [{_judged(found).unit}]")
    return ["", *titles]


def _judged(found: ControllerComparison) -> ReportColumn:
    return _column(found, "", (found.setting.judged.name,))


def rows(found: ControllerComparison, motion: str) -> list[list[str]]:
    """Return a motion's table as texts, a row per controller, its name first."""
    part = found.table[found.table["motion"] == motion]
    shown, judged = columns(found), _judged(found)
    texts = []
    for case in part.to_dict(orient="records"):
        name = str(case["controller"])
        title = f"{name} ({case['level']:g} V)" if isfinite(case["level"]) else name
        row = [title + (f" {MARK}" if case["stroke"] > 1.0 else "")]
        for one in shown:
            row.append(plain(one.factor * max(case[name] for name in one.outputs), 4))
        for reference in REFERENCES:
            share = found.value(motion, name) / found.value(motion, reference)
            row.append(f"{100.0 * share:.0f}")
        if found.worst is not None:
            value = found.worst_value(motion, name)
            row.append(plain(judged.factor * value, 4) if np.isfinite(value) else "")
        texts.append(row)
    return texts


def lowest(found: ControllerComparison, motion: str) -> int:
    """Return which row of a motion's table has the controller with the lowest judged value."""
    names = list(found.table[found.table["motion"] == motion]["controller"])
    first = min(found.controllers, key=lambda name: found.value(motion, name))
    return names.index(first)


def footnotes(found: ControllerComparison) -> list[str]:
    """Return what the tables' columns and marks mean."""
    texts = [
        f"of 0 V, of full, of best: the {what(found)} over that of the damper at 0 V, at its "
        "largest voltage, and at the best constant voltage."
    ]
    if found.worst is not None:
        texts.append(f"worst: the largest {what(found)} of the case and its members.")
    if (found.table["stroke"] > 1.0).any():
        texts.append(f"{MARK} the displacement leaves the damper's stroke.")
    if found.limits:
        texts.append(f"{LIMIT}: any voltage, the ground motion known in advance.")
    return texts


def colour_of(found: ControllerComparison, name: str) -> Any:
    """Return the colour of a controller, the same in all figures."""
    known = (*COLOURS, *_MORE)
    return known[found.controllers.index(name) % len(known)]


def draw_summary(found: ControllerComparison) -> Page:
    """Return the figure of all motions: what is judged, over the best constant voltage.

    A row per controller in each motion: a dot for the case, a line to its worst member, a bar for
    the limit.
    """
    judged, names = found.setting.judged, found.controllers
    wide = found.shares()
    first = winner(found)
    mean = float(wide[first].mean())
    title = f"{first}: {what(found)} lies {beside(mean, 'the best constant voltage')}"
    title += " on average" if len(found.motions) > 1 else ""
    unit = judged.unit.replace("s2", "s²")
    words = what(found)
    said = [
        f"{words[0].upper()}{words[1:]} as a share of that at the best constant voltage (dashed).",
        "Grey: 0 V (open) and the largest voltage (full).",
    ]
    if found.worst is not None:
        said.append("Line: to the worst member of the ensemble.")
    if found.limits:
        said.append("Black bar: the limit.")
    height = _ROW * (len(names) + 1.4) * len(found.motions) + 0.9
    page = Page(8.6, height, _unbroken(title), " ".join(said))
    with look():
        axes = page.figure.add_subplot(page.grid(1, 1, left=2.3, right=0.4, top=0.3)[0, 0])
        most, place, ticks = 100.0, 0.0, list[tuple[float, str]]()
        for motion in found.motions:
            heading = f"{motion} (100 %: {found.value(motion, BEST):.3g} {unit})"
            axes.annotate(
                heading, (0.0, place - 0.95), (-_LEFT, 0), xycoords=axes.get_yaxis_transform(),
                textcoords="offset points", fontsize=8.5, color=INK, va="center",
                fontweight="bold", annotation_clip=False,
            )  # fmt: skip
            ticks += [(place + k, name) for k, name in enumerate(names)]
            most = max(most, _draw_shares(axes, found, motion, wide.loc[motion], place))
            place += len(names) + 1.4
        axes.axvline(100.0, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)))
        axes.set_yticks([at for at, _ in ticks], [name for _, name in ticks], fontsize=8.5)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_ylim(place - 1.4, -1.4)
        axes.set_xlim(0.0, 1.06 * min(most, 250.0))
        axes.set_xlabel("% of the best constant voltage", loc="right", labelpad=1)
    return page


def _draw_shares(
    axes: Axes, found: ControllerComparison, motion: str, own: Any, top: float
) -> float:
    """Draw a motion's rows from `top` on; return the largest share [%] of its controllers.

    Parameters
    ----------
    axes, found, motion
    own : Series
        Shares of the best constant voltage, by what commands.
    top : float
        Place of the first row.
    """
    most, names = 0.0, found.controllers
    for k, name in enumerate(names):
        share, place, colour = 100.0 * float(own[name]), top + k, colour_of(found, name)
        worst = 100.0 * found.worst_value(motion, name) / found.value(motion, BEST)
        if np.isfinite(worst):
            axes.plot([share, worst], [place, place], color=colour, linewidth=1.4)
            axes.plot(worst, place, "|", color=colour, markersize=7, markeredgewidth=1.4)
            most = max(most, worst)
        axes.plot(share, place, _MARKERS[k % len(_MARKERS)], color=colour, markersize=6)
        most = max(most, share)
    for reference, fill in ((OFF, "white"), (ON, GREY)):
        share = 100.0 * float(own[reference])
        axes.plot(share, top - 0.45, "o", color=GREY, markerfacecolor=fill, markersize=4.5,
                  clip_on=True)  # fmt: skip
    if motion in found.limits:
        share = 100.0 * float(own[LIMIT])
        axes.plot([share, share], [top - 0.5, top + len(names) - 0.5], color=INK, linewidth=2.0)
    return most


def _unbroken(title: str) -> str:
    """Return a title whose numbers stay with their unit."""
    return title.replace(" %", "\u00a0%")


def draw_motion(found: ControllerComparison, motion: str) -> Page:
    """Return the figure of a motion: response and voltage of each controller over time.

    The response at the best constant voltage stands behind.
    """
    judged, names = found.setting.judged, [*found.controllers]
    if motion in found.limits:
        names.append(LIMIT)
    behind = found.frames[motion, BEST][judged.column]
    factor, unit = scale(judged.unit, float(np.abs(behind).max()))
    shown = unit.replace("s2", "s²")
    begin, end = strong_part(behind)
    least = min(found.controllers, key=lambda name: found.value(motion, name))
    title = (
        f"{motion}: {what(found)} lowest with {least}, "
        f"{beside(found.value(motion, least) / found.value(motion, BEST), 'the best constant')}"
    )
    subtitle = (
        f"Left: {judged.column.partition('.')[2].replace('_', ' ')} [{shown}]; grey: at the best "
        "constant voltage; dots: largest values. Right: voltage [V]."
    )
    page = Page(8.6, 1.05 * len(names) + 0.6, _unbroken(title), subtitle)
    with look():
        grid = page.grid(len(names), 2, left=0.5, column_gap=0.55, row_gap=0.34, top=0.3,
                         bottom=0.4, width_ratios=(1.9, 1.0))  # fmt: skip
        frames = {name: found.frames[motion, name] for name in names}
        size = 1.25 * factor * max(float(np.abs(f[judged.column]).max()) for f in
                                   [*frames.values(), found.frames[motion, BEST]])  # fmt: skip
        for row, (name, frame) in enumerate(frames.items()):
            colour = INK if name == LIMIT else colour_of(found, name)
            axes = page.figure.add_subplot(grid[row, 0])
            axes.plot(behind.loc[begin:end].index, factor * behind.loc[begin:end], color=PALE,
                      linewidth=0.8)  # fmt: skip
            part = factor * frame[judged.column].loc[begin:end]
            axes.plot(part.index, part, color=colour, linewidth=0.9)
            _mark(axes, part, colour)
            axes.set_ylim(-size, size)
            axes.set_title(name, color=colour, fontsize=9)
            beside_it = page.figure.add_subplot(grid[row, 1])
            volts = frame[found.outputs[-1].column].loc[begin:end]
            beside_it.plot(volts.index, volts, color=colour, linewidth=0.7)
            beside_it.set_ylim(-0.05 * found.setting.damper.most, 1.05 * found.setting.damper.most)
            for panel in (axes, beside_it):
                panel.set_xlim(begin, end)
                panel.tick_params(labelbottom=row == len(names) - 1)
                if row == len(names) - 1:
                    panel.set_xlabel("time [s]", loc="right", labelpad=0)
    return page


def _mark(axes: Axes, values: pd.Series[Any], colour: Any) -> None:
    """Mark the largest value of a history, with a number."""
    sizes = np.abs(values.to_numpy())
    place = int(np.argmax(sizes))
    at, value = float(values.index.to_numpy()[place]), float(values.to_numpy()[place])
    axes.plot(at, value, "o", color=colour, markersize=3.5)
    label(axes, f"{sizes[place]:.3g}", at, value, colour, xytext=(5, 0), va="center", fontsize=7.5)


def strong_part(history: pd.Series[Any]) -> tuple[float, float]:
    """Return begin and end [s] of the part of a history in which most happens."""
    energy = np.cumsum(np.square(history.to_numpy()))
    time = history.index.to_numpy()
    begin = float(time[int(np.searchsorted(energy, 0.005 * energy[-1]))])
    begin = max(0.0, float(np.floor(begin - 0.5)))
    return begin, min(float(time[-1]), begin + _LASTS)
