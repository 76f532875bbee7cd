"""The next tests of a building on a shaking table: ground motions and commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..core.arrays import Array
from ..core.progress import tell
from ..core.text import plain, quantity
from ..data.measurement import Measurement
from ..diagnosis.decision import refuse_unknown_noise
from ..diagnosis.prepared import Prepared, median_noise, refuse_lacking
from ..diagnosis.rig_runs import BuildingRuns
from ..errors import StudyError
from ..identification.rig import DAMPER
from ..identification.smoothing import smooth_steps
from ..physics.building import Building, frequencies
from ..physics.drive import DRIVES
from ..prediction.model_system import BuildingWithFile
from ..study.rig import building_of
from ..study.study import Study
from .folder import PlannedRun
from .information import DRAWS, Goal, Information
from .limits import RESERVE, SLOWEST, ZERO, PrescribedSignals, RigLimits, with_given
from .plan import Outcome, Plan, outcomes, searched
from .questions import (
    PlanRequest,
    RunsAtHand,
    Stated,
    largest_motion,
    notes_of_error,
    of_one_force,
    purposes_at,
    requests_of,
    stated,
)
from .shaking_table import ShakingTable, TablePlanner
from .waveforms import Waveform, displacement_of, records_at_hand, scalable

if TYPE_CHECKING:
    from ..view.style import Page

# A plan of a building: ground motions with commands.


ONE_FORCE = "distance, if they have exactly the forms of the model"
"""The figure of rivals that add up to one force while the damper's is not measured."""


@dataclass(frozen=True)
class BuildingPlan(Plan):
    """The next tests of a building.

    Attributes
    ----------
    predicted : tuple of (n,) arrays
        The displacement of the first level [m] in each test, simulated with the study's model.
    level : str
        The first level.
    """

    predicted: tuple[Array, ...] = field(default=(), repr=False)
    level: str = "base"
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
            about += f"; {place_of(self.level)} moves by {moved}"
            out.append(PlannedRun(self.name(k), self.roles[k], about, one.time, channels))
        return out

    def _why(self, one: Outcome) -> str:
        if one.what == ONE_FORCE:
            return (
                "they add up to one force while the damper's is not measured: no motion tells them "
                "apart, a load cell at the damper does."
            )
        return super()._why(one)

    def _demand(self) -> str:
        units = zip(self._peaks(), ("m", "m/s", "m/s2"), strict=True)
        asked = [quantity(peak, unit) for peak, unit in units]
        moved = max(float(np.max(np.abs(one))) for one in self.predicted)
        return (
            f"The tests ask the table for {asked[0]} to either side, {asked[1]} and {asked[2]} at "
            f"the most, and move {place_of(self.level)} by {quantity(moved, 'm')}, as the model "
            "predicts: nine tenths of what the rig can do, or less. Each begins and ends at rest. "
            "Command the table by its acceleration, or integrate it twice: the displacement comes "
            "back to zero."
        )

    def _page(self, k: int) -> Page:
        from .pictures import draw_shaking

        run, moved = self.runs()[k], self.predicted[k]
        return draw_shaking(run, moved, self.drive, place_of(self.level))


def _words(motion: Waveform, signals: PrescribedSignals) -> str:
    """Return a ground motion in words, a recorded one with its scale."""
    peak = quantity(float(np.max(np.abs(signals.a))), "m/s2")
    if motion.kind != "record":
        return motion.words(peak)
    factor = float(np.max(np.abs(signals.x)) / np.max(np.abs(motion.record)))
    return f"{motion.name} times {plain(factor, 2)}, {peak}"


# What a shaking table and the building on it have done already: the limits of a plan.

LONGEST = 30.0
"""Longest test [s] where nobody says."""

NEARLY = 0.02
"""Share of a run for which a command is at its largest level, or its least, at the least."""

BELOW, ABOVE = 0.3, 1.3
"""Band of the table, over the first and the last natural frequency."""


