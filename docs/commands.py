"""The page of all commands, made from their parsers."""

from __future__ import annotations

import argparse

from tables import table as _table

from bristle.cli import build_parser

EVERYWHERE = {
    "--quiet": "no progress messages",
    "--debug": "the traceback of an error",
}
"""Options of every command, listed once."""

PROGRESS = (
    "On a terminal a command shows its progress on stderr, with the remaining time once it can be "
    "estimated; in a pipe it prints a plain line now and then. The first run on a machine compiles "
    "the laws, and reports this. `--quiet` suppresses all of it; stdout contains only the answer. "
    "Ctrl-C ends a command with one line that states what is kept and how to continue: every file "
    "is complete or absent; an ensemble and `bristle study auto` continue where they stopped."
)
"""The progress that every command shows."""


def command_page() -> str:
    """Return the page of all commands, from their parsers."""
    parser = build_parser()
    about = (parser.epilog or "").strip()
    every = " and ".join(
        f"`{option}` ({text})" for option, text in EVERYWHERE.items() if option in _options(parser)
    )
    parts = [
        "# Commands",
        f"`bristle COMMAND --help` prints the same. Every command also takes {every}.",
        about,
        PROGRESS,
    ]
    rows = [
        [f"[`bristle {name}`](#bristle-{name})", _cell(help_of)]
        for name, help_of, _ in _commands(parser)
    ]
    parts.append(_table(["command", "what it does"], rows))
    for name, _, command in _commands(parser):
        parts += [f"## bristle {name}", _prose(command.description)]
        parts += _usage(f"bristle {name}", command)
    return "\n\n".join(part for part in parts if part) + "\n"


def _options(parser: argparse.ArgumentParser) -> set[str]:
    """Return the options that the commands below a parser take."""
    return {
        option
        for *_, command in _commands(parser)
        for action in command._actions
        for option in action.option_strings
    }


def _commands(
    parser: argparse.ArgumentParser,
) -> list[tuple[str, str, argparse.ArgumentParser]]:
    """Return name, help and parser of the commands below a parser."""
    found = [
        (name, next((h.help or "" for h in action._choices_actions if h.dest == name), ""), command)
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, command in action.choices.items()
    ]
    return [one for one in found if one[1] not in ("", argparse.SUPPRESS)]  # old names have none


def _usage(name: str, command: argparse.ArgumentParser) -> list[str]:
    """Return the arguments of a command, or those of the commands below it."""
    below = _commands(command)
    if below:
        parts = []
        for action, text, inner in below:
            parts += [f"### {name} {action}", _prose(text), *_usage(f"{name} {action}", inner)]
        return parts
    own = [one for one in command._actions if one.help != argparse.SUPPRESS]
    own = [one for one in own if not {"--help", *EVERYWHERE} & set(one.option_strings)]
    own.sort(key=lambda one: bool(one.option_strings))
    line = " ".join([name, *(_argument(one) for one in own if not one.option_strings)])
    if any(one.option_strings for one in own):
        line += " [OPTIONS]"
    expand = command._get_formatter()._expand_help
    rows = [[f"`{_argument(one)}`", _cell(expand(one) if one.help else "")] for one in own]
    return [f"    {line}", _table(["argument", "meaning"], rows) if rows else ""]


def _argument(action: argparse.Action) -> str:
    """Return how an argument is written."""
    if not action.option_strings and not action.choices:
        return str(action.metavar or action.dest)
    value = action.metavar or ("|".join(map(str, action.choices)) if action.choices else None)
    if not action.option_strings:
        return str(value)
    takes = "" if action.nargs == 0 else f" {value or action.dest.upper()}"
    return f"{action.option_strings[-1]}{takes}"


def _prose(text: str | None) -> str:
    """Return the first paragraph of a text as a sentence."""
    first = " ".join((text or "").strip().split("\n\n")[0].split())
    return f"{first[:1].upper()}{first[1:]}{'' if first.endswith('.') else '.'}" if first else ""


def _cell(text: str) -> str:
    """Return a help text for a cell of a table."""
    return " ".join(text.split()).replace("<", "&lt;")
