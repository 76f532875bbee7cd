"""Take back the last step of a study: its model before that step is the present one again."""

from __future__ import annotations

import argparse

from ._options import Parser, print_json

HELP = "undo the last step of a study's model"


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle undo`."""
    parser.add_study()
    parser.add_json()


def main(arguments: argparse.Namespace) -> int:
    """Undo the last step; the step is kept in history/undone/."""
    from ..study.study import Study

    study = Study(arguments.folder)
    undone = study.undo()
    now = study.history.step(study.history.numbers()[-1])
    if arguments.json:
        from dataclasses import asdict

        print_json({"undone": asdict(undone), "now": asdict(now)})
        return 0
    kept = study.history.undone(undone.number)
    print(f'{study.folder}: step {undone.number}, "{undone.what}", is taken back ({kept}).')
    print(f'The model is that of step {now.number} again, "{now.what}".')
    return 0
