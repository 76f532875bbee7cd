"""Files of a study: written whole or not at all, read with the lines of what is wrong."""

from __future__ import annotations

import json
import os
import tempfile
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import StudyError
from ..findings import unknown, written
from ..lines import KeyPath, key_lines
from ..version import __version__

LARGEST = 4 * 1024**2
"""Largest TOML or JSON file of a study [bytes]."""


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file so that there is the old one or the new one at any time, never a part.

    Raises
    ------
    StudyError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    draft: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
        draft = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        draft.chmod(0o666 & ~_umask())
        draft.replace(path)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({error.strerror or error}).") from None
    finally:
        if draft is not None:
            draft.unlink(missing_ok=True)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file whole; numbers that are not finite become null."""
    write_whole(path, json.dumps(_plain(data), indent=2, ensure_ascii=False) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """Return the content of a JSON file that holds an object; StudyError if it does not."""
    try:
        found = json.loads(_text(path))
    except ValueError as error:
        raise StudyError(f"{path}: no JSON ({error}). Remove or correct the file.") from None
    if not isinstance(found, dict):
        raise StudyError(f"{path}: holds {written(found)}; an object is right.")
    return found


def other_schema(found: Any) -> str:
    """Return what is said of a file's schema that this version does not read."""
    return (
        f"schema is {written(found)}, of another version of bristle; this one, {__version__}, "
        "reads 1. Nothing is changed; open it with the version that made it."
    )


class Toml:
    """A TOML file with the line of every key; collects what is wrong with it.

    Raises
    ------
    StudyError
        If the file cannot be read or is not TOML.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        text = _text(path)
        try:
            self.data: dict[str, Any] = tomllib.loads(text)
        except (ValueError, RecursionError) as error:
            raise StudyError(f"{path}: not TOML: {error}.") from None
        self._lines = key_lines(text)
        self.wrong: list[str] = []

    def error(self, keys: KeyPath, text: str) -> None:
        """Note what is wrong at a key; a key that is not there has the line of its table."""
        while keys and keys not in self._lines:
            keys = keys[:-1]
        line = self._lines.get(keys, 0)
        self.wrong.append(f"{self.path}{f', line {line}' if line else ''}: {text}")

    def check(self) -> None:
        """Raise one StudyError with all that is wrong, in the order of the file."""
        if self.wrong:
            raise StudyError("\n  ".join(dict.fromkeys(self.wrong)))

    def known(self, keys: KeyPath, table: Mapping[str, Any], names: Iterable[str]) -> None:
        """Note every key of a table that is none of some names."""
        names = list(names)
        for key in table:
            if key not in names:
                self.error((*keys, key), unknown("key", key, names))

    def schema(self) -> None:
        """Note that there is no schema; refuse one that this version does not read.

        Raises
        ------
        StudyError
            If the file is of another version: its other keys are not judged then.
        """
        if "schema" not in self.data:
            self.error(("schema",), "schema is missing; schema = 1 is right.")
        elif self.data["schema"] != 1:
            self.error(("schema",), other_schema(self.data["schema"]))
            self.check()

    def text(self, keys: KeyPath, table: Mapping[str, Any], key: str, default: str = "") -> str:
        """Return a text of a table, noting what is none.

        Parameters
        ----------
        keys : where the table stands in the file; () for the file itself
        table : the table as read
        key : the key of the text in it
        default : returned where the key is missing or holds no text
        """
        value = table.get(key, default)
        if not isinstance(value, str):
            self.error((*keys, key), f"{key} = {written(value)}; a text is right.")
            return default
        return value

    def number(self, keys: KeyPath, table: Mapping[str, Any], key: str) -> float | None:
        """Return a finite number of a table, None where it is absent, noting what is none."""
        if key not in table:
            return None
        value = table[key]
        if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) == _INF:
            self.error((*keys, key), f"{key} = {written(value)}; a finite number is right.")
            return None
        if value != value:
            self.error((*keys, key), f"{key} is not a number; a finite number is right.")
            return None
        return float(value)

    def table(self, keys: KeyPath, table: Mapping[str, Any], key: str) -> dict[str, Any]:
        """Return a table in a table, empty where it is absent, noting what is none."""
        value = table.get(key, {})
        if not isinstance(value, dict):
            self.error((*keys, key), f"{key} is {written(value)}; a table is right.")
            return {}
        return value


_INF = float("inf")


def _text(path: Path) -> str:
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "there is no such file"
            raise StudyError(f"{path}: {what}.")
        if path.stat().st_size > LARGEST:
            raise StudyError(f"{path}: larger than {LARGEST // 1024**2} MB: not of a study.")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror or error}).") from None
    except UnicodeDecodeError as error:
        raise StudyError(f"{path}: is not UTF-8 text ({error.reason}).") from None


def _plain(value: Any) -> Any:
    """Return a value as JSON has it: numbers of numpy and tuples turned, NaN and infinity null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and (value != value or abs(value) == _INF):
        return None
    return value


def _umask() -> int:
    """Return the process's umask, which can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
