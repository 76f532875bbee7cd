"""A scenario as plain data, and what a check knows of it while it reads it."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.config import Document, toml_content
from ..core.finding import Finding, worded
from ..core.text import LIST_AT_MOST, command, nearest, number, unknown, written
from ..core.toml_lines import KeyPath
from ..data import ground_motion_file
from ..errors import PhysicsError, ScenarioError
from ..fmu.catalogue import BuildingData, Made
from ..fmu.component import OUTSIDE, SWITCH
from ..fmu.description import Description, Value, Variable
from ..physics.building import PAPER, from_data
from ..units import Measure

ALGORITHMS = ("gauss-seidel", "midpoint", "midpoint-iterated", "jacobi")
FILE_PARAMETERS = ("record", "file")
"""Parameters that may name a file, relative to the scenario's folder."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A signal that a source plays: no file is needed.

    `time` (n,) s, rising; `values` (n,) in the `unit`, linear between. `quantity` is what they are,
    the title of the column, and `name` that of the file that `toml.save` writes, without its
    ending; "": that of the component.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float64]
    unit: str
    quantity: str = "value"
    name: str = ""

    def __post_init__(self) -> None:
        """Refuse what a file could not hold either.

        Raises
        ------
        PhysicsError
            If there are not two samples at least, all finite, at rising times from 0 or later.
        """
        t, x = self.time, self.values
        wrong = ""
        if t.ndim != 1 or t.shape != x.shape or len(t) < 2:
            wrong = (
                f"times of shape {t.shape} and values of {x.shape}; (n,) twice, n >= 2, is right"
            )
        elif not (np.isfinite(t).all() and np.isfinite(x).all()):
            wrong = "a sample is not finite; every sample needs a value"
        elif t[0] < 0.0 or not (np.diff(t) > 0.0).all():
            wrong = "its times do not rise from 0 s or later"
        if wrong:
            raise PhysicsError(f"signal {self.name or self.quantity}: {wrong}.")


@dataclass
class RunSettings:
    """The run as far as it could be read; None where it could not."""

    stop: float | None = None
    step: float | None = None
    algorithm: str = ALGORITHMS[0]


@dataclass(frozen=True)
class DamperLaw:
    """The law of a damper that a scenario names.

    `name` is the law's, its form with it (see `physics.forms`), `component` what the catalogue
    makes it from, `file` that of a user's own law.
    """

    name: str
    component: str
    file: Path | None = None

    @property
    def shown(self) -> str:
        """What the component is called in messages and titles."""
        return Path(self.component).stem


@dataclass
class Part:
    """A component as far as it could be read; `places` gives the path of each parameter.

    `played` is the unit of a signal's samples where their file tells it and the FMU does not.
    """

    name: str
    path: KeyPath
    kind: str = ""
    file: Path | None = None
    building: Path | None = None
    effects: tuple[Path, ...] = ()
    controller: Path | None = None
    law: DamperLaw | None = None
    step: float | None = None
    description: Description | None = None
    values: dict[str, Value] = field(default_factory=dict)
    signal: Signal | None = None
    played: Measure | None = None
    places: dict[str, KeyPath] = field(default_factory=dict)
    over_step: dict[str, str] = field(default_factory=dict)

    @property
    def variables(self) -> dict[str, Variable]:
        """Variables of the FMU by name; none where it could not be read."""
        return self.description.variables if self.description else {}

    @property
    def ports_command(self) -> str:
        """The command that lists all ports; "" where its law was made for this scenario."""
        return "" if self.law else command("list", "ports", self.kind)

    def value(self, name: str) -> Value | None:
        """Return a parameter's value as set, else its start value, else None."""
        variable = self.variables.get(name)
        return self.values.get(name, variable.start if variable else None)

    def real(self, name: str) -> float | None:
        """Return a parameter's value if it is a number."""
        value = self.value(name)
        return float(value) if isinstance(value, int | float) else None


