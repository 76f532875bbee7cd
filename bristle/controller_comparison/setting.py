"""What controllers are compared on: building, damper, ground motions."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..campaign.best_constant import G
from ..campaign.campaign import Statistic
from ..component.controller_file import Controller
from ..core.config import toml_content
from ..core.files import writing
from ..core.text import did_you_mean, unknown, written
from ..data import list_ground_motions, read_ground_motion
from ..data.building_file import read_building
from ..errors import DesignError, ScenarioError, not_usable
from ..fmu import catalogue
from ..fmu.controller import MEASURED
from ..fmu.description import Description, read_description
from ..model.model import Model
from ..model.model_file import read_model
from ..physics.building import PAPER, Building, Device, Ports, frequencies, paper_building
from ..physics.drive import DRIVES, VOLTAGE, Drive
from ..physics.laws import LAWS, laws_of
from ..synthesis import DesignDamper
from ..system.from_model import source_of, values_of
from ..system.library import damper_of, law_of
from ..system.overrides import parse_override

# What a user chooses, as text: `WHAT,NAME=VALUE,...`, such as `Skyhook,gain=100`.

Value = bool | int | float | str
Given = str | Path | Sequence[str | Path] | Mapping[str, str | Path]
"""What a caller may give as a list: one text or file, several, or several by their labels."""

_SETTING = re.compile(r",(?=\s*[A-Za-z_][\w.]*\s*=)")
_ENDINGS = (".json", ".toml", ".py", ".fmu", ".csv", ".at2", ".txt")


class Selection(NamedTuple):
    """A thing that was chosen.

    `what` is a name or a file, `settings` its values, `label` what tables call it.
    """

    what: str
    settings: dict[str, Value]
    label: str

    @property
    def is_file(self) -> bool:
        """Whether the text names a file rather than something of the library."""
        path = Path(self.what)
        return path.suffix.lower() in _ENDINGS or len(path.parts) > 1

    @property
    def as_text(self) -> str:
        """What tables call it: its label, else its name with its settings."""
        name = Path(self.what).stem if self.is_file else self.what
        values = (f"{key}={value}" for key, value in self.settings.items())
        return self.label or " ".join([name, *values])


def choice_of(text: object, where: str, label: str = "") -> Selection:
    """Return what a text chooses.

    Parameters
    ----------
    text : `WHAT,NAME=VALUE,...`; values as in TOML; `label=` names it in tables
    where : what the text was given as, for messages
    label : in place of one in the text

    Raises
    ------
    ScenarioError
        If nothing is named, or a setting is given twice.
    """
    if not isinstance(text, str | Path) or not str(text).strip():
        raise ScenarioError(f"{where}: {written(text)}; a name or a file is right.")
    what, *pieces = _SETTING.split(str(text).strip())
    settings: dict[str, Value] = {}
    for piece in pieces:
        name, value = parse_override(piece)
        if name in settings:
            raise ScenarioError(f'{where} "{text}": {name} is given twice; once is right.')
        settings[name] = value
    chosen = label or str(settings.pop("label", ""))
    settings.pop("label", None)
    return Selection(what, settings, chosen)


def choices_of(given: Given, where: str) -> list[Selection]:
    """Return what a list of texts, or a mapping of labels to texts, chooses.

    Raises
    ------
    ScenarioError
        As `choice_of`.
    """
    if isinstance(given, Mapping):
        return [choice_of(text, where, str(label)) for label, text in given.items()]
    texts = [given] if isinstance(given, str | Path) else list(given)
    return [choice_of(text, where) for text in texts]


def number(value: object, name: str, where: str, right: str = "a number") -> float:
    """Return a setting as a number.

    Parameters
    ----------
    value : what was set
    name, where : of the setting, and what was chosen
    right : what is expected

    Raises
    ------
    ScenarioError
        If it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ScenarioError(f"{where}: {name} = {written(value)}; {right} is right.")
    return float(value)


def refuse_twice(labels: Sequence[str], where: str, taken: Sequence[str] = ()) -> None:
    """Refuse labels that are given twice, or that tables have for something else.

    Raises
    ------
    ScenarioError
        Naming the label.
    """
    for k, label in enumerate(labels):
        if label in labels[:k] or label in taken:
            raise ScenarioError(
                f'{where}: "{label}" is there twice; WHAT,label=NAME gives one another name.'
            )


