"""Figures and tables of a study: its data, runs and history."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..comparison.names import effect_name, effect_names
from ..comparison.predictions import run_predictions
from ..comparison.view import (
    LOOPS,
    chosen_cycles,
    draw_error,
    draw_history,
    loop_panels,
    worst_window,
)
from ..core.finding import grouped, sentence
from ..core.text import (
    capital,
    command,
    joined,
    listed,
    percent,
    plain,
    plural,
    quantity,
    scale,
    short_z,
    with_interval,
)
from ..data.guess import Guess
from ..data.measurement import Measurement
from ..diagnosis.conclusion import is_correctable
from ..diagnosis.effect_limits import NO_AMOUNT
from ..diagnosis.law_choice import rows_of
from ..diagnosis.view import effect_text, law_block, verdict_view
from ..diagnosis.view import error_text as verdict_error
from ..errors import RecordError
from ..identification.fit import MISFIT
from ..identification.low_passed import force_budget
from ..identification.rig import DAMPER, ROLES
from ..learning.closure import NEAR, LearnedClosure
from ..learning.result import LearnedEffect
from ..model.equations import equations, symbols
from ..model.model import Model
from ..physics.drive import DRIVES
from ..physics.effect import closures
from ..physics.forms import joined_form, shown_law, split_form
from ..physics.laws import LAWS
from ..view.blocks import Block, Figure, Formula, Next, Table, Text, View, view_of
from ..view.style import Page, look
from .auto import Completed, halves
from .data_check import DataCheck
from .forms import law_command
from .history import HistoryStep, Step, history_steps
from .identify import Identified, is_identified
from .pictures import draw_data_check
from .steps import NOT_PROVEN, Added, Created, IdentifiedBuilding, unproven_of
from .study import Study
from .study_file import TEST

if TYPE_CHECKING:
    from ..identification.problem import Problem
    from ..identification.rig_fit import RigErrors

_RUNS = 6
"""Runs that cycles are sought in."""
_HISTORY = 3.1
"""Height of a force over time with its residual [in]."""
_SAMPLES = 1200
"""Samples of a history: more are not told apart."""
_HELD = ("exponent", "mass", "which")
"""Ends of names that are not shown where they are held."""
_NAMES = dict(zip(ROLES, ("training runs", "held-out runs"), strict=True))


@view_of(Identified)
def identified_view(found: Identified, folder: Path | None = None) -> View:
    """Return the view of an identification; of a study in a folder with the commands that follow.

    Parameters
    ----------
    found : what was identified
    folder : of the study, as it is typed
    """
    title = title_of(found)
    told, knots = equations(found.model), split_form(found.model.law)[2]
    unit = DRIVES[found.model.drive].unit
    points = (
        f"Knots of the command: {', '.join(map(plain, knots))} {unit}. [1] is the value at the "
        "first one, each other the rise from the knot before." if knots else ""
    )  # fmt: skip
    better, then, budget = list[Block](), list[Next](), list[Text]()
    if folder is not None:
        better, then = _better(found, folder), _next(found, folder)
        budget = [Text(budget_text(found.holdout or found.train, found.at.model))]
    hidden = f"These runs do not identify {joined(found.unidentified)}."
    laws = (law_block(rows_of(found.laws)),) if found.laws else ()
    starts = f"{found.fit.agreed} of {found.fit.starts} starts of the fit agree."
    return View(
        f"Identified: {title}.",
        (
            Text(error_text(found)), Text(z_text(found)), *better, Text(points),
            *(Formula(one.numbers, one.intervals) for one in told),
            Text(symbols(found.model, told) if told else "", "soft"), parameter_table(found),
            *laws, *([_forms(found)] if found.forms else ()),
            *([Text(hidden, "note")] if found.unidentified else ()), *left_out(found),
            *(Text(note, "note") for note in found.notes), *then,
        ),
        (
            *budget, Text(starts), errors_beside(found),
            Figure(lambda: draw_identified(found), f"{title}: force measured and predicted"),
        ),
    )  # fmt: skip


def title_of(found: Identified) -> str:
    """Return law and effects."""
    return " + ".join([shown_law(found.model.law), *map(effect_name, found.model.effects)])


def parameter_table(found: Identified, effects: Iterable[str] | None = None) -> Table:
    """Return the parameters with their intervals: all of them, or those of some effects alone."""
    rows = []
    for row in found.parameters():
        name, value, half = str(row["name"]), row["value"], row["interval95"]
        if row["how"] == "held" and name.endswith(_HELD):
            continue
        if effects is not None and name.partition(".")[0] not in effects:
            continue
        share = f"{plain(100.0 * half / abs(value), 2)} %" if half is not None and value else ""
        shown, interval = plain(value, 6), str(row["how"])
        if half is not None:
            shown, interval = with_interval(value, half / 1.96)
        rows.append([name, shown, str(row["unit"]), interval, share])
    return Table(("parameter", "value", "unit", "95 % interval", "of value"), rows, (1, 4))


def _columns(found: Identified) -> list[tuple[str, RigErrors]]:
    """Return the errors that are told: those before where that was a fitted model, and after."""
    columns = [("before", found.errors_before)] if found.errors_before is not None else []
    return [*columns, ("after" if columns else "now", found.errors)]


def _roles(found: Identified) -> list[str]:
    return [role for role in ROLES if role in found.errors.force]


def left_out(found: Identified) -> list[Text]:
    """Return what the error of each role leaves out, with count, share and reason."""
    force = found.errors.force
    return [
        Text(_of_role(role, " ".join(beside)), "note")
        for role in _roles(found)
        if (beside := force[role].beside())
    ]


def _of_role(role: str, beside: str) -> str:
    """Return what an error leaves out with whose it is; a warning stays one."""
    warns = "Warning: " if beside.startswith("Warning: ") else ""
    return f"{warns}{_NAMES[role].capitalize()}: {beside.removeprefix('Warning: ')}"


def error_text(found: Identified) -> str:
    """Return the sentence of the error of the force, before and after where both are known."""
    parts = []
    for role in reversed(_roles(found)):
        texts = [errors.force[role].text() for _, errors in _columns(found)]
        told = " -> ".join(dict.fromkeys(texts))
        parts.append(f"{told} on the {_NAMES[role]}")
    return f"Force error: {', '.join(parts)}."


def z_text(found: Identified) -> str:
    """Return how far the error is from what noise explains."""
    if not found.train.noise_known:
        return "How much of it is noise is not known: the force does not tell."
    z = {role: found.after[f"z_{role}"] for role in reversed(ROLES) if f"z_{role}" in found.after}
    told = joined([f"{short_z(one)} on the {_NAMES[role]}" for role, one in z.items()])
    begin = "The noise explains it. " if all(one <= MISFIT for one in z.values()) else ""
    return f"{begin}Error / noise (z; a true model has 1): {told}."


def errors_beside(found: Identified) -> Table:
    """Return the errors of the force, at each site, the low-passed ones, and z."""
    columns, roles = _columns(found), _roles(found)
    rows = [[_NAMES[role], *(errors.force[role].text() for _, errors in columns)] for role in roles]
    for role in roles:
        sites = found.errors.at[role]
        rows += [
            [f"{_NAMES[role]}, {site}", *(_at(errors, role, site) for _, errors in columns)]
            for site in (sites if len(sites) > 1 else ())
        ]
    for role in roles if found.cutoff else ():
        size = found.errors.force[role].signal
        low = (_low_passed(errors, role, size) for _, errors in columns)
        rows.append([f"below {found.cutoff:g} Hz, {_NAMES[role]}", *low])
    for role in roles:
        z = (short_z(errors.numbers[f"z_{role}"]) for _, errors in columns)
        rows.append([f"z, {_NAMES[role]}", *z])
    header = ("force error", *(name for name, _ in columns))
    note = "z: error / noise; a true model has 1."
    return Table(header, rows, range(1, len(header)), "Errors in detail", note=note)


def _at(errors: RigErrors, role: str, site: str) -> str:
    one = errors.at[role].get(site)
    return one.text() if one is not None else "-"


def _low_passed(errors: RigErrors, role: str, size: float) -> str:
    """Return the low-passed error; of several sites its share alone, for its RMS is their sum."""
    rms, share = errors.numbers[f"rms_{role}"], percent(errors.numbers[f"share_{role}"])
    return share if len(errors.at[role]) > 1 else f"{quantity(rms, 'N', 4, size)} ({share})"


def _forms(found: Identified) -> Table:
    """Return the table of the forms of the command."""
    rows, size = [], max(row.errors["error_train"] for row in found.forms)
    for row in found.forms:
        own = row.errors
        held_out = quantity(own["error_holdout"], "N", 4, size) if "error_holdout" in own else "-"
        z = short_z(own.get("z_holdout", own["z_train"]))
        train = quantity(own["error_train"], "N", 4, size)
        rows.append([row.form, train, held_out, percent(row.judged), z, str(row.numbers)])
    header = ("command", "training", "held out", "of force", "z", "fitted")
    note = "Each form identified with all effects of the model, on the same runs."
    return Table(header, rows, range(1, 6), note=note)


def budget_text(problem: Problem, model: Model) -> str:
    """Return the parts of a damper's force with their shares, the largest first; "" for others."""
    if LAWS[model.law].site != "damper":
        return ""
    runs = [force_budget(problem, model, run) for run in problem.runs[:_RUNS]]
    powers: dict[str, float] = {}
    for part in (part for parts in runs for part in parts):
        powers[part.name] = powers.get(part.name, 0.0) + float(np.sum(part.force**2))
    whole = sum(float(np.sum(np.sum([one.force for one in parts], axis=0) ** 2)) for parts in runs)
    order = sorted(powers, key=lambda name: -powers[name]) if whole > 0.0 else []
    told = (f"{effect_name(name)} {percent(np.sqrt(powers[name] / whole), 0)}" for name in order)
    return f"The force consists of (RMS over that of the force): {', '.join(told)}." * bool(order)


