"""Figures and tables of a comparison: how wrong a prediction is, where, and where not."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from ..core.text import percent, plain, scale, short_z
from ..data.channels import Label, label_text, varying
from ..physics.drive import DRIVES
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import BLUE, FLOOR, GREY, INK, VERMILION, Page, look
from .conditions import known_of
from .misfit import CLOSE, RunMisfit, SiteMisfit
from .names import name_of, site_name
from .panels import (
    OVERS,
    OneCycle,
    chosen_cycles,
    draw_error,
    draw_history,
    draw_loop,
    draw_loops,
    draw_pattern,
    draw_regimes,
    draw_spectrum,
    worst_window,
)
from .patterns import ResidualPattern
from .result import Comparison
from .words import FAINT, capitalised

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HISTORY, _PANELS = 3.1, 3.2
"""Heights of the history with its error, and of a row of two panels [in]."""
LOOPS = 4.6
"""Height of two rows of loops of single cycles [in]."""
_EXCESS = "beyond noise"
"""The column that a table has where the noise is known."""
_HALF = "half step [z]"
_NO_STEP = 0.05
"""What half the calculation step changes, over the noise, before it has a column."""
_NOTE = "z: error / noise; a true model has 1."
_SHOWN = 6  # coordinates in a table
_TICKS = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0)


@view_of(Comparison)
def comparison_view(comparison: Comparison) -> View:
    """Return the view of a comparison: its sentences, the error per site or run, then the rest."""
    title = headline(comparison)
    tables = [site_table(comparison)] if comparison.sites else []
    tables += [run_table(comparison), pattern_table(comparison), band_table(comparison)]
    if comparison.labels:
        tables.insert(-2, label_table(comparison))
    figure = Figure(lambda: draw_comparison(comparison), title)
    return View(title, (*map(Text, comparison.sentences), tables[0]), (*tables[1:], figure))


def site_table(comparison: Comparison) -> Table:
    """Return the error at each site of a building, the worst first."""
    known = [one.total.signal for one in comparison.sites if one.total.samples]
    factor, unit = scale("N", max(known, default=0.0))
    header = ["site", f"error [{unit}]", "of force", f"noise [{unit}]", "z", "95 %", "depends on"]
    rows = [_site(one, factor) for one in comparison.sites]
    return Table(header, rows, range(1, 6), "Error at every site", note=_NOTE)


def _site(one: SiteMisfit, factor: float) -> list[str]:
    name = site_name(one.site).removeprefix("the ")
    if not one.total.samples:
        return [name, "", "", "", "", "", one.why_not]
    (low, high), total, pattern = one.z_interval, one.total, one.pattern
    worth = pattern is not None and pattern.share >= FAINT
    return [
        name, plain(factor * total.rms, 4), percent(total.share),
        "" if one.why_not else plain(factor * total.noise), short_z(one.z),
        "" if one.why_not else f"{short_z(low)} to {short_z(high)}",
        one.why_not
        or (name_of(pattern.coordinate, one.site) if pattern is not None and worth else "nothing"),
    ]  # fmt: skip


def run_table(comparison: Comparison) -> Table:
    """Return the error on each run and over all, with the numerical error beside it."""
    factor, unit = scale(comparison.unit, comparison.total.signal)
    known = known_of(comparison.predictions)
    names = varying(known)
    header = ["run", f"error [{unit}]", "of force", f"noise [{unit}]", "z", "fit", "VAF"]
    header += [_HALF, *names]
    own = [[_label(name, one[name]) for name in names] for one in known]
    rows = [[*_run(run, factor), *labels] for run, labels in zip(comparison.runs, own, strict=True)]
    if len(rows) > 1:
        rows.append([*_run(comparison.total, factor), *["" for _ in names]])
    title = "Error on each run"
    if comparison.sites:
        title = f"{capitalised(site_name(comparison.site))}: error on each run"
    note = f"{_NOTE} Half step: what half the calculation step changes, over the noise."
    table = Table(header, rows, range(1, len(header)), title, note=note)
    if all(run.numerical_z < _NO_STEP for run in (*comparison.runs, comparison.total)):
        table = _without(table, (_HALF,))._replace(note=_NOTE)
    return _as_known(comparison, table)


def _label(name: str, value: Label) -> str:
    return label_text(name, value, DRIVES[name].unit if name in DRIVES else "")


def label_table(comparison: Comparison) -> Table:
    """Return the error by what is known of whole runs: one row per value of a label."""
    rows = [
        [name_of(one.name), one.text, short_z(one.z), str(one.runs)] for one in comparison.labels
    ]
    title = "Error by the labels of the runs"
    return Table(["label", "value", "z", "runs"], rows, (1, 2, 3), title)


def _run(run: RunMisfit, factor: float) -> list[str]:
    numerical = plain(run.numerical_z, 2) if run.numerical_z == run.numerical_z else "not tried"
    if run.z != run.z:
        numerical = short_z(None)
    return [
        run.name, plain(factor * run.rms, 4), percent(run.share), plain(factor * run.noise),
        short_z(run.z), percent(run.fit), percent(run.accounted), numerical,
    ]  # fmt: skip


def pattern_table(comparison: Comparison) -> Table:
    """Return the coordinates by how much of the error's power each carries."""
    header = ["coordinate", "of error", _EXCESS, "chance"]
    rows = [_pattern(one, comparison.site) for one in comparison.patterns[:_SHOWN]]
    title = "What the error depends on"
    note = (
        "Of error: the part of its power along the coordinate. Chance: how often a true model "
        "would show such a part along any coordinate."
    )
    return _as_known(comparison, Table(header, rows, (1, 2, 3), title, note=note))