# The folder of a comparison: files that its scenarios read lie in it, so that it can be moved.

FILES, SCENARIOS, ENSEMBLES, LIMITS = "files", "scenarios", "ensembles", "limits"
UNFINISHED = ".unfinished"
"""Stands in the folder until its comparison has come to its end."""
ABOVE = "../.."
"""From a scenario, which lies two folders deep, to the comparison's folder."""


class ComponentTable(NamedTuple):
    """A component of a scenario: what it is made from (`fmu`, `law` ...), and its parameters."""

    source: dict[str, Any]
    parameters: dict[str, Any]

    @property
    def table(self) -> dict[str, Any]:
        """Its table in a scenario."""
        return self.source | ({"parameters": self.parameters} if self.parameters else {})


class Folder:
    """The folder of a comparison.

    Parameters
    ----------
    path : Path
        Made where it is missing.

    Attributes
    ----------
    goes_on : bool
        Whether a comparison there was interrupted: runs of its ensembles that fit are taken over.

    Raises
    ------
    RunError
        If it cannot be written to, exit code 2.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._kept: dict[str, Path] = {}
        self.goes_on = (path / UNFINISHED).exists()
        self.write(path / FILES / ".keep", "")
        (path / FILES / ".keep").unlink()
        self.write(path / UNFINISHED, "")

    def finish(self) -> None:
        """Say that the comparison came to its end: the next one there begins anew."""
        (self.path / UNFINISHED).unlink(missing_ok=True)

    def keep(self, file: Path, name: str = "") -> str:
        """Copy a file in; return its path as scenarios write it.

        Parameters
        ----------
        file : to copy; another one of the same name gets a number
        name : in place of the file's own
        """
        file = file.absolute()
        stem, ending = Path(name or file.name).stem, Path(name or file.name).suffix
        kept, count = f"{stem}{ending}", 1
        while self._kept.get(kept, file) != file:
            count += 1
            kept = f"{stem}_{count}{ending}"
        self._kept[kept] = file
        target = self.path / FILES / kept
        with writing(target, not_usable):
            if not (target.exists() and target.samefile(file)):
                shutil.copyfile(file, target)
        return f"{ABOVE}/{FILES}/{kept}"

    def at(self, kind: str, motion: str, name: str) -> Path:
        """Return the path of a file about a motion: kind/motion/name."""
        return self.path / kind / plain_name(motion) / name

    def write(self, path: Path, text: str) -> Path:
        """Write a text file; return its path.

        Raises
        ------
        RunError
            If it cannot be written, exit code 2.
        """
        with writing(path, not_usable):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return path


def plain_name(text: str) -> str:
    """Return a text as the name of a file: letters, digits, dots and dashes."""
    return re.sub(r"[^\w.+-]+", "_", text).strip("._") or "unnamed"


# The damper whose command controllers set.

DEFAULT = "LuGreDamper"
_MOTION_INPUTS = ("displacement", "velocity")


@dataclass(frozen=True)
class CommandedDamper:
    """A damper whose command controllers set.

    Attributes
    ----------
    name : str
        In texts.
    part : ComponentTable
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
    part: ComponentTable
    drive: Drive
    most: float
    law: str
    values: Mapping[str, float]
    effects: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def usual(self) -> bool:
        """Whether it is the library's damper as it comes, for which stock designs were made."""
        if self.law != law_of(DEFAULT) or self.effects or self.most != VOLTAGE.largest:
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


def damper_from(given: str | Path, folder: Folder) -> CommandedDamper:
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
    dampers = [name for name in catalogue.component_names() if law_of(name)]
    laws = [law.name for law in laws_of("damper")]
    if choice.what in dampers:
        law = law_of(choice.what)
        return _built_in(choice, {"fmu": choice.what}, law, catalogue.describe(choice.what))
    if choice.what in laws:
        return _from_law(choice, choice.what, folder)
    hint = did_you_mean(choice.what, [*dampers, *laws])
    raise ScenarioError(
        f'--damper: no damper is named "{choice.what}". There are: {", ".join(dampers)}; the name '
        f"of a law, the folder of a study, an FMU are right too.{hint}"
    )


