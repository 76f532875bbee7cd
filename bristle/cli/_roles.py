"""`bristle study roles`: what the runs of a study are for."""

from __future__ import annotations

import argparse
from pathlib import Path

ROLES = {
    "train": "fitted to",
    "holdout": "held out: they test the model, and no fit uses them",
    "test": "test runs, which neither a fit nor a verdict uses",
    "exclude": "left out",
}
"""The roles, with what is said of runs that get them."""


def add_roles(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle study roles`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    for role, text in ROLES.items():
        parser.add_argument(
            f"--{role}", nargs="+", action="extend", default=[], metavar="RUN",
            help=f"these runs are {text}" if role != "test" else f"these are {text}",
        )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the runs as JSON")
    parser.set_defaults(act=_roles)


def _roles(arguments: argparse.Namespace) -> int:
    """Change the roles that are named; print those of all runs."""
    from ..errors import StudyError
    from ..study.added_runs import behind_data
    from ..study.study import Study

    study = Study(arguments.folder)
    roles: dict[str, str] = {}
    for role in ROLES:
        for run in getattr(arguments, role):
            if roles.setdefault(run, role) != role:
                raise StudyError(f"{run} is given two roles, {roles[run]} and {role}.")
    if roles:
        study = study.with_roles(roles)
    runs = (*study.settings.runs, *study.settings.excluded)
    if arguments.json:
        import json

        print(json.dumps([{"run": run.name, "role": run.role} for run in runs], indent=2))
        return 0
    for run in runs:
        print(f"{run.role:8} {run.name}")
    if changed := behind_data(study):
        print(changed)
    return 0
