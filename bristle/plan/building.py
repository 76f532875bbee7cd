"""The next tests of a building on a shaking table: ground motions, commands, sensors to add."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..bridge.in_building import House
from ..data.measurement import Measurement
from ..diagnose.equilibrium import BuildingRuns
from ..diagnose.opening import Opening, median_noise
from ..errors import RecordError, StudyError
from ..identify.structure import StructureProblem
from ..physics.building import frequencies
from ..physics.drive import DRIVES
from ..progress import tell
from ..quantity import plain, quantity
from ..study.identification import as_model
from ..study.rig import building_of
from ..study.study import Study
from .added_sensors import Added, added_sensors
from .building_sites import SiteWish, default_wishes, largest_motion, purposes_at
from .folder import PlannedRun
from .goal import Measured, Stated, stated
from .ground import displacement_of, records_at_hand, scalable
from .knowledge import Known
from .motions import Waveform
from .outcome import Outcome, outcomes
from .plan import Plan, Wish
from .planned_test import Signals, Test
from .purposes import cost_of
from .rig_limits import RESERVE, SLOWEST, RigLimits, with_given
from .search import LEAST, Goal, Planner, Seen
from .shaking_table import Columns, ShakingTable

Array = NDArray[np.float64]

CANDIDATES, IMPROVED = 64, 10
"""Tests that are looked at, and evaluations in which a picked one is improved: each is a run of the
building, simulated and smoothed."""

DRAWS = 4
"""Draws of the smoother's error that planned runs are judged with."""

LONGEST = 30.0
"""Longest test [s] where nobody says."""

TRIES, GENTLE, STEEP = 6, 0.97, 0.3
"""How often a motion beyond a limit is made smaller, how far below that limit, at the most by."""

RECORDS = 0.5
"""Share of the tests that are looked at with a recorded ground motion."""


@dataclass(frozen=True)
class BuildingPlan(Plan):
    """The next tests of a building.

    Attributes
    ----------
    predicted : tuple of (n,) arrays
        The displacement of the first level [m] in each test, simulated with the study's model.
    sensors : tuple of Added
        What sensors that the study lacks would show besides, the most useful one first.
    """

    predicted: tuple[Array, ...] = field(default=(), repr=False)
    sensors: tuple[Added, ...] = ()
    rig: ClassVar[str] = "structure"

    def runs(self) -> list[PlannedRun]:
        """Return the runs as a plan's folder holds them."""
        drive = DRIVES.get(self.drive)
        out = []
        for k, (test, one) in enumerate(zip(self.tests, self.signals, strict=True)):
            channels = {"ground_acceleration": one.a}
            about = _words(test.motion, one)
            if drive is not None:
                channels[drive.name] = one.V
                about += f", {test.command.words(drive.name, drive.unit)}"
            moved = quantity(float(np.max(np.abs(self.predicted[k]))), "m")
            about += f"; its first level moves by {moved}"
            role = "holdout" if k % 2 else "train"
            out.append(PlannedRun(f"plan_{k + 1}", role, about, one.time, channels))
        return out

    def sentences(self) -> list[str]:
        """Return the plan as an engineer would say it."""
        return [*super().sentences(), *(one.sentence() for one in self.sensors)]

    def files(self) -> dict[str, str | bytes]:
        """Return the further files of the plan's folder by name."""
        from .building_picture import building_files

        return building_files(self)

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {**super().as_dict(), "sensors": [one.as_dict() for one in self.sensors]}


def _words(motion: Waveform, signals: Signals) -> str:
    """Return a ground motion in words, a recorded one with its scale."""
    peak = quantity(float(np.max(np.abs(signals.a))), "m/s2")
    if motion.kind != "record":
        return motion.words(peak)
    factor = float(np.max(np.abs(signals.x)) / np.max(np.abs(motion.record)))
    return f"{motion.name} times {plain(factor, 2)}, {peak}"


