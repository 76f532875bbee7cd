"""Limits of a rig as a user gives them: quantities with units, in rig.toml or as arguments."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from math import isfinite
from pathlib import Path
from typing import Any

from ..data.files import Toml
from ..errors import StudyError, UnitError
from ..findings import unknown, written
from ..physics.drive import DRIVES, VOLTAGE
from ..units import convert
from .motions import COMMANDS, MOTIONS
from .rig_limits import SIZES, RigLimits

_NAMES = tuple(one.name for one in fields(RigLimits))


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
    for name in given:
        if name not in _NAMES:
            raise StudyError(unknown("limit", name, _NAMES))
    return {name: _read(name, value, drive) for name, value in given.items()}


def read_quantity(text: str | float, unit: str, what: str) -> float:
    """Return a quantity [SI] from a number with its unit, such as "20 mm".

    Raises
    ------
    StudyError
        If it is no number with a unit of that kind.
    """
    right = f'a number with its unit is right, such as "{_example(unit)}"'
    found = _QUANTITY.fullmatch(str(text))
    if found is None or (isinstance(text, str) and not found[2]):
        raise StudyError(f"{what} = {written(text)}: {right}.")
    try:
        value = convert(float(found[1]), found[2] or unit, unit)
    except UnitError as error:
        raise StudyError(f"{what} = {written(text)}: {right} ({error}).") from None
    if not isfinite(value):
        raise StudyError(f"{what} = {written(text)}: {right}.")
    return value


_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
"""A number, and its unit if there is one."""


def _example(unit: str) -> str:
    table = {"m": "20 mm", "m/s": "200 mm/s", "N": "2 kN", "Hz": "500 Hz", "J": "200 J"}
    return table.get(unit, f"10 {unit}")


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
    toml = Toml(path)
    toml.schema()
    toml.known((), toml.data, ("schema", "limits", "damper", "noise"))
    table = toml.table((), toml.data, "limits")
    toml.known(("limits",), table, _NAMES)
    out: dict[str, Any] = {}
    for key, value in table.items():
        if key in _NAMES:
            try:
                out[key] = _read(key, value, drive)
            except StudyError as error:
                toml.error(("limits", key), str(error))
    toml.check()
    return out


def _read(name: str, value: Any, drive: str) -> Any:
    """Return a limit [SI] from what a user gives for it."""
    unit = DRIVES.get(drive, VOLTAGE).unit
    if name in ("band", "command", "levels"):
        return _several(value, "Hz" if name == "band" else unit, name)
    if name in ("motions", "commands"):
        return _kinds(value, name)
    if name == "runs":
        return _whole(value)
    return read_quantity(value, f"{unit}/s" if name == "slew" else SIZES[name], name)


def _several(value: Any, unit: str, what: str) -> tuple[float, ...]:
    """Return the quantities of a list."""
    right = '["0.2 Hz", "10 Hz"]' if unit == "Hz" else f'["0 {unit}", "5 {unit}"]'
    if not isinstance(value, list | tuple) or not value:
        raise StudyError(f"{what} is {_no_list(value)}; a list is right, such as {right}.")
    if what != "levels" and len(value) != 2:
        raise StudyError(f"{what} is a list of {len(value)}; two are right, such as {right}.")
    return tuple(read_quantity(one, unit, what) for one in value)


def _no_list(value: Any) -> str:
    return written(value) if value or not isinstance(value, list | tuple) else "empty"


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise StudyError(f"runs is {written(value)}; a whole number is right.")
    return value


def _kinds(value: Any, what: str) -> tuple[str, ...]:
    """Return the names of waveforms."""
    known = MOTIONS if what == "motions" else COMMANDS
    if not isinstance(value, list | tuple) or not value:
        raise StudyError(f'{what} is {_no_list(value)}; a list is right, such as ["sine"].')
    for one in value:
        if one not in known or one == "record":
            raise StudyError(unknown(what[:-1], one, [name for name in known if name != "record"]))
    return tuple(value)
