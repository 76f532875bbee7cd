"""The next tests of a building on a shaking table: ground motions, commands, sensors to add."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..bridge.in_building import House
from ..compare.names import site_name
from ..diagnose.by_gains import refuse_unknown_noise
from ..diagnose.equilibrium import BuildingRuns
from ..diagnose.opening import Opening, median_noise
from ..errors import StudyError
from ..identify.rig import DAMPER
from ..physics.building import Building
from ..physics.effect import plain_name
from ..progress import tell
from ..study.identification import as_model
from ..study.rig import building_of
from ..study.study import Study
from .added_sensors import added_sensors
from .building_plan import ONE_FORCE, BuildingPlan
from .building_sites import SiteWish, default_wishes, purposes_at
from .goal import Measured, Stated, stated
from .ground import records_at_hand, scalable
from .knowledge import DRAWS, Known
from .measured_force import of_one_force
from .outcome import Outcome, outcomes
from .purposes import cost_of
from .rig_limits import RigLimits, with_given
from .seen import Goal
from .shaking_limits import limits_of_shaking
from .shaking_table import ShakingTable
from .table_planner import TablePlanner
from .wish import Wish, errs, note_of_missing

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
    _refuse_devices(building)
    measured = [*runs.train, *runs.holdout]
    motions = records_at_hand(measured, records, Path.cwd())
    house = House(building, study.folder / model.building if model.building else None)
    found = BuildingRuns(runs.train, runs.holdout, as_model(model), building, tell)
    sites = _opened(study, found)
    rig = _within(limits_of_shaking(measured, sites, house), limits or {})
    given = wish is not None and not wish.nothing
    wishes = [SiteWish(wish)] if given and wish else default_wishes(study.verdict() or {})
    purposes = purposes_at(sites, wishes, rig, study.drive)
    stand = {site: _stated(one, sites[site], seed) for site, one in purposes.items()}
    tell("looking at ground motions")
    with tempfile.TemporaryDirectory(prefix="bristle_plan_") as folder:
        table = ShakingTable(
            model, house, runs.train[0], median_noise(measured), rig.command[1], Path(folder)
        )
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
    return replace(made, notes=_notes(study, sites))


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


def _opened(study: Study, found: BuildingRuns) -> dict[str, Opening]:
    """Return the models of the sites, fitted."""
    found.refuse_lacking(study.folder)
    sites = {}
    for site in found.sites():
        tell(f"fitting {site}")
        opened = found.open_site(site)
        if opened is not None and opened.held_out.runs:
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


def _notes(study: Study, sites: Mapping[str, Opening]) -> tuple[str, ...]:
    """Return what weakens a plan: an error that an effect would take away first."""
    missing = note_of_missing(study, [plain_name(name) for name in study.model().effects])
    if missing:
        return missing
    loud = {site: one.before.z for site, one in sites.items() if one.before.z > one.rule.clean}
    return tuple(f"At {site_name(site)} the model {errs(z)}" for site, z in loud.items())


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
        spread = [np.log([*one.deviations().values()]).mean() for one in found if one.deviations()]
        return float(np.mean(total) + TIE * np.mean(spread or [0.0]))

    return Goal(asked, known, len(asked), cost, any(one.goal.judged for one in stand.values()))


def _planned(study: Study, stand: Mapping[str, Stated], planner: TablePlanner) -> BuildingPlan:
    """Return the plan that serves the goals of the sites, and what sensors would add to it."""
    tests = planner.plan()
    then = _by_site(stand, planner.goal.with_tests(tests))
    costs = [
        cost_of(one.purposes.figures(one.known)) - cost_of(one.purposes.figures(then[site]))
        for site, one in stand.items()
    ]
    rows = [one if one.settled else _or_beyond(one, stand, planner) for one in _rows(stand, then)]
    shown = [planner.response(one) for one in tests]
    tell("looking at sensors")
    assert planner.table is not None
    assert planner.show is not None
    sensors = added_sensors(planner.table, planner.show, stand, shown, then, rows)
    level = planner.table.levels[0]
    return BuildingPlan(
        study.name, tuple(one.test for one in tests),
        tuple(one.test.signals(planner.limits) for one in tests), tuple(rows), planner.limits,
        study.drive, float(np.exp(np.mean(costs))), tuple(one.role for one in tests),
        predicted=tuple(one.columns[f"structure.{level}_displacement"] for one in shown),
        sensors=tuple(sensors), level=level,
    )  # fmt: skip


def _by_site(stand: Mapping[str, Stated], found: Sequence[Known]) -> dict[str, list[Known]]:
    """Return what is known of the questions of each site, with the fitted parameters."""
    out, first = {}, 0
    for site, one in stand.items():
        out[site] = list(found[first : first + one.goal.count])
        first += len(one.goal.asked)
    return out


def _rows(stand: Mapping[str, Stated], then: Mapping[str, Sequence[Known]]) -> list[Outcome]:
    """Return what tests will show, site by site."""
    rows = []
    for site, one in stand.items():
        rows += at_site(site, outcomes(one.purposes, one.asked, one.known, then[site]))
    alike = {f"{DAMPER}: {pair}" for pair in of_one_force(stand)}
    return [_of_one_force(one) if one.name in alike else one for one in rows]


def _or_beyond(left: Outcome, stand: Mapping[str, Stated], planner: TablePlanner) -> Outcome:
    """Return what a plan leaves open, with whether a test of its own would settle it."""
    for one in planner.looked_at():
        told = _rows(stand, _by_site(stand, planner.goal.with_pair(one)))
        if any(other.name == left.name and other.settled for other in told):
            return left
    return replace(left, beyond=True)


def at_site(site: str, rows: Sequence[Outcome]) -> list[Outcome]:
    """Return outcomes whose names say at which site they are."""
    return [replace(one, name=f"{site}: {one.name}") for one in rows]


def _of_one_force(row: Outcome) -> Outcome:
    """Return the outcome of rivals that no motion tells apart."""
    return replace(row, what=ONE_FORCE, settled=False)
