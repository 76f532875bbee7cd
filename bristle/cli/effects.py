"""List the physical effects that a damper or structure can have, or tell all of one."""

# `bristle effects new NAME`, which starts an effect of the user's own, takes a second argument
# beside NAME here.

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..physics.effect import Effect

HELP = "list the physical effects, or tell all of one"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle effects`."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="an effect; else all, briefly")
    parser.add_argument("--json", action="store_true", help="print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Print a table of the effects, or everything about one."""
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS

    if arguments.name:
        told: Any = tell(_find(arguments.name, EFFECTS))
    else:
        told = [tell(effect) for _, effect in sorted(EFFECTS.items())]
    if arguments.json:
        import json

        print(json.dumps(told, indent=2))
    elif arguments.name:
        _print_one(told)
    else:
        _print_table(told)
    return 0


def tell(effect: type[Effect]) -> dict[str, Any]:
    """Return what users are told of an effect: class data, first line and formula of its text."""
    first, _, rest = (effect.__doc__ or "").strip().partition("\n")
    return {
        "name": effect.name,
        "site": effect.site,
        "laws": list(effect.laws) if effect.site == "damper" else [],
        "about": first.strip(),
        "text": _dedented(rest),
        "expect": effect.expect,
        "source": effect.source,
        "passive": effect.passive,
        "zero_at_rest": effect.zero_at_rest,
        "excludes": list(effect.excludes),
        "states": dict(effect.states),
        "parameters": {
            name: {
                "value": parameter.value,
                "unit": parameter.unit,
                "bounds": list(parameter.bounds),
                "text": parameter.text,
            }
            for name, parameter in effect.parameters.items()
        },
    }


def _dedented(text: str) -> str:
    import textwrap

    return textwrap.dedent(text).strip("\n")


def _find(name: str, known: dict[str, type[Effect]]) -> type[Effect]:
    from difflib import get_close_matches

    from ..errors import PhysicsError

    if name in known:
        return known[name]
    near = get_close_matches(name, known, 1)
    hint = f' Did you mean "{near[0]}"?' if near else ""
    raise PhysicsError(f'no effect is named "{name}". There are: {", ".join(sorted(known))}.{hint}')


def _print_one(told: dict[str, Any]) -> None:
    joins = f", joins {' and '.join(told['laws'])}" if told["laws"] else ""
    print(f"{told['name']} ({told['site']}{joins}): {told['about']}\n")
    print(told["text"])
    print(f"\nWhen it is missing: {told['expect']}.\nSource: {told['source']}.\n")
    for name, about in told["parameters"].items():
        low, high = about["bounds"]
        value = f"{about['value']:g} {about['unit']}" if about["unit"] != "1" else about["value"]
        print(f"  {told['name']}.{name} = {value}  ({low:g} to {high:g}): {about['text']}")
    print(f'\nIn a scenario, among the parameters of a {told["site"]}:  "{told["name"]}.on" = true')


def _print_table(rows: list[dict[str, Any]]) -> None:
    """Print the effects; each in a block of lines in a pipe, in a table on a terminal."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(show_lines=True)
        for title in ("effect", "site, laws", "what it does", "when it is missing", "parameters"):
            table.add_column(title)
        for row in rows:
            where = "\n".join([row["site"], *row["laws"]])
            about = f"{row['about']}\n({row['source']})".replace("[", r"\[")
            table.add_row(row["name"], where, about, row["expect"], "\n".join(_shortly(row)))
        Console().print(table)
    else:
        for row in rows:
            where = ", ".join([row["site"], *row["laws"]])
            print(f"{row['name']} ({where}): {row['about']}")
            print(f"  when it is missing: {row['expect']}")
            print(f"  parameters: {', '.join(_shortly(row))}")
            print(f"  source: {row['source']}")
    print("All of one:  bristle effects NAME")


def _shortly(row: dict[str, Any]) -> list[str]:
    return [
        f"{name} = {about['value']:g}" + (f" {about['unit']}" if about["unit"] != "1" else "")
        for name, about in row["parameters"].items()
    ]
