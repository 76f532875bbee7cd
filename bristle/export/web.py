"""A scenario or a component as files that a page of the web runs."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Any, NamedTuple
from uuid import UUID, uuid5

import numpy as np
from numpy.typing import NDArray

from ..core.files import write_whole
from ..core.jit import RefusedError, library_text
from ..core.progress import tell
from ..engine import records, time_loop
from ..engine.coupled import RecordLayout, linked, substeps_of
from ..errors import BristleError, BuildError, ScenarioError, StudyError
from ..fmu import catalogue
from ..fmu.build import plan
from ..fmu.description import Variable
from ..native import zig
from ..native.build import SHIM, functions_text, keep, shim_digest, shim_sources
from ..native.c_functions import c_text
from ..native.entrance import (
    GUID,
    PreparedComponent,
    answer_of,
    plain_text,
    prepare,
    refusal,
    text_digest,
)
from ..physics import damper, structure
from ..physics.effect import EFFECTS
from ..physics.generate import Functions
from ..physics.laws import LAWS
from ..system.model import Component, System
from ..system.scenario import load_scenario
from ..user_code.load import own_effects, own_laws
from ..view.html import escape, page

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


# The WebAssembly module, the numbers that it reads, and which of them a slider moves.

Array = NDArray[Any]

ORDER = (
    "sources", "times", "samples", "dampers", "structures", "sampled", "constants", "memory",
    "signals", "outputs",
)  # fmt: skip
"""The arrays as `march.c` takes them."""

AGREE = 1e-12
"""Difference, as a share of the number, up to which a number follows a parameter in proportion."""

ALIGN = 16  # bytes


class Moved(NamedTuple):
    """A number that a parameter moves: where it is in the bytes, and offset + slope value."""

    at: int
    offset: float
    slope: float


@dataclass(frozen=True)
class Slider:
    """A parameter that a page moves.

    `value`, `low`, `high` are in the parameter's unit; `moved` tells the numbers that follow it.
    """

    name: str
    unit: str
    text: str
    value: float
    low: float
    high: float
    moved: tuple[Moved, ...]


class PageNumbers:
    """What the time loop reads of a scenario, as bytes.

    Parameters
    ----------
    file, overrides
        As for `scenario.load_scenario`.

    Attributes
    ----------
    scenario, system : System, RecordLayout
    rows, substeps, h : int, int, float
        Rows behind the first, substeps of each, a substep [s].
    names, units : list of str
        The outputs as `component.port`, with their units, "" for none.
    places : dict
        Name of an array to its first byte and its number of items.
    data : bytes
    """

    def __init__(self, file: str | Path, overrides: Mapping[str, object] | None = None) -> None:
        scenario = load_scenario(file, overrides)
        system = self.system = RecordLayout(scenario)
        self._file, self._overrides = file, dict(overrides or {})
        self.scenario, self.rows = scenario, scenario.steps
        self.substeps = substeps_of(scenario, system)
        self.h = scenario.step / self.substeps
        shown = {name: at for name, at in system.outputs.items() if system.kinds[name] == "Real"}
        self.names = list(shown)
        self.units = [scenario.unit(name) for name in self.names]
        outputs = np.array(list(shown.values()), dtype=np.int64)
        sampled = system.sampled(self.h)
        arrays = (
            *system.sources(), *system.coupled(self.h), *sampled, system.start_values(), outputs,
        )  # fmt: skip
        self.places: dict[str, tuple[int, int]] = {}
        whole, floats = bytearray(), []
        for name, array in zip(ORDER, arrays, strict=True):
            whole += bytes(-len(whole) % ALIGN)
            self.places[name] = len(whole), len(array)
            floats.append(len(whole) + _floats(array))
            whole += array.tobytes()
        self.data = bytes(whole)
        self._floats = np.concatenate(floats)

    def slider(self, name: str, low: float | None = None, high: float | None = None) -> Slider:
        """Return a parameter that a page may move between two values.

        Parameters
        ----------
        name : str
            `component.parameter`.
        low, high : float, optional
            Where it ends, in its unit; else at half and at one and a half of its value.

        Raises
        ------
        ScenarioError
            If there is no such number, its ends are not within its bounds, or what the time loop
            reads does not follow it in proportion.
        """
        variable = _variable(self.scenario, name)
        component, own = self.scenario.part(name)
        value = float((component.value(own) if component else None) or 0.0)
        low = min(0.5 * value, 1.5 * value) if low is None else low
        high = max(0.5 * value, 1.5 * value) if high is None else high
        least = -np.inf if variable.minimum is None else variable.minimum
        most = np.inf if variable.maximum is None else variable.maximum
        low, high = max(low, least), min(high, most)
        if not low < high:
            raise ScenarioError(f"{name}: a slider from {low:g} to {high:g} moves nothing.")
        middle = low + 0.4 * (high - low)
        found = [self._with(name, one) for one in (low, middle, high)]
        moved = self._moved(name, (low, middle, high), found)
        text = variable.description
        return Slider(name, variable.unit or "", text, value, low, high, moved)

    def _with(self, name: str, value: float) -> PageNumbers:
        numbers = PageNumbers(self._file, {**self._overrides, name: value})
        if (numbers.substeps, numbers.places) != (self.substeps, self.places):
            raise ScenarioError(f"{name} changes how the run is computed: no slider can move it.")
        return numbers

    def _moved(
        self, name: str, values: Sequence[float], found: Sequence[PageNumbers]
    ) -> tuple[Moved, ...]:
        rest = np.array([np.frombuffer(one.data, dtype=np.uint8) for one in found])
        places = self._floats
        rows = np.array([_read(one.data, places) for one in found])
        rest[:, (places[:, None] + np.arange(8)).ravel()] = 0
        low, middle, high = values
        slope = (rows[2] - rows[0]) / (high - low)
        offset = rows[0] - slope * low
        said = offset + slope * middle
        wrong = np.abs(said - rows[1]) > AGREE * np.maximum(np.abs(rows[1]), np.abs(rows[2]))
        differs = np.any(rows != rows[0], axis=0)
        if (rest != rest[0]).any() or (wrong & differs).any():
            raise ScenarioError(
                f"{name}: what the run computes with does not follow it in proportion, so no "
                "slider can move it. Numbers of laws, intensities and levels can be."
            )
        if not differs.any():
            raise ScenarioError(f"{name} changes nothing in this scenario.")
        return tuple(
            Moved(int(places[k]), float(offset[k]), float(slope[k]))
            for k in np.flatnonzero(differs)
        )


def _floats(array: Array) -> Array:
    """Return the first byte (n,) of every float of an array, fields of records included."""
    if array.dtype.names is None:
        is_float = array.dtype.kind == "f"
        return np.arange(0, array.nbytes if is_float else 0, 8, dtype=np.int64)
    one: list[int] = []
    for name in array.dtype.names:
        kind, begin = array.dtype.fields[name][:2]  # type: ignore[index]
        if kind.base.kind == "f":
            one.extend(range(begin, begin + kind.itemsize, 8))
    starts = np.arange(len(array), dtype=np.int64)[:, None] * array.itemsize
    return np.asarray((starts + np.array(one, dtype=np.int64)).ravel())


def _read(data: bytes, places: Array) -> Array:
    raw = np.frombuffer(data, dtype=np.uint8)
    return raw[places[:, None] + np.arange(8)].copy().view(np.float64)[:, 0]


def _variable(scenario: System, name: str) -> Variable:
    found = scenario.variable(name)
    if found is None or found.causality not in ("parameter", "input") or found.kind != "Real":
        raise ScenarioError(
            f'{scenario.where}: no component has a number "{name}"; COMPONENT.PARAMETER is right, '
            "as in voltage.level."
        )
    return found


# The WebAssembly module that runs any scenario of built-in components.
#
# It is the coupled engine's time loop, compiled by numba to C and by zig from there. A
# scenario is numbers alone, so one module serves all that have the library's laws and effects; one
# with a user's own has another.

SOURCE = Path(__file__).with_name("march.c")

SITES = {"damper": damper.SETS, "structure": structure.SETS}


def module(system: RecordLayout) -> bytes:
    """Return the module, compiled if it is not in the cache: a minute or two, once.

    Parameters
    ----------
    system : RecordLayout
        What it is to run.

    Raises
    ------
    BuildError
        If zig is not installed, the compiler refuses a law or effect, or the cache cannot be
        written.
    """
    sets = [system.dampers, system.structures]
    functions = text_digest(linked(*sets)(time_loop.integrate))
    sizes = [f"-D{name}_SIZE={record.itemsize}" for name, record in _records(*sets).items()]
    content = hashlib.sha256(SOURCE.read_bytes())
    for one in (functions, zig.tools_web(), *sizes):
        content.update(one.encode())

    def link(path: Path) -> None:
        tell("compiling the time loop for the web, once")
        text = path.parent / "loop.c"
        order = {
            "own": _own(),
            "sets": [
                [[law.name for law in made.slots.laws], [e.name for e in made.slots.effects]]
                for made in sets
            ],
            "functions": functions,
            "target": str(text),
        }
        answer_of("bristle.export.web", order, "the time loop")
        zig.link_web([text, SOURCE], sizes, path)

    return keep(zig.folder() / f"{content.hexdigest()[:24]}.wasm", link).read_bytes()


def _records(dampers: Functions, structures: Functions) -> dict[str, np.dtype[np.void]]:
    """Return what the arrays of records hold; every other array holds numbers."""
    return {
        "SOURCE": records.source_record(),
        "DAMPER": records.damper_record(dampers.slots),
        "STRUCTURE": records.structure_record(structures.slots),
        "SAMPLED": records.sampled_record(),
    }


def _own() -> dict[str, list[str]]:
    """Return the files of the user's own laws and effects."""
    own = {"law": own_laws(), "effect": own_effects()}
    return {kind: [str(file) for file in files.values()] for kind, files in own.items()}


