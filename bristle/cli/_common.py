"""The options that every command takes, and every action of a command that has several."""

from __future__ import annotations

import argparse


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add --quiet and --debug."""
    _add(parser, False)


def add_common_to_actions(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add them to the actions of a command: after an action they count as before it."""
    for action in commands.choices.values():
        _add(action, argparse.SUPPRESS)


def _add(parser: argparse.ArgumentParser, default: object) -> None:
    text = "print no progress"
    parser.add_argument("--quiet", action="store_true", default=default, help=text)
    text = "show the traceback of an error"
    parser.add_argument("--debug", action="store_true", default=default, help=text)
