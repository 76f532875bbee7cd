"""Figures and tables of a study's report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..comparison.names import name_of
from ..comparison.panels import (
    OneCycle,
    chosen_cycles,
    draw_loop,
    draw_map,
    draw_pattern,
    draw_regimes,
    draw_spectrum,
    residual_map,
    under,
)
from ..comparison.view import LOOPS, loop_panels, telling_patterns
from ..core.text import command, percent, plain, quantity, short_z
from ..core.text import with_interval as with_interval
from ..data.channels import label_text
from ..physics.laws import LAWS
from ..study.runs import names_of_runs, place_of_run
from ..study.study_file import TEST
from ..view import html
from ..view.style import Page, look

if TYPE_CHECKING:
    from collections.abc import Collection

    from ..comparison.result import Comparison
    from ..data.measurement import Measurement
    from ..model.model import Fact, Model
    from ..study.study import Study


_COLOURS = {
    "white": "estimated from the samples: white",
    "low-passed": "estimated from the samples: white, low-passed above",
    "blue": "estimated from the samples: it grows with frequency, so this is an upper limit",
    "resting": "estimated where the channel is at rest",
    "slow": "estimated where the channel moves slowest: hard to separate from the signal",
    "hidden": "estimated: hard to separate from the signal, so this is a lower limit",
    "rough": "estimated: the signal itself is rough, so this is an upper limit",
    "none": "none seen",
}


def parameter_table(model: Model, drive: str) -> tuple[list[str], list[list[str]], list[str]]:
    """Return header, rows and notes of a model's parameters with their 95 % intervals.

    Without a command (`drive` "") those that act through one alone are left out.
    """
    header = ["parameter", "value", "95 % interval", "unit", "origin", "what it is"]
    rows, edges = [], []
    driven = LAWS[model.law].driven() if not drive and model.law in LAWS else ()
    flat = {name: fact for name, fact in model.written().items() if name not in driven}
    for name, value in flat.items():
        text, half = with_interval(value.value, value.std)
        origin = value.origin if value.free else f"{value.origin}, held"
        rows.append([name, text, half, "" if value.unit == "1" else value.unit, origin,
                     model.declared(name).text])  # fmt: skip
        if value.free and value.std is not None and _at_bound(value):
            edges.append(name)
    notes = [
        "Intervals: 1.96 standard deviations, the noise of force and measured motion both counted."
    ]
    if edges:
        notes.append(f"{', '.join(edges)}: at a bound of the fit, so the interval means little.")
    silent = [n for n, v in flat.items() if v.free and v.std is None and v.origin == "assumed"]
    if silent:
        notes.append(f"Not identified by these data: {', '.join(silent)}.")
    return header, rows, notes


def _at_bound(value: Fact) -> bool:
    """Return whether a value stands at a bound, as far as its own size and interval can tell.

    The range tells nothing: that of a stiffness spans nine orders of magnitude.
    """
    room = max(1e-6 * abs(value.value), 1e-2 * (value.std or 0.0))
    return value.value <= value.low + room or value.value >= value.high - room


def data_table(study: Study, measured: Sequence[Measurement]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows: a line per run, or per piece where gaps have cut it."""
    roles = _roles(study, measured)
    labelled = any(run.labels or run.levels for run in study.settings.runs)
    header = ["run", "role", "duration [s]", "rate [Hz]", "samples", "channels"]
    header += ["known"] if labelled else []
    rows = []
    for run in measured:
        rows.append(
            [
                run.name, roles[run.name], plain(run.duration, 4),
                plain(run.sampling.rate, 5), str(len(run.time)), ", ".join(run.channels),
                *([_known(study, run)] if labelled else []),
            ]
        )  # fmt: skip
    names = names_of_runs(study.settings)
    for one in study.settings.excluded:
        rows.append([names[one.file, one.piece], "left out", *["-"] * (len(header) - 2)])
    return header, rows