def _from_law(choice: Selection, law: str | Path, folder: Folder) -> CommandedDamper:
    found = damper_of(law)
    source = {"law": folder.keep(law) if isinstance(law, Path) else law}
    return _built_in(choice, source, found.name, catalogue.describe(found.component))


def _built_in(
    choice: Selection, source: dict[str, Any], law: str, description: Description
) -> CommandedDamper:
    declared = LAWS[law].parameters
    values = {
        name: number(choice.settings.get(name, parameter.value), name, f"--damper {choice.what}")
        for name, parameter in declared.items()
    }
    on = [name[:-3] for name, value in choice.settings.items() if name.endswith(".on") and value]
    most = _most(choice.what, choice.settings, description, VOLTAGE)
    return CommandedDamper(
        choice.as_text, ComponentTable(source, dict(choice.settings)), VOLTAGE, most, law,
        values, tuple(on),
    )  # fmt: skip


def _from_model(choice: Selection, path: Path, folder: Folder) -> CommandedDamper:
    """Return the damper of a model.toml, by itself or in the folder of a study."""
    file = path / "model.toml" if path.is_dir() else path
    model = read_model(file)
    inside = model.at("damper", bench=not model.building)
    values: dict[str, Any] = {**values_of(inside), **choice.settings}
    source = source_of(inside)
    if source["law"].endswith(".py"):
        source["law"] = folder.keep(Path(source["law"]))
    if "effects" in source:
        source["effects"] = [folder.keep(Path(one)) for one in source["effects"]]
    law = inside.base_law
    component = catalogue.component_of_law(law)
    description = catalogue.describe(component)
    own = {
        name: number(values[name], name, f"--damper {choice.what}")
        for name in LAWS[law].parameters if name in values
    }  # fmt: skip
    name = choice.label or (path.resolve().name if path.is_dir() else file.stem)
    return CommandedDamper(
        name, ComponentTable(source, values), VOLTAGE,
        _most(choice.what, values, description, VOLTAGE), law, own, tuple(inside.effects),
        tuple(_model_notes(model, name)),
    )  # fmt: skip


def _model_notes(model: Model, name: str) -> Iterable[str]:
    if model.drive != VOLTAGE.name:
        unit = DRIVES[model.drive].unit
        yield (
            f"{name} is commanded by a {model.drive}: 1 V of a controller counts as 1 {unit}, and "
            f"v_max is the largest {model.drive}."
        )
    if set(model.effects) - set(model.at("damper", bench=not model.building).effects):
        yield f"Effects of {name}'s model that are not in the damper are left out."


