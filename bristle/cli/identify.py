"""Fit the model of a study to its training runs, and test it on the held-out runs."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..findings import command
from ..physics.drive import DRIVES
from ..quantity import percent, plain, quantity, short_z
from ._consent import add_trust

if TYPE_CHECKING:
    from ..identify.rig_fit import RigErrors
    from ..study.identified import Identified

HELP = (
    "fit a study's model: parameters with intervals, what the data do not identify, errors of laws"
)

BETTER = 0.9
"""What part of the error another law must leave to be worth a word."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle identify`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--law",
        help="another law than the model's, see `bristle list laws`; all: keep the model's law, "
        "and compare all laws on a test bench",
    )
    parser.add_argument(
        "--command",
        dest="form",
        metavar="FORM",
        help="how the command enters: linear, quadratic or table; several with commas, or all, to "
        "compare their errors on held-out runs; else the form of the model",
    )
    parser.add_argument(
        "--cutoff",
        type=float,
        metavar="HZ",
        help="low-pass for the table of laws and for the low-passed errors beside the error; 0 for "
        "none; else study.toml's cut_off (18 Hz)",
    )
    parser.add_argument(
        "--starts",
        type=int,
        default=4,
        metavar="N",
        help="number of starting points of the fit; else 4",
    )
    parser.add_argument(
        "--no-table", action="store_true", help="leave out the table that compares the laws"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="show the result; do not change the study"
    )
    parser.add_argument(
        "--structure",
        action="store_true",
        help="for a building: identify only the building (stiffnesses, frequencies and damping "
        "ratios from its response) and write a building file",
    )
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Identify, write the step and the picture, print the tables."""
    if arguments.structure:
        from . import _building

        return _building.main(arguments)
    from ..interrupt import keeps
    from ..progress import Progress, tell
    from ..study.identification import STAGES, identify_study
    from ..study.study import Study
    from ._ahead import import_ahead

    study = Study(arguments.folder)
    if not arguments.dry_run:
        import_ahead("bristle.study.budget_picture", "bristle.study.fit_picture")
    with Progress("identifying", STAGES, True, even=False) as progress:
        found = identify_study(
            study,
            law=arguments.law,
            command=arguments.form,
            cutoff=arguments.cutoff,
            starts=arguments.starts,
            table=not arguments.no_table,
            write=not arguments.dry_run,
            show=progress.show,
        )
    tell("drawing")
    if not arguments.dry_run:
        keeps("The new step is kept in the study's history; its pictures were not all drawn.")
    picture = budget = None
    if not arguments.dry_run:
        from ..draw.style import png
        from ..study.budget_picture import draw_budget
        from ..study.fit_picture import identify_png

        picture = study.write_report("identify.png", identify_png(found))
        budget = draw_budget(found.holdout or found.train, found.at.model)
        if budget is not None:
            study.write_report("force_budget.png", png(budget, 110))
        study.write_report("identify.json", _as_json(found.as_dict()) + "\n")
    if arguments.json:
        place = str(picture.absolute()) if picture else None
        print(_as_json({**found.as_dict(), "picture": place}))
        return 0
    print(text(found, arguments.folder))
    if picture:
        print(f"Picture: {picture}")
        if budget is not None:
            print(f"What makes the force: {picture.with_name('force_budget.png')}")
    return 0


def _as_json(answer: dict[str, Any]) -> str:
    import json

    return json.dumps(answer, indent=2, ensure_ascii=False)


def text(found: Identified, folder: Path) -> str:
    """Return the tables as text."""
    from ..data.equation import equations, symbols
    from ..physics.forms import shown_law, split_form

    title = " + ".join([shown_law(found.model.law), *found.model.effects])
    lines = [f"{title}, {found.fit.agreed} of {found.fit.starts} starts agree", ""]
    lines += _parameters(found)
    if knots := split_form(found.model.law)[2]:
        unit = DRIVES[found.model.drive].unit
        lines.append(
            f"  Knots of the command: {', '.join(map(plain, knots))} {unit}. [1] is the value at "
            "the first one, each other the rise from the knot before."
        )
    if told := equations(found.model):
        lines += ["", *(f"  {one.numbers}" for one in told), f"  {symbols(found.model, told)}"]
    if found.unidentified:
        lines += ["", f"The data do not identify: {', '.join(found.unidentified)}."]
    lines += ["", *error_lines(found)]
    if found.laws:
        lines += ["", *_every_law(found, folder)]
    if found.forms:
        lines += ["", *_forms(found, folder)]
    if found.table and not found.laws:  # which are told as they do with effects
        lines += ["", *_laws(found, folder)]
    for note in found.notes:
        lines += ["", f"Note: {note}"]
    return "\n".join([*lines, "", *_next(found, folder)])


def _parameters(found: Identified) -> list[str]:
    rows = []
    for row in found.parameters():
        if row["how"] == "held" and row["name"].endswith(("exponent", "mass", "which")):
            continue
        half = row["interval95"]
        if half is not None:
            size = abs(row["value"])
            share = f"  {plain(100.0 * half / size, 2)} %" if size else ""
            interval = f"+- {plain(half, 2)}{share}"
        else:
            interval = row["how"]
        rows.append(f"  {row['name']:24} {plain(row['value'], 6):>12} {row['unit']:11} {interval}")
    return [f"  {'parameter':24} {'value':>12} {'unit':11} 95 % interval", *rows]


def error_lines(found: Identified) -> list[str]:
    """Return the table of errors, before where that was a fitted model, and what stands beside."""
    from ..identify.rig import ROLES

    columns = [("before", found.errors_before)] if found.errors_before is not None else []
    shown = [*columns, ("after" if columns else "", found.errors)]
    title = "error of the force: RMS, share"
    lines = [f"  {title:34} " + " ".join(f"{name:>22}" for name, _ in shown)]
    names = dict(zip(ROLES, ("training runs", "held-out runs"), strict=True))
    roles = [role for role in ROLES if role in found.errors.force]

    def add(name: str, cells: Iterable[str]) -> None:
        lines.append(f"  {name:34} " + " ".join(f"{cell:>22}" for cell in cells))

    for role in roles:
        add(names[role], (errors.force[role].text() for _, errors in shown))
        sites = found.errors.at[role]
        for site in sites if len(sites) > 1 else ():
            add(f"  {site}", (_at(errors, role, site) for _, errors in shown))
    for role in roles if found.cutoff else ():
        name = f"below {found.cutoff:g} Hz, {names[role]}"
        size = found.errors.force[role].signal
        add(name, (_low_passed(errors, role, size) for _, errors in shown))
    for role in roles:
        add(f"z, {names[role]}", (short_z(errors.numbers[f"z_{role}"]) for _, errors in shown))
    known = "; not known: the noise cannot be told from the force" * (not found.train.noise_known)
    lines.append(f"  z: error / noise; a true model has 1{known}.")
    for role in roles:
        lines += [f"  {names[role].capitalize()}: {t}" for t in found.errors.force[role].beside()]
    return lines


def _at(errors: RigErrors, role: str, site: str) -> str:
    one = errors.at[role].get(site)
    return one.text() if one is not None else "-"


def _low_passed(errors: RigErrors, role: str, size: float) -> str:
    """Return the low-passed error; of several sites its share alone, for its RMS is their sum."""
    rms, share = errors.numbers[f"rms_{role}"], percent(errors.numbers[f"share_{role}"])
    return share if len(errors.at[role]) > 1 else f"{quantity(rms, 'N', 4, size)} ({share})"


def _forms(found: Identified, folder: Path) -> list[str]:
    """Return the table of the forms of the command, and which one would do better."""
    lines = [f"  {'command':18} {'training':>11} {'held out':>11} {'of force':>9} {'z':>8} fitted"]
    size = max(row.errors["error_train"] for row in found.forms)
    for row in found.forms:
        own = row.errors
        held_out = quantity(own["error_holdout"], "N", 4, size) if "error_holdout" in own else "-"
        z = short_z(own.get("z_holdout", own["z_train"]))
        lines.append(
            f"  {row.form:18} {quantity(own['error_train'], 'N', 4, size):>11} {held_out:>11} "
            f"{percent(row.judged):>9} {z:>8} {row.numbers:>6}"
        )
    mine = next(row for row in found.forms if row.model.law == found.model.law)
    best = min(found.forms, key=lambda row: row.judged)
    if best.judged < BETTER * mine.judged:
        gain = 1.0 - best.judged / mine.judged
        lines.append(
            f"  {best.form} errs {gain:.0%} less than {mine.form}. To take it:  "
            f"{command('identify', folder, '--command', best.form)}"
        )
    return [*lines, "  Each form identified with all effects of the model, on the same runs."]


def _every_law(found: Identified, folder: Path) -> list[str]:
    """Return the table of all laws, and the command that seeks the law with its effects."""
    from ..diagnose.law_verdict import rows_of
    from .diagnose import law_lines

    free = command("diagnose", folder, "--law", "all")
    return [*law_lines(rows_of(found.laws)), f"  To seek the law with its effects:  {free}"]


def _laws(found: Identified, folder: Path) -> list[str]:
    """Return the table of laws, and which one would do better."""
    from ..physics.forms import shown_law
    from ..physics.laws import base_and_variant

    low = f"below {found.cutoff:g} Hz" if found.cutoff else "no filter"
    lines = [
        f"  {'law':18} {'training':>11} {'held out':>11} {'of force':>9} {low:>13} {'starts':>8}"
    ]
    size = max(row.error.signal_all for row in found.table)
    held_out = found.holdout is not None
    for row in found.table:
        both = (row.error_train.headline[0], row.error.headline[0])
        cells = [quantity(one, "N", 4, size) for one in both]
        below = quantity(row.holdout if held_out else row.train, "N", 4, size)
        lines.append(
            f"  {shown_law(row.law):18} {cells[0]:>11} {cells[1] if held_out else '-':>11} "
            f"{percent(row.error.headline[1]):>9} {below:>13} {row.agreed:>3} of {row.starts}"
        )
    own = {row.law: row.error.headline[0] for row in found.table}
    for name in own:
        base, variant = base_and_variant(name)
        if variant.lacks and own[name] and base.name in own:
            gain = 1.0 - own[base.name] / own[name]
            way = "lowers" if gain >= 0.0 else "raises"
            lines.append(f"  {base.name}: {variant.lacks} {way} the error by {abs(gain):.1%}.")
    mine, best = found.model.law, min(own, key=lambda law: own[law])
    if mine in own and own[best] < BETTER * own[mine]:
        lines.append(_better_law(mine, best, 1.0 - own[best] / own[mine], folder))
    fitted = f"the force {low}" if found.cutoff else "the force"
    return [*lines, f"  Each law fitted by least squares of {fitted}, without effects."]


def _better_law(mine: str, best: str, gain: float, folder: Path) -> str:
    """Return the line about a law that errs less; one that holds more may stand for an effect."""
    from ..physics.forms import shown_law
    from ..physics.laws import base_and_variant

    has, holds = (set(base_and_variant(law)[0].contains) for law in (mine, best))
    line = f"  The error of {best} is {gain:.0%} smaller than that of the model's law, "
    line += f"{shown_law(mine)}."
    if more := sorted(holds - has):
        return (
            f"{line} It contains a {' and a '.join(more)}, which may replace a missing effect. "
            f"Diagnose first:  {command('diagnose', folder)}"
        )
    return f"{line} To change it:  {command('identify', folder, '--law', best)}"


def _next(found: Identified, folder: Path) -> list[str]:
    z = max(found.after.get("z_holdout", 0.0), found.after["z_train"])
    if z != z:
        return [
            f"How much of the error is noise is not known. Next: what lowers it,  "
            f"{command('diagnose', folder)}"
        ]
    if z > 1.15:
        return [
            f"The error is {short_z(z)} times the noise floor. Next: where it occurs,  "
            f"{command('compare', folder)} ; what is missing,  {command('diagnose', folder)}"
        ]
    then = command("diagnose", folder)
    return [f"Noise explains the error. Next:  {then} , which lists what these data show."]
