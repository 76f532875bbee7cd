"""Find the effects that a study's model misses, with confidence and alternatives."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from ..findings import command
from ._consent import add_trust
from ._table import aligned

if TYPE_CHECKING:
    from ..diagnose.verdict_text import Verdict

HELP = "find the effects that a study's model misses, with confidence and alternatives"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle diagnose`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--law",
        help="all: search for the law together with its missing effects (default on a test bench "
        "if no law was chosen); the model's law: keep it",
    )
    parser.add_argument(
        "--limits", action="store_true",
        help="refit the model at the limit of every effect: exact also if the model is far from "
        "linear",
    )  # fmt: skip
    parser.add_argument(
        "--dry-run", action="store_true", help="show the verdict; do not change verdict.json"
    )
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print verdict.json")


def main(arguments: argparse.Namespace) -> int:
    """Diagnose, write verdict.json and the picture, print the verdict with its evidence."""
    from ..draw.style import png
    from ..interrupt import keeps
    from ..progress import tell
    from ..study.learning import diagnose_study, verdict_of
    from ..study.study import Study

    study = Study(arguments.folder)
    found = diagnose_study(
        study, law=arguments.law, profile=arguments.limits, write=not arguments.dry_run
    )
    verdict = verdict_of(study, found)
    picture = None
    if not arguments.dry_run:
        keeps("The verdict is kept in verdict.json; its picture was not drawn.")
        tell("drawing")
        picture = study.write_report("diagnose.png", png(found.plot()))
    if arguments.json:
        print(json.dumps(verdict, indent=2, ensure_ascii=False))
    else:
        print(text(verdict, arguments.folder))
        if picture:
            print(f"Picture: {picture}")
    return 0


SHORT = "  (short search: it gains too little, like all others)"


def text(verdict: Verdict, folder: Path) -> str:
    """Return the content of verdict.json as text, with the next command for a study's folder."""
    from ..diagnose.verdict_text import (
        FAULTS,
        about,
        drive_of,
        fault_rows,
        sentences,
        separating,
        untestable,
    )

    first, *others = sentences(verdict)
    lines = [first, *(["", " ".join(others)] if others else [])]
    for name in verdict["effects"]:
        lines += ["", f"  {about(name, drive_of(verdict))}"]
    if faults := fault_rows(verdict):
        lines += ["", *aligned([list(FAULTS), *faults], 4)]
    for note in verdict.get("notes", ()):
        lines += ["", f"Note: {note.rstrip('.')}."]
    if verdict.get("laws"):
        lines += ["", *law_lines(verdict["laws"])]
    lines += _error(verdict)
    lines += _trials(verdict)
    lines += _limits(verdict)
    if hidden := untestable(verdict):
        lines += ["", f"Not testable with these runs: {', '.join(hidden)}."]
    if separating(verdict):
        lines += ["", f"To distinguish them: {separating(verdict)}"]
    return "\n".join([*lines, "", f"Next:  {_next(verdict, folder)}"])


def law_lines(rows: Sequence[Verdict]) -> list[str]:
    """Return the table of laws as text, from its rows as verdict.json has them."""
    from ..diagnose.law_text import HEADER, TABLE_NOTE, law_table

    lines = aligned([list(HEADER), *law_table(rows)])
    return [*lines, *wrap(TABLE_NOTE, 98, initial_indent="  ", subsequent_indent="  ")]


def _error(verdict: Verdict) -> list[str]:
    """Return the error of the model as the study has it, which every command prints alike."""
    from ..identify.error import ForceError

    told = verdict.get("error") or {}
    names = {"train": "training runs", "holdout": "held-out runs"}
    role = "holdout" if "holdout" in told else "train"
    if role not in told:
        return []
    error = ForceError.of(told[role])
    sites = (verdict.get("error_by_site") or {}).get(role, {})
    by_site = [f"{site} {ForceError.of(one).text()}" for site, one in sites.items()]
    more = f"; {', '.join(by_site)}" if len(by_site) > 1 else ""
    first = f"The study's model errs by {error.text()} on the {names[role]}{more}."
    return ["", " ".join([first, *error.beside()])]


def _trials(verdict: Verdict) -> list[str]:
    """Return the table of the effects tried at the site whose model errs the most."""
    # A site whose noise is not known has no z: what effects gain there is told first.
    blind = (found for found in verdict["findings"] if found["z_holdout_before"] is None)
    at = next(blind, None) or max(
        verdict["findings"], key=lambda found: found["z_holdout_before"], default=None
    )
    rows = [row for row in verdict["ranking"] if at is not None and row["site"] == at["site"]]
    if at is None or not rows or "z_train_before" not in at:
        return []
    if at["z_holdout_before"] is None:
        return _gains(rows)
    lines = ["", f"  {'error / noise (z) of the model':34} {'training':>12} {'held out':>12}"]
    before = at["z_train_before"], at["z_holdout_before"]
    model = f"{verdict['law']} alone" if verdict.get("laws") else "present model"
    lines.append(f"  {model:34} {before[0]:>12.3f} {before[1]:>12.3f}")
    refined = [row for row in rows[:5] if row["refined"]]
    # The order of equals is that of a rounding: one stands for all of them.
    others = sorted(
        (row for row in rows if not row["refined"]),
        key=lambda row: (round(row["z_holdout"], 2), row["effect"]),
    )
    for row in [*refined, *others[:1]]:
        note = "" if row["refined"] else SHORT
        z = row["z_train"], row["z_holdout"]
        lines.append(f"  {'with ' + row['effect']:34} {z[0]:>12.3f} {z[1]:>12.3f}{note}")
    return [*lines, "  A true model has z = 1: its only error is the noise."]


