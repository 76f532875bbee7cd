"""The paper's Figs 14 to 17: one ground motion each, laws side by side, over time.

The text tells what is in them: Fig. 14 Northridge 0.7 g with its ground motion, voltages and
responses without damper, clipped-optimal and H-infinity; Fig. 15 the same motion with 0 V and LPV,
its voltage and parameters; Fig. 16 Northridge 0.3 g and Fig. 17 El Centro 0.6 g without damper,
clipped and LPV with its parameters. The arrangement is this project's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.view.style import GREY, INK, PALE, Page

from .experiment import CLIPPED, EL_CENTRO, HINF, LPV, NONE, ZERO, Comparison
from .pictures import COLOUR, NOTE, mark, short, strong_part

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_Y, _X = "structure.floor2_acceleration_absolute", "structure.base_displacement"
_LASTS = 16.0
"""Length of the part of a run that is shown [s]."""


@dataclass(frozen=True)
class _Quantity:
    """What a panel shows: its title, unit, and how it follows from a run's frame in SI."""

    name: str
    unit: str
    of: Callable[[pd.DataFrame], Any]


_GROUND = _Quantity("ground acceleration", "m/s²", lambda f: f["ground.ground_acceleration"])
_VOLTAGE = _Quantity("voltage", "V", lambda f: f["controller.voltage"])
_TOP = _Quantity("acceleration of floor 2", "m/s²", lambda f: f[_Y])
_DRIFT = _Quantity("base drift", "mm", lambda f: 1e3 * f[_X])
_SPEED = _Quantity("parameter: base velocity", "mm/s",
                   lambda f: 1e3 * f["controller.scheduling"])  # fmt: skip
_RATE = _Quantity(
    "parameter: its rate of change", "m/s²",
    lambda f: f["structure.base_acceleration_absolute"] - f["ground.ground_acceleration"],
)  # fmt: skip
_RESPONSES = (_TOP, _DRIFT)

Panel = tuple[str, _Quantity]
"""A law and what is shown of it."""


def northridge_hinf(c: Comparison) -> Page | None:
    """Fig. 14: the strong Northridge case, clipped and H-infinity; None without a record."""
    rows = _beside((_VOLTAGE, *_RESPONSES), CLIPPED, HINF)
    return _northridge(c, [[(NONE, _GROUND)], *rows], strong=True)


def northridge_lpv(c: Comparison) -> Page | None:
    """Fig. 15: the same motion, 0 V and LPV with its voltage and parameter."""
    return _northridge(c, [*_beside(_RESPONSES, ZERO, LPV), [(LPV, _VOLTAGE)], _PARAMETER], True)


def northridge_weak(c: Comparison) -> Page | None:
    """Fig. 16: the weak Northridge case, clipped and LPV with its parameter."""
    rows = _beside((_VOLTAGE, *_RESPONSES), CLIPPED, LPV)
    return _northridge(c, [*rows, _PARAMETER], strong=False)


def el_centro(c: Comparison) -> Page | None:
    """Fig. 17: El Centro 0.6 g, clipped and LPV with its parameter."""
    return draw(c, (EL_CENTRO, 0.6), [*_beside((_VOLTAGE, *_RESPONSES), CLIPPED, LPV), _PARAMETER])


_PARAMETER: list[Panel] = [(LPV, _SPEED), (LPV, _RATE)]


def _beside(quantities: tuple[_Quantity, ...], *laws: str) -> list[list[Panel]]:
    """Return a row of panels per quantity, a column per law."""
    return [[(law, quantity) for law in laws] for quantity in quantities]


def _northridge(c: Comparison, rows: list[list[Panel]], strong: bool) -> Page | None:
    """Draw a case of the Northridge record at hand; None without one."""
    motion = c.strong[0]
    if motion == EL_CENTRO:
        return None
    intensities = next(m for m in c.motions if m.name == motion).intensities
    return draw(c, (motion, max(intensities) if strong else min(intensities)), rows)


