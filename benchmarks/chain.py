"""A chain of 64 buildings, each on the one before, against one of 4: time per component and step.

64 instances no longer fit into a processor's cache, whoever calls them, so that the same calls
without a master are measured beside.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable
from pathlib import Path

from bristle.engine.cosimulation import Master, ignore
from bristle.engine.instance import Instance
from bristle.system.scenario import load_scenario

from ._rows import Row, least_times
from .master import find_fmus

SHORT, LONG = 4, 64
STEPS = 2048
"""Component steps of one slice; slices of all take turns, the fastest of each counts."""
SLICES = 25
GOAL = 1.2
ALGORITHMS = ("gauss-seidel", "midpoint")
INPUT, OUTPUT = "ground_acceleration", "floor2_acceleration_absolute"


def run() -> list[Row]:
    """Return how much a component costs more in the long chain, by algorithm."""
    return [row for algorithm in ALGORITHMS for row in _rows(algorithm)]


def _rows(algorithm: str) -> list[Row]:
    with tempfile.TemporaryDirectory() as folder:
        masters = {count: _started(count, algorithm, Path(folder)) for count in (SHORT, LONG)}
    jobs: dict[tuple[str, int], Callable[[int], None]] = {}
    for count, master in masters.items():
        jobs["master", count] = _steps(master.advance, count)
        jobs["calls", count] = _steps(_calls(master), count)
    least = least_times(jobs, STEPS, SLICES)
    for master in masters.values():
        master.close()
    ratio = least["master", LONG] / least["master", SHORT]
    alone = least["calls", LONG] / least["calls", SHORT]
    each = " and ".join(f"{1e6 * least['master', count] / STEPS:.1f}" for count in masters)
    return [
        Row(
            f"chain of {LONG} / of {SHORT}, {algorithm}, time per component and step",
            f"{ratio:.2f} x",
            f"<= {GOAL:g} x",
            ratio / GOAL,
            f"{each} us; the FMUs' calls without a master {alone:.2f} x",
        )
    ]


def _steps(advance: Callable[[int], None], count: int) -> Callable[[int], None]:
    """Return what makes so many steps of components, all components together."""
    return lambda steps: advance(steps // count)


def _started(count: int, algorithm: str, folder: Path) -> Master:
    """Return the initialised master of a chain of so many buildings."""
    lines = ["schema = 1", "[run]", "step = 0.002", f'algorithm = "{algorithm}"']
    lines.append(f"stop = {0.002 * ((SLICES + 1) * STEPS // count)!r}")
    for i in range(count):
        given = "damper_force = 0.0" if i else f"damper_force = 0.0, {INPUT} = 1.0"
        lines += [f"[components.b{i}]", 'fmu = "Structure"', f"parameters = {{ {given} }}"]
    lines.append("[connections]")
    lines += [f'"b{i}.{INPUT}" = "b{i - 1}.{OUTPUT}"' for i in range(1, count)]
    file = folder / f"chain_{count}.toml"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    scenario = load_scenario(file)
    master = Master(scenario, *find_fmus(scenario), ignore)
    master.start()
    return master


def _calls(master: Master) -> Callable[[int], None]:
    """Return a loop of one set, step and two gets per instance of a master, nothing passed on."""
    calls = [call for instance in master._instances for call in _calls_of(instance)]

    def loop(steps: int) -> None:
        for _ in range(steps):
            for function, arguments, _kept in calls:
                function(*arguments)

    return loop


def _calls_of(
    instance: Instance,
) -> list[tuple[Callable[..., int], tuple[object, ...], tuple[object, ...]]]:
    """Return function, arguments, and what must live as long as they do."""
    variables = instance.description.variables
    outputs = [v.name for v in variables.values() if v.causality == "output" and v.kind == "Real"]
    component = ctypes.c_void_p.from_param(instance.component)
    real = ctypes.c_double.from_param
    step = (component, real(0.0), real(0.002), ctypes.c_int.from_param(1))
    found: list[tuple[Callable[..., int], tuple[object, ...], tuple[object, ...]]] = []
    for name, ports, kind in (
        ("SetReal", [INPUT], ctypes.c_double),
        ("DoStep", [], None),
        ("GetReal", outputs, ctypes.c_double),
        ("GetInteger", ["fault"], ctypes.c_int),
    ):
        if kind is None:
            found.append((instance.calls.function(name), step, ()))
            continue
        references = (ctypes.c_uint * len(ports))(*(variables[p].reference for p in ports))
        values = (kind * len(ports))()
        first, second = (
            ctypes.c_void_p.from_param(ctypes.addressof(a)) for a in (references, values)
        )
        arguments = (component, first, ctypes.c_size_t.from_param(len(ports)), second)
        found.append((instance.calls.function(name), arguments, (references, values)))
    return found
