"""List the physical effects that a damper, structure or sensor can have, or tell all of one.

bristle effects new NAME starts an effect of your own; bristle effects check FILE tests it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._consent import add_trust

if TYPE_CHECKING:
    from ..physics.effect import Effect

HELP = "list the physical effects, tell all of one, start or check one of your own"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle effects`."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    text = "an effect; else all, briefly; or one of the words new, check"
    parser.add_argument("name", nargs="?", metavar="NAME", help=text)
    text = "with new: the name of your effect; with check: its file"
    parser.add_argument("target", nargs="?", metavar="NAME_OR_FILE", help=text)
    text = "a study whose own effects count too; with new: the study that the file is for"
    parser.add_argument("--study", type=Path, metavar="FOLDER", help=text)
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Print a table of the effects, everything about one, or start or check a user's own."""
    from ..errors import PhysicsError
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS

    if arguments.name in ("new", "check"):
        if not arguments.target:
            what = "NAME" if arguments.name == "new" else "FILE.py"
            raise PhysicsError(f"bristle effects {arguments.name} {what} is right.")
        return (_new if arguments.name == "new" else _check)(arguments)
    if arguments.target:
        raise PhysicsError(f'"{arguments.name} {arguments.target}": one name, or new, check.')
    left_out = _read_own(arguments.study)
    if arguments.name in left_out:
        _refuse_untrusted(arguments.study / "effects" / f"{arguments.name}.py")
    if arguments.name:
        found: Any = tell(_find(arguments.name, EFFECTS, left_out))
    else:
        found = [tell(effect) for _, effect in sorted(EFFECTS.items())]
    if arguments.json:
        import json

        print(json.dumps(found, indent=2))
    elif arguments.name:
        _print_one(found)
    else:
        _print_table(found)
    for text in left_out.values():
        print(f"left out: {text}", file=sys.stderr)
    return 0


def _read_own(study: Path | None) -> dict[str, str]:
    """Register the effects of a study; return those that are left out, and why."""
    if study is None:
        return {}
    from ..errors import PhysicsError
    from ..trust import load_effects

    if not study.is_dir():
        raise PhysicsError(f"--study {study}: there is no such folder.")
    return {one.name: one.error for one in load_effects(study / "effects") if one.error}


def _refuse_untrusted(file: Path) -> None:
    """Raise where the effect that is asked for waits for consent."""
    from ..physics.user import waiting

    if untrusted := waiting(file):
        raise untrusted


def _new(arguments: argparse.Namespace) -> int:
    """Write the file of a new effect, which works as it is."""
    from ..errors import PhysicsError
    from ..findings import command
    from ..physics.effect import EFFECTS
    from ..trust import remember_made
    from ._effect_template import template

    name = arguments.target
    if not name.isidentifier() or not name.isascii() or name != name.lower():
        raise PhysicsError(f'"{name}": a name of small letters, digits and _ is right.')
    if name in EFFECTS:
        raise PhysicsError(f'"{name}" is the name of an effect of the library; take another.')
    folder = Path()
    if arguments.study is not None:
        if not (arguments.study / "study.toml").is_file():
            raise PhysicsError(f"--study {arguments.study}: no study; there is no study.toml.")
        folder = arguments.study / "effects"
    file = folder / f"{name}.py"
    if file.exists():
        raise PhysicsError(f"{file} is there already; another name, or remove it.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(template(name), encoding="utf-8")
    except OSError as error:
        raise PhysicsError(f"{file}: cannot be written ({error.strerror or error}).") from None
    remember_made(file, template(name))
    if arguments.json:
        import json

        print(json.dumps({"file": str(file.absolute()), "effect": name}))
    else:
        print(
            f"{file}: an effect that works as it is. Change it, then:  "
            f"{command('effects', 'check', file)}"
        )
    return 0


def _check(arguments: argparse.Namespace) -> int:
    """Ask of an effect what is asked of the library's; 2 where something does not hold.

    Of a file that `bristle effects new` made here, checking it is consent to what it holds now.
    """
    from ..check.conformance import examine
    from ..trust import is_made_here, load_effect

    file = Path(arguments.target)
    effect = load_effect(file, trust=is_made_here(file))
    checks = examine(effect)
    good = all(check.holds for check in checks)
    if arguments.json:
        import json
        from dataclasses import asdict

        answer = {"effect": effect.name, "conforms": good, "checks": [asdict(c) for c in checks]}
        print(json.dumps(answer, indent=2))
    else:
        for check in checks:
            found = f": {check.found}" if check.found else ""
            print(f"{'ok  ' if check.holds else 'FAIL'}  {check.asked}{found}")
        print(f"{file}: {effect.name} {'conforms' if good else 'does not conform'}.")
    return 0 if good else 2


def tell(effect: type[Effect]) -> dict[str, Any]:
    """Return what users are told of an effect: class data, first line and formula of its text."""
    from ..physics.effect import laws_joined

    first, _, rest = (effect.__doc__ or "").strip().partition("\n")
    return {
        "name": effect.name,
        "site": effect.site,
        "laws": list(laws_joined(effect)),
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


def _find(name: str, known: dict[str, type[Effect]], left_out: dict[str, str]) -> type[Effect]:
    from difflib import get_close_matches

    from ..errors import PhysicsError

    if name in known:
        return known[name]
    if name in left_out:
        raise PhysicsError(left_out.pop(name))
    near = get_close_matches(name, known, 1)
    hint = f' Did you mean "{near[0]}"?' if near else ""
    raise PhysicsError(f'no effect is named "{name}". There are: {", ".join(sorted(known))}.{hint}')


def _print_one(found: dict[str, Any]) -> None:
    joins = f", joins {' and '.join(found['laws'])}" if found["laws"] else ""
    print(f"{found['name']} ({found['site']}{joins}): {found['about']}\n")
    print(found["text"])
    print(f"\nWhen it is missing: {found['expect']}.\nSource: {found['source']}.\n")
    for name, about in found["parameters"].items():
        low, high = about["bounds"]
        value = f"{about['value']:g} {about['unit']}" if about["unit"] != "1" else about["value"]
        print(f"  {found['name']}.{name} = {value}  ({low:g} to {high:g}): {about['text']}")
    if found["site"] == "sensor":
        print("\nIn a model that is held against measurements; never inside a damper.")
    else:
        site, name = found["site"], found["name"]
        print(f'\nIn a scenario, among the parameters of a {site}:  "{name}.on" = true')


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
