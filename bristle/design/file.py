"""The design file: TOML in, a checked task out.

schema = 1
kind = "lpv"                     # or "hinf", "lqg"; the rest may be left out
building = "my_building.toml"    # else the paper's model
device = "brace"                 # what is commanded; else the damper on the first level
sample_period = 0.002            # s
tau = 2.0                        # hinf, lpv: 1 or more; larger: a slower controller
order = 12                       # hinf, lpv: balanced states to keep; else all

[weights]                        # hinf, lpv
acceleration = { gain = 1.5, corner = 12.0 }           # gain w/(s + w), rad/s
command = { gain = 2.0, zero = 15.0, pole = 50.0 }     # gain (s + zero)/(s + pole)
noise = 0.04                     # m/s2; a weight may also be { numerator, denominator }

[damper]
model = "model.toml"             # or law, parameters = { f_c = 1.3 }, effects = ["stribeck"]
v_max = 8.0                      # V
known_to = 0.4                   # m/s, the largest speed of the data behind the model

[scheduling]                     # lpv
grid = [0.0, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3]        # m/s
varies = "none"                  # or "X", "Y": which Lyapunov matrix follows the speed
rate = 1.0                       # m/s2

[passive]                        # dampers at other places, which are not commanded
damper = { damping = 80.0, stiffness = 650.0 }         # N.s/m, N/m; "damper": on the first level

[lqg]                            # lqg: acceleration, drift, force, ground, noise
force = 0.2
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from difflib import get_close_matches
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar

from ..data.model import read_model
from ..errors import BristleError, DesignError, StudyError
from ..physics.building import Building, paper_building, read_building
from ..physics.laws import DEFAULT_OF_DESIGN
from .passive import Share
from .sliding import Damper
from .task import Scheduling, Task
from .weights import LqgWeights, Weight, Weights

T = TypeVar("T")

SCHEMA = 1
_TABLES = {"hinf": {"weights", "damper"}, "lpv": {"weights", "damper", "scheduling"}}
_TABLES["lqg"] = {"lqg", "damper"}
_NO_NUMBERS = ("grid", "rows", "varies")
_TOP = {"schema", "kind", "title", "building", "device", "sample_period", "tau", "order", "passive"}
_WEIGHT_FORMS: dict[frozenset[str], Callable[..., Weight]] = {
    frozenset({"gain", "corner"}): Weight.low_pass,
    frozenset({"gain", "zero", "pole"}): Weight.lead,
    frozenset({"numerator", "denominator"}): lambda numerator, denominator: Weight(
        tuple(numerator), tuple(denominator)
    ),
}


def read_task(path: str | Path) -> Task:
    """Return the task of a design file.

    Raises
    ------
    DesignError
        Naming the file, the table and what would be right.
    PhysicsError
        If the building's file is wrong.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = tomllib.load(file)
    except OSError as error:
        raise DesignError(f"{path}: cannot be read ({error.strerror}).") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DesignError(f"{path}: not valid TOML: {error}.") from error
    return task_from_data(data, path.parent, str(path))


def task_from_data(
    data: Mapping[str, Any], folder: Path, where: str = "design",
    place: tuple[Building, str] | None = None,
) -> Task:  # fmt: skip
    """Return the task that the content of a design file describes; paths are from `folder`.

    Parameters
    ----------
    data, folder, where
        The content, the folder of its paths, what messages call it.
    place : building and device where the content names none; else the paper's building

    Raises
    ------
    DesignError, PhysicsError
        As `read_task`.
    """
    if data.get("schema") != SCHEMA:
        raise DesignError(f"{where}: schema = {data.get('schema')!r}; this version reads {SCHEMA}.")
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in _TABLES:
        raise DesignError(f"{where}: kind = {kind!r}; there are {', '.join(_TABLES)}.")
    _known(data, _TOP | _TABLES[kind], where)
    for key in ("tau", "order"):
        if kind == "lqg" and key in data:
            raise DesignError(f"{where}: {key} is of hinf and lpv designs; lqg has none.")
    given: dict[str, Any] = {"kind": kind, "title": _text(data, "title", where)}
    for key in ("sample_period", "tau"):
        if key in data:
            given[key] = _number(data[key], key, where)
    if "order" in data:
        given["order"] = _whole(data["order"], "order", where)
    building, usual = place or (paper_building(), "")
    if name := _text(data, "building", where):
        building, usual = read_building(folder / name), ""
    given["building"], given["device"] = building, _text(data, "device", where) or usual
    readers: dict[str, Callable[[Mapping[str, Any], str], Any]] = {
        "weights": _weights,
        "damper": lambda table, at: _damper(table, folder, at),
        "scheduling": _scheduling,
        "lqg": lambda table, at: _plain(LqgWeights, table, at),
        "passive": _passive,
    }
    for name in sorted((_TABLES[kind] | {"passive"}) & set(data)):
        if not isinstance(data[name], dict):
            raise DesignError(f"{where}: {name} must be a table, [{name}].")
        at = f"{where} [{name}]"
        given[name] = _located(partial(readers[name], data[name], at), at)
    return _located(lambda: Task(**given), where)


