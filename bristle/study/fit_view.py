"""Figures of an identification: fits, and the parts of a model's force."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..comparison.panels import chosen_cycles, draw_error, draw_history, worst_window
from ..comparison.predictions import run_predictions
from ..comparison.view import LOOPS, loop_panels
from ..core.text import percent, plain, quantity, short_z
from ..identification.rig import DAMPER, ROLES
from ..model.equations import equations, symbols
from ..physics.drive import DRIVES
from ..physics.forms import shown_law, split_form
from ..physics.laws import base_and_variant
from ..view.blocks import Figure, Formula, Table, Text, View, view_of
from ..view.style import Page, look
from .identified import Identified

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
        f"Knots of the command: {', '.join(map(plain, knots))} {unit}. [1] is the value at the "
        "first one, each other the rise from the knot before." if knots else "",
        f"The data do not identify: {', '.join(found.unidentified)}." if found.unidentified else "",
        z_text(found),
    )  # fmt: skip
    laws: tuple[Table, ...] = ()
    if found.laws:
        from ..diagnosis.law_choice import rows_of  # takes long: most identify one law
        from ..diagnosis.view import law_block

        laws = (law_block(rows_of(found.laws)),)
    starts = f"{found.fit.agreed} of {found.fit.starts} starts agree."
    return View(
        title,
        (
            parameter_table(found), *(Formula(one.numbers, one.intervals) for one in told),
            Text(symbols(found.model, told) if told else "", "soft"), error_table(found),
            *left_out(found),
            *map(Text, said), *laws, *([_forms(found)] if found.forms else ()),
            *(Text(note, "note") for note in found.notes),
        ),
        (
            Text(starts), errors_beside(found),
            # Where all laws were asked for, they are told as they do with effects.
            *([law_errors(found)] if found.table and not found.laws else ()),
            Figure(lambda: draw_identified(found), f"{title}: force measured and predicted"),
        ),
    )  # fmt: skip


def title_of(found: Identified) -> str:
    """Return law and effects."""
    return " + ".join([shown_law(found.model.law), *found.model.effects])


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
        interval = row["how"] if half is None else f"± {plain(half, 2)}"
        rows.append([name, plain(value, 6), str(row["unit"]), interval, share])
    return Table(("parameter", "value", "unit", "95 % interval", ""), rows, (1, 4))


def _columns(found: Identified) -> list[tuple[str, RigErrors]]:
    """Return the errors that are told: those before where that was a fitted model, and after."""
    columns = [("before", found.errors_before)] if found.errors_before is not None else []
    return [*columns, ("after" if columns else "", found.errors)]


def _roles(found: Identified) -> list[str]:
    return [role for role in ROLES if role in found.errors.force]


def error_table(found: Identified) -> Table:
    """Return the error of the force on training and held-out runs."""
    columns = _columns(found)
    rows = [
        [_NAMES[role], *(errors.force[role].text() for _, errors in columns)]
        for role in _roles(found)
    ]
    header = ("error of the force: RMS, share", *(name for name, _ in columns))
    return Table(header, rows, range(1, len(header)))


def left_out(found: Identified) -> list[Text]:
    """Return what the error of each role leaves out, with count, share and reason."""
    force = found.errors.force
    return [
        Text(f"{_NAMES[role].capitalize()}: {' '.join(beside)}")
        for role in _roles(found)
        if (beside := force[role].beside())
    ]


def z_text(found: Identified) -> str:
    """Return how far the error is from what noise explains."""
    if not found.train.noise_known:
        return "How much of the error is noise is not known: it cannot be told from the force."
    z = max(found.after.get("z_holdout", 0.0), found.after["z_train"])
    if z > 1.15:
        return f"The error is {short_z(z)} times the noise floor (z); a true model has 1."
    return f"Noise explains the error: it is {short_z(z)} times the noise floor (z)."


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
    header = ("error of the force: RMS, share", *(name for name, _ in columns))
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
            notes.append(f"{base.name}: {variant.lacks} {way} the error by {abs(gain):.1%}.")
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
