"""model.toml: a law with its parameters and the effects that were added, each value with a source.

schema = 1
law = "lugre"

[parameters.sigma_a]
value = 650.0
unit = "N/m"
std = 12.0
origin = "identified"

[effects.gas_spring]
parameters = { k = { value = 81.2, unit = "N/m", std = 3.0 } }

[correlation]
parameters = ["sigma_a", "gas_spring.k"]
rows = [[1.0], [-0.42, 1.0]]

`command = "quadratic"`, or `command = "table"` with `command_knots = [0.0, 1.5, 3.0]` [V], beside
the law is a form that was chosen (`physics.forms`); `StudyModel.law` names both together.
`correlation` is how the errors of identified parameters go together (`data.correlation`); files
without it open as before. `data.study_model` is what is read, `data.model_text` writes the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import UnitError
from ..findings import unknown, written
from ..lines import KeyPath
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.effect import EFFECTS, exclude, laws_joined, plain_name
from ..physics.laws import LAWS, base_and_variant, law_names
from ..physics.parameter import Parameter
from ..physics.user import waiting, why_left_out
from ..units import convert
from .command_form import FORM_KEYS, law_in_form
from .correlation import read_correlation
from .declared import declared_of, defaults_of
from .declared import table_names as table_names
from .files import Toml
from .model_value import ORIGINS as ORIGINS
from .model_value import VALUE_KEYS as VALUE_KEYS
from .model_value import Value as Value
from .model_value import as_written, waiting_law
from .study_model import StudyModel as StudyModel
from .study_model import new_model as new_model

_KEYS = ("schema", "law", *FORM_KEYS, "building", "drive", "parameters", "effects", "correlation")


def read_model(path: Path, study: Path | None = None, *, to_show: bool = False) -> StudyModel:
    """Return the model in a model.toml; what is missing takes the law's values, free.

    Parameters
    ----------
    path : path
        The file.
    study : path, optional
        The folder where its building and its own effects are; else that of the file.
    to_show : bool
        Whether the model is only to be shown: then an effect or law whose code must not run yet is
        there with the values of the file.

    Raises
    ------
    StudyError
        With every mistake of the file and its line.
    TrustError
        If the model has an effect or law whose code must not run yet.
    """
    toml = Toml(path)
    data = toml.data
    toml.schema()
    toml.known((), data, _KEYS)
    beside = study or path.parent
    law = toml.text((), data, "law")
    only_shown = _unusable_law(toml, law, beside / "laws", to_show)
    law = law_in_form(toml, data, law, known=not only_shown)
    drive = toml.text((), data, "drive", VOLTAGE.name)
    if drive not in DRIVES:
        toml.error(("drive",), unknown("drive", drive, DRIVES))
        drive = VOLTAGE.name
    only_shown = [law] if only_shown else []
    given = toml.table((), data, "parameters")
    if only_shown:
        parameters = as_written(toml, ("parameters",), given)
    else:
        parameters = _values(toml, ("parameters",), given, (law, ""), drive)
    base = "" if only_shown else base_and_variant(law)[0].name
    effects, untrusted = _effects(toml, (base, drive), beside / "effects", to_show)
    only_shown += untrusted
    _exclusions(toml, [name for name in effects if name not in only_shown])
    building = toml.text((), data, "building")
    if building and not (beside / building).is_file():
        toml.error(("building",), f"there is no file {beside / building}.")
    model = StudyModel(law, parameters, effects, building, tuple(only_shown), drive=drive)
    toml.check()  # else what is wrong with an effect would be said again of its correlation
    correlation = None
    if "correlation" in data:
        correlation = read_correlation(toml, list(model.flat()), model.uncertain())
    toml.check()
    return replace(model, correlation=correlation)


def _unusable_law(toml: Toml, law: str, folder: Path, to_show: bool) -> list[str]:
    """Return the law's name in a list where its code must not run yet, nothing where it may."""
    if law in law_names():
        return []
    untrusted = waiting_law(folder, law)
    if untrusted and not to_show:
        raise untrusted
    if untrusted:
        return [law]
    why = why_left_out(folder / f"{law}.py") if law else ""
    toml.error(("law",), why or unknown("law", law, law_names()))
    toml.check()
    return []


def _effects(
    toml: Toml, joined: tuple[str, str], folder: Path, to_show: bool
) -> tuple[dict[str, dict[str, Value]], list[str]]:
    """Return the values of all effects, and the names of those whose code must not run yet.

    Parameters
    ----------
    toml : the file
    joined : the law that they join, and the model's drive
    folder : where the user's own effects are
    to_show : whether those that must not run are there as well, else TrustError is raised
    """
    effects: dict[str, dict[str, Value]] = {}
    only_shown = []
    for name, table in toml.table((), toml.data, "effects").items():
        own = folder / f"{name}.py"
        untrusted = waiting(own) if name not in EFFECTS else None
        if untrusted and not to_show:
            raise untrusted
        if untrusted:
            own_values = table.get("parameters") if isinstance(table, dict) else None
            effects[name] = as_written(toml, ("effects", name, "parameters"), own_values)
            only_shown.append(name)
            continue
        found = _effect(toml, name, table, joined, own)
        if found is not None:
            effects[name] = found
    return effects, only_shown


