"""The Bouc-Wen benchmark of nonlinear system identification: `python -m benchmarks boucwen`.

    m y'' + c y' + k y + z = u,    z' = alpha y' - beta (gamma |y'| z + delta y' |z|)

as published (Noel & Schoukens 2016; Schoukens & Noel 2017, IFAC-PapersOnLine 50(1), 448-453):
random-phase multisines of 50 N RMS from 5 to 150 Hz, 8192 samples at 750 Hz, in steady state. Here
they are integrated 40 times finer, low-passed and decimated.

The published task is another one than ours. It gives u and y alone, a black box is asked for, and
PNLSS leaves 1.2e-5 m on the multisine of the test (Esfahani et al. 2018). A bench of this package
measures motion and the force of the element, here c y' + k y + z = u - m y'', and looks for a law
of it; m is known. The identified element is then put back under the mass, and y is simulated from u
alone.
"""

# Longer than 300 lines: the system, an own law and its simulation are one story.

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from math import expm1, log1p

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bristle.core.arrays import Array
from bristle.core.text import plain
from bristle.data.measurement import measurements_of_frame
from bristle.identification.fit import fit_from_starts
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, Run
from bristle.model.model import Model
from bristle.physics import damper
from bristle.physics.law import Law, Shape, forget_law
from bristle.physics.parameter import Parameter
from bristle.physics.tuples import Inputs

from ._answers import Answer, Answers
from ._floor import share_of
from ._rows import Row

MASS, DAMPING, STIFFNESS = 2.0, 10.0, 5e4  # kg, N s/m, N/m
ALPHA, BETA, GAMMA, DELTA = 5e4, 1e3, 0.8, -1.1  # N/m, 1/m, 1, 1

RATE, SAMPLES = 750.0, 8192
LOW, HIGH, FORCE = 5.0, 150.0, 50.0  # Hz, Hz, N RMS

FINER = 40
"""Steps of the truth within one sample; 30 kHz."""

STEPS = 20
"""Steps of the simulation of an identified element within one sample; 15 kHz."""

BEFORE = 2048
"""Samples of the period that come first, until its steady state: nine time constants."""

NOISE = 0.01
"""Standard deviation of a channel's noise, by that of the channel."""

PUBLISHED = 1.2e-5
"""RMSE [m] of PNLSS on the multisine of the test, from input and output alone."""


@dataclass(frozen=True)
class Record:
    """One period in steady state: spectrum of u, and y [m], y' [m/s], element's force [N]."""

    spectrum: NDArray[np.complex128]
    y: Array
    v: Array
    force: Array


def multisine(seed: int) -> NDArray[np.complex128]:
    """Return the spectrum (SAMPLES / 2 + 1,) [N] of a period: equal lines, random phases."""
    lines = np.fft.rfftfreq(SAMPLES, 1.0 / RATE)
    on = (lines >= LOW) & (lines <= HIGH)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, on.sum())
    spectrum = np.zeros(len(lines), dtype=complex)
    spectrum[on] = FORCE * np.sqrt(2.0 / on.sum()) * np.exp(1j * phase) * SAMPLES / 2.0
    return spectrum


def finer(spectrum: NDArray[np.complex128], times: int) -> Array:
    """Return a period (SAMPLES times,) of a spectrum, sampled so many times finer."""
    return np.asarray(np.fft.irfft(spectrum, SAMPLES * times) * times)


