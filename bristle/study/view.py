"""Figures and tables of a study: its data, runs and history."""

from __future__ import annotations

from ..core.finding import grouped, sentence
from ..core.text import plain, short_z
from ..errors import RecordError
from ..view.blocks import Figure, Table, Text, View, view_of
from ..view.style import Page
from .data_check import DataCheck
from .fit_view import identified_view as identified_view
from .history import HistoryStep, history_steps
from .pictures import draw_run, staircase_page
from .study import Study
from .study_file import TEST


@view_of(DataCheck)
def data_check_view(found: DataCheck) -> View:
    """Return the view of a data check: its findings, worst first, and the picture of all runs."""
    rows = [[one.level, sentence(one, runs), one.do] for one, runs in grouped(found.findings)]
    title = "The data can be used" if found.ok else "Mend the data first"
    alt = "All runs: channels over time, force over motion"
    return View(title, (Table(("", "finding", "what to do"), rows), Figure(found.page, alt)))


@view_of(Study)
def study_view(study: Study) -> View:
    """Return the view of a study: its runs, verdict and history, and how the error fell."""
    settings, steps = study.settings, study.steps()
    rows = [
        [
            str(step.number), step.what, or_dash(one.z), or_dash(one.z_train),
            "-" if one.rms is None else _error_of(one),
        ]
        for step, one in zip(steps, history_steps(steps), strict=True)
    ]  # fmt: skip
    roles = [run.role for run in settings.runs]
    held_out, test = roles.count("holdout"), roles.count(TEST)
    verdict = study.verdict()
    return View(
        settings.title,
        (
            Text(
                f"{study.folder}: {len(settings.runs)} runs, {held_out} of them held out"
                f"{f', {test} for the test at the end' if test else ''}."
            ),
            Text(settings.excluded_text),
            Text(f"Verdict: {verdict.get('words')}" if verdict else ""),
            Text(study.stale(verdict) if verdict else ""),
            Table(("step", "what", "z, held out", "z, training", "RMS error [N]"), rows, (2, 3, 4)),
            Figure(lambda: study_page(study), settings.title),
        ),
    )  # fmt: skip


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
    runs = study.read("train") or study.read("holdout")
    if not runs:
        raise RecordError(f"{study.folder}: there is no run to draw.")
    return draw_run(runs[0])


def _error_of(step: HistoryStep) -> str:
    """Return the error of a step, which says below which frequency one of an old version is."""
    low = f" below {step.cut_off:g} Hz" if step.cut_off else ""
    return f"{plain(step.rms or 0.0, 4)}{low}"


def or_dash(z: float | None) -> str:
    """Return z as text, "-" where there is none."""
    return "-" if z is None else short_z(z)
