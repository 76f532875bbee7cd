"""The trained policy against clipped-optimal control on the eight cases, which it has not seen.

`python -m benchmarks trained`: each case by the coupled engine, then with noise, delay and wrong
parameters in the closed loop of the design, and how long a step of the FMU takes.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bristle.component.controller_file import read_controller
from bristle.core.arrays import Array
from bristle.core.files import scenarios_folder
from bristle.engine.coupled import Coupled
from bristle.errors import RecordError
from bristle.fmu.catalogue import instantiate
from bristle.synthesis import DesignDamper
from bristle.system.scenario import load_scenario

from ._motions import DATA, NEWHALL, REPORTED, G, recorded
from ._rows import Row
from ._semi_active import PARTS
from .training.closed_loop import Motion, Policy
from .training.training import Loop, PolicyTask, Run, Training, disturbed, plant_of, setup_of

FMU = "TrainedPolicy"
OUTPUT, DRIFT = "structure.floor2_acceleration_absolute", "structure.base_displacement"
LEAST, MEAN = 0.2, 0.3
"""Goals: below clipped-optimal in every case, and on the mean."""
MORE = 1.05
"""Goal for RMS and drift, against clipped-optimal's."""
LOST = 0.05
"""Goal for what noise, delay and wrong parameters cost."""
STEP = 200e-6
"""Goal for a step of the FMU [s]."""
DRAWS = 10
"""Wrong buildings, dampers and sensors of each case."""
POLICY = Path(__file__).parents[1] / "bristle" / "component" / "data" / "policy.json"


class Case(NamedTuple):
    """What a run shows: peak and RMS of the floor's acceleration [m/s2], peak drift [m]."""

    peak: float
    rms: float
    drift: float


def run() -> list[Row]:
    """Return a row per case, and those on all of them."""
    rows: list[Row] = []
    ratios, costs, more = [], [], []
    for name, record, intensity, seconds in REPORTED:
        try:
            ground = recorded(record, intensity, seconds)
        except RecordError:
            continue
        clipped, trained = (case(fmu, record, intensity) for fmu in ("ClippedOptimal", FMU))
        ratios.append(trained.peak / clipped.peak)
        more += [trained.rms / clipped.rms, trained.drift / clipped.drift]
        clean, wrong = closed_loop(ground)
        costs.append((wrong - clean) / clipped.peak)
        rows.append(
            Row(
                f"trained, {name} {intensity:g} g",
                f"{100 * (1 - ratios[-1]):.1f} % below: {trained.peak:.3f} against "
                f"{clipped.peak:.3f} m/s2",
                f"{100 * LEAST:.0f} % below clipped",
                ratios[-1] / (1.0 - LEAST),
                f"RMS {more[-2]:.2f}, drift {more[-1]:.2f} times clipped's; with noise, delay and "
                f"wrong parameters {100 * costs[-1]:.1f} points less, mean of {DRAWS}",
            )
        )
    mean, second = float(np.mean(ratios)), step_time()
    rows += [
        Row("trained, mean below clipped", f"{100 * (1 - mean):.1f} %", f"{100 * MEAN:.0f} %",
            mean / (1.0 - MEAN), f"{len(ratios)} of {len(REPORTED)} cases have their record here"),
        Row("trained, least gain", f"{100 * (1 - max(ratios)):.1f} %", f"{100 * LEAST:.0f} %",
            max(ratios) / (1.0 - LEAST),
            f"{sum(ratio <= 1.0 - LEAST for ratio in ratios)} cases pass"),
        Row("trained, noise, delay, 10 % wrong", f"{100 * float(np.mean(costs)):.1f} points",
            f"{100 * LOST:.0f} points", float(np.mean(costs)) / LOST),
        Row("trained, largest RMS or drift", f"{max(more):.2f} times clipped's", f"{MORE:g}",
            max(more) / MORE),
        Row("trained, step of the FMU", f"{1e6 * second:.0f} us", f"{1e6 * STEP:.0f} us",
            second / STEP, "the component in Python, one sample"),
    ]  # fmt: skip
    return rows


def case(fmu: str, record: str, intensity: float) -> Case:
    """Return what a controller makes of one of the eight cases."""
    text = (scenarios_folder() / "el_centro_0p6g_clipped.toml").read_text(encoding="utf-8")
    name = str(Path(DATA) / record) if record == NEWHALL else record
    values = {"ground.record": name, "ground.peak": intensity * G, "run.stop": 32.0}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "case.toml"
        file.write_text(text.replace('"ClippedOptimal"', f'"{fmu}"'), encoding="utf-8")
        rows: Any = Coupled().run(load_scenario(file, values))
    y, x = np.array(rows[OUTPUT]), np.array(rows[DRIFT])
    return Case(
        float(np.abs(y).max()), float(np.sqrt(np.mean(y**2))), float(np.abs(x).max())
    )  # fmt: skip


def closed_loop(ground: Array) -> tuple[float, float]:
    """Return the peak [m/s2] in the closed loop of the design, and its mean under disturbances.

    Parameters
    ----------
    ground : (n,) m/s2 every 0.25 ms
    """
    c = read_controller(POLICY)
    hidden = int(c.design["motions"]["hidden"])
    task = PolicyTask(damper=DesignDamper("lugre"), motions=Training(synthetic=1, hidden=hidden))
    samples = ground[::PARTS].copy()
    A, B, W, scales = (np.array(each) for each in (c.A, c.B, c.W, c.C))
    policy = Policy(False, 0.0, c.n, hidden, A, B, W, scales)
    loop = Loop(policy, len(samples), task.damper, 2 * task.building.size)
    clean = Run(
        plant_of(task), setup_of(task.damper, 0.0), Motion(samples, np.zeros((len(samples), 4)), 0)
    )
    random = np.random.default_rng(5)
    peaks = [
        float(np.abs(loop.respond(disturbed(loop, clean, task, random, worst=True), W)[0]).max())
        for _ in range(DRAWS)
    ]
    return float(np.abs(loop.respond(clean, W)[0]).max()), float(np.mean(peaks))


def step_time() -> float:
    """Return how long a sample of the component takes in Python [s], the median of many."""
    slave = instantiate(FMU)
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    spent = []
    for k in range(2000):
        slave.set_real(slave._inputs, [np.sin(0.1 * k), 0.01, 0.1, 5.0])
        began = time.perf_counter()
        slave.do_step(k * 0.002, 0.002)
        spent.append(time.perf_counter() - began)
    return float(np.median(spent))
