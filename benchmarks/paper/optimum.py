"""The passive optimum: peak acceleration of the second floor over the constant voltage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bristle.view.style import INK, RECONSTRUCTED, Page, label, ramp

from .runs import Drawing, Runs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SCENARIOS = {
    "0.2 g": "el_centro_0p2g_constant_voltage",
    "0.4 g": "el_centro_0p4g_constant_voltage",
    "0.6 g": "el_centro_0p6g_constant_voltage",
    "0.8 g": "el_centro_0p8g_constant_voltage",
}
PUBLISHED = {"0.2 g": 2.0, "0.4 g": 4.0, "0.6 g": 4.0, "0.8 g": 8.0}
"""The best voltages [V] that the paper's text gives (section IV-B)."""

VOLTAGES = tuple(float(voltage) for voltage in range(9))
RUNS = len(SCENARIOS) * len(VOLTAGES)

_PEAK = "peak floor 2 acceleration [m/s2]"
_STROKE = "peak stroke ratio [1]"


def draw(runs: Runs) -> Drawing:
    """Draw one curve per intensity, the least value and the paper's choice marked."""
    import pandas as pd

    rows = [
        (intensity, voltage, *_peaks(runs, scenario, voltage))
        for intensity, scenario in SCENARIOS.items()
        for voltage in VOLTAGES
    ]
    table = pd.DataFrame(rows, columns=["intensity", "voltage [V]", _PEAK, _STROKE])
    parts = {str(name): part.set_index("voltage [V]") for name, part in table.groupby("intensity")}
    curves = {name: part[_PEAK] for name, part in parts.items()}
    worst = max(curves[name][PUBLISHED[name]] / curves[name].min() - 1.0 for name in SCENARIOS)
    best = [f"{curves[name].idxmin():g}" for name in SCENARIOS]
    title = (
        "The stronger the earthquake, the more voltage is best: "
        f"{', '.join(best[:-1])} and {best[-1]} V from 0.2 to 0.8 g"
    )
    subtitle = (
        "Peak absolute acceleration of the second floor under El Centro N-S, LuGre damper at "
        "constant voltage. Ring: least of the nine voltages. Cross: the optimum that the paper "
        f"states, within {100 * worst:.1f} % of the least here. Dashed: the base drifts beyond the "
        "damper's stroke."
    )
    note = (
        RECONSTRUCTED
        + "\nGround motion: nominal peak times 0.45, a factor that is reconstructed as well."
    )
    page = Page(7.6, 4.7, title, subtitle, note)
    axes = page.figure.add_subplot(page.grid(1, 1, left=0.5, right=0.75)[0, 0])
    for (intensity, part), colour in zip(parts.items(), ramp(len(parts)), strict=True):
        _curve(axes, intensity, part, colour)
    axes.set_title("Peak acceleration of floor 2 [m/s²]")
    axes.set_xlabel("voltage [V]")
    axes.set_ylim(0.0, 1.05 * table[_PEAK].max())
    axes.set_xticks(VOLTAGES)
    return Drawing(page, {"": table})


def _peaks(runs: Runs, scenario: str, voltage: float) -> tuple[float, float]:
    frame = runs(scenario, {"voltage.level": voltage})
    acceleration = frame["structure.floor2_acceleration_absolute"].abs().max()
    return float(acceleration), float(frame["damper.stroke_ratio"].max())


def _curve(axes: Axes, intensity: str, part: pd.DataFrame, colour: Any) -> None:
    curve = part[_PEAK]
    axes.plot(curve.index, curve, color=colour, linestyle=(0, (3, 2)), linewidth=1.0)
    inside = curve.where(part[_STROKE] <= 1.0)
    axes.plot(curve.index, inside, color=colour, linewidth=1.6)
    axes.plot(curve.index, curve, "o", color=colour, markersize=3.5)
    lowest = int(curve.argmin())
    best, least = VOLTAGES[lowest], float(curve.iloc[lowest])
    axes.plot(best, least, "o", markersize=11, markerfacecolor="none", markeredgecolor=INK)
    chosen = PUBLISHED[intensity]
    axes.plot(chosen, curve[chosen], "x", markersize=8, markeredgewidth=2.0, color=INK, zorder=4)
    label(axes, f"{least:.2f}", best, least, INK, xytext=(0, 9), ha="center")
    end, last = VOLTAGES[-1], float(curve.iloc[-1])
    label(axes, intensity, end, last, colour, xytext=(9, 0), va="center", fontsize=10)