def _gains(rows: Sequence[Verdict]) -> list[str]:
    """Return the table of the effects that lower the error, where no z is known."""
    able = sorted((row for row in rows if row["gain"] > 0.0), key=lambda row: -row["gain"])[:5]
    lines = ["", f"  {'error of the force, held out':34} {'lower by':>12}"] if able else []
    for row in able:
        lines.append(f"  {'with ' + row['effect']:34} {100.0 * row['gain']:>10.1f} %")
    return lines


def _limits(verdict: Verdict) -> list[str]:
    """Return the table of what the runs still allow of each effect."""
    from ..diagnose.verdict_text import LIMITS, LIMITS_NOTES, limit_rows

    rows = limit_rows(verdict)
    if not rows:
        return []
    notes = (f"  {note}" for note in LIMITS_NOTES)
    return ["", *aligned([list(LIMITS), *rows]), *notes]


def _next(verdict: Verdict, folder: Path) -> str:
    """Return the command that follows from a verdict: what sets the data right comes first."""
    from ..diagnose.correctable import is_correctable

    if not any(map(is_correctable, verdict.get("sensors") or [])):
        return _with_law(verdict, folder)
    correct = command("study", "check", folder, "--correct")
    then = command("diagnose", folder)
    if verdict["kind"] != "insufficient":
        then = _with_law(verdict, folder)
    return f"{correct} , which corrects the runs that are named, then:  {then}"


def _with_law(verdict: Verdict, folder: Path) -> str:
    """Return the command for the model; two where the verdict asks for another law."""
    if not verdict.get("laws") or verdict["kind"] == "insufficient":
        return _then(verdict, folder)
    from ..physics.forms import joined_form
    from ..study.laws import law_command

    law = joined_form(verdict["law"], verdict["command"])
    if law == verdict["law_before"]:
        return _then(verdict, folder)
    return f"{law_command(folder, law)} , then:  {_then(verdict, folder)}"


def _then(verdict: Verdict, folder: Path) -> str:
    if verdict["kind"] == "ambiguous":
        return (
            f"{command('plan', folder)} , which writes a test that distinguishes them;  "
            f"{command('add', folder, verdict['effects'][0])} , which takes the first."
        )
    if verdict["kind"] == "effect":
        return command("add", folder, *verdict["effects"])
    if verdict["kind"] == "unknown":
        return (
            f"{_other_laws(verdict, folder)}"
            f"{command('learn', folder)} , which learns what is missing;  "
            f"{_gaining(verdict, folder)}"
            f"{command('compare', folder)} , which shows where the residual is;  "
            "bristle new effect NAME  starts your own effect."
        )
    if verdict["kind"] == "insufficient":
        return (
            f"set right in {folder / 'study.toml'} what the text names, or measure it again,  then "
            f"{command('diagnose', folder)}"
        )
    hidden = _not_excited(verdict)
    if verdict["kind"] == "none" and hidden:
        return (
            f"{command('plan', folder, '--see', *hidden)} , which writes tests that show what "
            f"these cannot;  {command('report', folder)}"
        )
    return command("report", folder)


def _not_excited(verdict: Verdict) -> list[str]:
    """Return the effects that these runs cannot show, and others may.

    What a parameter of another effect absorbs is that effect.
    """
    from ..diagnose.effect_limits import NO_AMOUNT

    rows = [row for found in verdict["findings"] for row in found.get("limits", ())]
    hidden = [row for row in rows if row.get("why") and "." not in row["why"].partition(" ")[0]]
    return sorted({row["effect"] for row in hidden if row["why"] != NO_AMOUNT})


def _other_laws(verdict: Verdict, folder: Path) -> str:
    """Return the command that seeks the law as well; "" where no other law leaves less."""
    if not any(found.get("other_law") for found in verdict["findings"]):
        return ""
    return (
        f"{command('diagnose', folder, '--law', 'all')} , which seeks the law with its effects;  "
    )


def _gaining(verdict: Verdict, folder: Path) -> str:
    """Return the command that adds what gains most where nothing explains the error; "" if none."""
    gains = verdict.get("gains") or []
    if not gains:
        return ""
    best = max(gains, key=lambda row: row["gain"])
    return (
        f"{command('add', folder, *best['effects'])} , which lowers the error by "
        f"{100.0 * best['gain']:.0f} %;  {command('study', 'auto', folder, '--greedy')} , "
        "which adds effects as long as one gains;  "
    )
