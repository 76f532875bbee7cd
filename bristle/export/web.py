"""A scenario or a component as files that a page of the web runs."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Any, NamedTuple
from uuid import UUID, uuid5

from ..core.files import write_whole
from ..errors import BuildError, ScenarioError, StudyError
from ..fmu import catalogue
from ..fmu.build import plan
from ..fmu.description import Variable
from ..native import zig
from ..native.build import SHIM, functions_text, keep, shim_digest, shim_sources
from ..native.prepare import GUID, PreparedComponent, prepare
from ..system.model import Component, System
from ..view.html import escape, page
from .web_module import PageNumbers, Slider, module

LOADERS = Path(__file__).parent
"""Folder with the loaders, and what pages are made of."""


def write_files(folder: Path, contents: Mapping[str, str | bytes]) -> list[Path]:
    """Write files into a folder, made if missing; return them in their order.

    Raises
    ------
    BuildError
        If one cannot be written.
    """
    try:
        for name, content in contents.items():
            write_whole(folder / name, content)
    except StudyError as error:
        raise BuildError(str(error)) from None
    return [folder / name for name in contents]


def loader(*names: str) -> dict[str, str]:
    """Return the texts of loaders by name."""
    return {name: (LOADERS / name).read_text(encoding="utf-8") for name in names}


LOADER = ("bristle.mjs", "bristle.d.mts")
"""What runs the module, and its types for editors and TypeScript."""

MOST_SLIDERS = 12
"""Sliders that a page has unless its own are named."""

Range = tuple[float | None, float | None]
_ANY: Range = (None, None)

_HEAD = "<style>main {{ max-width: 76rem; }}</style>\n<h1>{}</h1>"
_FOOT = "Made by bristle."


class Shown(NamedTuple):
    """What a page offers beside what its scenario says.

    `sliders` are the numbers that it moves where they can be moved, with the values between which
    they move if it is a mapping; else it has its own choice. `measured` maps outputs to those that
    hold their measured values.
    """

    sliders: Sequence[str] | Mapping[str, Range] = ()
    measured: Mapping[str, str] = MappingProxyType({})


NOTHING_MORE = Shown()


def export_web(
    file: str | Path,
    folder: Path,
    sliders: Mapping[str, Range] | None = None,
    overrides: Mapping[str, object] | None = None,
    shown: Shown = NOTHING_MORE,
) -> list[Path]:
    """Write a scenario as a WebAssembly module, its numbers, a loader and a page; return the files.

    Parameters
    ----------
    file : path
        The scenario, or the name of a stock one: of built-in components alone.
    folder : path
        Where to write, made if missing.
    sliders : mapping, optional
        `component.parameter` to the values between which it moves, None for half and one and a half
        of its own; else the numbers that the scenario sets and those of the dampers' laws.
    overrides : mapping, optional
        As for `scenario.load_scenario`.
    shown : Shown
        What the page offers beside the scenario's own.

    Raises
    ------
    ScenarioError
        If the scenario is wrong or has parts that are not compiled; if a slider cannot be.
    BuildError
        If zig is not installed, or the folder cannot be written.
    """
    numbers = PageNumbers(file, overrides)
    description, wasm = described(numbers, sliders, shown), module(numbers.system)
    title = description["title"]
    contents: dict[str, str | bytes] = {
        "index.html": page(title, [_HEAD.format(escape(title)), body(wasm, description)], _FOOT),
        "scenario.wasm": wasm,
        "scenario.json": json.dumps(description, indent=1) + "\n",
        **loader(*LOADER),
    }
    return write_files(folder, contents)


def chosen(
    numbers: PageNumbers,
    sliders: Mapping[str, Range] | None,
    among: Sequence[str] | Mapping[str, Range] = (),
) -> list[Slider]:
    """Return the sliders that are named, else those of the numbers offered, or of the scenario's.

    Raises
    ------
    ScenarioError
        If one that is named cannot be, does not hold the scenario's value, or moves what another
        one moves.
    """
    found: list[Slider] = []
    names = among or offered(numbers.scenario)
    ranges = names if isinstance(names, Mapping) else dict.fromkeys(names, _ANY)
    for name, (low, high) in (sliders or ranges).items():
        try:
            one = numbers.slider(name, low, high)
            _check_begin(one)
            _check_apart(one, found)
        except ScenarioError:
            if sliders:
                raise
            continue  # not every number can be moved; whoever names one is told
        found.append(one)
        if not sliders and len(found) == MOST_SLIDERS:
            break
    return found


def _check_begin(one: Slider) -> None:
    """Refuse a slider that does not hold the scenario's value: the page begins there."""
    if not one.low <= one.value <= one.high:
        unit = "" if one.unit in ("", "1") else f" {one.unit}"
        raise ScenarioError(
            f"{one.name} is {one.value:g}{unit} in the scenario, outside of the slider from "
            f"{one.low:g} to {one.high:g}. A slider that holds it is right, or --set "
            f"{one.name}=VALUE within it."
        )


def _check_apart(one: Slider, others: Sequence[Slider]) -> None:
    """Refuse a slider that moves a number of another one: the page could not tell them apart."""
    places = {moved.at for moved in one.moved}
    for other in others:
        if places & {moved.at for moved in other.moved}:
            raise ScenarioError(f"{one.name} and {other.name} move the same: take one of them.")


def offered(scenario: System) -> list[str]:
    """Return the numbers that a reader would move first: what is set, then the laws' own."""
    names = [name for component in scenario.components.values() for name in _set(component)]
    for component in scenario.components.values():
        if component.made_of().endswith("Damper"):
            names += [f"{component.name}.{one.name}" for one in _own_numbers(component)]
    return list(dict.fromkeys(names))


