"""The worst case: each controller with building, damper and sensors other than it was told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from ..campaign.distributions import Distribution, share
from ..core.text import percent
from ..core.toml_lines import toml_table
from ..errors import ScenarioError
from ..fmu.controller import SAMPLE_PERIOD
from ..physics.laws import LAWS
from ..system.scenario import load_scenario
from .runs import SEED, SENSORS, CaseRunner
from .setting import (
    DAMPER,
    ENSEMBLES,
    FILES,
    STRUCTURE,
    ComparedController,
    ComparedMotion,
    ComponentTable,
    plain_name,
)

if TYPE_CHECKING:
    import pandas as pd

_BUILDING = f"{STRUCTURE}.building"


@dataclass(frozen=True)
class Spread:
    """How far reality may lie from what a controller was told.

    Attributes
    ----------
    members : int
        How many buildings, dampers and sensors are drawn, the same for all controllers.
    share : float
        Each mass, each stiffness and each parameter of the damper's law lies within this share of
        its value to either side, evenly.
    noise : float
        RMS of the noise of each measured signal, as a share of the signal's RMS.
    delay : float
        Each measured signal lags by up to this time [s], evenly.

    Raises
    ------
    ScenarioError
        If a number is out of place.
    """

    members: int = 20
    share: float = 0.1
    noise: float = 0.01
    delay: float = 0.004

    def __post_init__(self) -> None:
        if isinstance(self.members, bool) or not isinstance(self.members, int) or self.members < 2:
            raise ScenarioError(f"--ensemble {self.members}: 2 or more members are right.")
        for name, value, most in (("spread", self.share, 0.9), ("noise", self.noise, 1.0),
                                  ("delay", self.delay, 1.0)):  # fmt: skip
            if not (isfinite(value) and 0.0 <= value <= most):
                raise ScenarioError(f"--{name} {value:g}: 0 to {most:g} is right.")
        if not (self.share or self.noise or self.delay):
            raise ScenarioError("--spread, --noise and --delay are 0: nothing varies.")

    def text(self, building: bool = True, damper: bool = True) -> str:
        """Return in words what varies, where the building and the damper's law do or do not."""
        parts = []
        what = [*(["masses", "stiffnesses"] * building), *(["damper parameters"] * damper)]
        if self.share and what:
            *before, last = what
            listed = " and ".join([", ".join(before), last] if before else [last])
            parts.append(f"{listed} within {percent(self.share, 0)}")
        if self.noise:
            parts.append(f"sensor noise of {percent(self.noise, 0)} of each signal")
        if self.delay:
            parts.append(f"sensor delays up to {1e3 * self.delay:g} ms")
        return ", ".join(parts)


def worst_of(
    bench: CaseRunner,
    motion: ComparedMotion,
    candidate: ComparedController,
    nominal: pd.DataFrame,
    spread: Spread,
    building: bool = True,
) -> tuple[dict[str, float], int]:
    """Return the largest of what is kept over a case and its members; how many members failed.

    Parameters
    ----------
    bench, motion, candidate : the case
    nominal : its run
    spread : what varies
    building : whether the building does
    """
    most = bench.measured(nominal)
    sensors = _sensors(bench, candidate, nominal, spread)
    vary = _varied(bench, candidate, motion, spread, building)
    if sensors is not None:
        vary[f"{SENSORS}.seed"] = {"integers": [1, 10**6]}
        if spread.delay:
            for name in candidate.wires:
                if name in bench.site.measured:
                    vary[f"{SENSORS}.{name}.delay"] = {"uniform": [0.0, spread.delay]}
    if not vary:
        return most, 0
    folder = bench.folder
    base = folder.at(ENSEMBLES, motion.name, f"{plain_name(candidate.name)}_scenario.toml")
    folder.write(base, bench.text(motion, candidate, sensors))
    file = folder.at(ENSEMBLES, motion.name, f"{plain_name(candidate.name)}.toml")
    found, failed = bench.many(file, candidate, base, spread.members, {"vary": vary})
    for name in most:
        if len(found):
            most[name] = max(most[name], float(found[name].max()))
    return most, failed


def tied(bench: CaseRunner, candidates: list[ComparedController]) -> list[str]:
    """Return the controllers with which no other building can be run: FMUs refuse it."""
    return [one.name for one in candidates if one.carries and bench.engine_of(one) == "fmu"]


