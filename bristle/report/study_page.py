"""The report of a study: one HTML file that needs nothing else, with verdict, history and data."""

from __future__ import annotations

import hashlib
import json
import platform
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..comparison.names import effect_names, site_name
from ..comparison.view import band_table, headline, pattern_table, run_table, site_table, sites_page
from ..core.progress import counted, tell
from ..core.text import command, short_z
from ..errors import BristleError
from ..model.equations import equations
from ..physics.drive import DRIVES
from ..physics.forms import shown_law
from ..planning.folder import FILE, PlanFolder, read_plan
from ..planning.outcome import OUTCOMES
from ..planning.performed import shows
from ..study.budget_picture import budgets, draw_budget, sentence
from ..study.history import HistoryStep, history_steps
from ..study.pictures import staircase_page
from ..study.study_file import TEST
from ..study.view import or_nothing, steps_table, story_view
from ..version import __version__
from ..view import html
from ..view.blocks import Text, View
from ..view.style import png
from .figures import (
    curves_section,
    data_table,
    data_words,
    error_page,
    loops_page,
    maps_page,
    parameter_table,
)
from .reproduce import commands

if TYPE_CHECKING:
    from ..comparison.comparison import RigComparer
    from ..comparison.result import Comparison
    from ..identification.rig_fit import SiteModel
    from ..model.model import Model
    from ..study.history import Step
    from ..study.study import Study


@dataclass(frozen=True)
class Content:
    """What a report tells: everything that was read and computed for it.

    `now` is the present model on held-out runs, `before` the model before the last effect that was
    added, `test` the present one on the test runs; None where there is none. `trouble` says why the
    model could not be compared. `what_if` is the section with sliders and `linked` that of
    pictures in which samples can be chosen, "" without; `damper` the damper with what predicts it,
    None where the model could not be compared.
    """

    study: Study
    model: Model
    verdict: dict[str, Any] | None
    steps: tuple[Step, ...]
    history_steps: tuple[HistoryStep, ...]
    now: Comparison | None
    before: Comparison | None
    added: str
    notes: tuple[str, ...]
    trouble: str
    test: Comparison | None = None
    what_if: str = ""
    linked: str = ""
    damper: SiteModel | None = None


def gather(study: Study, *, open_test: bool = True, what_if: bool = False) -> Content:
    """Return what the report of a study tells; it compares the models before and after.

    `open_test` False leaves test runs closed; else the study counts that they were opened.
    `what_if` adds sliders that compute the model in the page, which needs zig.
    """
    from ..study.steps import compare_study, comparer
    from .what_if import what_if_section

    moved = what_if_section(study) if what_if else ""  # first: it may lack its compiler
    model, steps = study.model(to_show=True), tuple(study.steps())
    runs = study.runs()
    now = before = test = damper = None
    trouble, added = "", ""
    found = history_steps(steps)
    try:
        study.model()  # raises where the code of an effect waits for consent
        against = comparer(study)
        now, damper = against.compare(model), against.damper(model)
        for step in reversed(steps):
            gone = set(study.model_of(step.number).effects)
            if step.number == 0 or not gone <= set(model.effects):
                break
            earlier = study.model_of(step.number - 1)
            new = [name for name in model.effects if name not in earlier.effects]
            if new:
                tell("the model before its last effect")
                before, added = against.compare(earlier), effect_names(new)
                break
        found = [_with_error(one, against, study) for one in counted(found, "step")]
        if open_test and study.files(TEST):
            test = compare_study(study, role=TEST)
    except BristleError as error:
        trouble = str(error)
    return Content(
        study, model, study.verdict(), steps, tuple(found), now, before, added, runs.notes, trouble,
        test, moved, damper=damper,
    )  # fmt: skip


def _with_error(step: HistoryStep, against: RigComparer, study: Study) -> HistoryStep:
    """Return a step with its z where the history does not tell it: an edit by hand."""
    import numpy as np

    from ..identification.search import z_scale

    if step.z is not None or step.number == 0:
        return step  # the model that a study begins with is nobody's guess of this damper
    runs = against.predictions(study.model_of(step.number))
    if not all(one.noise_known for one in runs):
        return step
    return replace(step, z=z_scale(np.concatenate([one.normalised for one in runs])))


# The model in a study's report: its equations with numbers, and what makes its force.


