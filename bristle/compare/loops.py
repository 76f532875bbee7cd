"""Loops of single cycles, by the level of the command: measured against model, with its band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from ..data.labels import label_text
from ..draw.cycles import by_level, cycles, steady
from ..draw.style import BLUE, GREY, INK, short_z, zero_lines
from ..identify.search import z_scale
from ..physics.drive import DRIVES
from ..quantity import plain, quantity
from .coordinates import SHOWN
from .names import name_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .prediction import RunPrediction

Array = NDArray[np.float64]

MOST = 4
"""Cycles side by side."""
OVERS = ("velocity", "displacement")
"""What loops are drawn over."""
BAND = "#cfe3f1"
"""The band in which a true model's measurement would be."""
_VARIES = 1e-2
"""Range of a command, over its largest value, from which on it tells cycles apart."""
_OFF = 5e-3
"""Share of its largest value below which a command is off."""


class OneCycle(NamedTuple):
    """A cycle of a run to draw: which samples, its level in words, and its error over noise."""

    prediction: RunPrediction
    part: slice
    text: str
    z: float


def chosen_cycles(predictions: Sequence[RunPrediction], most: int = MOST) -> list[OneCycle]:
    """Return one cycle in each range of the command.

    Where no command varies, of a number that is known of whole runs, such as their temperature or
    frequency; where none is, of speed. Nothing where displacement and velocity are not known.

    Parameters
    ----------
    predictions : runs of one output at one site
    most : cycles at the most
    """
    if not all({*OVERS} <= {*one.coordinates} for one in predictions):
        return []
    name, told = _level(predictions)
    motions = [
        (one.coordinates["displacement"], one.coordinates["velocity"], one.coordinates[name])
        for one in predictions
    ]
    skip = max(one.skip for one in predictions)
    found = [one for one in cycles(motions, skip) if _whole(predictions[one.run], one.part)]
    if name == "speed":  # the median of a cycle is no measure of how fast it is
        found = [
            one._replace(level=_peak(motions[one.run][1][one.part]), spread=0.0) for one in found
        ]
    out = []
    for one in by_level(found, most):
        of = predictions[one.run]
        text = told(one.level)
        if name != "speed" and not steady(one, found):
            low, high = np.quantile(motions[one.run][2][one.part], [0.05, 0.95])
            text = f"{told(low).partition(' ')[0]} to {told(high)}"
        out.append(OneCycle(of, one.part, text, z_of(of, one.part)))
    return out


def under(shown: Sequence[OneCycle], predictions: Sequence[RunPrediction]) -> list[OneCycle]:
    """Return the same cycles as another model predicts them.

    Parameters
    ----------
    shown : cycles
    predictions : the same runs under the other model
    """
    by_name = {one.name: one for one in predictions}
    there = [one._replace(prediction=by_name[one.prediction.name]) for one in shown]
    return [one._replace(z=z_of(one.prediction, one.part)) for one in there]


def z_of(of: RunPrediction, part: slice) -> float:
    """Return error / noise of a part of a run."""
    if not of.noise_known:
        return float("nan")
    return z_scale((of.measured - of.predicted)[part] / of.sigma[part])


def _peak(v: Array) -> float:
    return float(np.max(np.abs(v)))


def _whole(of: RunPrediction, part: slice) -> bool:
    """Return whether all samples of a part were measured, one after the other."""
    known = of.known is None or bool(np.all(of.known[part]))
    return known and (of.index is None or bool(np.all(np.diff(of.index[part]) == 1)))


