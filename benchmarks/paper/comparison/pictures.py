"""The paper's Fig. 13 drawn anew from the runs of the comparison, and this project's own pictures.

Figs 14 to 17 are in `cases`.
"""

from __future__ import annotations

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


def histories(c: Comparison, motion: str, column: str, what: str, unit: str, factor: float,
              laws: tuple[str, ...]) -> Page:  # fmt: skip
    """Draw one response over time at a weak and a strong intensity, a panel per law.

    Parameters
    ----------
    c : the runs
    motion : name of the ground motion
    column, factor : of the results, and what brings its SI values to `unit`
    what, unit : name and unit of the response, for title and axes
    laws : a panel for each
    """
    listed = next(m for m in c.motions if m.name == motion).intensities
    weak, strong = listed[0], 0.6 if 0.6 in listed else listed[-1]
    peaks = {
        (g, law): factor * float(c.frames[motion, g, law][column].abs().max())
        for g in (weak, strong)
        for law in laws
    }
    best = [min(laws, key=lambda law, g=g: peaks[g, law]) for g in (weak, strong)]  # type: ignore[misc]
    title = (
        f"{what} is lowest with {short(best[0])} at {weak:g} g and with {short(best[1])} at "
        f"{strong:g} g"
        if best[0] != best[1]
        else f"{what} is lowest with {short(best[0])} at {weak:g} g and at {strong:g} g"
    )
    free_peaks = [factor * float(c.frames[motion, g, NONE][column].abs().max())
                  for g in (weak, strong)]  # fmt: skip
    subtitle = (
        f"{motion}, nominal {weak:g} g (left) and {strong:g} g (right). Grey: without damper, up "
        f"to {free_peaks[0]:.3g} and {free_peaks[1]:.3g} {unit}. Dots: each law's largest value."
    )
    page = Page(10.0, 1.25 * len(laws) + 0.75, title, subtitle, NOTE)
    grid = page.grid(len(laws), 2, left=0.5, column_gap=0.35, row_gap=0.36)
    for place, g in enumerate((weak, strong)):
        begin, end = strong_part(c.frames[motion, g, NONE], longest=20.0)
        size = 1.35 * max(peaks[g, law] for law in laws)
        free = factor * c.frames[motion, g, NONE].loc[begin:end, column]
        for row, law in enumerate(laws):
            axes = page.figure.add_subplot(grid[row, place])
            part = factor * c.frames[motion, g, law].loc[begin:end, column]
            axes.plot(free.index, free, color=PALE, linewidth=0.7, alpha=0.8)
            axes.plot(part.index, part, color=COLOUR[law], linewidth=0.9)
            axes.set_ylim(-size, size)
            axes.set_xlim(begin, end)
            mark(axes, part, unit)
            axes.set_title(f"{short(law)} [{unit}]", color=COLOUR[law], fontsize=9)
            axes.tick_params(labelbottom=row == len(laws) - 1)
            if row == len(laws) - 1:
                axes.set_xlabel("time [s]", loc="right", labelpad=0)
    return page


def responses(c: Comparison) -> Page:
    """Return a picture of floor 2's acceleration under El Centro."""
    laws = (FOUR, *CONTROLLERS)
    what = "Under El Centro the peak acceleration of floor 2"
    return histories(c, EL_CENTRO, _Y, what, "m/s²", 1.0, laws)


def drifts(c: Comparison) -> Page:
    """Return a picture of the base drift under El Centro."""
    laws = (FOUR, *CONTROLLERS)
    return histories(c, EL_CENTRO, _X, "The base drift under El Centro", "mm", 1e3, laws)


def northridge(c: Comparison) -> Page | None:
    """Return a picture of floor 2's acceleration under Northridge; None without a record."""
    motion = c.strong[0]
    if motion == EL_CENTRO:
        return None
    laws = (FOUR, *CONTROLLERS)
    what = f"Under {motion} the peak acceleration of floor 2"
    return histories(c, motion, _Y, what, "m/s²", 1.0, laws)


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


def voltages(c: Comparison) -> Page:
    """Return voltage over time and force over velocity of the controllers, El Centro 0.6 g."""
    frames = {law: c.frames[EL_CENTRO, 0.6, law] for law in CONTROLLERS}
    between = {
        law: float(((f["controller.voltage"] > 0) & (f["controller.voltage"] < 8)).mean())
        for law, f in frames.items()
    }
    title = (
        "The clipped law switches between 0 and 8 V; LPV is strictly between for "
        f"{100 * between[LPV]:.0f} % of the time, H-infinity with inverse for "
        f"{100 * between[HINF]:.0f} %"
    )
    subtitle = "El Centro, nominal 0.6 g. Left: voltage, six seconds. Right: force over velocity."
    page = Page(10.0, 5.6, title, subtitle, NOTE)
    grid = page.grid(3, 2, left=0.5, column_gap=0.7, row_gap=0.5, width_ratios=(2.0, 1.0))
    shared: Axes | None = None
    for row, (law, frame) in enumerate(frames.items()):
        axes = page.figure.add_subplot(grid[row, 0])
        part = frame.loc[1.5:7.5]
        axes.plot(part.index, part["controller.voltage"], color=COLOUR[law], linewidth=0.8)
        axes.set_title(f"{short(law)}: voltage [V]", color=COLOUR[law])
        axes.set_xlim(1.5, 7.5)
        axes.set_ylim(-0.4, 8.4)
        axes.set_yticks([0, 2, 4, 6, 8])
        loop = page.figure.add_subplot(grid[row, 1], sharex=shared, sharey=shared)
        shared = shared or loop
        own = frame.loc[0.0:20.0]
        loop.axhline(0.0, color=PALE, linewidth=0.8, zorder=1)
        loop.axvline(0.0, color=PALE, linewidth=0.8, zorder=1)
        loop.plot(1e3 * own["structure.base_velocity"], own["damper.force"], color=COLOUR[law],
                  linewidth=0.5)  # fmt: skip
        loop.set_title("force [N]")
        for panel, axis_name in ((axes, "time [s]"), (loop, "velocity [mm/s]")):
            panel.tick_params(labelbottom=row == 2)
            if row == 2:
                panel.set_xlabel(axis_name, loc="right", labelpad=0)
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
