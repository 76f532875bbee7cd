"""Fit the model of a study to its training runs, and test it on the held-out runs."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.text import command, plain
from ..view.blocks import Block, Next, Text
from ._options import add_details, add_json, add_study, add_trust, json_text, print_json

if TYPE_CHECKING:
    from ..study.identified import Identified
    from ..study.steps import IdentifiedBuilding

HELP = (
    "fit a study's model: parameters with intervals, what the data do not identify, errors of laws"
)

BETTER = 0.9
"""What part of the error another law must leave to be worth a word."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle identify`."""
    add_study(parser)
    parser.add_argument(
        "--law",
        help="another law than the model's, see `bristle list laws`; all: keep the model's law, "
        "and compare all laws on a test bench",
    )
    text = (
        "how the command enters: linear, quadratic or table; several with commas, or all, to "
        "compare their errors on held-out runs; else the form of the model"
    )
    parser.add_argument("--command", dest="form", metavar="FORM", help=text)
    text = (
        "low-pass for the table of laws and for the low-passed errors beside the error; 0 for "
        "none; else study.toml's cut_off (18 Hz)"
    )
    parser.add_argument("--cutoff", type=float, metavar="HZ", help=text)
    text = "number of starting points of the fit; else 4"
    parser.add_argument("--starts", type=int, default=4, metavar="N", help=text)
    text = "leave out the table that compares the laws"
    parser.add_argument("--no-table", action="store_true", help=text)
    text = "show the result; do not change the study"
    parser.add_argument("--dry-run", action="store_true", help=text)
    text = (
        "for a building: identify only the building (stiffnesses, frequencies and damping ratios "
        "from its response) and write a building file"
    )
    parser.add_argument("--structure", action="store_true", help=text)
    add_trust(parser)
    add_details(parser)
    add_json(parser)


def main(arguments: argparse.Namespace) -> int:
    """Identify, write the step and the picture, print the tables."""
    if arguments.structure:
        return _main_building(arguments)
    from ..core.interrupt import keeps
    from ..core.progress import Progress, tell
    from ..study.identify import STAGES, identify_study
    from ..study.study import Study
    from ._options import import_ahead

    study = Study(arguments.folder)
    if not arguments.dry_run:
        import_ahead("bristle.study.budget_picture", "bristle.study.fit_view")
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
        from ..study.budget_picture import draw_budget
        from ..study.fit_view import draw_identified
        from ..view.style import png

        picture = study.write_report("identify.png", png(draw_identified(found), 110))
        budget = draw_budget(found.holdout or found.train, found.at.model)
        if budget is not None:
            study.write_report("force_budget.png", png(budget, 110))
        study.write_report("identify.json", json_text(found.as_dict()) + "\n")
    if arguments.json:
        place = str(picture.absolute()) if picture else None
        print_json({**found.as_dict(), "picture": place})
        return 0
    print(text(found, arguments.folder, details=arguments.details))
    if picture:
        print(f"Picture: {picture}")
        if budget is not None:
            print(f"What makes the force: {picture.with_name('force_budget.png')}")
    return 0


def text(found: Identified, folder: Path, *, details: bool = False) -> str:
    """Return an identification as text, with the commands that follow."""
    from ..view import terminal

    view = found.view()
    view = view._replace(blocks=(*view.blocks, *_better(found, folder), *_next(found, folder)))
    return terminal.text(view, details=details, elsewhere=command("report", folder))