def draw_identified(found: Identified) -> Page:
    """Return the figure of the judged runs, drawn and not yet written.

    Loops of one cycle per level of the command, the force over time where it is worst, and its
    residual beneath; runs that were held out where there are any.
    """
    problem, role = (found.holdout, "held out") if found.holdout else (found.train, "training")
    predictions = run_predictions(problem.of(problem.runs[:_RUNS]), found.at.model)
    cycles = chosen_cycles(predictions)
    worst = max(predictions, key=lambda one: float((one.normalised**2).mean()))
    window = worst_window(worst, _SAMPLES)
    with look():
        above = LOOPS * bool(cycles)
        page = Page(9.6, above + _HISTORY, *_headings(found, role))
        if cycles:
            loop_panels(page, 0.0, cycles)
        grid = page.grid(2, 1, top=above + 0.35, bottom=0.45, row_gap=0.4, height_ratios=[1.6, 1.0])
        upper = page.figure.add_subplot(grid[0, 0])
        draw_history(upper, worst, window)
        draw_error(page.figure.add_subplot(grid[1, 0], sharex=upper), worst, window)
        upper.tick_params(labelbottom=False)
    return page


def _headings(found: Identified, role: str) -> tuple[str, str]:
    law = title_of(found)
    site = found.at.site
    what = site.quantity[:1].upper() + site.quantity[1:]
    what += " of the damper" if site.shown == DAMPER else ""
    worst = " at the worst site" if site.shown else ""
    runs = "runs held out" if role == "held out" else "training runs"
    return (
        f"{law}: error {found.error.text()}, z = {short_z(found.z)}{worst}",
        f"{what} in {runs}, measured and predicted. z is error / noise; a true model has 1.",
    )


