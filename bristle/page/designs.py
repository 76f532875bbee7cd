"""Design files that the page writes, from the numbers of its form: design/KIND_1.toml and so on.

The page solves nothing: `bristle design` reads such a file, and what it found is beside it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..findings import unknown, written
from .message import RequestError

FOLDER = "design"
KINDS = {"hinf": "el_centro_0p6g_hinf", "lpv": "el_centro_0p6g_lpv"}
"""What may be designed, and the stock scenario in which it acts."""
MOTIONS = ("el_centro_1940_ns", "near_fault_pulse", "stationary_motion")
"""The three ground motions of a closed loop, where no others are chosen."""
PEAK = 0.2
"""Peak [g] to which each of them is scaled at first."""


class Field(NamedTuple):
    """A number of the form: its unit, what it is, its bounds and where it begins."""

    unit: str
    text: str
    low: float
    high: float
    value: float


FIELDS = {
    "acceleration.gain": Field("s2/m", "weight of the top floor's acceleration", 0.05, 20.0, 1.5),
    "acceleration.corner": Field("rad/s", "the acceleration weighs less above", 1.0, 200.0, 12.0),
    "command.gain": Field("", "weight of a fast command", 0.05, 50.0, 2.0),
    "command.zero": Field("rad/s", "a slower command weighs least", 0.5, 200.0, 15.0),
    "command.pole": Field("rad/s", "a faster command weighs in full", 5.0, 1000.0, 50.0),
    "noise": Field("m/s2", "noise of the measured acceleration", 1e-3, 1.0, 0.04),
    "tau": Field("", "larger than 1; the larger, the slower the controller", 1.01, 10.0, 2.0),
}  # fmt: skip
"""The numbers of a design, by what the design file calls them."""

_NAME = re.compile(rf"({'|'.join(KINDS)})_([0-9]{{1,4}})")


def design_name(text: object) -> str:
    """Return a text that names a design of the page; RequestError if it does not."""
    if not isinstance(text, str) or not _NAME.fullmatch(text):
        raise RequestError(f"a design: {written(text)} is no name of one; hinf_1 is right.")
    return text


def kind_of_design(name: str) -> str:
    """Return the kind of a design by its name."""
    return design_name(name).rpartition("_")[0]


def names_of(folder: Path) -> list[str]:
    """Return the designs of a study, the oldest first."""
    found = [
        match for one in (folder / FOLDER).glob("*.toml") if (match := _NAME.fullmatch(one.stem))
    ]
    return [match[0] for match in sorted(found, key=lambda match: int(match[2]))]


def content_of(kind: object, values: object, building: str, up: str = "../") -> dict[str, Any]:
    """Return the content of a design file.

    Parameters
    ----------
    kind : one of `KINDS`
    values : the numbers of `FIELDS` by name; those that are left out are as they begin
    building : file of the study's building, "" for the two-storey model
    up : from the design file to the folder of the study

    Raises
    ------
    RequestError
        If a name or a number is not right.
    """
    if kind not in KINDS:
        raise RequestError(unknown("kind", str(kind), KINDS))
    if not isinstance(values, Mapping):
        raise RequestError("values: NAME to number is right.")
    for name in values:
        if name not in FIELDS:
            raise RequestError(unknown("number of a design", str(name), FIELDS))
    found = {name: _number(name, values.get(name, one.value)) for name, one in FIELDS.items()}
    content: dict[str, Any] = {"schema": 1, "kind": kind, "tau": found["tau"]}
    if building:
        content["building"] = f"{up}{building}"
    weights: dict[str, Any] = {"noise": found["noise"]}
    for name in ("acceleration", "command"):
        own = {key.partition(".")[2]: v for key, v in found.items() if key.startswith(f"{name}.")}
        weights[name] = own
    return {**content, "weights": weights, "damper": {"model": f"{up}model.toml"}}


def values_of(content: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of `FIELDS` that a design file has."""
    flat = {"noise": content.get("weights", {}).get("noise"), "tau": content.get("tau")}
    for name in ("acceleration", "command"):
        for key, value in content.get("weights", {}).get(name, {}).items():
            flat[f"{name}.{key}"] = value
    return {name: float(flat[name]) for name in FIELDS if isinstance(flat.get(name), int | float)}


def write_design(folder: Path, kind: object, values: object, building: str) -> str:
    """Write the next design file of a study; return its name.

    Parameters
    ----------
    folder : of the study
    kind, values, building : as for `content_of`

    Raises
    ------
    RequestError
        As `content_of`.
    StudyError
        If it cannot be written.
    """
    from ..data.files import write_whole  # here: the server starts without numpy

    content = content_of(kind, values, building)
    numbers = [int(name.rpartition("_")[2]) for name in names_of(folder)]
    name = f"{content['kind']}_{max(numbers, default=0) + 1}"
    write_whole(folder / FOLDER / f"{name}.toml", _text(content))
    return name


def _text(content: Mapping[str, Any]) -> str:
    """Return a design file's text: values first, then its tables."""
    lines = [f"{key} = {_value(one)}" for key, one in content.items() if not isinstance(one, dict)]
    for table, rows in content.items():
        if isinstance(rows, dict):
            lines += ["", f"[{table}]", *(f"{key} = {_value(one)}" for key, one in rows.items())]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _number(name: str, value: object) -> float:
    low, high = FIELDS[name].low, FIELDS[name].high
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise RequestError(f"{name}: {written(value)}; a number is right.")
    if not low <= value <= high:
        raise RequestError(f"{name} = {value:g}: {low:g} to {high:g} is right.")
    return float(value)