def _effect(
    toml: Toml, name: str, table: Any, joined: tuple[str, str], own_file: Path
) -> dict[str, Value] | None:
    """Return the values of an effect; `joined` is the law that it joins, and the model's drive."""
    keys = ("effects", name)
    law, drive = joined
    if name not in EFFECTS:
        why = why_left_out(own_file)
        toml.error(keys, why or unknown("effect", name, sorted(EFFECTS)))
        return None
    if not isinstance(table, dict):
        toml.error(keys, f"is {written(table)}; a table is right.")
        return None
    if law and EFFECTS[name].sites == ("damper",) and not EFFECTS[name].joins(LAWS[law]):
        joins = ", ".join(laws_joined(EFFECTS[name]))
        toml.error(keys, f"{name} cannot join the law {law}; it joins {joins}.")
    toml.known(keys, table, ("parameters",))
    own = toml.table(keys, table, "parameters")
    return _values(toml, (*keys, "parameters"), own, (law, name), drive)


def _exclusions(toml: Toml, effects: list[str]) -> None:
    for name in effects:
        for other in effects:
            if plain_name(other) in EFFECTS[name].excludes and exclude(name, other):
                toml.error(("effects", name), f"{name} and {other} cannot be joined: drop one.")


def _values(
    toml: Toml, keys: KeyPath, table: Mapping[str, Any], owner: tuple[str, str], drive: str
) -> dict[str, Value]:
    """Return the values of an owner, (law, "") or (law, effect), that stand in a table."""
    declared, out = declared_of(*owner, drive), defaults_of(*owner, drive)
    tables = table_names(*owner)
    for name, own in table.items():
        if name in tables:
            out.update(_table(toml, (*keys, name), own, tables[name], declared, out))
        elif name not in declared:
            toml.error((*keys, name), unknown("parameter", name, [*declared, *tables]))
        elif not isinstance(own, dict):
            toml.error((*keys, name), f"{name} is {written(own)}; {{ value = ... }} is right.")
        else:
            out[name] = _value(toml, (*keys, name), own, declared[name], out[name])
    return out


def _table(
    toml: Toml, keys: KeyPath, given: Any, names: tuple[str, ...],
    declared: Mapping[str, Parameter], defaults: Mapping[str, Value],
) -> dict[str, Value]:  # fmt: skip
    """Return the values of a table: a list of numbers, or of what a parameter's table may say."""
    if not isinstance(given, list) or len(given) != len(names):
        right = f"a list of {len(names)} values, one per knot, is right"
        toml.error(keys, f"{keys[-1]} is {written(given)}; {right}.")
        return {}
    out = {}
    for name, own in zip(names, given, strict=True):
        entry = own if isinstance(own, dict) else {"value": own}
        out[name] = _value(toml, (*keys[:-1], name), entry, declared[name], defaults[name])
    return out


def _value(
    toml: Toml, keys: KeyPath, table: Mapping[str, Any], declared: Parameter, default: Value
) -> Value:
    toml.known(keys, table, VALUE_KEYS)
    name = str(keys[-1])
    unit = toml.text(keys, table, "unit", declared.unit) or "1"
    try:
        low, high = (convert(bound, declared.unit, unit) for bound in declared.bounds)
        value = convert(default.value, declared.unit, unit)
    except UnitError as error:
        toml.error((*keys, "unit"), f"{name}: {error}")
        return default
    bounds = low, high
    given = {key: toml.number(keys, table, key) for key in ("value", "low", "high", "std")}
    value = value if given["value"] is None else given["value"]
    low = low if given["low"] is None else given["low"]
    high = high if given["high"] is None else given["high"]
    slack = 1e-9 * max(abs(bounds[0]), abs(bounds[1]))
    if low < bounds[0] - slack or high > bounds[1] + slack:
        allowed = f"{bounds[0]:g} to {bounds[1]:g} {unit}"
        toml.error(keys, f"{name}: {low:g} to {high:g} leaves what is physical, {allowed}.")
    if not low <= value <= high:
        toml.error((*keys, "value"), f"{name} = {value:g} is outside {low:g} to {high:g} {unit}.")
    if given["std"] is not None and given["std"] < 0.0:
        toml.error((*keys, "std"), f"std = {given['std']:g}; 0 or a positive number is right.")
    free = table.get("free", default.free)
    if not isinstance(free, bool):
        toml.error((*keys, "free"), f"free = {written(free)}; true or false is right.")
    origin = toml.text(keys, table, "origin", "assumed")
    if origin not in ORIGINS:
        toml.error((*keys, "origin"), unknown("origin", origin, ORIGINS))
    return Value(value, unit, low, high, bool(free), given["std"], origin)
