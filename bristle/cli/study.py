"""Make a study from measurement files, check its data before any model, and change its runs."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import command, plural
from ..errors import StudyError
from ..view.blocks import Next
from ._options import (
    Parser,
    add_common_to_actions,
    channels_of,
    files_of,
    print_answer,
    print_json,
    print_study_answer,
    test_files,
)

if TYPE_CHECKING:
    from ..planning.folder import Performed
    from ..study.data_check import DataCheck
    from ..study.extend import Extended
    from ..study.read_again import CorrectedChannels
    from ..study.runs import RunCorrections
    from ..study.steps import Created
    from ..study.study import Study


# `bristle study channels`: which column each channel of a study is, in which unit and sign.


def add_channels(parser: Parser) -> None:
    """Add the arguments of `bristle study channels`."""
    parser.add_study()
    parser.add_channels_of_data()
    parser.add_dry_run()
    parser.add_json()
    parser.set_defaults(act=_channels)


def _channels(arguments: argparse.Namespace) -> int:
    """Correct the channels that are named; without any print them all."""
    from ..study.read_again import correct_channels
    from ..study.study import Study

    study = Study(arguments.folder)
    channels = channels_of(arguments.channel, arguments.step)
    if not channels and not arguments.without:
        _print_channels(study, as_json=arguments.json)
        return 0
    dry = arguments.dry_run
    done = correct_channels(study, channels, without=arguments.without, write=not dry)
    if not arguments.json:
        _print(study, done, dry)
        return 0
    print_json({
        "folder": str(study.folder.absolute()),
        "changes": [asdict(one) for one in done.changes],
        "notes": list(done.notes),
        "of_before": [one.what for one in done.of_before],
        "step": done.step.number if done.step else None,
    })  # fmt: skip
    return 0


def _print_channels(study: Study, *, as_json: bool) -> None:
    from ..study.study_file import spec_text

    listed = study.settings.channels
    if as_json:
        print_json({name: asdict(spec) for name, spec in listed.items()})
        return
    for name, spec in listed.items():
        print(f"{name:28} {spec_text(spec)}")


def _print(study: Study, done: CorrectedChannels, dry: bool) -> None:
    """Print what changes, what is no longer of the data, and the next command."""
    if not done.changes:
        print(f"{study.folder}: the channels are so already. Nothing is written.")
        return
    runs = len(study.settings.runs)
    what = "would change" if dry else "are corrected"
    print(f"{study.folder}: channels {what}; {plural(runs, 'run')} read by them.")
    for one in done.changes:
        print(f"  {one.channel:16} {one.text}")
    for note in done.notes:
        print(f"{note[:1].upper()}{note[1:]}.")
    if done.of_before:
        gone = ", ".join(one.what for one in done.of_before)
        begins = f"begins anew (step {done.step.number})" if done.step else "would begin anew"
        print(f"The model {begins}; of the channels as they were: {gone}.")
    if not dry:
        print(f"Next:  {command('study', 'check', study.folder)}")


# `bristle study extend`: more runs in a study, held against the plan that asked for them.


def add_extend(parser: Parser) -> None:
    """Add the arguments of `bristle study extend`."""
    parser.add_study()
    text = "measurement files, or a folder of them, with the columns of the study's others"
    parser.add_argument("data", nargs="+", metavar="FILES", help=text)
    text = (
        "held-out runs among them, by file name; else those of the plan, or by the usual "
        "names, or a third of the runs"
    )
    parser.option("--holdout", "GLOB", text, nargs="+", action="extend", default=[])
    parser.add_run_facts()
    text = "the plan of these tests: take its roles, and report differences from it"
    parser.option("--plan", "PLAN", text, type=Path)
    parser.add_json()
    parser.set_defaults(act=_extend)


def _extend(arguments: argparse.Namespace) -> int:
    from ..planning.folder import performed, read_plan
    from ..study.extend import extend_study
    from ..study.run_facts import RunChoices
    from ..study.study import Study

    study, table = Study(arguments.folder), arguments.runs
    files = [file for file in files_of(arguments.data, "") if table is None or Path(file) != table]
    by_plan = None
    if arguments.plan is not None:
        by_plan = performed(study, files, read_plan(arguments.plan))
    choices = RunChoices(arguments.level, arguments.label, table)
    roles = by_plan.roles if by_plan else None
    extended = extend_study(study, files, roles=roles, holdout=arguments.holdout, choices=choices)
    print_added(extended, by_plan, as_json=arguments.json)
    return 0


def print_added(
    extended: Extended, by_plan: Performed | None = None, *, as_json: bool = False
) -> None:
    """Print the runs that were added, what differs from their plan, and the next command."""
    from ..core.text import capital
    from ..study.study import unknown_to_model

    folder, runs = extended.study.folder, extended.runs
    notes = [*extended.notes, *(by_plan.notes if by_plan else ())]
    if as_json:
        return print_json({
            "folder": str(folder.absolute()),
            "added": [asdict(run) for run in runs],
            "notes": notes,
            "plan": [asdict(pair) for pair in by_plan.pairs] if by_plan else None,
        })  # fmt: skip
    print(f"{folder}: {plural(len(runs), 'run')} added.")
    for run in runs:
        print(f"  {run.name:28} {run.role}")
    for note in notes:
        print(f"{capital(note, [run.file for run in runs])}.")
    for text in by_plan.differences if by_plan else ():
        print(f"Warning: {text}.")
    then = "identify" if unknown_to_model(extended.study) else "diagnose"
    print(f"Next:  {command(then, folder)}")


# `bristle study roles`: what the runs of a study are for.

ROLES = {
    "train": "fitted to",
    "holdout": "held out: they test the model, and no fit uses them",
    "test": "test runs, which neither a fit nor a verdict uses",
    "exclude": "left out",
}
"""The roles, with what is said of runs that get them."""


def add_roles(parser: Parser) -> None:
    """Add the arguments of `bristle study roles`."""
    parser.add_study()
    for role, text in ROLES.items():
        parser.add_argument(
            f"--{role}", nargs="+", action="extend", default=[], metavar="RUN",
            help=f"these runs are {text}" if role != "test" else f"these are {text}",
        )  # fmt: skip
    parser.add_json("print the runs as JSON")
    parser.set_defaults(act=_roles)


def _roles(arguments: argparse.Namespace) -> int:
    """Change the roles that are named; print those of all runs."""
    from ..study.study import Study, behind_data

    study = Study(arguments.folder)
    roles: dict[str, str] = {}
    for role in ROLES:
        for run in getattr(arguments, role):
            if roles.setdefault(run, role) != role:
                raise StudyError(f"{run} is given two roles, {roles[run]} and {role}.")
    if roles:
        study = study.with_roles(roles)
    runs = (*study.settings.runs, *study.settings.excluded)
    if arguments.json:
        print_json([{"run": run.name, "role": run.role} for run in runs])
        return 0
    for run in runs:
        print(f"{run.role:8} {run.name}")
    if changed := behind_data(study):
        print(changed)
    return 0


HELP = "make and change studies of measurements: new, extend, check, roles, channels, auto"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle study`."""
    commands = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    _add_new(commands.add_parser("new", help="make a study from measurement files"))
    add_extend(commands.add_parser("extend", help="add measured runs to a study"))
    _add_check(
        commands.add_parser(
            "check",
            help="check the data, before any model",
            description="Check the data before any model; exit code 2 if there is an error.",
        )
    )
    add_roles(commands.add_parser("roles", help="show or change the roles of the runs"))
    add_channels(commands.add_parser("channels", help="show or correct columns, units and signs"))
    auto = commands.add_parser(
        "auto", help="repeat identify, diagnose and add until no effect of the library is missing"
    )
    auto.add_study()
    auto.flag("--learn", "if no known effect explains the error, learn a curve and continue")
    text = "if the verdict is unknown in the end, add a closure; the verdict stays unknown"
    auto.flag("--closure", text)
    text = (
        "all: search for the law together with its effects (default on a test bench if no law "
        "was chosen); a name: begin with that law"
    )
    auto.add_argument("--law", help=text)
    auto.flag("--proven", "leave out effects that improve the prediction and that no verdict names")
    auto.add_trust()
    auto.add_details()
    auto.add_json("print steps and verdict as JSON")
    auto.set_defaults(act=_auto)
    add_common_to_actions(commands)


