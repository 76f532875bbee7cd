"""Checks of a scenario's own tables: the run, the components and their parameters."""

# Longer than 300 lines: half of it are messages that say what would be right.

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..core.toml_lines import KeyPath
from ..errors import BristleError, PhysicsError, TrustError
from ..findings import Findings, number, unknown, written
from .document import COMPONENT_KEYS, LAW_KEYS, MADE_FROM, Document, flatten
from .laws import choose_law
from .library import Library
from .over_step import choose_over_step
from .parameters import check_parameter, check_together
from .parts import ALGORITHMS, Part, Run, existing_file
from .storeys import check_storeys

SCHEMA = 1
MAX_RESULT_BYTES = 2**31
"""Results are kept in memory; a run that would need more [byte] is refused."""
MAX_SUBSTEPS = 10_000
STEP_TOLERANCE = 1e-6
"""How far [1] a number of steps may lie from a whole one: room for decimals, not for mistakes."""

_TOP = ("schema", "title", "run", "components", "connections")
_RUN = ("stop", "step", "algorithm")
NAME = re.compile(r"[^\W\d][\w-]*")
RESERVED = (*_TOP, "time")


def table(findings: Findings, data: Mapping[str, Any], path: KeyPath) -> dict[str, Any] | None:
    """Return the table at the last key of `path`; None, and an error, for anything else there."""
    key = path[-1]
    found = data.get(str(key), {})
    if not isinstance(found, dict):
        findings.error(path, f"[{'.'.join(map(str, path))}] is {written(found)}, not a table.")
        return None
    return found


def known_keys(
    findings: Findings, where: str, data: Iterable[str], known: Iterable[str], path: KeyPath
) -> None:
    """Report every key that is none of the known.

    Parameters
    ----------
    findings : Findings, takes what is found
    where : words that begin the message, such as "[run]"
    data, known : the keys that are there; the keys that may be
    path : keys from the top of the document to the table
    """
    known = tuple(known)
    for key in data:
        if key not in known:
            findings.error((*path, key), f"{where}: {unknown('key', key, known)}")


def check_top(document: Document, findings: Findings) -> str:
    """Check schema, title and the names of the tables; return the title."""
    data = document.data
    known_keys(findings, "scenario", data, _TOP, ())
    schema = data.get("schema")
    if "schema" not in data:
        findings.error((), f"schema is missing: write schema = {SCHEMA} in the first line.")
    elif isinstance(schema, bool) or schema != SCHEMA or not isinstance(schema, int):
        findings.error(
            ("schema",), f"schema is {written(schema)}; this bristle reads schema = {SCHEMA}."
        )
    title = data.get("title", document.file.stem)
    if not isinstance(title, str):
        findings.error(("title",), f"title is {written(title)}; a text in quotes is right.")
        return document.file.stem
    return title


def check_run(document: Document, findings: Findings) -> Run:
    """Check stop, step and algorithm."""
    run = Run()
    if "run" not in document.data:
        findings.error((), "[run] is missing: it gives stop and step in seconds.")
        return run
    data = table(findings, document.data, ("run",))
    if data is None:
        return run
    known_keys(findings, "[run]", data, _RUN, ("run",))
    run.stop = _seconds(findings, data, ("run", "stop"), "[run] stop", required=True)
    run.step = _seconds(findings, data, ("run", "step"), "[run] step", required=True)
    algorithm = data.get("algorithm", ALGORITHMS[0])
    if algorithm in ALGORITHMS:
        run.algorithm = algorithm
    elif isinstance(algorithm, str):
        findings.error(
            ("run", "algorithm"), f"[run]: {unknown('algorithm', algorithm, ALGORITHMS)}"
        )
    else:
        findings.error(
            ("run", "algorithm"),
            f"[run] algorithm is {written(algorithm)}; one of these in quotes is right: "
            f"{', '.join(ALGORITHMS)}.",
        )
    return run


