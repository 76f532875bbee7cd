"""A scenario's tables, checked, and written back as TOML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ..core.config import ANY, Document
from ..core.files import write_whole
from ..core.text import unknown
from ..core.toml_lines import KeyPath
from ..core.toml_write import toml_key, toml_table, toml_value
from ..errors import BristleError, PhysicsError, TrustError
from ..fmu.description import Value
from ..model.model import Model
from ..physics.effect import EFFECTS
from ..physics.forms import split_form
from ..user_code.load import own_effects, own_laws
from .library import Library
from .model import Component, Part, Run, Scenario, existing_file
from .overrides import COMPONENT, FILE_PARAMETERS, LAW_KEYS, MADE_FROM, SCENARIO, flatten
from .parameters import check_parameter, check_storeys, check_together, choose_law, choose_over_step

MAX_RESULT_BYTES = 2**31
"""Results are kept in memory; a run that would need more [byte] is refused."""
MAX_SUBSTEPS = 10_000
STEP_TOLERANCE = 1e-6
"""How far [1] a number of steps may lie from a whole one: room for decimals, not for mistakes."""

NAME = re.compile(r"[^\W\d][\w-]*")
RESERVED = ("schema", *SCENARIO.keys, "time")


def check_steps(run: Run, parts: Iterable[Part], document: Document) -> None:
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


def check_components(
    document: Document, components: Mapping[str, Any], library: Library
) -> dict[str, Part]:
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
            parts[name] = _check_component(document, Part(name, path), settings, found, library)
    return parts


def _check_component(
    document: Document, part: Part, settings: Mapping[str, Any], found: Mapping[str, Any],
    library: Library,
) -> Part:  # fmt: skip
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
        _choose_fmu(part, settings, found, folder, library, document)
    elif choose_law(part, settings, found, folder, library, document):
        _describe(part, (*part.path, "law"), settings, library, document)
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
            check_parameter(part, name, value, folder, library, document)
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
    library: Library, document: Document,
) -> None:  # fmt: skip
    """Read `fmu` of a component, and what that FMU says of itself."""
    path, where = (*part.path, "fmu"), f"[components.{part.name}]"
    value = found["fmu"]
    if not value:
        if "fmu" not in settings or value == "":
            right = "expected a built-in name or the path of an .fmu file"
            document.error(path, f"{where}: fmu is missing: {right}.")
        return
    part.fmu = value
    if value.lower().endswith(".fmu") or "/" in value or "\\" in value:
        part.file = existing_file(value, folder, path, where, document)
        if part.controller:
            words = "a foreign FMU takes no controller file; the built-in controllers do."
            document.error((*part.path, "controller"), f"{where}: {words}")
        if part.file is None:
            return
    elif value not in library.names():
        document.error(path, f"{where}: {unknown('built-in FMU', value, library.names())}")
        return
    _describe(part, path, settings, library, document)


def _describe(
    part: Part, path: KeyPath, settings: Mapping[str, Any], library: Library, document: Document
) -> None:
    """Read what a component's FMU says of itself.

    Parameters
    ----------
    part, settings : the component
    path : the keys that lead to what chose its FMU
    library, document : where it is looked up; takes what is found
    """
    where = f"[components.{part.name}]"
    try:
        if part.file:
            part.description = library.describe_file(part.file)
            _check_begin(part, path, document)
        elif all(getattr(part, key) or key not in settings for key in MADE_FROM):
            own = (part.effects,) if part.effects else ()
            made_of = part.law.component if part.law else part.fmu
            part.description = library.describe(made_of, part.building, part.controller, *own)
    except TrustError:
        raise  # no mistake of the file, and it is asked about
    except BristleError as error:
        given = [key for key in MADE_FROM if getattr(part, key)]
        if part.effects and isinstance(error, PhysicsError) and not given:
            given = ["effects"]
        at = (*part.path, given[0]) if given else path
        document.error(at, f"{where}: {error}")


def _check_begin(part: Part, path: KeyPath, document: Document) -> None:
    """Say where an FMU's default experiment begins elsewhere than a run does."""
    begins = part.description.begins.strip() if part.description else ""
    try:
        if not begins or float(begins) == 0.0:
            return
    except ValueError:
        pass  # no number: it is shown as it stands
    text = f"the default experiment of its FMU begins at {begins} s; a run begins at 0 s"
    document.note(path, f"[components.{part.name}]: {text}.")


# A scenario as TOML text: as it is run, or made of a model and a measurement.


def scenario_text(scenario: Scenario) -> str:
    """Return the TOML text of a scenario; read again it gives the same run.

    Files are written as absolute paths, so that the text holds wherever it is put.
    """
    folder = scenario.file.parent
    parts = [component_text(c.name, _table_of(c, folder)) for c in scenario.components]
    wires: dict[str, Any] = {}
    for wire in scenario.connections:
        source = f"{wire.source}.{wire.output}"
        transformed = {"from": source, "factor": wire.factor, "offset": wire.offset}
        wires[f"{wire.target}.{wire.input}"] = transformed if wire.transformed else source
    run = {"stop": scenario.stop, "step": scenario.step, "algorithm": scenario.algorithm}
    return joined_text(scenario.title, run, parts, wires)