def _set(component: Component) -> list[str]:
    known = component.description.variables
    return [f"{component.name}.{n}" for n in component.values if known[n].kind == "Real"]


def _own_numbers(component: Component) -> list[Variable]:
    """Return the parameters of a damper's law: those before the stroke, effects come behind."""
    found: list[Variable] = []
    for variable in component.description.of("parameter"):
        if variable.name == "stroke":
            break
        found.append(variable)
    return found


def described(
    numbers: PageNumbers, named: Mapping[str, Range] | None = None, shown: Shown = NOTHING_MORE
) -> dict[str, Any]:
    """Return what the loader reads, as plain data: see bristle.d.mts.

    Parameters
    ----------
    numbers : PageNumbers
        Of the scenario.
    named, shown
        As `sliders` and `shown` of `export_web`.

    Raises
    ------
    ScenarioError
        If a slider that is named cannot be.
    """
    sliders = chosen(numbers, named, shown.sliders)
    outputs = zip(numbers.names, numbers.units, strict=True)
    return {
        "title": numbers.scenario.title,
        "rows": numbers.rows,
        "substeps": numbers.substeps,
        "h": numbers.h,
        "outputs": [{"name": name, "unit": unit} for name, unit in outputs],
        "sliders": [
            {
                "name": one.name, "unit": one.unit, "text": one.text, "value": one.value,
                "low": one.low, "high": one.high, "moved": [list(moved) for moved in one.moved],
            }
            for one in sliders
        ],
        "measured": dict(shown.measured),
        "places": {name: list(place) for name, place in numbers.places.items()},
        "numbers": base64.b64encode(numbers.data).decode(),
    }  # fmt: skip


def body(wasm: bytes, description: Mapping[str, Any]) -> str:
    """Return sliders and pictures as HTML that needs no other file; once in a page."""
    parts = loader(LOADER[0], "page.mjs", "page.html")
    script = re.sub(r"^export ", "", parts[LOADER[0]], flags=re.MULTILINE)
    script += re.sub(r"^import .*\n", "", parts["page.mjs"], flags=re.MULTILINE)
    return Template(parts["page.html"]).substitute(
        scenario=json.dumps(description).replace("</", "<\\/"),
        module=base64.b64encode(wasm).decode(),
        script=script,
    )


_SOURCE = LOADERS / "fmi.c"
_NAMESPACE = UUID("b1c4f0de-7f4e-5c68-9d2f-776562666d75")

COMPONENT_LOADER = ("component.mjs", "component.d.mts")
"""What runs the module, and its types for editors and TypeScript."""

_CALLED = (
    "fmi2SetupExperiment", "fmi2EnterInitializationMode", "fmi2ExitInitializationMode",
    "fmi2DoStep", "fmi2Reset", "fmi2FreeInstance", "fmi2GetReal", "fmi2GetInteger",
    "fmi2GetBoolean", "fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean", "fmi2SetString", "malloc",
    "free",
)  # fmt: skip
"""What the loader calls."""


def export_component(name: str, folder: Path) -> list[Path]:
    """Write a component as a WebAssembly module, its variables and a loader; return the files.

    Parameters
    ----------
    name : str
        A built-in component, or the file of a controller of one's own.
    folder : Path
        Where to write, made if missing.

    Raises
    ------
    BuildError
        If there is no such component, it needs a file, zig is not installed or refuses something,
        or the folder cannot be written.
    """
    what = plan(name)
    reading = getattr(catalogue.component_class(what.component), "file_of", None)
    if reading is not None and not reading.chooser:  # whatever its parameters, it reads a file
        raise BuildError(
            f"{name} plays a file, which a page cannot open. A scenario has it inside: "
            "`bristle export SCENARIO --web FOLDER` is right."
        )
    prepared = prepare(what)
    content = "".join([*prepared, shim_digest(), _SOURCE.read_text(encoding="utf-8")])
    guid = str(uuid5(_NAMESPACE, content))
    wasm = _module(prepared, guid, functions_text(what, prepared.functions))
    text = json.dumps(_described(what.name, guid, name), indent=1) + "\n"
    contents: dict[str, str | bytes] = {
        "component.wasm": wasm,
        "component.json": text,
        **loader(*COMPONENT_LOADER),
    }
    return write_files(folder, contents)


def _module(prepared: PreparedComponent, guid: str, text: Path) -> bytes:
    content = hashlib.sha256(f"{zig.tools_web()} {guid}".encode()).hexdigest()[:24]

    def link(path: Path) -> None:
        table = path.parent / "tables.c"
        table.write_text(prepared.tables.replace(GUID, guid), encoding="utf-8")
        options = [f"-I{SHIM}", *(f"-Wl,--export={one}" for one in _CALLED)]
        zig.link_web([*shim_sources(), table, _SOURCE, text], options, path)

    return keep(zig.folder() / f"{content}.wasm", link).read_bytes()


def _described(model: str, guid: str, component: str) -> dict[str, Any]:
    """Return what the loader reads, as plain data: see component.d.mts."""
    known = catalogue.describe(component)
    return {
        "name": model,
        "guid": guid,
        "text": known.description,
        "variables": [
            {
                "name": one.name, "reference": one.reference, "kind": one.kind,
                "causality": one.causality, "unit": one.unit or "", "start": one.start,
                "text": one.description,
            }
            for one in known.variables.values()
        ],
    }  # fmt: skip
