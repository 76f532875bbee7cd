"""Looks at single channels: standing still, clipped, drifting, offset, noisy, sampled how."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding, Level
from ...core.text import plain, quantity
from ..channels import DRIVE, device_channel
from ..cut_off import clipped_ends
from ..measurement import Measurement
from ..noise import Noise, estimate_noise, is_switched, spikes_text
from .motion import velocity_of_run

_MOTIONLESS = "Check the cable and the column: is it the right one?"
_HELD = 2  # samples per value from which a channel is one that was logged more slowly
_ALL_NOISE = 0.9  # the share of a command's RMS about its mean from which it is noise alone
_COLOURS = {
    "low-passed": "it fades towards half the sampling rate: this is its level below",
    "blue": "it grows towards high frequencies, as after a numerical derivative: an upper limit",
    "resting": "the channel was low-passed: this is its RMS while at rest",
    "slow": "the channel was low-passed and never rests: its slowest stretch has motion in it, too",
    "hidden": "the channel was low-passed and never rests, so that this is a lower limit",
    "rough": "the channel changes so much from sample to sample that this is an upper limit",
    "none": "no noise is to be seen",
}


def check_channels(run: Measurement, velocity: Array | None) -> Iterator[Finding]:
    """Yield what is found in each channel of a run.

    Parameters
    ----------
    run : Measurement
    velocity : (n,) m/s, measured or derived, None where nothing moves
    """
    for note in run.notes:
        yield Finding("reading", "note", note, run=run.name)
    yield from _spikes(run)
    for channel, values in run.channels.items():
        if np.ptp(values) == 0.0:
            yield from _still(run, channel, values)
            continue
        if channel not in DRIVE:
            yield from _clipped(run, channel, values, velocity)
        yield from _noise(run, channel, values)
    yield from _extra(run)
    if "displacement" in run.channels and np.ptp(run["displacement"]) > 0.0:
        yield from _drift(run, run["displacement"], velocity)
    if "force" in run.channels and velocity is not None and np.ptp(velocity) > 0.0:
        yield from _force_offset(run, run["force"], velocity)


def _extra(run: Measurement) -> Iterator[Finding]:
    """Report extra channels that stand still or are cut off: they keep no run from use."""
    for name, one in run.extra.items():
        if np.ptp(one.values) == 0.0:
            text = f"{name} is {quantity(float(one.values[0]), one.unit, 6)} throughout."
            do = "" if one.values[0] else _MOTIONLESS
            yield Finding("still", "note", text, do, run.name, name)
            continue
        changes = np.flatnonzero(np.diff(one.values))
        if np.median(np.diff(changes, prepend=-1)) >= _HELD:
            continue  # a slow logger repeats its last value
        ends = clipped_ends(one.values, estimate_noise(one.values).quantum)
        if ends and not is_switched(one.values):
            share = sum(end[0] for end in ends)
            text = f"{name} stays at exactly {_ends_text(ends, one.unit)}: it is cut off."
            do = "An error beyond that value shows no dependence on it."
            yield Finding("clipping", "warning", text, do, run.name, name, share)


def _spikes(run: Measurement) -> Iterator[Finding]:
    for channel in dict.fromkeys(spike.channel for spike in run.spikes):
        own = tuple(spike for spike in run.spikes if spike.channel == channel)
        text = f"{spikes_text(own)}."
        do = (
            "`bristle study check FOLDER --mask` takes them for not measured. Look for a loose "
            "cable."
        )
        yield Finding("spikes", "warning", text, do, run.name, channel, float(len(own)))


def _still(run: Measurement, channel: str, values: Array) -> Iterator[Finding]:
    if channel in DRIVE:
        return  # a constant voltage is a matter of excitation
    unit, value = run.units[channel], float(values[0])
    what = "zero" if value == 0.0 else f"{plain(value, 6)} {unit}"
    level: Level = "warning" if channel in ("acceleration", "holding_force") else "error"
    yield Finding(
        "still", level, f"{channel} is {what} throughout.", _MOTIONLESS, run.name, channel
    )


def _clipped(
    run: Measurement, channel: str, values: Array, velocity: Array | None
) -> Iterator[Finding]:
    facts = run.noise_facts[channel]
    ends = clipped_ends(values, facts.quantum if facts else 0.0)
    if is_switched(values) and (_keeps_levels(channel) or not _is_at_ends(ends)):
        return
    if channel.endswith("displacement"):
        ends = [end for end in ends if _moves_at(end[1], values, velocity)]
    if not ends:
        return
    friction = channel.endswith("force") and _is_at_ends(ends)
    other = ", or a friction without noise that nothing changes" if friction else ""
    text = (
        f"{channel} stays at exactly {_ends_text(ends, run.units[channel])}: it is cut off by its "
        f"instrument or amplifier{other}."
    )
    do = "Repeat the run with a larger range, or leave it out: saturated samples are lost."
    yield Finding("clipping", "warning", text, do, run.name, channel, sum(end[0] for end in ends))


def _keeps_levels(channel: str) -> bool:
    """Return whether a channel may keep to two levels: a command, or the velocity of a triangle."""
    _, quantity = device_channel(channel) or ("", channel)
    return quantity in DRIVE or quantity.endswith("velocity")


def _is_at_ends(ends: list[tuple[float, float, int]]) -> bool:
    """Return whether a channel stands at one of two ends most of the time."""
    return len(ends) == 2 and sum(end[0] for end in ends) > 0.5


def _moves_at(level: float, values: Array, velocity: Array | None) -> bool:
    """Return whether a displacement is cut off at a level: it would move, and does not rest."""
    if velocity is None or np.ptp(velocity) == 0.0:
        return False
    flat = np.isclose(values, level, rtol=0.0, atol=1e-9 * float(np.ptp(values)))
    return float(np.median(np.abs(velocity[flat]))) >= 0.05 * float(np.abs(velocity).max())


def _ends_text(ends: list[tuple[float, float, int]], unit: str) -> str:
    """Return where a channel is cut off, at one end or both, and how much of it."""
    return " and at ".join(
        f"{quantity(level, unit, 6)} in {stretches} stretches, {plain(100.0 * share, 2)} % of the "
        "samples"
        for share, level, stretches in ends
    )


def _noise(run: Measurement, channel: str, values: Array) -> Iterator[Finding]:
    std, facts = run.noise[channel], run.noise_facts[channel]
    rms = float(np.std(values))
    if channel in DRIVE and (is_switched(values) or std > _ALL_NOISE * rms):
        return  # a command that keeps its level shows nothing else
    share = std / rms if rms else 0.0
    unit = run.units[channel]
    level = quantity(std, unit, size=rms)
    if facts is None:
        part = plain(100 * share, 2)
        text = f"noise of {channel}: {level}, as given ({part} % of its RMS)."
        yield Finding("noise", "note", text, "", run.name, channel, share)
        return
    text = f"noise of {channel}: {level}, {plain(100 * share, 2)} % of its RMS"
    if facts.quantum and facts.quantum > 2.0 * std:
        text += f"; it is written in steps of {quantity(facts.quantum, unit, size=rms)}"
    yield from _coloured(run, channel, text, facts, share)


def _coloured(
    run: Measurement, channel: str, text: str, facts: Noise, share: float
) -> Iterator[Finding]:
    if facts.colour == "white":
        yield Finding("noise", "note", f"{text}.", "", run.name, channel, share)
        return
    doubtful = facts.colour in ("slow", "hidden", "rough", "blue")
    text = f"{text}; {_COLOURS[facts.colour]}."
    do = (
        f"Give its standard deviation as noise in [channels.{channel}], from a record at rest."
        if doubtful
        else ""
    )
    level: Level = "warning" if doubtful else "note"
    yield Finding("noise", level, text, do, run.name, channel, share)


def _drift(run: Measurement, x: Array, velocity: Array | None) -> Iterator[Finding]:
    """Report a displacement whose middle wanders while it moves, or lies far from zero."""
    slope, spread = middle_drift(x, velocity) if velocity is not None else (0.0, 0.0)
    span, middle = float(np.ptp(x)), 0.5 * float(x.max() + x.min())
    if abs(slope) > max(0.2 * span, 4.0 * spread):
        text = (
            f"the middle of the displacement drifts by {plain(1e3 * slope)} mm over the run, of "
            f"{plain(1e3 * span)} mm in all."
        )
        do = "Let the instrument warm up, or say in notes that the motion itself is so."
        yield Finding("drift", "warning", text, do, run.name, "displacement", abs(slope) / span)
    if abs(middle) > 0.25 * span:
        text = (
            f"displacement runs from {plain(1e3 * float(x.min()), 4)} to "
            f"{plain(1e3 * float(x.max()), 4)} mm: "
            "its zero is not the middle of the motion."
        )
        do = "Such data show effects of position only up to that zero."
        yield Finding("zero", "note", text, do, run.name, "displacement", abs(middle) / span)


def _force_offset(run: Measurement, force: Array, velocity: Array) -> Iterator[Finding]:
    """Report a force that differs between the two directions at equal speed."""
    drive = next((run[one] for one in DRIVE if one in run.channels), None)
    offset, spread = force_offset(force, velocity, drive)
    rms = float(np.std(force))
    if rms == 0.0 or abs(offset) < max(0.03 * rms, 4.0 * spread):
        return
    text = (
        f"force at equal speeds to both sides has a mean of {plain(offset, 4)} N "
        f"({plain(100 * offset / rms)} % of its RMS about the mean): the zero of the load cell, "
        "a preload, or an asymmetric damper."
    )
    do = "Note the load cell's reading without a damper; asymmetry shows only with it."
    level: Level = "warning" if abs(offset) > 0.1 * rms else "note"
    yield Finding("offset", level, text, do, run.name, "force", abs(offset) / rms)


def middle_drift(x: Array, velocity: Array) -> tuple[float, float]:
    """Return how far the middle between turning points moves over a run, and how that scatters."""
    least = 0.02 * float(np.abs(velocity).max())
    fast = np.flatnonzero(np.abs(velocity) > least)
    turns = fast[1:][np.diff(np.sign(velocity[fast])) != 0.0]
    if len(turns) < 10:
        return 0.0, 0.0
    middles = 0.5 * (x[turns[1:]] + x[turns[:-1]])
    at = 0.5 * (turns[1:] + turns[:-1]) / len(x)
    at = at - at.mean()
    slope = float(at @ middles / (at @ at))
    left = middles - middles.mean() - slope * at
    return slope, float(np.std(left) / np.sqrt(at @ at))


LEAST_ZERO = 0.03
"""Share of the force's RMS from which a constant part of it counts."""

