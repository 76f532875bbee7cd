"""What a comparison of controllers came to: its tables, and what they say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np

from ..campaign.campaign import Statistic
from ..core.files import writing
from ..core.text import percent, quantity
from ..errors import not_usable
from ..view import Viewable
from .runs import CaseRunner, Reached, Spread
from .setting import (
    BEST,
    LIMIT,
    OFF,
    ON,
    CommandedDamper,
    ComparedController,
    ComparedMotion,
    DamperPlace,
)

if TYPE_CHECKING:
    import pandas as pd


REFERENCES = (OFF, ON, BEST)


@dataclass(frozen=True)
class Setting:
    """What was compared: building, damper, controllers, motions, what is judged.

    `folder` holds the scenarios, None where nothing was kept; `varied` says in words how members
    differ, "" without.
    """

    site: DamperPlace
    damper: CommandedDamper
    candidates: list[ComparedController]
    motions: list[ComparedMotion]
    judged: Statistic
    spread: Spread | None
    folder: Path | None
    varied: str = ""


@dataclass(frozen=True, repr=False)
class ControllerComparison(Viewable):
    """Controllers under ground motions, beside constant voltages.

    Attributes
    ----------
    setting : Setting
        What was compared.
    outputs : tuple of Statistic
        What is kept of every run.
    table : DataFrame
        A row per motion and controller: motion, controller, engine, level (of a constant voltage
        [V]), stroke (largest displacement over the damper's stroke [1]), and a column per output,
        "peak structure.drift1", in SI units (`units`).
    worst : DataFrame or None
        Likewise the largest over each case and its members, and how many members failed.
    levels : mapping
        By motion: the same outputs at constant voltages, by the voltage [V].
    limits : mapping
        By motion what is known of its limit; empty where it was not asked for.
    frames : mapping
        By motion and controller the run, by time [s].
    notes : tuple of str
        What a reader has to know.
    seconds : float
    """

    setting: Setting
    outputs: tuple[Statistic, ...]
    table: pd.DataFrame
    worst: pd.DataFrame | None
    levels: Mapping[str, pd.DataFrame] = field(repr=False)
    limits: Mapping[str, Reached]
    frames: Mapping[tuple[str, str], pd.DataFrame] = field(repr=False)
    notes: tuple[str, ...]
    seconds: float

    @property
    def motions(self) -> list[str]:
        """The names of the motions."""
        return [one.name for one in self.setting.motions]

    @property
    def controllers(self) -> list[str]:
        """The names of the controllers, as they were given."""
        return [one.name for one in self.setting.candidates]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each output by its name."""
        return {one.name: one.unit for one in self.outputs}

    @property
    def verdict(self) -> list[str]:
        """What the comparison says, a sentence each, the first one first."""
        return sentences(self)

    def value(self, motion: str, controller: str, output: str = "") -> float:
        """Return what a case has of an output; else of the one that is judged."""
        rows = self.table
        row = rows[(rows["motion"] == motion) & (rows["controller"] == controller)]
        return float(row[output or self.setting.judged.name].iloc[0])

    def worst_value(self, motion: str, controller: str) -> float:
        """Return the worst of what is judged of a case; NaN without members."""
        if self.worst is None or controller == LIMIT:
            return float("nan")
        rows = self.worst
        row = rows[(rows["motion"] == motion) & (rows["controller"] == controller)]
        return float(row[self.setting.judged.name].iloc[0])

    def shares(self, reference: str = BEST) -> pd.DataFrame:
        """Return what is judged over that of a reference, by motion (rows) and controller.

        Parameters
        ----------
        reference : "passive off", "passive on" or "best constant"
        """
        name = self.setting.judged.name
        wide = self.table.pivot(index="motion", columns="controller", values=name)
        order = list(dict.fromkeys(self.table["controller"]))
        return wide.loc[self.motions, order].div(wide[reference].loc[self.motions], axis=0)

    def write(self, folder: str | Path) -> list[Path]:
        """Write the tables as CSV: comparison.csv, and worst.csv with members; return their paths.

        Raises
        ------
        RunError
            If they cannot be written, exit code 2.
        """
        folder = Path(folder)
        titles = {n: f"{n} [{u}]" for n, u in {**self.units, "level": "V", "stroke": "1"}.items()}
        frames = {"comparison.csv": self.table.rename(columns=titles)}
        if self.worst is not None:
            frames["worst.csv"] = self.worst.rename(columns=titles)
        with writing(folder, not_usable):
            folder.mkdir(parents=True, exist_ok=True)
            for name, frame in frames.items():
                frame.to_csv(folder / name, index=False, float_format="%.9g")
        return [folder / name for name in frames]


# What a reader of a comparison has to know of it, in sentences.


def of_designs(candidates: list[ComparedController]) -> list[str]:
    """Say which designs were made by the comparison, and why."""
    anew = [one.name for one in candidates if one.redesigned]
    if not anew:
        return []
    return [
        f"{', '.join(anew)}: the library's designs belong to its own building and damper. New ones "
        "were made for these, with the same weights brought to their size; a design file with "
        "weights of your own may find better ones (bristle design)."
    ]


def of_engines(bench: CaseRunner, candidates: list[ComparedController]) -> list[str]:
    """Say where two engines stand side by side."""
    stepped = [one.name for one in candidates if bench.engine_of(one) == "fmu"]
    if not stepped or len(stepped) == len(candidates):
        return []
    return [
        f"{', '.join(stepped)}: stepped as FMUs every {1e3 * bench.step:g} ms. The others are "
        "solved as one system, without coupling error; the engine fmu steps all of them."
    ]


# What it says, in sentences.

_ALIKE = 0.005
"""Share below which two values count as the same: no difference is told."""


def sentences(found: ControllerComparison) -> list[str]:
    """Return the verdict, a sentence each."""
    first = winner(found)
    texts = [_lowest(found, first), *_one_for_all(found, first), *_gap(found, first)]
    return [*texts, *_robust(found, first), *_stroke(found)]


def winner(found: ControllerComparison) -> str:
    """Return the controller that is lowest in most motions; of two, the lower on average."""
    wins = dict.fromkeys(found.controllers, 0)
    for motion in found.motions:
        wins[min(found.controllers, key=lambda c, m=motion: found.value(m, c))] += 1  # type: ignore[misc]
    return min(found.controllers, key=lambda c: (-wins[c], _mean(found, c)))


def what(found: ControllerComparison) -> str:
    """Return what is judged, in words: "peak acceleration of floor2"."""
    judged = found.setting.judged
    component, _, port = judged.column.partition(".")
    statistic = {"rms": "RMS"}.get(judged.statistic, judged.statistic)
    for ending, words in (("_acceleration_absolute", "acceleration"),
                          ("_displacement", "displacement")):  # fmt: skip
        if port.endswith(ending):
            return f"{statistic} {words} of {port.removesuffix(ending)}"
    return f"{statistic} {port.replace('_', ' ')}" + (f" of {component}" * (port == "force"))


def beside(share: float, other: str) -> str:
    """Return a value over another in words: "18 % below NAME"."""
    if abs(share - 1.0) < _ALIKE:
        return f"as high as {other}"
    return f"{abs(100.0 * (1.0 - share)):.0f} % {'below' if share < 1.0 else 'above'} {other}"


def _mean(found: ControllerComparison, name: str) -> float:
    return fmean(found.value(m, name) / found.value(m, BEST) for m in found.motions)


def _lowest(found: ControllerComparison, first: str) -> str:
    """Say which controller is lowest, and whether the best constant voltage is lower still."""
    count = len(found.motions)
    if count == 1:
        motion = found.motions[0]
        value = _shown(found, found.value(motion, first))
        return (
            f"{first} has the lowest {what(found)} under {motion}: {value}, "
            f"{beside(found.value(motion, first) / found.value(motion, BEST), _best(found))}."
        )
    order = {m: min(found.controllers, key=lambda c, m=m: found.value(m, c)) for m in found.motions}  # type: ignore[misc]
    wins = sum(one == first for one in order.values())
    below = sum(found.value(m, first) < found.value(m, BEST) for m in found.motions)
    text = f"{first} has the lowest {what(found)} of the controllers in {wins} of {count} motions"
    if len(found.controllers) == 1:
        text = f"{first} is below the best constant voltage in {below} of {count} motions"
    text += f"; on average it lies {beside(_mean(found, first), _best(found))}"
    best = min(found.controllers, key=lambda c: _mean(found, c))
    if best != first and _mean(found, first) - _mean(found, best) > _ALIKE:
        text += f", {best} {beside(_mean(found, best), 'it')}"
    return f"{text}."


def _best(found: ControllerComparison) -> str:
    return "the best constant voltage" + ("" if len(found.motions) == 1 else " of each motion")


def _one_for_all(found: ControllerComparison, first: str) -> list[str]:
    """Say what one constant voltage for all motions reaches: the best of each knows the motion."""
    if len(found.motions) == 1:
        return [
            "The best constant voltage was chosen with the motion known, "
            f"{_level(found, found.motions[0]):g} V."
        ]
    name = found.setting.judged.name
    ratios = np.mean(
        [found.levels[m][name].to_numpy() / found.value(m, BEST) for m in found.motions], axis=0
    )
    volts = found.levels[found.motions[0]].index.to_numpy()
    at = int(np.argmin(ratios))
    own = _mean(found, first) / float(ratios[at])
    return [
        "The best constant voltage of each motion was chosen with the motion known. One voltage "
        f"for all of them, {volts[at]:g} V, lies {beside(float(ratios[at]), 'it')} on average; "
        f"{first} is {beside(own, 'that')}."
    ]


def _level(found: ControllerComparison, motion: str) -> float:
    rows = found.table
    row = rows[(rows["motion"] == motion) & (rows["controller"] == BEST)]
    return float(row["level"].iloc[0])


def _gap(found: ControllerComparison, first: str) -> list[str]:
    """Say how much of what any control could gain the first one gains."""
    if not found.limits:
        return []
    lowest = _mean(found, LIMIT)
    share = (1.0 - _mean(found, first)) / (1.0 - lowest) if lowest < 1.0 else float("nan")
    text = f"The limit, with the motion known, lies {beside(lowest, 'the best constant voltage')}"
    text += " on average" if len(found.motions) > 1 else ""
    if share > 0.0:
        text += f"; {first} closes {percent(share, 0)} of that gap"
    unsure = [motion for motion, one in found.limits.items() if not one.sure]
    texts = [f"{text}."]
    if unsure:
        texts.append(f"The limit is not sure under {', '.join(unsure)}.")
    return texts


def _robust(found: ControllerComparison, first: str) -> list[str]:
    """Say what the worst members do, and whether the order stays."""
    spread = found.setting.spread
    if spread is None:
        return []

    def worst(name: str) -> float:
        return fmean(found.worst_value(m, name) / found.value(m, BEST) for m in found.motions)

    own = fmean(found.worst_value(m, first) / found.value(m, first) for m in found.motions)
    best = min(found.controllers, key=worst)
    same = worst(best) / fmean(found.worst_value(m, BEST) / found.value(m, BEST)
                               for m in found.motions)  # fmt: skip
    text = (
        f"With {found.setting.varied} ({spread.members} members), the worst case of {first} lies "
        f"{beside(own, 'its own value')}. "
    )
    text += f"{best} has the lowest worst case" if best != first else "Its worst case is the lowest"
    return [f"{text} of the controllers, {beside(same, 'that of the best constant voltage')}."]


def _stroke(found: ControllerComparison) -> list[str]:
    """Say which runs leave the damper's stroke: no end stop is in the model there."""
    beyond = found.table[found.table["stroke"] > 1.0]
    if beyond.empty:
        return []
    most = beyond.iloc[int(np.argmax(beyond["stroke"].to_numpy()))]
    return [
        f"In {len(beyond)} of {len(found.table)} runs the displacement leaves the damper's stroke, "
        f"most with {most['controller']} under {most['motion']}, {most['stroke']:.2f} times the "
        "stroke. The model has no end stop there: these rows hold for a longer damper."
    ]


def _shown(found: ControllerComparison, value: float) -> str:
    return quantity(value, found.setting.judged.unit).replace("m/s2", "m/s²")
