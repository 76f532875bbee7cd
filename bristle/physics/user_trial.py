"""Runs users' files in a child process first, under a limit of time and memory.

What the text of a file does not show, such as a power that takes a year, would hang whoever reads
it. So a file that is new here runs in a child before it runs in this process.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from .user_text import FlawError

SECONDS = 20.0
"""Time [s] within which a file has to define its class and its hooks to pass their trial."""

BYTES = 4 << 30
"""Memory that the child may ask for, where the system can limit it."""

_MOST_RESTARTS = 20


def tried(orders: list[dict[str, str]]) -> list[FlawError | None]:
    """Return what is wrong with each file, None where nothing is.

    Parameters
    ----------
    orders : list of dict
        Of each file what the child needs: "path", "shown", "word" and "text".
    """
    found: list[FlawError | None] = []
    for _ in range(_MOST_RESTARTS):
        if len(found) == len(orders):
            return found
        found += _answers(orders[len(found) :])
    return found + [FlawError("it cannot be tried: too many files before it fail.")] * (
        len(orders) - len(found)
    )


def _answers(orders: list[dict[str, str]]) -> list[FlawError | None]:
    """Return what a child says of the files, as far as it came: at least of one."""
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
    child = subprocess.run(
        [sys.executable, "-c", f"from {__package__}.user import serve; serve()"],
        input=json.dumps(orders), env={**os.environ, "PYTHONPATH": path}, capture_output=True,
        text=True, check=False, timeout=(SECONDS + 10.0) * len(orders) + 60.0,
    )  # fmt: skip
    rows = [json.loads(row) for row in child.stdout.splitlines() if row.startswith("{")]
    found = [FlawError(row["error"], row["line"]) if row["error"] else None for row in rows]
    if len(found) < len(orders):  # the child ended at the next one
        found.append(_ended(child, orders[len(found)]["path"]))
    return found


def _ended(child: subprocess.CompletedProcess[str], path: str) -> FlawError:
    """Return why the child ended at a file, and the line where it was."""
    lines = re.findall(rf'File "{re.escape(path)}", line (\d+)', child.stderr)
    line = int(lines[0]) if lines else 0
    if "Timeout" in child.stderr:
        return FlawError(
            f"it does not end within {SECONDS:g} s. A hook is called some hundred thousand times "
            "in a simulation: arithmetic that takes microseconds is right.",
            line,
        )
    told = child.stderr.strip().splitlines()
    last = told[-1] if told else f"status {child.returncode}"
    return FlawError(f"it ends the process that tries it: {last}.", line)


def serve(run: Callable[[dict[str, Any]], None]) -> None:
    """Try the files that stand on the standard input; the child's end of `tried`.

    Parameters
    ----------
    run : callable
        Takes an order and raises FlawError if its file is not right.
    """
    with suppress(ImportError, ValueError, OSError):  # not every system can limit memory
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    for order in json.load(sys.stdin):
        faulthandler.dump_traceback_later(SECONDS, exit=True)
        answer: dict[str, Any] = {"error": "", "line": 0}
        try:
            run(order)
        except FlawError as flaw:
            answer = {"error": str(flaw), "line": flaw.line}
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps(answer), flush=True)
