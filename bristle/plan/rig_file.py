"""Limits of a rig as a user gives them: quantities with units, in rig.toml or as arguments."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any

from ..core.config import Document, Key, Spec
from ..errors import StudyError, UnitError
from ..findings import unknown, written
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.laws import DEFAULT, law_names
from ..units import convert
from .motions import COMMANDS, MOTIONS
from .rig_limits import SIZES, RigLimits

_NOISE = {"displacement": "m", "velocity": "m/s", "force": "N"}
_EXAMPLES = {"m": "20 mm", "m/s": "200 mm/s", "N": "2 kN", "Hz": "500 Hz", "J": "200 J"}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
"""A number, and its unit if there is one."""


def limits_given(given: Mapping[str, Any], drive: str = "") -> dict[str, Any]:
    """Return limits as arguments of `RigLimits`, from what a user gives for each of them.

    Parameters
    ----------
    given : by name, numbers in SI or texts with a unit, as in rig.toml
    drive : the channel of the command, "" where none is known: its unit is that of levels

    Raises
    ------
    StudyError
        If there is no such limit, or a value is none.
    """
    document = Document("as given", StudyError, given)
    found = document.read(_limits(drive), ("limits",), given)
    document.check()
    return {name: found[name] for name in given}


def read_rig(path: Path, drive: str = "") -> dict[str, Any]:
    """Return the limits that a rig.toml gives, as arguments of `RigLimits`.

    Parameters
    ----------
    path : the file
    drive : the channel of the command, "" where none is known: its unit is that of levels

    Raises
    ------
    StudyError
        With every mistake of the file and its line.
    """
    document = Document(path, StudyError)
    limits = read_sheet(document, drive)["limits"]
    document.check()
    return {name: limits[name] for name in document.data.get("limits", {})}


def read_sheet(document: Document, drive: str) -> dict[str, Any]:
    """Return the tables of a rig.toml: limits, damper and noise in SI, None for what is not given.

    Parameters
    ----------
    document : takes what is wrong
    drive : the channel of the command
    """
    damper = Spec({
        "max_force": Key(partial(_positive, "N"), None),
        "law": Key(str, DEFAULT, choices=law_names()),
        "command": Key(str, VOLTAGE.name, choices=DRIVES),
    })  # fmt: skip
    noise = Spec({name: Key(partial(_positive, unit), None) for name, unit in _NOISE.items()})
    return document.read(Spec({"limits": _limits(drive), "damper": damper, "noise": noise}))


def _limits(drive: str) -> Spec:
    unit = DRIVES.get(drive, VOLTAGE).unit
    kinds: dict[str, Any] = {
        **{name: partial(read_quantity, unit=unit) for name, unit in SIZES.items()},
        "slew": partial(read_quantity, unit=f"{unit}/s"),
        "band": partial(_several, "Hz", 2), "command": partial(_several, unit, 2),
        "levels": partial(_several, unit, 0), "runs": int,
        "motions": partial(_kinds, "motion", MOTIONS),
        "commands": partial(_kinds, "command", COMMANDS),
    }  # fmt: skip
    return Spec({one.name: Key(kinds[one.name], None) for one in fields(RigLimits)})


def read_quantity(given: object, unit: str) -> float:
    """Return a quantity [SI] from a number with its unit, such as "20 mm".

    Raises
    ------
    StudyError
        If it is no number with a unit of that kind, in words that follow its name.
    """
    right = f'expected a number with its unit, such as "{_EXAMPLES.get(unit, f"10 {unit}")}"'
    found = _QUANTITY.fullmatch(str(given))
    value, why = float("nan"), ""
    if found and (found[2] or not isinstance(given, str)):
        try:
            value = convert(float(found[1]), found[2] or unit, unit)
        except UnitError as error:
            why = f" ({error})"
    if not isfinite(value):
        raise StudyError(f"= {written(given)}: {right}{why}.")
    return value


def _positive(unit: str, given: object) -> float:
    if (found := read_quantity(given, unit)) <= 0.0:
        raise StudyError(f"= {written(given)}: expected more than 0 {unit}.")
    return found


def _several(unit: str, count: int, given: object) -> tuple[float, ...]:
    """Return the quantities of a list of so many, or of any number where `count` is 0."""
    if not isinstance(given, list | tuple) or not given or len(given) != (count or len(given)):
        right = '["0.2 Hz", "10 Hz"]' if unit == "Hz" else f'["0 {unit}", "5 {unit}"]'
        size = f"a list of {count}" if count else "a list"
        raise StudyError(f"is {_shown(given)}: expected {size}, such as {right}.")
    return tuple(read_quantity(one, unit) for one in given)


def _kinds(what: str, known: Mapping[str, object], given: object) -> tuple[str, ...]:
    """Return the names of waveforms."""
    if not isinstance(given, list | tuple) or not given:
        raise StudyError(f'is {_shown(given)}: expected a list, such as ["sine"].')
    names = [name for name in known if name != "record"]
    wrong = next((one for one in given if one not in names), None)
    if wrong is not None:
        raise StudyError(f"is wrong: {unknown(what, str(wrong), names)}")
    return tuple(given)


def _shown(given: object) -> str:
    if not isinstance(given, list | tuple):
        return written(given)
    return f"a list of {len(given)}" if given else "empty"