def main(arguments: argparse.Namespace) -> int:
    """Run one action on studies."""
    return int(arguments.act(arguments))


def _add_check(parser: Parser) -> None:
    parser.add_study()
    parser.flag("--mask", "treat isolated spikes as not measured from now on")
    text = (
        "correct what can be corrected in study.toml: lines, and gain, zero or sign of a run "
        "that differs, and of the verdict on these data the delay of a run, clock, slew and range"
    )
    parser.flag("--correct", text)
    parser.add_json("print the findings as JSON")
    parser.set_defaults(act=_check)


def _add_new(parser: Parser) -> None:
    parser.add_argument("name", type=Path, metavar="NAME", help="folder of the new study")
    parser.add_argument(
        "--data", nargs="+", action="extend", required=True, metavar="GLOB",
        help="measurement files, or a folder of them; quote a pattern: 'lab/*.csv'",
    )  # fmt: skip
    text = "motion prescribed and force measured, or ground motion in and response out"
    parser.add_argument("--rig", choices=("bench", "structure"), default="bench", help=text)
    text = "the structure's data file, with --rig structure"
    parser.option("--building", "FILE", text, type=Path)
    parser.option("--device", "NAME", "device to identify, if the building has several")
    parser.add_channels_of_data()
    text = "test runs, which no fit and no verdict uses: names among the data, or more files"
    parser.add_argument("--test", nargs="+", action="extend", default=[], metavar="GLOB", help=text)
    _add_runs(parser)
    text = (
        "law of the first model; else lugre, and on a test bench diagnose searches for the "
        "law together with its effects"
    )
    parser.add_argument("--law", help=text)
    parser.add_argument("--title", default="", help="the study's title; else its name")
    parser.add_json()
    parser.set_defaults(act=_new)


