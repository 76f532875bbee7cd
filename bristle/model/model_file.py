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
the law is a form that was chosen (`physics.forms`); `Model.law` names both together.
`correlation` is how the errors of identified parameters go together (`model.model`); files
without it open as before. `model.model` is what is read, `model.model_file` writes the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.config import ANY, Document, Key, Spec
from ..core.files import write_whole
from ..core.text import unknown, written
from ..core.toml_lines import KeyPath
from ..errors import PhysicsError, StudyError, UnitError
from ..physics.drive import DRIVES, VOLTAGE
from ..physics.effect import EFFECTS, exclude, laws_joined, plain_name
from ..physics.forms import FORMS, TABLE_FORM, joined_form, split_form
from ..physics.laws import LAWS, base_and_variant, law_names
from ..physics.parameter import Parameter
from ..units import convert
from ..user_code.load import waiting, why_left_out
from .model import (
    CORRELATION,
    VALUE,
    Fact,
    Model,
    as_written,
    declared_of,
    defaults_of,
    read_correlation,
    set_correlation,
    table_names,
    waiting_law,
)

# The form of the command in a model.toml: the keys `command` and `command_knots`.

FORM_KEYS = {
    "command": Key(str, "", choices=FORMS), "command_knots": Key([float], (), "V")
}  # fmt: skip


def law_in_form(document: Document, found: Mapping[str, Any], law: str, known: bool = True) -> str:
    """Return a law's name with the form of the command that a file names.

    Parameters
    ----------
    document, found : takes what is wrong; what the file holds
    law : the name that stands in it
    known : whether the law is registered; else it is not asked whether it can have the form

    Raises
    ------
    StudyError
        If the form does not suit the law, or the knots are not right.
    """
    form, knots = found["command"], found["command_knots"]
    if knots and form != TABLE_FORM:
        right = f'command = "{TABLE_FORM}" beside them'
        document.error(("command_knots",), f"command_knots are given: expected {right}.")
    document.check()
    try:
        name = joined_form(law, form, knots)
        if known:
            base_and_variant(name)
    except PhysicsError as error:
        document.error(("command",), str(error))
        document.check()
    return name


_SPEC = Spec({
    "law": Key(str, about="the name of a law"), **FORM_KEYS, "building": Key(str, ""),
    "drive": Key(str, VOLTAGE.name, choices=DRIVES),
    "parameters": Spec(each=ANY),
    "effects": Spec(each=Spec({"parameters": Spec(each=ANY)})),
    "correlation": CORRELATION,
})  # fmt: skip


def read_model(path: Path, study: Path | None = None, *, to_show: bool = False) -> Model:
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
    document = Document(path, StudyError)
    found = document.read(_SPEC)
    beside, drive, building = study or path.parent, found["drive"], found["building"]
    law = found["law"] or ""
    only_shown = _unusable_law(document, law, beside / "laws", to_show)
    law = law_in_form(document, found, law, known=not only_shown)
    if only_shown:
        only_shown = [law]
        parameters = as_written(document, ("parameters",), found["parameters"])
    else:
        parameters = _values(document, ("parameters",), found["parameters"], (law, ""), drive)
    base = "" if only_shown else base_and_variant(law)[0].name
    effects, untrusted = _effects(document, found["effects"], (base, drive), beside, to_show)
    only_shown += untrusted
    _exclusions(document, [name for name in effects if name not in only_shown])
    if building and not (beside / building).is_file():
        document.error(("building",), f"there is no file {beside / building}.")
    document.check()  # else what is wrong with an effect would be said again of its correlation
    model = Model(
        law, tuple(effects), drive=drive, building=building, only_shown=tuple(only_shown)
    ).with_facts(parameters)
    for effect, own in effects.items():
        model = model.with_facts({f"{effect}.{name}": fact for name, fact in own.items()})
    correlation = None
    if "correlation" in document.data:
        correlation = read_correlation(
            document, found["correlation"], list(model.facts), model.uncertain()
        )
    document.check()
    return replace(model, correlation=correlation)


def _unusable_law(document: Document, law: str, folder: Path, to_show: bool) -> list[str]:
    """Return the law's name in a list where its code must not run yet, nothing where it may."""
    if law in law_names():
        return []
    untrusted = waiting_law(folder, law)
    if untrusted and not to_show:
        raise untrusted
    if untrusted:
        return [law]
    why = why_left_out(folder / f"{law}.py") if law else ""
    if law:
        document.error(("law",), why or unknown("law", law, law_names()))
    document.check()
    return []


