"""Looks at channels together: derivatives, delays, signs, units, and where power goes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import log10

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding, Level
from ...core.text import plain
from ..cut_off import numerical_derivative
from ..measurement import Measurement
from ..relation import (
    Relation,
    averaged,
    band,
    derivative_relation,
    differentiated,
    power_factor,
    tells_sign,
)

ACROSS = "across_device"
"""What stands before displacement and velocity across a device, as a level's name elsewhere."""

_GAIN = 0.02  # share by which two channels may differ in gain
_DELAY = 0.25  # share of the sampling step by which they may differ in time


def velocity_of_run(run: Measurement, level: str = "") -> Array | None:
    """Return the velocity (n,) [m/s] as measured, else the derivative of the displacement."""
    before = f"{level}_" if level else ""
    if f"{before}velocity" in run.channels:
        return run[f"{before}velocity"]
    if f"{before}displacement" in run.channels:
        x = run[f"{before}displacement"]
        return differentiated(x, run.step, min(band(x, run.step), 0.2 / run.step))
    return None


def with_motion_across(run: Measurement, lower: str, upper: str) -> Measurement:
    """Return a measurement of a building with the motion across a device, as `ACROSS` names it.

    Parameters
    ----------
    run : with the motion of the levels
    lower, upper : the levels that the device connects; "" for the ground
    """
    channels, units = {**run.channels}, {**run.units}
    for what in ("displacement", "velocity"):
        ends = [f"{level}_{what}" for level in (upper, lower) if level]
        if run.has(*ends):
            rest = run[ends[1]] if len(ends) > 1 else 0.0
            channels[f"{ACROSS}_{what}"] = run[ends[0]] - rest
            units[f"{ACROSS}_{what}"] = run.units[ends[0]]
    return replace(run, channels=channels, units=units)


def check_motion(run: Measurement, level: str = "") -> Iterator[Finding]:
    """Yield what is found between displacement, velocity and acceleration of a level."""
    before = f"{level}_" if level else ""
    x, v = f"{before}displacement", f"{before}velocity"
    if run.has(x, v):
        own = numerical_derivative(run[x], run[v], run.step)
        if own:
            text = (
                f"{v} is the numerical derivative of {x} ({own}): it adds no information, and "
                "its noise is that of the displacement."
            )
            do = (
                f"Leave it out with bristle study channels MY_RIG --without {v} , or record it "
                "with an instrument of its own."
            )
            yield Finding("derived", "note", text, do, run.name, v)
        else:
            yield from _related(run, x, v, derivative_relation(run[x], run[v], run.step))
    yield from _acceleration(run, before, x, v)


def _acceleration(run: Measurement, before: str, x: str, v: str) -> Iterator[Finding]:
    """Hold an acceleration against the velocity, or against the displacement differentiated."""
    a = f"{before}acceleration" + ("_absolute" if before else "")
    if not (run.has(a) and (run.has(x) or run.has(v))):
        return
    measured = run[a]
    if before:
        if not run.has("ground_acceleration"):
            return
        measured = measured - run["ground_acceleration"]
    if run.has(v):
        yield from _related(run, v, a, derivative_relation(run[v], measured, run.step))
        return
    rate = np.gradient(run[x], run.step)
    found = derivative_relation(rate, averaged(measured), run.step)
    yield from _related(run, f"d({x})/dt", a, found)


def check_force(run: Measurement, velocity: Array) -> Iterator[Finding]:
    """Yield what the power of the force says of its sign."""
    force = run["force"]
    if np.ptp(force) == 0.0 or np.ptp(velocity) == 0.0:
        return
    share, agree = power_factor(force, velocity)
    shown = f"share of the power that it could dissipate: {share:+.2f}"
    known = tells_sign(share, agree, len(force))
    if known and share < 0.0:
        text = f"force drives the motion, because it is positive along it ({shown})."
        do = (
            "Turn its sign with bristle study channels MY_RIG --channel force=-COLUMN : a force is "
            "positive when it resists motion along +x."
        )
        yield Finding("sign", "error", text, do, run.name, "force", -share)
    elif not known:
        text = (
            f"force neither resists nor drives the motion ({shown}): its sign cannot be determined."
        )
        do = "Check that force and motion were recorded together."
        yield Finding("sign", "warning", text, do, run.name, "force", -abs(share))


def _related(run: Measurement, lower: str, upper: str, found: Relation | None) -> Iterator[Finding]:
    if found is None:
        return  # one of the two stands still, which is said elsewhere
    if abs(found.correlation) < 0.9 and found.residual > 0.4:
        text = (
            f"{upper} is not the derivative of {lower}: their correlation is "
            f"{found.correlation:.2f}."
        )
        do = "Check the columns: are two exchanged, or is one instrument not connected?"
        yield Finding(
            "derivative", "error", text, do, run.name, upper, 1.0 - abs(found.correlation)
        )
        return
    gain = (
        f"{upper} is {plain(found.gain, 4)} (± {plain(2 * found.gain_std, 1)}) times the "
        f"derivative of {lower}"
    )
    after = f"; the remainder is {plain(100 * found.residual, 2)} % of it"
    text = f"{gain}{after}."
    off = abs(found.gain - 1.0)
    if found.gain < 0.0 or off > 0.25:
        size = abs(found.gain)
        doubts = ["sign"] * (found.gain < 0.0) + ["unit"] * (not 0.75 < size < 1.25)
        do = f"Check the {' and the '.join(doubts)} of both in study.toml."
        yield Finding("gain", "error", text, do, run.name, upper, abs(log10(size)))
    else:
        certain = off > max(_GAIN, 4.0 * found.gain_std)
        do = "One of the two instruments is out of calibration." if certain else ""
        level: Level = "warning" if certain else "note"
        yield Finding("gain", level, text, do, run.name, upper, off)
    if abs(found.delay) > max(_DELAY * run.step, 4.0 * found.delay_std):
        late = "later" if found.delay > 0.0 else "earlier"
        text = (
            f"{upper} comes {plain(1e3 * abs(found.delay))} ms "
            f"(± {plain(2e3 * found.delay_std, 1)}) {late} "
            f"than {lower}."
        )
        do = "Filters of two instruments differ: use the same on both, or one of the channels."
        yield Finding("delay", "warning", text, do, run.name, upper, abs(found.delay))
