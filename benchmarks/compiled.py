"""The compiled engine: against the same scheme in C, and against the tables of peaks."""

from __future__ import annotations

import ctypes
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bristle.component.damper import VOLTAGE
from bristle.core.jit import compiled
from bristle.engine.coupled import LONGEST_SUBSTEP, Coupled, RecordLayout
from bristle.engine.time_loop import INLINE, MAX_SWEEPS, TOLERANCE, integrate
from bristle.system.scenario import load_scenario

from . import _hosts
from ._published import DRIFT, SECOND_FLOOR, half_sine, passive, peak_errors, symbol
from ._rows import Row, interleave, ratio_of

SCENARIO = "el_centro_lugre_passive"
REPETITIONS = 15
SAME = 1e-9
"""How far the results of both may lie apart, as a share of a column's peak."""

SOURCE = Path(__file__).with_name("peer.c")
COLUMNS = (
    *(
        f"structure.{level}_{what}"
        for level in ("base", "floor1", "floor2")
        for what in ("displacement", "velocity", "acceleration_absolute")
    ),
    *("structure.drift1", "structure.drift2", "structure.holding_force"),
    *("ground.ground_acceleration", "damper.force", "damper.dissipated_energy"),
    "damper.stroke_ratio",
)
"""The columns of the C program's table, in its order."""


def run() -> list[Row]:
    """Return the compiled engine's figures."""
    return [*against_c(), *half_sine_peaks(), passive_peaks()]


def against_c() -> list[Row]:
    """Return the time of a substep over that of the C program, and how well the two agree."""
    name = "compiled engine / same scheme in C (-O2), per substep"
    scenario = load_scenario(SCENARIO)
    substeps = round(scenario.step / LONGEST_SUBSTEP)
    count = scenario.steps * substeps
    with tempfile.TemporaryDirectory() as folder:
        options = ("-O2", "-std=c99", "-Wall", "-Wextra", "-shared", "-fPIC", "-lm")
        made = _hosts.made_in_c(SOURCE, Path(folder, "peer.so"), *options)
        if made is None:
            return [Row(name, "skipped: no C compiler on the path, or not on Linux")]
        library = ctypes.CDLL(str(made))
        peer = Peer(library, RecordLayout(scenario), scenario.steps, substeps)
        ours = _Ours(RecordLayout(scenario), scenario.steps, substeps)
        ours.run(LONGEST_SUBSTEP)  # compiles, or reads what was compiled
        peer.run(LONGEST_SUBSTEP)
        apart = _apart(ours.columns(), peer.columns())
        sweeps = ours.sweeps / count, peer.sweeps / count
        note = (
            f"columns agree to {apart:.1e} of their peaks; sweeps per substep: {sweeps[0]:.3f} "
            f"compiled, {sweeps[1]:.3f} C"
        )
        if apart > SAME:
            return [Row(name, "not measured: the results differ", note=note)]
        jobs: dict[str, Callable[[], float]] = {
            "compiled": lambda: ours.run(LONGEST_SUBSTEP),
            "c": lambda: peer.run(LONGEST_SUBSTEP),
        }
        times = interleave(jobs, REPETITIONS)
    ratio = ratio_of(times["compiled"], times["c"])
    each = [1e9 * times[job].median / count for job in ("compiled", "c")]
    measured = f"{ratio:.3f} x; {each[0]:.0f} ns against {each[1]:.0f} ns, {count:,} substeps"
    return [Row(name, measured, "<= 2 x", ratio / 2.0, note)]


def half_sine_peaks() -> list[Row]:
    """Return the largest error of a peak, each sampled at 10 kHz so that none is missed."""
    rows = []
    for case in half_sine():
        overrides = {**case.overrides, "run.step": 1e-4}
        columns = Coupled().run(load_scenario("half_sine_pulse", overrides))
        errors = peak_errors(case, columns)
        worst = max(errors, key=lambda n: errors[n])
        rows.append(
            Row(
                f"half-sine pulse, compiled, {case.name}: {len(errors)} peaks",
                f"largest error {errors[worst]:.5%}: {symbol(worst)}",
                "<= 0.01 %",
                errors[worst] / 1e-4,
                f"x_b(10 s) {1e3 * columns[DRIFT][-1]:.4g} mm, table {1e3 * case.end:.4g} mm",
            )
        )
    return rows


def passive_peaks() -> Row:
    """Return the largest error in the table of peaks over intensity and voltage."""
    errors, beyond = {}, {}
    for (intensity, voltage), peak in passive().items():
        name = f"el_centro_{intensity:.1f}g_constant_voltage".replace(".", "p")
        scenario = load_scenario(name, {"voltage.level": voltage, "run.stop": 20.0})
        found = np.abs(Coupled().run(scenario)[SECOND_FLOOR]).max()
        errors[intensity, voltage] = abs(found / peak - 1.0)
        beyond[intensity, voltage] = max(0.0, abs(found - peak) - 0.005) / peak
    worst = max(errors, key=lambda case: errors[case])
    return Row(
        f"peak acceleration by voltage and intensity, compiled: {len(errors)}",
        f"largest error {errors[worst]:.3%}, at {worst[0]:g} g and {worst[1]:g} V",
        "<= 0.5 %",
        errors[worst] / 5e-3,
        f"beyond the rounding of the table to two decimals: {max(beyond.values()):.3%}",
    )


