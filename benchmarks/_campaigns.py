"""Ordinary and planned campaigns of the same length, on the true rigs of examples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bristle.data.measurement import Measurement
from bristle.examples.hidden import seal, unseal
from bristle.examples.make import Choice, make_bench, motion_of, programme_of
from bristle.examples.rigs import Damper, Signals, perform, recorded, rig_of, scales_of, write_csv
from bristle.planning.folder import PlannedRun
from bristle.planning.limits import RigLimits, Test
from bristle.planning.waveforms import Command, Waveform
from bristle.study.steps import create_study
from bristle.study.study import Study
from tests.independent.experiments import proposed

from ._blind import cases
from ._blind.plan import make_plan
from ._blind.subject import measurements

LIMITS = RigLimits(
    stroke=17e-3, speed=0.2, acceleration=10.0, command=(0.0, 8.0), band=(0.3, 8.0),
    duration=12.0, runs=4,
)  # fmt: skip
"""Of the rig of examples, for ordinary tests and planned ones alike."""

SHEET = """schema = 1
[damper]
law = "{law}"
max_force = "15 N"
[limits]
stroke = "17 mm"
speed = "200 mm/s"
acceleration = "10 m/s2"
command = ["0 V", "8 V"]
band = ["0.3 Hz", "8 Hz"]
"""
"""The same as a rig.toml; its force is a data sheet's round number."""

IN_USE = 0.8
"""Share of the stroke that a hidden rig is driven to."""

CHANNELS = ("displacement", "velocity", "voltage", "force")


class TrueRig:
    """The rig of an example on a bench: performs tests, as often as it is asked to.

    Parameters
    ----------
    folder : an empty folder for the example
    choice : what the example is like
    """

    def __init__(self, folder: Path, choice: Choice) -> None:
        make_bench(folder, choice)
        self.answer = unseal(folder)
        rig = rig_of(self.answer)
        assert isinstance(rig, Damper)
        self.damper, self.law = rig, choice.law or "bingham"
        self._rng = np.random.default_rng([choice.seed, 77])

    def ideal(self, run: PlannedRun) -> Signals:
        """Return what ideal instruments show of a run."""
        volts = programme_of(run.time, run.signals["voltage"])
        scales = scales_of("bench", self.law)
        return perform(self.damper, motion_of(run.time, run.signals["displacement"]), volts, scales)

    def performed(self, runs: Sequence[PlannedRun]) -> list[Signals]:
        """Return what the rig's own instruments show."""
        return [recorded(self.ideal(run), self.answer["instruments"], self._rng) for run in runs]

    def measured(self, runs: Sequence[PlannedRun]) -> tuple[list[Measurement], list[Measurement]]:
        """Return measurements to fit to, and those held out."""
        shown = self.performed(runs)
        made = measurements(
            [{**one, "name": run.name} for run, one in zip(runs, shown, strict=True)], CHANNELS
        )
        roles = [run.role for run in runs]
        train = [one for one, role in zip(made, roles, strict=True) if role == "train"]
        return train, [one for one, role in zip(made, roles, strict=True) if role != "train"]

    def study(self, runs: Sequence[PlannedRun], folder: Path) -> Study:
        """Return an example with these runs in place of its own."""
        files = _written(runs, self.performed(runs), folder)
        study = create_study(folder / "study", files, law=self.law, rig="bench").study
        seal(study.folder, self.answer)
        return study


