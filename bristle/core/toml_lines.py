"""Line numbers of a TOML text, which the reader of the standard library does not give."""

from __future__ import annotations

import json
import math
import re
import tomllib
from bisect import bisect_right
from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

from ..errors import ScenarioError

KeyPath = tuple[str | int, ...]
"""Keys from the top of a document down to one; whole numbers count the items of an array."""

_KEY = re.compile(r"""[ \t]*("(?:[^"\\\n]|\\.)*"|'[^'\n]*'|[A-Za-z0-9_-]+)[ \t]*""")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_TEXT = re.compile(
    r'''"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?'{3,5}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*\'''', re.DOTALL
)
_PLAIN = re.compile(r"[^,\[\]{}#\n]+")


class TextKey(NamedTuple):
    """One key of a text; `ends` is False for the leading parts of a dotted key or header."""

    path: KeyPath
    line: int
    ends: bool


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line, counted from 1, on which each key of a TOML text is first written.

    Parameters
    ----------
    text : str
        A valid TOML document; tables, dotted keys, inline tables and arrays are followed.

    Raises
    ------
    ScenarioError
        If the text is not TOML.
    """
    lines: dict[KeyPath, int] = {}
    for key in _Scanner(text).scan():
        lines.setdefault(key.path, key.line)
    return lines


def repeated_keys(text: str) -> list[tuple[KeyPath, int, int]]:
    """Return (path, line, line of the first) of keys and tables that are written twice.

    The text may be wrong further on: what can be read is searched.
    """
    scanner = _Scanner(text)
    # The reader of the standard library says what is wrong; this only adds the lines.
    with suppress(ScenarioError, RecursionError):
        scanner.scan()
    first: dict[KeyPath, int] = {}
    repeated = []
    for path, line, ends in scanner.keys:
        if ends and path in first:
            repeated.append((path, line, first[path]))
        elif ends:
            first[path] = line
    return repeated


class _Scanner:
    """Walks a text once and notes every key with its line."""

    def __init__(self, text: str) -> None:
        self.text = text.replace("\r\n", "\n")
        self.position = 0
        self.starts = [0] + [match.end() for match in re.finditer("\n", self.text)]
        self.keys: list[TextKey] = []
        self.counts: dict[KeyPath, int] = {}  # items so far of each array of tables

    def scan(self) -> list[TextKey]:
        table: KeyPath = ()
        while self._next():
            if self._take("[["):
                table = self._header(self._key_parts(), array=True)
                self._expect("]]")
            elif self._take("["):
                table = self._header(self._key_parts(), array=False)
                self._expect("]")
            else:
                self._pair(table)
        return self.keys

    def _next(self) -> str:
        """Skip blanks and comments; return the next character, "" at the end."""
        match = _BLANK.match(self.text, self.position)
        if match:
            self.position = match.end()
        return self.text[self.position : self.position + 1]

    def _take(self, mark: str) -> bool:
        found = self.text.startswith(mark, self.position)
        if found:
            self.position += len(mark)
        return found

    def _expect(self, mark: str) -> None:
        if not self._take(mark):
            raise ScenarioError(f'line {self._line()}: expected "{mark}".')

    def _line(self) -> int:
        return bisect_right(self.starts, self.position)

    def _note(self, base: KeyPath, parts: list[str], line: int) -> KeyPath:
        """Note a dotted key and its leading parts; return its path."""
        for part in parts[:-1]:
            base = (*base, part)
            self.keys.append(TextKey(base, line, ends=False))
        base = (*base, parts[-1])
        self.keys.append(TextKey(base, line, ends=True))
        return base

    def _key_parts(self) -> list[str]:
        parts = []
        while True:
            match = _KEY.match(self.text, self.position)
            if match is None:
                raise ScenarioError(f"line {self._line()}: expected a key.")
            self.position = match.end()
            parts.append(_unquoted(match[1]))
            if not self._take("."):
                return parts

    def _header(self, parts: list[str], array: bool) -> KeyPath:
        """Note a [header]; leading parts that are arrays of tables stand for their last item."""
        line = self._line()
        path: KeyPath = ()
        for depth, part in enumerate(parts, start=1):
            path = (*path, part)
            last = depth == len(parts)
            if last and array:
                self.keys.append(TextKey(path, line, ends=False))
                self.counts[path] = self.counts.get(path, 0) + 1
            if path in self.counts:
                path = (*path, self.counts[path] - 1)
            self.keys.append(TextKey(path, line, ends=last))
        return path

    def _pair(self, table: KeyPath) -> None:
        line = self._line()
        path = self._note(table, self._key_parts(), line)
        self._expect("=")
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        self._next()
        if self._take("{"):
            while self._next() not in ("}", ""):
                self._pair(path)
                self._next()
                self._take(",")
            self._expect("}")
        elif self._take("["):
            index = 0
            while self._next() not in ("]", ""):
                self.keys.append(TextKey((*path, index), self._line(), ends=True))
                self._value((*path, index))
                self._next()
                self._take(",")
                index += 1
            self._expect("]")
        else:
            match = _TEXT.match(self.text, self.position) or _PLAIN.match(self.text, self.position)
            if match is None:
                raise ScenarioError(f"line {self._line()}: expected a value.")
            self.position = match.end()


def _unquoted(part: str) -> str:
    if part.startswith("'"):
        return part[1:-1]
    if part.startswith('"'):
        try:
            return str(tomllib.loads(f"key = {part}")["key"])
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError(f"key {part}: {error}") from error
    return part


# Keys and values as TOML writes them.

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_key(name: str) -> str:
    """Return a name as a key of TOML, with quotes where it needs them."""
    return name if _BARE.fullmatch(name) else toml_value(name)


def toml_value(value: object) -> str:
    """Return a value as TOML writes it: a number, a text, true or false, a list or a table."""
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(key)} = {toml_value(item)}" for key, item in value.items())
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # "inf", "-inf", "nan", as TOML spells them
    if isinstance(value, str):  # JSON's escapes are TOML's; only DEL is missing
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def toml_text(content: Mapping[str, object]) -> str:
    """Return a document: its plain keys, and behind them a table for each mapping."""
    tables = {name: one for name, one in content.items() if isinstance(one, Mapping)}
    lines = toml_table({key: one for key, one in content.items() if key not in tables})
    for name, table in tables.items():
        lines += ["", f"[{toml_key(name)}]", *toml_table(table)]
    return "\n".join(lines) + "\n"


def toml_table(table: Mapping[str, object]) -> list[str]:
    """Return the lines of a table, one for each of its keys."""
    return [f"{toml_key(key)} = {toml_value(value)}" for key, value in table.items()]