def varied(bench: CaseRunner, candidates: list[ComparedController], spread: Spread) -> str:
    """Return in words what varies in a comparison."""
    building = "masses" in bench.site.data and not tied(bench, candidates)
    return spread.text(building, bool(bench.damper.law))


def unvaried(bench: CaseRunner, candidates: list[ComparedController], spread: Spread) -> list[str]:
    """Return what is not varied, a sentence each."""
    names = tied(bench, candidates)
    if not spread.share:
        return []
    if "masses" not in bench.site.data:
        return ["The building is given as matrices, which are not varied."]
    if not names:
        return []
    return [
        f"{', '.join(names)}: the design belongs to the building, and FMUs refuse another one. So "
        "masses and stiffnesses are not varied for any controller. With the engine compiled and "
        "the controller's file in place of its FMU they are."
    ]


def _sensors(
    bench: CaseRunner, candidate: ComparedController, nominal: pd.DataFrame, spread: Spread
) -> ComponentTable | None:
    """Return the instruments of a controller, None where it measures nothing."""
    sensed = [name for name in candidate.wires if name in bench.site.measured]
    if not sensed or not (spread.noise or spread.delay):
        return None
    period = candidate.period or SAMPLE_PERIOD
    parameters: dict[str, Any] = {"sample_period": period, "seed": 1}
    for name in sensed:
        column = bench.site.measured[name]
        values = nominal[column].to_numpy()
        deviation = spread.noise * float(np.sqrt(np.mean(np.square(values))))
        parameters[f"{name}.noise_density"] = float(f"{deviation * sqrt(2.0 * period):.6g}")
    return ComponentTable({"fmu": "Sensors"}, parameters)


def _varied(
    bench: CaseRunner,
    candidate: ComparedController,
    motion: ComparedMotion,
    spread: Spread,
    building: bool,
) -> dict[str, Any]:
    """Return what varies of building and damper, as an ensemble file has it."""
    found: dict[str, Any] = {}
    if not spread.share:
        return found
    values = _numbers(bench.site.data) if building else {}
    if bench.engine_of(candidate) == "compiled":
        found = {f"{_BUILDING}.{name}": _around(value, spread) for name, value in values.items()}
    elif values:
        found[_BUILDING] = {"each": _written(bench, motion, values, candidate, spread)}
    if not bench.damper.law:
        return found
    declared = LAWS[bench.damper.law].parameters
    for name, value in bench.damper.values.items():
        low, high = declared[name].bounds
        ends = [max(low, _around(value, spread)["uniform"][0]),
                min(high, _around(value, spread)["uniform"][1])]  # fmt: skip
        if ends[0] < ends[1]:
            found[f"{DAMPER}.{name}"] = {"uniform": ends}
    return found


def _numbers(data: dict[str, Any]) -> dict[str, float]:
    """Return the masses and stiffnesses of a building by the names of ensembles."""
    return {
        f"{key}.{i}": float(value)
        for key in ("masses", "stiffnesses")
        for i, value in enumerate(data.get(key, ()))
    }


def _around(value: float, spread: Spread) -> dict[str, list[float]]:
    ends = sorted((value * (1.0 - spread.share), value * (1.0 + spread.share)))
    return {"uniform": [float(f"{end:.9g}") for end in ends]}


def _written(
    bench: CaseRunner,
    motion: ComparedMotion,
    values: dict[str, float],
    candidate: ComparedController,
    spread: Spread,
) -> list[str]:
    """Write the members' buildings as files: an FMU contains its building; return their names."""
    system = load_scenario(bench.write(motion, candidate))
    names = []
    for run in range(spread.members):
        drawn = {
            f"{_BUILDING}.{name}": Distribution(
                "uniform", tuple(_around(value, spread)["uniform"])
            ).draw(share(SEED, run, f"{_BUILDING}.{name}"))
            for name, value in values.items()
        }
        path = bench.folder.path / FILES / f"building_{run:03d}.toml"
        building = system.with_values(drawn).components[STRUCTURE].building
        assert isinstance(building, Mapping)
        bench.folder.write(path, "\n".join(toml_table(building)) + "\n")
        names.append(f"../../{FILES}/{path.name}")
    return names