def _from_fmu(choice: Selection, path: Path, folder: Folder) -> CommandedDamper:
    description = read_description(path, any_platform=True)
    there = description.variables
    inputs = {name for name, v in there.items() if v.causality == "input"}
    missing = [name for name in _MOTION_INPUTS if name not in inputs]
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
    return CommandedDamper(
        choice.as_text, ComponentTable({"fmu": folder.keep(path)}, dict(choice.settings)),
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


# A controller as it stands in the scenarios of a comparison.

OFF, ON, BEST, LIMIT = "passive off", "passive on", "best constant", "limit"
"""What every comparison has besides the controllers."""
CONSTANT = "ConstantVoltage"


@dataclass(frozen=True)
class ComparedController:
    """A controller as it stands in the scenarios.

    Attributes
    ----------
    name : str
        In tables.
    part : ComponentTable
        Its component.
    wires : mapping
        Its inputs to the columns that feed them.
    output : str
        Its output that commands the damper.
    built_in : bool
        Whether the coupled engine has it.
    period : float or None
        Sample period [s], None of one without a clock.
    about : str
        What it is, a sentence.
    carries : bool
        Whether it has a design, which belongs to one building.
    redesigned : bool
        Whether that design was made by the comparison.
    """

    name: str
    part: ComponentTable
    wires: Mapping[str, str]
    output: str
    built_in: bool
    period: float | None
    about: str
    carries: bool = False
    redesigned: bool = False


def constant(name: str, level: float, about: str) -> ComparedController:
    """Return a constant voltage [V] as a candidate."""
    part = ComponentTable({"fmu": CONSTANT}, {"level": level})
    return ComparedController(name, part, {}, "voltage", True, None, about)


# The ground motions of a comparison: stock names, or files with their scale.

_IN_G = re.compile(r"([-+.\deE]+)\s*g")
_MOTION_KEYS = ("peak", "factor", "start", "stop")


@dataclass(frozen=True)
class ComparedMotion:
    """A ground motion as it shakes the building.

    Attributes
    ----------
    name : str
        In tables.
    part : ComponentTable
        The GroundMotion of its scenarios.
    stop : float
        End of the runs [s].
    peak : float
        Largest acceleration as it is run [m/s2].
    source : str
        Where the numbers come from, in words.
    """

    name: str
    part: ComponentTable
    stop: float
    peak: float
    source: str


def motions_of(given: Sequence[str | Path], folder: Folder, step: float) -> list[ComparedMotion]:
    """Return the ground motions, their files kept in the comparison's folder.

    Parameters
    ----------
    given : `RECORD,peak=0.6g,factor=0.45,stop=30`; the record a name, its beginning, or a file
    folder : of the comparison
    step : of the runs [s]; they end with the record, or at `stop`, on a whole number of steps

    Raises
    ------
    ScenarioError, RecordError
        If there is none, one is given twice, or a record cannot be read.
    """
    if not given:
        raise ScenarioError(
            "no ground motions: name records or files, as --motions el_centro_1940_ns,peak=0.4g "
            "my_record.AT2."
        )
    found = [_motion(one, folder, step) for one in choices_of(given, "--motions")]
    refuse_twice([motion.name for motion in found], "--motions")
    refuse_twice([plain_name(motion.name) for motion in found], "--motions")  # their folders
    return found


def _motion(choice: Selection, folder: Folder, step: float) -> ComparedMotion:
    for key in choice.settings:
        if key not in _MOTION_KEYS:
            raise ScenarioError(f"--motions {choice.what}: {unknown('setting', key, _MOTION_KEYS)}")
    names = [row.name for row in list_ground_motions()]
    record = choice.what
    begins = [name for name in names if name.startswith(record)]
    if record not in names and not Path(record).is_file() and len(begins) == 1:
        record = begins[0]
    motion = read_ground_motion(record, Path())
    values = {key: _motion_value(choice, key) for key in choice.settings}
    stop = values.pop("stop", float(motion.time[-1]) + values.get("start", 0.0))
    if not 0.0 < stop < 1e6:
        raise ScenarioError(f"--motions {choice.what}: stop = {stop:g} s; above 0 is right.")
    if values.get("peak", 1.0) <= 0.0:
        raise ScenarioError(
            f"--motions {choice.what}: peak = {values['peak']:g}; above 0 is right, and none at "
            "all for a record as it is."
        )
    scaled = values.get("peak", motion.peak) * abs(values.get("factor", 1.0))
    if not scaled > 0.0:
        raise ScenarioError(f"--motions {choice.what}: the ground does not move; check its factor.")
    own = record if record in names else folder.keep(Path(record))
    return ComparedMotion(
        choice.label or _motion_name(Path(record).stem if record not in names else record, values),
        ComponentTable({"fmu": "GroundMotion"}, {"record": own, **values}),
        round(ceil(stop / step - 1e-9) * step, 9), scaled,
        motion.source if record in names else Path(record).name,
    )  # fmt: skip


def _motion_value(choice: Selection, key: str) -> float:
    value: Value = choice.settings[key]
    if isinstance(value, str) and key == "peak" and (found := _IN_G.fullmatch(value.strip())):
        try:
            return float(found[1]) * G
        except ValueError:
            pass
    right = "5.9 (m/s2) or 0.6g" if key == "peak" else "a number"
    return number(value, key, f"--motions {choice.what}", right)


def _motion_name(record: str, values: dict[str, float]) -> str:
    texts = [record]
    if "peak" in values:
        texts.append(f"{values['peak'] / G:.3g} g")
    if "factor" in values:
        texts.append(f"x {values['factor']:.3g}")
    return " ".join(texts)


# The building of a comparison, and where in it the damper acts.

STRUCTURE, DAMPER, CONTROLLER, GROUND = "structure", "damper", "controller", "ground"
"""The components of every scenario of a comparison."""


@dataclass(frozen=True)
class DamperPlace:
    """A building, and the place of the damper that controllers command.

    `data` is the content of its file; `part` the Structure of the scenarios; `file` the
    building's, None for the library's own; `notes` what a reader has to know.
    """

    building: Building
    data: dict[str, Any]
    device: Device
    part: ComponentTable
    file: Path | None = None
    notes: tuple[str, ...] = ()

    @property
    def ports(self) -> Ports:
        """The Structure's ports at the damper."""
        return self.building.ports(self.device)

    def check_design(self, controller: Controller, where: str) -> None:
        """Refuse a controller that was designed for another building, or another of its dampers.

        Parameters
        ----------
        controller : as read from its file, or designed
        where : what the message calls it

        Raises
        ------
        DesignError
            Naming both.
        """
        controller.check_building(self.building, where)
        made, n = str(controller.design.get("device", "")), self.building.size
        known = made in ("", *(device.name for device in self.building.devices))
        if known and self.building.device(made).incidence(n) == self.device.incidence(n):
            return
        first = "the damper on the first level"
        raise DesignError(
            f"{where}: was designed for {made or first}, not for {self.device.name or first}; "
            "--device says which damper controllers command."
        )

    @property
    def top(self) -> str:
        """Column of the top level's absolute acceleration."""
        return f"{STRUCTURE}.{self.building.levels()[-1]}_acceleration_absolute"

    @property
    def drifts(self) -> list[str]:
        """Columns of the storeys' drifts, from below."""
        floors = self.building.size - self.building.isolated
        return [f"{STRUCTURE}.drift{i + 1}" for i in range(floors)]

    @property
    def travel(self) -> str:
        """Column of the displacement across the damper."""
        return f"{STRUCTURE}.{self.ports.displacement}"

    @property
    def measured(self) -> dict[str, str]:
        """The column of each of a controller's usual inputs."""
        at = (self.ports.displacement, self.ports.velocity)
        columns = (self.top, *(f"{STRUCTURE}.{port}" for port in at), f"{DAMPER}.force")
        return dict(zip(MEASURED, columns, strict=True))

    @property
    def frequencies(self) -> list[float]:
        """Natural frequencies [Hz], ascending."""
        return frequencies(self.building)

    def shown(self) -> list[str]:
        """Return the names of the Structure's outputs."""
        return [v.name for v in catalogue.describe("Structure", self.file).of("output")]

    def outputs(self, command: str) -> tuple[Statistic, ...]:
        """Return what is kept of every run: peak and RMS of each quantity.

        Parameters
        ----------
        command : column of what commands the damper
        """
        levels = self.building.levels()
        accelerations = [f"{STRUCTURE}.{name}_acceleration_absolute" for name in reversed(levels)]
        columns = dict.fromkeys(accelerations, "m/s2")
        if self.building.isolated:
            columns[f"{STRUCTURE}.base_displacement"] = "m"
        columns |= dict.fromkeys(self.drifts, "m")
        columns |= {self.travel: "m", f"{DAMPER}.force": "N", command: "V"}
        return tuple(
            Statistic(column, statistic, unit)
            for column, unit in columns.items()
            for statistic in ("peak", "rms")
        )


def site_from(file: str | Path | None, device: str, folder: Folder) -> DamperPlace:
    """Return the building of a file, None for the library's own, with the damper's place.

    Parameters
    ----------
    file : a building file
    device : name of the building's device that controllers command; "" the damper on the first
        level, or the only device that there is
    folder : of the comparison, which keeps the file

    Raises
    ------
    PhysicsError
        If the file is no building, or it has no such device.
    ScenarioError
        If the building has several devices and none is named.
    """
    if file is None:
        part = ComponentTable({"fmu": "Structure"}, {})
        return DamperPlace(paper_building(), PAPER, paper_building().device(device), part)
    building = read_building(file)
    names = [one.name for one in building.devices]
    if not device and len(names) == 1:
        device = names[0]
    if not device and names:
        raise ScenarioError(
            f"{file}: has the devices {', '.join(names)}; --device says which of them the "
            "controllers command."
        )
    idle = [name for name in names if name != device]
    notes = [f"No damper acts at {name}: its force is 0." for name in idle]
    source = {"fmu": "Structure", "building": folder.keep(Path(file))}
    parameters = {building.device(name).ports.force: 0.0 for name in idle}
    return DamperPlace(
        building,
        toml_content(Path(file)),
        building.device(device),
        ComponentTable(source, parameters),
        Path(file),
        tuple(notes),
    )
