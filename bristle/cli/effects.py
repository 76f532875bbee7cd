"""List the physical effects that a damper, structure or sensor can have, or describe one.

bristle effects new NAME starts your own effect; bristle effects check FILE tests it.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from . import _own

if TYPE_CHECKING:
    from ..physics.effect import Effect

HELP = "list the physical effects, describe one, start or check your own"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle effects`."""
    _own.add_arguments(parser, "effect")


def main(arguments: argparse.Namespace) -> int:
    """Print a table of the effects, everything about one, or start or check a user's own."""
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS
    from ..physics.law import LAWS
    from ._effect_template import template

    own = _own.Own("effect", lambda: EFFECTS, (*EFFECTS, *LAWS), template)
    return _own.main(arguments, own, tell, _print_one, _print_table)


def tell(effect: type[Effect]) -> dict[str, Any]:
    """Return what users are told of an effect: class data, first line and formula of its text."""
    from ..physics.effect import laws_joined

    about, text = _own.text_of(effect)
    return {
        "name": effect.name,
        "site": effect.site,
        "sites": list(effect.sites),
        "laws": list(laws_joined(effect)),
        "about": about,
        "text": text,
        "expect": effect.expect,
        "source": effect.source,
        "passive": effect.passive,
        "zero_at_rest": effect.zero_at_rest,
        "excludes": list(effect.excludes),
        "states": dict(effect.states),
        "parameters": _own.parameters_of(effect),
    }


def _print_one(found: dict[str, Any]) -> None:
    joins = f", joins {', '.join(found['laws'])}" if found["laws"] else ""
    print(f"{found['name']} ({', '.join(found['sites'])}{joins}): {found['about']}\n")
    print(found["text"])
    print(f"\nWhen it is missing: {found['expect']}.\nSource: {found['source']}.\n")
    print("\n".join(_own.parameter_lines(found, f"{found['name']}.")))
    if found["site"] == "sensor":
        print("\nUsed in a model that is compared with measurements; never inside a damper.")
    else:
        places = " or a ".join(found["sites"])
        print(f'\nIn a scenario, among the parameters of a {places}:  "{found["name"]}.on" = true')
    if len(found["sites"]) > 1:
        first, *others = found["sites"]
        named = " or ".join(f"{found['name']}@{site}" for site in others)
        print(f"In a building's model the name alone is that of the {first}; else {named}.")


def _print_table(rows: list[dict[str, Any]]) -> None:
    """Print the effects; each in a block of lines in a pipe, in a table on a terminal."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(show_lines=True)
        for title in ("effect", "site, laws", "what it does", "when it is missing", "parameters"):
            table.add_column(title)
        for row in rows:
            where = "\n".join([*row["sites"], *row["laws"]])
            about = f"{row['about']}\n({row['source']})".replace("[", r"\[")
            table.add_row(row["name"], where, about, row["expect"], "\n".join(_own.shortly(row)))
        Console().print(table)
    else:
        for row in rows:
            where = ", ".join([*row["sites"], *row["laws"]])
            print(f"{row['name']} ({where}): {row['about']}")
            print(f"  when it is missing: {row['expect']}")
            print(f"  parameters: {', '.join(_own.shortly(row))}")
            print(f"  source: {row['source']}")
    print("All of one:  bristle effects NAME")
