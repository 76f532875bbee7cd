"""Plan the next tests of a rig: motions and commands for its controller, and their expected result.

Each test is a CSV file that begins and ends at rest, with a picture. Half of the tests are for
training, half are held out. Without a purpose, they answer the open question of the verdict: the
alternatives if it is ambiguous, an unknown part if it is unknown, or else all effects and
parameters.

On a building the tests are ground motions and commands.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import command
from ..view.blocks import Next
from ._options import Parser, print_json

if TYPE_CHECKING:
    from ..planning.plan import Plan

HELP = "plan the next tests of a rig: motions and commands as files for its controller"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle plan`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", nargs="?", help="the study")
    text = "a rig.toml with [damper] and [limits]: plan before the first measurement"
    parser.option("--new", "FILE", text, type=Path)
    text = "distinguish alternatives: effects, laws, or none for the present model"
    parser.option("--separate", "NAME", text, nargs="+")
    parser.option("--see", "EFFECT", "make effects visible; without names, all effects", nargs="*")
    text = "narrow the intervals of parameters, or of those of an effect; without names, of all"
    parser.option("--sharpen", "PARAMETER", text, nargs="*")
    text = "cover coordinates on which an unknown part may depend; without names, the usual ones"
    parser.option("--learn", "COORDINATE", text, nargs="*")
    parser.option("--rig", "FILE", "a rig.toml with [limits]", type=Path)
    for name, text in LIMITS.items():
        parser.option(f"--{name.replace('_', '-')}", "QUANTITY", text)
    text = "for a building: more ground motions that the plan may scale, files or names"
    parser.option("--record", "FILE", text, nargs="+", default=[])
    parser.option("--runs", "N", "number of tests; 4 by default", type=int)
    parser.add_argument("--seed", type=int, default=1, help="seed of the candidate tests")
    text = "folder of the files; by default plan, plan_2 ... in the study"
    parser.add_out(text)
    parser.add_dry_run()
    parser.add_trust()
    parser.add_details()
    parser.add_json("print the plan as JSON")


LIMITS = {
    "stroke": 'motion to either side, such as "20 mm"; by default that of the runs',
    "speed": 'such as "200 mm/s"; by default that of the runs',
    "acceleration": 'such as "10 m/s2"; by default that of the runs',
    "force": 'of the actuator, such as "2 kN"',
    "heat": 'energy that the damper may absorb in a test, such as "200 J"',
    "duration": 'of a test, such as "20 s"; 12 s by default',
    "rate": 'samples per second of the controller, such as "500 Hz"',
    "damper_stroke": "of a building: motion of the damper to either side, such as 10mm",
    "drift": "of a building: drift of a storey to either side, such as 5mm",
}
"""Limits that are options: quantities with their unit."""


def main(arguments: argparse.Namespace) -> int:
    """Plan, write the files, print the tests and what they will show."""
    from ..errors import StudyError
    from ..planning.api import plan
    from ..planning.folder import refuse_existing

    if (arguments.folder is None) == (arguments.new is None):
        raise StudyError("name a study, or a rig.toml with --new; one of the two.")
    if arguments.new is not None and not arguments.new.is_file():
        raise StudyError(f"{arguments.new}: there is no such file.")
    if arguments.out is not None and not arguments.dry_run:
        refuse_existing(arguments.out)  # before the search, not after it
    given: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in (*LIMITS, "runs")
        if getattr(arguments, name) is not None
    }
    found = plan(
        arguments.new or arguments.folder,
        separate=arguments.separate,
        see=_asked(arguments.see),
        sharpen=_asked(arguments.sharpen),
        learn=_asked(arguments.learn),
        rig=arguments.rig,
        record=arguments.record,
        seed=arguments.seed,
        **given,
    )
    folder = None
    if found.worth and not arguments.dry_run:
        folder = found.write(arguments.out or _free(arguments.folder or Path()))
    if arguments.json:
        place = {"folder": str(folder)} if folder else {}
        print_json({**found.as_dict(), **place})
    else:
        print(text(found, arguments.folder, folder, details=arguments.details))
    return 0


def _asked(names: list[str] | None) -> list[str] | bool | None:
    return names or (None if names is None else True)


def _free(folder: Path) -> Path:
    """Return the first folder of `plan`, `plan_2` ... that is not there."""
    number = 1
    while (found := folder / ("plan" if number == 1 else f"plan_{number}")).exists():
        number += 1
    return found


def text(found: Plan, study: Path | None, folder: Path | None, *, details: bool = False) -> str:
    """Return a plan as text, with the next command.

    Parameters
    ----------
    found : the plan
    study, folder : where its study and its files are, if it has them
    details : whether to print what stands behind the answer
    """
    from ..view import terminal

    view = found.view()
    if folder is not None:
        then = command("study", "new", "my_rig", "--data", "MEASURED.csv")
        if study is not None:
            then = command("study", "extend", study, "MEASURED.csv", "--plan", folder)
        view = view.then(Next(then, "once they are measured"))
    told = terminal.text(view, details=details)
    return told if folder is None else f"{told}\nFiles: {folder}"
