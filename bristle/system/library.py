"""What a scenario may name: components, records, buildings, stock scenarios."""

from __future__ import annotations

import hashlib
import re
import zipfile
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from ..component.controller_file import KINDS, Controller, parse_controller, read_controller
from ..core.text import unknown
from ..core.toml_lines import KeyPath
from ..data.building_file import read_building
from ..errors import DesignError, PhysicsError
from ..fmu import catalogue
from ..physics.building import driven_mass as building_mass
from ..physics.building import paper_building
from ..physics.forms import joined_form
from ..physics.laws import LAWS, laws_of
from ..user_code.load import load_file
from .model import FILE_PARAMETERS, Component, DamperLaw, Part
from .overrides import MADE_FROM


def damper_of(law: str | Path, form: str = "", knots: tuple[float, ...] = ()) -> DamperLaw:
    """Return a damper's law, registered, with the component that is a damper of it.

    Parameters
    ----------
    law : name of a law of the library, or the file of a user's own
    form, knots : form of the command, one of `physics.forms.FORMS`, and a table's knots [V]

    Raises
    ------
    PhysicsError
        If there is no such law, its file is not right, or it cannot have the form.
    TrustError
        If nobody consented to the file's code.
    """
    file = law if isinstance(law, Path) else None
    name = str(law) if file is None else load_file(file, "law").name
    known = [one.name for one in laws_of("damper")]
    if name not in known:
        raise PhysicsError(unknown("law", name, known))
    whole = joined_form(name, form, knots)
    return DamperLaw(whole, catalogue.component_of_law(LAWS[whole].name), file)


def law_of(component: str) -> str:
    """Return the law of a built-in damper, "" of a component that is none."""
    return getattr(catalogue.component_class(catalogue.source(component)), "law", "")


def driven_mass(building: Path | None, port: str = "damper_force", attached: float = 0.0) -> float:
    """Return the mass [kg] that a damper's force acts on.

    Of the damper that is the base, or floor 1 of a fixed base; of a device of the building what it
    moves against each other.

    Parameters
    ----------
    building : its file, None for the built-in one
    port : the Structure's input that takes the force
    attached : mass [kg] more on the first level
    """
    found = read_building(building) if building else paper_building()
    pushed = next((d for d in found.devices if d.ports.force == port), found.device(""))
    return building_mass(found.with_attached_mass(attached).M, pushed)


def check_design(part: Part, building: Path | None) -> None:
    """Refuse a building, None for the built-in one, that a component's design is not made for.

    A component without a design suits any building.

    Raises
    ------
    DesignError, PhysicsError
        Naming both; if the building or the controller is wrong.
    """
    where = f"the design that {part.file.name if part.file else part.kind} carries"
    if part.file:
        controller = controller_in(part.file)
    else:
        own = catalogue.own_design(part.kind)
        controller = read_controller(part.controller or own) if own else None
        where = str(part.controller) if part.controller else where
    if controller is not None:
        controller.check_building(read_building(building) if building else paper_building(), where)


def controller_in(file: Path) -> Controller | None:
    """Return the controller that an FMU carries; None where it carries none that can be read."""
    try:
        with zipfile.ZipFile(file) as archive:
            for kind in KINDS:
                name = f"resources/{kind}.json"
                if name in archive.namelist():
                    return parse_controller(archive.read(name).decode(), f"{file}: {name}")
    except (OSError, zipfile.BadZipFile, UnicodeDecodeError, DesignError):
        return None  # the FMU's own check says what is wrong with it
    return None


# How a run with overrides is called: its title, and the folder of its results.

LONGEST_NAME = 100
"""Characters of a folder's name."""
_ODD = re.compile(r"[^A-Za-z0-9._+=-]")


def changed_title(components: Iterable[Component], changed: Collection[KeyPath]) -> str:
    """Return the title of a run whose components differ from the file's: what it is made of.

    A file's own title may no longer be true then. Sources (components without inputs) are given
    with all their values, the others with those that were changed.

    Parameters
    ----------
    components : iterable of Component
        As they run.
    changed : collection of key paths
        What overrides have changed, such as ("components", "voltage", "parameters", "level").
    """
    texts = []
    for component in components:
        name = component.path.name if component.path else component.kind
        paths = [path[2:] for path in changed if path[:2] == ("components", component.name)]
        keys = {str(path[-1]) for path in paths}
        inputs = component.description.of("input")
        values = [
            _pair(component, key, value)
            for key, value in component.values.items()
            if key in keys or not inputs
        ]
        for key in MADE_FROM:
            file = getattr(component, key)
            if key in keys and file is not None:
                values.append(f"{key} = {file.name}")
        texts.append(f"{name} ({', '.join(values)})" if values else name)
    if any(path[0] == "connections" for path in changed):
        texts.append("other connections than the file's")
    return ", ".join(texts)


def _pair(component: Component, key: str, value: object) -> str:
    if key in FILE_PARAMETERS:
        return f"{key} = {Path(str(value)).name}"
    unit = component.description.variables[key].unit
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    text = text.lower() if isinstance(value, bool) else text
    return f"{key} = {text}" + (f" {unit}" if unit and unit != "1" else "")


def needs_title(changed: Iterable[KeyPath]) -> bool:
    """Return whether changes may make a file's title untrue: all but those of times and steps."""
    return any(path[0] != "run" and path[2:] != ("step",) for path in changed)


def run_name(file: Path, overrides: Mapping[str, object]) -> str:
    """Return the name of a run: the scenario's, and what overrides make of it.

    Different overrides give different names; where a value cannot be part of a name (a path, a long
    list), digits that stand for all overrides follow.
    """
    pairs = [f"{name}={value}" for name, value in overrides.items()]
    name = "_".join([file.stem, *(_ODD.sub("-", _base(pair)) for pair in pairs)])
    if name == "_".join([file.stem, *pairs]) and len(name) <= LONGEST_NAME:
        return name
    if not pairs:
        return file.stem
    digest = hashlib.sha256("\0".join(pairs).encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{name[: LONGEST_NAME - 9].rstrip('-_.')}-{digest}"


def _base(pair: str) -> str:
    """Return a pair whose value is a path with the file's name alone."""
    name, _, value = pair.partition("=")
    last = re.split(r"[/\\]", value)[-1]
    return f"{name}={last}"