class _Ours:
    """The compiled time loop, run again and again into the same memory."""

    def __init__(self, system: RecordLayout, rows: int, substeps: int) -> None:
        self.system, self.rows, self.substeps = system, rows, substeps
        self.sweeps = 0
        self._slots = np.array(list(system.outputs.values()), dtype=np.int64)
        self._table = np.zeros((rows + 1, len(system.outputs)))
        self._loop = compiled(integrate, INLINE)

    def run(self, h: float) -> float:
        """Run once from the start; return the seconds of the loop alone."""
        system = self.system
        arguments = (
            system.sources(), system.coupled(h), system.sampled(h), system.start_values(),
            self._slots, self._table,
        )  # fmt: skip
        before = time.perf_counter()
        filled, _, self.sweeps = self._loop((self.rows, self.substeps, h), *arguments)
        seconds = time.perf_counter() - before
        if filled <= self.rows:
            raise RuntimeError(f"the loop stopped at row {filled}")
        return seconds

    def columns(self) -> dict[str, np.ndarray]:
        return dict(zip(self.system.outputs, self._table.T, strict=True))


_DOUBLES = ctypes.POINTER(ctypes.c_double)


class _Structure(ctypes.Structure):
    _fields_ = (
        ("n", ctypes.c_long),
        *((name, _DOUBLES) for name in ("phi", "held", "ramp", "m_inverse", "c", "k")),
        ("mass", ctypes.c_double),
    )


class _Damper(ctypes.Structure):
    _fields_ = tuple(
        (name, ctypes.c_double)
        for name in (
            *("sigma_a", "sigma_0", "sigma_1", "sigma_2", "sigma_b", "v_n", "a_0"),
            *("voltage", "stroke"),
        )
    )


class _Record(ctypes.Structure):
    _fields_ = (("size", ctypes.c_long), ("times", _DOUBLES), ("values", _DOUBLES))


class Peer:
    """The C program, given the same numbers as the compiled time loop."""

    def __init__(
        self, library: ctypes.CDLL, system: RecordLayout, rows: int, substeps: int
    ) -> None:
        self._loop = library.time_loop
        self._loop.restype = ctypes.c_long
        self.system, self.rows, self.substeps = system, rows, substeps
        self.sweeps = 0
        self._table = np.zeros((rows + 1, len(COLUMNS)))

    def run(self, h: float) -> float:
        """Run once from the start; return the seconds of the loop alone."""
        sources, times, samples = self.system.sources()
        dampers, structures = self.system.coupled(h)
        kept: list[np.ndarray] = []

        def address(values: Any) -> Any:
            kept.append(np.ascontiguousarray(values, dtype=np.float64))
            return kept[-1].ctypes.data_as(_DOUBLES)

        (b,), (d,), (g,) = structures, dampers, sources
        flat = (
            address(b[name])
            for name in ("phi", "held", "ramp", "m_inverse", "damping", "stiffness")
        )
        structure = _Structure(int(b["n"]), *flat, float(b["mass"]))
        voltage = self.system.start_values()[int(d["inputs"][VOLTAGE])]
        damper = _Damper(*map(float, d["p"][:7]), float(voltage), float(d["stroke"]))
        part = slice(int(g["begin"]), int(g["end"]))
        size = part.stop - part.start
        record = _Record(size, address(times[part]), address(g["scale"] * samples[part]))
        number = ctypes.c_double
        arguments = (
            ctypes.c_long(self.rows), ctypes.c_long(self.substeps), number(h), number(TOLERANCE),
            ctypes.c_long(MAX_SWEEPS), ctypes.byref(structure), ctypes.byref(damper),
            ctypes.byref(record), address(self._table), ctypes.c_long(len(COLUMNS)),
        )  # fmt: skip
        before = time.perf_counter()
        self.sweeps = self._loop(*arguments)
        seconds = time.perf_counter() - before
        if self.sweeps < 0:
            raise MemoryError("the C program found no memory")
        return seconds

    def columns(self) -> dict[str, np.ndarray]:
        return dict(zip(COLUMNS, self._table.T, strict=True))


def _apart(ours: dict[str, np.ndarray], peer: dict[str, np.ndarray]) -> float:
    """Return the largest difference of a column as a share of its peak."""
    return max(
        float(np.abs(ours[name] - column).max() / np.abs(column).max())
        for name, column in peer.items()
    )