@dataclass(frozen=True)
class Component:
    """One component of a system.

    `kind` is its name in the catalogue, or what the scenario calls the file of a foreign FMU, whose
    `path` stands then; `values` those that are set, inputs that are held constant included, files
    among them as absolute paths; `signal` what a source plays in place of a file; `building` the
    data of a Structure, or its file, None for the default; `controller` the file of a designed
    controller, None for the one that it carries; `effects` the files of a user's own effects that a
    built-in one carries besides the library's; `step` its own step [s], None for the run's; `law`
    that of a damper where the scenario names it; `over_step` what the scenario says of a foreign
    FMU's ports (see `parameters.choose_over_step`).
    """

    name: str
    kind: str
    description: Description = field(repr=False, compare=False)  # follows from the rest
    values: dict[str, Value] = field(default_factory=dict)
    path: Path | None = None
    building: BuildingData | None = None
    controller: Path | None = None
    effects: tuple[Path, ...] = ()
    law: DamperLaw | None = None
    signal: Signal | None = None
    step: float | None = None
    over_step: dict[str, str] = field(default_factory=dict)

    def made_of(self) -> str:
        """Return what the catalogue makes it from; a law of a user's own is registered then."""
        if self.law is None:
            return self.kind
        if self.law.file is not None:  # this process may not have read it yet
            from ..user_code.load import load_file

            load_file(self.law.file, "law")
        return self.law.component

    def made_with(self) -> Made:
        """Return what the catalogue makes it with."""
        return {
            "building": self.building, "controller": self.controller, "effects": self.effects,
            "ranged": self.ranged,
        }  # fmt: skip

    @property
    def plays(self) -> str:
        """The parameter that names the file which it plays, "" where it plays none."""
        return next((name for name in FILE_PARAMETERS if name in self.description.variables), "")

    @property
    def ranged(self) -> bool:
        """Whether it is a damper that knows the range of its data."""
        return OUTSIDE in self.description.variables

    def value(self, name: str) -> Value | None:
        """Return the value of a parameter: as it is set, else where it starts."""
        return self.values.get(name, self.description.variables[name].start)

    def taken_values(self, only_on: bool = False) -> dict[str, Value]:
        """Return the values that an FMU is given; with `only_on` none of effects that are off.

        A ground motion of another format is a two-column CSV in the user's cache.

        Raises
        ------
        RecordError
            If a ground motion cannot be read.
        """
        values = dict(self.values)
        if self.path is None and self.kind == "GroundMotion" and values.get("record"):
            values["record"] = ground_motion_file(str(values["record"]), Path())
        if only_on and self.path is None:
            off = {*self._effects()} - {*self.effects_on()}
            return {key: one for key, one in values.items() if key.partition(".")[0] not in off}
        return values

    def effects_on(self) -> list[str]:
        """Return the names of the effects that a built-in component has on."""
        return [name for name in self._effects() if self.value(name + SWITCH)]

    def _effects(self) -> list[str]:
        names = self.description.variables
        return [name.removesuffix(SWITCH) for name in names if name.endswith(SWITCH)]

    def with_values(self, given: Mapping[str, Value | Signal]) -> Component:
        """Return it with parameters, a file's signal or numbers of its building changed.

        Raises
        ------
        ScenarioError, PhysicsError
            If it has no such parameter, or a value does not fit.
        """
        values, signal, numbers = dict(self.values), self.signal, {}
        for name, value in given.items():
            variable = self.description.variables.get(name)
            if name.startswith("building."):
                numbers[name.removeprefix("building.")] = value
            elif variable is None:
                raise ScenarioError(f'"{self.name}.{name}": {self.kind} has no such parameter.')
            elif variable.causality not in ("parameter", "input"):
                words = f"is {variable.causality}; only parameters and inputs can be set."
                raise ScenarioError(f"{self.name}.{name} {words}")
            elif not isinstance(value, Signal):
                fits = typed(variable, value)
                if isinstance(fits, Wrong):
                    raise ScenarioError(f"{self.name}.{name} {fits.words}")
                values[name] = fits
                signal = None if name == self.plays else signal
            elif name != self.plays or self.path is not None:
                raise ScenarioError(f'"{self.name}.{name}": {self.kind} plays no signal there.')
            else:
                signal = value
                values.pop(name, None)
                values |= {"kind": "csv"} if "kind" in self.description.variables else {}
        building = changed_building(self.building, numbers) if numbers else self.building
        return replace(self, values=values, signal=signal, building=building)


