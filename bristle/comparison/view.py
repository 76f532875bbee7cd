"""Figures and tables of a comparison: how wrong a prediction is, where, and where not."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.text import log_ticks, percent, plain, quantity, scale, short_z
from ..data.channels import Label, label_text, varying
from ..data.cycles import by_level, cycles, steady
from ..identification.search import z_scale
from ..physics.drive import DRIVES
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import BLUE, FLOOR, GREY, INK, PALE, VERMILION, Page, look, zero_lines
from .conditions import known_of
from .misfit import CLOSE, RunMisfit, SiteMisfit
from .names import name_of, site_name
from .patterns import ResidualPattern
from .predictions import SHOWN, RunPrediction, shown
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
_SHARES = "Fit: 1 - error / standard deviation of what was measured; VAF: the same of variances."
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
    caption = (
        "Dots are samples, lines through them their mean with its 95 % interval, blue bands twice "
        "the expected noise. The spectrum of the error stands beside that of the noise."
    )
    figure = Figure(lambda: draw_comparison(comparison), title, caption)
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
    plain_note = f"{_NOTE} {_SHARES}"
    note = f"{plain_note} Half step: what half the calculation step changes, over the noise."
    table = Table(header, rows, range(1, len(header)), title, note=note)
    if all(run.numerical_z < _NO_STEP for run in (*comparison.runs, comparison.total)):
        table = _without(table, (_HALF,))._replace(note=plain_note)
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
    note = _SHARES if _SHARES in table.note else ""
    return _without(table, apart)._replace(note=note if _NOTE in table.note else table.note)


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
        begin = 0.95 + 0.25 * len(sites) if sites else 0.0  # with title and axis
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


def draw_sites(axes: Axes, sites: Sequence[SiteMisfit]) -> None:
    """Draw z at every site of a building, the top storey above, over the band of noise.

    Small dots are runs, the large one all of them with the 95 % interval.
    """
    shown = sorted((one for one in sites if one.identifiable), key=lambda one: _floor(one.site))
    axes.set_xscale("log")
    axes.axvspan(1.0 / CLOSE, CLOSE, color=FLOOR, lw=0.0)
    for y, one in enumerate(shown):
        colour = VERMILION if one.fails else BLUE
        axes.plot(one.z_interval, [y, y], color=colour, lw=1.6)
        axes.plot([run.z for run in one.runs], [y] * len(one.runs), ".", ms=4, color=GREY)
        axes.plot([one.z], [y], "o", ms=5.5, color=colour)
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


# The panels that hold a prediction against a measurement, one function each.

MEASURED, PREDICTED, ERROR = INK, BLUE, VERMILION
_DOTS = 3000
_WINDOW = 600  # samples of a history that are told apart on paper


def worst_window(prediction: RunPrediction, samples: int = _WINDOW) -> slice:
    """Return the stretch of a run where its normalised error is largest."""
    count = len(prediction.measured)
    if count <= samples:
        return slice(0, count)
    power = np.minimum(((prediction.measured - prediction.predicted) / prediction.sigma) ** 2, 1e4)
    power[: prediction.skip] = 0.0
    power[prediction.skip :][~prediction.judged] = 0.0
    total = np.concatenate([[0.0], np.cumsum(power)])
    begin = int(np.argmax(total[samples:] - total[:-samples]))
    return slice(begin, begin + samples)


def draw_history(axes: Axes, prediction: RunPrediction, window: slice) -> None:
    """Draw measured over predicted output in a stretch of a run."""
    time = prediction.time[window]
    axes.plot(time, prediction.measured[window], color=MEASURED, lw=1.6, alpha=0.85)
    axes.plot(time, prediction.predicted[window], color=PREDICTED, lw=1.3)
    axes.axhline(0.0, color=PALE, lw=0.8, zorder=1)
    axes.margins(x=0.0, y=0.08)
    axes.set_title(
        f"{_named(prediction)} [{prediction.unit}], {prediction.name}: its worst stretch"
    )
    _legend(axes, ("measured", MEASURED), ("model", PREDICTED))


def draw_error(axes: Axes, prediction: RunPrediction, window: slice) -> None:
    """Draw the error in a stretch of a run over the band that noise explains."""
    time, error = prediction.time[window], (prediction.measured - prediction.predicted)[window]
    band = 2.0 * prediction.sigma[window]
    axes.fill_between(time, -band, band, color="#dbe5ec", lw=0.0)
    axes.plot(time, error, color=ERROR, lw=0.9)
    axes.margins(x=0.0)
    top = max(1.15 * float(np.quantile(np.abs(error), 0.995)), 1.5 * float(np.median(band)))
    axes.set_ylim(-top, top)
    axes.set_title(f"measured less model [{prediction.unit}]")
    _legend(axes, ("twice the expected noise", "#9fb6c6"))
    axes.set_xlabel("time [s]", loc="right", labelpad=0)


def draw_loop(axes: Axes, prediction: RunPrediction, over: str) -> None:
    """Draw measured and predicted output over a coordinate.

    Parameters
    ----------
    axes : where to draw
    prediction : the run
    over : name of the coordinate, such as "displacement"
    """
    factor, unit = SHOWN.get(over, (1.0, ""))
    part = slice(prediction.skip, None)
    x = factor * prediction.coordinates[over][part]
    zero_lines(axes)
    axes.plot(x, prediction.measured[part], color=MEASURED, lw=1.3, alpha=0.75)
    axes.plot(x, prediction.predicted[part], color=PREDICTED, lw=1.0)
    axes.set_title(
        f"{_named(prediction)} [{prediction.unit}] over {name_of(over, prediction.site)}"
    )
    axes.set_xlabel(f"{_axis(over, prediction.site)} [{unit}]")
    axes.margins(0.05)


def draw_pattern(
    axes: Axes,
    comparison: Comparison,
    pattern: ResidualPattern,
    after: ResidualPattern | None = None,
) -> None:
    """Draw the error over a coordinate: samples, and the mean in bins with its interval.

    Parameters
    ----------
    axes : where to draw
    comparison : whose error it is
    pattern : the coordinate with its bins
    after : a pattern whose means are taken off first; None for none
    """
    units, size = comparison.predictions[0].units, float(np.max(np.abs(pattern.centre)))
    factor, unit = shown(pattern.coordinate, units, size)
    x = np.concatenate([one.judged_along()[pattern.coordinate] for one in comparison.predictions])
    y = np.concatenate([one.only_judged(one.residual) for one in comparison.predictions])
    sigma = np.concatenate(
        [one.only_judged(one.sigma[one.skip :]) for one in comparison.predictions]
    )
    if after:
        y = y - _means_along(comparison, after)
    if pattern.turned:
        y = y * _direction(comparison)
    axes.axhline(0.0, color=PALE, lw=0.8, zorder=1)
    if np.min(x) <= 0.0 <= np.max(x):  # from 25 °C on, a line at zero is an empty panel
        axes.axvline(0.0, color=PALE, lw=0.8, zorder=1)
    band = 2.0 * float(np.median(sigma))
    axes.axhspan(-band, band, color="#dbe5ec", lw=0.0, zorder=0)
    every = max(1, len(x) // _DOTS)
    axes.plot(factor * x[::every], y[::every], ".", ms=1.6, color=PALE, alpha=0.7, zorder=1.5)
    axes.errorbar(
        factor * pattern.centre, pattern.mean, 2.0 * pattern.std, color=ERROR, lw=1.6, marker="o",
        ms=3.0, elinewidth=0.9, zorder=3,
    )  # fmt: skip
    top = max(1.25 * float(np.max(np.abs(pattern.mean))), 1.6 * band)
    axes.set_ylim(-top, top)
    what = "more resistance than the model" if pattern.turned else "measured less model"
    if after:
        what = f"remaining: {what}"
    axes.set_title(f"{what} [{comparison.unit}]")
    axis = _axis(pattern.coordinate, comparison.site)
    axes.set_xlabel(axis + (f" [{unit}]" if unit else ""))
    if pattern.coordinate == "direction":
        axes.set_xlim(-1.8, 1.8)
        axes.set_xticks([-1.0, 1.0], ["moving back", "moving outwards"])
    carried = percent(pattern.share, 0) if pattern.share >= 0.01 else "below 1 %"
    of = "the remaining error" if after else "the error's power"
    share = f"{carried} of {of}" if pattern.significant else "no more than chance"
    axes.text(0.98, 0.97, share, transform=axes.transAxes, ha="right", va="top", fontsize=8.5,
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
              color=ERROR if pattern.significant else GREY)  # fmt: skip


def _direction(comparison: Comparison) -> Array:
    return np.concatenate([one.judged_along()["direction"] for one in comparison.predictions])


def _means_along(comparison: Comparison, pattern: ResidualPattern) -> Array:
    """Return the error's mean (n,) that a pattern gives each sample."""
    x = np.concatenate([one.judged_along()[pattern.coordinate] for one in comparison.predictions])
    bins = np.clip(np.searchsorted(pattern.low, x, side="right") - 1, 0, len(pattern.mean) - 1)
    means = pattern.mean[bins]
    return np.asarray(means * _direction(comparison) if pattern.turned else means)


