"""Take back the last step of a study: its model before that step is the present one again."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "undo the last step of a study's model"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle undo`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Undo the last step; the step is kept in history/undone/."""
    from ..study.study import Study

    study = Study(arguments.folder)
    undone = study.undo()
    now = study.history.step(study.history.numbers()[-1])
    if arguments.json:
        import json
        from dataclasses import asdict

        print(json.dumps({"undone": asdict(undone), "now": asdict(now)}, indent=2))
        return 0
    kept = study.history.undone(undone.number)
    print(f'{study.folder}: step {undone.number}, "{undone.what}", is taken back ({kept}).')
    print(f'The model is that of step {now.number} again, "{now.what}".')
    return 0
