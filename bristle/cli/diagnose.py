"""Find the effects that a study's model misses, with confidence and alternatives."""

from __future__ import annotations

import argparse

from ._options import Parser, print_study_answer

HELP = "find the effects that a study's model misses, with confidence and alternatives"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle diagnose`."""
    parser.add_study()
    text = (
        "all: search for the law together with its missing effects (default on a test bench "
        "if no law was chosen); the model's law: keep it"
    )
    parser.add_argument("--law", help=text)
    parser.add_dry_run()
    parser.add_trust()
    parser.add_details()
    parser.add_json("print verdict.json")


def main(arguments: argparse.Namespace) -> int:
    """Diagnose, write verdict.json and the picture, print the verdict with its evidence."""
    from ..core.interrupt import keeps
    from ..core.progress import tell
    from ..study.steps import diagnose_study, verdict_of
    from ..study.study import Study
    from ..study.view import diagnosed_view

    study = Study(arguments.folder)
    found = diagnose_study(study, law=arguments.law, write=not arguments.dry_run)
    verdict = verdict_of(study, found)
    picture = None
    if not arguments.dry_run:
        keeps("The verdict is kept in verdict.json; its picture was not drawn.")
        tell("drawing")
        from ..diagnosis.view import draw_verdict
        from ..view.style import png

        picture = study.write_report("diagnose.png", png(draw_verdict(verdict)))
    print_study_answer(arguments, verdict, diagnosed_view(verdict, study.folder), picture)
    return 0
