"""Faults of the sensors at a building's damper, as those of a bench are told.

The levels at the damper's ends are looked at one by one, the damper's force against the motion
across it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data.measurement import Measurement
from ..physics.building import Building
from ..physics.device import GROUND
from .corrected import corrected
from .faults import SensorFault
from .sensors import sensor_faults

BLURRED = ("lag", "high-pass", "delay", "derived")
"""Faults for which a building's velocity is left out: displacement and accelerometer say the same
without them, and what is left of a delay would be held against the law at each reversal."""

_MOTION = ("displacement", "velocity")


def faults_in_building(runs: Sequence[Measurement], building: Building) -> list[SensorFault]:
    """Return the faults that the channels at a building's damper show of each other.

    Parameters
    ----------
    runs : of the building, the damper's channels called `force` and `voltage`
    building : which knows where its damper is

    Returns
    -------
    list of SensorFault
        Of the one level of a damper on the ground by the names of a bench, `displacement` and
        `velocity`; of two levels by theirs.
    """
    ends = _ends(building)
    if len(ends) == 1:
        return sensor_faults([_as_bench(run, ends[0]) for run in runs])
    found = [
        replace(
            fault,
            channel=f"{end}_{fault.channel}",
            either=fault.either and f"{end}_{fault.either}",
            words=f"{end}: {fault.words}",
        )
        for end in ends
        for fault in sensor_faults([_as_bench(run, end, force=False) for run in runs])
    ]
    across = sensor_faults([_across(run, *ends) for run in runs])
    return [*found, *(fault for fault in across if fault.channel == "force")]


def without_faults(
    runs: Sequence[Measurement], faults: Sequence[SensorFault], building: Building
) -> list[Measurement]:
    """Return measurements without the faults of the damper's channels.

    Of velocities that are late or rounded the displacement says the same.

    Parameters
    ----------
    runs : of the building
    faults : as `faults_in_building` found them
    building : which knows where its damper is
    """
    end = _ends(building)[0]
    names = {what: f"{end}_{what}" for what in _MOTION}
    theirs = [replace(f, channel=names.get(f.channel, f.channel)) for f in faults]
    late = {f.channel for f in theirs if _blurs(f)}
    out = corrected(runs, [f for f in theirs if not _blurs(f)])
    if not late:
        return out
    return [
        replace(one, channels={n: v for n, v in one.channels.items() if n not in late})
        for one in out
    ]


def blurred(faults: Sequence[SensorFault]) -> bool:
    """Return whether a velocity at the damper is left out."""
    return any(map(_blurs, faults))


def moves_measured(runs: Sequence[Measurement], building: Building) -> bool:
    """Return whether the velocity of each end of the damper was measured, in every run."""
    return all(run.has(f"{end}_velocity") for run in runs for end in _ends(building))


def _blurs(fault: SensorFault) -> bool:
    return fault.channel.endswith("velocity") and fault.fault in BLURRED


def _ends(building: Building) -> list[str]:
    """Return the levels that the damper acts on, the upper one first."""
    lower, upper = building.device(building.studied).levels
    return [building.levels()[i] for i in (upper, lower) if i != GROUND]


def _as_bench(run: Measurement, level: str, force: bool = True) -> Measurement:
    """Return a measurement whose channels of a level are named as those of a bench."""
    names = {f"{level}_{what}": what for what in _MOTION}
    keep = {k: v for k, v in run.channels.items() if k in names or (k == "force" and force)}
    channels = {names.get(k, k): v for k, v in keep.items()}
    noise = {names.get(k, k): v for k, v in run.noise.items() if k in keep}
    return replace(run, channels=channels, noise=noise)


def _across(run: Measurement, upper: str, lower: str) -> Measurement:
    """Return the motion between two levels and the force, named as those of a bench."""
    ends = [_as_bench(run, level) for level in (upper, lower)]
    channels = {k: v for k, v in ends[0].channels.items() if k == "force"}
    noise = {k: v for k, v in ends[0].noise.items() if k == "force"}
    for what in _MOTION:
        if all(end.has(what) for end in ends):
            channels[what] = ends[0][what] - ends[1][what]
            noise[what] = sum(end.noise.get(what, 0.0) ** 2 for end in ends) ** 0.5
    return replace(run, channels=channels, noise=noise)
