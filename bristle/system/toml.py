"""A scenario's tables, checked, and written back as TOML."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.config import ANY, Document
from ..core.files import write_whole
from ..core.text import listed, unknown
from ..core.toml_lines import KeyPath, toml_key, toml_table, toml_value
from ..errors import BristleError, PhysicsError, TrustError
from ..fmu.catalogue import component_names, describe
from ..fmu.description import Description, read_description
from ..physics.forms import split_form
from .model import Component, Part, RunSettings, Signal, System, existing_file
from .overrides import COMPONENT, LAW_KEYS, MADE_FROM, SCENARIO, flatten
from .parameters import check_parameter, check_storeys, check_together, choose_law, choose_over_step

MAX_RESULT_BYTES = 2**31
"""Results are kept in memory; a run that would need more [byte] is refused."""
MAX_SUBSTEPS = 10_000
STEP_TOLERANCE = 1e-6
"""How far [1] a number of steps may lie from a whole one: room for decimals, not for mistakes."""

NAME = re.compile(r"[^\W\d][\w-]*")
RESERVED = ("schema", *SCENARIO.keys, "time")


def check_steps(run: RunSettings, parts: Iterable[Part], document: Document) -> None:
    """Check that stop is a whole number of steps, not too many, and each component's own step."""
    parts = list(parts)
    for part in parts:
        if part.step is not None and run.step is not None:
            _check_fraction(part, run.step, document)
    if run.stop is None or run.step is None:
        return
    count = run.stop / run.step
    columns = 1 + sum(len(part.description.of("output")) for part in parts if part.description)
    most = MAX_RESULT_BYTES // (8 * columns)
    if count > most:
        document.error(
            ("run", "step"),
            f"[run] stop/step is {count:.3g} steps with {columns} columns each, "
            f"{8e-9 * count * columns:.3g} GB of results; at most {most} steps are right: a step "
            f"from {run.stop / most:.3g} s on, or a stop up to {most * run.step:.3g} s.",
        )
        return
    whole = max(round(count), 1)
    if abs(count - whole) > STEP_TOLERANCE:
        below, above = max(int(count), 1) * run.step, (int(count) + 1) * run.step
        choices = " or ".join(f"{stop:.12g}" for stop in dict.fromkeys((below, above)))
        document.error(
            ("run", "stop"),
            f"[run] stop = {run.stop:.12g} s is {count:.6f} steps of {run.step:.12g} s; a whole "
            f"number is right, e.g. stop = {choices}.",
        )


def _check_fraction(part: Part, step: float, document: Document) -> None:
    """Check that a component's step is the run's step divided by a whole number."""
    assert part.step is not None
    path = (*part.path, "step")
    ratio = step / part.step
    if ratio > MAX_SUBSTEPS + 0.5:
        document.error(
            path,
            f"[components.{part.name}] step = {part.step:g} s is {ratio:.3g} steps within one of "
            f"the run's; at most {MAX_SUBSTEPS} are right: from {step / MAX_SUBSTEPS:.6g} s on.",
        )
        return
    whole = max(round(ratio), 1)
    if abs(ratio - whole) > STEP_TOLERANCE:
        fewer = max(int(ratio), 1)
        choices = " or ".join(
            f"{step / n:.12g}" for n in dict.fromkeys((fewer, max(int(ratio) + 1, 1)))
        )
        if ratio < 1.0:
            choices = f"{step:.12g} or {step / 2:.12g}"
        document.error(
            path,
            f"[components.{part.name}] step = {part.step:.12g} s does not divide the run's step of "
            f"{step:.12g} s; that step by a whole number is right, e.g. {choices} s.",
        )


def check_components(document: Document, components: Mapping[str, Any]) -> dict[str, Part]:
    """Check every component on its own; return them in the order of the file."""
    parts: dict[str, Part] = {}
    if not components and isinstance(document.data.get("components", {}), dict):
        words = "no components: [components.NAME] with fmu = ... adds one."
        document.error(("components",), words)
    for name, settings in components.items():
        path: KeyPath = ("components", name)
        if not NAME.fullmatch(name) or name in RESERVED:
            document.error(
                path,
                f'[components."{name}"]: a component cannot be called so; letters, digits, _ and - '
                f"are right, beginning with a letter, and none of {', '.join(RESERVED)}.",
            )
        # A key that is none of them may be a parameter, which its description knows.
        found = document.read(COMPONENT._replace(each=ANY), path, settings)
        if isinstance(settings, dict):
            parts[name] = _check_component(document, Part(name, path), settings, found)
    return parts