def joined_text(
    title: str, run: Mapping[str, Any], parts: Iterable[str], wires: Mapping[str, Any]
) -> str:
    """Return the text of a scenario.

    Parameters
    ----------
    title : of the scenario
    run : stop and step [s], algorithm
    parts : the components' tables, in the order in which they step
    wires : input "component.port" to output, or to a table of `from`, `factor`, `offset`
    """
    lines = ["schema = 1", f"title = {toml_value(title)}", "", "[run]", *toml_table(run)]
    for part in parts:
        lines += ["", part]
    return "\n".join([*lines, "", "[connections]", *toml_table(wires)]) + "\n"


def component_text(name: str, table: Mapping[str, Any]) -> str:
    """Return the table of a component as text."""
    return "\n".join([f"[components.{toml_key(name)}]", *toml_table(table)])


def _table_of(component: Component, folder: Path) -> dict[str, Any]:
    """Return the table of a component; relative files are in `folder`."""
    found: dict[str, Any] = {}
    if (law := component.law) is not None:
        name, form, knots = split_form(law.name)
        given = {"command": form, "command_knots": list(knots)}
        found["law"] = law.file.absolute().as_posix() if law.file else name
        found |= {key: value for key, value in given.items() if value}
    else:
        path = component.path
        found["fmu"] = component.fmu if path is None else path.absolute().as_posix()
    effects = [file.absolute().as_posix() for file in component.effects]
    values = dict(component.parameters)
    for name in FILE_PARAMETERS:
        if (folder / str(values.get(name, ""))).is_file():
            values[name] = (folder / str(values[name])).absolute().as_posix()
    building, controller = (
        file.absolute().as_posix() if file is not None else None
        for file in (component.building, component.controller)
    )
    more = {
        "building": building, "effects": effects or None, "controller": controller,
        "step": component.step, "over_step": component.over_step or None,
        "parameters": values or None,
    }  # fmt: skip
    return found | {key: value for key, value in more.items() if value is not None}


Parameters = dict[str, float | bool]
DamperText = Callable[[Parameters], str]
"""Parameters that the scenario knows to the table of its damper."""


def source_of(damper: Model) -> dict[str, Any]:
    """Return what a damper is made from where it is no FMU of its own: law, form, own effects.

    Parameters
    ----------
    damper : the model with the effects of the damper alone
    """
    plain, form, knots = split_form(damper.base_law)
    source: dict[str, Any] = {"law": own_laws().get(plain, plain)}
    source |= {"command": form} if form else {}
    source |= {"command_knots": list(knots)} if knots else {}
    own = [own_effects()[name] for name in damper.effects if EFFECTS[name].own]
    return source | ({"effects": own} if own else {})


def values_of(damper: Model) -> Parameters:
    """Return what such a damper is given: values of its law and effects, and their switches."""
    values = {
        name: value
        for name, value in damper.values.items()
        if "." not in name or name.partition(".")[0] in damper.effects
    }
    return {**values, **{f"{effect}.on": True for effect in damper.effects}}


def model_scenario_text(
    head: tuple[str, str], run: tuple[float, float], parts: list[str], wires: Mapping[str, str]
) -> str:
    """Return the text of a scenario that is made of a model.

    Parameters
    ----------
    head : its title, and the comment above
    run : stop and step [s]
    parts : the components' tables
    wires : input to output, both "component.port"
    """
    title, about = head
    plain = title.replace("\\", "/").replace('"', "'")
    # A SignalSource names no unit. Its file holds that of the input: a factor says so to the check.
    told = {
        target: {"from": source, "factor": 1.0} if source.endswith(".value") else source
        for target, source in wires.items()
    }
    settings = {"stop": run[0], "step": run[1], "algorithm": "gauss-seidel"}
    return f"{about}\n\n{joined_text(plain, settings, parts, told)}"


def part_text(name: str, source: Mapping[str, Any], parameters: Mapping[str, Value]) -> str:
    """Return the table of a component that is made of a model.

    Parameters
    ----------
    name : of the component
    source : what it is made from: `fmu` or `law`, `building`, `effects` ...
    parameters : the values that it is given
    """
    lines = [component_text(name, {key: _plain(value) for key, value in source.items()})]
    if parameters:
        pairs = (f"{toml_value(k)} = {toml_value(_plain(v))}" for k, v in parameters.items())
        lines.append(f"parameters = {{ {', '.join(pairs)} }}")
    return "\n".join(lines)


def _plain(value: Any) -> Any:
    """Return a value as TOML has it: files are texts, and all numbers are real."""
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, bool | str | Path):
        return str(value) if isinstance(value, Path) else value
    return float(value)


def signal_file(
    time: NDArray[Any], values: NDArray[Any], title: str, unit: str, path: Path
) -> Path:
    """Write a signal over its times as a two-column CSV; return its path.

    Parameters
    ----------
    time, values : (n,) s, and the signal in its unit
    title, unit : of its column
    path : of the file
    """
    rows = [f"time [s],{title} [{unit}]"]
    rows += [f"{t:.12g},{value!r}" for t, value in zip(time.tolist(), values.tolist(), strict=True)]
    write_whole(path, "\n".join(rows) + "\n")
    return path