# The commands that follow from an identification.

BETTER = 0.9
"""What part of the error another form must leave to be worth a word."""


def _better(found: Identified, folder: Path) -> list[Block]:
    """Return that another form of the command leaves less, and how to take it."""
    if found.laws:
        return [
            Next(command("diagnose", folder, "--law", "all"), "tries every law with its effects")
        ]
    out: list[Block] = []
    if found.forms:
        own = next(row for row in found.forms if row.model.law == found.model.law)
        best = min(found.forms, key=lambda row: row.judged)
        if best.judged < BETTER * own.judged:
            gain = 1.0 - best.judged / own.judged
            out.append(Text(f"{best.form} errs {percent(gain, 0)} less than {own.form}."))
            out.append(Next(command("identify", folder, "--command", best.form), "takes it"))
    return out


def _next(found: Identified, folder: Path) -> list[Next]:
    z = max(found.after.get("z_holdout", 0.0), found.after["z_train"])
    compare = Next(command("compare", folder), "shows where the error is")
    then = Next(command("diagnose", folder), "finds what the model misses")
    return [then, compare] if z > MISFIT else [then]


def added_view(added: Added, folder: Path) -> View:
    """Return what adding effects did: their values, the error before and after, what follows.

    Parameters
    ----------
    added : what was added
    folder : of the study, as it is typed
    """
    found, then = added.identified, [Next(command("diagnose", folder), "finds what is left")]
    said = [Text(error_text(found)), Text(z_text(found))]
    if added.other_law:
        told = f"The verdict is about the law {added.other_law}; this model has {found.model.law}."
        said.append(Text(told))
        then.append(Next(law_command(folder, added.other_law), "takes that law"))
    before = found.before.get("z_holdout")
    if before is not None and found.after["z_holdout"] >= before:
        said.append(Text("The error on the held-out runs did not fall."))
        then.insert(0, Next(command("undo", folder), "takes it out again"))
    title = f"Added: {effect_names(added.effects)} (step {added.step.number})."
    own = parameter_table(found, added.effects)
    table = [own] if own.rows else []  # a closure's weights are no parameters
    return View(title, (*said, *table, *left_out(found), *then))


