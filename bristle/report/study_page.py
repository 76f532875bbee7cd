"""The report of a study: one HTML file that needs nothing else, with verdict, history and data."""

from __future__ import annotations

import hashlib
import json
import platform
import re
import shlex
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..comparison.names import effect_names
from ..comparison.view import (
    LOOPS,
    chosen_cycles,
    loop_panels,
    run_table,
    under,
)
from ..core.progress import tell
from ..core.text import command, percent, plain, short_z, with_interval
from ..data.channels import label_text
from ..errors import BristleError
from ..model.equations import equations
from ..physics.drive import DRIVES
from ..physics.forms import shown_law, split_form
from ..prediction.export import write_editable
from ..study.history import HistoryStep, history_steps
from ..study.pictures import draw_staircase
from ..study.read_again import devices_of
from ..study.runs import names_of_runs, place_of_run
from ..study.steps import NOT_PROVEN
from ..study.study_file import TEST
from ..study.view import budget_text, channel_table, judged, steps_table, story_view
from ..version import __version__
from ..view import html
from ..view.blocks import Text, View
from ..view.style import Page, look, png

if TYPE_CHECKING:
    from collections.abc import Collection

    from ..comparison.result import Comparison
    from ..data.channels import ChannelSpec
    from ..data.measurement import Measurement
    from ..export.web import Shown
    from ..identification.rig_fit import SiteModel
    from ..model.model import Fact, Model
    from ..study.history import Step
    from ..study.study import Study


class Movable(NamedTuple):
    """A study's scenario as a page runs it: its file, what the page shows, run and notes."""

    scenario: Path
    shown: Shown
    run: str
    notes: tuple[str, ...]


@contextmanager
def movable(study: Study) -> Iterator[Movable]:
    """Yield the scenario of a study's damper whose numbers a page can move, in a folder that goes.

    Raises
    ------
    StudyError, RecordError
        If the model or its run cannot be read.
    """
    from ..export.web import Shown

    with tempfile.TemporaryDirectory() as folder:
        found = write_editable(study, Path(folder))
        measured = {"damper.force": "measured.value"} if found.force else {}
        shown = Shown([f"damper.{name}" for name in found.numbers], measured)
        yield Movable(found.scenario, shown, found.run, found.notes)


def what_if_section(study: Study) -> str:
    """Return the section of a report whose sliders move the numbers of the model.

    Raises
    ------
    BuildError
        If zig is not installed.
    ScenarioError, StudyError, RecordError
        If the study has no model, or its scenario cannot be compiled.
    """
    from ..export.web import PageNumbers, body, described, module

    with movable(study) as found:
        numbers = PageNumbers(found.scenario)
        description = described(numbers, shown=found.shown)
    return html.section(
        f"What if: the model in {found.run}, with other numbers",
        body(module(numbers.system), description),
        html.items(found.notes),
    )


# The tables of the parameters and the data.


def parameter_table(model: Model, drive: str) -> tuple[list[str], list[list[str]], list[str]]:
    """Return header, rows and notes of a model's parameters with their 95 % intervals.

    Without a command (`drive` "") those that act through one alone are left out.
    """
    header = ["parameter", "value", "95 % interval", "unit", "origin", "what it is"]
    rows, edges = [], []
    flat = model.written_for(drive)
    for name, value in flat.items():
        text, half = with_interval(value.value, value.std)
        origin = value.origin if value.free else f"{value.origin}, held"
        half, unit = half if value.std else "", value.unit if value.unit != "1" else ""
        rows.append([name, text, half, unit, origin, model.declared(name).text])
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
        rows.append([names[one.place], "left out", *["-"] * (len(header) - 2)])
    return header, rows


def _roles(study: Study, measured: Sequence[Measurement]) -> dict[str, str]:
    """Return what each measurement is for, by its name, as the report calls it."""
    settings = study.settings
    listed = {run.place: run.role for run in settings.runs}
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
        [str(one["name"]), f"g = {one['formula']}", percent(float(one["left"]), 0)]
        for one in told["forms"]
    ]