def draw(c: Comparison, case: tuple[str, float], rows: list[list[Panel]]) -> Page:
    """Draw panels over time; responses stand before those without damper.

    Parameters
    ----------
    c : the runs
    case : motion and nominal intensity [g]
    rows : one or two panels each
    """
    laws = list(dict.fromkeys(law for row in rows for law, _ in row if law != NONE))
    free = c.frames[(*case, NONE)]
    begin, end = strong_part(free, longest=_LASTS)
    page = Page(10.0, 1.4 * len(rows) + 0.7, _title(c, case, laws), _subtitle(c, case, laws), NOTE)
    grid = page.grid(len(rows), 2, left=0.6, column_gap=0.5, row_gap=0.56)
    for place, row in enumerate(rows):
        heights = [_height(c, case, panel, begin, end) for panel in row]
        for column, (law, quantity) in enumerate(row):
            where = grid[place, column] if len(row) > 1 else grid[place, :]
            axes = page.figure.add_subplot(where)
            part = quantity.of(c.frames[(*case, law)]).loc[begin:end]
            if quantity in _RESPONSES:
                behind = quantity.of(free).loc[begin:end]
                axes.plot(behind.index, behind, color=PALE, linewidth=0.7, alpha=0.8)
            colour = COLOUR.get(law, INK) if law != NONE else INK
            axes.plot(part.index, part, color=colour, linewidth=0.9)
            same = len({panel[1] for panel in row}) == 1
            height = max(heights) if same else heights[column]
            _scale(axes, quantity, height, _stroke(c.frames[(*case, law)]))
            axes.set_xlim(begin, end)
            if quantity is not _VOLTAGE:
                mark(axes, part, quantity.unit)
            name = f"{short(law)}: {quantity.name}" if law != NONE else quantity.name
            axes.set_title(f"{name} [{quantity.unit}]", color=colour, fontsize=9)
            axes.tick_params(labelbottom=len(row) == 1 or place == len(rows) - 1)
            if place == len(rows) - 1:
                axes.set_xlabel("time [s]", loc="right", labelpad=0)
    return page


def _height(
    c: Comparison, case: tuple[str, float], panel: Panel, begin: float, end: float
) -> float:
    """Return the largest absolute value that a panel has to show."""
    law, quantity = panel
    return float(np.abs(quantity.of(c.frames[(*case, law)]).loc[begin:end]).max())


def _stroke(frame: pd.DataFrame) -> float:
    """Return the stroke of a run's damper [mm], infinite without a damper."""
    if "damper.stroke_ratio" not in frame:
        return float("inf")
    return 1e3 * float(frame[_X].abs().max() / frame["damper.stroke_ratio"].max())


def _scale(axes: Axes, quantity: _Quantity, height: float, stroke: float) -> None:
    """Set the limits of a panel; a large drift is shown with the damper's stroke [mm]."""
    if quantity is _VOLTAGE:
        axes.set_ylim(-0.5, 8.5)
        axes.set_yticks([0, 4, 8])
        return
    if quantity is _DRIFT and height > 0.8 * stroke:
        height = max(height, stroke)
        for limit in (-stroke, stroke):
            axes.axhline(limit, color=GREY, linewidth=0.7, linestyle=(0, (4, 3)))
        axes.text(1.0, stroke, "stroke ", transform=axes.get_yaxis_transform(), ha="right",
                  va="bottom", color=GREY, fontsize=7)  # fmt: skip
    axes.set_ylim(-1.35 * height, 1.35 * height)


def _title(c: Comparison, case: tuple[str, float], laws: list[str]) -> str:
    """Return the finding: the peak of floor 2 with each law, and without damper."""
    peaks = {law: float(c.frames[(*case, law)][_Y].abs().max()) for law in (NONE, *laws)}
    listed = " and ".join(f"{peaks[law]:.2f} m/s² with {short(law)}" for law in laws)
    return (
        f"{case[0]}, nominal {case[1]:g} g: floor 2 peaks at {listed}, "
        f"{peaks[NONE]:.2f} m/s² without damper"
    )


def _subtitle(c: Comparison, case: tuple[str, float], laws: list[str]) -> str:
    beyond = [law for law in laws if c.frames[(*case, law)]["damper.stroke_ratio"].max() > 1.0]
    texts = ["Grey: without damper, cut off where it is larger. Dots: largest values."]
    if beyond:
        listed = " and ".join(map(short, beyond))
        stroke = _stroke(c.frames[(*case, beyond[0])])
        texts.append(f"With {listed} the base leaves the damper's stroke of {stroke:.0f} mm.")
    return " ".join(texts)