def draw_spectrum(axes: Axes, comparison: Comparison) -> None:
    """Draw the power spectral densities of error, expected noise and measured output."""
    found = comparison.spectrum
    f = found.frequency[1:]
    for values, colour, width in (
        (found.measured, PALE, 1.0), (found.noise, BLUE, 1.3), (found.residual, ERROR, 1.3),
    ):  # fmt: skip
        axes.loglog(f, values[1:], color=colour, lw=width)
    floor = float(np.min(found.noise[1:]))
    axes.set_ylim(0.3 * floor, 3.0 * float(np.max(found.measured[1:])))
    axes.set_xlim(f[0], f[-1])
    axes.set_title(f"PSD [{comparison.unit}²/Hz]")
    for axis, ends in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        axis.set_major_formatter(_as_text(log_ticks(*ends)))
        axis.set_minor_formatter(lambda value, _: "")
    axes.set_xlabel("frequency [Hz]")
    _legend(axes, ("measured", PALE), ("error", ERROR), ("expected noise", BLUE))


def _as_text(text: Callable[[float], str]) -> Callable[[float, float], str]:
    """Return what writes a mark, as an axis calls it: with the number of the mark."""
    return lambda value, _: text(value)


def draw_regimes(axes: Axes, comparison: Comparison) -> None:
    """Draw z in classes of speed and command, 1 being what noise explains."""
    cells = [one for one in comparison.regimes if one.speed or one.command]
    speeds = list(dict.fromkeys(one.speed for one in cells if one.speed))
    levels = list(dict.fromkeys(one.command for one in cells if one.command))
    pairs = {(one.speed, one.command): one.z for one in cells}
    columns, rows = (levels or [""]), (speeds or [""])
    values = np.array([[pairs.get((s, V), np.nan) for V in columns] for s in rows])
    shown = np.log10(np.maximum(values, 1.0))
    axes.imshow(shown, cmap="OrRd", vmin=0.0, vmax=1.0, aspect="auto", origin="lower")
    for (i, j), z in np.ndenumerate(values):
        if np.isfinite(z):
            colour = "white" if z > 5.0 else INK
            axes.text(j, i, short_z(z), ha="center", va="center",
                      color=colour, fontsize=10)  # fmt: skip
    axes.set_xticks(range(len(columns)), [_short(name) for name in columns], fontsize=8)
    axes.set_yticks(range(len(rows)), [_short(name) for name in rows], fontsize=8)
    axes.grid(visible=False)
    axes.set_title("error / noise (z)")