@dataclass(frozen=True)
class Content:
    """What a report tells: everything that was read and computed for it.

    `now` is the present model on held-out runs, `before` the model before the last effect that was
    added, `test` the present one on the test runs; None where there is none. `trouble` says why the
    model could not be compared. `what_if` is the section with sliders, "" without; `damper` the
    damper with what predicts it, None where the model could not be compared.
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
    damper: SiteModel | None = None


_WIDTH = 9.2
"""Of the loops' figure [in]."""


def gather(study: Study, *, open_test: bool = True, what_if: bool = False) -> Content:
    """Return what the report of a study tells; it compares the models before and after.

    `open_test` False leaves test runs closed; else the study counts that they were opened.
    `what_if` adds sliders that compute the model in the page, which needs zig.
    """
    from ..study.steps import compare_study, comparer, last_added

    moved = what_if_section(study) if what_if else ""  # first: it may lack its compiler
    model, steps = study.model(to_show=True), tuple(study.steps())
    verdict, runs = study.verdict(), study.runs()
    now = before = test = damper = None
    trouble, added = "", ""
    found = history_steps(steps)
    try:
        study.model()  # raises where the code of an effect waits for consent
        against = comparer(study)
        now, damper = against.compare(model), against.damper(model)
        last = last_added(study)
        if last is not None and {*last.effects} <= {*model.effects}:
            tell("the model before its last effect")
            before, added = against.compare(last.before), effect_names(last.effects)
        if open_test and study.files(TEST):
            test = compare_study(study, role=TEST)
    except BristleError as error:
        trouble = str(error)
    return Content(
        study, model, verdict, steps, tuple(found), now, before, added, runs.notes, trouble,
        test, moved, damper=damper,
    )  # fmt: skip


# The model in a study's report: its equations with numbers, and what makes its force.


def model_section(content: Content) -> str:
    """Return the section: equations with intervals, and what makes the force; "" without both."""
    parts = _equations(content)
    if content.damper is not None:
        site = content.damper.site
        said = budget_text(site.holdout or site.train, content.damper.model)
        parts += [html.paragraphs(said)] if said else []
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


def render(content: Content) -> str:
    """Return a study's report as one HTML document.

    It is the same for the same study, whenever and wherever it is made, but for the number of times
    that its test runs have been opened.
    """
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
        _on_test_runs(content),
        model_section(content),
        _parameters(content),
        _data(content),
        html.section("The verdict in detail", html.blocks(verdict.details))
        if verdict.details
        else "",
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
    return html.tiles(pairs)


def _where(content: Content) -> str:
    title, now = "Error of the present model", content.now
    if now is None:
        return html.section(title, html.paragraphs(content.trouble))
    view = now.view()
    shown = [one for one in (*view.blocks, *view.details) if not isinstance(one, Text)]
    return html.section(
        title, html.paragraphs(*now.sentences, kind="lead"), html.blocks([shown[-1], *shown[:-1]])
    )


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


def _history(content: Content) -> str:
    table = steps_table(content.history_steps)
    why = {step.number: step.why for step in content.steps}
    shown = judged(content.history_steps)
    rows = [[*row, why[one.number]] for row, one in zip(table.rows, shown, strict=True)]
    table = table._replace(header=[*table.header, "why"], rows=rows)
    picture = ""
    if (page := draw_staircase(content.history_steps)) is not None:
        caption = (
            "The error of each model of the history on runs that no fit has seen, over the RMS of "
            "their force; green, where the last one comes near it, what noise alone leaves."
        )
        fall = " \u2192 ".join(percent(one.share) for one in content.history_steps if one.share)
        picture = html.figure(png(page), f"Error on held-out runs: {fall} of the force", caption)
    return html.section("How the error fell", picture, html.blocks((table,)))


def _before_after(content: Content) -> str:
    now, before, added = content.now, content.before, content.added
    cycles = chosen_cycles(now.predictions) if now is not None and now.unit == "N" else []
    if now is None or before is None or not cycles:
        return ""
    with look():
        page = Page(_WIDTH, 2.0 * (LOOPS + 0.1), "")
        for row, (one, name) in enumerate(((before, "without"), (now, "with"))):
            loops = under(cycles, one.predictions)
            loop_panels(page, (LOOPS + 0.1) * row, loops, f"{name} {added}")
    by = "the level of the command, else by speed" if content.study.drive else "speed"
    z = f"z {short_z(before.z)} before, {short_z(now.z)} now"
    caption = (
        f"Single cycles of held-out runs by {by}: measured (black), predicted (blue), and the band "
        "in which 95 % of a true model's samples would be."
    )
    return html.section(
        f"Before and after {added}",
        html.figure(png(page), f"Force loops, measured and predicted; {z}", caption),
    )


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
        html.blocks((channel_table(measured),)),
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


