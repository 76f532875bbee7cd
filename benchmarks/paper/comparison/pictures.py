"""The paper's Figs 13 to 17 drawn anew from the runs of the comparison, and a summary of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.view.style import BLUE, GREEN, GREY, INK, PALE, RECONSTRUCTED, VERMILION, Page, label

from .experiment import (
    CLIPPED,
    CONTROLLERS,
    EL_CENTRO,
    FOUR,
    HINF,
    LPV,
    LPV_0,
    LPV_400,
    NONE,
    ZERO,
    Comparison,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

COLOUR = {NONE: PALE, ZERO: GREY, FOUR: INK, CLIPPED: VERMILION, HINF: GREEN, LPV: BLUE}
_MARKERS = {FOUR: ("|", 12), CLIPPED: ("s", 6), HINF: ("D", 5), LPV: ("o", 6)}
SHORT = {HINF: "H-infinity", CLIPPED: "clipped"}
NOTE = (
    RECONSTRUCTED
    + " Ground motion: 0.45 of its nominal peak, reconstructed as well. The arrangement of "
    "this figure is ours."
)
_Y, _X = "structure.floor2_acceleration_absolute", "structure.base_displacement"
_PEAK_Y, _RMS_Y = "peak floor 2 acceleration [m/s2]", "rms floor 2 acceleration [m/s2]"


def short(law: str) -> str:
    """Return a law's name as labels have room for it."""
    return SHORT.get(law, law)


def anti_windup(c: Comparison) -> Page:
    """Fig. 13: command, voltage and acceleration with three anti-windup rates."""
    case = c.strong
    laws = {0.0: LPV_0, 200.0: LPV, 400.0: LPV_400}
    frames = {
        rate: c.frames[(*case, law)] for rate, law in laws.items() if (*case, law) in c.frames
    }
    peaks = {rate: float(frame[_Y].abs().max()) for rate, frame in frames.items()}
    best = min(peaks, key=lambda rate: peaks[rate])
    change = 100.0 * (1.0 - peaks[best] / peaks[0.0])
    commands = {rate: float(f["controller.command_raw"].abs().max()) for rate, f in frames.items()}
    title = (
        f"Anti-windup keeps the command within {max(commands[r] for r in commands if r):.1f} V "
        f"instead of {commands[0.0]:.1f} V, and takes {change:.0f} % off the peak of floor 2"
        if change > 0.0
        else "Anti-windup bounds the command and does not lower the peak of floor 2"
    )
    subtitle = (
        f"{case[0]}, nominal {case[1]:g} g, LPV controller. Orange: the signed voltage that "
        "the controller asks for. Blue: what the damper gets, with the sign of the velocity."
    )
    begin, end = strong_part(frames[0.0])
    page = Page(10.0, 5.0, title, subtitle, NOTE)
    grid = page.grid(2, len(frames), left=0.5, column_gap=0.25, row_gap=0.5)
    first: list[Any] = [None, None]
    for column, (rate, frame) in enumerate(frames.items()):
        part = frame.loc[begin:end]
        for row in range(2):
            axes = page.figure.add_subplot(grid[row, column], sharey=first[row])
            first[row] = first[row] or axes
            axes.tick_params(labelleft=column == 0, labelbottom=row == 1)
            axes.axhline(0.0, color=PALE, linewidth=0.8, zorder=1)
            axes.set_xlim(begin, end)
            if row == 0:
                signed = np.sign(part["structure.base_velocity"]) * part["controller.voltage"]
                for limit in (-8.0, 8.0):
                    axes.axhline(limit, color=GREY, linewidth=0.7, linestyle=(0, (4, 3)))
                axes.plot(part.index, part["controller.command_raw"], color=VERMILION, alpha=0.45)
                axes.plot(part.index, signed, color=BLUE, linewidth=1.0)
                axes.set_title(f"λ = {rate:g} 1/s: signed voltage [V]")
            else:
                axes.plot(part.index, part[_Y], color=BLUE, linewidth=1.0)
                mark(axes, part[_Y], "m/s²")
                axes.set_title("acceleration of floor 2 [m/s²]")
                axes.set_xlabel("time [s]", loc="right", labelpad=0)
                axes.margins(y=0.16)
    return page


