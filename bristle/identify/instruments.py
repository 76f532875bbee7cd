"""Instruments that show a channel late or changed: sensor effects inside a fit.

The force that a model predicts is shown through the instrument of the force. Of the velocity the
instrument's reading is what was measured, so its effect is taken back: the motion that the damper
felt is the one that the instrument would have shown like that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..check.channel import shown
from ..data.command_limits import jumps
from ..data.measurement import Measurement
from ..physics.effect import EFFECTS, Effect

Array = NDArray[np.float64]

LEAST = 0.03
"""Least response, by the largest, that is taken back in full; below, noise would be blown up."""

LEAD = 0.4
"""Time [s] over which a record is led in from rest and out again, so that it may repeat."""


def sensors(effects: tuple[str, ...], channel: str) -> list[type[Effect]]:
    """Return the effects among these that are the instrument of a channel."""
    known = [EFFECTS[name] for name in effects]
    return [effect for effect in known if effect.site == "sensor" and effect.shows == channel]


def own(effect: type[Effect], values: dict[str, float]) -> dict[str, float]:
    """Return the values of an effect's parameters by their own names."""
    begin = effect.name + "."
    return {
        name.removeprefix(begin): value for name, value in values.items() if name.startswith(begin)
    }


def shown_force(
    effects: tuple[str, ...], values: dict[str, float], force: Array, dt: float
) -> Array:
    """Return what the instruments of the force show of it (n,) [N].

    Parameters
    ----------
    effects : names of the effects that are on; those that are no instrument of the force are
        left out
    values : parameters in SI by name, effect.parameter; missing ones take their defaults
    force : (n,) N
    dt : sampling step [s]
    """
    for effect in sensors(effects, "force"):
        force = shown(effect, own(effect, values), force, dt)
    return force


def pure_delay(
    effects: tuple[str, ...], values: dict[str, float]
) -> tuple[float, dict[str, float]]:
    """Return by what time [s] the force is merely late, and the values without that part."""
    total, left = 0.0, values
    for effect in sensors(effects, "force"):
        if effect.late:
            time, share, *_ = (f"{effect.name}.{name}" for name in effect.late)
            known = {f"{effect.name}.{n}": p.value for n, p in effect.parameters.items()} | values
            total += (1.0 - known[share]) * known[time]
            left = {**left, time: known[share] * known[time], share: 1.0}
    return total, left


def earlier(
    motion: tuple[Array, Array, Array, Array], late: float, dt: float
) -> tuple[Array, Array, Array, Array]:
    """Return x, v, a, V (n,) as they were a time `late` [s] before each sample.

    The force at that moment has the jumps of a sign law and of a stepped voltage in full, where the
    force between two samples would smear them. Before the record all is as at its begin.
    """
    whole = int(late / dt)
    rest = late - whole * dt
    x, v, a, V = (_delayed(signal, whole) for signal in motion)
    V_before, a_before = _delayed(V, 1), _delayed(a, 1)
    between = V - (V - V_before) * rest / dt
    V = np.where(jumps(V), V_before, between) if rest > 0.0 else V
    return (
        x - v * rest + 0.5 * a * rest**2,
        v - a * rest,
        a - (a - a_before) * rest / dt,
        V,
    )


def _delayed(signal: Array, count: int) -> Array:
    """Return a signal (n,) shifted by a number of samples, its first value held."""
    if count == 0:
        return signal
    return np.concatenate([np.full(min(count, len(signal)), signal[0]), signal[:-count]])


def true_motion(
    effects: tuple[str, ...], values: dict[str, float], v: Array, a: Array, dt: float
) -> tuple[Array, Array]:
    """Return the velocity and acceleration (n,) [m/s, m/s2] behind those of a velocity channel.

    Parameters
    ----------
    effects : names of the effects that are on; those that are no instrument of the velocity are
        left out
    values : parameters in SI by name, effect.parameter; missing ones take their defaults
    v, a : (n,) m/s, m/s2, as the instrument shows them
    dt : sampling step [s]
    """
    for effect in sensors(effects, "velocity"):
        there = own(effect, values)
        v, a = taken_back(effect, there, v, dt), taken_back(effect, there, a, dt)
    return v, a


def taken_back(effect: type[Effect], values: dict[str, float], reading: Array, dt: float) -> Array:
    """Return the signal (n,) that an instrument shows as this reading.

    The instrument's response to a single pulse is divided out in the frequency domain; where it
    answers with less than `LEAST` of its most, only in part (Tikhonov).

    Parameters
    ----------
    effect : Effect of the site "sensor"
    values : parameters of the effect by their own names ("gain"), in SI; missing ones default
    reading : (n,) in the channel's unit
    dt : sampling step [s]
    """
    n = len(reading)
    lead = max(8, round(LEAD / dt))
    fade = 0.5 - 0.5 * np.cos(np.pi * (np.arange(lead) + 0.5) / lead)
    padded = np.concatenate([fade * reading[0], reading, fade[::-1] * reading[-1]])
    size = 1 << int(np.ceil(np.log2(len(padded) + lead)))
    pulse = np.zeros(size)
    pulse[1] = 1.0  # not in the first sample, with which some states start
    response = np.fft.rfft(np.roll(shown(effect, values, pulse, dt), -1))
    power = np.abs(response) ** 2
    inverse = np.conj(response) / (power + LEAST**2 * power.max())
    inverse *= 1.0 + LEAST**2  # so that the strongest response is divided out in full
    spectrum = np.fft.rfft(padded, size) * inverse
    back: Array = np.fft.irfft(spectrum, size)[lead : lead + n]
    return back


def corrected(
    measurement: Measurement, effects: tuple[str, ...], values: dict[str, float]
) -> Measurement:
    """Return a measurement whose velocity channel is freed of its instrument's effects.

    For `prepare`, which then joins it with the displacement; noise is carried through by its gain.
    """
    known = sensors(effects, "velocity")
    if not known or not measurement.has("velocity"):
        return measurement
    channels, noise = dict(measurement.channels), dict(measurement.noise)
    for effect in known:
        before = channels["velocity"]
        after = taken_back(effect, own(effect, values), before, measurement.step)
        channels["velocity"] = after
        if "velocity" in noise:
            white = np.random.default_rng(0).standard_normal(len(before))
            gain = taken_back(effect, own(effect, values), white, measurement.step).std()
            noise["velocity"] *= float(gain)
    return replace(measurement, channels=channels, noise=noise)
