"""Force loops of both damper laws on a test bench: over voltages, and over frequencies."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import TYPE_CHECKING, Any

from bristle.view.style import GREY, RECONSTRUCTED, Page, label, ramp, zero_lines

from .runs import Drawing, Runs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

VOLTAGES = (0.0, 2.0, 4.0, 8.0)
"""V, at 2 Hz."""

FREQUENCIES = (1.0, 2.0, 4.0, 8.0)
"""Hz, at 4 V. Below 1 Hz a sine of this speed leaves the stroke of 20 mm."""

SPEED = 0.1
"""Largest speed of the rod in every loop [m/s]."""

CYCLES = 5
SAMPLES = 1000
"""Cycles of a run, of which the last is drawn, and samples of each."""

LAWS = {"Bingham": "bench_sine_bingham", "LuGre": "bench_sine_lugre"}

Namer = Callable[["Axes", "pd.DataFrame", str, str, Any], None]

_COLUMNS = ["law", "voltage [V]", "frequency [Hz]", "time [s]"]
_COLUMNS += ["displacement [m]", "velocity [m/s]", "force [N]"]


def over_voltages(runs: Runs) -> Drawing:
    """Draw the loops at 2 Hz for voltages from 0 to 8 V."""
    table = _table(runs, [(voltage, 2.0) for voltage in VOLTAGES])
    force, speed = table["force [N]"], 1e3 * table["velocity [m/s]"].abs()
    low = force[table["voltage [V]"] == VOLTAGES[0]].max()
    high = force[table["voltage [V]"] == VOLTAGES[-1]].max()
    at = speed.iloc[int(force.argmax())]
    title = (
        f"Voltage lifts the damper's peak force from {low:.1f} to {high:.1f} N; "
        f"beyond {at:.0f} mm/s it falls as speed grows"
    )
    subtitle = (
        f"Sine of 2 Hz, {1e3 * SPEED / (4 * pi):.2f} mm, so at most {1e3 * SPEED:g} mm/s; last of "
        f"{CYCLES} cycles. Where the rod turns, Bingham's force jumps; LuGre's bristles first bend "
        "by some millimetres."
    )
    page = Page(9.0, 6.9, title, subtitle, RECONSTRUCTED)
    return _draw(page, table, "voltage [V]", "V", _name_at_tips)


def over_frequencies(runs: Runs) -> Drawing:
    """Draw the loops at 4 V for frequencies from 1 to 8 Hz, at the same largest speed."""
    table = _table(runs, [(4.0, frequency) for frequency in FREQUENCIES])
    lugre = table[table["law"] == "LuGre"]
    peaks = [lugre[lugre["frequency [Hz]"] == f]["force [N]"].max() for f in FREQUENCIES]
    title = (
        "At one speed Bingham's force is the same at every frequency; LuGre's peak falls from "
        f"{peaks[0]:.1f} to {peaks[-1]:.1f} N once the bristles lack travel"
    )
    subtitle = (
        f"4 V; the same {1e3 * SPEED:g} mm/s at most, so {_stroke(FREQUENCIES[0])} mm of amplitude "
        f"at {FREQUENCIES[0]:g} Hz and {_stroke(FREQUENCIES[-1])} mm at {FREQUENCIES[-1]:g} Hz, "
        f"where the bristles slide at 2 mm (1/a_0); last of {CYCLES} cycles."
    )
    page = Page(9.0, 6.9, title, subtitle, RECONSTRUCTED)
    return _draw(page, table, "frequency [Hz]", "Hz", _name_at_zero)


def _stroke(frequency: float) -> str:
    return f"{1e3 * SPEED / (2.0 * pi * frequency):.1f}"


def _table(runs: Runs, cases: list[tuple[float, float]]) -> pd.DataFrame:
    """Return the last cycle of every case (voltage [V], frequency [Hz]) of both laws."""
    import pandas as pd

    return pd.concat(
        [
            _last_cycle(runs, law, voltage, frequency)
            for law in LAWS
            for voltage, frequency in cases
        ],
        ignore_index=True,
    )


def _last_cycle(runs: Runs, law: str, voltage: float, frequency: float) -> pd.DataFrame:
    overrides = {
        "voltage.level": voltage,
        "rod.frequency": frequency,
        "rod.amplitude": SPEED / (2.0 * pi * frequency),
        "run.stop": CYCLES / frequency,
        "run.step": 1.0 / (SAMPLES * frequency),
    }
    frame = runs(LAWS[law], overrides).iloc[-SAMPLES - 1 :]
    import pandas as pd

    values = [law, voltage, frequency, frame.index]
    values += [frame[name] for name in ("rod.displacement", "rod.velocity", "damper.force")]
    return pd.DataFrame(dict(zip(_COLUMNS, values, strict=True)))


def _draw(page: Page, table: pd.DataFrame, key: str, unit: str, name: Namer) -> Drawing:
    """Draw force over velocity and displacement, one column per law and a loop per `key`."""
    grid = page.grid(2, 2, row_gap=0.85, column_gap=0.45, left=0.45)
    first: Axes | None = None
    for column, law in enumerate(LAWS):
        for row, across in enumerate(("velocity", "displacement")):
            axes = page.figure.add_subplot(grid[row, column], sharey=first)
            first = first or axes
            zero_lines(axes)
            cases = table[table["law"] == law].groupby(key)
            for (value, loop), colour in zip(cases, ramp(len(cases)), strict=True):
                axes.plot(1e3 * _value(loop, across), loop["force [N]"], color=colour)
                name(axes, loop, across, f"{value:g} {unit}", colour)
            if not axes.texts:
                label(axes, "the same at every frequency", 0.0, -2.0, GREY, xytext=(10, 0))
            axes.set_xlabel(f"{across} [mm/s]" if across == "velocity" else f"{across} [mm]")
            axes.set_title(f"{law}: force [N] over {across}")
            axes.margins(x=0.12 if across == "velocity" else 0.05, y=0.09)
    return Drawing(page, {"": table})


def _name_at_tips(axes: Axes, loop: pd.DataFrame, across: str, name: str, colour: Any) -> None:
    """Write a loop's name at its tip over velocity, or on its upper branch mid-stroke."""
    x, force = 1e3 * _value(loop, across), loop["force [N]"]
    if across == "velocity":
        at = int(x.argmax())
        where: dict[str, Any] = {"xytext": (4, 0), "va": "center"}
    else:
        at = int(x.abs().where(loop["velocity [m/s]"] > 0.0).argmin())
        where = {"inline": True}
    label(axes, name, x.iloc[at], force.iloc[at], colour, **where)


def _name_at_zero(axes: Axes, loop: pd.DataFrame, across: str, name: str, colour: Any) -> None:
    """Write a loop's name on its rising branch, where the force is zero."""
    force = loop["force [N]"].to_numpy()
    at = int(((force[:-1] < 0.0) & (force[1:] >= 0.0)).argmax()) + 1
    x = 1e3 * float(_value(loop, across).iloc[at])
    if across == "velocity" and abs(x) < 1.0:  # the law knows no hysteresis
        return
    turn = 90 if across == "displacement" else 60
    label(axes, name, x, 0.0, colour, inline=True, rotation=turn, fontsize=8)


def _value(loop: pd.DataFrame, across: str) -> pd.Series[float]:
    return loop[{"velocity": "velocity [m/s]", "displacement": "displacement [m]"}[across]]
