"""TOML files read with care: a spec says what may stand in one, and every mistake has its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import BristleError
from ..version import __version__
from .finding import Finding, Level, worded
from .text import number, unknown, written
from .toml_lines import KeyPath, key_lines, repeated_keys

SCHEMA = 1
"""The version of every kind of file: its key `schema`, which has to be there."""

LARGEST = 4 * 1024**2
"""Largest TOML or JSON file that is read [byte]."""

REQUIRED: Any = object()
"""The default of a key that must be there."""

_NOUNS = {str: "a text in quotes", float: "a number", int: "a whole number", bool: "true or false"}
_TYPES = {str: "string", float: "number", int: "integer", bool: "boolean"}
_POSITION = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_HINTS = (
    ("Invalid value", 'text needs quotes, numbers have a decimal point: 0.5, "text", true'),
    ("Invalid initial character for a key", "an inline table { ... } stays on one line"),
    ("Unclosed", "every bracket and quote needs its partner"),
    ("Expected '='", "a line reads: key = value"),
    ("Unescaped", "write backslashes in 'single quotes'"),
    ("Expected newline", "one key = value per line"),
)


class Key(NamedTuple):
    """What a key may hold.

    Attributes
    ----------
    kind : type, list of one type, or callable
        `str`, `float`, `int`, `bool`; `[str]` or `[float]` for a list, which is read as a tuple;
        else what turns a value into the wanted one, raising a BristleError whose words follow the
        key's name, such as "= 3: expected ...".
    default : object
        Taken where the key is missing or wrong; without a default it must be there, and a text
        must not be empty.
    unit : str
        Of the number.
    least, above, most : float, optional
        Bounds of the number: not less than, more than, not more than.
    choices : collection of str
        The texts that are right besides the default; any where there are none.
    about : str
        What it is, in a few words.
    """

    kind: Any
    default: Any = REQUIRED
    unit: str = ""
    least: float | None = None
    above: float | None = None
    most: float | None = None
    choices: Collection[str] = ()
    about: str = ""

    def expected(self) -> str:
        """Return what is right, in words."""
        if isinstance(self.kind, list):
            text = "a list of " + ("texts" if self.kind == [str] else "numbers")
        elif 0 < len(self.choices) <= 4:
            text = " or ".join(f'"{one}"' for one in self.choices)
        else:
            text = _NOUNS.get(self.kind, "a value")
        low, high, unit = self.least, self.most, f" {self.unit}" if self.unit else ""
        if self.above is not None:
            text += f" above {self.above:g}{unit}"
        elif low is not None:
            text += f" of {low:g}{unit}" + (" or more" if high is None else f" to {high:g}{unit}")
        elif unit:
            text += f" [{self.unit}]"
        return f"{text} ({self.about})" if self.about else text

    def taken(self, value: object) -> Any:
        """Return a value as it is wanted.

        Raises
        ------
        BristleError
            With what is wrong with it, in words that follow the key's name.
        """
        if isinstance(self.kind, list):
            if not isinstance(value, list | tuple):
                raise self._refusal(f"is {written(value)}")
            return tuple(map(Key(self.kind[0])._item, value))
        if self.kind is float:
            value = number(value)
            if isinstance(value, str):
                raise self._refusal(value)
        elif self.kind not in _NOUNS:
            return self.kind(value)
        elif not isinstance(value, self.kind) or isinstance(value, bool) != (self.kind is bool):
            raise self._refusal(f"is {written(value)}")
        out = (
            (self.least is not None and value < self.least)
            or (self.above is not None and value <= self.above)
            or (self.most is not None and value > self.most)
        )
        if out:
            shown = f"{value:.12g}" if isinstance(value, float) else written(value)
            raise self._refusal(f"= {shown}{f' {self.unit}' if self.unit else ''}")
        return value

    def _item(self, value: object) -> Any:
        try:
            return self.taken(value)
        except BristleError:
            raise Key([self.kind])._refusal(f"holds {written(value)}") from None

    def _refusal(self, words: str) -> BristleError:
        return BristleError(f"{words}: expected {self.expected()}.")


ANY = Key(lambda value: value, None)
"""A key whose value is taken as it is."""


class Spec(NamedTuple):
    """What may stand in a table.

    Attributes
    ----------
    keys : mapping
        Keys and tables by name.
    each : Key or Spec, optional
        What every other name holds; without it another name is a mistake.
    many : bool
        Whether it is an array of tables, [[NAME]], which is read as a tuple.
    about : str
        What it is, in a few words.
    """

    keys: Mapping[str, Key | Spec] = {}
    each: Key | Spec | None = None
    many: bool = False
    about: str = ""


class Document:
    """A TOML file with the line of every key; collects what is found in it.

    Parameters
    ----------
    path : path
        The file, as messages name it.
    raises : type
        The class of the error that `check` raises.
    data : mapping, optional
        The content, where there is no file.

    Attributes
    ----------
    data : dict
        The content.
    lines : dict
        The line of each key by its path.
    overridden : dict
        For the path of each key that was set from outside, the name that it was set by.
    found : list of Finding
        What is wrong or worth knowing, in the order in which it was found.

    Raises
    ------
    BristleError
        Of the class `raises`, if the file cannot be read or is not TOML.
    """

    def __init__(
        self, path: str | Path, raises: type[BristleError], data: Mapping[str, Any] | None = None
    ) -> None:
        self.path = path
        self.overridden: dict[KeyPath, str] = {}
        self.found: list[Finding] = []
        self._raises = raises
        self.lines: dict[KeyPath, int] = {}
        if data is not None:
            self.data = dict(data)
            return
        text = read_text(Path(path), raises)
        try:
            self.data, self.lines = tomllib.loads(text), key_lines(text)
        except RecursionError:
            raise _error(raises, path, 0, "not TOML: brackets are nested too deeply.") from None
        except ValueError as error:  # TOMLDecodeError, and whole numbers of thousands of digits
            raise _error(raises, path, *_syntax(text, str(error))) from None

    def read(self, spec: Spec, keys: KeyPath = (), given: Any = None) -> dict[str, Any]:
        """Return what a table holds, defaults filled in; None where what must be there is not.

        Every mistake becomes a finding: `check` raises them.

        Parameters
        ----------
        spec : what may stand in it
        keys : where the table stands; () for the file itself, whose schema is checked as well
        given : the table

        Raises
        ------
        BristleError
            If the file is of another version: its other keys are not judged then.
        """
        if not keys:
            given, spec = self.data, spec._replace(keys={"schema": Key(int), **spec.keys})
            if (found := given.get("schema", SCHEMA)) != SCHEMA or isinstance(found, bool):
                self.error(("schema",), other_schema(found))
                self.check()
        if not isinstance(given, Mapping):
            self.error(keys, f"{_title(keys)} is {written(given)}: expected a table.")
            found = self.found.copy()
            blank = self.read(spec, keys, {})
            self.found = found  # what it lacks goes without saying
            return blank
        out = {
            name: self._value(one, (*keys, name), given[name])
            if name in given
            else self._missing(one, keys, name)
            for name, one in spec.keys.items()
        }
        for name in given:
            if name not in spec.keys and spec.each is not None:
                out[name] = self._value(spec.each, (*keys, name), given[name])
            elif name not in spec.keys:
                self.error((*keys, name), _in(keys) + unknown("key", name, spec.keys))
        return out

    def _value(self, spec: Key | Spec, keys: KeyPath, value: Any) -> Any:
        if isinstance(spec, Spec) and not spec.many:
            return self.read(spec, keys, value)
        if isinstance(spec, Spec):
            if not isinstance(value, list | tuple):
                right = f"a list of tables{f', as {spec.about}' if spec.about else ''}"
                self.error(keys, f"{_title(keys)} is {written(value)}: expected {right}.")
                return ()
            return tuple(self.read(spec, (*keys, index), one) for index, one in enumerate(value))
        if spec.default is REQUIRED and isinstance(value, str) and not value:
            return self._missing(spec, keys[:-1], str(keys[-1]))
        try:
            taken = spec.taken(value)
        except BristleError as error:
            self.error(keys, f"{_title(keys)} {error}")
        else:
            if not spec.choices or taken in (*spec.choices, spec.default):
                return taken
            self.error(keys, _in(keys[:-1]) + unknown(str(keys[-1]), taken, spec.choices))
        return None if spec.default is REQUIRED else spec.default

    def _missing(self, spec: Key | Spec, keys: KeyPath, name: str) -> Any:
        if isinstance(spec, Spec):
            return () if spec.many else self.read(spec, (*keys, name), {})
        if spec.default is REQUIRED:
            right = f"schema = {SCHEMA}" if name == "schema" else spec.expected()
            self.error((*keys, name), f"{_title((*keys, name))} is missing: expected {right}.")
        return None if spec.default is REQUIRED else spec.default

    def add(self, level: Level, keys: KeyPath, text: str) -> None:
        """Add a finding at the line of a key, once.

        A key that is not in the file has the line of the nearest table around it.
        """
        if keys in self.overridden:
            line, text = 0, f'override "{self.overridden[keys]}": {text}'
        else:
            while keys and keys not in self.lines:
                keys = keys[:-1]
            line = self.lines.get(keys, 0)
        if (finding := Finding("file", level, text, line=line)) not in self.found:
            self.found.append(finding)

    def error(self, keys: KeyPath, text: str) -> None:
        """Add what must be put right."""
        self.add("error", keys, text)

    def error_of(self, keys: KeyPath, text: str) -> None:
        """Add an error in a table at the line of the first of its keys that the text names."""
        named = [key for key in re.findall(r"\w+", text) if (*keys, key) in self.lines]
        self.error((*keys, *named[:1]), text)

    def warning(self, keys: KeyPath, text: str) -> None:
        """Add what is allowed and probably a mistake."""
        self.add("warning", keys, text)

    def note(self, keys: KeyPath, text: str) -> None:
        """Add what is good to know."""
        self.add("note", keys, text)

    def in_order(self) -> list[Finding]:
        """Return the findings by line; those of one line in the order in which they were made."""
        return sorted(self.found, key=lambda finding: finding.line)

    def check(self) -> None:
        """Raise one error with all that must be put right, in the order of the file."""
        wrong = [finding for finding in self.in_order() if finding.level == "error"]
        if wrong:
            raise raised(self._raises, self.path, wrong)


def read_text(path: Path, raises: type[BristleError]) -> str:
    """Return the text of a file in UTF-8.

    Raises
    ------
    BristleError
        Of the class `raises`, if there is no such file, or it is none of text, or too large.
    """
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "there is no such file"
            raise _error(raises, path, 0, f"{what}.")
        with path.open("rb") as stream:
            raw = stream.read(LARGEST + 1)
        if len(raw) > LARGEST:
            raise _error(raises, path, 0, f"is larger than {LARGEST // 1024**2} MB.")
        return raw.decode("utf-8-sig")
    except OSError as error:
        words = f"cannot be read ({error.strerror or error})."
        raise _error(raises, path, 0, words) from None
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        words = "is not UTF-8 text: save the file in the encoding UTF-8."
        raise _error(raises, path, line, words) from None


def toml_content(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds, unchecked; {} where it holds nothing that can be read.

    For what is looked up on the side: what is wrong with the file is told where it is read.
    """
    with suppress(OSError, ValueError, RecursionError):
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    return {}