def _check_component(
    document: Document, part: Part, settings: Mapping[str, Any], found: Mapping[str, Any]
) -> Part:
    """Check a component; `settings` is its table, `found` what could be read in it."""
    where, folder = f"[components.{part.name}]", Path(document.path).parent
    part.step = found["step"]
    for key in MADE_FROM:
        if key == "building" and key in settings and found["fmu"] != "Structure":
            words = 'only the built-in "Structure" is made from a building.'
            document.error((*part.path, key), f"{where} {key}: {words}")
        elif (value := found[key]) is not None:
            file = existing_file(value, folder, (*part.path, key), f"{where} {key}", document)
            setattr(part, key, file)
    _choose_effects(part, found, folder, document)
    if not any(key in settings for key in LAW_KEYS):
        _choose_fmu(part, settings, found, folder, document)
    elif choose_law(part, settings, found, folder, document):
        _describe(part, (*part.path, "law"), settings, document)
    choose_over_step(part, settings, found["over_step"], document)
    for key in settings:
        if key in COMPONENT.keys:
            continue
        if key in part.variables:
            words = f'"{key}" belongs into its parameters: parameters = {{ {key} = ... }}.'
        else:
            words = unknown("key", key, COMPONENT.keys)
        document.error((*part.path, key), f"{where}: {words}")
    path = (*part.path, "parameters")
    for name, value, place in flatten(found["parameters"], path):
        if name in part.places:
            document.error(place, f"{where}: {name} is set twice, with and without quotes.")
        part.places[name] = place
        if part.description:
            check_parameter(part, name, value, folder, document)
    check_together(part, folder, document)
    check_storeys(part, document)
    return part


def _choose_effects(part: Part, found: Mapping[str, Any], folder: Path, document: Document) -> None:
    """Read `effects` of a component: files with effects of a user's own."""
    if found["effects"] is None:
        return
    path, where = (*part.path, "effects"), f"[components.{part.name}] effects"
    fmu = found["fmu"] or ""
    if fmu.lower().endswith(".fmu") or "/" in fmu or "\\" in fmu:
        document.error(path, f"{where}: an FMU has its own effects; a built-in name takes files.")
        return
    files = (existing_file(file, folder, path, where, document) for file in found["effects"])
    part.effects = tuple(file for file in files if file is not None)


def _choose_fmu(
    part: Part, settings: Mapping[str, Any], found: Mapping[str, Any], folder: Path,
    document: Document,
) -> None:  # fmt: skip
    """Read `fmu` of a component, and what that FMU says of itself."""
    path, where = (*part.path, "fmu"), f"[components.{part.name}]"
    value = found["fmu"]
    if not value:
        if "fmu" not in settings or value == "":
            right = "expected a built-in name or the path of an .fmu file"
            document.error(path, f"{where}: fmu is missing: {right}.")
        return
    part.kind = value
    if value.lower().endswith(".fmu") or "/" in value or "\\" in value:
        part.file = existing_file(value, folder, path, where, document)
        if part.controller:
            words = "a foreign FMU takes no controller file; the built-in controllers do."
            document.error((*part.path, "controller"), f"{where}: {words}")
        if part.file is None:
            return
    elif value not in component_names():
        document.error(path, f"{where}: {unknown('built-in FMU', value, component_names())}")
        return
    _describe(part, path, settings, document)


def _describe(part: Part, path: KeyPath, settings: Mapping[str, Any], document: Document) -> None:
    """Read what a component's FMU says of itself.

    Parameters
    ----------
    part, settings : the component
    path : the keys that lead to what chose its FMU
    document : takes what is found
    """
    where = f"[components.{part.name}]"
    try:
        if part.file:
            part.description = read_description(part.file)
            _note_on_fmu(part, part.description, path, document)
        elif all(getattr(part, key) or key not in settings for key in MADE_FROM):
            made_of = part.law.component if part.law else part.kind
            more: dict[str, Any] = {"effects": part.effects} if part.effects else {}
            given = settings.get("parameters")
            if isinstance(given, dict) and any(key.partition(".")[0] == "range" for key in given):
                more["ranged"] = True  # what knows the range of its data has an output more
            part.description = describe(made_of, part.building, part.controller, **more)
    except TrustError:
        raise  # no mistake of the file, and it is asked about
    except BristleError as error:
        given = [key for key in MADE_FROM if getattr(part, key)]
        if part.effects and isinstance(error, PhysicsError) and not given:
            given = ["effects"]
        at = (*part.path, given[0]) if given else path
        document.error(at, f"{where}: {error}")