def _add_runs(parser: Parser) -> None:
    """Add what is known of whole runs, and how files hold them."""
    parser.add_run_facts()
    text = "files hold several runs: 'restart' of the time, 'rests', 'column TITLE', or 'sheets'"
    parser.option("--split", "HOW", text, default="")
    text = "sheet of a workbook, else the likeliest; '*' for all with the same columns, each a run"
    parser.option("--sheet", "NAME", text, default="")
    text = "decimate faster runs to this rate; 0 keeps all samples; else 500 Hz from 1 kHz on"
    parser.option("--rate", "HZ", text, type=float)
    parser.flag("--mask", "treat isolated spikes as not measured")


def _new(arguments: argparse.Namespace) -> int:
    from ..physics.laws import law_names
    from ..study.run_facts import RunChoices
    from ..study.steps import create_study

    law = arguments.law
    if law is not None and law not in law_names():
        raise StudyError(f'--law "{law}"; there are: {", ".join(law_names())}.')
    channels = channels_of(arguments.channel, arguments.step)
    table = arguments.runs
    files = [file for file in files_of(arguments.data) if table is None or Path(file) != table]
    test = test_files(arguments.test, files)
    split = arguments.split
    if arguments.sheet:
        if split:
            raise StudyError("--sheet and --split exclude each other.")
        split = "sheets" if arguments.sheet == "*" else f"sheet {arguments.sheet}"
    choices = RunChoices(
        arguments.level, arguments.label, table, split, arguments.rate, arguments.mask,
        test,
    )  # fmt: skip
    created = create_study(
        arguments.name,
        list(dict.fromkeys([*files, *test])),
        rig=arguments.rig,
        building=arguments.building,
        channels=channels,
        title=arguments.title,
        law=law,
        runs=choices,
        device=arguments.device,
        without=arguments.without,
    )
    print_answer(arguments, _created_answer(created), created.view())
    return 0


