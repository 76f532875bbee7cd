"""Simulate building and identified damper under ground motions alone, and say how far that holds.

Of a study of a building the ground motion and command of each run are taken, and the error of peak
and RMS of each response stands beside its 95 % band. `--building` puts a damper from a bench into
the building of a file.
"""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path

from ._options import Parser, print_study_answer
from .compare import add_role

HELP = "simulate a study's damper in its building: peaks and RMS, with a 95 %% band"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle predict`."""
    parser.add_study()
    add_role(parser)
    text = "simulate a damper from a bench in the building of this file, under --record or --data"
    parser.option("--building", "FILE", text, type=Path)
    parser.option("--data", "FILE", "with --building: a measurement of that building", type=Path)
    text = "with --building: name or file of a ground motion, where nothing was measured"
    parser.option("--record", "RECORD", text)
    text = "with --building: the damper's constant command if the ground motion has none; else 0"
    parser.option("--level", "V", text, type=float)
    text = "number of draws of the parameters for the band; 0 for no band; else 20"
    parser.option("--draws", "N", text, type=int)
    text = (
        "widen the band by the effects that the verdict's limits do not exclude, and list the part "
        "of each"
    )
    parser.flag("--with-limits", text)
    parser.add_trust()
    parser.add_details()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Simulate; print sentences, tables and notes."""
    from ..prediction.closed_loop import closed_loop, closed_loop_in
    from ..prediction.excitation import house_of, trials_in
    from ..prediction.monte_carlo import DRAWS
    from ..study.study import Study

    _refuse(arguments)
    study = Study(arguments.folder)
    draws = DRAWS if arguments.draws is None else arguments.draws
    if arguments.building is None:
        found = closed_loop(
            study, role=arguments.role, draws=draws, with_limits=arguments.with_limits
        )
    else:
        house = house_of(arguments.building)
        trials = trials_in(house, arguments.data, arguments.record, arguments.level)
        found = closed_loop_in(study, house, trials, draws=draws, with_limits=arguments.with_limits)
    print_study_answer(arguments, found.as_dict(), found.view())
    return 0


def _refuse(arguments: argparse.Namespace) -> None:
    """Refuse options that need --building, those that do not go with it, and bad numbers."""
    from ..errors import StudyError

    alone = [one for one in ("data", "record", "level") if getattr(arguments, one) is not None]
    if alone and arguments.building is None:
        raise StudyError(
            f"--{alone[0]} needs --building: a study of a building has ground motions of its own."
        )
    if arguments.building is not None and arguments.role != "holdout":
        raise StudyError("--role does not go with --building: the runs are those of the building.")
    if arguments.level is not None and not isfinite(arguments.level):
        raise StudyError(f"--level {arguments.level}: expected a finite number.")
    if arguments.draws is not None and arguments.draws < 0:
        raise StudyError(f"--draws {arguments.draws}: expected 0 or a positive whole number.")
