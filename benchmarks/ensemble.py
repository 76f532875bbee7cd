"""An ensemble of El Centro runs: two processes against one, one process against a plain loop.

The loops are cut into slices that take turns, so that a busy moment hits all of them.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

from bristle.campaign import EnsemblePlan
from bristle.campaign.campaign import run_local
from bristle.campaign.ensemble_file import read_ensemble
from bristle.engine.coupled import Coupled
from bristle.system.scenario import load_scenario

from ._rows import Row

ENSEMBLE = "el_centro_damper_and_building"
RUNS = 500
SLICES = 5


def run() -> list[Row]:
    """Return the ensemble's figures."""
    plan = read_ensemble(ENSEMBLE, RUNS)
    plan.campaign().prepare()
    jobs: dict[str, Callable[[range], None]] = {
        "loop": lambda runs: _loop(plan, runs),
        "one": lambda runs: _pool(plan, runs, 1),
        "two": lambda runs: _pool(plan, runs, 2),
    }
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    worked = dict.fromkeys(jobs, 0.0)
    size = RUNS // SLICES
    for k in range(SLICES):
        for name, job in jobs.items():
            before, work = time.perf_counter(), _processor_time()
            job(range(k * size, (k + 1) * size))
            seconds[name].append(time.perf_counter() - before)
            worked[name] += _processor_time() - work
    gain = statistics.median(a / b for a, b in zip(seconds["one"], seconds["two"], strict=True))
    cost = statistics.median(a / b for a, b in zip(seconds["one"], seconds["loop"], strict=True))
    return [
        Row(
            f"ensemble, {RUNS} El Centro runs, two processes",
            f"{sum(seconds['two']):.2f} s; one process {sum(seconds['one']):.2f} s",
        ),
        Row(
            "ensemble, two processes faster than one",
            f"{gain:.2f} x",
            ">= 1.8 x",
            1.8 / gain,
            f"needs two idle cores; processor time of two over one: "
            f"{worked['two'] / worked['one']:.3f}",
        ),
        Row(
            "ensemble, one process, cost per run / plain loop of load_scenario and simulate",
            f"{cost:.3f} x; loop {1e3 * sum(seconds['loop']) / RUNS:.1f} ms per run",
            "<= 1.1 x",
            cost / 1.1,
        ),
    ]


def _processor_time() -> float:
    """Return the processor time [s] of this process and of those that it has waited for."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def _loop(plan: EnsemblePlan, runs: range) -> None:
    """Run what a user would write: the scenario with values, the same numbers kept.

    The building stays as it is, for a loop would have to write a file for it.
    """
    names = [varied.name for varied in plan.varied if varied.place != "building"]
    for k in runs:
        values = plan.values(k)
        columns = Coupled().run(load_scenario(plan.system, {name: values[name] for name in names}))
        for output in plan.outputs:
            output.of(columns[output.column])


def _pool(plan: EnsemblePlan, runs: range, workers: int) -> None:
    for outcome in run_local(plan.campaign(), runs, workers):
        if outcome.reason:
            raise RuntimeError(outcome.reason)