def limits_of_shaking(
    runs: Sequence[Measurement], sites: Mapping[str, Prepared], house: BuildingWithFile
) -> RigLimits:
    """Return what table, building and amplifier have done already.

    Parameters
    ----------
    runs : that were measured
    sites : of the building, with their runs
    house : the building
    """
    tones = frequencies(house.building)
    low = max(SLOWEST, BELOW * tones[0])
    grounds = [(run["ground_acceleration"], run.step) for run in runs]
    x = [displacement_of(one, step, low) for one, step in grounds]
    v = [np.gradient(one, step) for one, (_, step) in zip(x, grounds, strict=True)]
    reached = {
        site: largest_motion([*one.problem.runs, *one.held_out.runs])[0] / RESERVE
        for site, one in sites.items()
    }
    drifts = [most for site, most in reached.items() if site.startswith("storey")]
    strokes = [most for site, most in reached.items() if not site.startswith("storey")]
    return RigLimits(
        max(float(np.max(np.abs(one))) for one in x) / RESERVE,
        max(float(np.max(np.abs(one))) for one in v) / RESERVE,
        max(float(np.quantile(np.abs(one), 0.999)) for one, _ in grounds) / RESERVE,
        band=(low, max(ABOVE * tones[-1], 2.0 * low)), command=_commands(runs),
        duration=min(LONGEST, max(run.duration for run in runs)), rate=1.0 / runs[0].step,
        motions=("sweep", "multisine"), commands=("held", "switched", "random"),
        damper_stroke=max(strokes, default=np.inf), drift=max(drifts, default=np.inf),
    )  # fmt: skip


def _commands(runs: Sequence[Measurement]) -> tuple[float, float]:
    """Return the least and the largest command of runs, without the noise on their record."""
    lows, highs = [0.0], [0.0]
    for run in runs:
        if run.drive:
            noise = run.noise.get(run.drive, 0.0)
            command, _ = smooth_steps(run[run.drive], noise, run.step)
            lows.append(float(np.quantile(command, NEARLY)) + noise)
            highs.append(float(np.quantile(command, 1.0 - NEARLY)) - noise)
    low, high = min(lows[1:], default=0.0), max(highs)
    return (0.0 if abs(low) < ZERO * high else low), high


CANDIDATES, IMPROVED = 64, 10
"""Tests that are looked at, and evaluations in which a picked one is improved: each is a run of the
building, simulated and smoothed."""

MANY = 12_000
"""Samples of a test from which on half as many are looked at."""

SAME_RATE = 1e-3
"""Share by which a given rate may differ from that of the runs."""

TIE = 0.01
"""Weight of how well parameters are known, where purposes leave a choice."""


