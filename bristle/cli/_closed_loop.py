"""`bristle compare --closed-loop`: building and damper under ground motions alone."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..bridge.closed_loop_result import ClosedLoop

_OF_HOUSE = ("ground", "level")


def add_closed_loop(parser: argparse.ArgumentParser) -> None:
    """Add the options of a closed-loop prediction."""
    group = parser.add_argument_group(
        "closed loop",
        "simulate building and identified damper under the ground motion and command of each run: "
        "error of peak and RMS of each response, with a 95 % band",
    )
    group.add_argument("--closed-loop", action="store_true", help="simulate the building as well")
    group.add_argument(
        "--in", dest="house", type=Path, metavar="FILE",
        help="simulate a damper from a bench in the building of this file, under --ground or "
        "--data",
    )  # fmt: skip
    group.add_argument(
        "--ground", metavar="RECORD",
        help="with --in: name or file of a ground motion, for a prediction; --data gives a "
        "measurement of that building instead",
    )  # fmt: skip
    group.add_argument(
        "--level", type=float, metavar="V",
        help="with --in: the damper's constant command if the ground motion has none; else 0",
    )  # fmt: skip
    group.add_argument(
        "--draws", type=int, metavar="N",
        help="number of draws of the parameters for the band; 0 for no band; else 20",
    )  # fmt: skip
    group.add_argument(
        "--with-limits", action="store_true",
        help="widen the band by the effects that the verdict's limits do not exclude, and list "
        "the part of each",
    )  # fmt: skip


def refuse_alone(arguments: argparse.Namespace) -> None:
    """Refuse options that need --closed-loop or --in, those that go with neither, bad numbers."""
    from ..errors import StudyError

    foreign = [name for name in ("fmu", "out") if getattr(arguments, name) is not None]
    if arguments.closed_loop and foreign:
        why = "a study's model is simulated" if foreign == ["fmu"] else "there is no picture"
        raise StudyError(f"--{foreign[0]} does not go with --closed-loop: {why}.")

    names = {"in": "house", **{name: name for name in (*_OF_HOUSE, "draws")}}
    given = [name for name, own in names.items() if getattr(arguments, own) is not None]
    if given and not arguments.closed_loop:
        raise StudyError(f"--{given[0]} needs --closed-loop.")
    if arguments.with_limits and not arguments.closed_loop:
        raise StudyError("--with-limits needs --closed-loop.")
    alone = [name for name in given if name in _OF_HOUSE]
    if alone and arguments.house is None:
        raise StudyError(
            f"--{alone[0]} needs --in: a study of a building has ground motions of its own."
        )
    if arguments.house is not None and arguments.role != "holdout":
        raise StudyError("--role does not go with --in: the runs are those of the building.")
    if arguments.level is not None and not isfinite(arguments.level):
        raise StudyError(f"--level {arguments.level}: a finite number is right.")
    if arguments.draws is not None and arguments.draws < 0:
        raise StudyError(f"--draws {arguments.draws}: 0 or a positive whole number is right.")


def closed_loop_of(arguments: argparse.Namespace) -> ClosedLoop:
    """Return the prediction that the arguments ask for."""
    from ..bridge.closed_loop import closed_loop, closed_loop_in
    from ..bridge.closed_loop_figures import DRAWS
    from ..bridge.closed_loop_input import house_of, trials_in
    from ..study.study import Study

    study = Study(arguments.folder)
    draws = DRAWS if arguments.draws is None else arguments.draws
    if arguments.house is None:
        return closed_loop(
            study, role=arguments.role, draws=draws, with_limits=arguments.with_limits
        )
    house = house_of(arguments.house)
    trials = trials_in(house, arguments.data, arguments.ground, arguments.level)
    return closed_loop_in(study, house, trials, draws=draws, with_limits=arguments.with_limits)


def print_closed_loop(found: ClosedLoop) -> None:
    """Print sentences, tables and notes."""
    from ..view.terminal import print_tables

    print("\n".join(found.sentences()))
    print_tables(found.tables())
    if any(row.inside is False for row in found.rows):
        print("\n* the measured figure is outside the band")
    for note in found.notes:
        # A command that ends a note is copied to a shell: no full stop is part of it.
        end = "" if note.endswith(".") or ":  bristle " in note else "."
        print(f"{note[:1].upper()}{note[1:]}{end}")