def model_section(content: Content) -> str:
    """Return the section: equations with intervals, the force budget; "" where there is neither."""
    parts = [*_equations(content), *_budget(content)]
    return html.section("The model", *parts) if parts else ""


def _equations(content: Content) -> list[str]:
    found = equations(content.model)
    if not found:
        return []
    drive = DRIVES[content.model.drive]
    parts: list[str] = []
    for of in dict.fromkeys(one.of for one in found):
        parts.append(f"<h3>{html.escape(of)}</h3>")
        parts += [html.formula(one.intervals) for one in found if one.of == of]
    acts = any(re.search(rf"\b{drive.symbol}(_felt)?\b", one.intervals) for one in found)
    command = f"{drive.symbol} is the {drive.name} [{drive.unit}], " if acts else ""
    note = (
        f"In SI units; {command}x and v are displacement "
        "and velocity of the rod. The numbers are those of the present model with half of their "
        "95 % intervals; a number without one was held, or these data do not identify it."
    )
    return [*parts, html.paragraphs(note, kind="soft")]


def _budget(content: Content) -> list[str]:
    at = content.damper
    if at is None:
        return []

    problem = at.site.holdout or at.site.train
    page, said = draw_budget(problem, at.model), sentence(budgets(problem, at.model))
    if page is None or not said:
        return []
    caption = (
        "The parts of the model's force in single cycles, stacked: what resists above and below "
        "zero, their sum the line. An effect's part is what the force loses without it."
    )
    return [
        "<h3>The force budget</h3>",
        html.paragraphs(said),
        html.figure(png(page), said, caption),
    ]


# The newest plan of a study in its report: the next tests, and what they will show.


def plan_section(study: Study) -> str:
    """Return the section of the newest plan in a study's folder, "" where there is none."""
    folders = sorted(study.folder.glob(f"plan*/{FILE}"), key=lambda file: file.stat().st_mtime)
    if not folders:
        return ""
    folder = folders[-1].parent
    try:
        plan = read_plan(folder)
        told = json.loads((folder / OUTCOMES).read_text(encoding="utf-8"))
        header, rows = told["header"], told["rows"]
    except (BristleError, OSError, ValueError, KeyError, TypeError) as error:
        return html.section("Next tests", html.paragraphs(f"{folder.name} cannot be read: {error}"))
    performed = _performed(study, plan, others=len(folders) > 1)
    lead = (
        f"The tests of {folder.name} are measured: their runs are in this study."
        if performed
        else f"{folder.name} holds tests for the rig's controller, one file each."
    )
    runs = [[run.name, run.purpose, run.about] for run in plan.runs]
    return html.section(
        "Planned tests" if performed else "Next tests",
        html.paragraphs(lead, kind="lead"),
        html.table(["run", "for", "what"], runs),
        html.table(header, rows, numbers=(2, 3)),
        *(() if performed else _pictures(folder, plan)),
    )


def _performed(study: Study, plan: PlanFolder, others: bool) -> bool:
    """Return whether the runs of a plan are in a study.

    Where there are `others`, names are not enough: plans that are made before any is measured call
    their runs alike.
    """
    there = {Path(run.file).stem for run in study.settings.runs}
    if not all(run.name in there for run in plan.runs):
        return False
    if not others:
        return True
    measured = [(Path(run.source).stem, run) for run in study.read()]
    return all(
        any(name == planned.name and shows(run, planned, plan.motion) for name, run in measured)
        for planned in plan.runs
    )


def _pictures(folder: Path, plan: PlanFolder) -> list[str]:
    found = []
    for run in plan.runs:
        file = folder / f"{run.name}.png"
        if file.is_file():
            found.append(html.figure(file.read_bytes(), run.about, f"{run.name}: {run.about}."))
    return found


def study_report(study: Study) -> str:
    """Return a study's report as one HTML document.

    It is the same for the same study, whenever and wherever it is made, but for the number of times
    that its test runs have been opened.

    Raises
    ------
    StudyError, RecordError
        If the study or its files cannot be read.
    """
    return render(gather(study))