def plan_building(
    study: Study,
    request: PlanRequest | None = None,
    *,
    limits: Mapping[str, Any] | None = None,
    records: Sequence[str] = (),
    seed: int = 1,
) -> BuildingPlan:
    """Return the next tests of a study of a building on a shaking table.

    Parameters
    ----------
    study : Study
    request : what they shall be for; None for what the verdict leaves open, or else all
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
    _refuse_devices(building)
    measured = [*runs.train, *runs.holdout]
    motions = records_at_hand(measured, records, Path.cwd())
    house = BuildingWithFile(building, study.folder / model.building if model.building else None)
    found = BuildingRuns(runs.train, runs.holdout, model, building)
    sites = _opened(study, found)
    rig = _within(limits_of_shaking(measured, sites, house), limits or {})
    purposes = purposes_at(sites, requests_of(request, study), rig, study.drive)
    stand = {site: _stated(one, sites[site], seed) for site, one in purposes.items()}
    tell("looking at ground motions")
    table = ShakingTable(model, house, runs.train[0], median_noise(measured), rig.command[1])
    planner = TablePlanner(
        _joint(stand), rig, 0.0, np.zeros((0, 0, 4)), rig.rate, seed=seed, drive=study.drive,
        candidates=CANDIDATES // (1 if rig.rate * rig.duration < MANY else 2),
        improved=IMPROVED, table=table, show=lambda few: found.planned(few, DRAWS),
        places=tuple(site for site, one in stand.items() for _ in one.goal.asked),
        records=tuple(
            scalable(one, rig.rate, rig.duration, rig.usable_band[0]) for one in motions
        ),
    )  # fmt: skip
    made = _planned(study, stand, planner)
    return replace(made, notes=notes_of_error(study, sites))


def _within(done: RigLimits, given: Mapping[str, Any]) -> RigLimits:
    """Return what table and building have done, with what is given in its place.

    Raises
    ------
    StudyError
        If they allow no test, or ask for another rate than that of the runs.
    """
    rig = with_given(done, given)
    if abs(rig.rate / done.rate - 1.0) > SAME_RATE:
        raise StudyError(
            f"rate = {rig.rate:g} Hz: the runs of this study have {done.rate:g} samples per "
            "second, and so have planned ones."
        )
    return replace(rig, rate=done.rate)


def _refuse_devices(building: Building) -> None:
    """Refuse dampers that a plan does not know: several, and one that is not on the first level.

    The limits of a plan are the stroke of a damper that moves with the first level, and drifts; the
    force of other devices under another ground motion is told by no model here.
    """
    device = building.device(building.studied)
    others = [one.name for one in building.devices if one.name != building.studied]
    if others or not device.on_first:
        where = device.place(building.levels())
        what = f"beside {', '.join(others)}" if others else f"for {device.name} ({where})"
        raise StudyError(
            f"building {building.name!r}: no test can be planned {what}. A plan is for a building "
            "with one damper, between the ground and the first level."
        )


def _opened(study: Study, found: BuildingRuns) -> dict[str, Prepared]:
    """Return the models of the sites, fitted."""
    refuse_lacking(study.folder, found.lacking)
    sites = {}
    for site in found.sites():
        tell(f"fitting {site}")
        opened = found.prepare(site)
        if opened.held_out.runs:
            sites[site] = opened
    for opened in sites.values():
        refuse_unknown_noise(study.folder, opened.held_out)
    if not sites:
        raise StudyError(f"{study.folder}: no site of this building has runs that are held out.")
    if DAMPER not in sites:
        raise StudyError(
            f"{study.folder}: neither a command nor the damper's force was measured; without its "
            "damper no response of the building can be predicted."
        )
    return sites


def _stated(purposes: Any, opened: Prepared, seed: int) -> Stated:
    measured = RunsAtHand(opened.problem.runs, opened.held_out.runs)
    return stated(purposes, opened.searched, measured, max(opened.before.z, 1.0), seed)


def _joint(stand: Mapping[str, Stated]) -> Goal:
    """Return the goal of all sites together: the mean of their costs."""
    asked = tuple(a for one in stand.values() for a in one.goal.asked)
    known = tuple(k for one in stand.values() for k in one.goal.known)

    def cost(found: Sequence[Information]) -> float:
        total, first = [], 0
        for one in stand.values():
            count = len(one.goal.asked)
            total.append(one.goal.cost(found[first : first + count]))
            first += count
        spread = [np.log([*one.deviations().values()]).mean() for one in found if one.deviations()]
        return float(np.mean(total) + TIE * np.mean(spread or [0.0]))

    return Goal(asked, known, len(asked), cost, any(one.goal.judged for one in stand.values()))


def _planned(study: Study, stand: Mapping[str, Stated], planner: TablePlanner) -> BuildingPlan:
    """Return the plan that serves the goals of the sites."""
    tests, rows, gain = searched(stand, planner, lambda then: _rows(stand, then))
    shown = [planner.response(one) for one in tests]
    level = planner.table.levels[0]
    return BuildingPlan(
        study.name, tuple(one.test for one in tests),
        tuple(one.test.signals(planner.limits) for one in tests), tuple(rows), planner.limits,
        study.drive, gain, tuple(one.role for one in tests),
        predicted=tuple(one.columns[f"structure.{level}_displacement"] for one in shown),
        level=level,
    )  # fmt: skip


def _rows(stand: Mapping[str, Stated], then: Mapping[str, Sequence[Information]]) -> list[Outcome]:
    """Return what tests will show, site by site."""
    rows = []
    for site, one in stand.items():
        rows += at_site(site, outcomes(one.purposes, one.asked, one.known, then[site]))
    alike = {f"{DAMPER}: {pair}" for pair in of_one_force(stand)}
    # Rivals that no motion tells apart.
    return [
        replace(one, what=ONE_FORCE, settled=False) if one.name in alike else one for one in rows
    ]


def at_site(site: str, rows: Sequence[Outcome]) -> list[Outcome]:
    """Return outcomes whose names say at which site they are."""
    return [replace(one, name=f"{site}: {one.name}") for one in rows]


def place_of(level: str) -> str:
    """Return a level of a building in words."""
    return "the base" if level == "base" else f"floor {level.removeprefix('floor')}"