@dataclass(frozen=True)
class Connection:
    """Component and port that take a value, component and port that give it.

    input = factor output + offset; `transformed` is whether the scenario says so, even if by 1 and
    0: units are its own matter then. `path` leads to its key in the file.
    """

    target: str
    input: str
    source: str
    output: str
    factor: float = 1.0
    offset: float = 0.0
    transformed: bool = False
    path: KeyPath = field(default=(), compare=False, repr=False)

    @property
    def changes(self) -> bool:
        """Whether a value changes on its way."""
        return (self.factor, self.offset) != (1.0, 0.0)

    def given(self, value: float) -> float:
        """Return what the input gets where the output has a value."""
        return self.factor * value + self.offset


@dataclass(frozen=True)
class System:
    """Components that are wired, and a run of them, checked.

    `title` is the scenario's unless overrides changed what runs (see `library.changed_title`);
    `stop` [s] is a whole number of steps of `step` [s]; `algorithm` is one of `ALGORITHMS`, and
    components step in their order. `origin` is the file that it was read from, None where it was
    made; `package` the SSP package that file was unpacked from; `findings` the warnings and notes
    of its check; `overrides` what was laid over the file, `changes` what `with_values` changed of
    that.
    """

    title: str
    stop: float
    step: float
    algorithm: str
    components: Mapping[str, Component]
    wires: tuple[Connection, ...]
    origin: Path | None = field(default=None, compare=False)
    findings: tuple[Finding, ...] = field(default=(), compare=False)
    overrides: dict[str, object] = field(default_factory=dict, compare=False)
    package: Path | None = field(default=None, compare=False)
    changes: Mapping[str, Value | Signal] = field(default_factory=dict, compare=False)

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return round(self.stop / self.step)

    @property
    def where(self) -> str:
        """What messages call it: its file, else its title."""
        return str(self.origin or self.title)

    def remarks(self) -> list[str]:
        """Return the warnings and notes of the check, a line each with its place."""
        name = (self.package or Path(self.where)).name
        return [f"{found.level}: {worded(name, found)}" for found in self.findings]

    def with_values(self, values: Mapping[str, Value | Signal]) -> System:
        """Return it with values by "component.parameter", a Signal for that of a file.

        A number of a building is "structure.building.masses.2", counted from 0.

        Raises
        ------
        ScenarioError, PhysicsError
            If there is no such component or parameter, or a value does not fit.
        """
        given: dict[str, dict[str, Value | Signal]] = {}
        for full, value in values.items():
            name, _, own = plain_target(full).partition(".")
            if name not in self.components:
                raise ScenarioError(f'"{full}": the scenario has no such component.')
            given.setdefault(name, {})[own] = value
        changed = {name: self.components[name].with_values(own) for name, own in given.items()}
        changes = {**self.changes, **{plain_target(full): v for full, v in values.items()}}
        return replace(self, components={**self.components, **changed}, changes=changes)

    def variable(self, name: str) -> Variable | None:
        """Return the variable "component.port", None where there is none."""
        component, own = self.part(name)
        return component.description.variables.get(own) if component else None

    def unit(self, name: str) -> str:
        """Return the unit of a variable, "" where it has none."""
        found = self.variable(name)
        return (found.unit or "") if found else ""

    def part(self, name: str) -> tuple[Component | None, str]:
        """Return the component that the name of a value begins with, and the rest of it."""
        first, _, rest = plain_target(name).partition(".")
        return self.components.get(first), rest


def plain_target(name: str) -> str:
    """Return a name in its short form: "damper.f_c" of "components.damper.parameters.f_c"."""
    first, _, rest = name.removeprefix("components.").partition(".")
    return f"{first}.{rest.removeprefix('parameters.')}" if rest else first


def changed_building(building: BuildingData | None, values: Mapping[str, object]) -> dict[str, Any]:
    """Return a Structure's building data with numbers changed, checked.

    Parameters
    ----------
    building : of the Structure
    values : "masses.2" (counted from 0, lowest level first), "rayleigh.alpha" ... to the number

    Raises
    ------
    PhysicsError
        If there is no such number, or the building is none with it.
    """
    known = toml_content(building) if isinstance(building, Path) else building or PAPER
    data: dict[str, Any] = copy.deepcopy(dict(known))
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


# The type of a parameter, and whether a value fits it.