# The building alone.


@view_of(IdentifiedBuilding)
def building_view(found: IdentifiedBuilding) -> View:
    """Return the view of what the response said of a building."""
    fit = found.fit
    levels = fit.building.levels()
    both = zip(found.given.stiffnesses, fit.stiffnesses, fit.std_stiffnesses, strict=True)
    stiffnesses = [
        [level, plain(given, 6), plain(now, 6), _interval(now, std)]
        for level, (given, now, std) in zip(levels, both, strict=True)
    ]
    modes = [
        [
            str(r + 1), plain(f, 5), _interval(f, fit.std_frequencies[r]), plain(ratio, 4),
            _interval(ratio, fit.std_damping_ratios[r]),
        ]
        for r, (f, ratio) in enumerate(zip(fit.frequencies, fit.damping_ratios, strict=True))
    ]  # fmt: skip
    errors = [
        [_NAMES[role], *(_equilibrium(one, role) for one in (found.before, found.after))]
        for role in ROLES
    ]
    hidden = f"The runs do not identify {joined(fit.unidentified)}."
    written = list[Block]()
    if found.file is not None:
        fmu = command("build", "Structure", "--building", found.file)
        written = [
            Text(f"Written: {found.file}, now the building of the model."),
            Next(fmu, "makes an FMU of it"),
        ]
    return View(
        f"{fit.building.name}: stiffness and damping of {plural(len(levels), 'level')}, "
        "masses as given.",
        (
            Table(
                ("stiffness below", "given [N/m]", "found [N/m]", "95 %"), stiffnesses, (1, 2)
            ),
            Table(
                ("mode", "frequency [Hz]", "95 %", "damping ratio", "95 %"), modes, (1, 3)
            ),
            Table(
                ("equilibrium error", "before", "after"), errors, (1, 2),
                note="At the worst level: share of the shear, and z = error / noise; a true model "
                "has 1.",
            ),
            *([Text(hidden, "note")] if fit.unidentified else []),
            *(Text(f"{note.rstrip('.')}.", "note") for note in found.notes), *written,
        ),
    )  # fmt: skip


def _equilibrium(errors: Mapping[str, float], role: str) -> str:
    share, z = (errors[f"{what}_equilibrium_{role}"] for what in ("share", "z"))
    return f"{percent(share)} (z = {z:.3g})"


def _interval(value: float, std: float) -> str:
    """Return half of a 95 % interval, and what share of the value it is."""
    if not isfinite(std):
        return "as given"
    share = f" ({plain(196.0 * std / abs(value), 2)} %)" if value else ""
    return f"± {plain(1.96 * std, 2)}{share}"


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
    return View(title, (*told[False], channel_table(found.runs), *told[True], figure))


class ChannelRange(NamedTuple):
    """A channel over all runs, in the unit that it is shown in, `factor` times the SI one.

    `noise` and `rms` are those of the middle run, `kind` how its noise looks.
    """

    name: str
    unit: str
    factor: float
    low: float
    high: float
    noise: float
    rms: float
    kind: str