def _legend(axes: Axes, *names: tuple[str, str]) -> None:
    """Write names into the title's line, from the right, each in its colour."""
    text = "   ".join(name for name, _ in names)
    if len(names) == 1:
        axes.set_title(text, loc="right", fontsize=8.5, color=names[0][1])
        return
    handles = [axes.plot([], [], color=colour, lw=2.0)[0] for _, colour in names]
    axes.legend(
        handles, [name for name, _ in names], loc="lower right", bbox_to_anchor=(1.0, 1.0),
        ncols=len(names), labelcolor="linecolor", fontsize=8, handlelength=0.9,
        columnspacing=0.9, handletextpad=0.4, borderaxespad=0.15,
    )  # fmt: skip


def _axis(coordinate: str, site: str) -> str:
    return name_of(coordinate, site).removeprefix("the ")


def _named(prediction: RunPrediction) -> str:
    return capitalised(prediction.quantity.replace("_", " "))


def _short(text: str) -> str:
    """Return "low speed\n(below 12 mm/s)" of "at low speed (below 12 mm/s)"."""
    return text.removeprefix("at ").replace(" (", "\n(")


# Loops of single cycles, by the level of the command: measured against model, with its band.

MOST = 4
"""Cycles side by side."""
OVERS = ("velocity", "displacement")
"""What loops are drawn over."""
BAND = "#cfe3f1"
"""The band in which a true model's measurement would be."""
_VARIES = 1e-2
"""Range of a command, over its largest value, from which on it tells cycles apart."""
_OFF = 5e-3
"""Share of its largest value below which a command is off."""


