"""What a verdict costs: simulations of the damper, samples in them, processor time, by stage.

    python -m benchmarks cost

prints the README's example, its law given and sought. A campaign of 30 sines takes minutes and is
asked for: `python -m benchmarks cost sines`. Its damper has a law and an effect that the library
lacks, so that nothing ends the search early.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd

from bristle.data.channels import ChannelSpec
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.diagnosis import diagnose_rig
from bristle.examples.make import Choice, make_bench
from bristle.identification.histories import DamperForces
from bristle.model.model import Model

from ._rows import Row, show

STAGES = {
    "motion": ("diagnosis.runs_of_rig",),
    "law": ("rig_runs.fit_from_starts", "rig_runs.refine"),
    "law trials": ("joint_search.try_laws", "joint_search.fitted_anew", "diagnosis.try_laws"),
    "effect trials": (
        "diagnosis.diagnose_damper",
        "joint_search.diagnose_damper",
        "diagnosis.Trials",
        "joint_search.Trials",
    ),
    "runs that contradict": ("diagnosis.contradicted",),
    "limits": ("diagnosis.effect_limits", "diagnosis.untestable"),
    "intervals": ("diagnosis.multistart_refit", "diagnosis.intervals_of"),
}
"""Functions of `bristle.diagnosis` by the stage that they are; all else is the rest."""

REST = "rest"

FREQUENCIES, AMPLITUDES = (0.5, 1.0, 2.0), (5e-3, 10e-3)
"""Of the campaign [Hz], [m]."""

CURRENTS, RATES = (0.0, 0.25, 0.5, 0.75, 1.0), (1000.0, 200.0)
"""Of the campaign [A], [Hz]; the rates take turns."""

SECONDS = 16.0
"""Length [s] of a run of it."""

STEP = 1e-4
"""Step [s] of its damper's state."""


@dataclass
class Spent:
    """Simulations, samples in them, and processor time [s] of a stage."""

    simulations: int = 0
    samples: int = 0
    seconds: float = 0.0

    def __str__(self) -> str:
        return f"{self.simulations:,} simulations, {self.samples:,} samples, {self.seconds:.1f} s"


@dataclass
class Meter:
    """What each stage has spent; simulations are counted where a bench makes them."""

    stages: dict[str, Spent] = field(default_factory=dict)

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Count what is made within."""
        lock, force = Lock(), DamperForces.force
        under_way = [REST]
        last = time.process_time()

        def charge() -> Spent:
            nonlocal last
            spent = self.stages.setdefault(under_way[-1], Spent())
            now = time.process_time()
            spent.seconds, last = spent.seconds + now - last, now
            return spent

        def counted(bench: DamperForces, x: Any, *given: Any, **named: Any) -> Any:
            with lock:
                spent = self.stages.setdefault(under_way[-1], Spent())
                spent.simulations, spent.samples = spent.simulations + 1, spent.samples + len(x)
            return force(bench, x, *given, **named)

        def staged(stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
            def call(*given: Any, **named: Any) -> Any:
                charge()
                under_way.append(stage)
                try:
                    return function(*given, **named)
                finally:
                    charge()
                    under_way.pop()

            return call

        with ExitStack() as patches:
            patches.enter_context(patch.object(DamperForces, "force", counted))
            for stage, names in STAGES.items():
                for name in names:
                    whole = f"bristle.diagnosis.{name}"
                    module, _, own = whole.rpartition(".")
                    found = getattr(__import__(module, fromlist=[own]), own)
                    patches.enter_context(patch(whole, staged(stage, found)))
            yield
            charge()

    def rows(self, name: str) -> list[Row]:
        """Return a row of all, and one of each stage."""
        whole = Spent()
        for one in self.stages.values():
            whole.simulations += one.simulations
            whole.samples += one.samples
            whole.seconds += one.seconds
        order = (*STAGES, REST)
        return [
            Row(f"cost of a verdict, {name}", str(whole)),
            *(
                Row(f"cost of a verdict, {name}: {stage}", str(self.stages[stage]))
                for stage in order
                if stage in self.stages
            ),
        ]


def run() -> list[Row]:
    """Return the cost of the README's example, its law given and sought."""
    with tempfile.TemporaryDirectory() as folder:
        study = make_bench(Path(folder) / "rig", Choice())
        runs, law = study.runs(), study.model().law
    given, free = Meter(), Meter()
    diagnose_rig(runs.train, runs.holdout, Model(law))  # compiles
    with given.counting():
        diagnose_rig(runs.train, runs.holdout, Model(law))
    with free.counting():
        diagnose_rig(runs.train, runs.holdout, Model(law), any_law=True)
    return [*given.rows("README's example"), *free.rows("the same, law sought")]


def main(given: Sequence[str]) -> int:
    """Print the cost of the campaign of sines; 0."""
    if [*given] != ["sines"]:
        raise SystemExit(f"cost {' '.join(given)}: `cost sines` and `cost` are right.")
    train, held_out = sines()
    meter = Meter()
    with meter.counting():
        found = diagnose_rig(train, held_out, Model("bingham"), any_law=True)
    show([*meter.rows("30 sines"), Row("verdict, 30 sines", f"{found.kind} {found.law}")])
    return 0


def sines(seed: int = 11) -> tuple[list[Measurement], list[Measurement]]:
    """Return a campaign of 30 sines of a damper that the library lacks: runs to fit, held out."""
    rng = np.random.default_rng(seed)
    settings = [
        (current, frequency, amplitude)
        for current in CURRENTS
        for frequency in FREQUENCIES
        for amplitude in AMPLITUDES
    ]
    runs = [_sine(*setting, RATES[k % len(RATES)], rng) for k, setting in enumerate(settings)]
    held_out = range(2, len(runs), 5)
    return (
        [run for k, run in enumerate(runs) if k not in held_out],
        [runs[k] for k in held_out],
    )


def _sine(
    current: float, frequency: float, amplitude: float, rate: float, rng: np.random.Generator
) -> Measurement:
    """Return a run: a bristle that gives way as its root, stronger in compression, and a thinning
    oil whose drag falls as the damper works."""
    count = round(SECONDS / STEP)
    t = STEP * np.arange(count)
    x = amplitude * np.minimum(1.0, t * frequency) * np.sin(2.0 * np.pi * frequency * t)
    v = np.gradient(x, STEP)
    bristle = np.empty(count)
    z = 0.0
    for k, speed in enumerate(v.tolist()):
        bristle[k] = z
        z += STEP * (speed - abs(speed) * z * abs(z) ** 0.5) / 6e-4
    yielding = 150.0 + 900.0 * current - 180.0 * current**2
    drag = (1500.0 + 1100.0 * current) * v * np.exp(-STEP * np.cumsum(np.abs(v)) / 0.8)
    force = yielding * bristle * (1.0 + 0.12 * np.tanh(v / 0.01)) + drag + 4000.0 * x + 60.0
    every = round(1.0 / (rate * STEP))
    frame = pd.DataFrame({
        "time": t[::every],
        "displacement": x[::every] + 2e-6 * rng.standard_normal(-(-count // every)),
        "force": force[::every] + 8.0 * rng.standard_normal(-(-count // every)),
        "current": np.full(-(-count // every), current),
    })  # fmt: skip
    units = {"time": "s", "displacement": "m", "force": "N", "current": "A"}
    specs = {name: ChannelSpec(name, unit) for name, unit in units.items()}
    name = f"sine_{current:g}A_{frequency:g}Hz_{1e3 * amplitude:g}mm"
    return measurements_of_frame(frame, name, specs)[0]
