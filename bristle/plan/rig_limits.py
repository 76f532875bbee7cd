"""What a rig can do: limits of its actuator, its amplifier and its recorder, from rig.toml."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ..data.files import Toml
from ..errors import StudyError, UnitError
from ..findings import unknown, written
from ..identify.model import Run
from ..physics.drive import DRIVES, VOLTAGE
from ..units import convert
from .motions import COMMANDS, MOTIONS

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
"""Units of the quantities of rig.toml, and what they are called there."""


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
        Energy that the damper may take up in a test [J].
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
        for name in (
            "stroke", "speed", "acceleration", "force", "duration", "heat", "rate",
            "damper_stroke", "drift",
        ):  # fmt: skip
            if not getattr(self, name) > 0.0:
                raise StudyError(
                    f"{name} = {getattr(self, name):g}: these limits allow no motion; more than 0 "
                    "is right."
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
    for name in given:
        if name not in _NAMES:
            raise StudyError(unknown("limit", name, _NAMES))
    return {name: _read(name, value, drive) for name, value in given.items()}


def read_quantity(text: str | float, unit: str, what: str) -> float:
    """Return a quantity [SI] from a number with its unit, such as "20 mm".

    Raises
    ------
    StudyError
        If it is no number with a unit of that kind.
    """
    right = f'a number with its unit is right, such as "{_example(unit)}"'
    found = _QUANTITY.fullmatch(str(text))
    if found is None or (isinstance(text, str) and not found[2]):
        raise StudyError(f"{what} = {written(text)}: {right}.")
    try:
        value = convert(float(found[1]), found[2] or unit, unit)
    except UnitError as error:
        raise StudyError(f"{what} = {written(text)}: {right} ({error}).") from None
    if not isfinite(value):
        raise StudyError(f"{what} = {written(text)}: {right}.")
    return value


_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
"""A number, and its unit if there is one."""


def _example(unit: str) -> str:
    table = {"m": "20 mm", "m/s": "200 mm/s", "N": "2 kN", "Hz": "500 Hz", "J": "200 J"}
    return table.get(unit, f"10 {unit}")


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
    toml = Toml(path)
    toml.schema()
    toml.known((), toml.data, ("schema", "limits", "damper", "noise"))
    table = toml.table((), toml.data, "limits")
    toml.known(("limits",), table, _NAMES)
    out: dict[str, Any] = {}
    for key, value in table.items():
        if key in _NAMES:
            try:
                out[key] = _read(key, value, drive)
            except StudyError as error:
                toml.error(("limits", key), str(error))
    toml.check()
    return out


_NAMES = tuple(one.name for one in fields(RigLimits))


def _read(name: str, value: Any, drive: str) -> Any:
    """Return a limit [SI] from what a user gives for it."""
    unit = DRIVES.get(drive, VOLTAGE).unit
    if name in ("band", "command", "levels"):
        return _several(value, "Hz" if name == "band" else unit, name)
    if name in ("motions", "commands"):
        return _kinds(value, name)
    if name == "runs":
        return _whole(value)
    return read_quantity(value, f"{unit}/s" if name == "slew" else SIZES[name], name)


def _several(value: Any, unit: str, what: str) -> tuple[float, ...]:
    """Return the quantities of a list."""
    right = '["0.2 Hz", "10 Hz"]' if unit == "Hz" else f'["0 {unit}", "5 {unit}"]'
    if not isinstance(value, list | tuple) or not value:
        raise StudyError(f"{what} is {_no_list(value)}; a list is right, such as {right}.")
    if what != "levels" and len(value) != 2:
        raise StudyError(f"{what} is a list of {len(value)}; two are right, such as {right}.")
    return tuple(read_quantity(one, unit, what) for one in value)


def _no_list(value: Any) -> str:
    return written(value) if value or not isinstance(value, list | tuple) else "empty"


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise StudyError(f"runs is {written(value)}; a whole number is right.")
    return value


def _kinds(value: Any, what: str) -> tuple[str, ...]:
    """Return the names of waveforms."""
    known = MOTIONS if what == "motions" else COMMANDS
    if not isinstance(value, list | tuple) or not value:
        raise StudyError(f'{what} is {_no_list(value)}; a list is right, such as ["sine"].')
    for one in value:
        if one not in known or one == "record":
            raise StudyError(unknown(what[:-1], one, [name for name in known if name != "record"]))
    return tuple(value)
