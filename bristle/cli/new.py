"""Start an effect, a law, a controller or a scenario of your own: a file that works as it is.

`bristle check` tests it; `bristle build` makes an FMU of a controller.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

from ._options import Parser

HELP = "start your own effect, law, controller or scenario"

_KINDS = ("effect", "law", "controller", "scenario")


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle new`."""
    parser.add_argument("kind", choices=_KINDS, metavar="KIND", help=", ".join(_KINDS))
    text = "your name for it; the file is NAME.py, of a scenario NAME.toml"
    parser.add_argument("name", metavar="NAME", help=text)
    text = "with effect, law: the study whose folder the file goes to"
    parser.option("--study", "FOLDER", text, type=Path)
    text = "with scenario: the stock scenario to begin with, see `bristle list scenarios`"
    parser.option("--like", "SCENARIO", text)
    parser.add_json("print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Write a new file; say what to do next."""
    from ..core.text import command
    from ..errors import BristleError

    kind, name = arguments.kind, arguments.name
    if arguments.study is not None and kind not in ("effect", "law"):
        raise BristleError(f"new {kind}: --study goes with effect and law alone.")
    if (arguments.like is None) == (kind == "scenario"):
        raise BristleError(
            "new scenario: expected --like SCENARIO; bristle list scenarios names them."
            if kind == "scenario"
            else f"new {kind}: --like goes with scenario alone."
        )
    about = {"file": "", kind: name}
    if kind == "scenario":
        from ..system.scenario import copy_scenario

        file = copy_scenario(arguments.like, Path(f"{name.removesuffix('.toml')}.toml"))
        then = command("run", file)
    elif kind == "controller":
        file, about[kind] = _controller(name)
        then = command("build", file)
    else:
        file = _physics(kind, name, arguments.study)
        then = command("check", file)
    if arguments.json:
        print(json.dumps(about | {"file": str(file.absolute())}))
    else:
        a = "an" if kind[0] in "aeiou" else "a"
        print(f"{file}: {a} {kind} that works as it is. Change it, then:  {then}")
    return 0


def _controller(name: str) -> tuple[Path, str]:
    """Write the file; return it and the name of the component in it."""
    from ..errors import BuildError
    from ..fmu.catalogue import component_names
    from ..user_code.templates import class_name, file_text

    component = class_name(name)
    if component in component_names():
        raise BuildError(f'"{name}": {component} is a built-in component; take another name.')
    text = file_text("controller", name)
    return _written(Path(f"{name}.py"), name, text, BuildError), component


def _physics(word: str, name: str, study: Path | None) -> Path:
    """Write the file of an effect or a law into a study, or into the current folder."""
    from ..errors import PhysicsError
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS
    from ..physics.laws import law_names
    from ..trust import remember_made
    from ..user_code.templates import file_text

    if name in (*law_names(), *law_names("structure"), *EFFECTS):
        raise PhysicsError(f'"{name}" is taken in the library; take another name.')
    if study is not None and not (study / "study.toml").is_file():
        raise PhysicsError(f"--study {study}: no study; there is no study.toml.")
    folder = Path() if study is None else study / f"{word}s"
    file = _written(folder / f"{name}.py", name, file_text(word, name), PhysicsError)
    remember_made(file, file_text(word, name))
    return file


def _written(file: Path, name: str, text: str, error: Callable[[str], Exception]) -> Path:
    """Write the text that a template has for a name into a file that is not there yet."""
    from ..core.files import write_new

    if not name.isidentifier() or not name.isascii() or name != name.lower() or name[0] == "_":
        raise error(f'"{name}": expected a name of small letters, digits and _.')
    return write_new(file, text, error, folder=True)