def _better(found: Identified, folder: Path) -> list[Block]:
    """Return that another form of the command, or another law, leaves less, and how to take it."""
    from ..physics.forms import shown_law
    from ..physics.laws import base_and_variant

    if found.laws:
        return [Next(command("diagnose", folder, "--law", "all"), "seeks the law with its effects")]
    out: list[Block] = []
    if found.forms:
        own = next(row for row in found.forms if row.model.law == found.model.law)
        best = min(found.forms, key=lambda row: row.judged)
        if best.judged < BETTER * own.judged:
            gain = 1.0 - best.judged / own.judged
            out.append(Text(f"{best.form} errs {gain:.0%} less than {own.form}."))
            out.append(Next(command("identify", folder, "--command", best.form), "takes it"))
    errors, mine = {row.law: row.error.headline[0] for row in found.table}, found.model.law
    law = min(errors, key=lambda one: errors[one], default=mine)
    if mine not in errors or errors[law] >= BETTER * errors[mine]:
        return out
    gain = 1.0 - errors[law] / errors[mine]
    told = f"The error of {law} is {gain:.0%} smaller than that of the model's law, "
    told += f"{shown_law(mine)}."
    has, holds = (set(base_and_variant(one)[0].contains) for one in (mine, law))
    if more := sorted(holds - has):  # it may stand for an effect: the diagnosis comes first
        return [
            *out, Text(f"{told} It contains a {' and a '.join(more)}, which may replace a missing "
                       "effect: diagnose first."),
        ]  # fmt: skip
    return [*out, Text(told), Next(command("identify", folder, "--law", law), "changes the law")]


def _next(found: Identified, folder: Path) -> list[Next]:
    z = max(found.after.get("z_holdout", 0.0), found.after["z_train"])
    compare = Next(command("compare", folder), "shows where the error is")
    then = Next(command("diagnose", folder), "finds what is missing")
    return [then, compare] if z > 1.15 else [then]


# The building alone, with --structure.


def _main_building(arguments: argparse.Namespace) -> int:
    """Identify the building, write its file and the step, print the tables."""
    from ..errors import StudyError
    from ..study.steps import identify_building_alone
    from ..study.study import Study

    if arguments.law:
        raise StudyError("--law is a damper's: --structure identifies the building without one.")
    found = identify_building_alone(Study(arguments.folder), write=not arguments.dry_run)
    if arguments.json:
        print_json(found.as_dict())
        return 0
    print(_building_text(found))
    return 0


def _building_text(found: IdentifiedBuilding) -> str:
    """Return the tables as text."""
    fit = found.fit
    levels = fit.building.levels()
    lines = [f"{fit.building.name}: {len(levels)} level(s), masses as given", ""]
    lines.append(f"  {'stiffness below':16} {'given':>12} {'found':>12} N/m   95 % interval")
    for i, level in enumerate(levels):
        given, now = (plain(one[i], 6) for one in (found.given.stiffnesses, fit.stiffnesses))
        half = _interval(fit.stiffnesses[i], fit.std_stiffnesses[i])
        lines.append(f"  {level:16} {given:>12} {now:>12}       {half}")
    lines += ["", f"  {'mode':>4} {'frequency':>12} Hz  {'95 %':18} {'damping ratio':>14}  95 %"]
    for r, (f, ratio) in enumerate(zip(fit.frequencies, fit.damping_ratios, strict=True)):
        lines.append(
            f"  {r + 1:>4} {plain(f, 5):>12}     {_interval(f, fit.std_frequencies[r]):18} "
            f"{plain(ratio, 4):>14}  {_interval(ratio, fit.std_damping_ratios[r])}"
        )
    if fit.unidentified:
        lines += ["", f"The data do not identify: {', '.join(fit.unidentified)}."]
    lines += ["", f"  {'what equilibrium leaves, worst level':38} {'before':>18} {'after':>18}"]
    for role, name in (("train", "training runs"), ("holdout", "held-out runs")):
        cells = [
            f"z = {errors[f'z_equilibrium_{role}']:.3g} ({errors[f'share_equilibrium_{role}']:.1%})"
            for errors in (found.before, found.after)
        ]
        lines.append(f"  {name:38} {cells[0]:>18} {cells[1]:>18}")
    lines.append("  z: error / noise; a true model has 1. In brackets: share of the shear.")
    for note in found.notes:
        lines += ["", f"Note: {note.rstrip('.')}."]
    if found.file is not None:
        lines += [
            "",
            f"Building: {found.file} , now the model's. As an FMU:  "
            f"{command('build', 'Structure', '--from', found.file)}",
        ]
    return "\n".join(lines)


def _interval(value: float, std: float) -> str:
    """Return half of a 95 % interval, and what share of the value it is."""
    if not isfinite(std):
        return "as given"
    share = f"  {plain(196.0 * std / abs(value), 2)} %" if value else ""
    return f"+- {plain(1.96 * std, 2)}{share}"