@dataclass(frozen=True)
class TablePlanner(Planner):
    """Finds the tests of a building on its table; `places` has the site of each question.

    `table` simulates them; `show` returns the sites of runs that were not measured yet; `records`
    are motions that may be scaled.
    """

    table: ShakingTable | None = None
    show: Callable[[list[Measurement]], dict[str, StructureProblem]] | None = None
    places: tuple[str, ...] = ()
    records: tuple[Waveform, ...] = ()
    nothing_kept: ClassVar[str] = (
        "no ground motion stays within the limits and moves the building: a larger stroke, speed "
        "or acceleration of the table, or a larger stroke of the damper or drift, is needed."
    )

    def response(self, test: Test) -> tuple[Signals, Columns]:
        """Return what a test prescribes, and every output of the simulation."""
        assert self.table is not None
        signals = test.signals(self.limits, self.rate)
        columns = self.table.response(signals)
        assert columns is not None
        return signals, columns

    def _look(self, test: Test) -> Seen | None:
        assert self.table is not None
        for _ in range(TRIES):
            signals = test.signals(self.limits, self.rate)
            columns = self.table.response(signals) if test.share >= LEAST**2 else None
            if columns is None:
                return None
            most = self.table.excess(columns, self.limits)
            if most <= 1.0:
                return self._judged(test, signals, columns)
            test = test.smaller(max(STEEP, GENTLE / most))
        return None

    def _judged(self, test: Test, signals: Signals, columns: Columns) -> Seen | None:
        """Return a test that keeps the limits as it would be seen, None where nothing moves."""
        assert self.table is not None
        assert self.show is not None
        try:
            found = self.show([self.table.measured(signals, columns)])
        except RecordError:  # the base does not move
            return None
        normals, samples = [], []
        for site, asked in zip(self.places, self.goal.asked, strict=True):
            runs = found[site].runs if site in found else []
            normals.append(asked.of(runs, DRAWS))
            samples.append(sum(len(run.x) - run.skip for run in runs))
        return Seen(test, signals, tuple(normals), tuple(samples))

    def _motion(self, which: float, at: float, seed: int) -> Waveform:
        """Return a motion by two numbers between 0 and 1: a record, or its kind and frequency."""
        if not self.records or which >= RECORDS:
            low = RECORDS if self.records else 0.0
            return super()._motion((which - low) / (1.0 - low), at, seed)
        count = len(self.records)
        return self.records[min(int(which / RECORDS * count), count - 1)]


def plan_building(
    study: Study,
    wish: Wish | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    records: Sequence[str] = (),
    seed: int = 1,
) -> BuildingPlan:
    """Return the next tests of a study of a building on a shaking table.

    Parameters
    ----------
    study : Study
    wish : what they shall be for; None for what the verdict leaves open, or else all
    limits : of table and building, as arguments of `RigLimits`; what is not given is what the runs
        have done
    records : further ground motions that may be scaled: names, or files
    seed : of what is drawn

    Raises
    ------
    StudyError
        If the limits allow no test, or a purpose names what there is not.
    RecordError
        If a file cannot be read.
    """
    study.usable_effects()
    model, runs = study.model(), study.runs()
    building = building_of(study, model)
    assert building is not None
    house = House(building, study.folder / model.building if model.building else None)
    measured = [*runs.train, *runs.holdout]
    found = BuildingRuns(runs.train, runs.holdout, as_model(model), building, tell)
    sites = _opened(study, found)
    own = limits_of_shaking(measured, sites, house)
    rig = with_given(own, limits or {})
    if rig.rate != own.rate:
        raise StudyError(
            f"rate = {rig.rate:g} Hz: the runs of {study.name} have {own.rate:g} samples per "
            "second, and so have planned ones."
        )
    waveforms = [
        scalable(one, rig.rate, rig.duration, rig.usable_band[0])
        for one in records_at_hand(measured, records, Path.cwd())
    ]
    given = wish is not None and not wish.nothing
    wishes = [SiteWish(wish)] if given and wish else default_wishes(study.verdict() or {})
    purposes = purposes_at(sites, wishes, rig, study.drive)
    stand = {site: _stated(one, sites[site], seed) for site, one in purposes.items()}
    tell("looking at ground motions")
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bristle_plan_")))
        table = ShakingTable(
            model, house, runs.train[0], median_noise(measured), rig.command[1], folder
        )
        planner = TablePlanner(
            _joint(stand), rig, 0.0, np.zeros((0, 0, 4)), rig.rate, None, seed, study.drive,
            CANDIDATES, IMPROVED, table=table, show=lambda few: found.planned(few, DRAWS),
            places=tuple(site for site, one in stand.items() for _ in one.goal.asked),
            records=tuple(waveforms),
        )  # fmt: skip
        return _planned(study, stand, planner)


