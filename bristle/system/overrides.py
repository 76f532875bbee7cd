"""What may stand in a scenario file, and overrides that are laid over it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ..component import OVER_STEP
from ..core.config import ANY, Document, Key, Spec
from ..core.text import unknown, written
from ..core.toml_lines import KeyPath
from ..errors import ScenarioError
from ..physics.forms import FORMS
from .model import ALGORITHMS, FILE_PARAMETERS

LAW_KEYS = ("law", "command", "command_knots")
"""Those that say which law a damper has, and how the command enters it."""
INSTEAD = {"law": "fmu", "fmu": "law"}
"""Which key takes the place of which: a component has one."""
LISTS = ("command_knots", "effects")
"""Keys whose value is a list."""
MADE_FROM = ("building", "controller")
"""Keys that name a file which a component is made from."""
FILES = (*FILE_PARAMETERS, *MADE_FROM, "fmu", "law", "effects")
"""Last words of names whose value may be a file."""

_SHORT = re.compile(r"[+-]?(\d+\.|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""Numbers that TOML does not know: .5 and 5."""


def _files(value: object) -> tuple[str, ...]:
    files = value if isinstance(value, list) else [value]
    if not files or not all(isinstance(file, str) for file in files):
        raise ScenarioError(f'is {written(value)}: expected "FILE.py", or a list of them.')
    return tuple(files)


COMPONENT = Spec({
    "fmu": Key(str, None, about="a built-in name, or a path relative to this file"),
    "law": Key(
        str, None, about="a damper's law in place of fmu: its name, or a file of your own"
    ),
    "command": Key(str, None, choices=FORMS, about="how the command enters the law"),
    "command_knots": Key([float], None, "V", about="knots of a table over the command"),
    "building": Key(str, None, about="data file of another building"),
    "controller": Key(
        str, None, about="controller file of bristle design, for a designed controller"
    ),
    "effects": Key(
        _files, None,
        about="files with effects of your own, for a built-in damper or Structure",
    ),
    "step": Key(float, None, "s", above=0.0, about="the run's step divided by a whole number"),
    "over_step": Spec(
        each=Key(str, None, choices=OVER_STEP),
        about="how a foreign FMU takes its inputs over a step; an output that stands between "
        "instants is sampled",
    ),
    "parameters": Spec(each=ANY),
})  # fmt: skip
"""`[components.NAME]`."""
SCENARIO = Spec({
    "title": Key(str, None, about="title of figures and tables"),
    "run": Spec({
        "stop": Key(float, unit="s", above=0.0, about="end of the run, a whole number of steps"),
        "step": Key(float, unit="s", above=0.0, about="communication step"),
        "algorithm": Key(str, ALGORITHMS[0], choices=ALGORITHMS),
    }),
    "components": Spec(each=ANY, about="they step in this order, but for jacobi"),
    "connections": Spec(each=ANY, about='"component.input" = "component.output"'),
})  # fmt: skip


def flatten(
    table: Mapping[str, Any],
    path: KeyPath,
    whole: Callable[[str, Mapping[str, Any]], bool] = lambda name, table: False,
    before: str = "",
) -> Iterator[tuple[str, object, KeyPath]]:
    """Yield (dotted name, value, path) of a table whose dotted names may lack their quotes.

    TOML reads `gas_spring.on = true` as a table in a table and `"gas_spring.on" = true` as one
    key; in a scenario both mean the same.

    Parameters
    ----------
    table, path : the table, and the keys that lead to it
    whole : (dotted name, table) -> whether a table is a value, and no part of a name
    before : what stands before the names in this table
    """
    for key, value in table.items():
        name = f"{before}{key}"
        if isinstance(value, dict) and not whole(name, value):
            yield from flatten(value, (*path, key), whole, f"{name}.")
        else:
            yield name, value, (*path, key)


