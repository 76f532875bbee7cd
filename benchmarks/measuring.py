"""How long a study's identification and diagnosis take, and how much memory: whole commands.

The studies are made of random runs on the true rig of an example, with a hidden Stribeck friction:
seven runs of 12 s at 500 Hz, and thirty of 60 s at 1 kHz. "Cold" is a cache without machine code.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bristle.diagnosis import diagnose_rig
from bristle.examples.make import Choice
from bristle.examples.rigs import (
    Motion,
    Programme,
    instruments,
    perform,
    recorded,
    scales_of,
    write_csv,
)
from bristle.model.model import Model
from bristle.planning.limits import PrescribedSignals, Test
from bristle.planning.waveforms import Command, Waveform
from bristle.study.steps import create_study
from bristle.study.study import Study

from ._rows import Row
from .cost import Meter
from .plan import LIMITS, TrueRig

EFFECT = "stribeck"


class Cost(NamedTuple):
    """What a command took: seconds, of them those of processors, and the most memory in GB."""

    seconds: float
    processor: float
    memory: float

    def __str__(self) -> str:
        return f"{self.seconds:.1f} s ({self.processor:.1f} s of processor, {self.memory:.2f} GB)"


def run() -> list[Row]:
    """Return the figures of both studies."""
    with tempfile.TemporaryDirectory(prefix="bristle_measuring_") as name:
        folder = Path(name)
        return [*_seven(folder), *_thirty(folder)]


def _seven(folder: Path) -> list[Row]:
    study = _study(folder / "seven", runs=7, held=2, seconds=12.0, rate=500.0)
    cold = {**os.environ, "BRISTLE_CACHE": str(folder / "cold")}
    first = _cost(["identify", study], cold)
    second = _cost(["diagnose", study], {**cold, "BRISTLE_CACHE": str(folder / "colder")})
    identify, given = _cost(["identify", study], cold), _warm(["diagnose", study], cold)
    free = _warm(["diagnose", study, "--law", "all"], cold)
    limits = _limits(Study(Path(study)))
    what = "7 runs of 12 s at 500 Hz"
    return [
        _row(f"identify, {what}, cold", first, 5.0),
        _row(f"identify, {what}, warm", identify, 3.0),
        _row(f"diagnose, {what}, law given, cold", second, 30.0),
        _row(f"diagnose, {what}, law given, warm", given, 15.0),
        _row(f"diagnose, {what}, law free, warm", free, 3.0 * given.seconds),
        Row(
            "limits with a verdict, of the rest",
            f"{limits:.1%}",
            "<= 10 %",
            10.0 * limits,
        ),
    ]


def _limits(study: Study) -> float:
    """Return the processor time that the limits of a diagnosis take, over that of its rest."""
    runs, law, meter = study.runs(), Model(study.model().law), Meter()
    diagnose_rig(runs.train, runs.holdout, law)  # compiles
    with meter.counting():
        diagnose_rig(runs.train, runs.holdout, law)
    limits = meter.stages["limits"].seconds
    return limits / (sum(one.seconds for one in meter.stages.values()) - limits)


def _thirty(folder: Path) -> list[Row]:
    study = _study(folder / "thirty", runs=30, held=10, seconds=60.0, rate=1000.0)
    cost = _warm(["diagnose", study], {**os.environ, "BRISTLE_CACHE": str(folder / "cold")})
    what = "diagnose, 30 runs of 60 s at 1 kHz, warm"
    memory = Row(f"{what}, memory", f"{cost.memory:.2f} GB", "<= 2 GB", cost.memory / 2.0)
    return [_row(what, cost, 90.0), memory]


def _row(name: str, cost: Cost, goal: float) -> Row:
    return Row(name, str(cost), f"<= {goal:.0f} s", cost.seconds / goal)


def _study(folder: Path, *, runs: int, held: int, seconds: float, rate: float) -> str:
    """Return the folder of a study of random runs under random steps of the command."""
    choice = Choice(effects=(EFFECT,), law="bingham", seed=5)
    rig = TrueRig(folder / "rig", choice)
    rng, scales = np.random.default_rng(5), scales_of("bench", "bingham")
    files: list[Path] = []
    noise: dict[str, float] = {}
    for k in range(runs):
        test = Test(
            Waveform("multisine", 0.5, 5.0, 50 + k), Command("random", 0.0, 8.0, 0.7, k),
            seconds=seconds,
        )  # fmt: skip
        planned = test.signals(LIMITS, rate)
        motion, volts = _sampled(planned, rate)
        shown = perform(rig.damper, motion, volts, scales)
        noise = noise or instruments({"first": shown}, choice.noise)
        role = "holdout" if k >= runs - held else "train"
        files.append(folder / f"{role}_{k + 1}.csv")
        write_csv(files[-1], recorded(shown, noise, rng))
    return str(create_study(folder / "study", files, law="bingham", rig="bench").study.folder)


def _sampled(planned: PrescribedSignals, rate: float) -> tuple[Motion, Programme]:
    """Return motion and command at the samples alone: no state depends on what is between them."""
    rows = list(zip(planned.x.tolist(), planned.v.tolist(), planned.a.tolist(), strict=True))
    volts: list[float] = planned.V.tolist()

    def moved(t: float) -> tuple[float, float, float]:
        return rows[round(t * rate)]

    def command(t: float) -> float:
        return volts[round(t * rate)]

    return Motion(planned.time, moved), Programme(command)


def _warm(words: list[str], environment: dict[str, str]) -> Cost:
    """Return the cost of a command that has run before."""
    _cost(words, environment)
    return _cost(words, environment)


def _cost(words: list[str], environment: dict[str, str]) -> Cost:
    begin = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "bristle.cli", *words, "--quiet"],
            env=environment, stdout=said, stderr=subprocess.STDOUT,
        )  # fmt: skip
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            said.seek(0)
            raise RuntimeError(f"{words}: {said.read().decode()[-500:]}")
    seconds = time.perf_counter() - begin
    return Cost(seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024**2)
