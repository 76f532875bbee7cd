"""Figures and tables of an ensemble and of the best constant voltage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.text import plain
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import BLUE, GREY, INK, PALE, VERMILION, Page, label, look, ramp
from .best_constant import Passive
from .ensemble import Ensemble

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from .campaign import Statistic


MOST_OUTPUTS = 6
MOST_NAMES = 8
_HEIGHT = 1.75
"""Of one output's row [in]."""
_SHOWN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "m/s2": (1.0, "m/s²"), "1": (1.0, "")}


@view_of(Ensemble)
def ensemble_view(found: Ensemble) -> View:
    """Return the view of an ensemble: its quantiles, and what failed."""
    done = int((found.runs["status"] == "done").sum())
    before = f", {found.continued} of them from before" if found.continued else ""
    table = found.quantiles
    # How many are done and failed says the title, unless outputs differ in it.
    columns = [
        str(name) for name in table.columns
        if name != "unit" and not (name in ("done", "failed") and table[name].nunique() == 1)
    ]  # fmt: skip
    rows = [
        [
            str(name) if row["unit"] == "1" else f"{name} [{row['unit']}]",
            *(plain(row[one], 4) for one in columns),
        ]
        for name, row in table.iterrows()
    ]  # fmt: skip
    title = f"{found.plan.title}: {done} runs done, {len(found.runs) - done} failed"
    failures = (
        f"failed {one.count} times, first in run {one.run}: {one.reason}" for one in found.failures
    )
    figure = (Figure(lambda: draw_ensemble(found), found.plan.title),) if done > 1 else ()
    return View(
        title,
        (
            Table(("output", *columns), rows, range(1, len(columns) + 1)),
            Text(f"{len(found.runs)} runs{before} in {found.wall_time:.1f} s"),
            *(Text(note, "note") for note in failures),
        ),
        figure,
    )  # fmt: skip


@view_of(Passive)
def passive_view(found: Passive) -> View:
    """Return the view of best constant voltages: of each ground motion, and of all of them."""
    at = [round(k) for k in (0, (len(found.grid) - 1) / 2, len(found.grid) - 1)]
    best = [
        [motion.name, f"{one.voltage:.2f}", plain(one.value, 4), *(plain(row[k], 4) for k in at)]
        for motion, one, row in zip(found.motions, found.best, found.values, strict=True)
    ]
    header = ("ground motion", "best [V]", "value", *(f"{found.grid[k]:g} V" for k in at))
    rows = [[text, f"{voltage:.2f}", said] for text, voltage, said in found.for_all()]
    title = f"Best constant voltages: least {found.what} [{found.unit}]"
    return View(
        title,
        (
            Table(header, best, range(1, len(header))),
            Table(("for all of them", "voltage [V]", "value"), rows, (1,)),
            Text(f"{found.runs} runs"), *(Text(note, "note") for note in found.notes),
        ),
        (Figure(lambda: draw_passive(found), title),),
    )  # fmt: skip


@look()
def draw_ensemble(found: Ensemble) -> Page:
    """Return the figure of an ensemble of at least two runs that are done.

    One row per output, at most six. Left: a histogram with the median and the bands between the
    quantiles of 5 and 95, 25 and 75 %. Right: rank correlations (Spearman) of the output with the
    numbers that vary, largest first, and what chance alone would give.
    """
    done = found.runs[found.runs["status"] == "done"]
    outputs = found.plan.outputs[:MOST_OUTPUTS]
    numbers = varying_numbers(found.plan, done)
    failed = len(found.runs) - len(done)
    failures = f"{failed} runs failed" if failed else "none failed"
    left_out = len(found.plan.outputs) - len(outputs)
    more = f" {left_out} more outputs are in the table." if left_out else ""
    subtitle = (
        f"{len(done)} runs, {failures}. Line: median; bands: 25 to 75 % and 5 to 95 % of the runs."
        + (" Right: how strongly each varied number moves the output (rank correlation); "
           "grey: no more than chance." if numbers else "")
        + more
    )  # fmt: skip
    page = Page(8.2 if numbers else 5.6, _HEIGHT * len(outputs), found.plan.title, subtitle)
    columns = 2 if numbers else 1
    ratios: dict[str, Any] = {"width_ratios": [1.0, 0.8]} if numbers else {}
    grid = page.grid(
        len(outputs), columns, left=0.55, right=0.25, column_gap=2.15, row_gap=0.68, **ratios
    )
    for row, output in enumerate(outputs):
        axes = page.figure.add_subplot(grid[row, 0])
        _histogram(axes, output, done[output.name].to_numpy())
        if numbers:
            side = page.figure.add_subplot(grid[row, 1])
            _influence(side, correlations(done, output.name, numbers), len(done))
            if row == len(outputs) - 1:
                side.set_xlabel("rank correlation")
    return page