class OneCycle(NamedTuple):
    """A cycle of a run to draw: which samples, its level in words, and its error over noise."""

    prediction: RunPrediction
    part: slice
    text: str
    z: float


def chosen_cycles(predictions: Sequence[RunPrediction], most: int = MOST) -> list[OneCycle]:
    """Return one cycle in each range of the command.

    Where no command varies, of a number that is known of whole runs, such as their temperature or
    frequency; where none is, of speed. Nothing where displacement and velocity are not known.

    Parameters
    ----------
    predictions : runs of one output at one site
    most : cycles at the most
    """
    if not all({*OVERS} <= {*one.coordinates} for one in predictions):
        return []
    name, told = _level(predictions)
    motions = [
        (one.coordinates["displacement"], one.coordinates["velocity"], one.coordinates[name])
        for one in predictions
    ]
    skip = max(one.skip for one in predictions)
    found = [one for one in cycles(motions, skip) if _whole(predictions[one.run], one.part)]
    if name == "speed":  # the median of a cycle is no measure of how fast it is
        peaks = [float(np.max(np.abs(motions[one.run][1][one.part]))) for one in found]
        found = [one._replace(level=v, spread=0.0) for one, v in zip(found, peaks, strict=True)]
    out = []
    for one in by_level(found, most):
        of = predictions[one.run]
        text = told(one.level)
        if name != "speed" and not steady(one, found):
            low, high = np.quantile(motions[one.run][2][one.part], [0.05, 0.95])
            text = f"{told(low).partition(' ')[0]} to {told(high)}"
        out.append(OneCycle(of, one.part, text, z_of(of, one.part)))
    return out


def under(shown: Sequence[OneCycle], predictions: Sequence[RunPrediction]) -> list[OneCycle]:
    """Return the same cycles as another model predicts them.

    Parameters
    ----------
    shown : cycles
    predictions : the same runs under the other model
    """
    by_name = {one.name: one for one in predictions}
    there = [one._replace(prediction=by_name[one.prediction.name]) for one in shown]
    return [one._replace(z=z_of(one.prediction, one.part)) for one in there]


def z_of(of: RunPrediction, part: slice) -> float:
    """Return error / noise of a part of a run."""
    if not of.noise_known:
        return float("nan")
    return z_scale((of.measured - of.predicted)[part] / of.sigma[part])


def _whole(of: RunPrediction, part: slice) -> bool:
    """Return whether all samples of a part were measured, one after the other."""
    known = of.known is None or bool(np.all(of.known[part]))
    return known and (of.index is None or bool(np.all(np.diff(of.index[part]) == 1)))