def apply_overrides(document: Document, overrides: Mapping[str, object]) -> set[KeyPath]:
    """Lay overrides over the document; return the paths of those that had another value before.

    A name that leads nowhere becomes a finding.
    """
    changed: set[KeyPath] = set()
    for name, value in overrides.items():
        target = _target(document.data, str(name))
        if isinstance(target, str):
            document.error((), f'override "{name}": {target}')
            continue
        *tables, key = target
        table = document.data
        for step in tables:
            table = table.setdefault(step, {})
            if not isinstance(table, dict):
                break  # the check of the file says that this must be a table
        else:
            before = {name: old for name, old, _ in flatten(table, ())}
            _drop(table, key)
            table[key] = _as_in_file(value, key)
            other = INSTEAD.get(key, "") if len(target) == 3 else ""
            if (*tables, other) not in document.overridden:
                table.pop(other, None)
            document.overridden[target] = str(name)
            if key not in before or before[key] != table[key]:
                changed.add(target)
    return changed


def _target(data: Mapping[str, Any], name: str) -> tuple[str, ...] | str:
    """Return the path that an override sets, or the words for why there is none."""
    first, _, rest = name.partition(".")
    if first == "components":
        first, _, rest = rest.partition(".")
    if name == "title":
        return ("title",)
    components = data.get("components")
    known = [str(key) for key in components] if isinstance(components, dict) else []
    if first not in ("run", "connections", *known):
        return unknown("component", first, [*known, "run", "connections"])
    if not rest:
        return f'a dotted name is right, as in "{first}.step".'
    if first in ("run", "connections"):
        return first, rest
    if rest.startswith("over_step."):
        return "components", first, "over_step", rest.removeprefix("over_step.")
    if rest in COMPONENT.keys and rest != "parameters":
        return "components", first, rest
    return "components", first, "parameters", rest.removeprefix("parameters.")


def _drop(table: dict[str, Any], name: str) -> None:
    """Take a dotted name out of a table, with or without its quotes."""
    table.pop(name, None)
    parts = name.split(".")
    for count in range(1, len(parts)):
        inner = table.get(".".join(parts[:count]))
        if isinstance(inner, dict):
            _drop(inner, ".".join(parts[count:]))


def plain(value: object) -> object:
    """Return an override's value in the types of TOML: paths and numbers of numpy have others."""
    if isinstance(value, Path):
        return str(value)
    item = getattr(value, "item", None)
    if callable(item) and getattr(value, "size", 1) == 1:  # numbers of numpy
        return item()
    return value


def _as_in_file(value: object, key: str) -> object:
    """Return an override's value as TOML would give it.

    A file is looked for in the current folder first, because there its name was typed.
    """
    value = plain(value)
    if isinstance(value, list):
        return [_as_in_file(one, key) for one in value]
    if key in FILES and isinstance(value, str) and Path(value).suffix:
        here = Path(value).absolute()
        return str(here) if exists(here) else value
    return value


def exists(path: Path) -> bool:
    """Return whether there is a file or folder; names that no file can have are not there."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def parse_override(text: str) -> tuple[str, bool | int | float | str]:
    """Return (name, value) of a command-line override such as `damper.f_c=2`.

    The value follows TOML: `true`, `2`, `1e-3`, `"text"`; `.5` is a number, too, and anything else
    is text as it stands.

    Raises
    ------
    ScenarioError
        If the text has no `=` or no name before it.
    """
    name, equals, value = text.partition("=")
    name, value = name.strip(), value.strip()
    if not equals or not name:
        raise ScenarioError(f'--set "{text}": NAME=VALUE is right, as in --set damper.f_c=2.')
    if "#" in value and value[:1] not in ("'", '"'):
        return name, value  # TOML would take the rest for a comment
    if _SHORT.fullmatch(value):
        return name, float(value)
    found = _in_toml(value)
    return name, found if isinstance(found, bool | int | float | str) else value


def _in_toml(text: str) -> object:
    """Return the value that a text is in TOML, else the text."""
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return found["value"] if len(found) == 1 else text


def parse_overrides(texts: list[str]) -> dict[str, object]:
    """Return the overrides of a command line by name; lists of what takes a list.

    Raises
    ------
    ScenarioError
        If one cannot be read or a name is given twice.
    """
    overrides: dict[str, object] = {}
    for text in texts:
        name, found = parse_override(text)
        value: object = found
        if name.rpartition(".")[2] in LISTS and isinstance(found, str):
            listed = _in_toml(found)
            value = listed if isinstance(listed, list) else found
        if name in overrides:
            raise ScenarioError(f'--set: "{name}" is given twice; once is right.')
        overrides[name] = value
    return overrides