def other_schema(found: object) -> str:
    """Return what is said of a file's schema that this version does not read."""
    return (
        f"schema is {written(found)}, of another version of bristle: expected {SCHEMA}, which this "
        f"one, {__version__}, reads. Nothing is changed; open it with the version that made it."
    )


def json_schema(spec: Key | Spec) -> dict[str, Any]:
    """Return the JSON schema (draft 7) of what a spec says, for editors."""
    about = {"description": spec.about} if spec.about else {}
    if isinstance(spec, Spec):
        table: dict[str, Any] = {"type": "object", **about}
        if needed := [name for name, one in spec.keys.items() if _needed(one)]:
            table["required"] = needed
        table["additionalProperties"] = json_schema(spec.each) if spec.each else False
        if spec.keys:
            table["properties"] = {name: json_schema(one) for name, one in spec.keys.items()}
        return {"type": "array", "items": table} if spec.many else table
    if spec.unit:
        about = {"description": f"{spec.about} [{spec.unit}]".strip()}
    if isinstance(spec.kind, list):
        return {"type": "array", "items": json_schema(Key(spec.kind[0])), **about}
    found: dict[str, Any] = {"type": _TYPES[spec.kind]} if spec.kind in _TYPES else {}
    if spec.choices:
        found = {"enum": list(spec.choices)}
    bounds = {"minimum": spec.least, "exclusiveMinimum": spec.above, "maximum": spec.most}
    found |= {name: bound for name, bound in bounds.items() if bound is not None}
    default = {"default": spec.default} if spec.default not in (REQUIRED, None, "") else {}
    return {**found, **about, **default}