def channel_ranges(runs: Sequence[Measurement]) -> list[ChannelRange]:
    """Return what each channel of some runs holds."""
    found = []
    for name in dict.fromkeys(name for run in runs for name in run.channels):
        there = [run for run in runs if name in run.channels]
        low = min(float(run[name].min()) for run in there)
        high = max(float(run[name].max()) for run in there)
        noise = float(np.median([run.noise.get(name, 0.0) for run in there]))
        rms = float(np.median([np.std(run[name]) for run in there]))
        factor, unit = scale(there[0].units[name], max(abs(low), abs(high)))
        colours = [facts.colour for run in there if (facts := run.noise_facts.get(name))]
        kind = max(set(colours), key=colours.count) if colours else "given"
        low, high, noise, rms = (factor * one for one in (low, high, noise, rms))
        found.append(ChannelRange(name, unit, factor, low, high, noise, rms, kind))
    return found


def channel_table(runs: Sequence[Measurement]) -> Table:
    """Return the table of the channels: range over all runs, noise in the middle one."""
    rows = [
        [
            one.name, one.unit, plain(one.low, 4), plain(one.high, 4), plain(one.noise, 2),
            f"{plain(100.0 * one.noise / one.rms, 2)} %" if one.rms > 0.0 else "", one.kind,
        ]
        for one in channel_ranges(runs)
    ]  # fmt: skip
    rows += [_extra(name, runs) for name in dict.fromkeys(n for run in runs for n in run.extra)]
    header = ("channel", "unit", "lowest", "highest", "noise", "of RMS", "kind of noise")
    return Table(header, rows, range(2, 6))


def _extra(name: str, runs: Sequence[Measurement]) -> list[str]:
    there = [run.extra[name] for run in runs if name in run.extra]
    low = min(float(one.values.min()) for one in there)
    high = max(float(one.values.max()) for one in there)
    factor, unit = scale(there[0].unit, max(abs(low), abs(high)))
    few = len(runs) - len(there)
    lacking = f" (not in {plural(few, 'run')})" if few else ""
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
        f"{folder}: a study of {plural(len(settings.runs), 'run')}, "
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
    """Return the view of a study: its runs, verdict and history, and its first run."""
    settings = study.settings
    roles = [run.role for run in settings.runs]
    held_out, test = roles.count("holdout"), roles.count(TEST)
    verdict = study.verdict()
    return View(
        settings.title,
        (
            Text(
                f"{study.folder}: {plural(len(roles), 'run')}, "
                f"{_held_out(len(roles), held_out)} held out"
                f"{f', {test} for the test at the end' if test else ''}."
            ),
            Text(settings.excluded_text),
            Text(f"Verdict: {verdict.get('words')}" if verdict else ""),
            Text(study.stale(verdict) if verdict else ""),
            steps_table(history_steps(study.steps())),
            Figure(lambda: first_run_page(study), settings.title),
        ),
    )  # fmt: skip


def first_run_page(study: Study) -> Page:
    """Return the figure of a study's first run.

    Raises
    ------
    RecordError, StudyError
        If the runs cannot be read.
    """
    runs = study.read("train") or study.read("holdout")
    if not runs:
        raise RecordError(f"{study.folder}: there is no run to draw.")
    return draw_data_check(runs[:1])


def diagnosed_view(verdict: Mapping[str, Any], folder: Path) -> View:
    """Return the view of a verdict on a study's model, with the commands that follow.

    Parameters
    ----------
    verdict : as verdict.json has it
    folder : of the study, as it is typed
    """
    return verdict_view(verdict).then(*next_steps(verdict, folder))


def story_view(study: Study, verdict: Mapping[str, Any]) -> View:
    """Return what a study has found: what its model has by now, how the error fell, what remains.

    Parameters
    ----------
    study : the folder, opened
    verdict : on its present model, as verdict.json has it
    """
    model = study.model(to_show=True)
    gains = verdict.get("gains") or []
    new = [row for row in gains if not set(row["effects"]) & set(model.effects)]
    doubtful = [one for one in study.steps() if one.why.endswith(NOT_PROVEN)]
    # Beside another model than the verdict's its effects are not advised.
    other = verdict.get("law", model.law) not in (model.law, split_form(model.law)[0])
    advised = [] if other or (doubtful and not halves(doubtful[0])) else new
    known = verdict["effects"] if other else model.effects
    then = next_steps({**verdict, "gains": advised}, study.folder, known)
    view = verdict_view({**verdict, "gains": new}).then(*then)
    steps = history_steps(study.steps())
    measured = [one for one in steps if one.rms is not None]
    if not measured:
        return view
    began = study.model_of(steps[0].number, to_show=True)
    guessed = [name for one in doubtful for name in unproven_of(study, one)]
    known = (*began.effects, *closures(model.effects), *guessed)
    added = [name for name in model.effects if name not in known]
    if not added:
        return view
    own = [effect_text(name, _sizes(model, name), DRIVES[model.drive]) for name in added]
    told = [Text(text) for text in own]
    if verdict.get("kind") != "none":
        told.insert(0, Text(view.title.replace("Something is", "Something else is"), "say"))
    fall = Text(_fall(measured))
    # What a missing effect would gain stands in the verdict's sentence alone.
    said = Text(verdict_error(verdict)) if verdict.get("kind") != "effect" else None
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
    return found.view().then(*then)


