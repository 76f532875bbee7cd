"""Make an example study of a rig with a hidden effect, to try the commands."""

from __future__ import annotations

import argparse
from pathlib import Path

from ._options import Parser, add_common_to_actions, print_json

HELP = "make an example study: measurements of a rig with a hidden effect"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle example`."""
    commands = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    shown = commands.add_parser("list", help="list the effects that each rig can hide")
    shown.add_json("print as JSON")
    shown.set_defaults(act=_list)
    bench = commands.add_parser("bench", help="an MR damper, or another device, on a test bench")
    _add_choices(bench)
    text = "keep the voltage constant in each run, at 2 or 6 V, as many laboratories do"
    bench.flag("--held", text)
    bench.set_defaults(act=_make)
    building = commands.add_parser("building", help="a base-isolated building on a shake table")
    _add_choices(building)
    building.flag("--no-load-cell", "leave the damper's force out of the files")
    building.set_defaults(act=_make)
    reveal = commands.add_parser("reveal", help="show the hidden answer and what the study found")
    reveal.add_argument("folder", type=Path, metavar="FOLDER", help="the example")
    reveal.add_json()
    reveal.set_defaults(act=_reveal)
    performing = commands.add_parser("perform", help="perform a plan on the simulated rig")
    performing.add_argument("folder", type=Path, metavar="FOLDER", help="the example")
    performing.add_argument("plan", type=Path, metavar="PLAN", help="the folder of the plan")
    text = "name the runs NAME_1, NAME_2 ...; else they have the names of the plan"
    performing.option("--as-runs", "NAME", text, default="")
    performing.flag("--insist", "perform the plan even if it was made for another study")
    performing.add_json()
    performing.set_defaults(act=_perform)
    add_common_to_actions(commands)


def _add_choices(parser: Parser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the new study")
    text = (
        "effect to hide, see bristle example list; give it twice for two; else the seed draws one"
    )
    parser.several("--effect", "NAME", text)
    parser.flag("--none", "hide nothing")
    parser.flag("--outside", "hide an effect that is not in the library")
    text = (
        "law of the damper: bingham or lugre; in a building lugre; on a bench also shock_absorber, "
        "friction_damper, isolator or fluid_viscous, which nothing commands"
    )
    parser.add_argument("--law", default="", help=text)
    text = "noise on every channel as a share of its RMS; 0.01 by default"
    parser.option("--noise", "SHARE", text, type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=1, help="draws the rig; 1 by default")


def main(arguments: argparse.Namespace) -> int:
    """Run one action on examples."""
    return int(arguments.act(arguments))


def _list(arguments: argparse.Namespace) -> int:
    from ..examples.hidden import HIDDEN

    rows = [
        {
            "name": one.name, "rigs": list(one.rigs), "laws": list(one.laws),
            "outside": one.outside, "about": one.about,
        }
        for one in HIDDEN.values()
    ]  # fmt: skip
    if arguments.json:
        print_json(rows)
        return 0
    print(f"{'hidden effect':20} {'in':16} what it is")
    for one in HIDDEN.values():
        print(f"{one.name:20} {', '.join(one.rigs):16} {one.about}")
        if one.laws:
            print(f"{'':37} (laws {', '.join((*one.laws, *one.devices))})")
    outside = ", ".join(one.name for one in HIDDEN.values() if one.outside)
    print(f"\nNo effect of the library: {outside}. Draw one of them with --outside.")
    print("Make one:  bristle example bench my_rig")
    return 0


def _make(arguments: argparse.Namespace) -> int:
    from ..examples.hidden import FILE
    from ..examples.make import Choice, make_bench, make_building
    from ..study.study import Study

    folder: Path = arguments.folder
    choice = Choice(
        effects=tuple(arguments.effect), law=arguments.law, noise=arguments.noise,
        seed=arguments.seed, nothing=arguments.none, outside=arguments.outside,
        held=getattr(arguments, "held", False),
    )  # fmt: skip
    if arguments.action == "bench":
        make_bench(folder, choice)
    else:
        make_building(folder, choice, load_cell=not arguments.no_load_cell)
    runs = Study(folder).settings.runs
    held = sum(run.role == "holdout" for run in runs)
    print(f"{folder}: a study of {len(runs) - held} runs for training and {held} held out.")
    print(f"The hidden answer is in {folder / FILE}.")
    print(f"Next:  bristle study auto {folder}")
    return 0


def _perform(arguments: argparse.Namespace) -> int:
    from ..examples.make import perform_plan
    from .study import print_added

    extended = perform_plan(
        arguments.folder, arguments.plan, name=arguments.as_runs, insist=arguments.insist
    )
    print_added(extended, as_json=arguments.json)
    return 0


def _reveal(arguments: argparse.Namespace) -> int:
    from ..examples.hidden import told, unseal
    from ..study.study import Study

    answer = unseal(arguments.folder)
    study = Study(arguments.folder)
    verdict = study.verdict() or {}
    named = [*study.model().effects, *verdict.get("effects", [])]
    found, kind = tuple(dict.fromkeys(named)), str(verdict.get("kind", ""))
    if arguments.json:
        print_json(answer | {"found": list(found), "verdict": kind})
    else:
        print(told(answer, found, kind))
    return 0
