"""What `bristle effects` and `bristle laws` share: a file of one's own, its check, the lists."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..quantity import tick, typed
from ._consent import add_trust

WITHIN = 300.0
"""Time [s] that a check of a file may take."""


class Own(NamedTuple):
    """What differs between effects and laws.

    `word` is "effect" or "law"; `known` gives those that are registered; `names` all names that
    are taken; `template` gives the text of a new file.
    """

    word: str
    known: Callable[[], Mapping[str, Any]]
    names: tuple[str, ...]
    template: Callable[[str], str]

    @property
    def folder(self) -> str:
        """The folder of a study with files of this kind, and the command."""
        return f"{self.word}s"


def add_arguments(parser: argparse.ArgumentParser, word: str) -> None:
    """Add the arguments of the command for effects or laws."""
    a = f"an {word}" if word[0] in "aeiou" else f"a {word}"
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    text = f"{a}; without it, a list of all; or one of the words new, check"
    parser.add_argument("name", nargs="?", metavar="NAME", help=text)
    text = f"with new: the name of your {word}; with check: its file"
    parser.add_argument("target", nargs="?", metavar="NAME_OR_FILE", help=text)
    text = f"a study whose own {word}s count too; with new: the study that the file is for"
    parser.add_argument("--study", type=Path, metavar="FOLDER", help=text)
    add_trust(parser)
    parser.add_argument("--json", action="store_true", help="print as JSON")


Told = dict[str, Any]


def main(
    arguments: argparse.Namespace, own: Own, tell: Callable[[Any], Told],
    print_one: Callable[[Told], None], print_table: Callable[[list[Told]], None],
) -> int:  # fmt: skip
    """Print a table, everything about one, or start or check a file of a user's own.

    Parameters
    ----------
    arguments : of the command line
    own : what differs between effects and laws
    tell : returns what is told of a class, as JSON has it
    print_one, print_table : print what is told of one class, and of several
    """
    from ..errors import PhysicsError

    if arguments.name in ("new", "check"):
        if not arguments.target:
            what = "NAME" if arguments.name == "new" else "FILE.py"
            raise PhysicsError(f"bristle {own.folder} {arguments.name} {what} is right.")
        return (new if arguments.name == "new" else check)(arguments, own)
    if arguments.target:
        raise PhysicsError(f'"{arguments.name} {arguments.target}": one name, or new, check.')
    left_out = read_own(arguments.study, own)
    if arguments.name in left_out:
        refuse_untrusted(arguments.study / own.folder / f"{arguments.name}.py")
    if arguments.name:
        found: Any = tell(find(arguments.name, own, left_out))
    else:
        found = [tell(one) for _, one in sorted(own.known().items())]
    if arguments.json:
        print(json.dumps(found, indent=2))
    elif arguments.name:
        print_one(found)
    else:
        print_table(found)
    for text in left_out.values():
        print(f"left out: {text}", file=sys.stderr)
    return 0


def read_own(study: Path | None, own: Own) -> dict[str, str]:
    """Register the files of a study; return those that are left out, and why."""
    if study is None:
        return {}
    from ..errors import PhysicsError
    from ..trust import load

    if not study.is_dir():
        raise PhysicsError(f"--study {study}: there is no such folder.")
    load(study / "laws", "law")  # what an effect joins
    return {one.name: one.error for one in load(study / own.folder, own.word) if one.error}


def refuse_untrusted(file: Path) -> None:
    """Raise where the effect or law that is asked for waits for consent."""
    from ..physics.user import waiting

    if untrusted := waiting(file):
        raise untrusted


def new(arguments: argparse.Namespace, own: Own) -> int:
    """Write a new file, which works as it is."""
    from ..errors import PhysicsError
    from ..findings import command
    from ..trust import remember_made

    name, word = arguments.target, own.word
    a = f"an {word}" if word[0] in "aeiou" else f"a {word}"
    if not name.isidentifier() or not name.isascii() or name != name.lower():
        raise PhysicsError(f'"{name}": a name of small letters, digits and _ is right.')
    if name in own.names:
        raise PhysicsError(f'"{name}" is the name of {a} of the library; take another.')
    folder = Path()
    if arguments.study is not None:
        if not (arguments.study / "study.toml").is_file():
            raise PhysicsError(f"--study {arguments.study}: no study; there is no study.toml.")
        folder = arguments.study / own.folder
    file = folder / f"{name}.py"
    if file.exists():
        raise PhysicsError(f"{file} is there already; another name, or remove it.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(own.template(name), encoding="utf-8")
    except OSError as error:
        raise PhysicsError(f"{file}: cannot be written ({error.strerror or error}).") from None
    remember_made(file, own.template(name))
    if arguments.json:
        print(json.dumps({"file": str(file.absolute()), word: name}))
    else:
        then = command(own.folder, "check", file)
        print(f"{file}: {a} that works as it is. Change it, then:  {then}")
    return 0


def check(arguments: argparse.Namespace, own: Own) -> int:
    """Ask of a file what is asked of the library's; 2 where something does not hold.

    Of a file that `new` made here, checking it is consent to what it holds now.
    """
    from ..errors import PhysicsError
    from ..progress import tell
    from ..trust import is_made_here, load_file

    file = Path(arguments.target)
    # Refuses what is wrong with file and line.
    made = load_file(file, own.word, trust=is_made_here(file))
    tell(f"checking {file.name}: its hooks are called some hundred thousand times, and compiled")
    program = [sys.executable, "-m", "bristle.check.own", own.word, str(file)]
    try:
        child = subprocess.run(program, capture_output=True, text=True, check=False, timeout=WITHIN)
    except subprocess.TimeoutExpired:
        raise PhysicsError(
            f"{file}: the check does not end within {WITHIN:g} s. A hook is called some hundred "
            "thousand times: arithmetic that takes microseconds is right."
        ) from None
    if child.returncode != 0:
        told = child.stderr.strip().splitlines()
        raise PhysicsError(f"{file}: the check fails: {told[-1] if told else child.returncode}")
    checks = json.loads(child.stdout)
    good = all(one["holds"] for one in checks)
    if arguments.json:
        answer = {own.word: made.name, "conforms": good, "checks": checks}
        print(json.dumps(answer, indent=2))
    else:
        for one in checks:
            found = f": {one['found']}" if one["found"] else ""
            print(f"{'ok  ' if one['holds'] else 'FAIL'}  {one['asked']}{found}")
        print(f"{file}: {made.name} {'conforms' if good else 'does not conform'}.")
    return 0 if good else 2


def find(name: str, own: Own, left_out: dict[str, str]) -> Any:
    """Return the one of a name; PhysicsError that names the nearest where there is none."""
    from difflib import get_close_matches

    from ..errors import PhysicsError

    known = own.known()
    if name in known:
        return known[name]
    if name in left_out:
        raise PhysicsError(left_out.pop(name))
    near = get_close_matches(name, known, 1)
    hint = f' Did you mean "{near[0]}"?' if near else ""
    names = ", ".join(sorted(known))
    raise PhysicsError(f'no {own.word} is named "{name}". There are: {names}.{hint}')


def parameters_of(one: Any) -> dict[str, Any]:
    """Return what users are told of the parameters."""
    return {
        name: {
            "value": parameter.value,
            "unit": parameter.unit,
            "bounds": list(parameter.bounds),
            "text": parameter.text,
        }
        for name, parameter in one.parameters.items()
    }


def text_of(one: Any) -> tuple[str, str]:
    """Return the first line of a docstring, and the rest of it."""
    import textwrap

    first, _, rest = (one.__doc__ or "").strip().partition("\n")
    return first.strip(), textwrap.dedent(rest).strip("\n")


def parameter_lines(found: dict[str, Any], begin: str) -> list[str]:
    """Return a line per parameter: value, unit, bounds, meaning."""
    lines = []
    for name, about in found["parameters"].items():
        low, high = (tick(bound) for bound in about["bounds"])
        value = f"{typed(about['value'])} {about['unit']}".removesuffix(" 1")
        lines.append(f"  {begin}{name} = {value}  ({low} to {high}): {about['text']}")
    return lines


def shortly(row: dict[str, Any]) -> list[str]:
    """Return name, value and unit of each parameter."""
    return [
        f"{name} = {typed(about['value'])}" + (f" {about['unit']}" if about["unit"] != "1" else "")
        for name, about in row["parameters"].items()
    ]
