"""A scenario as one component: its ports by name, where signals lie, its FMU."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from ..component import HELD, LINEAR, controller, damper, sensors, source, structure
from ..engine.coupled import LONGEST_SUBSTEP, RecordLayout
from ..engine.records import MEASURED, NOWHERE
from ..errors import ScenarioError
from ..fmu import catalogue
from ..fmu.build import PACKAGE, BuildPlan
from ..fmu.component import Played, SampleFile, SourceSlave
from ..physics.linear import packed
from ..system.library import run_name
from ..system.model import System
from ..system.scenario import load_scenario, resolve_scenario
from . import composite_functions as functions

KINDS: dict[Any, int] = {
    source: functions.SOURCE, damper: functions.DAMPER, structure: functions.STRUCTURE,
    controller: functions.CONTROLLER, sensors: functions.SENSORS,
}  # fmt: skip

FOUND_BY_THE_STEP = "holding_force"
"""An input that no host can give: the coupled step finds what holds a structure itself."""


@dataclass(frozen=True)
class Input:
    """An input of the whole: a port of a part, or with `is_value` a parameter of a source.

    It is `optional` where the scenario runs without a value for it.
    """

    part: str
    port: str
    optional: bool = True
    is_value: bool = False

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.part}.{self.port}"


class Assembly:
    """A scenario as one component.

    Parameters
    ----------
    file, overrides : as for `scenario.load_scenario`
    named : iterable of str
        Ports and parameters of sources, as PART.PORT, that become inputs besides those that are
        open.

    Attributes
    ----------
    scenario : System
        As it is left, without what feeds the inputs that are named.
    system : RecordLayout
    inputs : list of Input

    Raises
    ------
    ScenarioError
        If the scenario cannot be compiled, or a name is none that can be an input.
    """

    def __init__(
        self,
        file: str | Path,
        overrides: Mapping[str, object] | None = None,
        named: Iterable[str] = (),
    ) -> None:
        whole = load_scenario(file, overrides)
        chosen = [_named(whole, one) for one in dict.fromkeys(named)]
        cut = {(one.part, one.port) for one in chosen if not one.is_value}
        fed = cut & {(c.target, c.input) for c in whole.wires}
        left = [c for c in whole.wires if (c.target, c.input) not in cut]
        self.scenario = replace(whole, wires=tuple(left))
        self.system = RecordLayout(self.scenario, only_on=True)
        self.parts: dict[str, Any] = self.system.slaves
        open_ones = [
            Input(name, port, (name, port) not in fed)
            for name, slave in self.parts.items()
            for port in (slave.vars[index].name for index in slave._inputs)
            if (name, port) not in self.system.source_of and port != FOUND_BY_THE_STEP
        ]
        self.inputs = [*open_ones, *(one for one in chosen if one.is_value)]

    def kind(self, part: str) -> int:
        """Return which of `KINDS` a part is."""
        return KINDS[type(self.parts[part]).functions]

    def is_held(self, one: Input) -> bool:
        """Return whether an input is held over a step: commands and values are, for they jump."""
        if one.is_value:
            return True
        slave = self.parts[one.part]
        return self.kind(one.part) == functions.DAMPER and one.port == slave.drive.name

    def over_step(self, one: Input) -> str:
        """Return how an input is taken over a step."""
        return HELD if self.is_held(one) else LINEAR

    # -- files that parts play

    @cached_property
    def files(self) -> dict[str, Path]:
        """The files that sources play, by their names among the resources, without ".csv"."""
        found: dict[str, Path] = {}
        for slave in self.parts.values():
            if isinstance(slave, SourceSlave):
                path = _played_file(slave)
                if path is not None:
                    found.setdefault(_free_name(path, found), path)
        return found

    def start_value(self, part: str, parameter: str) -> Any:
        """Return the value of a part's parameter: of a file, its name among the resources."""
        slave = self.parts[part]
        value = slave[parameter]
        reading = getattr(slave, "file_of", None)
        if reading is not None and parameter == reading.parameter:
            path = _played_file(slave)
            names = [name for name, file in self.files.items() if file == path]
            return names[0] if names else value
        return value

    def played(self) -> list[Played]:
        """Return from what the signals are read that sources play, one for each source."""
        found = []
        for name, slave in self.parts.items():
            for one in slave.played():
                file, pairs = (_of_part(name, reading) for reading in (one.file, one.pairs))
                found.append(Played(file, pairs, one.header))
        return found

    # -- what the functions compute with

    def bake(self) -> list[float]:
        """Return what the build fixes, as `composite_functions` takes it apart."""
        system = self.system
        starts = {
            f"{part}.{name}": value
            for part, slave in self.parts.items()
            for name, value in zip(slave.parameter_names(), slave.flat_values(), strict=True)
        }
        inputs = {one.name for one in self.inputs}
        places = {name: k for k, name in enumerate(one for one in starts if one not in inputs)}
        taken = [places.get(name, NOWHERE) for name in starts]
        names = [name for group in system.names.values() for name in group]
        counts = [len(system.names[kind]) for kind in ("source", "damper", "structure", "sampled")]
        signals = [*system.start_values(), 0.0]  # the last one takes what is no signal
        parts = list(self.parts)
        slots, held, measures, set_by, of = [], [], [], [], []
        for one in self.inputs:
            slot = len(signals) - 1 if one.is_value else system.slots[one.part, one.port]
            slots.append(slot)
            held.append(self.is_held(one))
            given = self.kind(one.part) == functions.DAMPER and one.port == "acceleration"
            measures.append(self._number(one.part) if given else NOWHERE)
            set_by.append(list(starts).index(one.name) if one.is_value else NOWHERE)
            of.append(parts.index(one.part) if one.is_value else NOWHERE)
        shown = [system.outputs[name] for name in self.shown()]
        general = [len(names), self.scenario.step, LONGEST_SUBSTEP, *counts]
        baked: list[Sequence[float]] = [general, signals, shown, slots, held, measures, set_by, of]
        baked += [taken, [*starts.values()]]
        first, first_place, played = 0, 0, 0
        for name, slave in self.parts.items():
            own = [f"{name}.{one}" for one in slave.parameter_names()]
            plays = len(slave.played())
            about = [
                self.kind(name), self._number(name), first, len(own), first_place,
                played if plays else NOWHERE,
            ]  # fmt: skip
            baked += [about, self._wiring(name), slave.bake()]
            first, played = first + len(own), played + plays
            first_place += sum(one in places for one in own)
        return packed(*baked)

    def shown(self) -> list[str]:
        """Return the Real outputs of all parts, as PART.PORT."""
        return [name for name, kind in self.system.kinds.items() if kind == "Real"]

    def _number(self, part: str) -> int:
        """Return the number of a part among those of its kind."""
        group = next(names for names in self.system.names.values() if part in names)
        return group.index(part)

    def _wiring(self, part: str) -> list[float]:
        wiring = self.system.wiring(part)
        if self.kind(part) == functions.DAMPER:
            given = self.parts[part].constants.measured  # the scenario holds it constant
            wiring[MEASURED] = bool(wiring[MEASURED] or given)
        return wiring

    # -- what follows what

    def followed(self, part: str, port: str, initial: bool = False) -> list[str]:
        """Return the inputs of the whole that an output follows at once, by their names.

        Parameters
        ----------
        part, port : the output
        initial : whether before the first step, where first samples follow what is measured
        """
        names, seen = {one.name for one in self.inputs}, set()
        found: list[str] = []
        left = [(part, port)]
        while left:
            one = left.pop()
            if one in seen:
                continue
            seen.add(one)
            for other in self._inputs_of(*one, initial):
                if f"{one[0]}.{other}" in names:
                    found.append(f"{one[0]}.{other}")
                elif begin := self.system.source_of.get((one[0], other)):
                    left.append(begin)
            found += [i.name for i in self.inputs if i.is_value and i.part == one[0]]
        return sorted(set(found))

    def _inputs_of(self, part: str, port: str, initial: bool) -> Sequence[str]:
        slave = self.parts[part]
        if initial and self.kind(part) in (functions.CONTROLLER, functions.SENSORS):
            return [slave.vars[index].name for index in slave._inputs]
        follows: Sequence[str] = slave._depends[port]
        return follows


