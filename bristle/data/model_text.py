"""A model as the text of a model.toml, with the comments of the file that it replaces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..physics.drive import VOLTAGE
from ..physics.forms import split_form
from .correlation import set_correlation
from .files import write_whole
from .model import VALUE, StudyModel, Value, table_names


def write_model(path: Path, model: StudyModel) -> None:
    """Write a model.toml; comments of the file that it replaces stay."""
    write_whole(path, model_text(model, path))


def model_text(model: StudyModel, beside: Path | None = None) -> str:
    """Return a model as TOML, on top of an older file's comments where there is one."""
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    document = tomlkit.document()
    if beside is not None and beside.is_file():
        try:
            document = tomlkit.parse(beside.read_text(encoding="utf-8-sig"))
        except (TOMLKitError, OSError, UnicodeDecodeError):
            document = tomlkit.document()
    document["schema"] = 1
    law, form, knots = split_form(model.law)
    document["law"] = law
    _set_or_drop(document, "command", form)
    _set_or_drop(document, "command_knots", list(knots) or "")
    _set_or_drop(document, "building", model.building)
    _set_or_drop(document, "drive", "" if model.drive == VOLTAGE.name else model.drive)
    for key in ("parameters", "effects"):
        if key not in document:
            document[key] = tomlkit.table(is_super_table=True)
    _update(document["parameters"], _listed(model.parameters, table_names(model.law)), False)
    effects = document["effects"]
    for name in [name for name in effects if name not in model.effects]:
        del effects[name]
    for name, values in model.effects.items():
        if name not in effects:
            effects[name] = tomlkit.table()
        if "parameters" not in effects[name]:
            effects[name]["parameters"] = tomlkit.inline_table()
        _update(effects[name]["parameters"], _listed(values, table_names("", name)), True)
    if not model.effects:
        del document["effects"]
    set_correlation(document, model.correlation, model.uncertain())
    return tomlkit.dumps(document)


def _listed(
    values: Mapping[str, Value], tables: Mapping[str, tuple[str, ...]]
) -> dict[str, dict[str, Any] | list[dict[str, Any]]]:
    """Return values as a file has them: those of a table as one list."""
    inside = {name for names in tables.values() for name in names}
    plain = {name: _as_toml(value) for name, value in values.items() if name not in inside}
    rows = {
        table: [_as_toml(values[name]) for name in names]
        for table, names in tables.items()
        if set(names) <= set(values)
    }
    return {**plain, **rows}


def _update(
    table: Any, wanted: Mapping[str, dict[str, Any] | list[dict[str, Any]]], inline: bool
) -> None:
    import tomlkit

    for name in [name for name in table if name not in wanted]:
        del table[name]
    for name, content in wanted.items():
        if isinstance(content, list):
            if name not in table or table[name] != content:
                table[name] = tomlkit.array()
                for row in content:
                    entry = tomlkit.inline_table()
                    entry.update(row)
                    table[name].append(entry)
            continue
        if name not in table:
            table[name] = tomlkit.inline_table() if inline else tomlkit.table()
        for key in VALUE.keys:
            _set_or_drop(table[name], key, content.get(key, ""))


def _set_or_drop(table: Any, key: str, value: Any) -> None:
    if value == "":
        table.pop(key, None)
    elif key not in table or table[key] != value:
        table[key] = value


def _as_toml(value: Value) -> dict[str, Any]:
    found: dict[str, Any] = {"value": value.value, "unit": value.unit}
    if value.std is not None and value.std == value.std and value.std != float("inf"):
        found["std"] = value.std
    return {**found, "low": value.low, "high": value.high, "free": value.free} | {
        "origin": value.origin
    }
