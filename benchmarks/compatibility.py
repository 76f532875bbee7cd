"""Every FMU of the project in other tools: which run it, and whether their rows are the same.

    python -m benchmarks compatibility                          # prints what was seen
    python -m benchmarks compatibility --native                 # FMUs that need no Python
    python -m benchmarks compatibility --docs                   # and writes docs/compatibility.md
    python -m benchmarks compatibility --cross-check FOLDER     # files for the FMI cross-check

Each FMU is stepped alone, in a process of its own, with its inputs held and its effects on. The
reference is the same component as a Python object: no FMU, no binary. The C host moves the inputs,
steps two instances in turn, resets one and replays a state; its last outputs are compared.
"""

from __future__ import annotations

import argparse
import csv
import importlib.metadata
import math
import platform
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from bristle.fmu import build, catalogue
from bristle.fmu.archive import platform_folder
from bristle.fmu.description import Description, read_description
from bristle.physics.effect import effects_of
from bristle.physics.laws import laws_of

from . import _hosts
from ._rows import Row, write_between

PAGE = Path(__file__).resolve().parent.parent / "docs" / "compatibility.md"
BLOCKS = {False: "compatibility", True: "native"}
"""Marks of the page around the tables of FMUs in Python, and of native ones."""
STEPS, STEP = 200, 0.002
NEAR = 1e-9
"""Largest difference of equal rows, as a share of the largest value of an output."""
HELD = {"V": 3.0, "m": 0.01, "m/s": 0.05, "m/s2": 1.5, "N": 0.5}
"""What an input is held at, by unit."""
MOVING: dict[str, dict[str, Any]] = {
    "GroundMotion": {"peak": 3.0, "factor": 1.5},
    "ConstantVoltage": {"level": 3.0},
    "SignalSource": {"kind": "chirp", "amplitude": 2.0, "phase": 0.5},
    "PrescribedMotion": {"kind": "sine", "amplitude": 0.01, "phase": 0.5},
}
"""Parameters with which a source moves."""
C_HOST = "C host"
PACKAGES = {"FMPy": "fmpy", "libcosim": "libcosimpy", "Ecos": "ecospy"}
UNREACHED = {
    "OMSimulator": ("OMSimulator", "its package downloads a binary while it is built"),
    "PyFMI": ("pyfmi", "PyPI holds its sources alone, which need FMI Library and Assimulo"),
}
"""Tools that this command does not run: their package, and what keeps it from being installed."""


@dataclass(frozen=True)
class Result:
    """What became of an FMU in a tool: the largest difference of its rows, or why there is none."""

    fmu: str
    tool: str
    steps: int
    difference: float | None
    why: str = ""

    @property
    def good(self) -> bool:
        """Whether the rows are equal to the reference."""
        return self.difference is not None and self.difference <= NEAR

    def __str__(self) -> str:
        if self.difference is None:
            return f"fails: {self.why}"
        if self.difference == 0.0:
            return "equal"
        word = "equal" if self.good else "differs"
        return f"{word} within {self.difference:.0e}"


def parameters(component: str) -> dict[str, Any]:
    """Return parameters with which a component's outputs move, its effects on where they may."""
    laws = {catalogue.component_of_law(law.name): law.name for law in laws_of("damper")}
    site = ("structure", "") if component == "Structure" else ("damper", laws.get(component, ""))
    on: list[str] = []
    for effect in effects_of(*site) if component in (*laws, "Structure") else ():
        if not set(effect.excludes) & set(on):
            on.append(effect.name)
    return {**MOVING.get(component, {}), **{f"{name}.on": True for name in on}}


def built(component: str, folder: Path, native: bool = False) -> Path:
    """Return a component's FMU with these parameters as its start values."""
    what = build.plan(component, starts=parameters(component))
    if native:
        from bristle.native.build import build as build_native
        from bristle.native.zig import here

        return build_native(what, folder, [here()])
    return build.build(what, folder)


def held(about: Description) -> dict[str, float]:
    """Return the values that the inputs are held at; optional ones stay as they are."""
    return {v.name: HELD[v.unit or ""] for v in about.of("input") if not v.optional}


def reference(component: str, moves: Iterable[dict[str, float]], step: float) -> list[list[float]]:
    """Return the Real outputs of a component as a Python object, after each step.

    Parameters
    ----------
    component : str
    moves : iterable of mapping
        The inputs before the initialisation, then before each step.
    step : float
        Length of a step [s].
    """
    slave = catalogue.instantiate(component)
    for name, value in parameters(component).items():
        slave._values[slave._index[name]] = value

    def put(values: dict[str, float]) -> None:
        slave.set_real([slave._index[name] for name in values], list(values.values()))

    moves = iter(moves)
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    put(next(moves))
    slave.exit_initialization_mode()
    rows = [slave.get_real(slave._outputs)]
    for k, values in enumerate(moves):
        put(values)
        if not slave.do_step(k * step, step):
            raise RuntimeError(f"{component} stops with fault {slave.fault}")
        rows.append(slave.get_real(slave._outputs))
    return rows


