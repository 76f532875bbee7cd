"""The same scenario in other hosts, libcosim and Ecos, and in a plain loop: the same numbers."""

from __future__ import annotations

import csv
import importlib.util
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built import built, built_native
from fresh import fresh

H, STEPS = 0.002, 1500  # 3 s: the strongest part of El Centro begins within them
FMUS = {
    "ground": "GroundMotion",
    "structure": "Structure",
    "voltage": "ConstantVoltage",
    "damper": "LuGreDamper",
}
PARAMETERS: dict[str, dict[str, Any]] = {
    "ground": {"peak": 5.886, "factor": 0.45},
    "voltage": {"level": 4.0},
    "damper": {"gas_spring.on": True, "gas_spring.k": 60.0, "mount_compliance.on": True},
}
CONNECTIONS = {
    "structure.ground_acceleration": "ground.ground_acceleration",
    "structure.damper_force": "damper.force",
    "damper.displacement": "structure.base_displacement",
    "damper.velocity": "structure.base_velocity",
    "damper.voltage": "voltage.voltage",
}
WATCHED = (
    "ground.ground_acceleration",
    "structure.base_displacement",
    "structure.base_velocity",
    "structure.floor2_acceleration_absolute",
    "structure.holding_force",
    "damper.force",
    "damper.dissipated_energy",
)


each_form = pytest.mark.parametrize(
    "form",
    [
        built,
        pytest.param(
            built_native,
            marks=[
                pytest.mark.slow,  # a building and a damper are compiled
                pytest.mark.skipif(
                    importlib.util.find_spec("ziglang") is None,
                    reason="ziglang compiles native FMUs, not there",
                ),
            ],
        ),
    ],
)
"""What gives the FMUs: those that run in Python, or native ones. Both have the same rows."""


def job(form: Callable[[str], Path] = built) -> dict[str, Any]:
    return {
        "paths": {name: str(form(component)) for name, component in FMUS.items()},
        "parameters": PARAMETERS,
        "connections": CONNECTIONS,
        "watched": WATCHED,
        "h": H,
        "steps": STEPS,
    }


@fresh
def by_hand(job: dict[str, Any], early: bool) -> list[list[float]]:
    from live import Fmu, Loop

    fmus = {name: Fmu(path, name) for name, path in job["paths"].items()}
    loop = Loop(fmus, job["connections"])
    loop.begin(job["parameters"])
    return loop.run(job["steps"], job["h"], job["watched"], "jacobi", early)


@cache
def reference(early: bool) -> np.ndarray:
    """Return the rows (steps + 1, ports): read right after a step, or after the inputs were set."""
    rows = np.array(by_hand(job(), early))
    assert np.abs(rows).max(axis=0).min() > 0.0
    return rows


def need(package: str) -> None:
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"the package {package} is not installed (extra: test)")


@fresh
def by_libcosim(job: dict[str, Any]) -> list[list[float]]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_step_size(round(job["h"] * 1e9))
    index, references = {}, {}
    for name, path in job["paths"].items():
        index[name] = execution.add_local_slave(CosimLocalSlave(path, name))
        references[name] = {
            variable.name.decode(): variable.reference
            for variable in execution.slave_variables(index[name])
        }
    for name, values in job["parameters"].items():
        for key, value in values.items():
            kind = (
                execution.boolean_initial_value if value is True else execution.real_initial_value
            )
            assert kind(index[name], references[name][key], value), key
    for target, source in job["connections"].items():
        (name, port), (other, output) = target.split("."), source.split(".")
        status = execution.connect_real_variables(
            index[other], references[other][output], index[name], references[name][port]
        )
        assert status == 0, target
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    watched = [port.split(".") for port in job["watched"]]
    rows = []
    for _ in range(job["steps"]):
        assert execution.step()
        rows.append(
            [
                observer.last_real_values(index[name], [references[name][port]])[0]
                for name, port in watched
            ]
        )
    return rows


@pytest.mark.slow  # 2 s: by default it has the rows of a package (tests/engine/test_export_ssp.py)
@each_form
def test_libcosim(form: Callable[[str], Path]) -> None:
    need("libcosimpy")
    found = np.array(by_libcosim(job(form)))
    expected = reference(True)[1:]  # it has no row at t = 0
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(found - expected).max(axis=0) <= 1e-12 * scale).all()


@fresh
def by_ecos(job: dict[str, Any], result: str) -> None:
    import ctypes
    import sys
    from pathlib import Path

    tbb = Path(sys.prefix) / "lib" / "libtbb.so.12"
    if tbb.is_file():  # Ecos does not find it by itself
        ctypes.CDLL(str(tbb), ctypes.RTLD_GLOBAL)
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    EcosLib.set_log_level("warn")
    with EcosSimulationStructure() as structure:
        for name, path in job["paths"].items():
            structure.add_model(name, path)
        for target, source in job["connections"].items():
            structure.make_real_connection(
                source.replace(".", "::", 1), target.replace(".", "::", 1)
            )
        values = {
            f"{name}::{key}": value
            for name, given in job["parameters"].items()
            for key, value in given.items()
        }
        structure.add_parameter_set("given", values)
        with EcosSimulation(structure=structure, step_size=job["h"]) as simulation:
            watched = [port.replace(".", "::", 1) for port in job["watched"]]
            simulation.add_csv_writer(result, identifiers=watched)
            assert simulation.init(parameter_set="given")
            simulation.step(job["steps"])
            simulation.terminate()


@each_form
def test_ecos(form: Callable[[str], Path], tmp_path: Path) -> None:
    need("ecospy")
    if sys.platform != "linux":
        pytest.skip("ecospy's library is loaded as on Linux")
    result = tmp_path / "result.csv"
    by_ecos(job(form), str(result))
    with result.open(encoding="utf-8", newline="") as file:
        rows = [[cell.strip() for cell in row] for row in csv.reader(file)]
    columns = {name.split("[")[0].replace("::", "."): i for i, name in enumerate(rows[0])}
    table = np.array([[float(cell) for cell in row if cell] for row in rows[1:]])
    found = table[:, [columns[name] for name in WATCHED]]
    expected = reference(False)
    assert len(found) == len(expected)
    assert np.abs(found - expected).max() <= 0.6e-6  # it prints six decimals