_INTEGER_RANGE = (-(2**31), 2**31 - 1)
_CHOICES = re.compile(r"\bone of:? ((?:[\w-]+, )*[\w-]+)")


@dataclass(frozen=True)
class Wrong:
    """Why a value does not fit a variable, in words that follow the variable's name."""

    words: str


def typed(variable: Variable, value: object) -> Value | Wrong:
    """Return a value in the type of a variable, within its bounds, or what is wrong with it."""
    unit = f" {variable.unit}" if variable.unit and variable.unit != "1" else ""
    if variable.kind == "Boolean":
        if isinstance(value, bool):
            return value
        return Wrong(f"is {written(value)}; true or false is right.")
    if variable.kind == "String":
        return _text(variable, value)
    if variable.kind in ("Integer", "Enumeration"):
        if isinstance(value, bool) or not isinstance(value, int):
            right = f"{shown_items(variable)} are" if variable.items else "a whole number is"
            return Wrong(f"is {written(value)}; {right} right.")
        least, most = _INTEGER_RANGE
        if not least <= value <= most:
            return Wrong(f"is {written(value)}; FMI holds whole numbers from {least} to {most}.")
        if variable.items and value not in variable.items.values():
            return Wrong(f"is {value}, which is no item; {shown_items(variable)} are right.")
        real = float(value)
    else:
        found = number(value)
        if isinstance(found, str):
            return Wrong(f"{found}; a number{f' in{unit}' if unit else ''} is right.")
        real = found
        value = found
    low, high = variable.minimum, variable.maximum
    if low is not None and real < low:
        return Wrong(f"= {real:g}{unit} lies below {low:g}{unit}; {_range(low, high, unit)}.")
    if high is not None and real > high:
        return Wrong(f"= {real:g}{unit} lies above {high:g}{unit}; {_range(low, high, unit)}.")
    return value


def _range(low: float | None, high: float | None, unit: str) -> str:
    if high is None:
        return f"{low:g}{unit} or more is right"
    if low is None:
        return f"{high:g}{unit} or less is right"
    return f"{low:g} to {high:g}{unit} is right"


def shown_items(variable: Variable) -> str:
    """Return the items of an Enumeration as words: `slow = 2, fast = 5`."""
    items = [f"{name} = {value}" for name, value in variable.items.items()]
    more = f" and {len(items) - LIST_AT_MOST} more" if len(items) > LIST_AT_MOST else ""
    return ", ".join(items[:LIST_AT_MOST]) + more


def choices(variable: Variable) -> tuple[str, ...]:
    """Return the texts that a String variable takes, where its description lists them.

    FMI 2.0 has no bounds for texts; bristle's components write "one of a, b, c".
    """
    match = _CHOICES.search(variable.description)
    return tuple(match[1].split(", ")) if match else ()


def _text(variable: Variable, value: object) -> Value | Wrong:
    if not isinstance(value, str):
        return Wrong(f"is {written(value)}; a text in quotes is right.")
    if "\0" in value:
        return Wrong("holds a null character, which no FMU can take.")
    allowed = choices(variable)
    if allowed and value not in allowed:
        return Wrong(f'= "{value}": {unknown(variable.name, value, allowed)}')
    return value


def existing_file(
    value: str, folder: Path, path: KeyPath, where: str, document: Document
) -> Path | None:
    """Return the absolute path of a file; None, and an error, where there is none.

    Parameters
    ----------
    value : str
        Its name as the scenario has it.
    folder : Path
        Where relative names begin.
    path : tuple
        Keys from the top of the document to the value.
    where : str
        Words that begin the message.
    document : Document
        Takes what is found.
    """
    if "\0" in value:
        document.error(path, f"{where}: no file can have a null character in its name.")
        return None
    file = (folder / value).absolute()
    try:
        if file.is_file():
            return file
        # Names are alike by their endings alone, so these are left out.
        beside = {entry.stem: entry.name for entry in file.parent.glob(f"*{file.suffix}")}
    except OSError:
        beside = {}
    close = nearest(file.stem, beside)
    hint = f' Did you mean "{Path(value).parent / beside[close[0]]}"?' if close else ""
    document.error(path, f'{where}: there is no file "{value}" (looked for {file}).{hint}')
    return None
