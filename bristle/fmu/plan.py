"""What decides an FMU's bytes: its component, what is baked in, the library that it carries."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from math import inf, isfinite
from pathlib import Path
from typing import Any
from uuid import UUID, uuid5

from ..errors import BuildError
from ..physics.drive import VOLTAGE
from ..physics.forms import split_form
from ..physics.user import own_laws
from . import catalogue
from .description import Variable

PACKAGE = Path(__file__).resolve().parent.parent
_BUNDLED = (
    "errors.py", "units.py", "physics/**/*.py", "control/**/*.py", "component/**/*.py",
    "fmu/slave.py", "fmu/model_description.py", "fmu/binary.py", "fmu/component.py",
    "fmu/source.py", "fmu/damper.py", "fmu/controller.py", "fmu/own_controller.py",
)  # fmt: skip
CAPABILITIES = {
    "needsExecutionTool": True,  # a Python that the host brings
    "canHandleVariableCommunicationStepSize": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
}
"""What an FMU that runs in Python says of itself, in pythonfmu's words."""
_NAMESPACE = UUID("7c0b8c8e-3d0f-5d0a-9b55-62726973746c")


@dataclass(frozen=True)
class Plan:
    """Everything that decides an FMU's bytes.

    `name` is the model's name, `component` its source; `baked` goes into the FMU as JSON, `files`
    as resources; `effects` and `laws` are files of the user's own, bundled beside the library's.
    """

    name: str
    component: Path
    baked: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)
    effects: tuple[Path, ...] = ()
    laws: tuple[Path, ...] = ()

    def digest(self) -> str:
        """Return the digest of the content, 12 hexadecimal digits."""
        content = hashlib.sha256()
        for part in (_library_digest(), self.name, json.dumps(self.baked, sort_keys=True)):
            content.update(part.encode())
        named = [(self.component.name, self.component), *sorted(self.files.items())]
        own = (*sorted(self.effects), *sorted(self.laws))
        for name, path in [*named, *((path.name, path) for path in own)]:
            content.update(name.encode())
            content.update(path.read_bytes())
        return content.hexdigest()[:12]

    def guid(self) -> str:
        """Return the guid that follows from the content."""
        return str(uuid5(_NAMESPACE, self.digest()))


@cache
def library_files() -> tuple[tuple[str, Path], ...]:
    """Return name and path of each file of the library that an FMU carries."""
    paths = {path for pattern in _BUNDLED for path in PACKAGE.glob(pattern)}
    return tuple(sorted((path.relative_to(PACKAGE).as_posix(), path) for path in paths))


@cache
def _library_digest() -> str:
    import pythonfmu

    made_by = f"{pythonfmu.__version__} {sorted(CAPABILITIES.items())}"
    content = hashlib.sha256(made_by.encode())
    for name, path in library_files():
        content.update(name.encode())
        content.update(path.read_bytes())
    return content.hexdigest()


def plan(
    component: str,
    *,
    name: str | None = None,
    building: Path | None = None,
    record: Path | None = None,
    samples: Path | None = None,
    starts: Mapping[str, Any] | None = None,
    effects: Iterable[Path] = (),
    controller: Path | None = None,
    drive: str = VOLTAGE.name,
    step: float | None = None,
) -> Plan:
    """Return what to build.

    Parameters
    ----------
    component : str
        A built-in component, or the Python file of one of the user's own, which is run.
    name : str, optional
        The model's name; else the component's.
    building : path, optional
        Building file, for a Structure.
    record : path, optional
        Ground motion in any format that `records` reads, for a GroundMotion.
    samples : path, optional
        Two-column CSV for a component that plays a signal: its parameter `file`.
    starts : mapping, optional
        Start values of parameters that differ from the component's.
    effects : iterable of path
        Files with effects of the user's own.
    controller : path, optional
        Controller file of a design, for a component that takes one of its kind.
    drive : str
        What commands a damper: one of `physics.drive.DRIVES`.
    step : float, optional
        Step [s] that the FMU asks for; else 2 ms.

    Raises
    ------
    BuildError, DesignError, PhysicsError, RecordError
        If a name or a file is wrong.
    """
    path = catalogue.source(component)
    kind = catalogue.component_class(path)
    chosen = kind.__name__ if name is None else name
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", chosen):
        raise BuildError(f'"{chosen}" is no model name: letters, digits and _ are right.')
    baked: dict[str, Any] = {"name": chosen}
    files = {Path(file).name: PACKAGE / file for file in getattr(kind, "files", ())}
    if building is not None:
        _only("Structure", component, "a building")
        baked["building"] = catalogue.read_building_data(building)
    if record is not None:
        _only("GroundMotion", component, "a record")
        from ..data import ground_motion_file

        found = ground_motion_file(str(record), Path.cwd())
        if f"{found}.csv" not in files:  # else it is in every GroundMotion
            stem = re.sub(r"[^A-Za-z0-9_]", "_", record.stem)
            files[f"{stem}.csv"] = Path(found)
            found = stem
        baked["record"] = found
    if samples is not None:
        baked["samples"] = re.sub(r"[^A-Za-z0-9_]", "_", samples.stem)
        files[f"{baked['samples']}.csv"] = samples
    if controller is not None:
        files[catalogue.design_file(component, kind, controller)] = controller
    effects = tuple(effects)
    if effects:
        catalogue.describe(component, building, effects=effects)  # refuses what is wrong with them
    if drive != VOLTAGE.name:
        baked["drive"] = drive
    if step is not None:
        baked["step"] = step
    if starts:
        known = catalogue.describe(component, building, effects=effects, drive=drive).variables
        baked["starts"] = _checked_starts(component, known, starts)
    law = getattr(kind, "law", "")
    laws = tuple(file for name, file in own_laws().items() if name == split_form(law)[0])
    return Plan(chosen, path, baked, files, effects, laws)


def _checked_starts(
    component: str, known: Mapping[str, Variable], starts: Mapping[str, Any]
) -> dict[str, Any]:
    """Return start values in the types of their variables; BuildError for what cannot be."""
    kinds = {"Real": (float, int), "Integer": (int,), "Boolean": (bool,), "String": (str,)}
    checked: dict[str, Any] = {}
    for key, value in starts.items():
        variable = known.get(key)
        if variable is None or variable.causality not in ("parameter", "input"):
            raise BuildError(f'{component} has no parameter "{key}".')
        where = f"{component}.{key} = {value!r}"
        if type(value) not in kinds[variable.kind]:
            raise BuildError(f"{where}: a value of the type {variable.kind} is right.")
        if variable.kind == "Real":
            value = float(value)
            low = -inf if variable.minimum is None else variable.minimum
            high = inf if variable.maximum is None else variable.maximum
            if not (isfinite(value) and low <= value <= high):
                raise BuildError(f"{where}: a finite number in [{low!r}, {high!r}] is right.")
        checked[key] = value
    return checked


def _only(right: str, component: str, what: str) -> None:
    if component != right:
        raise BuildError(f"{what} goes into {right}, not into {component}.")
