"""Make a study from measurement files, check its data before any model, and change its runs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ._channels import add_channels
from ._common import add_common_to_actions, add_details
from ._consent import add_trust
from ._extend import add_extend
from ._files import add_run_facts, channels_of, files_of, test_files
from ._roles import add_roles

if TYPE_CHECKING:
    from ..study.create import Created
    from ..study.data_check import DataCheck
    from ..study.joined_corrections import RunCorrections
    from ..study.study import Study

HELP = "make and change studies of measurements: new, extend, check, roles, channels, auto"


def add_arguments(parser: argparse.ArgumentParser) -> None:
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
    auto.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    auto.add_argument(
        "--learn", action="store_true",
        help="if no known effect explains the error, learn a curve and continue",
    )  # fmt: skip
    auto.add_argument(
        "--law",
        help="all: search for the law together with its effects (default on a test bench if no law "
        "was chosen); a name: begin with that law",
    )
    auto.add_argument(
        "--greedy", action="store_true",
        help="if no effect explains the error, add the one that lowers it most, and continue",
    )  # fmt: skip
    add_trust(auto)
    add_details(auto)
    auto.add_argument("--json", action="store_true", help="print steps and verdict as JSON")
    auto.set_defaults(act=_auto)
    add_common_to_actions(commands)


def main(arguments: argparse.Namespace) -> int:
    """Run one action on studies."""
    return int(arguments.act(arguments))


def _add_check(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--mask", action="store_true", help="treat isolated spikes as not measured from now on"
    )
    parser.add_argument(
        "--correct", action="store_true",
        help="correct what can be corrected in study.toml: lines, and gain, zero or sign of a run "
        "that differs, and of the verdict on these data the delay of a run, clock, slew and range",
    )  # fmt: skip
    parser.add_argument(
        "--exclude", nargs="+", action="extend", default=[], metavar="RUN",
        help="leave these runs out from now on: role = \"exclude\" in study.toml",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")
    parser.set_defaults(act=_check)


def _add_new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", type=Path, metavar="NAME", help="folder of the new study")
    parser.add_argument(
        "--data", nargs="+", action="extend", required=True, metavar="GLOB",
        help="measurement files, or a folder of them; quote a pattern: 'lab/*.csv'",
    )  # fmt: skip
    parser.add_argument(
        "--rig", choices=("bench", "structure"), default="bench",
        help="motion prescribed and force measured, or ground motion in and response out",
    )  # fmt: skip
    parser.add_argument(
        "--building", type=Path, metavar="FILE",
        help="the structure's data file, with --rig structure",
    )  # fmt: skip
    parser.add_argument(
        "--device", metavar="NAME", help="device to identify, if the building has several"
    )
    parser.add_argument(
        "--channel",
        action="append",
        default=[],
        metavar="CHANNEL=COLUMN@UNIT",
        help="column of a channel, instead of the guess; a minus before COLUMN reverses its sign: "
        "--channel 'force=-Ch3@kN'",
    )
    parser.add_argument(
        "--without", action="append", default=[], metavar="CHANNEL",
        help="a channel that is not read, though a column was taken for it",
    )  # fmt: skip
    parser.add_argument(
        "--step", type=float, metavar="S", help="sampling step in s of files without a time"
    )
    parser.add_argument(
        "--test", nargs="+", action="extend", default=[], metavar="GLOB",
        help="test runs, which no fit and no verdict uses: names among the data, or more files",
    )  # fmt: skip
    _add_runs(parser)
    parser.add_argument(
        "--law",
        help="law of the first model; else lugre, and on a test bench diagnose searches for the "
        "law together with its effects",
    )
    parser.add_argument("--title", default="", help="the study's title; else its name")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(act=_new)


def _add_runs(parser: argparse.ArgumentParser) -> None:
    """Add what is known of whole runs, and how files hold them."""
    add_run_facts(parser)
    parser.add_argument(
        "--split", default="", metavar="HOW",
        help="files hold several runs: 'restart' of the time, 'rests', or 'column TITLE'",
    )  # fmt: skip
    parser.add_argument(
        "--rate", type=float, metavar="HZ",
        help="decimate faster runs to this rate; 0 keeps all samples; else 500 Hz from 1 kHz on",
    )  # fmt: skip
    parser.add_argument("--mask", action="store_true", help="treat isolated spikes as not measured")


def _new(arguments: argparse.Namespace) -> int:
    from ..data.channels import ChannelSpec
    from ..errors import StudyError
    from ..physics.laws import law_names
    from ..study.create import create_study
    from ..study.run_facts import RunChoices

    law = arguments.law
    if law is not None and law not in law_names():
        raise StudyError(f'--law "{law}"; there are: {", ".join(law_names())}.')
    channels = channels_of(arguments.channel)
    if arguments.step is not None:
        if "time" in channels:
            raise StudyError("--step and --channel time=... exclude each other.")
        channels["time"] = ChannelSpec(step=arguments.step)
    table = arguments.runs
    files = [file for file in files_of(arguments.data) if table is None or Path(file) != table]
    test = test_files(arguments.test, files)
    choices = RunChoices(
        arguments.level, arguments.label, table, arguments.split, arguments.rate, arguments.mask,
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
    if arguments.json:
        _print_json(created)
    else:
        _print_new(created)
    return 0


def _print_json(created: Created) -> None:
    import json
    from dataclasses import asdict

    settings = created.study.settings
    answer = {
        "folder": str(created.study.folder.absolute()),
        "rig": settings.rig,
        "runs": [asdict(run) for run in settings.runs],
        "channels": [asdict(guess) for guess in created.guesses],
        "extra": {n: {"column": s.column, "unit": s.unit} for n, s in created.extra.items()},
        "unused": list(created.unused),
        "notes": list(created.notes),
    }
    print(json.dumps(answer, indent=2, ensure_ascii=False))


def _print_new(created: Created) -> None:
    from ..findings import capital, command, listed

    folder, settings = created.study.folder, created.study.settings
    print(f"{folder}: a study of {len(settings.runs)} run(s). The columns are read as:")
    for guess in created.guesses:
        turned = "turned" if guess.sign < 0 else ""
        told = guess.column.endswith((f"[{guess.unit}]", f"({guess.unit})"))
        column = guess.column if told else f"{guess.column} [{guess.unit}]"
        print(f"  {guess.channel:28} {column} {turned}".rstrip())
        print(f"  {'':28}   {guess.reason}")
        if guess.doubt:
            print(f"  {'':28}   doubtful: {guess.doubt}")
    extra = [f"  {name:28} {one.column}, in {one.unit}" for name, one in created.extra.items()]
    if extra:
        head = "Extra channels, on which an error may depend ([extra] in study.toml):"
        print(head, *extra, sep="\n")
    if created.unused:
        print(f"Not used: {listed(created.unused)}.")
    files = [run.file for run in (*settings.runs, *settings.excluded)]
    for note in created.notes:
        print(f"{capital(note, files)}.")
    then = command("study", "check", folder)
    wrong = command("study", "channels", folder, "--channel", "CHANNEL=COLUMN@UNIT")
    print(f"Wrong? Correct it:  {wrong}\nThen:  {then}")


def _check(arguments: argparse.Namespace) -> int:
    from ..draw.style import png
    from ..errors import StudyError
    from ..progress import Progress
    from ..study.data_check import check_data
    from ..study.study import Study

    study = Study(arguments.folder)
    if arguments.mask and not study.settings.mask:
        study = study.with_mask()
        if not arguments.json:
            print(f"{study.folder / 'study.toml'}: mask = true; isolated spikes are masked.\n")
    if arguments.exclude:
        study = study.with_excluded(arguments.exclude)
        if not arguments.json:
            print(f"{study.folder / 'study.toml'}: {study.settings.excluded_text}\n")
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
    if arguments.json:
        import json

        answer = {**found.as_dict(), "picture": str(picture.absolute())}
        answer |= {"not_corrected": apart} if apart else {}
        print(json.dumps(answer, indent=2, ensure_ascii=False))
    else:
        print(found.text())
        print(f"\nPicture: {picture}")
        if not found.ok:
            print("Correct these errors before you fit a model.", file=sys.stderr)
    return 0 if found.ok else StudyError.exit_code


def _corrections(study: Study, found: DataCheck) -> list[RunCorrections]:
    """Return what the check and the verdict on these data can set right, run by run."""
    from ..diagnose.correctable import corrections_of
    from ..study.joined_corrections import joined_corrections

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
    from ..study.completion import complete
    from ..study.learning import verdict_of
    from ..study.staircase import staircase
    from ..study.study import Study
    from .diagnose import text

    study = Study(arguments.folder)
    quiet = arguments.json or not sys.stdout.isatty()
    low = study.settings.cut_off
    shown: list[int] = []

    def show() -> None:
        steps = study.steps()
        if quiet:
            return
        print(f"\n{staircase(steps, cut_off=low)}\n", flush=True)
        shown.append(len(steps))

    done = complete(
        study, law=arguments.law, greedy=arguments.greedy, curves=arguments.learn, on_step=show
    )
    if arguments.json:
        import json

        print(json.dumps(done.as_dict(), indent=2, ensure_ascii=False))
        return 0
    if not shown:
        print(f"{staircase(study.steps(), cut_off=low)}\n")
    for one in done.curves:
        print("\n".join(one.sentences()) + "\n")
    print(text(verdict_of(study, done.verdict), arguments.folder, details=arguments.details))
    return 0
