"""Figures and tables of a study: its data, runs and history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..comparison.names import effect_names
from ..core.finding import grouped, sentence
from ..core.text import capital, command, listed, percent, plain, scale, short_z
from ..data.guess import Guess
from ..data.measurement import Measurement
from ..diagnosis.conclusion import is_correctable
from ..diagnosis.effect_limits import NO_AMOUNT
from ..diagnosis.view import effect_text, error_text, verdict_view
from ..errors import RecordError
from ..learning.closure import LearnedClosure
from ..learning.closure_names import NEAR
from ..learning.result import LearnedEffect
from ..model.model import Model
from ..physics.drive import DRIVES
from ..physics.effect import closures
from ..physics.forms import joined_form
from ..view.blocks import Block, Figure, Next, Table, Text, View, view_of
from ..view.style import Page
from .auto import Completed
from .data_check import DataCheck
from .fit_view import identified_view as identified_view
from .forms import law_command
from .history import HistoryStep, Step, history_steps
from .pictures import draw_run, staircase_page
from .steps import Created, unproven_of
from .study import Study
from .study_file import TEST


@view_of(DataCheck)
def data_check_view(found: DataCheck) -> View:
    """Return the view of a data check: what to mend, what each channel holds, what to know."""
    told: dict[bool, list[Block]] = {True: [], False: []}
    for one, runs in grouped(found.findings):
        if one.kind == "noise" and one.level == "note":
            continue  # in the table
        level = "" if one.level == "note" else f"{one.level.capitalize()}: "
        text = f"{level}{sentence(one, runs)} {one.do}".rstrip()
        told[one.level == "note"].append(Text(text, "note"))
    title = "The data can be used." if found.ok else "Correct these errors before you fit a model."
    figure = Figure(found.page, "All runs: channels over time, force over motion")
    return View(title, (*told[False], _channels(found.runs), *told[True], figure))


def _channels(runs: Sequence[Measurement]) -> Table:
    """Return the table of the channels: range over all runs, noise in the middle one."""
    rows = [_channel(name, [run for run in runs if name in run.channels])
            for name in dict.fromkeys(name for run in runs for name in run.channels)]  # fmt: skip
    rows += [_extra(name, runs) for name in dict.fromkeys(n for run in runs for n in run.extra)]
    header = ("channel", "unit", "lowest", "highest", "noise", "of RMS", "kind of noise")
    return Table(header, rows, range(2, 6))


def _channel(name: str, there: Sequence[Measurement]) -> list[str]:
    low = min(float(run[name].min()) for run in there)
    high = max(float(run[name].max()) for run in there)
    noise = float(np.median([run.noise.get(name, 0.0) for run in there]))
    rms = float(np.median([np.std(run[name]) for run in there]))
    factor, unit = scale(there[0].units[name], max(abs(low), abs(high)))
    colours = [facts.colour for run in there if (facts := run.noise_facts.get(name))]
    return [
        name, unit, plain(factor * low, 4), plain(factor * high, 4), plain(factor * noise, 2),
        f"{plain(100.0 * noise / rms, 2)} %" if rms > 0.0 else "",
        max(set(colours), key=colours.count) if colours else "given",
    ]  # fmt: skip


def _extra(name: str, runs: Sequence[Measurement]) -> list[str]:
    there = [run.extra[name] for run in runs if name in run.extra]
    low = min(float(one.values.min()) for one in there)
    high = max(float(one.values.max()) for one in there)
    factor, unit = scale(there[0].unit, max(abs(low), abs(high)))
    few = len(runs) - len(there)
    lacking = f" (not in {few} run{'s' * (few > 1)})" if few else ""
    extra = f"extra channel{lacking}"
    return [name, unit, plain(factor * low, 4), plain(factor * high, 4), "", "", extra]


@view_of(Created)
def created_view(created: Created) -> View:
    """Return the view of a new study: which column each channel is, and why it was taken so."""
    folder, settings = created.study.folder, created.study.settings
    held = sum(run.role == "holdout" for run in settings.runs)
    files = [run.file for run in (*settings.runs, *settings.excluded)]
    rows = [[one.channel, _column(one), one.reason] for one in created.guesses]
    rows += [
        [name, f"{one.column} [{one.unit}]", "extra channel: an error may depend on it"]
        for name, one in created.extra.items()
    ]
    notes = [f"{one.channel} is doubtful: {one.doubt}." for one in created.guesses if one.doubt]
    notes += [f"Not used: {listed(created.unused)}."] if created.unused else []
    # A command that ends a note is copied to a shell: no full stop is part of it.
    notes += [
        f"{capital(note, files)}{'' if ':  bristle ' in note else '.'}" for note in created.notes
    ]
    wrong = command("study", "channels", folder, "--channel", "CHANNEL=COLUMN@UNIT")
    return View(
        f"{folder}: a study of {len(settings.runs)} run{'s' * (len(settings.runs) > 1)}, "
        f"{_held_out(len(settings.runs), held)} held out.",
        (
            Table(("channel", "column", "read so because"), rows),
            *(Text(note, "note") for note in notes),
            Next(command("study", "check", folder), "checks the data before any model"),
            Next(wrong, "if a column is wrong"),
        ),
    )  # fmt: skip


def _held_out(runs: int, held: int) -> str:
    """Return what is held out of a study's runs: of a single one its last part."""
    return f"{held} of them" if held or runs > 1 else "its last part"


