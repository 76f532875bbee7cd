"""Find the effects that a study's model misses, with confidence and alternatives."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.text import command
from ..view.blocks import Next
from ._options import add_details, add_json, add_study, add_trust, print_json

if TYPE_CHECKING:
    from ..diagnosis.words import Verdict

HELP = "find the effects that a study's model misses, with confidence and alternatives"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle diagnose`."""
    add_study(parser)
    parser.add_argument(
        "--law",
        help="all: search for the law together with its missing effects (default on a test bench "
        "if no law was chosen); the model's law: keep it",
    )
    text = (
        "refit the model at the limit of every effect: exact also if the model is far from linear"
    )
    parser.add_argument("--limits", action="store_true", help=text)
    text = "show the verdict; do not change verdict.json"
    parser.add_argument("--dry-run", action="store_true", help=text)
    add_trust(parser)
    add_details(parser)
    add_json(parser, "print verdict.json")


def main(arguments: argparse.Namespace) -> int:
    """Diagnose, write verdict.json and the picture, print the verdict with its evidence."""
    from ..core.interrupt import keeps
    from ..core.progress import tell
    from ..diagnosis.view import draw_verdict
    from ..study.steps import diagnose_study, verdict_of
    from ..study.study import Study
    from ..view.style import png

    study = Study(arguments.folder)
    found = diagnose_study(
        study, law=arguments.law, profile=arguments.limits, write=not arguments.dry_run
    )
    verdict = verdict_of(study, found)
    picture = None
    if not arguments.dry_run:
        keeps("The verdict is kept in verdict.json; its picture was not drawn.")
        tell("drawing")
        picture = study.write_report("diagnose.png", png(draw_verdict(verdict)))
    if arguments.json:
        print_json(verdict)
    else:
        print(text(verdict, arguments.folder, details=arguments.details))
        if picture:
            print(f"Picture: {picture}")
    return 0


def text(verdict: Verdict, folder: Path, *, details: bool = False) -> str:
    """Return the content of verdict.json as text, with the next command for a study's folder."""
    from ..diagnosis.view import verdict_view
    from ..view import terminal

    view = verdict_view(verdict)
    view = view._replace(blocks=(*view.blocks, *_next(verdict, folder)))
    return terminal.text(view, details=details, elsewhere=command("report", folder))


def _next(verdict: Verdict, folder: Path) -> list[Next]:
    """Return the commands that follow from a verdict: what sets the data right comes first."""
    from ..diagnosis.conclusion import is_correctable

    then = _with_law(verdict, folder)
    if not any(map(is_correctable, verdict.get("sensors") or [])):
        return then
    if verdict["kind"] == "insufficient":
        then = [Next(command("diagnose", folder))]
    correct = command("study", "check", folder, "--correct")
    return [Next(correct, "corrects the runs that are named"), *then]


def _with_law(verdict: Verdict, folder: Path) -> list[Next]:
    """Return the commands for the model; first another law where the verdict asks for it."""
    then = _then(verdict, folder)
    if not verdict.get("laws") or verdict["kind"] == "insufficient":
        return then
    from ..physics.forms import joined_form
    from ..study.forms import law_command

    law = joined_form(verdict["law"], verdict["command"])
    return then if law == verdict["law_before"] else [Next(law_command(folder, law)), *then]


def _then(verdict: Verdict, folder: Path) -> list[Next]:
    kind, report = verdict["kind"], Next(command("report", folder))
    if kind == "ambiguous":
        return [
            Next(command("plan", folder), "writes a test that distinguishes them"),
            Next(command("add", folder, verdict["effects"][0]), "takes the first"),
        ]
    if kind == "effect":
        return [Next(command("add", folder, *verdict["effects"]))]
    if kind == "unknown":
        other_law = any(found.get("other_law") for found in verdict["findings"])
        every = command("diagnose", folder, "--law", "all")
        return [
            *([Next(every, "seeks the law with its effects")] if other_law else []),
            Next(command("learn", folder), "learns what is missing"),
            *_gaining(verdict, folder),
            Next(command("compare", folder), "shows where the residual is"),
            Next("bristle new effect NAME", "starts your own effect"),
        ]
    if kind == "insufficient":
        right = f"after {folder / 'study.toml'} is set right where the text says so, or new runs"
        return [Next(command("diagnose", folder), right)]
    hidden = _not_excited(verdict)
    if kind == "none" and hidden:
        plan = command("plan", folder, "--see", *hidden)
        return [Next(plan, "writes tests that show what these cannot"), report]
    return [report]


def _not_excited(verdict: Verdict) -> list[str]:
    """Return the effects that these runs cannot show, and others may.

    What a parameter of another effect absorbs is that effect.
    """
    from ..diagnosis.effect_limits import NO_AMOUNT

    rows = [row for found in verdict["findings"] for row in found.get("limits", ())]
    hidden = [row for row in rows if row.get("why") and "." not in row["why"].partition(" ")[0]]
    return sorted({row["effect"] for row in hidden if row["why"] != NO_AMOUNT})


def _gaining(verdict: Verdict, folder: Path) -> list[Next]:
    """Return the commands that add what gains most where nothing explains the error, if any."""
    gains = verdict.get("gains") or []
    if not gains:
        return []
    best = max(gains, key=lambda row: row["gain"])
    greedy = command("study", "auto", folder, "--greedy")
    return [
        Next(command("add", folder, *best["effects"]), f"error {100.0 * best['gain']:.0f} % lower"),
        Next(greedy, "adds effects as long as one gains"),
    ]
