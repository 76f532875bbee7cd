"""`bristle study extend`: more runs in a study, held against the plan that asked for them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ._files import add_run_facts, files_of

if TYPE_CHECKING:
    from ..plan.performed import Performed
    from ..study.extend import Extended


def add_extend(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle study extend`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "data", nargs="+", metavar="FILES",
        help="measurement files, or a folder of them, with the columns of the study's others",
    )  # fmt: skip
    parser.add_argument(
        "--holdout", nargs="+", action="extend", default=[], metavar="GLOB",
        help="held-out runs among them, by file name; else those of the plan, or by the usual "
        "names, or every third run",
    )  # fmt: skip
    add_run_facts(parser)
    parser.add_argument(
        "--plan", type=Path, metavar="PLAN",
        help="the plan of these tests: take its roles, and report differences from it",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(act=_extend)


def _extend(arguments: argparse.Namespace) -> int:
    from ..plan.folder import read_plan
    from ..plan.performed import performed
    from ..study.extend import extend_study
    from ..study.run_facts import RunChoices
    from ..study.study import Study

    study, table = Study(arguments.folder), arguments.runs
    files = [file for file in files_of(arguments.data, "") if table is None or Path(file) != table]
    by_plan = None
    if arguments.plan is not None:
        by_plan = performed(study, files, read_plan(arguments.plan))
    choices = RunChoices(arguments.level, arguments.label, table)
    roles = by_plan.roles if by_plan else None
    extended = extend_study(study, files, roles=roles, holdout=arguments.holdout, choices=choices)
    print_added(extended, by_plan, as_json=arguments.json)
    return 0


def print_added(
    extended: Extended, by_plan: Performed | None = None, *, as_json: bool = False
) -> None:
    """Print the runs that were added, what differs from their plan, and the next command."""
    if as_json:
        _print_json(extended, by_plan)
        return
    from ..findings import capital, command
    from ..study.added_runs import unknown_to_model

    folder, runs = extended.study.folder, extended.runs
    print(f"{folder}: {len(runs)} run{'s' * (len(runs) != 1)} added.")
    for run in runs:
        print(f"  {run.name:28} {run.role}")
    notes = [*extended.notes, *(by_plan.notes if by_plan else ())]
    for note in notes:
        print(f"{capital(note, [run.file for run in runs])}.")
    for text in by_plan.differences if by_plan else ():
        print(f"Warning: {text}.")
    then = "identify" if unknown_to_model(extended.study) else "diagnose"
    print(f"Next:  {command(then, folder)}")


def _print_json(extended: Extended, by_plan: Performed | None) -> None:
    import json
    from dataclasses import asdict

    answer = {
        "folder": str(extended.study.folder.absolute()),
        "added": [asdict(run) for run in extended.runs],
        "notes": [*extended.notes, *(by_plan.notes if by_plan else ())],
        "plan": [asdict(pair) for pair in by_plan.pairs] if by_plan else None,
    }
    print(json.dumps(answer, indent=2, ensure_ascii=False))