def _column(one: Guess) -> str:
    """Return a column with its unit, and that its sign is turned if it is."""
    known = one.column.endswith((f"[{one.unit}]", f"({one.unit})"))
    column = one.column if known else f"{one.column} [{one.unit}]"
    return f"-{column}" if one.sign < 0 else column


@view_of(Study)
def study_view(study: Study) -> View:
    """Return the view of a study: its runs, verdict and history, and how the error fell."""
    settings = study.settings
    roles = [run.role for run in settings.runs]
    held_out, test = roles.count("holdout"), roles.count(TEST)
    verdict = study.verdict()
    return View(
        settings.title,
        (
            Text(
                f"{study.folder}: {len(roles)} run{'s' * (len(roles) > 1)}, "
                f"{_held_out(len(roles), held_out)} held out"
                f"{f', {test} for the test at the end' if test else ''}."
            ),
            Text(settings.excluded_text),
            Text(f"Verdict: {verdict.get('words')}" if verdict else ""),
            Text(study.stale(verdict) if verdict else ""),
            steps_table(history_steps(study.steps()), settings.cut_off),
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


def diagnosed_view(verdict: Mapping[str, Any], folder: Path) -> View:
    """Return the view of a verdict on a study's model, with the commands that follow.

    Parameters
    ----------
    verdict : as verdict.json has it
    folder : of the study, as it is typed
    """
    view = verdict_view(verdict)
    return view._replace(blocks=(*view.blocks, *next_steps(verdict, folder)))


def story_view(study: Study, verdict: Mapping[str, Any]) -> View:
    """Return what a study has found: what its model has by now, how the error fell, what remains.

    Parameters
    ----------
    study : the folder, opened
    verdict : on its present model, as verdict.json has it
    """
    model = study.model(to_show=True)
    gains = verdict.get("gains") or []
    new = [row for row in gains if not set(row["effects"]) <= set(model.effects)]
    view = diagnosed_view({**verdict, "gains": new}, study.folder)
    steps = history_steps(study.steps())
    judged = [one for one in steps if one.rms is not None]
    if not judged:
        return view
    began = study.model_of(steps[0].number, to_show=True)
    doubtful = [one for step in study.steps() for one in unproven_of(study, step)]
    known = (*began.effects, *closures(model.effects), *doubtful)
    added = [name for name in model.effects if name not in known]
    if not added:
        return view
    own = [effect_text(name, _sizes(model, name), DRIVES[model.drive]) for name in added]
    told = [Text(text, "say") for text in own]
    if verdict.get("kind") != "none":
        told.insert(0, Text(view.title, "say"))
    # The errors of earlier versions are low-passed: they and the others show no fall together.
    alike = [one for one in judged if one.cut_off == judged[-1].cut_off]
    fall = Text(_fall(alike[0], alike[-1], study.settings.cut_off))
    # What a missing effect would gain stands in the verdict's sentence alone.
    said = Text(error_text(verdict)) if verdict.get("kind") != "effect" else None
    rest = [one for one in view.blocks if one != said]
    title = f"Found and added: {effect_names(added)}."
    return view._replace(title=title, blocks=(fall, *told, *rest))


def learned_with_next(found: LearnedEffect, folder: Path) -> View:
    """Return the view of what was learned in a study, with the command that follows."""
    then: tuple[Next, ...] = ()
    if found.file is not None:
        then = (Next(command("add", folder, found.name), "puts it into the model"),)
    elif found.found.refused:
        closure = command("learn", folder, "--closure")
        then = (
            Next(command("compare", folder), "shows where the error is"),
            Next(closure, "carries it without a formula"),
        )
    view = found.view()
    return view._replace(blocks=(*view.blocks, *then))


def closure_with_next(found: LearnedClosure, folder: Path) -> View:
    """Return the view of a study's closure, with the command that follows."""
    then: tuple[Next, ...] = ()
    if found.file is not None:
        then = (Next(command("add", folder, found.name), "puts it beside the model"),)
    if found.nearest is not None and found.nearest.explains >= NEAR:
        name = found.nearest.effect
        then = (*then, Next(command("add", folder, name), "takes the effect in its place"))
    view = found.view()
    return view._replace(blocks=(*view.blocks, *then))


def completed_view(study: Study, done: Completed, verdict: Mapping[str, Any]) -> View:
    """Return what `study auto` came to: the story, how the error fell, what was learned.

    Parameters
    ----------
    study : the folder, opened
    done : what was done
    verdict : the last one, as verdict.json has it
    """
    view = story_view(study, verdict)
    table = steps_table(history_steps(study.steps()), study.settings.cut_off)
    learned = [Text(" ".join(one.sentences())) for one in done.curves]
    if done.unproven:
        learned.append(Text(_unproven(study, done.unproven)))
    learned += map(Text, done.closure.sentences() if done.closure else ())
    learned += [Text(f"No closure: {done.no_closure}")] if done.no_closure else []
    first, *rest = view.blocks  # the error
    return view._replace(blocks=(first, *learned, *rest, table))


def _unproven(study: Study, step: Step) -> str:
    """Return the sentences about a step that improves the prediction and is not proven."""
    fall = [errors.get("error_share_holdout") for errors in (step.before, step.after)]
    falls = " to ".join(percent(one) for one in fall if isinstance(one, float))
    names = effect_names(unproven_of(study, step)) or step.what
    back = command("undo", study.folder)
    return (
        f"Improves the prediction, is not proven: {names}. "
        "Chosen on training runs left out of the fit; the error on held-out runs goes from "
        f"{falls} of the force. The verdict is on the model without it. {back} takes it back; "
        "--proven keeps it out from the start."
    )


def _sizes(model: Model, effect: str) -> dict[str, tuple[float, float | None, str]]:
    """Return the values of an effect with standard deviation and unit."""
    return {name: (f.value, f.std, f.unit) for name, f in model.written_of(effect).items()}


def _fall(first: HistoryStep, last: HistoryStep, cut_off: float) -> str:
    """Return the sentence that tells how the error on held-out runs fell; of one step, what it is.

    Parameters
    ----------
    first, last : whose errors are of the same low-pass, which is told
    cut_off : Hz, of that low-pass where they do not tell it
    """
    factor, unit = scale("N", max(first.rms or 0.0, last.rms or 0.0))
    texts = [_error(one, factor, unit) for one in ((first, last) if first != last else (last,))]
    low = cut_off if last.cut_off is None else last.cut_off
    below = f" below {low:g} Hz" if low else ""
    return f"Force error{below} on the held-out runs: {' -> '.join(texts)}."


def _error(step: HistoryStep, factor: float, unit: str) -> str:
    share = f" ({percent(step.share)})" if step.share is not None else ""
    return f"{plain(factor * (step.rms or 0.0), 4)} {unit}{share}"


def steps_table(steps: Sequence[HistoryStep], cut_off: float = 0.0) -> Table:
    """Return the table of a history: the error of each model on held-out runs.

    Parameters
    ----------
    steps : of the history
    cut_off : Hz, of the low-pass on the forces of a step that does not tell its own; 0 for none
    """
    factor, unit = scale("N", max((one.rms for one in steps if one.rms is not None), default=0.0))
    rows = [[_named(one, cut_off), *_step(one, factor)] for one in steps]
    header = ["step", f"error [{unit}]", "of force", "z", "z train"]
    title = "Error of each model on the held-out runs"
    note = "z: error / noise; a true model has 1."
    if all(one.z is None for one in steps) and any(one.share is not None for one in steps):
        header, rows = header[:3], [row[:3] for row in rows]
        note = "How much of it is noise is not known."
    return Table(header, rows, range(1, len(header)), title, note=note)


def _named(step: HistoryStep, cut_off: float) -> str:
    """Return a step with its number, and below which frequency its error is if not all of it."""
    low = cut_off if step.cut_off is None else step.cut_off
    below = f" (below {low:g} Hz)" if low and step.rms is not None else ""
    return f"{step.number} {step.what}{below}"


def _step(step: HistoryStep, factor: float) -> list[str]:
    if step.z is None and step.share is None:
        return ["not judged", "", "", ""]
    error = "" if step.rms is None else plain(factor * step.rms, 4)
    share = "" if step.share is None else percent(step.share)
    return [error, share, short_z(step.z), or_nothing(step.z_train)]


def or_nothing(z: float | None) -> str:
    """Return z as text, "" where there is none."""
    return "" if z is None else short_z(z)


# The commands that follow from a verdict.


def next_steps(verdict: Mapping[str, Any], folder: Path) -> list[Next]:
    """Return the commands that follow from a verdict: what sets the data right comes first."""
    then = _with_law(verdict, folder)
    if not any(map(is_correctable, verdict.get("sensors") or [])):
        return then
    if verdict["kind"] == "insufficient":
        then = [Next(command("diagnose", folder))]
    correct = command("study", "check", folder, "--correct")
    return [Next(correct, "corrects the runs that are named"), *then]


def _with_law(verdict: Mapping[str, Any], folder: Path) -> list[Next]:
    """Return the commands for the model; first another law where the verdict asks for it."""
    then = _then(verdict, folder)
    if not verdict.get("laws") or verdict["kind"] == "insufficient":
        return then
    law = joined_form(verdict["law"], verdict["command"])
    return then if law == verdict["law_before"] else [Next(law_command(folder, law)), *then]


def _then(verdict: Mapping[str, Any], folder: Path) -> list[Next]:
    kind, report = verdict["kind"], Next(command("report", folder), "all of it on one page")
    if kind == "ambiguous":
        return [
            Next(command("plan", folder), "writes a test that distinguishes them"),
            Next(command("add", folder, verdict["effects"][0]), "takes the first"),
        ]
    other_law = any(found.get("other_law") for found in verdict.get("findings") or [])
    every = Next(command("diagnose", folder, "--law", "all"), "tries every law with its effects")
    if kind == "effect":
        add = Next(command("add", folder, *verdict["effects"]), "puts it into the model")
        return [every, add] if other_law else [add]
    if kind == "unknown":
        return [
            *([every] if other_law else []),
            Next(command("learn", folder), "learns what is missing"),
            _gaining(verdict, folder),
        ]
    if kind == "insufficient":
        right = f"after {folder / 'study.toml'} is set right where the text says so, or new runs"
        return [Next(command("diagnose", folder), right)]
    hidden = not_excited(verdict)
    if kind == "none" and hidden:
        plan = command("plan", folder, "--see", *hidden)
        return [report, Next(plan, "plans tests that show what these cannot")]
    return [report, Next(command("export", folder), "writes the model as an FMU")]


def not_excited(verdict: Mapping[str, Any]) -> list[str]:
    """Return the effects that these runs cannot show, and others may.

    What a parameter of another effect absorbs is that effect.
    """
    rows = [row for found in verdict.get("findings") or [] for row in found.get("limits", ())]
    hidden = [row for row in rows if row.get("why") and "." not in row["why"].partition(" ")[0]]
    return sorted({row["effect"] for row in hidden if row["why"] != NO_AMOUNT})


def _gaining(verdict: Mapping[str, Any], folder: Path) -> Next:
    """Return the command that adds what gains, where an effect does; else one to look."""
    gains = verdict.get("gains") or []
    if not gains:
        return Next(command("compare", folder), "shows where the error is")
    best = max(gains, key=lambda row: row["gain"])
    why = f"error {100.0 * best['gain']:.0f} % lower"
    return Next(command("add", folder, *best["effects"]), why)