# The commands that make a study again: from its files, step by step, to its report.

AGAIN = "_again"
"""What the name of the study that is made anew ends with."""


def commands(study: Study) -> list[str]:
    """Return the lines of a shell that make a study again beside it, from the folder above.

    What the history did by hand is copied; everything else is computed anew.
    """
    old = study.name
    new = old + AGAIN
    lines = [_new(study, old, new)]
    read = {run.file for run in study.settings.runs}
    # What is left out may be what no command can read.
    for out in dict.fromkeys(run.file for run in study.settings.excluded):
        if out not in read:
            lines.append(_copy(f"{old}/{out}", f"{new}/{out}"))
    lines.append(_copy(f"{old}/study.toml", f"{new}/study.toml"))
    own_laws = sorted(study.laws_folder.glob("*.py"))
    if own_laws:  # `study new` makes a folder for effects alone
        lines.append(shlex.join(["mkdir", "-p", f"{new}/laws"]))
    for file in (*own_laws, *sorted(study.effects_folder.glob("*.py"))):
        place = f"{file.parent.name}/{file.name}"
        lines.append(_copy(f"{old}/{place}", f"{new}/{place}"))
    lines.append(command("study", "check", new))
    law = ""
    for step in study.steps():
        present = study.model_of(step.number, to_show=True).law
        lines += _step(step, old, new, law, present)
        law = present
    return [*lines, *(command(word, new) for word in ("compare", "diagnose", "report"))]


def _new(study: Study, old: str, new: str) -> str:
    """Return the command that makes the study; its channels are given, not guessed again."""
    settings = study.settings
    files = dict.fromkeys(f"{old}/{run.file}" for run in settings.runs)
    words = ["study", "new", new, "--data", *files]
    test = dict.fromkeys(f"{old}/{run.file}" for run in settings.runs if run.role == TEST)
    words += ["--test", *test] if test else []
    if settings.split:
        words += ["--split", settings.split]
    if settings.rig != "bench":
        words += ["--rig", settings.rig]
    if study.history.model_file(0).is_file():
        model = study.model_of(0, to_show=True)
        words += ["--law", split_form(model.law)[0]]
        if model.building:
            words += ["--building", f"{old}/{model.building}"]
            if len(devices_of(study.folder, settings)[1]) > 1:
                words += ["--device", settings.device]
    for name, spec in settings.channels.items():
        words += _channel(name, spec)
    return command(*words)


def _channel(name: str, spec: ChannelSpec) -> list[str]:
    if spec.step is not None:
        return ["--step", f"{spec.step:g}"]
    unit = f"@{spec.unit}" if spec.unit else ""
    return ["--channel", f"{name}={'-' if spec.sign < 0 else ''}{spec.column}{unit}"]


def _step(step: Step, old: str, new: str, law: str, present: str) -> list[str]:
    """Return what makes a step of the history again; nothing for the first model.

    `law` is that of the model before the step, `present` that of its own.
    """
    verb, _, rest = step.what.partition(" ")
    if verb == "begin":
        return []
    if verb == "add":
        return [command("add", new, *rest.removesuffix(f" ({NOT_PROVEN})").split(", "))]
    if step.what == "identify the building":
        return [command("identify", new, "--structure")]
    if verb == "identify":
        # Not by the step's words: they name a table without its knots.
        options = _other_law(law, present) if present != law else []
        return [command("identify", new, *options)]
    return [_copy(f"{old}/history/{step.number:03d}/model.toml", f"{new}/model.toml")]


def _other_law(law: str, other: str) -> list[str]:
    """Return the options that lead from a law to another one, or to another form of it."""
    (before, _, _), (after, form, _) = split_form(law), split_form(other)
    named = ["--law", after] if after != before or not form else []
    return named + (["--command", form] if form else [])


def _copy(source: str, target: str) -> str:
    return shlex.join(["cp", source, target])
