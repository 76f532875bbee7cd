"""Check scenarios, and effects and laws of your own, without running them.

Of a scenario every mistake is printed at once, with its line. The hooks of your own effect or law
are called some hundred thousand times: are they pure, finite, passive where they say so?
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import cut_short, plural
from ._options import Parser, print_json

if TYPE_CHECKING:
    from ..core.finding import Finding

HELP = "check scenario files, or your own effects and laws: every mistake, with its line"

WITHIN = 300.0
"""Time [s] that a check of an effect or law may take."""

_COLOURS = {"error": "31", "warning": "33", "note": "36"}


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle check`."""
    text = "scenario files, names of stock scenarios, or the file of your own effect or law"
    parser.add_argument("files", nargs="*", metavar="FILE", help=text)
    parser.add_overrides()
    parser.add_trust()
    parser.add_json("print the findings as JSON")
    parser.flag("--schema", "print the JSON schema of scenario files")


def main(arguments: argparse.Namespace) -> int:
    """Print what is found; return 2 if there is an error, else 0."""
    from ..errors import ScenarioError

    if arguments.schema:
        from ..system.schema import schema_text

        print(schema_text(), end="")
        return 0
    if not arguments.files:
        raise ScenarioError("bristle check: expected a FILE, e.g. bristle check my.toml.")
    if any(file.endswith(".py") for file in arguments.files):
        if len(arguments.files) > 1 or arguments.overrides:
            raise ScenarioError("bristle check: expected one effect or law, without --set.")
        return _own(Path(arguments.files[0]), arguments.json)
    from ..system.overrides import parse_overrides
    from ..system.scenario import check_scenario

    overrides = parse_overrides(arguments.overrides)
    found = {file: check_scenario(file, overrides) for file in arguments.files}
    if arguments.json:
        _print_json(found)
    else:
        for file, findings in found.items():
            print_findings(file, findings)
    wrong = any(finding.level == "error" for findings in found.values() for finding in findings)
    return 2 if wrong else 0


def _print_json(found: dict[str, list[Finding]]) -> None:
    answer = [
        {
            "file": file,
            "ok": all(finding.level != "error" for finding in findings),
            "findings": [finding.as_dict("line", "level", "text") for finding in findings],
        }
        for file, findings in found.items()
    ]
    print_json({"files": answer})


def print_findings(file: str, findings: list[Finding], around: Sequence[str] = ()) -> None:
    """Print one line per finding, `FILE:LINE: level: text`, which editors make clickable.

    Of many the errors come first, as many as a message holds, with a count of the rest.

    Parameters
    ----------
    file : its name
    findings : in the order of their lines
    around : lines that the command prints about it besides, which take their room
    """
    colour = sys.stdout.isatty()
    counts = {level: sum(finding.level == level for finding in findings) for level in _COLOURS}
    counted = ", ".join(plural(n, level) for level, n in counts.items() if n)
    last = f"{file}: {counted}"
    if not counts["error"]:
        last = f"{file}: ok{', ' + counted if counted else ''}"
    lines = [_line(file, finding, colour=colour) for finding in findings]
    text, others = "\n".join(lines), [*around, last]
    if cut_short(text, others) != text:
        first = sorted(range(len(lines)), key=lambda k: list(_COLOURS).index(findings[k].level))
        text = cut_short("\n".join(lines[k] for k in first), others, "--json")
    if lines:
        print(text)
    print(last)


def _line(file: str, finding: Finding, *, colour: bool) -> str:
    level = finding.level
    word = f"\033[{_COLOURS[level]}m{level}\033[0m" if colour else level
    place = f"{file}:{finding.line}" if finding.line else file
    return f"{place}: {word}: {finding.text}"


def _own(file: Path, as_json: bool) -> int:
    """Ask of an effect or law what is asked of the library's; 2 where something does not hold.

    Of a file that `bristle new` made here, checking it is consent to what it holds now.
    """
    from ..core.progress import tell
    from ..errors import PhysicsError
    from ..trust import is_made_here
    from ..user_code.load import load_file

    word = _word(file)
    made = load_file(file, word, trust=is_made_here(file))  # refuses with file and line
    tell(f"checking {file.name}: its hooks are called some hundred thousand times, and compiled")
    program = [sys.executable, "-m", "bristle.user_code.conformance", word, str(file)]
    try:
        child = subprocess.run(program, capture_output=True, text=True, check=False, timeout=WITHIN)
    except subprocess.TimeoutExpired:
        raise PhysicsError(
            f"{file}: the check does not end within {WITHIN:g} s. A hook is called some hundred "
            "thousand times: arithmetic that takes microseconds is right."
        ) from None
    if child.returncode != 0:
        told = child.stderr.strip().splitlines()
        raise PhysicsError(f"{file}: the check fails: {told[-1] if told else child.returncode}")
    checks: list[dict[str, Any]] = json.loads(child.stdout)
    good = all(one["holds"] for one in checks)
    if as_json:
        print_json({word: made.name, "conforms": good, "checks": checks})
        return 0 if good else 2
    for one in checks:
        found = f": {one['found']}" if one["found"] else ""
        print(f"{'ok  ' if one['holds'] else 'FAIL'}  {one['asked']}{found}")
    print(f"{file}: {made.name} {'conforms' if good else 'does not conform'}.")
    return 0 if good else 2


def _word(file: Path) -> str:
    """Return what a file defines, "effect" or "law", by the class that its class extends."""
    from ..core.files import reading
    from ..errors import PhysicsError
    from ..user_code.reading import text_of

    with reading(file, PhysicsError):
        bases = re.findall(r"^class \w+\((\w+)", text_of(file, errors="replace"), re.MULTILINE)
    if "OwnController" in bases:
        raise PhysicsError(f"{file}: a controller is checked where it is built: bristle build FILE")
    return "law" if "Law" in bases else "effect"