def _roles(study: Study, measured: Sequence[Measurement]) -> dict[str, str]:
    """Return what each measurement is for, by its name, as the report calls it."""
    settings = study.settings
    listed = {(run.file, run.piece): run.role for run in settings.runs}
    roles = {one.name: listed[place_of_run(study.folder, settings, one.name)] for one in measured}
    if sum(role != TEST for role in listed.values()) == 1:  # it is split in time
        split = study.runs()
        roles |= {one.name: "train" for one in split.train}
        roles |= {one.name: "holdout" for one in split.holdout}
    return {name: "held out" if role == "holdout" else role for name, role in roles.items()}


def _known(study: Study, run: Measurement) -> str:
    """Return what is known of a whole run: "current 1 A, temperature 40 °C"."""
    levels = {name for one in study.settings.runs for name in one.levels}
    own = {name: float(run[name][0]) for name in sorted(levels) if run.has(name)}
    texts = [f"{name} {label_text(name, level, run.units[name])}" for name, level in own.items()]
    return ", ".join([*texts, *(f"{n} {label_text(n, y)}" for n, y in run.labels.items())])


def data_words(measured: Sequence[Measurement]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows: the noise of each channel over all runs, and how it was found."""
    header = ["channel", "noise", "of its RMS", "how it was found"]
    rows = []
    for channel in dict.fromkeys(name for run in measured for name in run.channels):
        having = [run for run in measured if channel in run.channels]
        noise = float(np.median([run.noise.get(channel, 0.0) for run in having]))
        size = float(np.median([np.std(run[channel]) for run in having]))
        facts = [run.noise_facts.get(channel) for run in having]
        found = dict.fromkeys(
            "given" if f is None else _COLOURS.get(f.colour, f.colour) for f in facts
        )
        unit = having[0].units[channel]
        of = percent(noise / size, 2) if size > 0.0 else "-"
        rows.append([channel, quantity(noise, unit, fine=True), of, "; ".join(found)])
    return header, rows


# The curves that a study learned, in its report: picture, formula, and what each leaves.


def curves_section(study: Study, present: Collection[str]) -> str:
    """Return the section of the curves that were learned here and whose effects there still are.

    "" where there is none.

    Parameters
    ----------
    study : the folder, opened
    present : names of the effects of its present model
    """
    parts = []
    for file in sorted(study.reports_folder.glob("*.json")):
        name = file.stem
        if not (study.effects_folder / f"{name}.py").is_file():
            continue
        parts.append(f"<h3>{html.escape(name)}</h3>")
        try:
            told = json.loads(file.read_text(encoding="utf-8"))
            texts, rows = [str(one) for one in told["sentences"]], _rows(told)
        except (OSError, ValueError, KeyError, TypeError) as error:
            parts.append(html.paragraphs(f"reports/{file.name} cannot be read: {error!r}."))
            continue
        parts.append(html.paragraphs(*texts, kind="lead"))
        picture = file.with_suffix(".png")
        if picture.is_file():
            caption = _caption(told)
            parts.append(html.figure(picture.read_bytes(), texts[0], caption))
        if rows:  # a resonance, elastic-slip elements and a surface have none
            heads = ["form", "formula", "remains of the curve"]
            parts.append(html.table(heads, rows, numbers=(2,)))
        if name not in present:
            add = command("add", study.name, name)
            parts.append(html.paragraphs(f"The present model is without it:  {add}", kind="soft"))
    return html.section("What was learned from these runs", *parts) if parts else ""


def _caption(told: dict[str, Any]) -> str:
    """Return what the picture of a curve shows."""
    if told.get("levels"):
        return (
            "The surface, a curve for each level of its second signal, with the 95 % interval of "
            "each of its values. A hollow point continues those beside it."
        )
    if told["forms"]:
        return (
            "The curve with the 95 % interval of each of its values, and the closed form that "
            "follows it best."
        )
    return "What was learned is no curve with a closed form."


def _rows(told: dict[str, Any]) -> list[list[str]]:
    """Return name, formula and remaining share of the closed forms nearest to a curve."""
    return [
        [str(one["name"]), f"g = {one['formula']}", f"{100.0 * float(one['left']):.0f} %"]
        for one in told["forms"]
    ]


# The pictures of a study's report: staircase, loops and maps before and after, the error now.

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
