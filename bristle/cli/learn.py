"""Learn an unknown effect from a study's measurements, as a curve inside the model.

A spline along displacement, speed, acceleration, the command, a memory of these or an extra channel
acts as an added force, a factor of a part of the law, or a map of the command. Where no curve along
one signal explains the error, surfaces over two signals are tried too. In the isolation layer or a
storey of a building a curve acts as an added force, friction or damping, or a factor of the
stiffness. The command keeps it if it lowers the error on held-out runs beyond chance. What no
formula serves, a closure carries: a small network, and no effect of physics.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection
from typing import TYPE_CHECKING

from ._options import Parser, print_study_answer

if TYPE_CHECKING:
    from ..study.study import Study

HELP = "learn an unknown effect from a study's measurements, as a curve or a formula"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle learn`."""
    parser.add_study()
    text = (
        "signals that the curve may depend on, such as displacement,speed, or an extra "
        "channel of the study; of several, curves along each and surfaces over two; default all"
    )
    parser.option("--along", "SIGNAL[,SIGNAL]", text, default="")
    text = (
        "parts that the curve may act on: force, friction, yield, viscous, fluid, "
        "yield_field, fluid_field, command, slip, resonance; in a layer or storey force, "
        "friction, spring, damping, slip; default all"
    )
    parser.option("--as", "PART[,PART]", text, dest="parts", default="")
    text = (
        "site in a building: damper, layer, storey1, storey2 ...; by default the site whose "
        "verdict is unknown, or else the one with the largest error"
    )
    parser.option("--at", "SITE", text, default="")
    text = "name of the effect; default learned_1, learned_2"
    parser.add_argument("--name", default="", help=text)
    text = "learn a closure: a small network in parallel with the model, for what no curve serves"
    parser.flag("--closure", text)
    parser.flag("--table", "keep the table even if a formula fits as well")
    parser.add_dry_run()
    parser.add_trust()
    parser.add_details()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Learn, write the effect's file, print what was found."""
    from ..learning.curve import PARTS, PARTS_OF_LINE
    from ..learning.signals import ALONG
    from ..study.learn import learn_effect
    from ..study.study import Study
    from ..study.view import learned_with_next

    study = Study(arguments.folder)
    if arguments.closure:
        return _closure(study, arguments)
    signals = {name: name for name in (*ALONG, *study.settings.beside)}
    signals |= _of_command(study.drive)
    found = learn_effect(
        study,
        parts=_listed(arguments.parts, {**PARTS, **PARTS_OF_LINE}, "--as"),
        along=[signals[one] for one in _listed(arguments.along, signals, "--along")],
        at=arguments.at.strip().replace(" ", ""),
        name=arguments.name,
        table=arguments.table,
        write=not arguments.dry_run,
    )
    print_study_answer(arguments, found.as_dict(), learned_with_next(found, arguments.folder))
    return 0


def _closure(study: Study, arguments: argparse.Namespace) -> int:
    """Learn a closure, write its effect's file, print what was found."""
    from ..errors import StudyError
    from ..study.learn import learn_study_closure
    from ..study.view import closure_with_next

    given = ("along", "parts", "at", "table")
    wrong = [{"parts": "as"}.get(one, one) for one in given if getattr(arguments, one)]
    if wrong:
        raise StudyError(
            f"--{wrong[0]} chooses a curve; a closure has all motion and command as inputs. "
            f"--closure without --{wrong[0]} is right."
        )
    found = learn_study_closure(study, name=arguments.name, write=not arguments.dry_run)
    print_study_answer(arguments, found.as_dict(), closure_with_next(found, arguments.folder))
    return 0


def _of_command(drive: str) -> dict[str, str]:
    """Return how the signals of a command may be called in a study: `current` for `voltage`."""
    from ..physics.drive import VOLTAGE

    old = (VOLTAGE.name, f"recent_{VOLTAGE.name}")
    return {name.replace(VOLTAGE.name, drive): name for name in old if drive}


def _listed(text: str, known: Collection[str], option: str) -> list[str]:
    from ..core.text import unknown
    from ..errors import StudyError

    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in known:
            what = "signal" if option == "--along" else "part"
            raise StudyError(f"{option}: {unknown(what, name, known)}")
    return names