def damper_from_model(
    path: str | Path, v_max: float = 8.0, known_to: float | None = None
) -> Damper:
    """Return the damper of a model.toml: its law with the effects that act in a damper.

    Parameters
    ----------
    path : the file, as a study writes it
    v_max : largest voltage [V]
    known_to : largest speed [m/s] of the data behind the model, None where nobody says

    Raises
    ------
    DesignError
        With every mistake of the file and its line.
    """
    try:
        model = read_model(Path(path))
    except StudyError as error:
        raise DesignError(str(error)) from None
    inside = model.at("damper", bench=not model.building)
    on = tuple(inside.effects)
    return _located(lambda: Damper(model.law, inside.values(), on, v_max, known_to), str(path))


def _weights(table: Mapping[str, Any], where: str) -> Weights:
    _known(table, {"acceleration", "command", "noise"}, where)
    given: dict[str, Any] = {
        name: _weight(table[name], f"{where} {name}")
        for name in ("acceleration", "command")
        if name in table
    }
    if "noise" in table:
        given["noise"] = _number(table["noise"], "noise", where)
    return Weights(**given)


def _weight(table: Any, where: str) -> Weight:
    form = _WEIGHT_FORMS.get(frozenset(table)) if isinstance(table, dict) else None
    if form is None:
        forms = "; ".join("{ " + ", ".join(sorted(keys)) + " }" for keys in _WEIGHT_FORMS)
        raise DesignError(f"{where}: a weight is one of {forms}.")
    values: dict[str, Any] = {}
    for name, value in table.items():
        if name in ("numerator", "denominator"):
            if not isinstance(value, list):
                raise DesignError(f"{where}: {name} must be a list, highest power of s first.")
            values[name] = [_number(v, name, where) for v in value]
        else:
            values[name] = _number(value, name, where)
    return form(**values)


def _damper(table: Mapping[str, Any], folder: Path, where: str) -> Damper:
    _known(table, {"law", "parameters", "effects", "model", "v_max", "known_to"}, where)
    limits = {
        name: _number(table[name], name, where) for name in ("v_max", "known_to") if name in table
    }
    if "model" in table:
        if {"law", "parameters", "effects"} & set(table):
            raise DesignError(f"{where}: give either model or law, parameters, effects.")
        return damper_from_model(folder / _text(table, "model", where), **limits)
    parameters, effects = table.get("parameters", {}), table.get("effects", [])
    if not isinstance(parameters, dict) or not isinstance(effects, list):
        raise DesignError(
            f"{where}: parameters must be a table of numbers, effects a list of names."
        )
    values = {str(name): _number(value, str(name), where) for name, value in parameters.items()}
    law = _text(table, "law", where) or DEFAULT_OF_DESIGN
    return Damper(law, values, tuple(map(str, effects)), **limits)


def _passive(table: Mapping[str, Any], where: str) -> dict[str, Share]:
    shares = {}
    for name, share in table.items():
        if not isinstance(share, dict):
            raise DesignError(f"{where}: {name} must be {{ damping = ..., stiffness = ... }}.")
        _known(share, set(Share._fields), f"{where} {name}")
        shares[name] = Share(
            **{key: _number(value, key, f"{where} {name}") for key, value in share.items()}
        )
    return shares


def _scheduling(table: Mapping[str, Any], where: str) -> Scheduling:
    given = dict(table)
    if "grid" in given:
        if not isinstance(given["grid"], list):
            raise DesignError(f"{where}: grid must be a list of speeds [m/s].")
        given["grid"] = tuple(_number(value, "grid", where) for value in given["grid"])
    if "rows" in given:
        given["rows"] = _whole(given["rows"], "rows", where)
    return _plain(Scheduling, given, where)


def _plain(kind: type[T], table: Mapping[str, Any], where: str) -> T:
    """Return a dataclass of numbers; what is not a number there is taken as it is."""
    _known(table, {f.name for f in fields(kind)}, where)  # type: ignore[arg-type]
    return kind(
        **{
            name: value if name in _NO_NUMBERS else _number(value, name, where)
            for name, value in table.items()
        }
    )


def _located(make: Callable[[], T], where: str) -> T:
    """Return what `make` makes; put the place in front of a design error that lacks it."""
    try:
        return make()
    except BristleError as error:
        if not isinstance(error, DesignError) or str(error).startswith(where.split(" [")[0]):
            raise
        raise DesignError(f"{where}: {error}") from None


def _known(table: Mapping[str, Any], known: set[str], where: str) -> None:
    for key in table:
        if key not in known:
            close = get_close_matches(key, known, n=1)
            hint = f' Did you mean "{close[0]}"?' if close else ""
            raise DesignError(
                f"{where}: unknown key {key!r}; there are {', '.join(sorted(known))}.{hint}"
            )


def _number(value: Any, key: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
        raise DesignError(f"{where}: {key} must be a finite number, found {value!r}.")
    return float(value)


def _whole(value: Any, key: str, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise DesignError(f"{where}: {key} must be a whole number, found {value!r}.")
    return value


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise DesignError(f"{where}: {key} must be a text, found {value!r}.")
    return value
