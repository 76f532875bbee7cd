"""What a study's model is missing, how sure that is, and what else it could be."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..findings import command
from ._consent import add_trust

if TYPE_CHECKING:
    from ..diagnose import Diagnosis

HELP = "what a study's model is missing, how sure, what else it could be"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle diagnose`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--dry-run", action="store_true", help="show the verdict; leave verdict.json as it is"
    )
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print verdict.json")


def main(arguments: argparse.Namespace) -> int:
    """Diagnose, write verdict.json, print the verdict with its evidence."""
    from ..study.learning import diagnose_study, verdict_of
    from ..study.study import Study

    study = Study(arguments.folder)
    found = diagnose_study(study, write=not arguments.dry_run)
    if arguments.json:
        print(json.dumps(verdict_of(study, found), indent=2, ensure_ascii=False))
    else:
        print(text(found, arguments.folder))
    return 0


SHORT = "  (short search: it gains too little, as the others do)"

TITLES = {
    "none": "Nothing is missing.",
    "effect": "Missing: {names}.",
    "class": "Missing is one of: {names}.",
    "unknown": "Something is missing that no effect of the library explains.",
    "insufficient": "These data carry no verdict.",
}


def text(found: Diagnosis, folder: Path) -> str:
    """Return the verdict as text."""
    from ..physics.effect import EFFECTS

    joined = (" and " if found.kind == "effect" else ", ").join(found.effects)
    lines = [TITLES[found.kind].format(names=joined), "", found.words]
    for name in found.effects:
        lines += ["", f"  {EFFECTS[name].first_line()}"]
    if found.sensors:
        lines += ["", "Sensors:"]
        lines += [f"  {one.channel:14} {one.fault:10} {one.value:.5g}" for one in found.sensors]
    if found.trials and found.before is not None:
        lines += ["", f"  {'model':34} {'z, training':>12} {'z, held out':>12}"]
        lines.append(f"  {'as it is':34} {found.before.train:>12.3f} {found.before.z:>12.3f}")
        refined = [trial for trial in found.trials[:5] if trial.refined]
        others = [trial for trial in found.trials if not trial.refined]
        # The order of equals is that of a rounding: one stands for all of them.
        others.sort(key=lambda trial: (round(trial.z, 2), trial.effects))
        for trial in [*refined, *others[:1]]:
            note = "" if trial.refined else SHORT
            lines.append(
                f"  {'with ' + trial.effects[-1]:34} {trial.train:>12.3f} {trial.z:>12.3f}{note}"
            )
        lines.append("  z: error over the noise that a true model would show; a true model has 1.")
    if found.untestable:
        lines += ["", f"Not testable with these runs: {', '.join(found.untestable)}."]
    if found.experiment is not None:
        lines += ["", f"To tell them apart: {found.experiment.words()}"]
    return "\n".join([*lines, *_next(found, folder)])


def _next(found: Diagnosis, folder: Path) -> list[str]:
    if found.kind in ("effect", "class"):
        names = found.effects if found.kind == "effect" else found.effects[:1]
        return ["", f"Next:  {command('add', folder, *names)}"]
    if found.kind == "unknown":
        return [
            "",
            f"Next:  {command('compare', folder)} , which shows where the residual is;  bristle "
            "effects new NAME  begins an effect of your own.",
        ]
    return ["", f"Next:  {command('report', folder)}"]
