"""The damper of a comparison: a component or law with values, a study's, or an FMU."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..data.model import StudyModel, read_model
from ..design import Damper as DesignDamper
from ..errors import ScenarioError
from ..findings import nearest
from ..fmu import catalogue
from ..fmu.description import Description, read_description
from ..physics.drive import DRIVES, VOLTAGE, Drive
from ..physics.laws import LAWS, laws_of
from ..scenario.library import damper_of
from ..scenario.model_parts import source_of, values_of
from .choice import Choice, choice_of, number, said
from .folder import Folder, Part

DEFAULT = "LuGreDamper"
_MOTION = ("displacement", "velocity")


@dataclass(frozen=True)
class Damper:
    """A damper whose command controllers set.

    Attributes
    ----------
    name : str
        In texts.
    part : Part
        Its component in the scenarios.
    drive : Drive
        What commands it.
    most : float
        Largest command, in the drive's unit.
    law : str
        Name of its law, "" of an FMU, whose law nobody knows.
    values : mapping
        Values of its law's parameters in SI.
    effects : tuple of str
        Its effects that are on.
    notes : tuple of str
        What a reader has to know of it.
    """

    name: str
    part: Part
    drive: Drive
    most: float
    law: str
    values: Mapping[str, float]
    effects: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def usual(self) -> bool:
        """Whether it is the library's damper as it comes, for which stock designs were made."""
        if self.law != catalogue_law(DEFAULT) or self.effects or self.most != VOLTAGE.largest:
            return False
        declared = LAWS[self.law].parameters
        return all(value == declared[name].value for name, value in self.values.items())

    def for_design(self) -> DesignDamper | None:
        """Return what designs know of it, None where its law has no closed form."""
        law = LAWS.get(self.law)
        if law is None or not law.exact() or law.felt:
            return None
        own = {
            name: float(value)
            for name, value in self.part.parameters.items()
            if name.partition(".")[0] in self.effects and not name.endswith(".on")
        }
        return DesignDamper(self.law, {**self.values, **own}, self.effects, self.most)


def catalogue_law(component: str) -> str:
    """Return the law of a built-in component, "" where it is no damper."""
    return str(getattr(catalogue.component_class(catalogue.source(component)), "law", ""))


def damper_from(given: str | Path, folder: Folder) -> Damper:
    """Return the damper that a text chooses.

    Parameters
    ----------
    given : `WHAT,NAME=VALUE,...`; a component, a law, the file of a law, the folder of a study or
        its model.toml, or an FMU
    folder : of the comparison, which keeps files

    Raises
    ------
    ScenarioError, StudyError, FmuError, PhysicsError
        If there is no such damper, or nothing commands it.
    """
    choice = choice_of(given, "--damper")
    path = Path(choice.what)
    if path.suffix.lower() == ".fmu":
        return _from_fmu(choice, path, folder)
    if path.is_dir() or path.suffix.lower() == ".toml":
        return _from_model(choice, path, folder)
    if path.suffix.lower() == ".py":
        return _from_law(choice, path, folder)
    dampers = [name for name in catalogue.component_names() if catalogue_law(name)]
    laws = [law.name for law in laws_of("damper")]
    if choice.what in dampers:
        law = catalogue_law(choice.what)
        return _built_in(choice, {"fmu": choice.what}, law, catalogue.describe(choice.what))
    if choice.what in laws:
        return _from_law(choice, choice.what, folder)
    close = nearest(choice.what, [*dampers, *laws])
    hint = f' Did you mean "{close[0]}"?' if close else ""
    raise ScenarioError(
        f'--damper: no damper is named "{choice.what}". There are: {", ".join(dampers)}; the name '
        f"of a law, the folder of a study, an FMU are right too.{hint}"
    )


def _from_law(choice: Choice, law: str | Path, folder: Folder) -> Damper:
    found = damper_of(law)
    source = {"law": folder.keep(law) if isinstance(law, Path) else law}
    return _built_in(choice, source, found.name, catalogue.describe(found.component))


