"""A scenario file as text: read with care, lines kept, overrides laid over it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.toml_lines import KeyPath, key_lines, repeated_keys
from ..errors import ScenarioError
from ..findings import Finding, Findings, unknown

MAX_BYTES = 1_000_000
"""A scenario is a page of text; a file larger than this [byte] is something else."""

LAW_KEYS = ("law", "command", "command_knots")
"""Those that say which law a damper has, and how the command enters it."""
COMPONENT_KEYS = (
    *("fmu", *LAW_KEYS, "building", "controller", "effects", "step", "over_step", "parameters"),
)
INSTEAD = {"law": "fmu", "fmu": "law"}
"""Which of them takes the place of which: a component has one."""
LISTS = ("command_knots", "effects")
"""Those whose value is a list."""
MADE_FROM = ("building", "controller")
"""Those of them that name a file which a component is made from."""
FILE_PARAMETERS = ("record", "file")
"""Parameters that may name a file, relative to the scenario's folder."""

_POSITION = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_SHORT = re.compile(r"[+-]?(\d+\.|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""Numbers that TOML does not know: .5 and 5."""
_HINTS = (
    ("Invalid value", 'text needs quotes, numbers have a decimal point: 0.5, "text", true'),
    ("Invalid initial character for a key", "an inline table { ... } stays on one line"),
    ("Unclosed", "every bracket and quote needs its partner"),
    ("Expected '='", "a line reads: key = value"),
    ("Unescaped", "write backslashes in 'single quotes'"),
    ("Expected newline", "one key = value per line"),
)


@dataclass
class Document:
    """The content of a scenario file, with the place of every key.

    `overridden` gives, for each path that an override has set, the override's own name; `changed`
    holds those paths that had another value before.
    """

    file: Path
    data: dict[str, Any]
    lines: dict[KeyPath, int]
    overridden: dict[KeyPath, str] = field(default_factory=dict)
    changed: set[KeyPath] = field(default_factory=set)

    def place(self, path: KeyPath) -> tuple[int, str]:
        """Return the line of a key and the words before a finding about it.

        A key that is not in the file has the line of the nearest table around it.
        """
        if path in self.overridden:
            return 0, f'override "{self.overridden[path]}": '
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 0), ""


def read_document(file: Path) -> Document | Finding:
    """Return the file's content, or the one finding that says why there is none."""
    try:
        if not file.is_file():
            wrong = "is a folder" if file.is_dir() else "there is no such file"
            return Finding(0, "error", f"{wrong}; a scenario is a TOML file.")
        with file.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except OSError as error:
        return Finding(0, "error", f"cannot be read: {error.strerror or error}.")
    if len(raw) > MAX_BYTES:
        return Finding(
            0, "error", f"is larger than {MAX_BYTES // 1000} kB: a scenario is a page of text."
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        return Finding(line, "error", "is not UTF-8 text: save the file in the encoding UTF-8.")
    try:
        return Document(file, tomllib.loads(text), key_lines(text))
    except RecursionError:
        return Finding(0, "error", "brackets are nested too deeply for a scenario.")
    except ValueError as error:  # TOMLDecodeError, and whole numbers of thousands of digits
        return _syntax(text, str(error))


def _syntax(text: str, message: str) -> Finding:
    """Return the finding for a text that is not TOML."""
    rows = text.splitlines() or [""]
    repeated = repeated_keys(text)
    if re.match(r"Cannot (overwrite|declare|mutate)|Duplicate", message) and repeated:
        path, line, first = repeated[0]
        name = ".".join(str(part) for part in path)
        return Finding(
            line, "error", f'"{name}" is written twice, first in line {first}: one of them must go.'
        )
    position = _POSITION.search(message)
    line = int(position[1]) if position and position[1] else len(rows)
    what = _POSITION.sub("", message)
    column = f" in column {position[2]}" if position and position[2] else " at the end"
    row = rows[min(line, len(rows)) - 1]
    hint = next((f"; {words}" for start, words in _HINTS if what.startswith(start)), "")
    at = row[int(position[2]) - 1 :][:1] if position and position[2] else ""
    if at.isalpha() and not at.isascii() and what.startswith("Expected"):
        hint = f'; a name with "{at}" needs quotes'
    return Finding(line, "error", f"not TOML: {what}{column} of `{row.strip()[:80]}`{hint}.")


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


def apply_overrides(
    document: Document, overrides: Mapping[str, object], findings: Findings
) -> None:
    """Lay overrides over the document; a name that leads nowhere becomes a finding."""
    for name, value in overrides.items():
        target = _target(document.data, str(name))
        if isinstance(target, str):
            findings.found.append(Finding(0, "error", f'override "{name}": {target}'))
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
                document.changed.add(target)


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
    if rest in COMPONENT_KEYS[:-1]:
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
    is_file_name = key in (*FILE_PARAMETERS, *MADE_FROM, "fmu", "law", "effects")
    if is_file_name and isinstance(value, str) and Path(value).suffix:
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