def _seconds(
    findings: Findings, data: Mapping[str, Any], path: KeyPath, what: str, required: bool = False
) -> float | None:
    """Return a time above zero [s], or None after saying what is wrong with it."""
    key = str(path[-1])
    if key not in data:
        if required:
            findings.error(path[:-1], f"{what} is missing: a time in seconds is right.")
        return None
    value = number(data[key])
    if isinstance(value, str):
        findings.error(path, f"{what} {value}; a time in seconds is right.")
        return None
    if value <= 0.0:
        findings.error(path, f"{what} = {value:g} s; a time above 0 s is right.")
        return None
    return value


def check_steps(run: Run, parts: Iterable[Part], findings: Findings) -> None:
    """Check that stop is a whole number of steps, not too many, and each component's own step."""
    parts = list(parts)
    for part in parts:
        if part.step is not None and run.step is not None:
            _check_fraction(part, run.step, findings)
    if run.stop is None or run.step is None:
        return
    count = run.stop / run.step
    columns = 1 + sum(len(part.description.of("output")) for part in parts if part.description)
    most = MAX_RESULT_BYTES // (8 * columns)
    if count > most:
        findings.error(
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
        findings.error(
            ("run", "stop"),
            f"[run] stop = {run.stop:.12g} s is {count:.6f} steps of {run.step:.12g} s; a whole "
            f"number is right, e.g. stop = {choices}.",
        )


def _check_fraction(part: Part, step: float, findings: Findings) -> None:
    """Check that a component's step is the run's step divided by a whole number."""
    assert part.step is not None
    path = (*part.path, "step")
    ratio = step / part.step
    if ratio > MAX_SUBSTEPS + 0.5:
        findings.error(
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
        findings.error(
            path,
            f"[components.{part.name}] step = {part.step:.12g} s does not divide the run's step of "
            f"{step:.12g} s; that step by a whole number is right, e.g. {choices} s.",
        )


def check_components(document: Document, library: Library, findings: Findings) -> dict[str, Part]:
    """Check every component on its own; return them in the order of the file."""
    parts: dict[str, Part] = {}
    data = table(findings, document.data, ("components",))
    if data is None:
        return parts
    if not data:
        findings.error(("components",), "no components: [components.NAME] with fmu = ... adds one.")
    for name in data:
        path: KeyPath = ("components", name)
        if not NAME.fullmatch(name) or name in RESERVED:
            findings.error(
                path,
                f'[components."{name}"]: a component cannot be called so; letters, digits, _ and - '
                f"are right, beginning with a letter, and none of {', '.join(RESERVED)}.",
            )
        settings = table(findings, data, path)
        if settings is not None:
            parts[name] = _check_component(document, Part(name, path), settings, library, findings)
    return parts


def _check_component(
    document: Document,
    part: Part,
    settings: dict[str, Any],
    library: Library,
    findings: Findings,
) -> Part:
    where = f"[components.{part.name}]"
    part.step = _seconds(findings, settings, (*part.path, "step"), f"{where} step")
    folder = document.file.parent
    _choose_building(part, settings, folder, findings)
    _choose_effects(part, settings, folder, findings)
    _choose_controller(part, settings, folder, findings)
    if not any(key in settings for key in LAW_KEYS):
        _choose_fmu(part, settings, folder, library, findings)
    elif choose_law(part, settings, folder, library, findings):
        _describe(part, (*part.path, "law"), settings, library, findings)
    choose_over_step(part, settings, findings)
    for key in settings:
        if key in COMPONENT_KEYS:
            continue
        if key in part.variables:
            words = f'"{key}" belongs into its parameters: parameters = {{ {key} = ... }}.'
        else:
            words = unknown("key", key, COMPONENT_KEYS)
        findings.error((*part.path, key), f"{where}: {words}")
    path = (*part.path, "parameters")
    for name, value, place in flatten(table(findings, settings, path) or {}, path):
        if name in part.places:
            findings.error(place, f"{where}: {name} is set twice, with and without quotes.")
        part.places[name] = place
        if part.description:
            check_parameter(part, name, value, folder, library, findings)
    check_together(part, folder, findings)
    check_storeys(part, findings)
    return part


def _choose_building(
    part: Part, settings: Mapping[str, Any], folder: Path, findings: Findings
) -> None:
    """Read `building` of a component."""
    if "building" not in settings:
        return
    path, value = (*part.path, "building"), settings["building"]
    where = f"[components.{part.name}] building"
    if settings.get("fmu") != "Structure":
        findings.error(path, f'{where}: only the built-in "Structure" is made from a building.')
    elif not isinstance(value, str):
        findings.error(path, f"{where} is {written(value)}; the path of a TOML file is right.")
    else:
        part.building = existing_file(value, folder, path, where, findings)


def _choose_effects(
    part: Part, settings: Mapping[str, Any], folder: Path, findings: Findings
) -> None:
    """Read `effects` of a component: files with effects of a user's own."""
    if "effects" not in settings:
        return
    path, value = (*part.path, "effects"), settings["effects"]
    where = f"[components.{part.name}] effects"
    files = value if isinstance(value, list) else [value]
    if not files or not all(isinstance(file, str) for file in files):
        findings.error(
            path, f'{where} is {written(value)}; "FILE.py", or a list of them, is right.'
        )
        return
    fmu = str(settings.get("fmu", ""))
    if fmu.lower().endswith(".fmu") or "/" in fmu or "\\" in fmu:
        findings.error(path, f"{where}: an FMU has its own effects; a built-in name takes files.")
        return
    found = [existing_file(file, folder, path, where, findings) for file in files]
    part.effects = tuple(file for file in found if file is not None)


def _choose_controller(
    part: Part, settings: Mapping[str, Any], folder: Path, findings: Findings
) -> None:
    """Read `controller` of a component; whether it takes one, its description says."""
    if "controller" not in settings:
        return
    path, value = (*part.path, "controller"), settings["controller"]
    where = f"[components.{part.name}] controller"
    if not isinstance(value, str):
        findings.error(
            path, f"{where} is {written(value)}; the path of a controller file is right."
        )
    else:
        part.controller = existing_file(value, folder, path, where, findings)


def _choose_fmu(
    part: Part,
    settings: Mapping[str, Any],
    folder: Path,
    library: Library,
    findings: Findings,
) -> None:
    """Read `fmu` of a component, and what that FMU says of itself."""
    path, where = (*part.path, "fmu"), f"[components.{part.name}]"
    value = settings.get("fmu")
    if not isinstance(value, str) or not value:
        said = f"fmu is {written(value)}" if "fmu" in settings else "fmu is missing"
        findings.error(
            path, f"{where}: {said}; a built-in name or the path of an .fmu file is right."
        )
        return
    part.fmu = value
    if value.lower().endswith(".fmu") or "/" in value or "\\" in value:
        part.file = existing_file(value, folder, path, where, findings)
        if part.controller:
            words = "a foreign FMU takes no controller file; the built-in controllers do."
            findings.error((*part.path, "controller"), f"{where}: {words}")
        if part.file is None:
            return
    elif value not in library.names():
        findings.error(path, f"{where}: {unknown('built-in FMU', value, library.names())}")
        return
    _describe(part, path, settings, library, findings)


def _describe(
    part: Part, path: KeyPath, settings: Mapping[str, Any], library: Library, findings: Findings
) -> None:
    """Read what a component's FMU says of itself.

    Parameters
    ----------
    part, settings : the component
    path : the keys that lead to what chose its FMU
    library, findings : where it is looked up; takes what is found
    """
    where = f"[components.{part.name}]"
    try:
        if part.file:
            part.description = library.describe_file(part.file)
            _check_begin(part, path, findings)
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
        findings.error(at, f"{where}: {error}")


def _check_begin(part: Part, path: KeyPath, findings: Findings) -> None:
    """Say where an FMU's default experiment begins elsewhere than a run does."""
    begins = part.description.begins.strip() if part.description else ""
    try:
        if not begins or float(begins) == 0.0:
            return
    except ValueError:
        pass  # no number: it is shown as it stands
    text = f"the default experiment of its FMU begins at {begins} s; a run begins at 0 s"
    findings.note(path, f"[components.{part.name}]: {text}.")