def _built_in(choice: Choice, source: dict[str, Any], law: str, description: Description) -> Damper:
    declared = LAWS[law].parameters
    values = {
        name: number(choice.settings.get(name, parameter.value), name, f"--damper {choice.what}")
        for name, parameter in declared.items()
    }
    on = [name[:-3] for name, value in choice.settings.items() if name.endswith(".on") and value]
    most = _most(choice.what, choice.settings, description, VOLTAGE)
    return Damper(
        choice.label or said(choice), Part(source, dict(choice.settings)), VOLTAGE, most, law,
        values, tuple(on),
    )  # fmt: skip


def _from_model(choice: Choice, path: Path, folder: Folder) -> Damper:
    """Return the damper of a model.toml, by itself or in the folder of a study."""
    file = path / "model.toml" if path.is_dir() else path
    model = read_model(file)
    inside = model.at("damper", bench=not model.building)
    values: dict[str, Any] = {**values_of(inside), **choice.settings}
    source = source_of(inside)
    if isinstance(source["law"], Path):
        source["law"] = folder.keep(source["law"])
    if "effects" in source:
        source["effects"] = [folder.keep(one) for one in source["effects"]]
    law = inside.base_law
    component = catalogue.component_of_law(law)
    description = catalogue.describe(component)
    own = {
        name: number(values[name], name, f"--damper {choice.what}")
        for name in LAWS[law].parameters if name in values
    }  # fmt: skip
    name = choice.label or (path.resolve().name if path.is_dir() else file.stem)
    return Damper(
        name, Part(source, values), VOLTAGE, _most(choice.what, values, description, VOLTAGE), law,
        own, tuple(inside.effects), tuple(_notes(model, name)),
    )  # fmt: skip


def _notes(model: StudyModel, name: str) -> Iterable[str]:
    if model.drive != VOLTAGE.name:
        unit = DRIVES[model.drive].unit
        yield (
            f"{name} is commanded by a {model.drive}: 1 V of a controller counts as 1 {unit}, and "
            f"v_max is the largest {model.drive}."
        )
    if set(model.effects) - set(model.at("damper", bench=not model.building).effects):
        yield f"Effects of {name}'s model that are not in the damper are left out."


def _from_fmu(choice: Choice, path: Path, folder: Folder) -> Damper:
    description = read_description(path, any_platform=True)
    there = description.variables
    inputs = {name for name, v in there.items() if v.causality == "input"}
    missing = [name for name in _MOTION if name not in inputs]
    if "force" not in there or there["force"].causality != "output":
        missing.append("force")
    if missing:
        raise ScenarioError(
            f"--damper {path}: has no {' and no '.join(missing)}; a damper has the inputs "
            "displacement [m], velocity [m/s] and a command, and the output force [N]."
        )
    drive = next((one for one in DRIVES.values() if one.name in inputs), None)
    if drive is None:
        raise ScenarioError(
            f"--damper {path}: nothing commands it: it has no input {', '.join(DRIVES)}. "
            "Controllers need one to compare."
        )
    notes = ["The law of the damper's FMU is not known: its parameters are not varied."]
    if drive is not VOLTAGE:
        notes.append(f"1 V of a controller counts as 1 {drive.unit} of the damper's {drive.name}.")
    return Damper(
        choice.label or said(choice), Part({"fmu": folder.keep(path)}, dict(choice.settings)),
        drive, _most(choice.what, choice.settings, description, drive), "", {}, (), tuple(notes),
    )  # fmt: skip


def _most(what: str, settings: Mapping[str, Any], description: Description, drive: Drive) -> float:
    """Return the largest command, refusing a damper that takes none."""
    variable = description.variables.get(drive.limit)
    start = variable.start if variable is not None else drive.largest
    most = settings.get(drive.limit, start)
    if isinstance(most, bool) or not isinstance(most, int | float) or not most > 0.0:
        raise ScenarioError(
            f"--damper {what}: {drive.limit} = {most} leaves controllers nothing to command; "
            f"{drive.largest:g} {drive.unit} is usual."
        )
    return float(most)
