"""The master against a bare ctypes loop and against Ecos: same four FMUs, 17,500 steps."""

from __future__ import annotations

import ctypes
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bristle.engine.cosimulation import Master, ignore
from bristle.engine.instance import Instance, Unpacked
from bristle.fmu.build import ensure
from bristle.fmu.description import Description, read_description
from bristle.system.model import System
from bristle.system.scenario import load_scenario

from ._rows import Row, Times, interleave, ratio_of

SCENARIO = "el_centro_lugre_passive"
STEPS = 17_500
REPETITIONS = 5

Fmus = tuple[dict[str, Path], dict[str, Description], dict[str, dict[str, Any]]]


def run() -> list[Row]:
    """Return the master's figures."""
    # The bare loop exchanges values as Gauss-Seidel does; `coupling` has the costs of the others.
    scenario = load_scenario(SCENARIO, {"run.algorithm": "gauss-seidel"})
    fmus = find_fmus(scenario)
    jobs: dict[str, Callable[[], float]] = {
        "master": lambda: time_master(scenario, fmus),
        "bare": lambda: time_bare(scenario, fmus, prepared=True),
        "plain": lambda: time_bare(scenario, fmus, prepared=False),
    }
    if _ecos_is_there():
        jobs["ecos_csv"] = lambda: time_ecos(scenario, fmus, csv=True)
        jobs["ecos"] = lambda: time_ecos(scenario, fmus, csv=False)
    times = interleave(jobs, REPETITIONS)
    master = times["master"]
    rows = [
        Row("master, 17,500 steps, every output kept", str(master)),
        _against("bare ctypes loop, arguments converted beforehand", master, times["bare"], 1.15),
        _against("bare ctypes loop, arguments converted in each call", master, times["plain"]),
    ]
    if "ecos" in times:
        rows.append(_against("Ecos, level warn, with its CSV writer", master, times["ecos_csv"], 1))
        rows.append(_against("Ecos, level warn, nothing recorded", master, times["ecos"]))
    else:
        rows.append(Row("master against Ecos", "ecospy and tbb are not installed here"))
    return rows


def _against(name: str, master: Times, other: Times, goal: float | None = None) -> Row:
    ratio = ratio_of(master, other)
    return Row(
        f"master / {name}",
        f"{ratio:.3f} x; it took {other}",
        f"<= {goal:g} x" if goal else "",
        ratio / goal if goal else None,
    )


def find_fmus(scenario: System, ensure: Callable[..., Path] = ensure) -> Fmus:
    """Return files, descriptions and parameters of a scenario's FMUs, in Python or native."""
    there = scenario.components
    paths = {n: c.path or ensure(c.made_of(), **c.made_with()) for n, c in there.items()}
    descriptions = {name: read_description(path) for name, path in paths.items()}
    return paths, descriptions, {name: one.taken_values() for name, one in there.items()}


def time_master(scenario: System, fmus: Fmus) -> float:
    """Return the seconds of all steps, the table of all outputs included."""
    with Master(scenario, *fmus, ignore) as master:
        master.start()
        before = time.perf_counter()
        master.advance(STEPS)
        master.table()
        return time.perf_counter() - before


def time_bare(scenario: System, fmus: Fmus, prepared: bool) -> float:
    """Return the seconds of a loop with one doStep, getReal, getInteger and setReal per FMU.

    Connected inputs are set, all outputs are read and kept. With `prepared` the arguments of the
    calls are converted once, else in each call, as ctypes does by itself.
    """
    paths, descriptions, parameters = fmus
    with Unpacked() as unpacked:
        instances = [
            Instance(name, descriptions[name], unpacked.folder(path), lambda message: None)
            for name, path in paths.items()
        ]
        for instance in instances:
            instance.initialise(parameters[instance.name], scenario.stop)
            instance.finish_initialisation()
        seconds = _bare_loop(scenario, instances, prepared)
        for instance in instances:
            instance.close()
    return seconds


class _Calls:
    """The four calls of one FMU, and where its outputs go: Reals, then the fault code."""

    def __init__(self, instance: Instance, inputs: list[str], step: float, prepared: bool) -> None:
        variables = instance.description.variables
        outputs = [v for v in variables.values() if v.causality == "output" and v.kind == "Real"]
        self.places = {v.name: i for i, v in enumerate(outputs)}
        self.outputs = (ctypes.c_double * (len(outputs) + 1))()
        self.inputs = (ctypes.c_double * max(len(inputs), 1))()
        self.references = [
            (ctypes.c_uint * max(len(names), 1))(*(variables[name].reference for name in names))
            for names in (inputs, list(self.places), ["fault"])
        ]
        sizes = (len(inputs), len(outputs), 1)
        places = (
            ctypes.addressof(self.inputs),
            ctypes.addressof(self.outputs),
            ctypes.addressof(self.outputs) + 8 * len(outputs),
        )
        kinds = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
        self.arguments = [
            self._convert((instance.component, ctypes.addressof(vr), n, place), kinds, prepared)
            for vr, n, place in zip(self.references, sizes, places, strict=True)
        ]
        names = ("SetReal", "GetReal", "GetInteger")
        self.functions = [instance.calls.function(name) for name in names]
        kinds_of_step = (ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)
        self.step_arguments = self._convert(
            (instance.component, 0.0, step, 1), kinds_of_step, prepared
        )
        self.step = instance.calls.function("DoStep")
        if not prepared:
            self.step.argtypes = kinds_of_step  # type: ignore[attr-defined]
            for function in self.functions:
                function.argtypes = kinds  # type: ignore[attr-defined]

    @staticmethod
    def _convert(
        values: tuple[Any, ...], kinds: tuple[Any, ...], prepared: bool
    ) -> tuple[Any, ...]:
        if not prepared:
            return values
        return tuple(kind.from_param(value) for kind, value in zip(kinds, values, strict=True))