SAME_ZERO = 0.15
"""Share of it by which a constant part may differ between runs and be that of the load cell."""

SURE_ZERO = 4.0
"""Standard deviations of a constant part that it is beyond, or within which it is the same."""


def zero_of_load_cell(runs: Sequence[Measurement]) -> float | None:
    """Return the constant force [N] that runs show alike however they move, None without one.

    It is the load cell's zero, or a preload; that of an asymmetric damper differs between runs.
    """
    found = []
    for run in runs:
        velocity = velocity_of_run(run)
        if velocity is None or "force" not in run.channels:
            return None
        counts = np.isfinite(run["force"]) & np.isfinite(velocity)
        if not counts.any() or np.ptp(velocity[counts]) == 0.0:
            return None
        drive = next((run[one][counts] for one in DRIVE if one in run.channels), None)
        found.append(force_offset(run["force"][counts], velocity[counts], drive))
    if len(found) < 2:
        return None
    offsets, spreads = np.array(found).T
    zero = float(np.median(offsets))
    rms = float(np.sqrt(np.mean([np.nanvar(run["force"]) for run in runs])))
    alike = np.abs(offsets - zero) <= np.maximum(SAME_ZERO * abs(zero), SURE_ZERO * spreads)
    sure = abs(zero) > max(LEAST_ZERO * rms, SURE_ZERO * float(np.median(spreads)))
    return zero if sure and bool(alike.all()) else None