def varying_numbers(plan: Any, done: pd.DataFrame) -> list[str]:
    """Return the varied names whose values are numbers and not all the same."""
    return [
        varied.name
        for varied in plan.varied
        if done[varied.name].dtype.kind in "fi" and done[varied.name].nunique() > 1
    ]


def correlations(done: pd.DataFrame, output: str, names: list[str]) -> list[tuple[str, float]]:
    """Return names with Spearman's rank correlation with an output, largest size first."""
    ranks = done[[*names, output]].rank()
    if ranks[output].nunique() < 2:
        return [(name, 0.0) for name in names]
    found = [(name, float(np.corrcoef(ranks[name], ranks[output])[0, 1])) for name in names]
    return sorted(found, key=lambda pair: -abs(pair[1]))


def _histogram(axes: Axes, output: Statistic, values: Any) -> None:
    factor, unit = _SHOWN.get(output.unit, (1.0, output.unit))
    values = values * factor
    q05, q25, q50, q75, q95 = np.quantile(values, (0.05, 0.25, 0.5, 0.75, 0.95))
    # Freedman and Diaconis (1981), within reason.
    width = 2.0 * (q75 - q25) / len(values) ** (1.0 / 3.0)
    span = float(np.ptp(values))
    bins = int(np.clip(span / width, 8, 60)) if width > 0.0 and span > 0.0 else 8
    axes.axvspan(q05, q95, color=BLUE, alpha=0.10, linewidth=0)
    axes.axvspan(q25, q75, color=BLUE, alpha=0.16, linewidth=0)
    axes.hist(values, bins=bins, color=BLUE, alpha=0.75, edgecolor="white", linewidth=0.4)
    axes.axvline(q50, color=VERMILION, linewidth=1.6)
    axes.set_title(f"{_title(output)} [{unit}]" if unit else _title(output))
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.set_yticks([])
    axes.margins(x=0.02)
    text = f"median {q50:.3g}\n5 to 95 %: {q05:.3g} to {q95:.3g}"
    axes.text(
        0.985, 0.95, text, transform=axes.transAxes, ha="right", va="top", fontsize=7.5,
        color=GREY, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.5},
    )  # fmt: skip


def _influence(axes: Axes, pairs: list[tuple[str, float]], runs: int) -> None:
    pairs = pairs[:MOST_NAMES][::-1]
    chance = 2.0 / np.sqrt(max(runs - 1, 1))
    places = np.arange(len(pairs))
    values = np.array([value for _, value in pairs])
    colours = [BLUE if abs(value) > chance else PALE for value in values]
    axes.barh(places, values, height=0.66, color=colours)
    axes.axvline(0.0, color=INK, linewidth=0.7)
    axes.set_yticks(places, [name for name, _ in pairs], fontsize=6.8)
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(-1.0, 1.0)
    axes.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    axes.spines["left"].set_visible(False)
    axes.grid(axis="y", visible=False)


def _title(output: Statistic) -> str:
    """Return an output as words: "peak of floor2 acceleration absolute"."""
    component, _, port = output.column.rpartition(".")
    statistic = {"rms": "RMS"}.get(output.statistic, output.statistic)
    return f"{statistic} of {port.replace('_', ' ')} ({component})"


@look()
def draw_passive(found: Passive) -> Page:
    """Return the figure of the judged output over the voltage, the least of each motion marked."""
    fair = found.goals["regret"]
    what = found.what
    title = f"Best constant voltage for {len(found.motions)} ground motions: {fair.voltage:.2g} V"
    subtitle = (
        f"{what} over the voltage. Ring: least for the motion. Dashed: the "
        f"voltage that is at most {100 * (fair.value - 1):.0f} % above the least for any of them."
    )
    page = Page(7.6, 4.7, title, subtitle)
    axes = page.figure.add_subplot(page.grid(1, 1, left=0.5, right=1.9)[0, 0])
    axes.axvline(fair.voltage, color=PALE, linestyle=(0, (4, 3)), linewidth=1.2)
    colours = ramp(len(found.motions))
    for motion, values, best, colour in zip(
        found.motions, found.values, found.best, colours, strict=True
    ):
        axes.plot(found.grid, values, color=colour, linewidth=1.6)
        axes.plot(
            best.voltage, best.value, "o", markersize=8, markerfacecolor="white",
            markeredgecolor=INK,
        )  # fmt: skip
        label(axes, f"{best.value:.3g}", best.voltage, best.value, INK, xytext=(0, 8), ha="center")
        end, last = float(found.grid[-1]), float(values[-1])
        label(axes, motion.name, end, last, colour, xytext=(8, 0), va="center")
    axes.set_title(f"{what} [{found.unit}]")
    axes.set_xlabel("voltage [V]")
    axes.set_ylim(0.0, 1.06 * float(found.values.max()))
    return page
