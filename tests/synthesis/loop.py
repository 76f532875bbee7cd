"""The closed loop by Runge-Kutta, independent of the library's structure, damper and march.

A LuGre damper on the paper's building, whose equations are written out here; controllers are the
library's run-time laws. Seven states [q, q', z]; the ground acceleration linear between samples of
the record; the voltage held over 2 ms. At each sample: measure with the previous voltage, compute
the new one, apply it at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import exp
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bristle.component import control_laws
from bristle.component.controller_file import Controller
from bristle.core.jit import compiled
from bristle.data import read_ground_motion
from bristle.physics.building import paper_building
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

Array = NDArray[np.float64]

SAMPLE, SUBSTEPS, V_MAX = 0.002, 10, 8.0
G, KAPPA = 9.81, 0.45
PASSIVE, CLIPPED, INVERSE, BINGHAM_INVERSE, LPV, LQG = range(6)
P = tuple(parameter.value for parameter in LuGre.parameters.values())
BINGHAM_P = (1.3, 0.83, 100.0, 20.0, 0.02, 1.0)

clipped_voltage = control_laws.clipped_voltage
signed_voltage = control_laws.signed_voltage
applied_signed = control_laws.applied_signed
LUGRE_CODE, BINGHAM_CODE = law_code("lugre"), law_code("bingham")
voltage_of_law, force_of_law = control_laws.voltage_of_law, control_laws.force_of_law
estimate_states = control_laws.estimate_states
table_row, command, advance = control_laws.table_row, control_laws.command, control_laws.advance
STILL, LEAST_SLOPE = control_laws.STILL, control_laws.LEAST_SLOPE


def plant_force(z, v, V):  # type: ignore[no-untyped-def]
    slip = v - 500.0 * abs(v) * z
    return (650.0 + 415.0 * V) * z + 5.0 * slip + (100.0 + 20.0 * V) * v * exp(-abs(v) / 0.02)


def rates(x, a_g, V, stiffness, damping, mass, out):  # type: ignore[no-untyped-def]
    force = plant_force(x[6], x[3], V)
    for i in range(3):
        out[i] = x[3 + i]
        total = -force if i == 0 else 0.0
        for j in range(3):
            total -= stiffness[i, j] * x[j] + damping[i, j] * x[3 + j]
        out[3 + i] = total / mass[i] - a_g
    out[6] = x[3] - 500.0 * abs(x[3]) * x[6]


def ahead(x, k, dt, out):  # type: ignore[no-untyped-def]
    for i in range(7):
        out[i] = x[i] + dt * k[i]


def simulate(  # type: ignore[no-untyped-def]
    law, ground, samples, matrices, n, rows, v_top, A, B, W, C, rate, p, bingham_p, level, work, out
):
    """Fill out (samples + 1, 4) with y, base displacement, force, voltage at each sample."""
    stiffness, damping, mass = matrices[:3], matrices[3:6], matrices[6]
    h = 0.002 / 10
    x, at, k1, k2, k3, k4, state, spare, bent = work
    V = level
    for k in range(samples + 1):
        v, y = x[3], 0.0
        for j in range(3):
            y -= (stiffness[2, j] * x[j] + damping[2, j] * x[3 + j]) / mass[2]
        if law != 0:
            row = table_row(v, v_top, rows) if rows > 1 else 0
            u = command(n, C, row, state)
            applied = u
            measured = plant_force(x[6], v, V)
            if law == 1 or law == 5:
                V = clipped_voltage(u, measured, 0.5, 8.0)
            elif law == 2:
                V = voltage_of_law(LUGRE_CODE, p, u, v, bent, (STILL, LEAST_SLOPE, 8.0))
                applied = force_of_law(LUGRE_CODE, p, v, V, bent)
                estimate_states(LUGRE_CODE, p, v, V, 0.002, bent)
            elif law == 3:
                V = voltage_of_law(BINGHAM_CODE, bingham_p, u, v, bent, (STILL, LEAST_SLOPE, 8.0))
                applied = force_of_law(BINGHAM_CODE, bingham_p, v, V, bent)
            else:
                V = signed_voltage(u, v, 8.0)
                applied = applied_signed(V, v)
            second = measured if law == 5 else rate * (applied - u)
            advance(n, A, B, W, row, state, (y, second), spare)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = y, x[0], plant_force(x[6], v, V), V
        if k == samples:
            break
        for s in range(10):
            g = 2 * (10 * k + s)
            rates(x, ground[g], V, stiffness, damping, mass, k1)
            ahead(x, k1, 0.5 * h, at)
            rates(at, ground[g + 1], V, stiffness, damping, mass, k2)
            ahead(x, k2, 0.5 * h, at)
            rates(at, ground[g + 1], V, stiffness, damping, mass, k3)
            ahead(x, k3, h, at)
            rates(at, ground[g + 2], V, stiffness, damping, mass, k4)
            for i in range(7):
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


@cache
def _compiled() -> Any:
    return compiled(simulate)


@dataclass(frozen=True)
class Run:
    """What a run did: peaks and RMS over the whole record."""

    peak: float  # |y| [m/s2]
    rms: float  # y [m/s2]
    drift: float  # peak |x_b| [m]
    force: float  # peak |f| [N]
    voltage: float  # RMS [V]


def run(
    law: int,
    ground: Array,
    controller: Controller | None = None,
    rate: float = 0.0,
    level: float = 0.0,
) -> Run:
    """Run a law on a ground acceleration sampled every 0.1 ms."""
    samples = (len(ground) - 1) // (2 * SUBSTEPS)
    out = np.zeros((samples + 1, 4))
    b = paper_building()
    matrices = np.array([*b.K, *b.C, np.diag(b.M)])
    if controller is None:
        n, rows, v_top, flats = 1, 1, 1.0, [np.zeros(1)] * 4
    else:
        n, rows, v_top = controller.n, controller.rows, controller.v_top
        flats = [
            np.array(values) for values in (controller.A, controller.B, controller.W, controller.C)
        ]
    work = (*(np.zeros(7) for _ in range(6)), np.zeros(n), np.zeros(n), np.zeros(1))
    _compiled()(
        law, ground, samples, matrices, n, rows, v_top, *flats, rate, np.array(P),
        np.array(BINGHAM_P), level, work, out,
    )  # fmt: skip
    y, drift, force, voltage = out.T
    return Run(
        float(np.abs(y).max()), float(np.sqrt(np.mean(y**2))), float(np.abs(drift).max()),
        float(np.abs(force).max()), float(np.sqrt(np.mean(voltage**2))),
    )  # fmt: skip


def earthquake(record: str, intensity: float, seconds: float, folder: Path = Path()) -> Array:
    """Return a record scaled to kappa times `intensity` [g] every 0.1 ms, zero after its end."""
    motion = read_ground_motion(record, folder)
    t = np.arange(round(seconds / SAMPLE) * 2 * SUBSTEPS + 1) * (SAMPLE / (2 * SUBSTEPS))
    scaled = motion.acceleration * (KAPPA * intensity * G / motion.peak)
    return np.interp(t, motion.time - motion.time[0], scaled, right=0.0)


def half_sine(amplitude: float) -> Array:
    """Return a pulse of 0.2 s [m/s2], run over 10 s."""
    t = np.arange(round(10.0 / SAMPLE) * 2 * SUBSTEPS + 1) * (SAMPLE / (2 * SUBSTEPS))
    return np.where(t < 0.2 - 1e-9, amplitude * np.sin(np.pi * t / 0.2), 0.0)
