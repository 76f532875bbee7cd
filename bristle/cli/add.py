"""Add an effect to a study's model, refit it, and show the error before and after."""

from __future__ import annotations

import argparse

from ._options import Parser, print_answer

HELP = (
    "add an effect to a study's model and refit it: error before and after, a step in the history"
)


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle add`."""
    parser.add_study()
    parser.add_argument("effects", nargs="+", metavar="EFFECT", help="see `bristle list effects`")
    parser.add_argument("--why", default="", help="the reason, for the history")
    parser.add_trust()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Add, refit, print."""
    from ..core.interrupt import keeps
    from ..study.steps import add_effects
    from ..study.study import Study
    from ..study.view import added_view

    study = Study(arguments.folder)
    added = add_effects(study, arguments.effects, why=arguments.why)
    keeps("The new step is kept in the study's history.")
    print_answer(arguments, added.as_dict(), added_view(added, arguments.folder))
    return 0
