"""Stiction peaks: what the damper's friction does to the acceleration of the base as it turns."""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.view.style import BLUE, GREY, PALE, RECONSTRUCTED, VERMILION, Page, label

from .runs import Drawing, Runs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SCENARIO = "stiction_base_acceleration"
SHOWN = (("Bingham", 0.0), ("LuGre", 0.0), ("LuGre", 4.0))
VOLTAGES = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
"""V, for the height of the peaks with the LuGre law."""

RUNS = len(VOLTAGES) + 1
SETTLED = 4.0
"""Time from which peaks count [s]: the start has died out."""

HALF_WIDTH = 0.03
"""The chord, above which a peak's height is taken, spans this time on either side [s]."""

_BASE_MASS = 1.96935633694460  # kg, of the stock structure: a stuck Bingham damper must know it
_FREQUENCY = 1.5  # Hz, of the stock scenario's shaking
_WINDOW = (7.1, 8.75)
_A, _V = "structure.base_acceleration_absolute", "structure.base_velocity"


def draw(runs: Runs) -> Drawing:
    """Draw acceleration and velocity of the base, the peaks marked, and their height by voltage."""
    import pandas as pd

    frames = {("LuGre", voltage): _run(runs, "LuGre", voltage) for voltage in VOLTAGES}
    frames["Bingham", 0.0] = _run(runs, "Bingham", 0.0)
    peaks = {case: find_peaks(frame) for case, frame in frames.items()}
    smooth = {case: _smooth_height(frame) for case, frame in frames.items()}
    gone = min(
        voltage
        for voltage in VOLTAGES
        if peaks["LuGre", voltage]["height [m/s2]"].max() <= smooth["LuGre", voltage]
    )
    lead = 1e3 * float(-np.median(peaks["LuGre", 0.0]["peak after crossing [s]"]))
    title = (
        "Where the base turns, the damper's stiction leaves a peak in its acceleration; "
        f"with LuGre none is left at {gone:g} V and above"
    )
    subtitle = (
        "Absolute acceleration of the base, ground shaken by a sine of 1.5 m/s² and 1.5 Hz. Lines: "
        "zero crossings of the base velocity. Dots: of the samples from 30 ms before a crossing to "
        "30 ms after, the one that stands highest above their chord, if higher than the crest of "
        f"a pure sine would. LuGre's peaks come {lead:.0f} ms before the crossing."
    )
    page = Page(10.0, 6.8, title, subtitle, RECONSTRUCTED)
    grid = page.grid(
        2, 3, left=0.5, bottom=2.5, row_gap=0.45, column_gap=0.25, height_ratios=(1.9, 1.0)
    )
    first: list[Any] = [None, None]
    for column, case in enumerate(SHOWN):
        for row in range(2):
            axes = page.figure.add_subplot(grid[row, column], sharey=first[row])
            first[row] = first[row] or axes
            axes.tick_params(labelleft=column == 0)
            if row == 0:
                _accelerations(axes, case, frames[case], peaks[case], smooth[case])
            else:
                _velocities(axes, case, frames[case], peaks[case])
    below = page.grid(1, 1, top=5.1, left=0.5, bottom=0.45)
    _heights(page.figure.add_subplot(below[0, 0]), peaks, smooth)
    curves = [_labelled(frames[case], *case) for case in SHOWN]
    found = [
        pd.DataFrame({**_names(*case), **table, "crest [m/s2]": smooth[case]})
        for case, table in peaks.items()
    ]
    return Drawing(
        page,
        {
            "": pd.concat(curves, ignore_index=True),
            "_peaks": pd.concat(found, ignore_index=True),
        },
    )


def _run(runs: Runs, law: str, voltage: float) -> pd.DataFrame:
    overrides: dict[str, object] = {"voltage.level": voltage, "damper.fmu": f"{law}Damper"}
    if law == "Bingham":  # else its sign function chatters wherever the base sticks
        overrides["damper.moving_mass"] = _BASE_MASS
        overrides["connections.damper.holding_force"] = "structure.holding_force"
    return runs(SCENARIO, overrides)