def difference(found: Sequence[Sequence[float]], wanted: Sequence[Sequence[float]]) -> float:
    """Return the largest difference as a share of the largest value of its output."""
    one, two = np.array(found, dtype=float), np.array(wanted, dtype=float)
    if one.shape != two.shape:
        return float("inf")
    scale = np.maximum(np.abs(two).max(axis=0), 1e-300)
    worst = (np.abs(one - two) / scale).max() if one.size else 0.0
    return float(worst) if np.isfinite(worst) else float("inf")


def try_host(tool: str, component: str, path: Path) -> Result:
    """Step an FMU in a tool, beside its reference."""
    about = read_description(path)
    outputs = [v.name for v in about.of("output") if v.kind == "Real"]
    given = held(about)
    job = {
        "path": str(path), "inputs": given, "outputs": outputs, "steps": STEPS, "step": STEP,
    }  # fmt: skip
    try:
        found = _hosts.play(tool, job)
    except _hosts.HostError as error:
        return Result(component, tool, STEPS, None, str(error))
    wanted = reference(component, [given] * (STEPS + 1), STEP)[1:]
    return Result(component, tool, STEPS, difference(found, wanted))


def try_c_host(program: Path, component: str, path: Path) -> Result:
    """Step an FMU in the C host, beside its reference."""
    swung = _hosts.swung(read_description(path))
    moves = [
        {name: _hosts.swing(one, i, max(k, 0)) for i, (name, one) in enumerate(swung.items())}
        for k in range(-1, _hosts.TURNS)
    ]
    try:
        last = _hosts.by_c_host(program, path)
    except _hosts.HostError as error:
        return Result(component, C_HOST, _hosts.TURNS, None, str(error))
    wanted = reference(component, moves, _hosts.TURN)[-1:]
    return Result(component, C_HOST, _hosts.TURNS, difference([last], wanted))


def version(package: str) -> str | None:
    """Return the installed version of a package, None where it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def try_all(names: Sequence[str], folder: Path, native: bool = False) -> list[Result]:
    """Step the FMUs, in Python or native, in every tool that is installed."""
    program = _hosts.c_host(folder)
    results = []
    for name in names:
        path = built(name, folder, native)
        for tool in _hosts.HOSTS:
            if version(PACKAGES[tool]):
                results.append(try_host(tool, name, path))
        if program is not None:
            results.append(try_c_host(program, name, path))
    return results


def tables(results: Sequence[Result], today: date, native: bool = False) -> str:
    """Return the page's table of tools, and a line for each FMU whose rows differ in one."""
    system = f"{platform.system()} {platform.machine()}"
    lines = ["| tool | version | platform | steps | result | date |", "|---|---|---|---|---|---|"]
    for tool in (*PACKAGES, C_HOST):
        own = [result for result in results if result.tool == tool]
        python = "without Python" if native else f"libpython {platform.python_version()}"
        number = python if tool == C_HOST else version(PACKAGES[tool])
        if own:
            good = [one.difference for one in own if one.good and one.difference is not None]
            within = f" within {max(good):.0e}" if good and max(good) else ""
            said = f"{len(good)} of {len(own)} FMUs give equal rows{within}"
            lines.append(
                f"| {tool} | {number} | {system} | {own[0].steps} | {said} | {today.isoformat()} |"
            )
        else:
            why = "no C compiler, or no shared libpython" if tool == C_HOST else "not installed"
            lines.append(f"| {tool} | | {system} | | not run: {why} | {today.isoformat()} |")
    for tool, (package, why) in UNREACHED.items():
        number = version(package)
        said = "installed; this command does not run it" if number else f"not installed: {why}"
        lines.append(f"| {tool} | {number or ''} | {system} | | {said} | {today.isoformat()} |")
    wrong = [f"- `{one.fmu}` in {one.tool}: {one}." for one in results if not one.good]
    return "\n".join([*lines, *(["", *wrong] if wrong else [])])


def rows(results: Sequence[Result]) -> list[Row]:
    """Return one figure per tool: how many FMUs give equal rows, and what became of the others."""
    found = []
    for tool in dict.fromkeys(result.tool for result in results):
        own = [result for result in results if result.tool == tool]
        good = sum(one.good for one in own)
        note = "; ".join(f"{one.fmu} {one}" for one in own if not one.good)
        name = f"FMUs with equal rows in {tool}"
        goal = f"{len(own)} of {len(own)}"
        found.append(Row(name, f"{good} of {len(own)}", goal, len(own) / max(good, 0.5), note))
    return found


def run() -> list[Row]:
    """Return the figures of all components."""
    with tempfile.TemporaryDirectory(prefix="bristle-hosts-") as folder:
        return rows(try_all(catalogue.component_names(), Path(folder)))