def closure_with_next(found: LearnedClosure, folder: Path) -> View:
    """Return the view of a study's closure, with the command that follows."""
    then: tuple[Next, ...] = ()
    if found.file is not None:
        then = (Next(command("add", folder, found.name), "puts it beside the model"),)
    if found.nearest is not None and found.nearest.explains >= NEAR:
        name = found.nearest.effect
        then = (*then, Next(command("add", folder, name), "takes the effect in its place"))
    return found.view().then(*then)


PAYS = 0.9
"""What a closure may leave of the error at most, for it to be the last command that is named."""


def completed_view(study: Study, done: Completed, verdict: Mapping[str, Any]) -> View:
    """Return what `study auto` came to: the story, how the error fell, what was learned.

    Parameters
    ----------
    study : the folder, opened
    done : what was done
    verdict : the last one, as verdict.json has it
    """
    view = story_view(study, verdict)
    table = steps_table(history_steps(study.steps()))
    learned = [Text(" ".join(one.sentences())) for one in done.curves]
    learned += [Text(_unproven(study, done, one)) for one in done.unproven]
    learned += [Text(done.refuted)] if done.refuted else []
    learned += map(Text, done.closure.sentences() if done.closure else ())
    learned += [Text(f"No closure: {done.no_closure}")] if done.no_closure else []
    first, *rest = view.blocks  # the error
    then = []
    if done.promise <= PAYS:
        gain = f"a network: error {percent(1.0 - done.promise, 0)} lower, on training runs"
        then = [Next(command("learn", study.folder, "--closure"), gain)]
    shown = [table] if is_identified(study.model()) else []
    return view._replace(blocks=(first, *learned, *rest, *shown, *then))


def _unproven(study: Study, done: Completed, step: Step) -> str:
    """Return the sentences about a step that improves the prediction and is not proven."""
    first = step is done.unproven[0]
    on = "with" if first and done.anew else "without"
    if first and halves(step) and not done.anew:
        on = f"without; {command('diagnose', study.folder)} makes one on that with"
    fall = [errors.get("error_share_holdout") for errors in (step.before, step.after)]
    falls = " to ".join(percent(one) for one in fall if isinstance(one, float))
    what = step.what.removesuffix(f" ({NOT_PROVEN})")
    names = what if what.startswith("take ") else effect_names(unproven_of(study, step))
    back = command("undo", study.folder)
    return (
        f"Improves the prediction, is not proven: {names}. "
        "Chosen on training runs left out of the fit; the error on held-out runs goes from "
        f"{falls} of the force. The verdict is on the model {on} it. {back} takes it back; "
        "--proven keeps it out from the start."
    )


def _sizes(model: Model, effect: str) -> dict[str, tuple[float, float | None, str]]:
    """Return the values of an effect with standard deviation and unit."""
    return {name: (f.value, f.std, f.unit) for name, f in model.written_of(effect).items()}


def _fall(steps: Sequence[HistoryStep]) -> str:
    """Return the sentence that tells how the error on held-out runs fell, or what it is."""
    factor, unit = scale("N", max(one.rms or 0.0 for one in (steps[0], steps[-1])))
    proven = [one for one in steps if NOT_PROVEN not in one.what] or steps
    texts = [_error(one, factor, unit) for one in dict.fromkeys([proven[0], proven[-1]])]
    more = ""
    if steps[-1] is not proven[-1]:
        more = f", with what is not proven {_error(steps[-1], factor, unit)}"
    return f"Force error on the held-out runs: {' -> '.join(texts)}{more}."