def render(content: Content) -> str:
    """Return the HTML document."""
    study = content.study
    settings = study.settings
    rig = "structure" if settings.has_building else "test bench"
    what = " + ".join([shown_law(content.model.law), *content.model.effects])
    verdict = _verdict(content)
    body = [
        f"<h1>{html.escape(settings.title)}</h1>",
        html.paragraphs(f"A damper on a {rig}, compared with its model: {what}.", kind="soft"),
        f'<div class="notes">{html.escape(settings.notes)}</div>' if settings.notes.strip() else "",
        html.answer(verdict),
        _tiles(content),
        _history(content),
        _before_after(content),
        curves_section(study, content.model.effects),
        content.what_if,
        _where(content),
        content.linked,
        _on_test_runs(content),
        model_section(content),
        _parameters(content),
        _data(content),
        html.section("The verdict in detail", html.blocks(verdict.details))
        if verdict.details
        else "",
        plan_section(study),
        _reproduce(content),
    ]
    foot = (
        f"bristle {html.escape(__version__)}. Error / noise (z) is the error divided by the noise "
        "floor, the error of a true model: the noise of force and measured motion together. A few "
        "large errors do not decide it. z = 1 is the best that these data can confirm."
    )
    return html.page(settings.title, [part for part in body if part], foot)


def _verdict(content: Content) -> View:
    """Return the view of the verdict, without the notes on the data, which have their section."""
    if (verdict := content.verdict) is None:
        none = "No diagnosis has been made of the present model."
        order = command("diagnose", content.study.name)
        then = f"{order} finds what it misses, and how certain that is."
        return View("Not diagnosed", (Text(none, "say"), Text(then)))
    notes = [note for note in verdict.get("notes") or [] if note not in content.notes]
    return story_view(content.study, {**verdict, "notes": notes})


def _tiles(content: Content) -> str:
    now = content.now
    if now is None:
        return ""
    low, high = now.z_interval
    span = f"; 95 %: {low:.2f} to {high:.2f}" if now.noise_known else ""
    pairs = [
        (
            now.error.text(now.unit),
            f"error of the {now.quantity} on held-out runs: RMS of measured less predicted, and "
            "its share of the RMS of what was measured",
        ),
        (
            f"z = {short_z(now.z)}",
            f"error / noise (z) on held-out runs; a true model has 1{span}",
        ),
    ]
    first = next((one.z for one in content.history_steps if one.z is not None), None)
    if first is not None and first > 1.02 * now.z:
        pairs.append(
            (f"{short_z(first)} → {short_z(now.z)}", "z of the first fitted model, and of this one")
        )
    runs = content.study.settings.runs
    count = sum(run.role == "holdout" for run in runs)
    held_out = f"{count} of them held out" if count else "its last part held out"
    test = sum(run.role == TEST for run in runs)
    held_out += f", {test} test run{'s' * (test > 1)}" if test else ""
    out = len(content.study.settings.excluded)
    held_out += f"; {out} left out" if out else ""
    pairs.append((f"{len(runs)} run{'s' * (len(runs) > 1)}", held_out))
    return html.tiles(pairs)


def _where(content: Content) -> str:
    now = content.now
    if now is None:
        return html.section("Error of the present model", html.paragraphs(content.trouble))

    along = "the two coordinates that it depends on most"
    if now.second:
        along = "the coordinate that it depends on most, and the remaining error along the next"
    caption = (
        f"Above: the error along {along}; dots are samples, the line the mean with its 95 % "
        "interval, the blue band twice the expected noise. Below: its spectrum against that of "
        f"the noise; z by speed{f' and {content.model.drive}' if content.study.drive else ''}."
    )
    title, say = headline(now), now.sentences
    return html.section(
        "Error of the present model",
        html.paragraphs(*say, kind="lead"),
        *_sites(content),
        html.figure(png(error_page(now)), title, caption),
        html.blocks((run_table(now), pattern_table(now), band_table(now))),
    )  # fmt: skip


def _on_test_runs(content: Content) -> str:
    """Return the error on runs that no choice has seen; "" where there are none."""
    if not content.study.files(TEST):
        return ""
    title = "Error on the test runs"
    if content.test is None:
        return html.section(
            title, html.paragraphs(content.trouble or "They stay closed.", kind="soft")
        )
    said = (content.test.sentences[0], content.test.sentences[-1])
    return html.section(
        title,
        html.paragraphs(*said, kind="lead"),
        html.blocks((run_table(content.test),)),
    )


