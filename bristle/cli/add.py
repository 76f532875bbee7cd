"""Add an effect to a study's model, refit it, and show the error before and after."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from ..findings import command
from ..quantity import plain
from ._consent import add_trust

if TYPE_CHECKING:
    from ..study.learning import Added

HELP = (
    "add an effect to a study's model and refit it: error before and after, a step in the history"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle add`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument("effects", nargs="+", metavar="EFFECT", help="see `bristle list effects`")
    parser.add_argument("--why", default="", help="the reason, for the history")
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Add, refit, print."""
    from ..interrupt import keeps
    from ..study.learning import add_effects
    from ..study.study import Study

    study = Study(arguments.folder)
    added = add_effects(study, arguments.effects, why=arguments.why)
    keeps("The new step is kept in the study's history.")
    if arguments.json:
        print(json.dumps(added.as_dict(), indent=2, ensure_ascii=False))
    else:
        print(text(added, arguments.folder))
    return 0


def text(added: Added, folder: Path) -> str:
    """Return what adding did, as text."""
    from ..study.laws import law_command
    from .identify import error_lines

    found = added.identified
    after = found.after
    lines = [f"Step {added.step.number}: {added.step.what} ({added.step.why})", ""]
    lines += error_lines(found)
    lines.append("")
    for row in found.parameters():
        if row["name"].partition(".")[0] in added.effects:
            half = row["interval95"]
            interval = f"+- {plain(half, 2)}" if half is not None else row["how"]
            value = plain(row["value"], 5)
            lines.append(f"  {row['name']:28} {value:>12} {row['unit']:10} {interval}")
    if added.other_law:
        lines += [
            "", f"The verdict is about the law {added.other_law}; this model has "
            f"{found.model.law}. To take that law:  {law_command(folder, added.other_law)}",
        ]  # fmt: skip
    before = found.before.get("z_holdout")
    if before is not None and after["z_holdout"] >= before:
        lines += ["", "The error on runs not seen did not fall:  " + command("undo", folder)]
    return "\n".join([*lines, "", f"Next:  {command('diagnose', folder)}"])
