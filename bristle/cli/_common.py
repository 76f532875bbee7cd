"""Options that every command takes, or every action of a command, or several commands."""

from __future__ import annotations

import argparse
import json
from typing import Any


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add --quiet and --debug."""
    _add(parser, False)


def add_common_to_actions(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add them to the actions of a command: after an action they count as before it."""
    for action in commands.choices.values():
        _add(action, argparse.SUPPRESS)


def add_overrides(
    parser: argparse.ArgumentParser, of: str = "file", example: str = "damper.f_c=2"
) -> None:
    """Add --set to a command that loads a scenario; `of` is what the values are else taken from."""
    parser.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"use this value instead of the {of}'s, e.g. --set {example}",
    )


def add_details(parser: argparse.ArgumentParser) -> None:
    """Add --details to a command whose answer has some."""
    parser.add_argument(
        "--details", action="store_true", help="print the evidence below the answer: all tables"
    )


def _add(parser: argparse.ArgumentParser, default: object) -> None:
    text = "print no progress"
    parser.add_argument("--quiet", action="store_true", default=default, help=text)
    text = "show the traceback of an error"
    parser.add_argument("--debug", action="store_true", default=default, help=text)


def print_json(answer: dict[str, Any]) -> None:
    """Print an answer as JSON has it: what is not finite is null."""
    print(json.dumps(_finite(answer), indent=2, ensure_ascii=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value
