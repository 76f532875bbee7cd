"""The picture of a force budget: the parts of a model's force, stacked over single cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..comparison.names import effect_name
from ..comparison.panels import OneCycle, chosen_cycles
from ..comparison.predictions import run_predictions
from ..core.text import percent, scale
from ..identification.error_table import ForceShare, force_budget
from ..physics.forms import shown_law
from ..physics.laws import LAWS
from ..view.style import BLUE, GREEN, GREY, INK, PALE, PURPLE, VERMILION, Page, look

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..identification.problem import Problem
    from ..model.model import Model

Array = NDArray[np.float64]
Budgets = dict[str, list[ForceShare]]

_RUNS = 6
_WIDTH, _PANELS, _BAR = 9.2, 2.7, 0.27
"""Width of the figure, heights of a row of cycles and of a bar [in]."""
_LEFT = 0.85  # in, beside the panels: -1500 and the axis label need it
_OF_LAW = {
    "yield": BLUE, "viscous": "#7db8dc", "damping of the bristles": "#bcd9ea", "spring": GREEN,
    "rest of the law": PALE,
}  # fmt: skip
_OF_EFFECTS = (VERMILION, PURPLE, "#e69f00", "#8c6bb1", "#b15928")


def budgets(problem: Problem, model: Model) -> Budgets:
    """Return the force budget of a damper's model in each run, by its name.

    Empty for a law that is no damper's.
    """
    if LAWS[model.law].site != "damper":
        return {}
    return {run.name: force_budget(problem, model, run) for run in problem.runs[:_RUNS]}


def shares(found: Budgets) -> list[tuple[str, float]]:
    """Return the parts with their RMS over that of the force, in all runs together."""
    powers: dict[str, float] = {}
    total = 0.0
    for one in found.values():
        total += float(np.sum(np.sum([part.force for part in one], axis=0) ** 2))
        for part in one:
            powers[part.name] = powers.get(part.name, 0.0) + float(np.sum(part.force**2))
    if not total > 0.0:
        return []
    return [(name, float(np.sqrt(power / total))) for name, power in powers.items()]


def sentence(found: Budgets) -> str:
    """Return the parts with their shares in words, the largest first; "" where there are none."""
    parts = sorted(shares(found), key=lambda one: -one[1])
    told = ", ".join(f"{effect_name(name)} {percent(share, 0)}" for name, share in parts)
    return f"The force consists of (RMS over that of the force): {told}." if told else ""


def draw_budget(problem: Problem, model: Model) -> Page | None:
    """Return the figure of a force budget, drawn and not yet written; None for no damper's law.

    Parameters
    ----------
    problem : Problem
        Runs with what predicts them.
    model : Model
        Law and effects with their values.
    """
    found = budgets(problem, model)
    if not found:
        return None
    predictions = run_predictions(problem.of(problem.runs[:_RUNS]), model)
    cycles, parts = chosen_cycles(predictions), shares(found)
    colours = colours_of([name for name, _ in parts])
    with look():
        bars = _BAR * len(parts) + 0.75
        above = _PANELS if cycles else 0.0
        names = [shown_law(model.law), *map(effect_name, model.effects)]
        heading = f"{' + '.join(names)}: the parts of its force"
        said = "Stacked over single cycles; the line is their sum, the model's force."
        page = Page(_WIDTH, above + bars, heading, said if cycles else "")
        if cycles:
            grid = page.grid(1, len(cycles), top=0.4, bottom=bars + 0.5, left=_LEFT, column_gap=0.2)
            panels = [page.figure.add_subplot(grid[0, k]) for k in range(len(cycles))]
            _stacks(panels, cycles, found, colours)
        grid = page.grid(1, 1, top=above + 0.3, bottom=0.4, left=2.0, right=0.9)
        _bars(page.figure.add_subplot(grid[0, 0]), parts, colours)
    return page


def colours_of(names: list[str]) -> dict[str, str]:
    """Return the colour of each part: those of the law have their own, effects the others."""
    effects = [name for name in names if name not in _OF_LAW]
    own = {name: _OF_EFFECTS[k % len(_OF_EFFECTS)] for k, name in enumerate(effects)}
    return {name: _OF_LAW.get(name) or own[name] for name in names}


def _stacks(
    panels: list[Axes], cycles: list[OneCycle], found: Budgets, colours: dict[str, str]
) -> None:
    """Draw the parts of each cycle on each other, those that push back and those that pull."""
    length = max(float(np.ptp(one.prediction.time[one.part])) for one in cycles)
    times, in_unit = scale("s", length, fine=True)
    size = max(float(np.abs(one.prediction.measured[one.part]).max()) for one in cycles)
    factor, unit = scale("N", size)
    low, high = 0.0, 0.0
    for axes, one in zip(panels, cycles, strict=True):
        of = one.prediction
        time = times * (of.time[one.part] - of.time[one.part.start])
        parts = found[of.name]
        forces = factor * np.array([part.force[one.part] for part in parts])
        fills = [colours[part.name] for part in parts]
        axes.stackplot(time, np.maximum(forces, 0.0), colors=fills, lw=0.0)
        axes.stackplot(time, np.minimum(forces, 0.0), colors=fills, lw=0.0)
        axes.plot(time, forces.sum(axis=0), color="white", lw=2.4)
        axes.plot(time, forces.sum(axis=0), color=INK, lw=1.2)
        axes.set_title(one.text, fontsize=9.5)
        axes.set_title(of.name, loc="right", fontsize=7, color=GREY)
        axes.set_xlabel(f"time in the cycle [{in_unit}]", fontsize=8)
        # A label at the right edge would run into the first one of the next panel.
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
        axes.tick_params(labelsize=8)
        axes.set_xlim(time[0], time[-1])
        low, high = min(low, axes.get_ylim()[0]), max(high, axes.get_ylim()[1])
    for number, axes in enumerate(panels):
        axes.set_ylim(low, high)
        if number:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel(f"force [{unit}]", fontsize=8)


def _bars(axes: Axes, parts: list[tuple[str, float]], colours: dict[str, str]) -> None:
    """Draw the parts' shares as bars, which are the key of the colours as well."""
    places = range(len(parts))
    axes.barh(
        places, [share for _, share in parts], color=[colours[name] for name, _ in parts],
        height=0.7,
    )  # fmt: skip
    for place, (_, share) in zip(places, parts, strict=True):
        axes.text(share, place, f" {percent(share, 0)}", va="center", fontsize=8.5, color=INK)
    axes.set_yticks(places, [effect_name(name) for name, _ in parts], fontsize=9, color=INK)
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    axes.set_title("RMS over that of the force, in all of these runs", fontsize=9)
    axes.grid(visible=False, axis="y")
