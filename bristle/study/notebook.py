"""What a notebook shows of an identification and of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..data.checks.finding import grouped, sentence
from ..data.equation import equations, symbols
from ..draw import html
from ..draw.figure import DPI
from ..draw.style import Page, png, short_z
from ..errors import RecordError
from ..physics.forms import shown_law
from ..quantity import percent, plain
from .fit_picture import draw_identified
from .run_file import TEST
from .staircase import HistoryStep, history_steps
from .staircase_picture import staircase_page

if TYPE_CHECKING:
    from .data_check import DataCheck
    from .identified import Identified
    from .study import Study


def data_check_html(found: DataCheck) -> str:
    """Return a data check as HTML: its findings, worst first, and the picture of all runs."""
    rows = [[one.level, sentence(one, runs), one.do] for one, runs in grouped(found.findings)]
    title = "The data can be used" if found.ok else "Mend the data first"
    return html.fragment(
        title,
        html.table(["", "finding", "what to do"], rows),
        html.figure(png(found.page(), DPI), "All runs: channels over time, force over motion"),
    )


_HELD = ("exponent", "mass", "which")


def identified_html(found: Identified) -> str:
    """Return an identification as HTML: equations, parameters, errors, and its picture."""
    title = " + ".join([shown_law(found.model.law), *found.model.effects])
    rows = [
        [
            str(row["name"]), f"{row['value']:.5g}",
            row["how"] if row["interval95"] is None else f"± {row['interval95']:.2g}",
            "" if row["unit"] == "1" else str(row["unit"]),
        ]
        for row in found.parameters()
        if not (row["how"] == "held" and row["name"].endswith(_HELD))
    ]  # fmt: skip
    errors = [
        [
            words, found.errors.force[role].text(), short_z(found.after[f"z_{role}"]),
            " ".join(found.errors.force[role].beside()),
        ]
        for role, words in (("train", "training"), ("holdout", "held out"))
        if role in found.errors.force
    ]  # fmt: skip
    header = ["runs", "error of the force", "error / noise (z)", "samples"]
    told = equations(found.model)
    return html.fragment(
        title,
        *(html.formula(one.intervals) for one in told),
        *([html.paragraphs(symbols(found.model, told), kind="soft")] if told else []),
        html.table(["parameter", "value", "95 % interval", "unit"], rows, numbers=(1, 2)),
        html.table(header, errors, numbers=(1, 2)),
        _forms(found),
        html.items(found.notes),
        html.figure(png(draw_identified(found), DPI), f"{title}: force measured and predicted"),
    )


def _forms(found: Identified) -> str:
    """Return the table of the forms of the command, "" where they were not compared."""
    if not found.forms:
        return ""
    rows = [
        [
            row.form, percent(row.judged),
            short_z(row.errors.get("z_holdout", row.errors["z_train"])), str(row.numbers),
        ]
        for row in found.forms
    ]  # fmt: skip
    header = ["command", "error of the force", "error / noise (z)", "fitted numbers"]
    return html.table(header, rows, numbers=(1, 2, 3))


def study_page(study: Study) -> Page:
    """Return the figure of a study: how the error fell, or its first run before any fit.

    Raises
    ------
    RecordError, StudyError
        If nothing was identified, and the runs cannot be read.
    """
    steps = history_steps(study.steps())
    if any(step.z is not None for step in steps):
        return staircase_page(steps)
    from .run_picture import draw_run

    runs = study.read("train") or study.read("holdout")
    if not runs:
        raise RecordError(f"{study.folder}: there is no run to draw.")
    return draw_run(runs[0])


def _error_of(step: HistoryStep) -> str:
    """Return the error of a step, which says below which frequency one of an old version is."""
    low = f" below {step.cut_off:g} Hz" if step.cut_off else ""
    return f"{plain(step.rms or 0.0, 4)}{low}"


def study_html(study: Study) -> str:
    """Return a study as HTML: its history in a table, and its picture."""
    settings, steps = study.settings, study.steps()
    rows = [
        [
            str(step.number), step.what, _or_dash(one.z), _or_dash(one.z_train),
            "-" if one.rms is None else _error_of(one),
        ]
        for step, one in zip(steps, history_steps(steps), strict=True)
    ]  # fmt: skip
    roles = [run.role for run in settings.runs]
    held_out, test = roles.count("holdout"), roles.count(TEST)
    verdict = study.verdict()
    return html.fragment(
        settings.title,
        html.paragraphs(
            f"{study.folder}: {len(settings.runs)} runs, {held_out} of them held out"
            f"{f', {test} for the test at the end' if test else ''}.",
            settings.excluded_text,
            f"Verdict: {verdict.get('words')}" if verdict else "",
            study.stale(verdict) if verdict else "",
        ),
        html.table(
            ["step", "what", "z, held out", "z, training", "RMS error [N]"], rows, (2, 3, 4)
        ),
        html.figure(png(study_page(study), DPI), settings.title),
    )


def _or_dash(z: float | None) -> str:
    return "-" if z is None else short_z(z)