def find_peaks(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per zero crossing of the base velocity after `SETTLED`.

    The crossing is interpolated linearly. The peak is the sample within `HALF_WIDTH` of it that
    stands highest above the chord over that span, counted in the direction in which the damper
    pushes the base before it turns. A smooth curve has a height there too, see the crest of a sine.

    Parameters
    ----------
    frame : DataFrame
        Results with velocity and absolute acceleration of the base, evenly spaced in time.

    Returns
    -------
    DataFrame
        "crossing [s]", "peak after crossing [s]", "acceleration [m/s2]", "height [m/s2]".
    """
    import pandas as pd

    time = frame.index.to_numpy()
    velocity, acceleration = frame[_V].to_numpy(), frame[_A].to_numpy()
    width = round(HALF_WIDTH / (time[1] - time[0]))
    rows = []
    moving = np.flatnonzero(velocity)  # a sample may lie on the crossing
    turns = np.flatnonzero(velocity[moving[:-1]] * velocity[moving[1:]] < 0.0)
    for i, j in zip(moving[turns], moving[turns + 1], strict=True):
        if time[i] < SETTLED or i + width >= len(time):
            continue
        share = velocity[i] / (velocity[i] - velocity[j])
        crossing = time[i] + share * (time[j] - time[i])
        span = slice(i - width, i + width + 1)
        t, a = time[span], acceleration[span]
        # Moving towards -x, the base is pushed towards +x: the peak points to where it turns.
        above = np.sign(velocity[j]) * (a - np.interp(t, t[[0, -1]], a[[0, -1]]))
        at = int(np.argmax(above))
        rows.append((crossing, t[at] - crossing, a[at], above[at]))
    names = ["crossing [s]", "peak after crossing [s]", "acceleration [m/s2]", "height [m/s2]"]
    return pd.DataFrame(rows, columns=names)


def _smooth_height(frame: pd.DataFrame) -> float:
    """Return the height over the chord at the crest of a sine as large as the acceleration."""
    largest = float(frame[_A].loc[SETTLED:].abs().max())
    return largest * (1.0 - cos(2.0 * pi * _FREQUENCY * HALF_WIDTH))


def _accelerations(
    axes: Axes,
    case: tuple[str, float],
    frame: pd.DataFrame,
    peaks: pd.DataFrame,
    smooth: float,
) -> None:
    part = frame.loc[_WINDOW[0] : _WINDOW[1]]
    _crossings(axes, peaks)
    axes.plot(part.index, part[_A], color=BLUE)
    seen = peaks[peaks["height [m/s2]"] > smooth]
    at = seen["crossing [s]"] + seen["peak after crossing [s]"]
    inside = (at > _WINDOW[0]) & (at < _WINDOW[1])
    axes.plot(at[inside], seen["acceleration [m/s2]"][inside], "o", color=VERMILION, markersize=5)
    force = float(np.sqrt(np.mean(np.square(frame["damper.force"].loc[SETTLED:]))))
    axes.set_title(f"{case[0]}, {case[1]:g} V: base acceleration [m/s²]")
    text = f"damper force {force:.1f} N RMS"
    label(axes, text, 1.0, 1.0, GREY, xycoords="axes fraction", xytext=(0, -3), ha="right",
          va="top", fontsize=8)  # fmt: skip
    axes.set_xlim(*_WINDOW)
    axes.margins(y=0.12)
    axes.tick_params(labelbottom=False)


def _velocities(
    axes: Axes, case: tuple[str, float], frame: pd.DataFrame, peaks: pd.DataFrame
) -> None:
    part = frame.loc[_WINDOW[0] : _WINDOW[1]]
    axes.axhline(0.0, color=PALE, linewidth=0.8)
    _crossings(axes, peaks)
    axes.plot(part.index, 1e3 * part[_V], color=GREY)
    axes.set_title("base velocity [mm/s]", color=GREY)
    axes.set_xlim(*_WINDOW)
    axes.set_xlabel("time [s]", loc="right", labelpad=0)


def _crossings(axes: Axes, peaks: pd.DataFrame) -> None:
    for crossing in peaks["crossing [s]"]:
        if _WINDOW[0] < crossing < _WINDOW[1]:
            axes.axvline(crossing, color=PALE, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)


def _heights(
    axes: Axes, peaks: dict[tuple[str, float], pd.DataFrame], smooth: dict[tuple[str, float], float]
) -> None:
    columns = [peaks["LuGre", voltage]["height [m/s2]"].to_numpy() for voltage in VOLTAGES]
    low, high = [c.min() for c in columns], [c.max() for c in columns]
    middle = [float(np.median(c)) for c in columns]
    axes.fill_between(VOLTAGES, low, high, color=BLUE, alpha=0.13, linewidth=0)
    axes.plot(VOLTAGES, middle, color=BLUE, marker="o", markersize=4, clip_on=False)
    crest = [smooth["LuGre", voltage] for voltage in VOLTAGES]
    axes.plot(VOLTAGES, crest, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)))
    axes.set_title("LuGre: height of the peaks [m/s²] over voltage")
    axes.set_xlabel("voltage [V]", loc="right", labelpad=0)
    axes.set_ylim(0.0, 1.08 * max(high))
    axes.set_xlim(0.0, VOLTAGES[-1])
    label(axes, "median", VOLTAGES[1], middle[1], BLUE, xytext=(6, 4))
    label(axes, "from smallest to largest", VOLTAGES[1], high[1], GREY, xytext=(6, -2), fontsize=8)
    text = "crest of a pure sine as large as the acceleration"
    label(axes, text, VOLTAGES[5], crest[5], GREY, xytext=(0, 5), fontsize=8)


def _names(law: str, voltage: float) -> dict[str, Any]:
    return {"law": law, "voltage [V]": voltage}


def _labelled(frame: pd.DataFrame, law: str, voltage: float) -> pd.DataFrame:
    """Return the drawn part of a run with the columns of the CSV file."""
    import pandas as pd

    part = frame.loc[_WINDOW[0] : _WINDOW[1]]
    columns = {
        "time [s]": part.index,
        "base acceleration absolute [m/s2]": part[_A],
        "base velocity [m/s]": part[_V],
        "damper force [N]": part["damper.force"],
    }
    return pd.DataFrame({**_names(law, voltage), **columns})