def _opened(study: Study, found: BuildingRuns) -> dict[str, Opening]:
    """Return the models of the sites, fitted."""
    sites = {}
    for site in found.sites():
        tell(f"fitting {site}")
        opened = found.open_site(site)
        if opened is not None and opened.held_out.runs:
            sites[site] = opened
    if not sites:
        raise StudyError(f"{study.folder}: no site of this building has runs that are held out.")
    return sites


def _stated(purposes: Any, opened: Opening, seed: int) -> Stated:
    measured = Measured(opened.problem.runs, opened.held_out.runs)
    return stated(purposes, opened.searched, measured, max(opened.before.z, 1.0), seed)


def _joint(stand: Mapping[str, Stated]) -> Goal:
    """Return the goal of all sites together: the mean of their costs."""
    asked = tuple(a for one in stand.values() for a in one.goal.asked)
    known = tuple(k for one in stand.values() for k in one.goal.known)

    def cost(found: Sequence[Known]) -> float:
        total, first = [], 0
        for one in stand.values():
            count = len(one.goal.asked)
            total.append(one.goal.cost(found[first : first + count]))
            first += count
        return float(np.mean(total))

    return Goal(asked, known, cost)


def _planned(study: Study, stand: Mapping[str, Stated], planner: TablePlanner) -> BuildingPlan:
    """Return the plan that serves the goals of the sites, and what sensors would add to it."""
    goal = planner.goal
    tests = planner.plan()
    after = goal.with_tests(tests)
    then, rows, gains, first = {}, [], [], 0
    for site, one in stand.items():
        then[site] = after[first : first + one.count]
        first += len(one.goal.asked)
        gains.append(
            cost_of(one.purposes.figures(one.known)) - cost_of(one.purposes.figures(then[site]))
        )
        rows += at_site(site, outcomes(one.purposes, one.asked, one.known, then[site]))
    shown = [planner.response(one.test) for one in tests]
    tell("looking at sensors")
    assert planner.table is not None
    assert planner.show is not None
    sensors = added_sensors(planner.table, planner.show, stand, shown, then, rows)
    level = planner.table.levels[0]
    return BuildingPlan(
        study.name, tuple(one.test for one in tests),
        tuple(one.test.signals(planner.limits) for one in tests), tuple(rows), planner.limits,
        study.drive, float(np.exp(np.mean(gains))),
        tuple(columns[f"structure.{level}_displacement"] for _, columns in shown), tuple(sensors),
    )  # fmt: skip


def at_site(site: str, rows: Sequence[Outcome]) -> list[Outcome]:
    """Return outcomes whose names say at which site they are."""
    return [replace(one, name=f"{site}: {one.name}") for one in rows]


def limits_of_shaking(
    runs: Sequence[Measurement], sites: Mapping[str, Opening], house: House
) -> RigLimits:
    """Return what table, building and amplifier have done already.

    Parameters
    ----------
    runs : that were measured
    sites : of the building, with their runs
    house : the building
    """
    tones = frequencies(house.building)
    low = max(SLOWEST, 0.3 * tones[0])
    grounds = [(run["ground_acceleration"], run.step) for run in runs]
    x = [displacement_of(one, step, low) for one, step in grounds]
    v = [np.gradient(one, step) for one, (_, step) in zip(x, grounds, strict=True)]
    reached = {
        site: largest_motion([*one.problem.runs, *one.held_out.runs])[0] / RESERVE
        for site, one in sites.items()
    }
    drifts = [most for site, most in reached.items() if site.startswith("storey")]
    strokes = [most for site, most in reached.items() if not site.startswith("storey")]
    commands = [run[run.drive] for run in runs if run.drive]
    command = (0.0, 0.0)
    if commands:
        least = min(float(np.quantile(one, 0.001)) for one in commands)
        most = max(float(np.quantile(one, 0.999)) for one in commands)
        command = (max(0.0, least) if least > -0.02 * most else least, most)
    return RigLimits(
        max(float(np.max(np.abs(one))) for one in x) / RESERVE,
        max(float(np.max(np.abs(one))) for one in v) / RESERVE,
        max(float(np.quantile(np.abs(one), 0.999)) for one, _ in grounds) / RESERVE,
        band=(low, max(1.3 * tones[-1], 2.0 * low)), command=command,
        duration=min(LONGEST, max(run.duration for run in runs)), rate=1.0 / runs[0].step,
        motions=("sweep", "multisine"), commands=("held", "switched", "random"),
        damper_stroke=max(strokes, default=np.inf), drift=max(drifts, default=np.inf),
    )  # fmt: skip