def _pattern(pattern: ResidualPattern, site: str) -> list[str]:
    name = name_of(pattern.coordinate, site)
    name += ", with the direction of motion" if pattern.turned else ""
    excess = percent(pattern.of_excess, 0) if pattern.of_excess == pattern.of_excess else "-"
    chance = plain(pattern.p, 1) if pattern.p >= 0.001 else "< 0.001"
    return [name, percent(pattern.share), excess, chance]


def band_table(comparison: Comparison) -> Table:
    """Return the error in octaves against the noise in each."""
    factor, unit = scale(comparison.unit, comparison.total.signal)
    header = ["band [Hz]", "z", f"error [{unit}]", _EXCESS, "coherence"]
    rows = [
        [
            f"{plain(band.low)} - {plain(band.high)}", short_z(band.z), plain(factor * band.rms, 2),
            percent(band.share, 0), f"{band.coherence:.2f}",
        ]
        for band in comparison.spectrum.bands
    ]  # fmt: skip
    title = "The error by frequency"
    return _as_known(comparison, Table(header, rows, range(1, 5), title))


def _as_known(comparison: Comparison, table: Table) -> Table:
    """Return a table without what only a known noise tells, and what is nowhere known."""
    if comparison.noise_known:
        empty = [
            name for k, name in enumerate(table.header) if {row[k] for row in table.rows} == {"-"}
        ]
        return _without(table, empty)
    apart = ("z", _EXCESS, _HALF, *(one for one in table.header if one.startswith("noise [")))
    return _without(table, apart)._replace(note="" if _NOTE in table.note else table.note)


def _without(table: Table, names: Collection[str]) -> Table:
    """Return a table, all of whose columns but the first are numbers, without some columns."""
    kept = [k for k, name in enumerate(table.header) if name not in names]
    return table._replace(
        header=[table.header[k] for k in kept],
        rows=[[row[k] for k in kept] for row in table.rows],
        numbers=range(1, len(kept)),
    )


