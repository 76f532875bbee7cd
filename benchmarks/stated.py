"""The error that a run states of its coupling against the true one, on loops drawn at random.

    python -m benchmarks stated --first 1000 --cases 120

No rule was tuned on these. The truth is the coupled engine with substeps of 20 us.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import pandas as pd

from bristle.engine.cosimulation import Cosimulation, ignore
from bristle.engine.coupling_error import (
    ROUNDING,
    CouplingError,
    again_by,
    estimate,
    finer,
    largest,
)
from bristle.engine.results import judged_by
from bristle.errors import BristleError, ScenarioError
from bristle.system.model import System
from bristle.system.scenario import load_scenario

from ._random_scenarios import write_random
from ._rows import Row

AGAIN = again_by(Cosimulation(listen=ignore))


FIRST, CASES = 1000, 20
TRUTH = 2e-5
"""Substep of the run that is taken for true [s]."""
NEAR, GOAL = 1.3, 0.95
WAYS = ("h, h/2, h/4", "coupled engine")
"""How an error can be estimated: by finer steps alone, as for foreign FMUs, or by the engine."""

Pair = tuple[CouplingError, float]


def run(first: int = FIRST, cases: int = CASES) -> list[Row]:
    """Return how near the stated errors are, for both ways of an estimate.

    Parameters
    ----------
    first : seed of the first case
    cases : how many
    """
    pairs: dict[str, list[Pair]] = {way: [] for way in WAYS}
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + cases):
            try:
                found = case(seed, Path(folder))
            except BristleError as error:
                failed += 1
                print(f"case {seed}: {error}", file=sys.stderr)
                continue
            for way, some in found.items():
                pairs[way] += some.values()
                for name, (told, true) in some.items():
                    if told.worth and not 1.0 / NEAR <= told.along / true <= NEAR:
                        print(f"case {seed}, by {way}: {name}: {told.along:.2g} stated, "
                              f"{true:.2g} true", file=sys.stderr)  # fmt: skip
    text = f"{cases - failed} random loops from seed {first} on"
    return [row for way, some in pairs.items() for row in _rows(f"{text}, by {way}", some)]


def case(seed: int, folder: Path) -> dict[str, dict[str, Pair]]:
    """Return stated and true error of the outputs that depend on the step, for both ways."""
    scenario = load_scenario(write_random(seed, folder))
    runs: dict[tuple[float, str], pd.DataFrame] = {}

    def again(one: System, engine: str) -> pd.DataFrame:
        key = one.step, engine
        if key not in runs:
            runs[key] = AGAIN(one, engine)
        return runs[key]

    def alone(one: System, engine: str) -> pd.DataFrame:
        if engine == "compiled":
            raise ScenarioError("as if one of the FMUs were foreign")
        return again(one, engine)

    frame = again(scenario, "fmu")
    parts = round(scenario.step / TRUTH)
    exact = AGAIN(finer(scenario, parts), "compiled").iloc[::parts]
    found: dict[str, dict[str, Pair]] = {}
    for way, runner in zip(WAYS, (alone, again), strict=True):
        told = estimate(scenario, frame, runner)[1]
        found[way] = {}
        for name in judged_by(frame):
            values = exact[name].to_numpy()[: len(frame)]
            true = largest(frame[name].to_numpy() - values) / (largest(values) or 1.0)
            if told[name].some or true > ROUNDING:
                found[way][name] = told[name], max(true, ROUNDING)
    return found


def _rows(what: str, pairs: list[Pair]) -> list[Row]:
    ratios = [told.along / true for told, true in pairs if told.worth]
    if not ratios:
        return [Row(f"stated / true error, {what}", "no output without a warning")]
    near = sum(1.0 / NEAR <= ratio <= NEAR for ratio in ratios) / len(ratios)
    below = sum(ratio < 0.5 for ratio in ratios)
    warned = f"{len(pairs) - len(ratios)} of {len(pairs)} outputs got a warning"
    return [
        Row(f"{what}: stated error within a factor {NEAR:g}",
            f"{near:.1%} of {len(ratios)} outputs", f">= {GOAL:.0%}", GOAL / max(near, 1e-9),
            warned),
        Row(f"{what}: stated below half", f"{below} of {len(ratios)}", "none", float(below > 0) * 2,
            f"{min(ratios):.2f} to {max(ratios):.2f}"),
    ]  # fmt: skip


def main(given: list[str]) -> int:
    """Run the cases that are asked for, print their figures."""
    from .__main__ import show

    parser = argparse.ArgumentParser(prog="python -m benchmarks stated", description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST, help="seed of the first case")
    parser.add_argument("--cases", type=int, default=CASES, help="how many")
    arguments = parser.parse_args(given)
    show(run(arguments.first, arguments.cases))
    return 0
