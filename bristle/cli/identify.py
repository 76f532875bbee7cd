"""Fit the model of a study to its training runs, and test it on the held-out runs."""

from __future__ import annotations

import argparse

from ._options import Parser, import_ahead, print_answer, print_study_answer

HELP = (
    "fit a study's model: parameters with intervals, what the data do not identify, errors of laws"
)


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle identify`."""
    parser.add_study()
    text = (
        "another law than the model's, see `bristle list laws`; all: keep the model's law, "
        "and compare all laws on a test bench"
    )
    parser.add_argument("--law", help=text)
    text = (
        "how the command enters: linear, quadratic or table; several with commas, or all, to "
        "compare their errors on held-out runs; else the form of the model"
    )
    parser.option("--command", "FORM", text, dest="form")
    text = (
        "low-pass for the low-passed errors beside the error; 0 for none; else study.toml's "
        "cut_off (18 Hz)"
    )
    parser.option("--cutoff", "HZ", text, type=float)
    text = "number of starting points of the fit; else 4"
    parser.option("--starts", "N", text, type=int, default=4)
    parser.add_dry_run()
    text = (
        "for a building: identify only the building (stiffnesses, frequencies and damping ratios "
        "from its response) and write a building file"
    )
    parser.flag("--structure", text)
    parser.add_trust()
    parser.add_details()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Identify, write the step and the picture, print the tables."""
    if arguments.structure:
        return _main_building(arguments)
    from ..core.files import json_text
    from ..core.interrupt import keeps
    from ..core.progress import tell
    from ..study.identify import identify_study
    from ..study.study import Study
    from ..study.view import identified_view

    study = Study(arguments.folder)
    if not arguments.dry_run:
        import_ahead("bristle.study.pictures", "bristle.study.view")
    found = identify_study(
        study,
        law=arguments.law,
        command=arguments.form,
        cutoff=arguments.cutoff,
        starts=arguments.starts,
        write=not arguments.dry_run,
    )
    tell("drawing")
    if not arguments.dry_run:
        keeps("The new step is kept in the study's history; its picture was not drawn.")
    picture = None
    if not arguments.dry_run:
        from ..study.view import draw_identified
        from ..view.style import png

        picture = study.write_report("identify.png", png(draw_identified(found), 110))
        study.write_report("identify.json", json_text(found.as_dict()) + "\n")
    answer = {**found.as_dict(), "picture": str(picture.absolute()) if picture else None}
    print_study_answer(arguments, answer, identified_view(found, study.folder), picture)
    return 0


# The building alone, with --structure.


def _main_building(arguments: argparse.Namespace) -> int:
    """Identify the building, write its file and the step, print the tables."""
    from ..errors import StudyError
    from ..study.steps import identify_building_alone
    from ..study.study import Study

    if arguments.law:
        raise StudyError("--law is a damper's: --structure identifies the building without one.")
    found = identify_building_alone(Study(arguments.folder), write=not arguments.dry_run)
    print_answer(arguments, found.as_dict(), found.view())
    return 0