def _note_on_fmu(part: Part, fmu: Description, path: KeyPath, document: Document) -> None:
    """Say which inputs of an FMU are not read, and where it begins elsewhere than a run does."""
    if fmu.unread:
        text = f"of type Binary, which is not read, its FMU has the input {listed(fmu.unread)}"
        document.note(path, f"[components.{part.name}]: {text}.")
    begins = fmu.begins.strip()
    try:
        if not begins or float(begins) == 0.0:
            return
    except ValueError:
        pass  # no number: it is shown as it stands
    text = f"the default experiment of its FMU begins at {begins} s; a run begins at 0 s"
    document.note(path, f"[components.{part.name}]: {text}.")


# A system as TOML text, and as a folder of files.


def scenario_text(system: System) -> str:
    """Return the TOML text of a system; read again it gives the same one.

    Files are written as absolute paths, so that the text holds wherever it is put. A signal that no
    file holds is left out: see `save`.
    """
    return _text(system, None)


def save(system: System, file: Path, about: str = "") -> list[Path]:
    """Write a system as a scenario, with the signals that it plays; return the files, it first.

    Files in its folder are named from there. A building that is data goes into a file as well.

    Parameters
    ----------
    system, file : what is written, and where
    about : comment above it

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    folder = file.absolute().parent
    folder.mkdir(parents=True, exist_ok=True)
    made: list[Path] = []
    components = dict(system.components)
    for name, one in system.components.items():
        if one.signal is not None:
            path = folder / f"{one.signal.name or name}.csv"
            path = folder / f"{name}_{path.name}" if path in made else path
            made.append(signal_file(one.signal, path))
            values = {**one.values, one.plays: str(path)}
            components[name] = one = replace(one, values=values, signal=None)
        if one.building is not None and not isinstance(one.building, Path):
            made.append(folder / f"{name}_building.toml")
            write_whole(made[-1], "\n".join(toml_table(one.building)) + "\n")
            components[name] = replace(one, building=made[-1])
    text = _text(replace(system, components=components), folder)
    write_whole(file, f"{about}\n\n{text}" if about else text)
    return [file, *made]


def _text(system: System, folder: Path | None) -> str:
    wires: dict[str, Any] = {}
    for wire in system.wires:
        source = f"{wire.source}.{wire.output}"
        transformed = {"from": source, "factor": wire.factor}
        transformed |= {"offset": wire.offset} if wire.offset else {}
        wires[f"{wire.target}.{wire.input}"] = transformed if wire.transformed else source
    run = {"stop": system.stop, "step": system.step, "algorithm": system.algorithm}
    tables = {name: _table_of(one, folder) for name, one in system.components.items()}
    return tables_text(system.title, run, tables, wires)


def tables_text(
    title: str,
    run: Mapping[str, Any],
    components: Mapping[str, Mapping[str, Any]],
    wires: Mapping[str, Any],
) -> str:
    """Return the text of a scenario.

    Parameters
    ----------
    title, run, components, wires : as for `scenario.make_system`; files by their names
    """
    lines = ["schema = 1", f"title = {toml_value(title)}", "", "[run]", *toml_table(run)]
    for name, table in components.items():
        lines += ["", f"[components.{toml_key(name)}]", *toml_table(table)]
    return "\n".join([*lines, "", "[connections]", *toml_table(wires)]) + "\n"


def _table_of(component: Component, folder: Path | None) -> dict[str, Any]:
    """Return the table of a component; files in the folder are named from there."""

    def named(file: Path) -> str:
        file = file.absolute()
        inside = folder is not None and file.is_relative_to(folder)
        return (file.relative_to(folder) if inside and folder else file).as_posix()

    found: dict[str, Any] = {}
    if (law := component.law) is not None:
        name, form, knots = split_form(law.name)
        given = {"command": form, "command_knots": list(knots)}
        found["law"] = named(law.file) if law.file else name
        found |= {key: value for key, value in given.items() if value}
    else:
        found["fmu"] = component.kind if component.path is None else named(component.path)
    values = dict(component.values)
    if (played := str(values.get(component.plays, ""))) and Path(played).is_absolute():
        values[component.plays] = named(Path(played))
    building, controller = (
        named(file) if isinstance(file, Path) else file
        for file in (component.building, component.controller)
    )
    more = {
        "building": building, "effects": [named(file) for file in component.effects] or None,
        "controller": controller, "step": component.step,
        "over_step": component.over_step or None, "parameters": values or None,
    }  # fmt: skip
    return found | {key: value for key, value in more.items() if value is not None}


def signal_file(signal: Signal, path: Path) -> Path:
    """Write a signal as a two-column CSV; return its path."""
    rows = [f"time [s],{signal.quantity} [{signal.unit}]"]
    for t, value in zip(signal.time.tolist(), signal.values.tolist(), strict=True):
        rows.append(f"{repr(t).removesuffix('.0')},{value!r}")
    write_whole(path, "\n".join(rows) + "\n")
    return path
