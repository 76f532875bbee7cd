"""Each law identified from bench data that it made itself: `python -m benchmarks laws`.

A run is 12 s of a rod that is moved by tones up to 6 Hz under a voltage that swings and steps; two
runs make a case, every channel with 1 % noise, sampled at 500 Hz. The truth of a case is drawn
about the law's defaults, the force is integrated 10 times finer, and `identify` begins as for any
user: from the class data alone. Reported is how many of the 95 % intervals hold the truth.

`python -m benchmarks laws --seeds 50 --law dahl` measures more of one law.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from bristle.core.arrays import Array
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.identification.fit import fit_from_starts
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem
from bristle.model.model import Model
from bristle.physics.laws import LAWS, laws_of

from ._rows import Row, show

STEP = 0.002
"""Sampling step [s]."""
FINER = 10
"""Steps of the truth within one of the sampling."""
SECONDS = 12.0
NOISE = 0.01
"""Standard deviation of a channel's noise, by that of the channel."""
SPREAD = 1.5
"""A parameter of the truth lies between its default over this and times it."""
SEEDS = 4
"""Cases per law where nobody says another number."""
WITHIN = 1.96
"""Half of a 95 % interval, in standard deviations."""
LOW, HIGH = 0.90, 0.99
"""Shares of the intervals that hold the truth, between which they are right."""


@dataclass(frozen=True)
class Case:
    """What a fit found of one truth: errors over standard deviations by name; what was not told."""

    law: str
    seed: int
    errors: dict[str, float]
    unidentified: tuple[str, ...]
    agreed: int

    @property
    def covered(self) -> int:
        """How many of the intervals hold the truth."""
        return sum(abs(error) < WITHIN for error in self.errors.values())


def motion(rng: np.random.Generator, seconds: float = SECONDS) -> tuple[Array, ...]:
    """Return t [s], x [m], v [m/s], a [m/s2] and V [V], every STEP / FINER."""
    t = np.arange(round(seconds / STEP) * FINER + 1) * STEP / FINER
    x, v, a = np.zeros((3, len(t)))
    for low, high, size in ((0.5, 1.5, 4e-3), (1.5, 3.0, 2.5e-3), (3.0, 6.0, 1.2e-3)):
        w, phase = 2.0 * np.pi * rng.uniform(low, high), rng.uniform(0.0, 2.0 * np.pi)
        size *= rng.uniform(0.7, 1.3)
        x += size * np.sin(w * t + phase)
        v += size * w * np.cos(w * t + phase)
        a -= size * w * w * np.sin(w * t + phase)
    swing = 2.5 * (1.0 + np.sin(2.0 * np.pi * rng.uniform(0.3, 1.2) * t))
    levels = rng.uniform(0.0, 8.0, 12)
    held = levels[np.minimum((t / seconds * 12).astype(int), 11)]
    return t, x, v, a, np.where(t < 0.5 * seconds, swing, held)


def truth_of(law: str, rng: np.random.Generator) -> dict[str, float]:
    """Return parameters of a law about its defaults; those that no fit moves stay there."""
    found = {}
    for name, parameter in LAWS[law].parameters.items():
        if name not in LAWS[law].fixed():
            low, high = parameter.bounds
            value = parameter.value * SPREAD ** rng.uniform(-1.0, 1.0)
            if parameter.value == 0.0:
                value = rng.uniform(-0.5, 0.5)
            found[name] = float(np.clip(value, low + 0.1 * abs(value), high))
    return found


def recorded(
    law: str,
    values: dict[str, float],
    rng: np.random.Generator,
    name: str,
    effects: Sequence[str] = (),
) -> Measurement:
    """Return one run of a law, and of effects with it, measured with noise."""
    t, x, v, a, V = motion(rng)
    force = DamperForces(law, list(effects)).force(x, v, a, V, STEP / FINER, values)
    seen = {"displacement [m]": x, "velocity [m/s]": v, "voltage [V]": V, "force [N]": force}
    frame = {"time [s]": t[::FINER]}
    for title, signal in seen.items():
        shown = signal[::FINER]
        noise = NOISE * np.std(shown) * rng.standard_normal(len(shown))
        frame[title] = shown if title.startswith("voltage") else shown + noise
    return measurements_of_frame(pd.DataFrame(frame), name)[0]


def case(law: str, seed: int) -> Case:
    """Return what `identify` finds of the truth of one seed."""
    rng = np.random.default_rng([seed, *law.encode()])
    truth = truth_of(law, rng)
    problem = Problem([prepare(recorded(law, truth, rng, f"run_{k}")) for k in (1, 2)])
    found = fit_from_starts(problem, Model(law))
    errors = {
        name: (found.model.value(name) - truth[name]) / max(std, 1e-300)
        for name, std in found.std.items()
        if name not in found.unidentified
    }
    return Case(law, seed, errors, found.unidentified, found.agreed)


def row_of(law: str, cases: Sequence[Case]) -> Row:
    """Return the row of a law: the share covered, and the parameters that are worst."""
    count = sum(len(one.errors) for one in cases)
    held = sum(one.covered for one in cases)
    share = held / max(count, 1)
    missed = {
        name: sum(abs(one.errors.get(name, 0.0)) >= WITHIN for one in cases)
        for name in LAWS[law].parameters
    }
    lost = sum(len(one.unidentified) for one in cases)
    worst = ", ".join(f"{name} {n}" for name, n in missed.items() if n)
    # A few cases do not tell 95 % from 89 %: what their own scatter allows is reached.
    slack = 2.0 * np.sqrt(0.05 * 0.95 / max(len(cases), 1))
    low, high = LOW - slack / 2.0, min(HIGH + slack / 2.0, 1.0)
    ratio = max(low / max(share, 1e-9), share / high)
    return Row(
        f"law {law}: parameters within their 95 % intervals",
        f"{100.0 * share:.1f} % ({held} of {count}, {len(cases)} cases)",
        f"{100.0 * LOW:.0f} to {100.0 * HIGH:.0f} %",
        float(ratio),
        f"not told {lost}; outside: {worst or 'none'}",
    )


def measure(laws: Sequence[str], seeds: int, processes: int | None = None) -> list[Row]:
    """Return a row per law over so many cases each."""
    rows = []
    for law in laws:
        case(law, 10_000)  # compiled, and kept, before the others ask for it
        with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
            cases = list(pool.map(partial(case, law), range(seeds)))
        rows.append(row_of(law, cases))
        print(f"{rows[-1].name}: {rows[-1].measured}; {rows[-1].note}", file=sys.stderr, flush=True)
    return rows


def run() -> list[Row]:
    """Return the rows of all laws with a few cases each."""
    return measure([law.name for law in laws_of("damper")], SEEDS)


def main(given: Sequence[str]) -> int:
    """Show the rows of some laws over some seeds, as the arguments ask."""
    names = [law.name for law in laws_of("damper")]
    parser = argparse.ArgumentParser(prog="python -m benchmarks laws", description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS, help="cases per law")
    parser.add_argument("--law", action="append", choices=names, help="this law; may be repeated")
    parser.add_argument("--processes", type=int, help="how many at a time")
    arguments = parser.parse_args(given)
    show(measure(arguments.law or names, arguments.seeds, arguments.processes))
    return 0
