"""Check scenario files without running them: every mistake at once, with its line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..findings import cut_short
from ._common import add_overrides
from ._consent import add_trust

if TYPE_CHECKING:
    from ..scenario.scenario import Finding

HELP = "check scenario files: every mistake at once, with its line"

_COLOURS = {"error": "31", "warning": "33", "note": "36"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle check`."""
    parser.add_argument(
        "files", nargs="*", metavar="FILE", help="scenario files, or names of stock scenarios"
    )
    add_overrides(parser)
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")
    parser.add_argument(
        "--schema", action="store_true", help="print the JSON schema of scenario files"
    )


def main(arguments: argparse.Namespace) -> int:
    """Print what is found; return 2 if there is an error, else 0."""
    from ..errors import ScenarioError

    if arguments.schema:
        from ..scenario.schema import schema_text

        print(schema_text(), end="")
        return 0
    if not arguments.files:
        raise ScenarioError("bristle check wants a FILE: a scenario, e.g. bristle check my.toml.")
    from ..scenario.scenario import check_scenario, parse_overrides

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
    import json

    answer = [
        {
            "file": file,
            "ok": all(finding.level != "error" for finding in findings),
            "findings": [finding._asdict() for finding in findings],
        }
        for file, findings in found.items()
    ]
    print(json.dumps({"files": answer}, indent=2))


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
    counted = ", ".join(f"{n} {level}{'s' * (n > 1)}" for level, n in counts.items() if n)
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
    line, level, text = finding
    word = f"\033[{_COLOURS[level]}m{level}\033[0m" if colour else level
    return f"{file}:{line}: {word}: {text}" if line else f"{file}: {word}: {text}"
