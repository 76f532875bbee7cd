"""Add an effect to a study's model, refit it, and show the error before and after."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.text import command
from ..view.blocks import Next, Text, View
from ._options import add_json, add_study, add_trust, print_json

if TYPE_CHECKING:
    from ..study.steps import Added

HELP = (
    "add an effect to a study's model and refit it: error before and after, a step in the history"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle add`."""
    add_study(parser)
    parser.add_argument("effects", nargs="+", metavar="EFFECT", help="see `bristle list effects`")
    parser.add_argument("--why", default="", help="the reason, for the history")
    add_trust(parser)
    add_json(parser)


def main(arguments: argparse.Namespace) -> int:
    """Add, refit, print."""
    from ..core.interrupt import keeps
    from ..study.steps import add_effects
    from ..study.study import Study

    study = Study(arguments.folder)
    added = add_effects(study, arguments.effects, why=arguments.why)
    keeps("The new step is kept in the study's history.")
    if arguments.json:
        print_json(added.as_dict())
    else:
        print(text(added, arguments.folder))
    return 0


def text(added: Added, folder: Path) -> str:
    """Return what adding did, as text."""
    from ..study.fit_view import error_table, left_out, parameter_table, z_text
    from ..study.forms import law_command
    from ..view import terminal

    found, then = added.identified, [Next(command("diagnose", folder))]
    said = [*left_out(found), Text(z_text(found))]
    if added.other_law:
        told = f"The verdict is about the law {added.other_law}; this model has {found.model.law}."
        said.append(Text(told))
        then.append(Next(law_command(folder, added.other_law), "takes that law"))
    before = found.before.get("z_holdout")
    if before is not None and found.after["z_holdout"] >= before:
        said.append(Text("The error on runs not seen did not fall."))
        then.insert(0, Next(command("undo", folder)))
    title = f"Step {added.step.number}: {added.step.what} ({added.step.why})"
    tables = (error_table(found), parameter_table(found, added.effects))
    return terminal.text(View(title, (*tables, *said, *then)))