def coarser(signal: Array, count: int = SAMPLES) -> Array:
    """Return a period (count,) of a finer one: what lies above half the rate is taken off."""
    spectrum = np.fft.rfft(signal)[: count // 2 + 1] * (count / len(signal))
    spectrum[-1] = 0.0
    return np.asarray(np.fft.irfft(spectrum, count))


def rates(y: float, v: float, z: float, u: float) -> tuple[float, float, float]:
    """Return y', y'' and z' of the published system."""
    bend = ALPHA * v - BETA * (GAMMA * abs(v) * z + DELTA * v * abs(z))
    return v, (u - DAMPING * v - STIFFNESS * y - z) / MASS, bend


def integrate(u: Array, dt: float) -> Array:
    """Return y, y', z (n, 3) from rest at the instants 0, dt, ...: the classical fourth order.

    Parameters
    ----------
    u : (2 n - 1,) force [N] at those instants and in the middles between them
    dt : step [s]
    """
    forces = u.tolist()
    y = v = z = 0.0
    out = [(y, v, z)]
    half = 0.5 * dt
    for k in range(0, len(forces) - 2, 2):
        here, mid, end = forces[k : k + 3]
        a1, b1, c1 = rates(y, v, z, here)
        a2, b2, c2 = rates(y + half * a1, v + half * b1, z + half * c1, mid)
        a3, b3, c3 = rates(y + half * a2, v + half * b2, z + half * c2, mid)
        a4, b4, c4 = rates(y + dt * a3, v + dt * b3, z + dt * c3, end)
        y += dt / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        v += dt / 6.0 * (b1 + 2.0 * (b2 + b3) + b4)
        z += dt / 6.0 * (c1 + 2.0 * (c2 + c3) + c4)
        out.append((y, v, z))
    return np.array(out)


def record(seed: int, times: int = 1) -> Record:
    """Return what a period of a multisine does to the published system, in steady state.

    Parameters
    ----------
    seed : of the phases
    times : how many times the published rate its samples have
    """
    spectrum = multisine(seed)
    u = finer(spectrum, 2 * FINER)
    whole = np.concatenate([u[-2 * FINER * BEFORE :], u])
    y, v, z = integrate(whole[:-1], 1.0 / (RATE * FINER))[FINER * BEFORE :].T
    force = DAMPING * v + STIFFNESS * y + z
    y, v, force = (coarser(one, SAMPLES * times) for one in (y, v, force))
    return Record(spectrum, y, v, force)


def on_bench(given: Record, seed: int, name: str) -> Run:
    """Return the first SAMPLES of a record as a bench measures them, every channel with noise."""
    rng, rate = np.random.default_rng(seed), RATE * len(given.y) / SAMPLES
    seen = {"displacement [m]": given.y, "velocity [m/s]": given.v, "force [N]": given.force}
    frame = {
        title: signal[:SAMPLES] + NOISE * np.std(signal) * rng.standard_normal(SAMPLES)
        for title, signal in seen.items()
    }
    time = {"time [s]": np.arange(SAMPLES) / rate}
    return prepare(measurements_of_frame(pd.DataFrame({**time, **frame}), name)[0])


def simulate(model: Model, spectrum: NDArray[np.complex128]) -> Array:
    """Return y (SAMPLES,) [m] of the mass on an identified element, from u alone, in steady state.

    Newmark's constant mean acceleration, as published; the element moves by its own step.
    """
    u = finer(spectrum, STEPS)
    u = np.concatenate([u[-STEPS * BEFORE :], u]).tolist()
    dt = 1.0 / (RATE * STEPS)
    setup = damper.setup_of(model.law, model.values, list(model.effects))
    functions = damper.functions_of(model.law, model.effects)
    z = damper.start_states(model.law, model.values, functions.slots)
    end, work, step = [0.0] * len(z), [0.0] * damper.room(len(z)), functions.link(damper.step)
    now = Inputs(0.0, 0.0, 0.0, 0.0, dt, 0.0, 0.0, False)
    evaluate = functions.made["evaluate"]
    force, out = evaluate(setup, now, z, work[: len(z)], work[len(z) :])[0], []
    now = now._replace(a=(u[0] - force) / MASS)
    for pushed in u:
        a = now.a
        for _ in range(3):
            v = now.v + 0.5 * dt * (now.a + a)
            x = now.x + dt * now.v + 0.25 * dt * dt * (now.a + a)
            then = Inputs(x, v, a, 0.0, dt, 0.0, 0.0, False)
            force = step(setup, now, then, z, end, work)[0]
            a = (pushed - force) / MASS
        now, z, end = then._replace(a=a), end, z
        out.append(x)
    return coarser(np.array(out)[STEPS * BEFORE :])


def rmse(model: Model, given: Record) -> float:
    """Return the RMSE [m] of the displacement that an identified element leads to."""
    return float(np.sqrt(np.mean((simulate(model, given.spectrum) - given.y) ** 2)))


def bent(deflection: float, v: float, inward: float, outward: float, dt: float) -> float:
    """Return b after a step at constant velocity, exactly: b' = v - (gamma |v| b + delta v |b|).

    Parameters
    ----------
    deflection : b at the start [m]
    v : velocity [m/s]
    inward, outward : gamma - delta and gamma + delta [1/m]: of the way back to the middle, and out
    dt : length of the step [s]
    """
    way = 1.0 if v >= 0.0 else -1.0
    left, b = abs(v) * dt, way * deflection
    if b < 0.0:
        back = log1p(-b * inward) / inward
        if left < back:
            return way * (b - (1.0 - inward * b) / inward * expm1(-inward * left))
        left, b = left - back, 0.0
    if abs(outward * left) < 1e-12:
        return way * (b + left)
    return way * (b - (1.0 - outward * b) / outward * expm1(-outward * left))


@contextmanager
def own_law() -> Iterator[str]:
    """Register the published element as a law of the user's own, as long as the context lasts."""

    class FirstOrder(Law):
        """Bouc-Wen element of first order: f = alpha b + c v + k x, see `bent` for b."""

        name = "bouc_wen_first_order"
        parts = ("yield", "viscous", "spring")
        contains = ("spring",)
        source = "Schoukens & Noel (2017), IFAC-PapersOnLine 50(1), 448-453"
        states = {"deflection": "m"}  # noqa: RUF012
        parameters = {  # noqa: RUF012
            "alpha": Parameter(1e3, "N/m", (0.0, 1e9), "stiffness of the hysteretic spring"),
            "c": Parameter(10.0, "N.s/m", (0.0, 1e7), "viscous coefficient"),
            "k": Parameter(1e3, "N/m", (0.0, 1e9), "stiffness beside it"),
            "inward": Parameter(100.0, "1/m", (1e-2, 1e6), "beta (gamma - delta)"),
            "outward": Parameter(100.0, "1/m", (-1e3, 1e6), "beta (gamma + delta)"),
        }
        shapes = {  # noqa: RUF012
            "inward": Shape(0.1, 10.0, 9, ("alpha",)), "outward": Shape(0.1, 3.0, 4, ("alpha",)),
        }  # fmt: skip

        @staticmethod
        def yielding(q, z, p):  # type: ignore[no-untyped-def]
            return p.alpha * z.deflection

        @staticmethod
        def viscous(q, z, p):  # type: ignore[no-untyped-def]
            return p.c * q.v

        @staticmethod
        def elastic(q, z, p):  # type: ignore[no-untyped-def]
            return p.k * q.x

        @staticmethod
        def rate(q, z, p):  # type: ignore[no-untyped-def]
            b, middle, half = z.deflection, 0.5 * (p.inward + p.outward), p.outward - p.inward
            return (q.v - middle * abs(q.v) * b - 0.5 * half * q.v * abs(b),)

        @staticmethod
        def advance(q, z, p):  # type: ignore[no-untyped-def]
            return (bent(z.deflection, q.v, p.inward, p.outward, q.dt),)

    try:
        yield FirstOrder.name
    finally:
        forget_law(FirstOrder)


TRAIN, TEST = 1, 2
"""Seeds of the multisine that a law is identified from, and of that of the test."""

FAST = 4
"""Times the published rate at which the bench samples in the second row of a law."""

OWN, LIBRARY = "own", "bouc_wen"
"""Which law is identified: the published equations as a user's own, or the library's."""

JOBS = ((OWN, 1, 1), (OWN, FAST, 1), (LIBRARY, 1, 1))
"""Law, times the published rate of the bench, version of this file's numbers."""


def answer(law: str, times: int, _version: int = 1) -> Answer:
    """Return what a law leaves: the force on the bench [1], the displacement in simulation [m]."""
    with own_law() if law == OWN else nullcontext(law) as name:
        bench = Problem([on_bench(record(TRAIN, times), TRAIN, "multisine")])
        found = fit_from_starts(bench, Model(name))
        test = record(TEST)
        model = found.model
        errors = [(run.force - bench.predict(model, run))[run.skip :] for run in bench.runs]
        return {
            "force": share_of(errors, bench.runs), "rmse": rmse(model, test),
            "rms": float(np.sqrt(np.mean(test.y**2))), "values": model.values, "std": found.std,
        }  # fmt: skip


def run() -> list[Row]:
    """Return the rows of the laws identified on a bench, beside the published figure."""
    done = Answers("boucwen").complete(JOBS, answer)
    rows = []
    for law, times, version in JOBS:
        one = done[json.dumps([law, times, version])]
        what = "its equations as an own law" if law == OWN else f"the library's {law}"
        told = ", ".join(f"{n} {plain(v, 3)} ± {plain(one['std'].get(n, 0.0), 2)}"
                         for n, v in one["values"].items() if n in one["std"])  # fmt: skip
        rows.append(
            Row(
                f"Bouc-Wen benchmark, {what}, bench at {times * RATE:g} Hz: RMSE of y",
                f"{one['rmse']:.2e} m ({one['rmse'] / one['rms']:.1%} of y)",
                f"{PUBLISHED:.1e} m, PNLSS from u and y alone", one["rmse"] / PUBLISHED,
                f"{one['force']:.1%} of the force left on the bench; {told}",
            )
        )  # fmt: skip
    return rows