def _error(step: HistoryStep, factor: float, unit: str) -> str:
    share = f" ({percent(step.share)})" if step.share is not None else ""
    return f"{plain(factor * (step.rms or 0.0), 4)} {unit}{share}"


def judged(steps: Sequence[HistoryStep]) -> Sequence[HistoryStep]:
    """Return the steps whose errors are known; all of them where none is."""
    return [one for one in steps if one.z is not None or one.share is not None] or steps


def steps_table(steps: Sequence[HistoryStep]) -> Table:
    """Return the table of a history: the error of each model on held-out runs."""
    factor, unit = scale("N", max((one.rms for one in steps if one.rms is not None), default=0.0))
    rows = [[f"{one.number} {one.what}", *_step(one, factor)] for one in judged(steps)]
    header = ["step", f"error [{unit}]", "of force", "z", "z train"]
    title = "Error of each model on the held-out runs"
    note = "z: error / noise; a true model has 1."
    if all(one.z is None for one in steps) and any(one.share is not None for one in steps):
        header, rows = header[:3], [row[:3] for row in rows]
        note = "How much of it is noise is not known."
    return Table(header, rows, range(1, len(header)), title, note=note)


def _step(step: HistoryStep, factor: float) -> list[str]:
    if step.z is None and step.share is None:
        return ["not fitted", "", "", ""]
    error = "" if step.rms is None else plain(factor * step.rms, 4)
    share = "" if step.share is None else percent(step.share)
    return [error, share, short_z(step.z), or_nothing(step.z_train)]


def or_nothing(z: float | None) -> str:
    """Return z as text, "" where there is none."""
    return "" if z is None else short_z(z)


# The commands that follow from a verdict.


def next_steps(verdict: Mapping[str, Any], folder: Path, known: Sequence[str] = ()) -> list[Next]:
    """Return the commands that follow from a verdict: what sets the data right comes first.

    Parameters
    ----------
    verdict : as verdict.json has it
    folder : of the study, as it is typed
    known : the effects that its model has by now
    """
    then = _with_law(verdict, folder, known)
    if not any(map(is_correctable, verdict.get("sensors") or [])):
        return then
    if verdict["kind"] == "insufficient":
        then = [Next(command("diagnose", folder))]
    correct = command("study", "check", folder, "--correct")
    return [Next(correct, "corrects the runs that are named"), *then]


def _with_law(verdict: Mapping[str, Any], folder: Path, known: Sequence[str]) -> list[Next]:
    """Return the commands for the model; first another law where the verdict asks for it."""
    then = _then(verdict, folder, known)
    if not verdict.get("laws") or verdict["kind"] == "insufficient":
        return then
    law = joined_form(verdict["law"], verdict["command"])
    if law == verdict["law_before"]:
        return then
    why = "fits the law that comes nearest" if verdict["kind"] == "unknown" else "takes that law"
    return [Next(law_command(folder, law), why), *then]


def _then(verdict: Mapping[str, Any], folder: Path, known: Sequence[str]) -> list[Next]:
    kind, report = verdict["kind"], Next(command("report", folder), "all of it on one page")
    if kind == "ambiguous":
        taken = set(verdict["effects"]) & set(known)
        first = Next(command("add", folder, verdict["effects"][0]), "takes the first")
        test = Next(command("plan", folder), "writes a test that distinguishes them")
        return [test] if taken else [test, first]
    other_law = any(found.get("other_law") for found in verdict.get("findings") or [])
    every = Next(command("diagnose", folder, "--law", "all"), "tries every law with its effects")
    if kind == "effect":
        add = Next(command("add", folder, *verdict["effects"]), "puts it into the model")
        return [every, add] if other_law else [add]
    if kind == "unknown":
        left = (verdict.get("not_tried") or {}).get("two_effects", ())
        cut = [*dict.fromkeys(split_form(law)[0] for law in left)][:2]
        pairs = [
            Next(command("study", "auto", folder, "--law", law), "tries two effects with this law")
            for law in cut
        ]
        return [
            *([every] if other_law else []),
            *pairs,
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
    why = f"error {percent(best['gain'], 0)} lower, {NOT_PROVEN}"
    return Next(command("add", folder, *best["effects"]), why)