def _effects(
    document: Document, given: Mapping[str, Any], joined: tuple[str, str], beside: Path,
    to_show: bool,
) -> tuple[dict[str, dict[str, Fact]], list[str]]:  # fmt: skip
    """Return the values of all effects, and the names of those whose code must not run yet.

    Parameters
    ----------
    document, given : takes what is wrong; the tables of the effects
    joined : the law that they join, and the model's drive
    beside : the folder where those of the user's own are, in effects
    to_show : whether those that must not run are there as well, else TrustError is raised
    """
    effects: dict[str, dict[str, Fact]] = {}
    only_shown = []
    for name, table in given.items():
        keys, own = ("effects", name), beside / "effects" / f"{name}.py"
        untrusted = waiting(own) if name not in EFFECTS else None
        if untrusted and not to_show:
            raise untrusted
        if untrusted:
            effects[name] = as_written(document, (*keys, "parameters"), table["parameters"])
            only_shown.append(name)
        elif name not in EFFECTS:
            words = why_left_out(own) or unknown("effect", name, sorted(EFFECTS))
            document.error(keys, words)
        elif (
            joined[0]
            and EFFECTS[name].sites == ("damper",)
            and not EFFECTS[name].joins(LAWS[joined[0]])
        ):
            joins = ", ".join(laws_joined(EFFECTS[name]))
            document.error(keys, f"{name} cannot join the law {joined[0]}; it joins {joins}.")
        else:
            effects[name] = _values(
                document, (*keys, "parameters"), table["parameters"], (joined[0], name), joined[1]
            )
    return effects, only_shown


def _exclusions(document: Document, effects: list[str]) -> None:
    for name in effects:
        for other in effects:
            if plain_name(other) in EFFECTS[name].excludes and exclude(name, other):
                document.error(("effects", name), f"{name} and {other} cannot be joined: drop one.")


def _values(
    document: Document, keys: KeyPath, given: Mapping[str, Any], owner: tuple[str, str], drive: str
) -> dict[str, Fact]:
    """Return the values of an owner, (law, "") or (law, effect), that stand in a table."""
    declared, out = declared_of(*owner, drive), defaults_of(*owner, drive)
    tables = table_names(*owner)
    for name, own in given.items():
        here = (*keys, name)
        if name in declared:
            out[name] = _value(document, here, own, declared[name], out[name])
        elif name not in tables:
            document.error(here, unknown("parameter", name, [*declared, *tables]))
        elif not isinstance(own, list) or len(own) != len(tables[name]):
            right = f"a list of {len(tables[name])} values, one per knot"
            document.error(here, f"{name} is {written(own)}: expected {right}.")
        else:
            for index, (one, entry) in enumerate(zip(tables[name], own, strict=True)):
                plain = entry if isinstance(entry, dict) else {"value": entry}
                out[one] = _value(document, (*here, index), plain, declared[one], out[one], one)
    return out


def _value(
    document: Document, keys: KeyPath, given: Any, declared: Parameter, default: Fact,
    name: str = "",
) -> Fact:  # fmt: skip
    """Return a parameter's value; `name` where its key is another."""
    name = name or str(keys[-1])
    if not isinstance(given, dict):
        document.error(keys, f"{name} is {written(given)}: expected {{ value = ... }}.")
        return default
    found = document.read(VALUE, keys, given)
    unit = declared.unit if found["unit"] is None else found["unit"] or "1"
    try:
        bounds = low, high = tuple(convert(one, declared.unit, unit) for one in declared.bounds)
        value = convert(default.value, declared.unit, unit)
    except UnitError as error:
        document.error((*keys, "unit"), f"{name}: {error}")
        return default
    value, low, high = (
        usual if found[key] is None else found[key]
        for key, usual in (("value", value), ("low", low), ("high", high))
    )
    slack = 1e-9 * max(abs(bounds[0]), abs(bounds[1]))
    if low < bounds[0] - slack or high > bounds[1] + slack:
        allowed = f"{bounds[0]:g} to {bounds[1]:g} {unit}".removesuffix(" 1")
        document.error(keys, f"{name}: {low:g} to {high:g} leaves what is physical, {allowed}.")
    if not low <= value <= high:
        right = f"{low:g} to {high:g} {unit}".removesuffix(" 1")
        document.error((*keys, "value"), f"{name} = {value:g} is outside {right}.")
    free = default.free if found["free"] is None else found["free"]
    return Fact(value, unit, low, high, free, found["std"], found["origin"])


# A model as the text of a model.toml, with the comments of the file that it replaces.


def write_model(path: Path, model: Model) -> None:
    """Write a model.toml; comments of the file that it replaces stay."""
    write_whole(path, model_text(model, path))


def model_text(model: Model, beside: Path | None = None) -> str:
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
    _update(document["parameters"], _listed(model), False)
    effects = document["effects"]
    for name in [name for name in effects if name not in model.effects]:
        del effects[name]
    for name in model.effects:
        if name not in effects:
            effects[name] = tomlkit.table()
        if "parameters" not in effects[name]:
            effects[name]["parameters"] = tomlkit.inline_table()
        _update(effects[name]["parameters"], _listed(model, name), True)
    if not model.effects:
        del document["effects"]
    set_correlation(document, model.correlation, model.uncertain())
    return tomlkit.dumps(document)


def _listed(model: Model, effect: str = "") -> dict[str, dict[str, Any] | list[dict[str, Any]]]:
    """Return the values of the law or an effect as a file has them; a table is one list."""
    values, tables = model.written_of(effect), table_names(model.law, effect)
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


def _as_toml(value: Fact) -> dict[str, Any]:
    found: dict[str, Any] = {"value": value.value, "unit": value.unit}
    if value.std is not None and value.std == value.std and value.std != float("inf"):
        found["std"] = value.std
    return {**found, "low": value.low, "high": value.high, "free": value.free} | {
        "origin": value.origin
    }
