"""What a rig can do, rig.toml, and a test within these limits."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.config import Document, Key, Spec
from ..core.text import quantity, unknown, written
from ..data.corrections import limited
from ..errors import StudyError, UnitError
from ..identification.problem import Run
from ..physics.drive import DRIVES, VOLTAGE, Drive
from ..physics.laws import DEFAULT, law_names
from ..units import convert
from .waveforms import COMMANDS, MOTIONS, Command, Waveform, command_of, shape_of

RESERVE = 0.9
"""Part of each limit that a planned test uses: a controller overshoots, a model errs."""

SECONDS, RUNS = 12.0, 4
"""Length [s] and number of planned tests."""

SLOWEST = 0.2
"""Lowest frequency [Hz] of a planned motion where no band is given."""

SPAN = 40.0
"""Highest over lowest frequency of a band where none is given, at the most."""

ZERO = 0.02
"""Share of the largest command below which the smallest is zero, but for its noise."""

SIZES = {
    "stroke": "m", "speed": "m/s", "acceleration": "m/s2", "force": "N", "heat": "J",
    "duration": "s", "pause": "s", "rate": "Hz", "damper_stroke": "m", "drift": "m",
}  # fmt: skip
"""Units of the limits that are quantities, by the names that rig.toml gives them."""


@dataclass(frozen=True)
class RigLimits:
    """What a rig can do, in SI; infinite where nothing is known.

    Attributes
    ----------
    stroke, speed, acceleration : float
        Of the motion, to either side [m, m/s, m/s2]; of the table, where a building stands on it.
    force : float
        Of the actuator [N].
    band : tuple of float
        Lowest and highest frequency [Hz].
    command : tuple of float
        Least and largest value of the command, in its unit.
    slew : float
        How fast the command can change, in its unit per second.
    levels : tuple of float
        The values that the command can take, where it can take these alone.
    duration, pause : float
        Longest test, and the rest between two of them [s].
    runs : int
        How many tests.
    heat : float
        Energy that the damper may absorb in a test [J].
    rate : float
        Samples per second of the controller.
    motions, commands : tuple of str
        The waveforms that the controller has: of `motions.MOTIONS` and `motions.COMMANDS`.
    damper_stroke, drift : float
        Of a building: the motion of its damper, and of its storeys, to either side [m].
    """

    stroke: float
    speed: float
    acceleration: float = inf
    force: float = inf
    band: tuple[float, float] = (0.0, inf)
    command: tuple[float, float] = (0.0, 0.0)
    slew: float = inf
    levels: tuple[float, ...] = ()
    duration: float = SECONDS
    pause: float = 0.0
    runs: int = RUNS
    heat: float = inf
    rate: float = 500.0
    motions: tuple[str, ...] = ("sine", "sweep", "triangle", "multisine")
    commands: tuple[str, ...] = tuple(COMMANDS)
    damper_stroke: float = inf
    drift: float = inf

    def check(self) -> None:
        """Refuse limits that allow no test.

        Raises
        ------
        StudyError
            Saying which limit, and what would be right.
        """
        for name, unit in SIZES.items():
            if name != "pause" and not getattr(self, name) > 0.0:
                raise StudyError(
                    f"{name} = {getattr(self, name):g} {unit}: these limits allow no motion; more "
                    "than 0 is right."
                )
        if not 0.0 <= self.band[0] < self.band[1]:
            raise StudyError(
                f"band = {self.band[0]:g} to {self.band[1]:g} Hz allows no motion; the lowest "
                "frequency first, then a higher one."
            )
        if self.command[0] > self.command[1]:
            raise StudyError(
                f"command = {self.command[0]:g} to {self.command[1]:g}: the least value first."
            )
        if not self.slew > 0.0:
            raise StudyError(f"slew = {self.slew:g}: a command that cannot change has one level.")
        if self.runs < 1:
            raise StudyError(f"runs = {self.runs}: 1 or more is right.")
        if self.duration < 2.0:
            raise StudyError(f"duration = {self.duration:g} s: 2 s or more is right.")
        if not self.pause >= 0.0:
            raise StudyError(f"pause = {self.pause:g} s: 0 or more is right.")
        if self.band[1] * self.duration < 1.0:
            raise StudyError(
                f"band = {self.band[0]:g} to {self.band[1]:g} Hz: a test of {self.duration:g} s "
                "holds not one period of it; a longer duration, or a higher band, is right."
            )
        if self.rate * self.duration < 400.0:
            raise StudyError(
                f"{self.rate:g} samples per second in {self.duration:g} s are "
                f"{self.rate * self.duration:.0f} samples; a fit needs 400 or more."
            )

    @property
    def usable_band(self) -> tuple[float, float]:
        """The frequencies [Hz] that tests use: those at which the rig moves by a fair amount."""
        low = max(self.band[0], SLOWEST, 3.0 / self.duration)
        low = min(low, max(0.5 * self.band[1], self.band[0]))
        # Above this the speed leaves a twentieth of the stroke.
        fastest = self.speed / (2.0 * np.pi * 0.05 * self.stroke)
        high = min(self.band[1], SPAN * low, 0.05 * self.rate, max(fastest, 2.0 * low))
        return low, max(high, low)

    def nearest(self, value: float) -> float:
        """Return the value that the command can take nearest to one that is wanted."""
        value = min(max(value, self.command[0]), self.command[1])
        return min(self.levels, key=lambda level: abs(level - value)) if self.levels else value


def limits_of_runs(runs: Sequence[Run]) -> RigLimits:
    """Return what a rig has done already: the limits of a plan where nobody gives others."""
    low = min(float(run.V.min()) for run in runs)
    high = max(float(run.V.max()) for run in runs)
    return RigLimits(
        max(float(np.ptp(run.x)) for run in runs) / 2.0 / RESERVE,
        max(float(np.max(np.abs(run.v))) for run in runs) / RESERVE,
        max(float(np.quantile(np.abs(run.a), 0.999)) for run in runs) / RESERVE,
        command=(0.0 if abs(low) < ZERO * high else low, high),
        duration=max(2.0, min(SECONDS, max(len(run.x) * run.dt for run in runs))),
        rate=1.0 / min(run.dt for run in runs),
    )


def with_given(limits: RigLimits, given: Mapping[str, Any]) -> RigLimits:
    """Return limits with those that were given in their place, checked.

    Raises
    ------
    StudyError
        If they allow no test.
    """
    out = replace(limits, **given)
    out.check()
    if not out.levels:
        return out
    low, high = out.command if "command" in given else (min(out.levels), max(out.levels))
    levels = tuple(level for level in out.levels if low <= level <= high)
    if not levels:
        wrong = ", ".join(f"{level:g}" for level in out.levels)
        raise StudyError(f"levels = {wrong}: none of them is in command = {low:g} to {high:g}.")
    return replace(out, levels=levels, command=(min(levels), max(levels)))


# A planned test: a motion and a command, as large as the rig's limits allow.


@dataclass(frozen=True)
class PrescribedSignals:
    """What a test prescribes: `time`, `x`, `v`, `a`, `V` (n,) [s, m, m/s, m/s2, the command]."""

    time: Array
    x: Array
    v: Array
    a: Array
    V: Array

    @property
    def dt(self) -> float:
        """The sampling step [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Test:
    """A motion under a command.

    `share` of what the limits of the motion allow; `seconds` its length.
    """

    __test__ = False  # pytest takes a class of this name for tests

    motion: Waveform
    command: Command
    share: float = 1.0
    seconds: float = 12.0

    def signals(self, limits: RigLimits, rate: float = 0.0) -> PrescribedSignals:
        """Return what the test prescribes within the limits, but for those of force and heat.

        Parameters
        ----------
        limits : of the rig
        rate : samples per second; 0 for that of the limits
        """
        t = np.arange(round(self.seconds * (rate or limits.rate)) + 1) / (rate or limits.rate)
        x, v, a = shape_of(self.motion, t)
        size = self.share * RESERVE * min(
            limits.stroke,
            limits.speed / float(np.max(np.abs(v))),
            limits.acceleration / float(np.max(np.abs(a))),
        )  # fmt: skip
        V = command_of(self.command, t)
        if limits.levels:
            levels = np.array(sorted(limits.levels))
            V = levels[np.argmin(np.abs(V[:, None] - levels), axis=1)]
        V = limited(V, float(t[1]), "slew", RESERVE * limits.slew)
        return PrescribedSignals(t, size * x, size * v, size * a, V)

    def words(self, signals: PrescribedSignals, drive: Drive | None) -> str:
        """Return the test in words; `drive` is the command's channel, None where there is none."""
        motion = self.motion.words(quantity(float(np.max(np.abs(signals.x))), "m"))
        if drive is None:
            return motion
        return f"{motion}, {self.command.words(drive.name, drive.unit)}"

    def smaller(self, factor: float) -> Test:
        """Return the test with a smaller motion."""
        return replace(self, share=self.share * factor)


# Limits of a rig as a user gives them: quantities with units, in rig.toml or as arguments.

_NOISE = {"displacement": "m", "velocity": "m/s", "force": "N"}
_EXAMPLES = {"m": "20 mm", "m/s": "200 mm/s", "N": "2 kN", "Hz": "500 Hz", "J": "200 J"}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
"""A number, and its unit if there is one."""


def limits_given(given: Mapping[str, Any], drive: str = "") -> dict[str, Any]:
    """Return limits as arguments of `RigLimits`, from what a user gives for each of them.

    Parameters
    ----------
    given : by name, numbers in SI or texts with a unit, as in rig.toml
    drive : the channel of the command, "" where none is known: its unit is that of levels

    Raises
    ------
    StudyError
        If there is no such limit, or a value is none.
    """
    document = Document("as given", StudyError, given)
    found = document.read(_limits(drive), ("limits",), given)
    document.check()
    return {name: found[name] for name in given}


def read_rig(path: Path, drive: str = "") -> dict[str, Any]:
    """Return the limits that a rig.toml gives, as arguments of `RigLimits`.

    Parameters
    ----------
    path : the file
    drive : the channel of the command, "" where none is known: its unit is that of levels

    Raises
    ------
    StudyError
        With every mistake of the file and its line.
    """
    document = Document(path, StudyError)
    limits = read_sheet(document, drive)["limits"]
    document.check()
    return {name: limits[name] for name in document.data.get("limits", {})}


def read_sheet(document: Document, drive: str) -> dict[str, Any]:
    """Return the tables of a rig.toml: limits, damper and noise in SI, None for what is not given.

    Parameters
    ----------
    document : takes what is wrong
    drive : the channel of the command
    """
    damper = Spec({
        "max_force": Key(partial(_positive, "N"), None),
        "law": Key(str, DEFAULT, choices=law_names()),
        "command": Key(str, VOLTAGE.name, choices=DRIVES),
    })  # fmt: skip
    noise = Spec({name: Key(partial(_positive, unit), None) for name, unit in _NOISE.items()})
    return document.read(Spec({"limits": _limits(drive), "damper": damper, "noise": noise}))


def _limits(drive: str) -> Spec:
    unit = DRIVES.get(drive, VOLTAGE).unit
    kinds: dict[str, Any] = {
        **{name: partial(read_quantity, unit=unit) for name, unit in SIZES.items()},
        "slew": partial(read_quantity, unit=f"{unit}/s"),
        "band": partial(_several, "Hz", 2), "command": partial(_several, unit, 2),
        "levels": partial(_several, unit, 0), "runs": int,
        "motions": partial(_kinds, "motion", MOTIONS),
        "commands": partial(_kinds, "command", COMMANDS),
    }  # fmt: skip
    return Spec({one.name: Key(kinds[one.name], None) for one in fields(RigLimits)})


def read_quantity(given: object, unit: str) -> float:
    """Return a quantity [SI] from a number with its unit, such as "20 mm".

    Raises
    ------
    StudyError
        If it is no number with a unit of that kind, in words that follow its name.
    """
    right = f'expected a number with its unit, such as "{_EXAMPLES.get(unit, f"10 {unit}")}"'
    found = _QUANTITY.fullmatch(str(given))
    value, why = float("nan"), ""
    if found and (found[2] or not isinstance(given, str)):
        try:
            value = convert(float(found[1]), found[2] or unit, unit)
        except UnitError as error:
            why = f" ({error})"
    if not isfinite(value):
        raise StudyError(f"= {written(given)}: {right}{why}.")
    return value


def _positive(unit: str, given: object) -> float:
    if (found := read_quantity(given, unit)) <= 0.0:
        raise StudyError(f"= {written(given)}: expected more than 0 {unit}.")
    return found


def _several(unit: str, count: int, given: object) -> tuple[float, ...]:
    """Return the quantities of a list of so many, or of any number where `count` is 0."""
    if not isinstance(given, list | tuple) or not given or len(given) != (count or len(given)):
        right = '["0.2 Hz", "10 Hz"]' if unit == "Hz" else f'["0 {unit}", "5 {unit}"]'
        size = f"a list of {count}" if count else "a list"
        raise StudyError(f"is {_shown(given)}: expected {size}, such as {right}.")
    return tuple(read_quantity(one, unit) for one in given)


def _kinds(what: str, known: Mapping[str, object], given: object) -> tuple[str, ...]:
    """Return the names of waveforms."""
    if not isinstance(given, list | tuple) or not given:
        raise StudyError(f'is {_shown(given)}: expected a list, such as ["sine"].')
    names = [name for name in known if name != "record"]
    wrong = next((one for one in given if one not in names), None)
    if wrong is not None:
        raise StudyError(f"is wrong: {unknown(what, str(wrong), names)}")
    return tuple(given)


def _shown(given: object) -> str:
    if not isinstance(given, list | tuple):
        return written(given)
    return f"a list of {len(given)}" if given else "empty"
