"""Motions, commands and ground motions that the controller of a laboratory can run.

A motion is a shape of unit peak, scaled to what the rig can do; a command goes through levels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, sosfiltfilt

from ..core.arrays import Array
from ..data.ground_motion import GroundMotion, baked_in, read_ground_motion
from ..data.measurement import Measurement
from ..errors import RecordError

RAMP = 0.5
"""Time [s] in which a motion begins from rest, and ends at it."""

LINES = 16
"""Sines of a multisine."""

ROUNDED = 0.04
"""Part of a period of a triangle in which its corners are rounded."""


@dataclass(frozen=True)
class Waveform:
    """The shape of a motion.

    `kind` is one of MOTIONS; `low`, `high` Hz (a sine and a triangle have `high` alone); `seed`
    draws the phases of a multisine; `record` (n,) is the motion of a "record", at the rate of the
    test, of any size.
    """

    kind: str
    low: float
    high: float
    seed: int = 0
    record: tuple[float, ...] = ()
    name: str = ""

    def words(self, amplitude: str) -> str:
        """Return the motion in words; `amplitude` with its unit."""
        band = f"{self.low:.3g} to {self.high:.3g} Hz"
        return {
            "sine": f"sine of {amplitude} at {self.high:.3g} Hz",
            "triangle": f"triangle of {amplitude} at {self.high:.3g} Hz",
            "sweep": f"sweep of {amplitude} from {band}",
            "multisine": f"random multisine of {amplitude}, {band}, seed {self.seed}",
            "record": f"{self.name} scaled to {amplitude}",
        }[self.kind]


def _sine(shape: Waveform, t: Array) -> Array:
    return np.sin(2.0 * np.pi * shape.high * t)


def _triangle(shape: Waveform, t: Array) -> Array:
    phase = shape.high * t
    corners = 2.0 * np.abs(2.0 * ((phase - 0.25) % 1.0) - 1.0) - 1.0
    width = max(3, round(ROUNDED / shape.high / (t[1] - t[0])) | 1)
    # Twice: then the acceleration has no jumps either.
    return np.asarray(uniform_filter1d(uniform_filter1d(corners, width), width))


def _sweep(shape: Waveform, t: Array) -> Array:
    """Return a sweep of equal time per octave, there and back; its speed stays about the same."""
    half = 0.5 * t[-1]
    folded = np.minimum(t, t[-1] - t)
    rate = np.log(shape.high / shape.low) / half
    frequency = shape.low * np.exp(rate * folded)
    phase = np.cumsum(frequency) * (t[1] - t[0])
    return np.asarray(np.sin(2.0 * np.pi * phase) * np.sqrt(shape.low / frequency))


def _multisine(shape: Waveform, t: Array) -> Array:
    """Return sines of equal speed, at frequencies evenly spaced in logarithm, phases random."""
    generator = np.random.default_rng(shape.seed)
    whole = t[-1] - t[0]
    lines = np.geomspace(shape.low, shape.high, LINES)
    lines = np.unique(np.maximum(np.round(lines * whole), 1.0)) / whole
    phases = generator.uniform(0.0, 2.0 * np.pi, len(lines))
    waves = np.sin(2.0 * np.pi * lines[:, None] * t + phases[:, None]) / lines[:, None]
    return np.asarray(waves.sum(axis=0))


def _record(shape: Waveform, t: Array) -> Array:
    out = np.zeros_like(t)
    count = min(len(t), len(shape.record))
    out[:count] = shape.record[:count]
    return out


MOTIONS: dict[str, Callable[[Waveform, Array], Array]] = {
    "sine": _sine, "sweep": _sweep, "triangle": _triangle, "multisine": _multisine,
    "record": _record,
}  # fmt: skip
"""Kinds of motions by name."""


def fade(t: Array, rise: float = RAMP) -> Array:
    """Return a factor (n,) that rises smoothly from 0 to 1 at the start, and falls at the end."""
    q = np.clip(np.minimum(t - t[0], t[-1] - t) / rise, 0.0, 1.0)
    return np.asarray(q**3 * (10.0 - 15.0 * q + 6.0 * q * q))


def shape_of(waveform: Waveform, t: Array) -> tuple[Array, Array, Array]:
    """Return x, v, a (n,) of a motion of unit peak [1, 1/s, 1/s2] that begins and ends at rest."""
    x = MOTIONS[waveform.kind](waveform, t) * fade(t)
    x = x / np.max(np.abs(x))
    spline = make_interp_spline(t, x, k=5)
    return x, spline.derivative(1)(t), spline.derivative(2)(t)


@dataclass(frozen=True)
class Command:
    """What the command does in a test.

    `kind` is one of COMMANDS; `low`, `high` its least and its largest value in its unit; `period`
    how long a level lasts, or that of a sine [s]; `seed` draws random steps.
    """

    kind: str
    low: float
    high: float
    period: float = 1.0
    seed: int = 0

    def words(self, name: str, unit: str) -> str:
        """Return the command in words; its name and unit as the study has them."""
        if self.high == self.low:
            return f"{name} held at {self.high:.3g} {unit}"
        between = f"between {self.low:.3g} and {self.high:.3g} {unit}"
        return {
            "held": f"{name} held at {self.high:.3g} {unit}",
            "switched": f"{name} switched {between} every {self.period:.3g} s",
            "stairs": f"{name} in steps of {self.period:.3g} s {between}",
            "random": f"{name} in random steps {between}, about {self.period:.3g} s each",
            "sine": f"{name} in a sine {between}, period {self.period:.3g} s",
        }[self.kind]


def _held(command: Command, t: Array) -> Array:
    return np.ones_like(t)


def _switched(command: Command, t: Array) -> Array:
    return np.asarray((t // command.period) % 2, dtype=float)


def _stairs(command: Command, t: Array) -> Array:
    """Return four steps up and as many down, over and over."""
    up = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0]) / 3.0
    return np.asarray(up[(t // command.period).astype(int) % len(up)])


def _random(command: Command, t: Array) -> Array:
    """Return levels drawn evenly, every fourth of them the least one."""
    generator = np.random.default_rng(command.seed)
    count = int(2.5 * (t[-1] - t[0]) / command.period) + 2
    edges = np.cumsum(generator.uniform(0.5, 1.5, count) * command.period)
    levels = generator.uniform(0.0, 1.0, count + 1)
    levels[::4] = 0.0
    return np.asarray(levels[np.searchsorted(edges, t, side="right")])


def _wave(command: Command, t: Array) -> Array:
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * t / command.period))


COMMANDS: dict[str, Callable[[Command, Array], Array]] = {
    "held": _held, "switched": _switched, "stairs": _stairs, "random": _random, "sine": _wave,
}  # fmt: skip
"""Kinds of commands by name."""


def command_of(command: Command, t: Array) -> Array:
    """Return the command (n,) in its unit."""
    return command.low + (command.high - command.low) * COMMANDS[command.kind](command, t)


# Ground motions that a shaking table can run: its displacement from a recorded acceleration.

REST = 2.0
"""Rest before and after a record, in periods of the corner below which the table does not move."""


def displacement_of(acceleration: Array, step: float, corner: float) -> Array:
    """Return the displacement (n,) [m] of a table that runs a recorded acceleration.

    What is slower than the corner is left out at each integration: no table has the room for it.

    Parameters
    ----------
    acceleration : (n,) m/s2
    step : of the samples [s]
    corner : lowest frequency of the table [Hz]
    """
    low = butter(2, min(2.0 * corner * step, 0.5), "high", output="sos")
    many = round(REST / corner / step)
    moved = np.pad(acceleration, many)
    for _ in range(2):
        moved = cumulative_trapezoid(sosfiltfilt(low, moved), dx=step, initial=0.0)
    return np.asarray(sosfiltfilt(low, moved)[many : many + len(acceleration)])


def scalable(motion: GroundMotion, rate: float, seconds: float, corner: float) -> Waveform:
    """Return a ground motion as a waveform that can be scaled: its strongest stretch.

    Parameters
    ----------
    motion : as recorded
    rate : samples per second of the waveform
    seconds : its length
    corner : lowest frequency of the table [Hz]

    Raises
    ------
    RecordError
        If the ground does not move.
    """
    step = 1.0 / rate
    even = np.arange(motion.time[0], motion.time[-1] + 0.5 * step, step)
    felt = np.interp(even, motion.time, motion.acceleration)
    if not np.any(felt):
        raise RecordError(f"{motion.name}: the ground does not move in it.")
    count = min(round(seconds * rate) + 1, len(felt))
    power = np.concatenate([[0.0], np.cumsum(felt**2)])
    begin = int(np.argmax(power[count:] - power[:-count]))
    x = displacement_of(felt[begin : begin + count], step, corner)
    return Waveform("record", corner, 0.5 * rate, record=tuple(x.tolist()), name=motion.name)


def records_at_hand(
    runs: Sequence[Measurement], names: Sequence[str], folder: Path
) -> list[GroundMotion]:
    """Return the ground motions that can be scaled: named ones, built-in ones, those of runs.

    Parameters
    ----------
    runs : of a study
    names : of records, or files
    folder : what a relative path is relative to

    Raises
    ------
    RecordError
        If a record cannot be read.
    """
    found = [read_ground_motion(name, folder) for name in dict.fromkeys((*names, *baked_in()))]
    return found + [
        GroundMotion(
            run.time - run.time[0], run["ground_acceleration"],
            f"the ground motion of {run.name}", run.source,
        )
        for run in runs
    ]  # fmt: skip
