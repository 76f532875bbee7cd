"""Asks on a terminal whether code that came with a file may run; shows it first."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..errors import TrustError


def add_trust(parser: argparse.ArgumentParser) -> None:
    """Add --trust to a command that may run effects of somebody's own."""
    text = (
        "consent to run effects and laws that came with a study or scenario; bristle remembers it"
    )
    parser.add_argument("--trust", action="store_true", help=text)


def given(error: TrustError) -> bool:
    """Return whether the user consents to a text that is shown, and remember that.

    Nobody is asked where the input or the messages are no terminal.
    """
    if not error.text or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    from ..progress import tell
    from ..trust import readable, remember

    tell("")  # the question stands on the terminal until it is answered
    print(f"{error.path} has not run on this machine before:\n", file=sys.stderr)
    for line in readable(error.text).splitlines():
        print(f"    {line}", file=sys.stderr)
    print("\nIt runs with your rights. Run it, and remember that? [y/N] ", end="", file=sys.stderr)
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        return False
    remember(Path(error.path), error.text)
    return True