def draw_comparison(comparison: Comparison) -> Page:
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
        page = Page(9.6, height, headline(comparison), " ".join(comparison.sentences))
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
    shown = f"{one.quantity.replace('_', ' ')} [{force[1]}]"
    colours = "measured (black) and model (blue)"
    band = "Band: 95 % of a true model's samples."
    page.figure.text(
        0.65 / page.width, (page.foot + inner - top - 0.14) / page.height,
        f"{name}: {shown}, {colours}" if name else f"{shown} in single cycles, {colours}. {band}",
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
        return f"The model's {what} is right within its noise (error / noise z = {z:.2f})"
    times = plain(z, 2 if z < 100.0 else 3)
    off = f"The model's {what} is off by {percent(comparison.error.headline[1])}"
    text = f"{off}, {times} times the noise (z)"
    if not comparison.noise_known:
        text = f"{off}, noise included"
    if comparison.first:
        along = name_of(comparison.first.coordinate, comparison.site)
        text += f"; the error depends mainly on {along}"
    return text


def sites_height(count: int) -> float:
    """Return the height [in] of a panel of so many sites, with its title and axis."""
    return 0.95 + 0.25 * count


def draw_sites(axes: Axes, sites: Sequence[SiteMisfit], before: Sequence[SiteMisfit] = ()) -> None:
    """Draw z at every site of a building, the top storey above, over the band of noise.

    Small dots are runs, the large one all of them with the 95 % interval; `before` are the sites of
    an earlier model, drawn as rings.
    """
    shown = sorted((one for one in sites if one.identifiable), key=lambda one: _floor(one.site))
    earlier = {one.site: one.z for one in before if one.identifiable}
    axes.set_xscale("log")
    axes.axvspan(1.0 / CLOSE, CLOSE, color=FLOOR, lw=0.0)
    for y, one in enumerate(shown):
        colour = VERMILION if one.fails else BLUE
        axes.plot(one.z_interval, [y, y], color=colour, lw=1.6)
        axes.plot([run.z for run in one.runs], [y] * len(one.runs), ".", ms=4, color=GREY)
        axes.plot([one.z], [y], "o", ms=5.5, color=colour)
        if one.site in earlier:
            axes.plot([earlier[one.site]], [y], "o", ms=6.5, mfc="none", mec=GREY, mew=1.1)
        pattern = one.pattern if one.fails and one.pattern and one.pattern.share >= FAINT else None
        turns = (
            f", along {name_of(pattern.coordinate, one.site).removeprefix('the ')}"
            if pattern
            else ""
        )
        axes.text(1.02, y, f"z = {short_z(one.z)}{turns}", transform=axes.get_yaxis_transform(),
                  va="center", fontsize=8.5, color=colour if one.fails else INK)  # fmt: skip
    names = [site_name(one.site).removeprefix("the ") for one in shown]
    axes.set_yticks(range(len(shown)), names, fontsize=9, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(-0.6, len(shown) - 0.4)
    every = [z for one in shown for z in (one.z, *one.z_interval, *(r.z for r in one.runs))]
    every += list(earlier.values())
    low, high = min([*every, 0.7]), max([*every, 2.0])
    axes.set_xlim(0.9 * max(low, 0.1), 1.15 * high)
    steps = [z for z in _TICKS if axes.get_xlim()[0] <= z <= axes.get_xlim()[1]]
    axes.set_xticks(steps, [f"{z:g}" for z in steps])
    axes.xaxis.set_minor_formatter(lambda value, _: "")
    axes.grid(visible=False, axis="y")
    axes.set_title("error / noise (z) at every site; green: noise floor")


def _floor(site: str) -> int:
    """Return where a site is drawn, from below: damper, layer, storeys."""
    if site.startswith("storey"):
        return int(site.removeprefix("storey"))
    return {"damper": -1}.get(site, 0)


def sites_page(now: Comparison, before: Comparison | None, width: float) -> Page:
    """Return z at every site of a building, and of the model before the last added effect."""
    with look():
        page = Page(width, sites_height(len(now.sites)), "")
        grid = page.grid(1, 1, top=0.35, bottom=0.35, left=1.2, right=2.9)
        draw_sites(page.figure.add_subplot(grid[0, 0]), now.sites, before.sites if before else ())
    return page