def force_offset(force: Array, velocity: Array, drive: Array | None = None) -> tuple[float, float]:
    """Return the part of a force that does not turn with the motion [N], and how it scatters [N].

    What turns is a yield force and a viscous one, both growing with the voltage `drive`.
    """
    sign = np.tanh(velocity / (0.1 * float(np.std(velocity))))
    odd = [sign, velocity, velocity * np.abs(velocity)]
    if drive is not None and np.ptp(drive) > 0.0:
        odd += [one * drive for one in odd[:2]]
    A = np.column_stack([np.ones(len(force)), *odd])
    A = A / np.maximum(np.abs(A).max(axis=0), 1e-300)  # columns of one size
    blocks = zip(np.array_split(A, 8), np.array_split(force, 8), strict=True)
    offset = float(np.linalg.lstsq(A, force, rcond=None)[0][0])
    parts = [float(np.linalg.lstsq(part, rest, rcond=None)[0][0]) for part, rest in blocks]
    return offset, float(np.std(parts) / np.sqrt(len(parts)))


# Looks at how large values are: what no damper does tells a wrong unit, or a turned command.

LARGEST = {
    "displacement": 10.0, "velocity": 20.0, "force": 1e8, "voltage": 1e3, "current": 100.0,
    "duty": 101.0, "field": 10.0,
}  # fmt: skip
"""What no damper on a bench reaches, in the units of the channels."""

