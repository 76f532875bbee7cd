"""The built-in components: their names, their classes, and their ports without building an FMU."""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypedDict

from ..core.config import toml_content
from ..core.files import cache_folder, components_folder, reading, write_whole
from ..core.text import unknown
from ..errors import BuildError, StudyError
from ..physics.forms import split_form
from ..physics.law import LAWS
from ..user_code.load import own_laws
from .component import EffectSlave
from .description import Description, Variable
from .slave import Slave

BuildingData = Path | Mapping[str, Any]
"""A building file, or the checked data of one."""
_PACKAGE = Path(__file__).resolve().parent.parent
_OWN_DAMPER = '''"""FMU: a damper by the law {law}, which no component of the library has."""

from bristle.fmu.damper import DamperSlave


class {component}(DamperSlave):
    """{about}"""

    law = "{law}"

    def declare(self):
        super().declare()
'''


@cache
def sources() -> dict[str, Path]:
    """Return the source file of each built-in component by the component's name."""
    found = {}
    for path in sorted(components_folder().glob("*.py")):
        if not path.stem.startswith("_"):
            found[component_class(path).__name__] = path
    return found


def component_names() -> list[str]:
    """Return the names of the built-in components."""
    return sorted(sources())


def controllers() -> list[str]:
    """Return the names of the library's controllers: of what has a controller's ports."""
    return [one for one in component_names() if hasattr(component_class(source(one)), "law_kind")]


def source(name: str) -> Path:
    """Return the source file of a component, or the file itself where a name is that of one.

    Raises
    ------
    BuildError
        If there is no component of that name; the text names the nearest.
    """
    if name.endswith(".py"):
        if not Path(name).is_file():
            raise BuildError(f"{name}: there is no such file.")
        return Path(name).absolute()
    own = {_own_component(law): law for law in own_laws()}
    if name in own:
        return _own_source(own[name])
    try:
        return sources()[name]
    except KeyError:
        all_of_them = "bristle list components"
        raise BuildError(unknown("component", name, component_names(), all_of_them)) from None


def component_of_law(law: str) -> str:
    """Return the name of the component that is a damper of some law.

    Raises
    ------
    BuildError
        If there is none.
    """
    if split_form(law)[1]:
        return str(_own_source(law))
    if law in own_laws():
        return _own_component(law)
    for name, path in sources().items():
        if getattr(component_class(path), "law", "") == law:
            return name
    raise BuildError(f"no component is a damper of the law {law}: components/ needs one.")


def _own_component(law: str) -> str:
    """Return the name of the component that is a damper of a user's own law."""
    return "Own" + "".join(word[:1].upper() + word[1:] for word in _words(law)) + "Damper"


def _words(law: str) -> list[str]:
    """Return the words of a law's name, those of a chosen form with it."""
    return re.findall(
        r"\w+", law.replace(".", "p").replace("-", "m").replace("+", "").replace("_", " ")
    )


def _own_source(law: str) -> Path:
    """Return the file of the component that is a damper of a user's own law, written if need be.

    All projects share the folder, and each text has its own: laws of one name differ in their
    first lines.
    """
    about = LAWS[law].first_line().replace("\\", "/").replace('"', "'")
    text = _OWN_DAMPER.format(law=law, component=_own_component(law), about=about)
    folder = cache_folder() / "components" / hashlib.sha256(text.encode()).hexdigest()[:12]
    path = folder / f"{'_'.join(_words(law))}_damper.py"
    if not path.is_file() or path.read_bytes() != text.encode():
        try:
            write_whole(path, text)
        except StudyError as error:
            raise BuildError(str(error)) from None
    return path


def component_class(path: Path) -> type[Slave]:
    """Return the component class that a source file defines, as the file is now.

    Raises
    ------
    BuildError
        If the file cannot be read, or defines none, or more than one.
    """
    with reading(path, BuildError):
        content = path.read_bytes()
    return _class_of(path, content)


