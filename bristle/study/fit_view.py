"""Figures of an identification: fits, and the parts of a model's force."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from ..comparison.names import effect_name, effect_names, joined
from ..comparison.panels import chosen_cycles, draw_error, draw_history, worst_window
from ..comparison.predictions import run_predictions
from ..comparison.view import LOOPS, loop_panels
from ..core.text import command, percent, plain, quantity, short_z, with_interval
from ..identification.rig import DAMPER, ROLES
from ..model.equations import equations, symbols
from ..physics.drive import DRIVES
from ..physics.forms import shown_law, split_form
from ..physics.laws import base_and_variant
from ..view.blocks import Block, Figure, Formula, Next, Table, Text, View, view_of
from ..view.style import Page, look
from .forms import law_command
from .identified import Identified
from .steps import Added, IdentifiedBuilding

if TYPE_CHECKING:
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
def identified_view(found: Identified) -> View:
    """Return the view of an identification."""
    title = title_of(found)
    told, knots = equations(found.model), split_form(found.model.law)[2]
    unit = DRIVES[found.model.drive].unit
    said = (
        error_text(found), z_text(found),
        f"Knots of the command: {', '.join(map(plain, knots))} {unit}. [1] is the value at the "
        "first one, each other the rise from the knot before." if knots else "",
    )  # fmt: skip
    hidden = f"These runs do not identify {joined(found.unidentified)}."
    laws: tuple[Table, ...] = ()
    if found.laws:
        from ..diagnosis.law_choice import rows_of  # takes long: most identify one law
        from ..diagnosis.view import law_block

        laws = (law_block(rows_of(found.laws)),)
    starts = f"{found.fit.agreed} of {found.fit.starts} starts of the fit agree."
    return View(
        f"Identified: {title}.",
        (
            *map(Text, said), *(Formula(one.numbers, one.intervals) for one in told),
            Text(symbols(found.model, told) if told else "", "soft"), parameter_table(found),
            *laws, *([_forms(found)] if found.forms else ()),
            *([Text(hidden, "note")] if found.unidentified else ()), *left_out(found),
            *(Text(note, "note") for note in found.notes),
        ),
        (
            Text(starts), error_table(found), errors_beside(found),
            # Where all laws were asked for, they are told as they do with effects.
            *([law_errors(found)] if found.table and not found.laws else ()),
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


def error_table(found: Identified) -> Table:
    """Return the error of the force on training and held-out runs."""
    columns = _columns(found)
    rows = [
        [_NAMES[role], *(errors.force[role].text() for _, errors in columns)]
        for role in _roles(found)
    ]
    header = ("force error", *(name for name, _ in columns))
    return Table(header, rows, range(1, len(header)))


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
    begin = "" if max(z.values()) > 1.15 else "The noise explains it. "
    return f"{begin}Error / noise (z; a true model has 1): {told}."


def errors_beside(found: Identified) -> Table:
    """Return the errors at each site, the low-passed ones, and z."""
    columns, roles, rows = _columns(found), _roles(found), []
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


def law_errors(found: Identified) -> Table:
    """Return the table of laws, and what a law does without a part of it."""
    low = f"below {found.cutoff:g} Hz" if found.cutoff else "no filter"
    rows, size = [], max(row.error.signal_all for row in found.table)
    held_out = found.holdout is not None
    for row in found.table:
        both = (row.error_train.headline[0], row.error.headline[0])
        cells = [quantity(one, "N", 4, size) for one in both]
        below = quantity(row.holdout if held_out else row.train, "N", 4, size)
        share, starts = percent(row.error.headline[1]), f"{row.agreed} of {row.starts}"
        rows.append(
            [shown_law(row.law), cells[0], cells[1] if held_out else "-", share, below, starts]
        )
    fitted = f"the force {low}" if found.cutoff else "the force"
    notes = [f"Each law fitted by least squares of {fitted}, without effects."]
    own = {row.law: row.error.headline[0] for row in found.table}
    for name in own:
        base, variant = base_and_variant(name)
        if variant.lacks and own[name] and base.name in own:
            gain = 1.0 - own[base.name] / own[name]
            way = "lowers" if gain >= 0.0 else "raises"
            notes.append(f"{base.name}: {variant.lacks} {way} the error by {percent(abs(gain))}.")
    header = ("law", "training", "held out", "of force", low, "starts")
    return Table(header, rows, range(1, 6), "Laws", note=" ".join(notes))


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
"""What part of the error another law must leave to be worth a word."""


def identified_with_next(found: Identified, folder: Path) -> View:
    """Return the view of an identification with the commands that follow.

    Parameters
    ----------
    found : the identification
    folder : of the study, as it is typed
    """
    view, better = found.view(), _better(found, folder)
    answer = [error_text(found), z_text(found)]
    said = [one for one in view.blocks if isinstance(one, Text) and one.text in answer]
    rest = [one for one in view.blocks if one not in said]
    return view._replace(blocks=(*said, *better, *rest, *_next(found, folder)))


def _better(found: Identified, folder: Path) -> list[Block]:
    """Return that another form of the command, or another law, leaves less, and how to take it."""
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
    errors, mine = {row.law: row.error.headline[0] for row in found.table}, found.model.law
    law = min(errors, key=lambda one: errors[one], default=mine)
    if mine not in errors or errors[law] >= BETTER * errors[mine]:
        return out
    gain = 1.0 - errors[law] / errors[mine]
    told = f"The law {law} errs {percent(gain, 0)} less than {shown_law(mine)}"
    has, holds = (set(base_and_variant(one)[0].contains) for one in (mine, law))
    if more := sorted(holds - has):  # it may stand for an effect: the diagnosis comes first
        return [
            *out, Text(f"{told}, but it contains a {' and a '.join(more)}, which may stand for a "
                       "missing effect: diagnose first."),
        ]  # fmt: skip
    return [
        *out,
        Text(f"{told}."),
        Next(command("identify", folder, "--law", law), "changes the law"),
    ]


def _next(found: Identified, folder: Path) -> list[Next]:
    z = max(found.after.get("z_holdout", 0.0), found.after["z_train"])
    compare = Next(command("compare", folder), "shows where the error is")
    then = Next(command("diagnose", folder), "finds what the model misses")
    return [then, compare] if z > 1.15 else [then]


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
    return View(title, (*said, parameter_table(found, added.effects), *left_out(found), *then))


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
        f"{fit.building.name}: stiffness and damping of {len(levels)} "
        f"level{'s' * (len(levels) > 1)}, masses as given.",
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
