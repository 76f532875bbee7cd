"""A building with some of its numbers changed: as data, and as a file for a Structure."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.config import toml_content
from ..core.toml_write import toml_key, toml_value
from ..errors import PhysicsError
from ..physics.building import PAPER, from_data
from ..scenario.scenario import Component


def changed(component: Component, values: Mapping[str, object]) -> dict[str, Any]:
    """Return a Structure's building data with numbers changed, checked.

    Parameters
    ----------
    component : Component
        A Structure.
    values : mapping
        "masses.2" (counted from 0, lowest level first), "rayleigh.alpha" ... to the number.

    Raises
    ------
    PhysicsError
        If there is no such number, or the building is none with it.
    """
    data = copy.deepcopy(toml_content(component.building) if component.building else PAPER)
    for path, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise PhysicsError(f"building {path} = {value!r} must be a number.")
        *way, last = path.split(".")
        place: Any = data
        for key in way:
            place = _within(place, key, path)
        if isinstance(_within(place, last, path), dict | list | str | bool):
            raise PhysicsError(f"building {path} is not a single number.")
        place[int(last) if isinstance(place, list) else last] = float(value)
    from_data(data, "building")
    return data


def _within(place: Any, key: str, path: str) -> Any:
    if isinstance(place, list) and key.isdigit() and int(key) < len(place):
        return place[int(key)]
    if isinstance(place, dict) and key in place:
        return place[key]
    there = f"0 to {len(place) - 1}" if isinstance(place, list) else ", ".join(place or ())
    raise PhysicsError(f"building {path}: {key!r} is not there; there is {there}.")


def write(data: Mapping[str, Any], path: Path) -> None:
    """Write building data as TOML: its values are numbers, texts, lists and one level of tables."""
    text = "".join(f"{toml_key(key)} = {toml_value(value)}\n" for key, value in data.items())
    path.write_text(text, encoding="utf-8")
