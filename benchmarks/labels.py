"""Labels of runs that a parameter depends on, and labels that nothing depends on.

    python -m benchmarks labels --first 4000 --cases 40

Of each four cases two have a dependence on a label, one nothing, one something that no effect of
the library has. All have labels besides that were drawn at random. No rule was tuned on these.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bristle.data.channels import Labels
from bristle.data.measurement import Known, Measurement, measurements_of
from bristle.data.table import table_from_frame
from bristle.diagnosis import Diagnosis, diagnose_rig
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS
from bristle.user_code.load import undefine

from ._rows import Row, show

FIRST, CASES = 4000, 40
RUNS, TRAIN = 8, 6
STEP, COUNT = 2e-3, 1500
GOAL = 0.9
KINDS = ("preload on a pressure", "yield force on the oil", "viscous part on the temperature",
         "stiffness on a level")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A rig: `runs`, what depends on the `label` ("": nothing), and what of it is a rig's own."""

    runs: list[Measurement]
    label: str
    about: str


def case(seed: int) -> Case:
    """Return the case of a seed."""
    rng = np.random.default_rng(seed)
    kind = KINDS[(2 * (seed // 4) + seed % 4) % 4]
    matters, hidden = seed % 4 < 2, seed % 4 == 3
    sizes = {
        "f": rng.uniform(0.5, 2.0), "f_v": rng.uniform(0.4, 1.0), "c": rng.uniform(30.0, 90.0),
        "k": rng.uniform(30.0, 120.0), "f_0": rng.uniform(-1.0, 1.0),
        "v_s": rng.uniform(5e-3, 2e-2),
    }  # fmt: skip
    size = rng.uniform(0.15, 0.5) * rng.choice([-1.0, 1.0])
    told: list[Labels] = []
    changes: list[dict[str, float]] = []
    by_kind: dict[str, tuple[str, list[Any]]] = {
        KINDS[0]: ("pressure", [50.0, 100.0, 150.0]), KINDS[1]: ("oil", ["new", "old"]),
        KINDS[2]: ("temperature", list(np.round(rng.uniform(12.0, 45.0, RUNS), 1))),
        KINDS[3]: ("level", [1.0, 2.0, 3.0, 4.0]),
    }  # fmt: skip
    name, levels = by_kind[kind]
    order = _spread(levels, rng)
    for k in range(RUNS):
        own, value = dict(sizes), order[k]
        if kind == KINDS[0]:
            own["f_0"] += size * (float(value) - 100.0) / 50.0
        elif kind == KINDS[1]:
            own["f"] *= 1.0 + size * (value == "old")
        elif kind == KINDS[2]:
            warm = 1.0 / (float(value) + 273.15) - 1.0 / 298.15
            own["c"] *= float(np.exp(3000.0 * abs(size) * warm))
        else:
            own["k"] *= 1.0 + size * (float(value) - 2.5)
        changes.append(own if matters else sizes)
        other: Labels = {"humidity": float(np.round(rng.uniform(30.0, 60.0), 1))}
        random: Labels = {"batch": str(rng.choice(["A", "B", "C"]))} if not matters else {}
        told.append({**({name: value} if matters else {}), **other, **random})
    runs = [
        _run(f"run_{k + 1}", rng, own, labels, hidden)
        for k, (own, labels) in enumerate(zip(changes, told, strict=True))
    ]
    about = kind if matters else "an effect that has no name" if hidden else "nothing"
    return Case(runs, name if matters else "", about)


def _spread(levels: list[Any], rng: np.random.Generator) -> list[Any]:
    """Return a level for each run, each in turn, the order at random, each level in training."""
    while True:
        order = [levels[k % len(levels)] for k in range(RUNS)]
        order = [order[k] for k in rng.permutation(RUNS)]
        if {*order[:TRAIN]} >= {*levels} or len(levels) == RUNS:
            return order


def _run(
    name: str, rng: np.random.Generator, p: dict[str, float], labels: Labels, hidden: bool
) -> Measurement:
    """Return a run of a damper with a smooth yield force: its own motion, steps of the voltage."""
    t = STEP * np.arange(COUNT)
    w = 2.0 * np.pi * rng.uniform(0.4, 5.0, 8)
    size, angle = rng.uniform(0.3, 1.0) * 0.02 / w, w[:, None] * t + rng.uniform(0.0, 6.28, (8, 1))
    x, v = size @ np.sin(angle), (size * w) @ np.cos(angle)
    V = np.repeat(rng.choice([0.0, 2.0, 4.0], 10), COUNT // 10)
    force = (p["f"] + p["f_v"] * V) * np.tanh(v / p["v_s"]) + p["c"] * v + p["k"] * x + p["f_0"]
    if hidden:  # a bore that is worn in the middle of the stroke
        force = force * (1.0 - 0.5 * np.exp(-((x / 1.5e-3) ** 2)))
    frame = pd.DataFrame({
        "time [s]": t, "x [m]": x + 1e-6 * rng.standard_normal(COUNT), "U [V]": V,
        "F [N]": force + 0.05 * rng.standard_normal(COUNT),
    })  # fmt: skip
    (run,) = measurements_of(table_from_frame(frame, name), known=Known(labels=labels))
    return run


def named(found: Diagnosis) -> set[str]:
    """Return the labels that a verdict names, alone or among alternatives."""
    return {
        label
        for name in found.effects if name in EFFECTS
        for label in EFFECTS[name].labels.values()
    }  # fmt: skip


def run(first: int = FIRST, cases: int = CASES) -> list[Row]:
    """Return how many labels that matter are found, and how many that do not are named.

    Parameters
    ----------
    first : seed of the first case
    cases : how many
    """
    matter = hit = idle = wrong = 0
    for seed in range(first, first + cases):
        one = case(seed)
        found = diagnose_rig(one.runs[:TRAIN], one.runs[TRAIN:], Model("tanh"))
        told = named(found)
        there = {label for run in one.runs for label in run.labels}
        matter, hit = matter + bool(one.label), hit + (one.label in told)
        idle, wrong = idle + len(there - {one.label}), wrong + len(told - {one.label})
        print(f"case {seed}, {one.about}: {found.kind} {', '.join(found.effects)} "
              f"(z {found.z_before:.2f} to {found.z_after:.2f})", file=sys.stderr)  # fmt: skip
        for name in found.written:
            undefine(name)
    text = f"{cases} benches from seed {first} on"
    share = hit / max(1, matter)
    return [
        Row(f"labels that matter, named: {text}", f"{hit} of {matter}", f">= {GOAL:.0%}",
            GOAL / max(share, 1e-9)),
        Row(f"labels that do not, named: {text}", f"{wrong} of {idle}", "none", 2.0 * (wrong > 0)),
    ]  # fmt: skip


def main(given: Sequence[str]) -> int:
    """Run the cases that are asked for, show their figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks labels", description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST, help="seed of the first case")
    parser.add_argument("--cases", type=int, default=CASES, help="how many")
    show(run(**vars(parser.parse_args(given))))
    return 0