def _created_answer(created: Created) -> dict[str, Any]:
    settings = created.study.settings
    return {
        "folder": str(created.study.folder.absolute()),
        "rig": settings.rig,
        "runs": [asdict(run) for run in settings.runs],
        "channels": [asdict(guess) for guess in created.guesses],
        "extra": {n: {"column": s.column, "unit": s.unit} for n, s in created.extra.items()},
        "unused": list(created.unused),
        "notes": list(created.notes),
    }


def _check(arguments: argparse.Namespace) -> int:
    from ..core.progress import Progress
    from ..study.data_check import check_data
    from ..study.study import Study
    from ..view.style import png

    study = Study(arguments.folder)
    if arguments.mask and not study.settings.mask:
        study = study.with_mask()
        if not arguments.json:
            print(f"{study.folder / 'study.toml'}: mask = true; isolated spikes are masked.\n")
    total = len(study.settings.runs)
    with Progress("checking the data", total, True) as progress:
        found = check_data(study, progress.show)
    apart: list[str] = []
    if arguments.correct and (joined := _corrections(study, found)):
        study = study.with_corrections({run.name: run.corrections for run in joined})
        apart = [text for run in joined for text in run.apart]
        if not arguments.json:
            _print_corrections(joined)
        found = check_data(study)
    picture = study.write_report("data_check.png", png(found.page(), 110))
    answer = {**found.as_dict(), "picture": str(picture.absolute())}
    answer |= {"not_corrected": apart} if apart else {}
    then = (
        Next(command("identify", study.folder), "fits the model"),
        Next(command("study", "auto", study.folder), "takes all steps from here on"),
    )
    print_answer(arguments, answer, found.view().then(*(then if found.ok else ())))
    if not arguments.json:
        print(f"Picture: {picture}")
    return 0 if found.ok else StudyError.exit_code


def _corrections(study: Study, found: DataCheck) -> list[RunCorrections]:
    """Return what the check and the verdict on these data can set right, run by run."""
    from ..diagnosis.conclusion import corrections_of
    from ..study.runs import joined_corrections

    corrections = found.corrections()
    verdict = study.verdict()
    if verdict is not None and verdict.get("data") == study.data:
        for run, listed in corrections_of(verdict, [run.name for run in found.runs]).items():
            own = corrections.setdefault(run, [])
            known = {one[:2] for one in own}  # what both found is set right once
            own += [one for one in listed if one[:2] not in known]
    sizes = {run.name: len(run.time) for run in found.runs}
    return joined_corrections(study.folder, study.settings, corrections, sizes)


def _print_corrections(joined: Sequence[RunCorrections]) -> None:
    """Print what is set right from now on, run by run, then what cannot be."""
    if any(run.corrections for run in joined):
        print("From now on, by study.toml:")
    for run in joined:
        for one in run.corrections:
            print(f"  {run.name}: {one.text}.")
        for note in run.notes:
            print(f"    {note}")
    for run in joined:
        for text in run.apart:
            print(text)
    print()


def _auto(arguments: argparse.Namespace) -> int:
    from ..study.auto import complete
    from ..study.steps import verdict_of
    from ..study.study import Study
    from ..study.view import completed_view

    study = Study(arguments.folder)
    done = complete(
        study, law=arguments.law, proven=arguments.proven, curves=arguments.learn,
        closure=arguments.closure,
    )  # fmt: skip
    written = study.verdict()  # its error is that of the model that the study now has
    view = completed_view(study, done, written or verdict_of(study, done.verdict))
    print_study_answer(arguments, done.as_dict(), view)
    return 0