class HiddenRig:
    """A rig of the blind benchmark's generator, with an effect that the library does not have.

    Parameters
    ----------
    seed : of the cases
    number : of the case among them, at 15 or 40 % and with 1 % noise
    """

    def __init__(self, seed: int, number: int) -> None:
        tasks = make_plan(seed, 3 * (number + 1) + 12, "outside")
        self.task = [one for one in tasks if one.noise == 0.01 and one.strength > 0.05][number]
        self._made = cases.make(self.task)
        rig = self._made.specimen.rig
        self.limits = replace(
            LIMITS, stroke=IN_USE * rig.stroke, speed=rig.speed, acceleration=np.inf
        )
        self._rig = rig

    def sheet(self, path: Path) -> Path:
        """Write the data sheet of the rig as a rig.toml; return its path."""
        limits = self.limits
        path.write_text(
            f"""schema = 1
[damper]
law = "{self.task.law}"
max_force = "{self._rig.force:.2g} N"
[limits]
stroke = "{limits.stroke:.6g} m"
speed = "{limits.speed:.6g} m/s"
command = ["0 V", "8 V"]
band = ["0.3 Hz", "8 Hz"]
""",
            encoding="utf-8",
        )
        return path

    def performed(self, runs: Sequence[PlannedRun]) -> list[Signals]:
        """Return what the rig's instruments show of runs."""
        out = []
        for k, run in enumerate(runs):
            given = (run.signals["displacement"], run.signals["voltage"])
            one = proposed(self._rig, given, run.role, {})
            out.append(_signals(self._made.perform(one, self.task.seed + k, run.name)))
        return out

    def own(self) -> dict[str, Signals]:
        """Return the runs that the generator makes of the rig by itself."""
        return {run["name"]: _signals(run) for run in self._made.runs}

    def study(self, runs: Sequence[PlannedRun], folder: Path) -> Study:
        """Return a study of runs on the rig."""
        files = _written(runs, self.performed(runs), folder)
        return create_study(folder / "study", files, law=self.task.law, rig="bench").study


def _signals(run: dict[str, Any]) -> Signals:
    return {name: values for name, values in run.items() if name not in ("name", "role")}


def _written(runs: Sequence[PlannedRun], shown: Sequence[Signals], folder: Path) -> list[Path]:
    """Write recorded runs as files whose names have their roles; return the files."""
    folder.mkdir(parents=True)
    files = []
    for run, one in zip(runs, shown, strict=True):
        role = "holdout" if run.role == "holdout" else "train"
        files.append(folder / f"{role}_{run.name}.csv")
        write_csv(files[-1], one)
    return files


def _runs(tests: Sequence[Test], name: str, limits: RigLimits) -> list[PlannedRun]:
    out = []
    for k, test in enumerate(tests):
        one = test.signals(limits)
        signals = {"displacement": one.x, "voltage": one.V}
        role = "holdout" if k % 2 else "train"
        out.append(PlannedRun(f"{name}_{k + 1}", role, "", one.time, signals))
    return out


def chirps(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return the paper's chirp under a sine of the command, four times."""
    rng = np.random.default_rng([seed, 1])
    return _runs(
        [
            Test(Waveform("sweep", 0.4, float(rng.uniform(4.0, 6.0))),
                 Command("sine", 0.0, 5.0, float(rng.uniform(0.7, 2.0))))
            for _ in range(4)
        ], "chirp", limits,
    )  # fmt: skip


def random_runs(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return seven random runs under random steps of the command."""
    return _runs(
        [
            Test(Waveform("multisine", 0.5, 5.0, 10 * seed + k),
                 Command("random", 0.0, 8.0, 0.7, k), seconds=48.0 / 7.0)
            for k in range(7)
        ], "random", limits,
    )  # fmt: skip


def sines(seed: int, limits: RigLimits = LIMITS) -> list[PlannedRun]:
    """Return sines at three amplitudes and four levels of the command."""
    rng = np.random.default_rng([seed, 3])
    f = float(rng.uniform(1.0, 2.0))
    return _runs(
        [
            Test(Waveform("sine", 0.3, f), Command("held", 0.0, level), share, 4.0)
            for share in (1.0, 0.5, 0.25)
            for level in (0.0, 8.0 / 3.0, 16.0 / 3.0, 8.0)
        ], "sine", limits,
    )  # fmt: skip


def few_sines(seed: int) -> list[PlannedRun]:
    """Return eight sines of 4 s: four to fit to and four to judge by, at two levels."""
    rng = np.random.default_rng([seed, 4])
    f, low, high = float(rng.uniform(1.0, 2.0)), *sorted(rng.uniform(0.0, 8.0, 2).tolist())
    tests = [
        Test(Waveform("sine", 0.3, f), Command("held", 0.0, level), share, 4.0)
        for level in (low, high)
        for share in (0.9, 0.8, 0.45, 0.4)
    ]
    return _runs(tests, "sine", LIMITS)


ORDINARY = {"chirp": chirps, "random": random_runs, "sines": sines}
"""Ordinary campaigns of 48 s by name."""