def summary(c: Comparison) -> Page:
    """Return peak and RMS of floor 2 with every law, as shares of those at 0 V."""
    table: Any = c.table.set_index(["motion", "intensity [g]", "law"])
    cases = [(m.name, g) for m in c.motions for g in m.intensities]
    laws = (FOUR, *CONTROLLERS)
    lowest = [min(CONTROLLERS, key=lambda law, k=k: table.loc[(*k, law), _PEAK_Y]) for k in cases]  # type: ignore[misc]
    count = {law: lowest.count(law) for law in CONTROLLERS}
    first = max(count, key=lambda law: count[law])
    title = (
        f"Of the three controllers, {short(first)} has the lowest peak in {count[first]} of "
        f"{len(cases)} cases; which one is best depends on the record"
        if count[first] < len(cases)
        else f"Of the three controllers, {short(first)} has the lowest peak in every case"
    )
    subtitle = (
        "Acceleration of floor 2 as a share of that at 0 V, over the whole record. Ring: the "
        "lowest of the three controllers."
    )
    page = Page(10.0, 0.42 * len(cases) + 1.35, title, subtitle, NOTE)
    grid = page.grid(1, 2, left=1.9, column_gap=0.3, top=0.75, bottom=0.35)
    shared: Axes | None = None
    for place, (quantity, name) in enumerate(((_PEAK_Y, "peak"), (_RMS_Y, "RMS"))):
        axes = page.figure.add_subplot(grid[0, place], sharey=shared)
        shared = shared or axes
        for row, case in enumerate(cases):
            base = table.loc[(*case, ZERO), quantity]
            shares = {law: 100.0 * table.loc[(*case, law), quantity] / base for law in laws}
            axes.plot([min(shares.values()), max(shares.values())], [row, row], color=PALE,
                      linewidth=1.0, zorder=1)  # fmt: skip
            best = min(CONTROLLERS, key=lambda law: shares[law])
            axes.plot(shares[best], row, "o", markersize=12, markerfacecolor="none",
                      markeredgecolor=GREY, markeredgewidth=0.9)  # fmt: skip
            for law in laws:
                marker, size = _MARKERS[law]
                axes.plot(shares[law], row, marker, color=COLOUR[law], markersize=size,
                          markeredgewidth=1.6, linestyle="none",
                          label=short(law) if row == 0 else None)  # fmt: skip
        axes.axvline(100.0, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.set_title(f"{name} [% of that at 0 V]")
        axes.set_yticks(range(len(cases)), [f"{motion} {g:g} g" for motion, g in cases])
        axes.tick_params(labelleft=place == 0, left=False)
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_ylim(len(cases) - 0.4, -0.6)
    handles, names = shared.get_legend_handles_labels() if shared else ([], [])
    corner = (1.0 - 0.25 / page.width, 1.0 - page.head / page.height)
    page.figure.legend(handles, names, loc="upper right", ncols=len(names), fontsize=8.5,
                       bbox_to_anchor=corner,
                       handletextpad=0.2, columnspacing=1.2)  # fmt: skip
    return page


def mark(axes: Axes, values: pd.Series[Any], unit: str) -> None:
    """Mark the largest absolute value of a history, with its unit."""
    place = int(np.argmax(np.abs(values.to_numpy())))
    at, value = float(values.index.to_numpy()[place]), float(values.to_numpy()[place])
    axes.plot(at, value, "o", color=VERMILION, markersize=4, zorder=4)
    low, high = axes.get_xlim()
    left = at > low + 0.6 * (high - low)
    text = f"{abs(value):#.3g}".rstrip(".")
    label(axes, f"{text} {unit}", at, value, VERMILION, fontsize=8,
          xytext=(-5 if left else 5, 0), ha="right" if left else "left", va="center")  # fmt: skip


def strong_part(frame: pd.DataFrame, longest: float = 10.0) -> tuple[float, float]:
    """Return begin and end [s] of the part of a run in which most happens, at most `longest` s."""
    y = frame[_Y].to_numpy()
    energy = np.cumsum(np.square(y))
    time = frame.index.to_numpy()
    begin = float(time[np.searchsorted(energy, 0.005 * energy[-1])])
    begin = max(0.0, np.floor(begin - 0.5))
    return begin, min(float(time[-1]), begin + longest)


# The paper's Figs 14 to 17: one ground motion each, laws side by side, over time.

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