def _bare_loop(scenario: System, instances: list[Instance], prepared: bool) -> float:
    """Step ground, structure, voltage and damper, written out by hand; return the seconds."""
    wires = {(w.target, w.input): (w.source, w.output) for w in scenario.wires}
    fed = {i.name: [name for target, name in wires if target == i.name] for i in instances}
    made = [_Calls(i, fed[i.name], scenario.step, prepared) for i in instances]
    g, s, v, d = made
    by_name = dict(zip((i.name for i in instances), made, strict=True))

    def sources(name: str) -> list[tuple[Any, int]]:
        pairs = [wires[name, port] for port in fed[name]]
        return [(by_name[source].outputs, by_name[source].places[port]) for source, port in pairs]

    (ground, a_g), (force, f) = sources("structure")
    (motion, x), (_, w), (volts, u) = sources("damper")
    s_in, d_in = s.inputs, d.inputs
    g_step, s_step, v_step, d_step = (c.step for c in made)
    (gc, _, h, past), (sc, *_), (vc, *_), (dc, *_) = (c.step_arguments for c in made)
    (_, g_get, g_look), (s_put, s_get, s_look), (_, v_get, v_look), (d_put, d_get, d_look) = (
        c.functions for c in made
    )
    _, (_, g1, g2, g3), (_, g4, g5, g6) = g.arguments
    (_, s1, s2, s3), (_, s4, s5, s6), (_, s7, s8, s9) = s.arguments
    _, (_, v1, v2, v3), (_, v4, v5, v6) = v.arguments
    (_, d1, d2, d3), (_, d4, d5, d6), (_, d7, d8, d9) = d.arguments
    real = ctypes.c_double.from_param if prepared else float
    rows: list[tuple[bytes, bytes, bytes, bytes]] = []
    keep, step = rows.append, scenario.step
    g_out, s_out, v_out, d_out = (c.outputs for c in made)
    before = time.perf_counter()
    for k in range(STEPS):
        t = real(k * step)
        g_step(gc, t, h, past)
        g_get(gc, g1, g2, g3)
        g_look(gc, g4, g5, g6)
        s_in[0] = ground[a_g]
        s_in[1] = force[f]
        s_put(sc, s1, s2, s3)
        s_step(sc, t, h, past)
        s_get(sc, s4, s5, s6)
        s_look(sc, s7, s8, s9)
        v_step(vc, t, h, past)
        v_get(vc, v1, v2, v3)
        v_look(vc, v4, v5, v6)
        d_in[0] = motion[x]
        d_in[1] = motion[w]
        d_in[2] = volts[u]
        d_put(dc, d1, d2, d3)
        d_step(dc, t, h, past)
        d_get(dc, d4, d5, d6)
        d_look(dc, d7, d8, d9)
        keep((bytes(g_out), bytes(s_out), bytes(v_out), bytes(d_out)))
    return time.perf_counter() - before


def time_ecos(scenario: System, fmus: Fmus, csv: bool) -> float:
    """Return the seconds of Ecos's steps, its CSV writer included if wanted."""
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    paths, _, parameters = fmus
    EcosLib.set_log_level("warn")
    structure = EcosSimulationStructure()
    for name, path in paths.items():
        structure.add_model(name, str(path))
    for wire in scenario.wires:
        structure.make_real_connection(
            f"{wire.source}::{wire.output}", f"{wire.target}::{wire.input}"
        )
    values = {f"{c}::{n}": value for c, given in parameters.items() for n, value in given.items()}
    structure.add_parameter_set("scenario", values)
    with (
        tempfile.TemporaryDirectory() as folder,
        EcosSimulation(structure=structure, step_size=scenario.step) as simulation,
    ):
        if csv:
            simulation.add_csv_writer(str(Path(folder, "ecos.csv")))
        if not simulation.init(parameter_set="scenario"):
            raise RuntimeError(EcosLib.get_last_error())
        before = time.perf_counter()
        simulation.step(STEPS)
        seconds = time.perf_counter() - before
        simulation.terminate()
    return seconds


def _ecos_is_there() -> bool:
    """Load the library that Ecos needs and does not find by itself; False if it is missing."""
    try:
        ctypes.CDLL(Path(sys.prefix, "lib", "libtbb.so.12"), ctypes.RTLD_GLOBAL)
        import ecospy  # noqa: F401
    except (ImportError, OSError):
        return False
    return True
