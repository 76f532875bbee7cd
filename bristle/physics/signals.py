"""Test signals and instruments: what they give at time t, and how fast it changes.

`value` and `rate` are one source for both paths: the numbers come as a flat sequence in the order
of `PARAMETERS`, the samples of the kinds "steps" and "csv" as two sequences.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, isfinite, pi, sin
from typing import Any

from ..errors import PhysicsError
from .effect import Effect
from .generate import Slots, call, generate, q_source
from .motion_file import interpolate
from .parameter import Parameter

CONSTANT = 0
SINE = 1
CHIRP = 2
STEPS = 3
HALF_SINE = 4
CSV = 5
KINDS = {
    "constant": CONSTANT,
    "sine": SINE,
    "chirp": CHIRP,
    "steps": STEPS,
    "half_sine": HALF_SINE,
    "csv": CSV,
}

INSTANT = 1e-9
"""A step of a signal happens at most so much early [s]: times that hosts add up are rounded."""

_ANY = (-1e12, 1e12)
PARAMETERS: dict[str, Parameter] = {
    "level": Parameter(0.0, "", _ANY, "value of the kind constant"),
    "amplitude": Parameter(1.0, "", _ANY, "amplitude of sine, chirp and half_sine"),
    "frequency": Parameter(1.0, "Hz", (0.0, 1e6), "frequency; of a chirp at its start"),
    "phase": Parameter(0.0, "rad", _ANY, "phase of sine and chirp at `start`"),
    "offset": Parameter(0.0, "", _ANY, "value about which sine, chirp and half_sine move"),
    "start": Parameter(0.0, "s", _ANY, "time at which the signal begins; before it, `offset`"),
    "duration": Parameter(1.0, "s", (1e-9, 1e9), "length of a chirp and of a half_sine"),
    "frequency_end": Parameter(10.0, "Hz", (0.0, 1e6), "frequency of a chirp at its end"),
}

TAKEN: dict[str, tuple[str, ...]] = {
    "constant": ("level",),
    "sine": ("amplitude", "frequency", "phase", "offset", "start"),
    "chirp": ("amplitude", "frequency", "frequency_end", "phase", "offset", "start", "duration"),
    "steps": ("steps",),
    "half_sine": ("amplitude", "offset", "start", "duration"),
    "csv": ("file",),
}
"""Which parameters each kind takes: those above, and the two of its samples."""


def value(
    kind: int, t: float, p: Sequence[float], times: Sequence[float], values: Sequence[float]
) -> float:
    """Return the signal at a time, in its own unit.

    A half sine lasts for `duration`, a chirp sweeps linearly and ends with it.

    Parameters
    ----------
    kind : one of the codes of `KINDS`
    t : s
    p : (8,) values in the order of `PARAMETERS`
    times, values : (n,) samples [s, the signal's unit], held from each to the next for "steps",
        linear between for "csv"; else not used
    """
    if kind == CONSTANT:
        return p[0]
    if kind == STEPS:
        held = 0.0
        for i in range(len(times)):
            if times[i] > t + INSTANT:
                break
            held = values[i]
        return held
    if kind == CSV:
        return interpolate(t, times, values)
    s = t - p[5]
    if s < 0.0:
        return p[4]
    if kind == SINE:
        return p[4] + p[1] * sin(2.0 * pi * p[2] * s + p[3])
    if s >= p[6]:
        return p[4]
    if kind == HALF_SINE:
        return p[4] + p[1] * sin(pi * s / p[6])
    return p[4] + p[1] * sin(2.0 * pi * (p[2] + 0.5 * (p[7] - p[2]) * s / p[6]) * s + p[3])


def rate(
    kind: int, t: float, p: Sequence[float], times: Sequence[float], values: Sequence[float]
) -> float:
    """Return the rate of the signal at a time [1/s]; between the samples of "csv", their slope.

    Parameters
    ----------
    kind, t, p, times, values
        As in `value`.
    """
    if kind in (CONSTANT, STEPS):
        return 0.0
    if kind == CSV:
        last = len(times) - 1
        if not times[0] <= t < times[last]:
            return 0.0
        low, high = 0, last
        while high - low > 1:
            middle = (low + high) // 2
            if times[middle] <= t:
                low = middle
            else:
                high = middle
        return (values[low + 1] - values[low]) / (times[low + 1] - times[low])
    s = t - p[5]
    if s < 0.0:
        return 0.0
    if kind == SINE:
        return p[1] * 2.0 * pi * p[2] * cos(2.0 * pi * p[2] * s + p[3])
    if s >= p[6]:
        return 0.0
    if kind == HALF_SINE:
        return p[1] * pi / p[6] * cos(pi * s / p[6])
    sweep = (p[7] - p[2]) / p[6]
    angle = 2.0 * pi * (p[2] + 0.5 * sweep * s) * s + p[3]
    return p[1] * 2.0 * pi * (p[2] + sweep * s) * cos(angle)


def read_steps(text: str) -> tuple[list[float], list[float]]:
    """Return times [s] and values of the text "0:0 1.5:4 3:0", time:value pairs in order.

    Raises
    ------
    PhysicsError
        If a pair is not two finite numbers or a time does not follow the one before.
    """
    times: list[float] = []
    values: list[float] = []
    for pair in text.split():
        time, _, level = pair.partition(":")
        try:
            numbers = float(time), float(level)
        except ValueError:
            numbers = float("nan"), float("nan")
        if not (isfinite(numbers[0]) and isfinite(numbers[1])):
            raise PhysicsError(
                f'steps: "{pair}" is not TIME:VALUE, two finite numbers; such as "0:0 1.5:4 3:0".'
            )
        if times and numbers[0] <= times[-1]:
            raise PhysicsError(f"steps: the time {numbers[0]:g} s does not follow {times[-1]:g} s.")
        times.append(numbers[0])
        values.append(numbers[1])
    if not times:
        raise PhysicsError('steps: no pair; give TIME:VALUE pairs such as "0:0 1.5:4 3:0".')
    return times, values


def _source(effect: type[Effect], slots: Slots) -> str:
    q = q_source(value="value", dt="dt")
    places = slots.places(effect)
    lines = ["def show(value, dt, z, p):", f"    q = {q}"]
    if places:
        targets = "".join(f"z[{place}], " for place in places)
        lines.append(f"    {targets}= {call(effect, 'advance', slots, 'q')}")
    lines.append(f"    return {call(effect, 'channel', slots, 'q')}")
    return "\n".join(lines)


def instrument(effect: type[Effect]) -> tuple[Any, Slots]:
    """Return the function show(value, dt, z, p) of a sensor's effect, and where its numbers lie.

    It takes the next sample of the signal, advances the states `z` in place and returns what the
    instrument shows then.
    """
    slots = Slots((), (effect,))
    return generate("show", _source(effect, slots), slots), slots
