"""Checks of a component's parameters: names, types, bounds, and the files that they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import pi, sin
from pathlib import Path
from typing import Any

from ..component import SAMPLED
from ..core.config import Document
from ..core.text import unknown
from ..data import read_ground_motion
from ..data.building_file import read_building
from ..data.titles import column
from ..errors import BristleError, PhysicsError, RecordError, TrustError
from ..fmu.catalogue import component_names
from ..fmu.description import Variable
from ..physics.building import ROUNDING, Building
from ..physics.effect import EFFECTS
from ..physics.forms import TABLE_FORM
from ..physics.motion_file import ANY_HEADER, read_text, read_two_column, rows
from ..physics.signals import KINDS, PARAMETERS, STEPS, TAKEN, read_steps
from ..units import Measure, alike
from .library import damper_of, law_of
from .model import (
    FILE_PARAMETERS,
    Component,
    Part,
    RunSettings,
    Signal,
    Wrong,
    existing_file,
    typed,
)

# Checks of built-in test signals: their samples, parameters that do nothing, rods that jump.

_SMALL_JUMP = 1e-3
"""Share of the amplitude [1] below which a jump of the displacement is not worth a word."""


def check_signal(part: Part, folder: Path, document: Document) -> None:
    """Check the samples of a signal, and that its kind takes all parameters that are set.

    Parameters
    ----------
    part : Part
        Any component; one without a `kind` of signal is passed over.
    folder : Path
        The scenario's; relative names of files begin there.
    document : Document
        Takes what is found.
    """
    kind = part.value("kind")
    if part.file is not None or not isinstance(kind, str) or kind not in KINDS:
        return
    if kind == "csv" and "file" in part.variables and part.signal is None:
        _check_csv(part, folder, document)
    if kind == "steps" and "steps" in part.variables:
        _check_steps(part, document)
    taken = TAKEN[kind]
    for name in (*PARAMETERS, "steps", "file"):
        if name in part.values and name not in taken:
            document.warning(
                part.places[name],
                f'{part.name}.{name} does nothing while {part.name}.kind is "{kind}", which takes '
                f"{', '.join(taken)}.",
            )


def _check_csv(part: Part, folder: Path, document: Document) -> None:
    path = part.places.get("file") or part.places.get("kind", part.path)
    value, where = part.value("file"), f"{part.name}.file"
    if not value:
        document.error(path, f'{where} is missing: kind = "csv" reads a file.')
        return
    file = existing_file(str(value), folder, path, where, document)
    if file:
        like = part.variables.get("offset")
        wanted = like.measure if like else None
        try:
            read_two_column(file, ANY_HEADER.replace("UNIT", wanted.name if wanted else "UNIT"))
        except PhysicsError as error:
            document.error(path, f"{where}: {error}")
            return
        title = next(rows(read_text(file)))[1].partition(",")[2].strip()
        unit = column(1, title).unit
        if unit and wanted is None:
            part.played = Measure(unit.name)
        elif unit and wanted and wanted.unit and not alike(unit, wanted.unit):
            text = f'its values are "{title}", and are taken in [{wanted.name}]. Convert them.'
            document.error(path, f"{where}: {file}: {text}")


def _check_steps(part: Part, document: Document) -> None:
    try:
        read_steps(str(part.value("steps") or ""))
    except PhysicsError as error:
        path = part.places.get("steps") or part.places.get("kind", part.path)
        document.error(path, f"{part.name}.{error}")


def check_rod(part: Part, run: RunSettings, document: Document) -> None:
    """Warn of a prescribed motion that jumps: its velocity shows nothing of it.

    Parameters
    ----------
    part : Part
        Any component; one that is no built-in motion of a rod is passed over.
    run : RunSettings
        Its stop says what is reached.
    document : Document
        Takes what is found.
    """
    if part.file is not None or not {"displacement", "kind"} <= part.variables.keys():
        return
    for name, text in _jumps(part, run.stop or 0.0):
        document.warning(part.places.get(name) or part.places.get("kind", part.path), text)


def _jumps(part: Part, stop: float) -> Iterator[tuple[str, str]]:
    """Yield the parameter and the text of each jump before the stop [s]."""
    kind, numbers = part.value("kind"), {name: part.real(name) or 0.0 for name in PARAMETERS}
    if kind not in ("sine", "chirp"):
        return
    amplitude, phase, start = (numbers[name] for name in ("amplitude", "phase", "start"))
    if 0.0 < start < stop and abs(sin(phase)) > _SMALL_JUMP and amplitude:
        yield (
            "phase",
            f"{part.name}: the displacement jumps by {amplitude * sin(phase):.3g} m with velocity "
            f"0 where the {kind} begins, at t = {start:.9g} s; phase = 0 or start = 0 is right.",
        )
    duration, mean = numbers["duration"], 0.5 * (numbers["frequency"] + numbers["frequency_end"])
    end, cycles = start + duration, mean * duration + phase / (2.0 * pi)
    jump = -amplitude * sin(2.0 * pi * cycles)
    if kind == "chirp" and 0.0 < end < stop and abs(jump) > _SMALL_JUMP * abs(amplitude):
        text = f"{part.name}: the displacement jumps by {jump:.3g} m with velocity 0 where the "
        yield "duration", f"{text}chirp ends, at t = {end:.9g} s{_better(duration, mean, phase)}."


def _better(duration: float, mean: float, phase: float) -> str:
    """Return the duration [s] nearest to this one at which a chirp ends at its offset."""
    if mean <= 0.0:
        return ""
    before = phase / pi  # half cycles
    halves = max(round(2.0 * mean * duration + before), int(before // 1) + 1)
    return f"; duration = {(halves - before) / (2.0 * mean):.9g} ends it at its offset"


def check_parameter(part: Part, name: str, value: object, folder: Path, document: Document) -> None:
    """Check one parameter, and keep its value in `part.values` if it is right.

    Parameters
    ----------
    part : Part
        The component; `part.places` knows where the parameter stands.
    name, value : str, object
        Its name, and its value as the file has it.
    folder : Path
        The scenario's; relative names of files begin there.
    document : Document
        Takes what is found.
    """
    where, place = f"{part.name}.{name}", part.places[name]
    variable = part.variables.get(name)
    if variable is None:
        settable = [v.name for v in part.variables.values() if v.causality == "parameter"]
        words = unknown("parameter", name, settable, part.ports_command)
        if name == "record":
            words += ' A record is played by fmu = "GroundMotion", as in el_centro_0p6g_clipped.'
        document.error(place, f"[components.{part.name}]: {words}")
        return
    if variable.causality not in ("parameter", "input"):
        kind = {"output": "an output", "local": "internal"}.get(
            variable.causality, f"a {variable.causality}"
        )
        document.error(place, f"{where} is {kind}; only parameters and inputs can be set.")
        return
    if isinstance(value, Signal) and name in FILE_PARAMETERS:
        part.signal = value
        return
    checked = typed(variable, value)
    if isinstance(checked, Wrong):
        document.error(place, f"{where} {checked.words}")
        return
    part.values[name] = checked
    if part.kind == "GroundMotion" and name == "record":
        try:
            read_ground_motion(str(checked), folder)  # as the run will read it
        except RecordError as error:
            document.error(place, f"{where}: {error}")


def check_together(part: Part, folder: Path, document: Document) -> None:
    """Check parameters that need one another: switches of effects, kinds of signals."""
    for name in part.values:
        switch = f"{name.rpartition('.')[0]}.on"
        if name != switch and switch in part.variables and part.value(switch) is not True:
            document.warning(
                part.places[name],
                f"{part.name}.{name} does nothing while {part.name}.{switch} is false.",
            )
    check_signal(part, folder, document)


# The law of a damper that a scenario names: of the library or a user's own, in a chosen form.


def choose_law(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], folder: Path,
    document: Document,
) -> bool:  # fmt: skip
    """Read `law`, `command` and `command_knots` of a component; return whether they are right.

    Parameters
    ----------
    part, settings, found : the component, which gets its law; its table; what could be read in it
    folder : where relative names begin
    document : takes what is found

    Raises
    ------
    TrustError
        If nobody consented to the code of a user's own law.
    """
    where = f"[components.{part.name}]"
    law = _named(part, settings, found, folder, document)
    form = _form(part, settings, found, document)
    if law is None or form is None:
        return False
    try:
        part.law = damper_of(law, *form)
    except TrustError:
        raise  # no mistake of the file, and it is asked about
    except BristleError as error:
        key = "command" if "command" in settings and "law" not in settings else "law"
        document.error((*part.path, key), f"{where}: {error}")
        return False
    part.kind = part.law.shown
    return True


def _named(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], folder: Path,
    document: Document,
) -> str | Path | None:  # fmt: skip
    """Return the law that is named, by itself or by a built-in damper; None where none is."""
    where = f"[components.{part.name}]"
    fmu, path = found["fmu"], (*part.path, "law")
    value: str | None = found["law"]
    if "law" not in settings:
        own = law_of(fmu) if fmu in component_names() else ""
        if not own:
            words = (
                f"{where}: only a built-in damper takes a form of the command, or law = ... does."
            )
            document.error((*part.path, "command"), words)
        return own or None
    if "fmu" in settings:
        words = f"{where}: fmu and law both say what the damper is; one of them must go."
        document.error((*part.path, "fmu"), words)
        return None
    if value == "":
        words = 'law is missing: expected the name of a law, or "FILE.py" of your own.'
        document.error(path, f"{where}: {words}")
    if not value:
        return None
    if not value.endswith(".py"):
        return value
    return existing_file(value, folder, path, f"{where} law", document)


def _form(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], document: Document
) -> tuple[str, tuple[float, ...]] | None:
    """Return the form of the command and the knots [V] of a table; None where they are wrong."""
    if any(key in settings and found[key] is None for key in ("command", "command_knots")):
        return None
    form, knots = found["command"] or "", found["command_knots"] or ()
    if bool(knots) != (form == TABLE_FORM):
        document.error(
            (*part.path, "command_knots"),
            f"[components.{part.name}]: command_knots is {'a list' if knots else 'missing'}: "
            f'expected a list of numbers [V] beside command = "{TABLE_FORM}", and none beside '
            "another form.",
        )
        return None
    return form, knots


# What a scenario says of the ports of a foreign FMU: how inputs are taken over a step.


def choose_over_step(
    part: Part, settings: Mapping[str, Any], told: Mapping[str, str | None], document: Document
) -> None:
    """Read `over_step` of a component, port by port.

    Parameters
    ----------
    part : Part
        Its `over_step` is filled.
    settings, told : mapping
        The component's table in the scenario; the words by port, None for one that is none.
    document : Document
        Takes what is found.
    """
    path, where = (*part.path, "over_step"), f"[components.{part.name}] over_step"
    if not isinstance(settings.get("over_step"), dict):
        return
    if part.file is None:
        document.error(
            path, f"{where}: built-in components say it themselves, foreign FMUs do not."
        )
        return
    ports = {name: v for name, v in part.variables.items() if v.causality in ("input", "output")}
    for name, word in told.items():
        if part.description and name not in ports:
            document.error((*path, name), f"{where}: {unknown('port', name, ports)}")
        elif word is None:
            continue  # which is said already
        elif name in ports and ports[name].causality == "output" and word != SAMPLED:
            document.error(
                (*path, name),
                f'{where}: {name} is an output: "{SAMPLED}" is right, if it stands between '
                "instants of its own.",
            )
        else:
            part.over_step[name] = word


def told_over_step(component: Component) -> dict[str, str]:
    """Return what is known of a component's ports beside what its FMU says.

    That is what a scenario says of a foreign FMU. The outputs of a built-in signal of the kind
    "steps" stand between its steps: to go on from them would leave the range of the signal.
    """
    kind = str(component.values.get("kind", ""))
    if component.path is None and KINDS.get(kind) == STEPS:
        return {v.name: SAMPLED for v in component.description.of("output") if v.kind == "Real"}
    return component.over_step


def as_told(variable: Variable, told: Mapping[str, str]) -> Variable:
    """Return a variable with what a scenario says of it: an output that is sampled is discrete."""
    word = told.get(variable.name)
    if word is None:
        return variable
    if variable.causality == "output":
        return replace(variable, variability="discrete")
    return replace(variable, over_step=word)


# Check of the stiffness that a building's matrix leaves to each storey.


def check_storeys(part: Part, document: Document) -> None:
    """Warn of storeys without a positive stiffness; refuse them where an effect needs it.

    Matrices that were condensed may have such entries. But an effect that takes a share of the
    storey's stiffness pushes outwards there.

    Parameters
    ----------
    part : Part
        Any component; one without a building of its own is passed over.
    document : Document
        Takes what is found.
    """
    if part.building is None:
        return
    try:
        building = read_building(part.building)
    except PhysicsError:  # told where the component is described
        return
    path, where = (*part.path, "building"), f"[components.{part.name}] building"
    levels = ["ground", *building.levels()]
    least = ROUNDING * max(abs(value) for row in building.K for value in row)
    for i, stiffness in enumerate(building.stiffnesses):
        if stiffness > least:
            continue
        text = (
            f"K gives {stiffness:.4g} N/m between {levels[i]} and {levels[i + 1]}; a positive "
            f"stiffness is right, {_right(i)}."
        )
        needing = list(_needing(part, building, i))
        for name in needing:
            place = part.places.get(f"{name}.on", path)
            document.error(
                place, f"{part.name}.{name} needs the stiffness below each level: {text}"
            )
        if not needing:
            document.warning(path, f"{where}: {text}")


def _right(i: int) -> str:
    """Return where in K the stiffness below level i stands."""
    if i == 0:
        return "the sum of the first row of K"
    return f"with a negative entry in row {i + 1}, column {i} of K"


def _needing(part: Part, building: Building, i: int) -> Iterator[str]:
    """Yield the effects in use that need the stiffness below level i."""
    layer = building.isolated and i == 0
    storey = i if building.isolated else i + 1
    for name, effect in EFFECTS.items():
        if part.value(f"{name}.on") is not True or "stiffness" not in effect.needs:
            continue
        only = part.real(f"{name}.which") or 0.0  # 0: every storey
        of_storeys = "storey" in effect.needs or "drift" in effect.needs
        if (layer and not of_storeys) or (of_storeys and not layer and only in (0.0, storey)):
            yield name