def _named(scenario: System, name: str) -> Input:
    """Return the input of a name; ScenarioError for what cannot be one."""
    part, _, port = name.partition(".")
    found = scenario.variable(name)
    if found is None or found.causality not in ("input", "parameter"):
        raise ScenarioError(
            f'{scenario.where}: no component has an input or a parameter "{name}"; '
            "COMPONENT.PORT is right, as in structure.ground_acceleration."
        )
    if found.causality == "input":
        if port == FOUND_BY_THE_STEP:
            raise ScenarioError(
                f"{scenario.where}: {name} cannot be an input: the coupled step finds it itself."
            )
        return Input(part, port)
    kind = catalogue.component_class(catalogue.source(scenario.components[part].made_of()))
    if found.kind != "Real" or not issubclass(kind, SourceSlave):
        raise ScenarioError(
            f"{scenario.where}: {name} cannot be an input: it is fixed once a run begins. Ports "
            "can be, and numbers of sources, as ground.factor or voltage.level."
        )
    return Input(part, port, is_value=True)


def _played_file(slave: SourceSlave) -> Path | None:
    """Return the file that a source plays, None where it plays none."""
    if slave.file_of is None or not slave._is_read(slave.file_of):
        return None
    name = slave[slave.file_of.parameter]
    files = [Path(one) for one in getattr(slave, "files", ())]
    bundled = {one.stem: PACKAGE / one for one in files}
    path: Path = bundled.get(name, Path(name))
    return path


