"""Sensors that a study of a building lacks: what they would show of the planned tests.

A test is simulated with one channel more, smoothed and parted into sites as a measured run is. With
the damper's force, layer and damper are two sites where they were one: `measured_force` has that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any

from ..comparison.names import site_name
from ..data.measurement import Measurement
from ..diagnosis.rule import BENCH
from ..identification.building_sites import StructureProblem
from ..identification.rig import DAMPER
from .information import Information, of_roles
from .outcome import Outcome, along
from .questions import Purposes, Stated
from .shaking_table import FORCE, ShakingTable, SimulatedTest
from .site_questions import Key, of_one_force, with_measured_force

HELPS, SOME = 1.5, 1.15
"""Factors from which on a sensor is said to help, and from which on the best one is named."""

Sites = dict[str, StructureProblem]
Show = Callable[[list[Measurement]], Sites]


@dataclass(frozen=True)
class AddedSensors:
    """What a sensor would change most of what the tests show.

    `channel` of the sensor; `outcome` with the tests alone (`now`) and with the sensor too
    (`then`); `factor` by which it helps; `settles` whether a verdict can tell with it, and cannot
    without.
    """

    channel: str
    outcome: Outcome
    factor: float
    settles: bool

    def sentence(self) -> str:
        """Return what the sensor would show, as an engineer would say it."""
        one = self.outcome
        site, _, name = one.name.partition(": ")
        where = f"{name} at {site_name(site)}"
        now, then = (one.shown(value) for value in (one.now, one.then))
        change = f"from {now} to {then}" if isfinite(one.now) else f"to {then}"
        if self.settles:
            needed = f"{BENCH.separating_sigma:g}"
            does = f"settle {name}: with it they are {then} apart; a verdict needs {needed}"
        elif one.purpose == "separate":
            does = f"raise the distance of {where} {change}"
        elif one.purpose == "see":
            place = f" in place of {now}" if isfinite(one.now) else ""
            does = f"lower the smallest visible {where}: {one.what} {then}{place}"
        else:
            does = f"lower the {one.what} of {where} {change}"
        much = "" if self.settles or self.factor >= HELPS else ", and no other sensor does more"
        return f"{_named(self.channel)} would {does}{much}."

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "channel": self.channel, "settles": self.settles,
            "factor": self.factor if isfinite(self.factor) else None,
            "outcome": self.outcome.as_dict(), "sentence": self.sentence(),
        }  # fmt: skip


def _named(channel: str) -> str:
    """Return a channel as it is bought: with its place."""
    if channel == FORCE:
        return "A load cell at the damper"
    level, _, kind = channel.partition("_")
    place = place_of(level)
    if kind == "acceleration_absolute":
        return f"An accelerometer on {place}"
    return f"A {kind} of {place}"


def place_of(level: str) -> str:
    """Return a level of a building in words."""
    return "the base" if level == "base" else f"floor {level.removeprefix('floor')}"


def added_sensors(
    table: ShakingTable,
    show: Show,
    stand: Mapping[str, Stated],
    tests: Sequence[SimulatedTest],
    then: Mapping[str, Sequence[Information]],
    rows: Sequence[Outcome],
) -> list[AddedSensors]:
    """Return what sensors that the study lacks would add, the most useful one first.

    Those that help by `HELPS` or more; of others the best one alone.

    Parameters
    ----------
    table : simulates the tests
    show : returns the sites of runs that were not measured yet
    stand : the purposes of each site, with what the runs at hand say
    tests : the tests, simulated
    then : what the runs at hand and the tests say of each site
    rows : the outcomes of the tests
    """
    without = {site: one.purposes.figures(then[site]) for site, one in stand.items()}
    plain_values = {
        (site, one.purpose, one.name): one.value for site, own in without.items() for one in own
    } | {(DAMPER, "separate", pair): inf for pair in of_one_force(stand)}
    out = []
    for channel in table.lacking():
        sites = [show([table.measured(one.signals, one.columns, (channel,))]) for one in tests]
        roles = [one.held_out for one in tests]
        values = _values(stand, sites, roles)
        if channel == FORCE and DAMPER in stand:
            values |= with_measured_force(stand[DAMPER], sites, roles)
        helps = {
            key: plain_values[key] / value
            for key, value in values.items()
            if 0.0 < value < inf and plain_values.get(key, 0.0) > value
        }
        if helps:
            out.append(_told(channel, helps, values, stand, rows))
    out.sort(key=lambda one: (not one.settles, -one.factor))
    helping = [one for one in out if one.settles or one.factor >= HELPS]
    return helping or [one for one in out[:1] if one.factor >= SOME]


def _values(
    stand: Mapping[str, Stated], sites: Sequence[Sites], roles: Sequence[bool]
) -> dict[Key, float]:
    """Return the figures with a sensor, smaller ones being better, of sites that stay the same."""
    out: dict[Key, float] = {}
    for site, one in stand.items():
        if not all(_same(site, found, one) for found in sites):
            continue
        known = []
        for asked, now in zip(one.asked, one.known, strict=True):
            told = [asked.evidence(found[site].runs) for found in sites]
            known.append(now.with_runs(of_roles(told, roles)))
        out |= {(site, f.purpose, f.name): f.value for f in one.purposes.figures(known)}
    return out


def _same(site: str, found: Sites, one: Stated) -> bool:
    """Return whether a site's force is had as before: measured, or from equilibrium."""
    before = one.asked[0].problem
    assert isinstance(before, StructureProblem)
    return site in found and found[site].reconstructed == before.reconstructed


def _told(
    channel: str,
    helps: Mapping[Key, float],
    values: Mapping[Key, float],
    stand: Mapping[str, Stated],
    rows: Sequence[Outcome],
) -> AddedSensors:
    """Return what a sensor helps with most: what it settles, or else its largest factor."""
    settled = [
        key
        for key in helps
        if key[1] == "separate" and values[key] <= 1.0 < values[key] * helps[key]
    ]
    best = max(settled or helps, key=lambda key: helps[key])
    site, purpose, name = best
    row = next(
        one
        for one in rows
        if one.purpose == purpose
        and one.name in (f"{site}: {name}", f"{site}: {along(name, stand[site].purposes.drive)}")
    )
    factor = helps[best]
    if purpose == "see":
        row = _visible(row, stand[site].purposes, name, (factor * values[best], values[best]))
    elif purpose == "separate":
        needed = BENCH.separating_sigma
        row = replace(row, now=needed / (factor * values[best]), then=needed / values[best])
    else:
        row = replace(row, now=row.then, then=row.then / factor)
    return AddedSensors(channel, row, factor, bool(settled))


def _visible(row: Outcome, purposes: Purposes, name: str, sizes: tuple[float, float]) -> Outcome:
    """Return an outcome with the sizes from which an effect is named, without and with a sensor."""
    one = next(one for one in purposes.effects if one.sized.name == name)
    now, then = (
        one.sized.value(max(one.size * size, one.least)) if size < inf else inf for size in sizes
    )
    return replace(row, what=one.sized.parameter, now=now, then=then)
