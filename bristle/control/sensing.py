"""Velocities that no sensor measures, and the skyhook law that needs one."""

from __future__ import annotations

from math import exp


def low_passed(filtered: float, before: float, now: float, corner: float, h: float) -> float:
    """Return a first-order low-pass after a sample, exactly, for a signal linear in between.

    Parameters
    ----------
    filtered : float
        The low-passed signal at the last sample, in the signal's unit.
    before, now : float
        The signal at the last sample and at this one.
    corner : float
        Corner frequency [rad/s]: 2 pi 18 for 18 Hz.
    h : float
        Sample period [s].
    """
    slope = (now - before) / h
    return now - slope / corner + (filtered - before + slope / corner) * exp(-corner * h)


def filtered_velocity(filtered: float, now: float, corner: float) -> float:
    """Return the rate of the low-passed displacement: corner (x - filtered) [m/s].

    It is the derivative of `low_passed` itself; no difference between samples is taken.
    """
    return corner * (now - filtered)


def leaky_integral(total: float, before: float, now: float, corner: float, h: float) -> float:
    """Return an integral after a sample: it forgets at a corner frequency.

    Exact for a signal linear between samples; of an acceleration it is the velocity above `corner`,
    without the drift of a sensor's bias.

    Parameters
    ----------
    total : the integral at the last sample, in the signal's unit times s
    before, now : the signal at the last sample and at this one
    corner : corner frequency [rad/s]
    h : sample period [s]
    """
    mean = low_passed(total * corner, before, now, corner, h)
    return mean / corner


def skyhook_command(v_absolute: float, gain: float) -> float:
    """Return the force [N] of a dashpot of `gain` [N s/m] hung from the sky.

    Karnopp, Crosby & Harwood (1974), J. Eng. Ind. 96(2), 619-626. An inverse law turns it into a
    voltage, which is zero where a damper cannot give that force.
    """
    return gain * v_absolute


def skyhook_switch(v_absolute: float, v: float, v_max: float) -> float:
    """Return the on-off skyhook voltage [V]: `v_max` while the damper would slow the mass down.

    `v_absolute` is the velocity of the mass [m/s], `v` the one across the damper [m/s].
    """
    return v_max if v_absolute * v > 0.0 else 0.0