def _sites(content: Content) -> list[str]:
    """Return the picture and table of a building's sites; nothing on a bench."""
    now = content.now
    if now is None or not now.sites:
        return []

    rings = f" Rings: without {content.added}." if content.before else ""
    worst = now.sites[0]
    name = site_name(worst.site)
    title = f"The model is right within its noise at every site; {name} is worst"
    if worst.fails:
        title = f"Of the building's sites {name} is worst: z = {short_z(worst.z)}"
    caption = (
        "z at every site, from the top storey down, each compared with equilibrium on runs that no "
        "fit has seen: small dots are runs, the large one all of them with its 95 % interval."
        + rings
    )
    return [
        html.figure(png(sites_page(now, content.before, 9.2)), title, caption),
        html.blocks((site_table(now),)),
    ]


def _history(content: Content) -> str:
    with_z = [one for one in content.history_steps if one.z is not None]
    table = steps_table(content.history_steps, content.study.settings.cut_off)
    rows = [[*row, step.why] for row, step in zip(table.rows, content.steps, strict=True)]
    table = table._replace(header=[*table.header, "why"], rows=rows)
    picture = ""
    if with_z:
        fall = " → ".join(or_nothing(one.z) for one in with_z)
        picture = html.figure(
            png(staircase_page(with_z)),
            f"The staircase of the history: z on held-out runs {fall}",
            "The error of each model of the history over the noise, on runs that no fit has seen "
            "(blue) and on those that it was fitted to (grey); in words the error on the first. "
            "These data cannot distinguish a model at the green line from a true one.",
        )  # fmt: skip
    return html.section("How the error fell", picture, html.blocks((table,)))


def _before_after(content: Content) -> str:
    if content.now is None or content.now.unit != "N":
        return ""

    names = (f"without {content.added}", f"with {content.added}")
    if content.before is None:
        names = ("", "the model now")
    z = f"z {short_z(content.before.z)} before, " if content.before else ""
    title = f"Before and after {content.added}" if content.before else "The loops"
    by = "the level of the command, else by speed" if content.study.drive else "speed"
    loops = html.figure(
        png(loops_page(content.before, content.now, names)),
        f"Force loops, measured and predicted; {z}{short_z(content.now.z)} now",
        f"Single cycles of held-out runs by {by}: measured (black), predicted (blue), and the band "
        "in which 95 % of a true model's samples would be.",
    )
    page = maps_page(content.before, content.now, names)
    maps = ""
    if page is not None:
        maps = html.figure(
            png(page),
            "The error over displacement and velocity",
            "Where the error is, over displacement and velocity, in units of the expected noise: "
            "red where the measured force is above the model's, blue where it is below. A true "
            "model leaves a pale map without a pattern.",
        )
    return html.section(title, loops, maps)


def _parameters(content: Content) -> str:
    header, rows, notes = parameter_table(content.model, content.study.drive)
    return html.section(
        "Parameters", html.table(header, rows, numbers=(1, 2)),
        html.paragraphs(*notes, kind="soft"),
    )  # fmt: skip


def _data(content: Content) -> str:
    measured = [*content.study.runs().all]
    if content.test is not None:
        measured += content.study.read(TEST)
    header, rows = data_table(content.study, measured)
    return html.section(
        "The data",
        html.table(header, rows, numbers=range(2, 5)),
        "<h3>Noise, and how it was found</h3>",
        html.table(*data_words(measured), numbers=(1, 2)),
        html.items(content.notes),
    )


def _reproduce(content: Content) -> str:
    import numpy
    import scipy

    study = content.study
    rows = [
        [file, hashlib.sha256((study.folder / file).read_bytes()).hexdigest()[:16]]
        for file in dict.fromkeys(run.file for run in study.settings.runs)
    ]
    versions = (
        f"bristle {__version__}, Python {platform.python_version()}, numpy {numpy.__version__}, "
        f"scipy {scipy.__version__}"
    )
    model = hashlib.sha256((study.folder / "model.toml").read_bytes()).hexdigest()[:16]
    return html.section(
        "How to reproduce",
        html.paragraphs(
            "The study's folder contains the data, the model and every step of its history. In the "
            "folder above it, these commands repeat the study:"
        ),
        "<pre>" + html.escape("\n".join(commands(study))) + "</pre>",
        html.table(["file", "SHA-256, first 16 digits"], [*rows, ["model.toml", model]]),
        html.paragraphs(f"Made with {versions}.", kind="soft"),
    )