@cache
def _class_of(path: Path, content: bytes) -> type[Slave]:
    module = ModuleType(f"_bristle_component_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        # Not by Python's loader: its bytecode stays, of a file that changes within a second.
        exec(compile(content, str(path), "exec", dont_inherit=True), module.__dict__)
    except Exception as error:  # whatever a component of the user's own raises
        raise BuildError(f"{path}: {type(error).__name__}: {error}") from error
    classes = [one for one in vars(module).values() if isinstance(one, type)]
    own = [one for one in classes if issubclass(one, Slave) and one.__module__ == module.__name__]
    if len(own) != 1:
        raise BuildError(f"{path}: {len(own)} component classes; one per file is right.")
    return own[0]


class Made(TypedDict, total=False):
    """What a built-in component is made with: see `build.plan`."""

    building: BuildingData | None
    controller: Path | None
    effects: tuple[Path, ...]
    ranged: bool


def instantiate(
    name: str,
    building: BuildingData | None = None,
    instance: str = "",
    controller: Path | None = None,
    effects: Iterable[Path] = (),
    drive: str = "",
    offers: Iterable[str] | None = None,
    ranged: bool = False,
) -> Slave:
    """Return a component as a Python object, as an FMU's binary would make it.

    Parameters
    ----------
    name : str
        A name of `component_names()`.
    building, controller : path or None
        Building file of a Structure; file of a designed controller; None: the component's own,
        if it has one.
    instance : str
        Name of the instance; "": that of the component.
    effects : iterable of path
        Files with effects of a user's own.
    drive : str
        What commands a damper; "": its voltage.
    offers : iterable of str or None
        The effects that it offers by name; None: all of its site.
    ranged : bool
        Whether a damper knows the range of its data.

    Raises
    ------
    BuildError, DesignError, PhysicsError
        If there is no such component; if a file is wrong.
    """
    from ..user_code.load import load_file

    baked: dict[str, Any] = {"building": read_building_data(building)} if building else {}
    kind = component_class(source(name))
    if drive:
        baked["drive"] = drive
    if ranged:
        baked["ranged"] = True
    own = [load_file(path) for path in effects]
    if own:
        baked["own"] = [effect.name for effect in own]
    if offers is not None:
        baked["effects"] = sorted(offers)
    if controller:
        baked["files"] = {design_file(name, kind, controller): str(controller)}
    files: tuple[str, ...] = getattr(kind, "files", ())
    resources = str((_PACKAGE / files[0]).parent) if files else None
    return kind(baked=baked, instance_name=instance or name, resources=resources)


def read_building_data(building: BuildingData) -> dict[str, Any]:
    """Return the checked data of a building or its file, to be baked into a Structure."""
    from ..data.building_file import read_building

    if not isinstance(building, Path):
        return dict(building)
    read_building(building)
    return toml_content(building)


def design_file(component: str, kind: type[Slave], controller: Path) -> str:
    """Return under which name a component takes a controller file.

    Raises
    ------
    BuildError, DesignError
        If it takes none, or none of this kind; if the file is no controller.
    """
    from ..component.controller_file import read_controller

    wanted = getattr(kind, "design", "")
    if not wanted:
        raise BuildError(f"a controller file goes into a designed controller, not {component}.")
    found = read_controller(controller).kind
    if found != wanted:
        raise BuildError(
            f"{controller}: a controller of the kind {found!r}; {component} takes {wanted!r}: "
            f"design it with kind = {wanted!r}."
        )
    return f"{wanted}.json"


def own_design(component: str) -> Path | None:
    """Return the controller file that a component carries; None where it has no design."""
    kind: Any = component_class(source(component))
    return _PACKAGE / kind.files[0] if getattr(kind, "design", "") else None


def describe(
    name: str,
    building: BuildingData | None = None,
    controller: Path | None = None,
    effects: Iterable[Path] = (),
    drive: str = "",
    ranged: bool = False,
) -> Description:
    """Return the ports and parameters of a built-in component; no FMU is needed for it.

    Parameters
    ----------
    name : str
        A name of `component_names()`.
    building : path, optional
        The building file of a Structure.
    controller : path, optional
        The controller file of a designed controller.
    effects : iterable of path, optional
        Files with effects of a user's own that the component carries too.
    drive : str, optional
        What commands a damper; "": its voltage.
    ranged : bool
        Whether a damper knows the range of its data.

    Raises
    ------
    BuildError, DesignError, PhysicsError
        If there is no such component; if the controller, the building or an effect is wrong.
    """
    effects = tuple(effects)
    slave = instantiate(
        name, building, controller=controller, effects=effects, drive=drive, ranged=ranged
    )
    if effects and not isinstance(slave, EffectSlave):
        raise BuildError(f"{name} takes no effects; a damper or a Structure does.")
    variables = {}
    for index, declared in slave.vars.items():
        key = declared.name
        low, high, nominal = slave._bounds.get(key, (None, None, None))
        variables[key] = Variable(
            name=key,
            kind=type(declared).__name__,
            causality=declared.causality.name,
            variability=declared.variability.name,
            reference=index,
            unit=slave._units.get(key),
            start=None if key in slave._depends else slave[key],
            minimum=low,
            maximum=high,
            nominal=nominal,
            description=declared.description or "",
            dependencies=slave._depends.get(key),
            optional=key in slave._optional,
            over_step=slave._over_step.get(key),
            jumps_without=slave._jumps.get(key),
        )
    return Description(
        name=name,
        guid=str(slave.guid),
        identifier=name,
        description=slave.description or "",
        variables=variables,
        capabilities={},
    )