STROKE = 1e-4
"""Range of a displacement [m] below which it is doubted: a rod plays as much in its mounts."""

SLOW = 5.0
"""Samples per second below which the time is doubted: no motion of a bench is so slow."""

NEVER = 0.02
"""Share of its largest value, positive, that a command which is turned does not pass."""

MOSTLY = 0.2
"""Share of its lowest value that the mean of such a command is below: noise about zero is not."""


def check_sizes(run: Measurement, velocity: Array | None) -> Iterator[Finding]:
    """Yield what no damper does: the sizes of motion, force, command and time of a run on a bench.

    Parameters
    ----------
    run : Measurement
    velocity : (n,) m/s, measured or derived, None where nothing moves
    """
    for channel, most in LARGEST.items():
        if channel in run.channels and (size := float(np.abs(run[channel]).max())) > most:
            yield _unit(run, channel, f"{channel} reaches {quantity(size, run.units[channel], 3)}")
    speed = 0.0 if velocity is None else float(np.abs(velocity).max())
    if "velocity" not in run.channels and speed > LARGEST["velocity"]:
        yield _unit(run, "displacement", f"the displacement moves at {quantity(speed, 'm/s', 3)}")
    moved = float(np.ptp(run["displacement"])) if "displacement" in run.channels else 0.0
    if 0.0 < moved < STROKE:
        yield _unit(run, "displacement", f"displacement moves by {quantity(moved, 'm', 3)} in all")
    if run.sampling.rate < SLOW:
        rate = quantity(run.sampling.rate, "Hz", 3)
        yield _unit(run, "time", f"by its times the run was sampled at {rate}")
    for channel in DRIVE:
        if channel in run.channels:
            yield from _turned(run, channel, run[channel])


def _unit(run: Measurement, channel: str, what: str) -> Finding:
    return Finding(
        "size", "warning", f"{what}: is the unit of the {channel} right?",
        f"Correct it with bristle study channels MY_RIG --channel {channel}=COLUMN@UNIT",
        run.name, channel,
    )  # fmt: skip


def _turned(run: Measurement, channel: str, values: Array) -> Iterator[Finding]:
    """Report a command that is below zero and never above: laws take more of it for more force."""
    low = float(values.min())
    if low < 0.0 and float(values.max()) <= -NEVER * low and float(np.mean(values)) < MOSTLY * low:
        text = (
            f"{channel} goes down to {quantity(low, run.units[channel], 3)} and never above zero: "
            "is its sign turned?"
        )
        do = f"Turn it with bristle study channels MY_RIG --channel {channel}=-COLUMN"
        yield Finding("command sign", "warning", text, do, run.name, channel)
