"""What a user chooses, as text: `WHAT,NAME=VALUE,...`, such as `Skyhook,gain=100`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from ..errors import ScenarioError
from ..findings import written
from ..scenario.document import parse_override

Value = bool | int | float | str
Given = str | Path | Sequence[str | Path] | Mapping[str, str | Path]
"""What a caller may give as a list: one text or file, several, or several by their labels."""

_SETTING = re.compile(r",(?=\s*[A-Za-z_][\w.]*\s*=)")
_FILES = (".json", ".toml", ".py", ".fmu", ".csv", ".at2", ".txt")


class Choice(NamedTuple):
    """A thing that was chosen.

    `what` is a name or a file, `settings` its values, `label` what tables call it.
    """

    what: str
    settings: dict[str, Value]
    label: str

    @property
    def is_file(self) -> bool:
        """Whether the text names a file rather than something of the library."""
        path = Path(self.what)
        return path.suffix.lower() in _FILES or len(path.parts) > 1


def choice_of(text: object, where: str, label: str = "") -> Choice:
    """Return what a text chooses.

    Parameters
    ----------
    text : `WHAT,NAME=VALUE,...`; values as in TOML; `label=` names it in tables
    where : what the text was given as, for messages
    label : in place of one in the text

    Raises
    ------
    ScenarioError
        If nothing is named, or a setting is given twice.
    """
    if not isinstance(text, str | Path) or not str(text).strip():
        raise ScenarioError(f"{where}: {written(text)}; a name or a file is right.")
    what, *pieces = _SETTING.split(str(text).strip())
    settings: dict[str, Value] = {}
    for piece in pieces:
        name, value = parse_override(piece)
        if name in settings:
            raise ScenarioError(f'{where} "{text}": {name} is given twice; once is right.')
        settings[name] = value
    chosen = label or str(settings.pop("label", ""))
    settings.pop("label", None)
    return Choice(what, settings, chosen)


def choices_of(given: Given, where: str) -> list[Choice]:
    """Return what a list of texts, or a mapping of labels to texts, chooses.

    Raises
    ------
    ScenarioError
        As `choice_of`.
    """
    if isinstance(given, Mapping):
        return [choice_of(text, where, str(label)) for label, text in given.items()]
    texts = [given] if isinstance(given, str | Path) else list(given)
    return [choice_of(text, where) for text in texts]


def said(choice: Choice) -> str:
    """Return what tables call a choice without a label: its name with its settings."""
    name = Path(choice.what).stem if choice.is_file else choice.what
    return " ".join([name, *(f"{key}={value}" for key, value in choice.settings.items())])


def number(value: object, name: str, where: str) -> float:
    """Return a setting as a number.

    Raises
    ------
    ScenarioError
        If it is none; `where` says what was chosen, `name` the setting.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ScenarioError(f"{where}: {name} = {written(value)}; a number is right.")
    return float(value)


def refuse_twice(labels: Sequence[str], where: str, taken: Sequence[str] = ()) -> None:
    """Refuse labels that are given twice, or that tables have for something else.

    Raises
    ------
    ScenarioError
        Naming the label.
    """
    for k, label in enumerate(labels):
        if label in labels[:k] or label in taken:
            raise ScenarioError(
                f'{where}: "{label}" is there twice; WHAT,label=NAME gives one another name.'
            )