def _free_name(path: Path, taken: Mapping[str, Path]) -> str:
    """Return a name for a file among the resources that no other one has."""
    stem = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in path.stem)
    name, k = stem, 2
    while name in taken and taken[name] != path:
        name, k = f"{stem}_{k}", k + 1
    return name


def _of_part(part: str, reading: SampleFile | None) -> SampleFile | None:
    if reading is None:
        return None
    chooser = f"{part}.{reading.chooser}" if reading.chooser else ""
    return SampleFile(f"{part}.{reading.parameter}", chooser, reading.word)


_COMPONENT = Path(__file__).with_name("component.py")


def export_composite(
    scenario: str | Path,
    folder: Path,
    build: Callable[[BuildPlan, Path], Path],
    overrides: Mapping[str, object] | None = None,
    inputs: Iterable[str] = (),
) -> Path:
    """Write a scenario as one FMU into a folder, made if missing; return its path.

    Parameters
    ----------
    scenario, overrides
        As for `scenario.load_scenario`.
    folder : Path
    build : callable
        Builds a planned FMU into a folder: `native.build.build` for some platforms.
    inputs : iterable of str
        Ports, and parameters of sources, that become inputs: PART.PORT.

    Raises
    ------
    ScenarioError
        If the scenario is wrong or cannot be compiled, or an input is none.
    BuildError
        If the FMU cannot be built.
    """
    return build(plan_of(scenario, overrides, inputs), folder)


def plan_of(
    scenario: str | Path, overrides: Mapping[str, object] | None = None, inputs: Iterable[str] = ()
) -> BuildPlan:
    """Return what to build; parameters and errors are those of `export_composite`."""
    file, named = resolve_scenario(scenario), list(inputs)
    given = (overrides or {}).items()
    chosen = {key: str(value) if isinstance(value, Path) else value for key, value in given}
    assembly = Assembly(file, chosen, named)
    name = re.sub(r"[^A-Za-z0-9_]", "_", run_name(file, chosen))
    if not name[0].isalpha():
        name = f"scenario_{name}"
    parts = assembly.scenario.components.values()
    effects = dict.fromkeys(path for part in parts for path in part.effects)
    laws = dict.fromkeys(part.law.file for part in parts if part.law and part.law.file)
    baked = {"name": name, "scenario": str(file), "overrides": chosen, "inputs": named}
    files = {f"{name}.csv": path for name, path in assembly.files.items()}
    return BuildPlan(name, _COMPONENT, baked, files, tuple(effects), tuple(laws))