def _needed(spec: Key | Spec) -> bool:
    """Return whether a key, or one in a table, must be there."""
    if isinstance(spec, Spec):
        return not spec.many and any(map(_needed, spec.keys.values()))
    return spec.default is REQUIRED


def _title(keys: KeyPath) -> str:
    """Return what a key is called: `stop`, `[run] stop`, `[[runs]] role`."""
    return f"{_in(keys[:-1], '')}{keys[-1]}" if isinstance(keys[-1], str) else f"[[{keys[-2]}]]"


def _in(keys: KeyPath, mark: str = ":") -> str:
    """Return the table that keys lead to, before what is said of it; "" for the file itself."""
    if not keys:
        return ""
    if isinstance(keys[-1], int):
        return f"[[{keys[-2]}]]{mark} "
    return f"[{'.'.join(str(key) for key in keys if isinstance(key, str))}]{mark} "


def raised(raises: type[BristleError], path: str | Path, found: Sequence[Finding]) -> BristleError:
    """Return the error that tells findings in a file, a line each with its place."""
    made = raises("\n  ".join(worded(path, finding) for finding in found))
    made.findings = tuple(found)
    return made


def _error(raises: type[BristleError], path: str | Path, line: int, text: str) -> BristleError:
    return raised(raises, path, (Finding("file", "error", text, line=line),))


def _syntax(text: str, message: str) -> tuple[int, str]:
    """Return the line and the words for a text that is not TOML."""
    rows = text.splitlines() or [""]
    repeated = repeated_keys(text)
    if re.match(r"Cannot (overwrite|declare|mutate)|Duplicate", message) and repeated:
        path, line, first = repeated[0]
        name = ".".join(str(part) for part in path)
        return line, f'"{name}" is written twice, first in line {first}: one of them must go.'
    position = _POSITION.search(message)
    line = int(position[1]) if position and position[1] else len(rows)
    what = _POSITION.sub("", message)
    column = f" in column {position[2]}" if position and position[2] else " at the end"
    row = rows[min(line, len(rows)) - 1]
    hint = next((f"; {words}" for start, words in _HINTS if what.startswith(start)), "")
    at = row[int(position[2]) - 1 :][:1] if position and position[2] else ""
    if at.isalpha() and not at.isascii() and what.startswith("Expected"):
        hint = f'; a name with "{at}" needs quotes'
    return line, f"not TOML: {what}{column} of `{row.strip()[:80]}`{hint}."