def main(given: list[str]) -> int:
    """Try all components in all tools; write the page or the cross-check files where asked."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks compatibility", description=__doc__)
    parser.add_argument("--docs", action="store_true", help=f"write the tables of {PAGE.name}")
    parser.add_argument("--native", action="store_true", help="FMUs that need no Python")
    parser.add_argument("--only", nargs="+", metavar="FMU", default=catalogue.component_names())
    parser.add_argument(
        "--cross-check", type=Path, metavar="FOLDER",
        help="write the files of the FMI cross-check rules into this folder; runs no tool",
    )  # fmt: skip
    chosen = parser.parse_args(given)
    if chosen.cross_check is not None:
        for name in chosen.only:
            print(cross_check(name, chosen.cross_check))
        return 0
    with tempfile.TemporaryDirectory(prefix="bristle-hosts-") as folder:
        results = try_all(chosen.only, Path(folder), chosen.native)
    for row in rows(results):
        print(f"{row.name}: {row.measured}" + (f" ({row.note})" if row.note else ""))
    if chosen.docs:
        begin, end = (f"<!-- {BLOCKS[chosen.native]}: {mark} -->" for mark in ("begin", "end"))
        write_between(PAGE, begin, end, tables(results, date.today(), chosen.native))
    return int(not all(result.good for result in results))


def cross_check(component: str, folder: Path) -> Path:
    """Write a component's files of the FMI cross-check into the rules' folders; return its folder.

    Parameters
    ----------
    component : str
    folder : Path
        Where the folders of the FMI version begin.
    """
    place = folder / "fmus" / "2.0" / "cs" / platform_folder() / "bristle"
    place = place / importlib.metadata.version("bristle") / component
    place.mkdir(parents=True, exist_ok=True)
    path = built(component, place)
    (place / ".lock").unlink(missing_ok=True)
    about = read_description(path)
    moves = moves_of(_hosts.swung(about))
    wanted = reference(component, [moves[0], *moves[:-1]], STEP)
    outputs = [v.name for v in about.of("output") if v.kind == "Real"]
    write_files(place, component, moves, outputs, wanted)
    return place


# The files of the FMI cross-check beside an FMU: input, reference rows, options, a README.

CHECKED = 500
"""Steps of the reference rows."""
TOLERANCE = 1e-9

README = """# {name}

An FMU of bristle for co-simulation, FMI 2.0. It needs no license and no tool, but a Python
interpreter (3.9 or newer) in the host's process: a host that is not Python loads a shared libpython
first. Its binaries are for 64-bit Linux and Windows.

`{name}_ref.csv` has the outputs at t = 0 and after each step of {step} s. {inputs}

Open an issue in the project's repository for questions.
"""
INPUTS = "In the step from\nt the inputs have their values of `{name}_in.csv` at t."


def moves_of(inputs: Mapping[str, tuple[float, float]]) -> list[dict[str, float]]:
    """Return the inputs at each time, of centre and amplitude of each, one cycle in a second."""
    return [
        {
            name: centre + amplitude * math.sin(2 * math.pi * k * STEP + 0.7 * i)
            for i, (name, (centre, amplitude)) in enumerate(inputs.items())
        }
        for k in range(CHECKED + 1)
    ]


def write_files(
    place: Path,
    name: str,
    inputs: Sequence[Mapping[str, float]],
    outputs: Sequence[str],
    rows: Sequence[Sequence[float]],
) -> None:
    """Write the files beside an FMU of this name.

    Parameters
    ----------
    place : Path
        The FMU's folder.
    name : str
    inputs : sequence of mapping
        The inputs at each time.
    outputs : sequence of str
        Names of the columns of `rows`.
    rows : sequence of sequence of float
        The outputs at each time.
    """
    times = [k * STEP for k in range(CHECKED + 1)]
    table = [[time, *row] for time, row in zip(times, rows, strict=True)]
    _write_table(place / f"{name}_ref.csv", outputs, table)
    if inputs[0]:
        table = [[time, *row.values()] for time, row in zip(times, inputs, strict=True)]
        _write_table(place / f"{name}_in.csv", list(inputs[0]), table)
    options = {"StartTime": 0.0, "StopTime": CHECKED * STEP, "StepSize": STEP, "RelTol": TOLERANCE}
    text = "".join(f"{key}, {value!r}\n" for key, value in options.items())
    (place / f"{name}_ref.opt").write_text(text, encoding="utf-8")
    said = INPUTS.format(name=name) if inputs[0] else "It has no inputs."
    readme = README.format(name=name, step=STEP, inputs=said)
    (place / "README.md").write_text(readme, encoding="utf-8")


def _write_table(file: Path, names: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        head = ",".join(f'"{name}"' for name in ("time", *names))
        stream.write(head + "\n")
        csv.writer(stream, lineterminator="\n").writerows([[repr(x) for x in row] for row in rows])
