"""What a comparison of controllers says, in sentences."""

from __future__ import annotations

from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np

from ..core.text import quantity
from .setting import BEST, LIMIT

if TYPE_CHECKING:
    from .result import ControllerComparison

_ALIKE = 0.005
"""Share below which two values count as the same: no difference is told."""


def sentences(found: ControllerComparison) -> list[str]:
    """Return the verdict, a sentence each."""
    first = winner(found)
    texts = [_lowest(found, first), *_one_for_all(found, first), *_gap(found, first)]
    return [*texts, *_robust(found, first), *_stroke(found)]


def winner(found: ControllerComparison) -> str:
    """Return the controller that is lowest in most motions; of two, the lower on the mean."""
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


def _mean(found: ControllerComparison, name: str, reference: str = BEST) -> float:
    return fmean(found.value(m, name) / found.value(m, reference) for m in found.motions)


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
    text += f"; on the mean it lies {beside(_mean(found, first), _best(found))}"
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
        f"for all of them, {volts[at]:g} V, lies {beside(float(ratios[at]), 'it')} on the mean; "
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
    text += " on the mean" if len(found.motions) > 1 else ""
    if share > 0.0:
        text += f"; {first} closes {100.0 * share:.0f} % of that gap"
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