def _level(predictions: Sequence[RunPrediction]) -> tuple[str, Any]:
    """Return the coordinate that tells cycles apart, and what says one of its values."""
    drive = predictions[0].drive
    if all(drive in one.coordinates for one in predictions):
        values = np.concatenate([one.coordinates[drive] for one in predictions])
        if float(np.ptp(values)) > _VARIES * float(np.max(np.abs(values))) > 0.0:
            largest = float(np.max(np.abs(values)))
            unit = DRIVES[drive].unit

            def level(value: float) -> str:
                off = abs(value) < _OFF * largest  # noise about zero is no command
                return f"{plain(0.0 if off else value)} {unit}"

            return drive, level
    for name in predictions[0].labels:  # what is known of whole runs, such as a temperature
        known = [one.labels.get(name, "") for one in predictions if name in one.coordinates]
        numbers = [one for one in known if not isinstance(one, str)]
        if len(numbers) == len(predictions) and max(numbers) > min(numbers):
            return name, lambda value, name=name: f"{name} {label_text(name, value)}"
    return "speed", lambda value: f"up to {quantity(value, 'm/s', 2)}"


def draw_cycle(
    axes: Axes,
    one: OneCycle,
    over: str,
    *,
    force: tuple[float, str] = (1.0, "N"),
    band: bool = True,
) -> None:
    """Draw a cycle, measured and predicted, in the band of 95 % of a true model's samples.

    Parameters
    ----------
    axes : where to draw
    one : the cycle
    over : name of the coordinate
    force : factor from SI and unit in which the output is shown
    """
    of, (factor, _) = one.prediction, force
    x = SHOWN.get(over, (1.0, ""))[0] * of.coordinates[over][one.part]
    predicted = factor * of.predicted[one.part]
    zero_lines(axes)
    half = 1.96 * factor * of.sigma[one.part]
    pieces = [*ribbon(x, predicted - half, predicted + half)]
    axes.add_collection(PolyCollection(pieces, facecolors=BAND, lw=0.0))
    axes.plot(x, factor * of.measured[one.part], color=INK, lw=1.5, alpha=0.85)
    axes.plot(x, predicted, color=BLUE, lw=1.2)
    axes.text(
        0.03, 0.97, f"z = {short_z(one.z)}", transform=axes.transAxes, va="top", fontsize=8.0,
        color=GREY,
    )  # fmt: skip
    axes.tick_params(labelsize=8)


def ribbon(x: Array, low: Array, high: Array) -> Array:
    """Return the corners (n - 1, 4, 2) of the pieces of a band along a curve that turns back.

    Parameters
    ----------
    x, low, high : (n,) of the curve, and the edges of its band
    """
    lower, upper = np.stack([x, low], axis=1), np.stack([x, high], axis=1)
    return np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1)


def draw_loops(
    rows: Mapping[str, Sequence[Axes]], shown: Sequence[OneCycle], *, force: tuple[float, str]
) -> None:
    """Draw cycles side by side, one row per coordinate, all panels of a row on one scale.

    Parameters
    ----------
    rows : coordinate to one axes per cycle
    shown : the cycles
    force : factor from SI and unit in which the output is shown
    """
    for number, (over, panels) in enumerate(rows.items()):
        site = shown[0].prediction.site
        axis = name_of(over, site).removeprefix("the ")
        for panel, one in zip(panels, shown, strict=False):
            draw_cycle(panel, one, over, force=force)
            panel.set_xlabel(f"{axis} [{SHOWN.get(over, (1.0, ''))[1]}]", fontsize=8)
            if number == 0:
                panel.set_title(one.text, fontsize=9.5)
                begin = one.prediction.time[one.part.start]
                panel.set_title(
                    f"{one.prediction.name}, {begin:.3g} s", loc="right", fontsize=7, color=GREY
                )
        _alike(panels)


def _alike(panels: Sequence[Axes]) -> None:
    """Give panels side by side the same ranges; only the first one names its values."""
    spans = [(panel.get_xlim(), panel.get_ylim()) for panel in panels]
    for number, panel in enumerate(panels):
        panel.set_xlim(min(x[0] for x, _ in spans), max(x[1] for x, _ in spans))
        panel.set_ylim(min(y[0] for _, y in spans), max(y[1] for _, y in spans))
        if number:
            panel.tick_params(labelleft=False)
