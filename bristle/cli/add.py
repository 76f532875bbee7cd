"""Add an effect to a study's model, refit it, and show the error before and after."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..findings import command
from ._consent import add_trust

if TYPE_CHECKING:
    from ..study.learning import Added

HELP = "add an effect to a study's model: refit, error before and after, a step in the history"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle add`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument("effects", nargs="+", metavar="EFFECT", help="names; see bristle effects")
    parser.add_argument("--why", default="", help="the reason, for the history")
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Add, refit, print."""
    from ..study.learning import add_effects
    from ..study.study import Study

    study = Study(arguments.folder)
    added = add_effects(study, arguments.effects, why=arguments.why)
    if arguments.json:
        print(json.dumps(added.as_dict(), indent=2, ensure_ascii=False))
    else:
        print(text(added, arguments.folder))
    return 0


def text(added: Added, folder: Path) -> str:
    """Return what adding did, as text."""
    found = added.identified
    before, after = found.before, found.after
    lines = [f"Step {added.step.number}: {added.step.what} ({added.step.why})", ""]
    lines.append(f"  {'':24} {'before':>10} {'after':>10}")
    for key, name in (
        ("z_train", "z, training runs"),
        ("z_holdout", "z, held-out runs"),
        ("rms_train", "RMS [N], training"),
        ("rms_holdout", "RMS [N], held out"),
    ):
        if key in after:
            lines.append(f"  {name:24} {before[key]:>10.4g} {after[key]:>10.4g}")
    lines.append("")
    for row in found.parameters():
        if row["name"].partition(".")[0] in added.effects:
            half = row["interval95"]
            interval = f"+- {half:.2g}" if half is not None else row["how"]
            lines.append(f"  {row['name']:28} {row['value']:>12.5g} {row['unit']:10} {interval}")
    if "z_holdout" in after and after["z_holdout"] >= before["z_holdout"]:
        lines += ["", "The error on runs not seen did not fall:  " + command("undo", folder)]
    return "\n".join([*lines, "", f"Next:  {command('diagnose', folder)}"])
