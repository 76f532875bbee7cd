"""What was learned, in words, tables and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from ..comparison.names import site_name
from ..core.arrays import Array
from ..core.text import percent, scale, short_z
from ..view.blocks import Block, Table, Text, View, view_of
from ..view.style import BLUE, GREY, PALE, VERMILION, Page, look, png, ramp
from .closed_forms import ClosedForm, in_words, name_of, nearest_of
from .closure import LearnedClosure
from .curve import Curve
from .fit import Fitted
from .result import LearnedEffect
from .signals import GIVEN, RING, response
from .surface import continues

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@view_of(LearnedEffect)
def learned_view(found: LearnedEffect) -> View:
    """Return the view of a learned effect: what it is, what it explains, its files."""
    title, *rest = found.sentences()
    files: list[Block] = []
    if found.file is not None:
        files.append(Text(f"Effect: {found.file}. Picture: {found.picture}."))
    others = [
        [one.curve.words(), short_z(one.trial.z), short_z(one.trial.train)]
        for one in found.found.others
    ]
    header, note = ("also fitted", "z held out", "z train"), "z: error / noise; a true model has 1."
    table = [Table(header, others, (1, 2), note=note)] if others else []
    return View(title, (*map(Text, rest), *files), tuple(table))


@view_of(LearnedClosure)
def closure_view(found: LearnedClosure) -> View:
    """Return the view of a closure: what it is, what it lives on, where it is not supported."""
    title, *rest = found.sentences()
    rows = [[words, percent(part, 0)] for words, part in found.lives_on]
    table = [Table(("input", "goes without it"), rows, (1,))] if rows else []
    file = [] if found.file is None else [Text(f"File: {found.file}.")]
    return View(title, (*map(Text, rest), *file), tuple(table))


# The picture of a learned curve: with its band, its closed form, and what else was tried.

BESIDE = 18
"""Characters in a line of the legend beside a surface."""

ROOM = 0.05
"""Of the axis, above the highest value and below the lowest one."""

FINE = 1000
"""Points at which a closed form is drawn: a ripple turns between two knots."""


def curve_png(learned: LearnedEffect) -> bytes:
    """Return a PNG of a learned curve that is kept, with its 95 % band."""
    return png(draw_curve(learned), 110)


def draw_curve(learned: LearnedEffect) -> Page:
    """Return the figure of a learned curve, drawn and not yet written."""
    found, best, closed = learned.found, learned.found.best, learned.closed
    assert best is not None
    curve = best.curve
    with look():
        where = f" at {site_name(curve.at)}" if curve.place.is_line else ""
        heading = f"{found.name}: {curve.words()}{where}"
        caption = (
            f"z on held-out runs {short_z(found.before.z)} before, {short_z(best.trial.z)} with it"
        )
        caption += f", {short_z(closed.trial.z)} with the formula." if closed is not None else "."
        if curve.across:
            caption += (
                " The bands are 95 % intervals. A hollow point continues those beside it: hardly a "
                "sample is near."
            )
        elif curve.part != RING:
            caption += " The band is the 95 % interval of each value."
        page = Page(8.0, 3.6, heading, caption)
        right = 1.6 if curve.across else 0.4
        top = 0.3 if curve.across or curve.part == RING else 0.6  # a legend stands there
        grid = page.grid(1, 1, top=top, bottom=0.55, left=0.75, right=right)
        axes = page.figure.add_subplot(grid[0, 0])
        if curve.part == RING:
            _draw_mode(axes, curve)
        elif curve.across:
            _draw_surface(axes, best)
        else:
            _draw(axes, best, learned.forms)
    return page


def _draw_mode(axes: Axes, curve: Curve) -> None:
    """Draw by what factor a load cell shows the force at each frequency."""
    mode = dict(curve.memory)
    at = np.geomspace(0.2 * mode["frequency"], 5.0 * mode["frequency"], 800)
    shown = response(curve.values[0], mode["frequency"], mode["damping"], at)
    axes.axhline(1.0, color=PALE, lw=1.0)
    axes.semilogx(at, shown, color=BLUE, lw=2.2)
    axes.set_ylim(0.0, None)
    decades = 10.0 ** np.arange(np.floor(np.log10(at[0])), np.ceil(np.log10(at[-1])) + 1)
    ticks = np.outer(decades, [1.0, 2.0, 5.0]).ravel()
    axes.set_xticks([one for one in ticks if at[0] <= one <= at[-1]])
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.set_xlabel("frequency [Hz]")
    axes.set_title("amplitude of the force shown / of the damper's force")


def _draw_surface(axes: Axes, found: Fitted) -> None:
    """Draw a surface as a family of curves, one for each level of its second signal."""
    curve = found.curve
    shape = len(curve.levels), len(curve.knots)
    s = np.array(curve.knots)
    y, half = np.array(curve.values).reshape(shape), 1.96 * np.array(found.std).reshape(shape)
    told = np.ones(y.size, dtype=bool)
    told[list(continues(curve))] = False
    told = told.reshape(shape)
    across, along = scale(curve.along_unit, float(np.max(np.abs(s))))
    up, unit = scale(curve.unit, float(np.max(np.abs(y))))
    over, level_unit = scale(curve.across_unit, float(np.max(np.abs(curve.levels))))
    level_unit = "" if level_unit in ("", "1") else f" {level_unit}"
    axes.axhline(0.0, color=PALE, lw=1.0)
    for k, (colour, level) in enumerate(zip(ramp(len(y)), curve.levels, strict=True)):
        known = told[k]
        low, high = up * (y[k] - half[k]), up * (y[k] + half[k])
        axes.fill_between(across * s, low, high, where=known, color=colour, alpha=0.12, lw=0.0)
        name = f"{over * level:.3g}{level_unit}"
        axes.plot(across * s, up * y[k], color=colour, lw=1.8, label=name)
        axes.plot(across * s[known], up * y[k][known], color=colour, lw=0.0, marker="o", ms=3.5)
        axes.plot(
            across * s[~known], up * y[k][~known], color=colour, lw=0.0, marker="o", ms=3.5,
            markerfacecolor="white",
        )  # fmt: skip
    _show_values(axes, up * y, up * half)
    _name_axes(axes, curve, along, unit)
    axes.legend(
        frameon=False, labelcolor=GREY, fontsize=9, title_fontsize=9,
        title=fill(curve.second.words, BESIDE), loc="center left", bbox_to_anchor=(1.0, 0.5),
    )  # fmt: skip


def _draw(axes: Axes, found: Fitted, forms: Sequence[ClosedForm]) -> None:
    curve = found.curve
    s, y, half = np.array(curve.knots), np.array(curve.values), 1.96 * np.array(found.std)
    across, along = scale(curve.along_unit, float(np.max(np.abs(s))))
    up, unit = scale(curve.unit, float(np.max(np.abs(y))))
    axes.axhline(0.0, color=PALE, lw=1.0)
    axes.fill_between(across * s, up * (y - half), up * (y + half), color=BLUE, alpha=0.18, lw=0.0)
    axes.plot(across * s, up * y, color=BLUE, lw=2.2, marker="o", ms=4, label="learned")
    best = nearest_of(forms)
    if best is not None:
        named = name_of(forms)
        name = in_words(named, curve) if named else f"nearest form: {best.name}"
        fine = np.linspace(s[0], s[-1], FINE)
        axes.plot(across * fine, up * best.at(fine), color=VERMILION, lw=1.4, ls="--", label=name)
    _show_values(axes, up * y, up * half)
    for given in (value for name, value in curve.memory if name in GIVEN):
        axes.axvline(across * given, color=PALE, lw=1.0)
    _name_axes(axes, curve, along, unit)
    # Above the title: a curve with many waves leaves no room beside it.
    axes.legend(
        frameon=False, labelcolor=GREY, fontsize=9, loc="lower left", bbox_to_anchor=(0.0, 1.13),
        ncols=2, borderpad=0.0, borderaxespad=0.0, columnspacing=1.2,
    )  # fmt: skip


def _show_values(axes: Axes, y: Array, half: Array) -> None:
    """Let the axis show all values and their bands, but of a band no more than the values span.

    A value that the runs hardly tell would else flatten all others.

    Parameters
    ----------
    axes : with the curve, or the curves of a surface
    y, half : values and half the widths of their bands, as drawn
    """
    low, high = float(y.min()), float(y.max())
    span = max(high - low, float(np.median(half)))
    bottom = max(float((y - half).min()), low - span)
    top = min(float((y + half).max()), high + span)
    room = ROOM * (top - bottom) or 1.0
    axes.set_ylim(bottom - room, top + room)


def _name_axes(axes: Axes, curve: Curve, along: str, unit: str) -> None:
    """Name the signal of a curve below its picture, and its part above."""
    words = curve.signal.formula or curve.signal.words
    axes.set_xlabel(f"{words} [{along}]" if along else words)
    quantity_name = curve.of.words.split(" ", 1)[1] if unit not in ("", "1") else "g"
    axes.set_title(
        f"{quantity_name} [{unit}]" if unit not in ("", "1") else f"g in {curve.of.formula}"
    )