def _level(predictions: Sequence[RunPrediction]) -> tuple[str, Any]:
    """Return the coordinate that tells cycles apart, and what says one of its values."""
    drive = predictions[0].drive
    if all(drive in one.coordinates for one in predictions):
        values = np.concatenate([one.coordinates[drive] for one in predictions])
        if float(np.ptp(values)) > _VARIES * float(np.max(np.abs(values))) > 0.0:
            largest = float(np.max(np.abs(values)))
            unit = DRIVES[drive].unit

            def level(value: float) -> str:
                off = abs(value) < _OFF * largest  # noise about zero is no command
                return f"{plain(0.0 if off else value)} {unit}"

            return drive, level
    for name in predictions[0].labels:  # what is known of whole runs, such as a temperature
        known = [one.labels.get(name, "") for one in predictions if name in one.coordinates]
        numbers = [one for one in known if not isinstance(one, str)]
        if len(numbers) == len(predictions) and max(numbers) > min(numbers):
            return name, lambda value, name=name: f"{name} {label_text(name, value)}"
    return "speed", lambda value: f"up to {quantity(value, 'm/s', 2)}"


def draw_cycle(
    axes: Axes,
    one: OneCycle,
    over: str,
    *,
    force: tuple[float, str] = (1.0, "N"),
) -> None:
    """Draw a cycle, measured and predicted, in the band of 95 % of a true model's samples.

    Parameters
    ----------
    axes : where to draw
    one : the cycle
    over : name of the coordinate
    force : factor from SI and unit in which the output is shown
    """
    from matplotlib.collections import PolyCollection

    of, (factor, _) = one.prediction, force
    x = SHOWN.get(over, (1.0, ""))[0] * of.coordinates[over][one.part]
    predicted = factor * of.predicted[one.part]
    zero_lines(axes)
    half = 1.96 * factor * of.sigma[one.part]
    pieces = [*ribbon(x, predicted - half, predicted + half)]
    axes.add_collection(PolyCollection(pieces, facecolors=BAND, lw=0.0))
    axes.plot(x, factor * of.measured[one.part], color=INK, lw=1.5, alpha=0.85)
    axes.plot(x, predicted, color=BLUE, lw=1.2)
    axes.text(
        0.03, 0.97, f"z = {short_z(one.z)}", transform=axes.transAxes, va="top", fontsize=8.0,
        color=GREY,
    )  # fmt: skip
    axes.tick_params(labelsize=8)


def ribbon(x: Array, low: Array, high: Array) -> Array:
    """Return the corners (n - 1, 4, 2) of the pieces of a band along a curve that turns back.

    Parameters
    ----------
    x, low, high : (n,) of the curve, and the edges of its band
    """
    lower, upper = np.stack([x, low], axis=1), np.stack([x, high], axis=1)
    return np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1)


def draw_loops(
    rows: Mapping[str, Sequence[Axes]], shown: Sequence[OneCycle], *, force: tuple[float, str]
) -> None:
    """Draw cycles side by side, one row per coordinate, all panels of a row on one scale.

    Parameters
    ----------
    rows : coordinate to one axes per cycle
    shown : the cycles
    force : factor from SI and unit in which the output is shown
    """
    for number, (over, panels) in enumerate(rows.items()):
        site = shown[0].prediction.site
        axis = _axis(over, site)
        for panel, one in zip(panels, shown, strict=False):
            draw_cycle(panel, one, over, force=force)
            panel.set_xlabel(f"{axis} [{SHOWN.get(over, (1.0, ''))[1]}]", fontsize=8)
            if number == 0:
                panel.set_title(one.text, fontsize=9.5)
                begin = one.prediction.time[one.part.start]
                panel.text(
                    0.97, 0.03, f"{one.prediction.name}\n{begin:.3g} s", ha="right", fontsize=6.5,
                    color=GREY, transform=panel.transAxes,
                )  # fmt: skip
        _alike(panels)


def _alike(panels: Sequence[Axes]) -> None:
    """Give panels side by side the same ranges; only the first one names its values."""
    spans = [(panel.get_xlim(), panel.get_ylim()) for panel in panels]
    for number, panel in enumerate(panels):
        panel.set_xlim(min(x[0] for x, _ in spans), max(x[1] for x, _ in spans))
        panel.set_ylim(min(y[0] for _, y in spans), max(y[1] for _, y in spans))
        if number:
            panel.tick_params(labelleft=False)