def serve() -> None:
    """Compile what stands on the standard input; the other end of `module`."""
    from ..user_code.load import load_file

    given = json.load(sys.stdin)
    for kind, files in given["own"].items():
        for file in files:
            load_file(Path(file), kind)
    sets = [
        site.of(*(LAWS[name] for name in laws), *(EFFECTS[name] for name in effects))
        for site, (laws, effects) in zip(SITES.values(), given["sets"], strict=True)
    ]
    try:
        loop = linked(*sets)(time_loop.integrate)
        if text_digest(loop) != given["functions"]:
            raise BuildError("laws or effects have changed meanwhile; export it again.")
        text = _text(loop, _records(*sets))
    except BristleError as error:
        sys.exit(str(error))
    Path(given["target"]).write_text(text, encoding="utf-8")


def _text(loop: Any, known: Mapping[str, np.dtype[np.void]]) -> str:
    row, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    sources, dampers, structures, sampled = (np.zeros(0, record) for record in known.values())
    examples = (
        (0, 0, 0.0), (sources, row, row), (dampers, structures), (sampled, row, row), row, whole,
        np.zeros((0, 0)),
    )  # fmt: skip
    own = [Path(file).resolve() for files in _own().values() for file in files]
    try:
        return c_text(plain_text(*library_text(loop, examples, time_loop.INLINE)))
    except RefusedError as error:
        raise BuildError(refusal(str(error), own)) from error
