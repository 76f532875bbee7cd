"""The picture of an identification: loops measured and predicted, and the force over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..draw.style import BLUE, INK, Page, look, percent, png, short_z
from ..identify.fit import Model, Problem, Run
from ..identify.table import low_pass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .identified import Identified

_RUNS = 3
_SHOWN = 5000  # samples per line: more are not seen
_ROW = 2.6
"""Height of a run's row [in]."""
_KILO = 2e3
"""Range of a force [N] above which it is shown in kN."""


def identify_png(found: Identified) -> bytes:
    """Return a PNG: force over velocity, displacement and time, of up to three judged runs."""
    return png(draw_identified(found), 110)


def draw_identified(found: Identified) -> Page:
    """Return the figure of up to three judged runs, drawn and not yet written."""
    problem, role = (found.holdout, "held out") if found.holdout else (found.train, "training")
    runs = problem.runs[:_RUNS]
    with look():
        page = Page(11.0, _ROW * len(runs), *_headings(found))
        grid = page.grid(
            len(runs), 3, top=0.4, bottom=0.45, row_gap=0.8, column_gap=0.65,
            width_ratios=[1.0, 1.0, 1.6],
        )  # fmt: skip
        for row, run in enumerate(runs):
            panels = [page.figure.add_subplot(grid[row, column]) for column in range(3)]
            _row(panels, problem, found.at.model, run, found.cutoff)
            panels[0].set_title(f"{run.name} ({role})")
            panels[0].set_ylabel(f"force [{_scale(run)[0]}]")
    return page


def _headings(found: Identified) -> tuple[str, str]:
    z = found.after.get("z_holdout", found.after["z_train"])
    share = found.after.get("share_holdout", found.after["share_train"])
    low = f" below {found.cutoff:g} Hz" if found.cutoff else ""
    law = " + ".join([found.model.law, *found.model.effects])
    site = found.at.site
    what = site.quantity[:1].upper() + site.quantity[1:]
    worst = " at the worst site" if site.shown else ""
    return (
        f"{law}: error {percent(share)} of the force, z = {short_z(z)}{worst}",
        f"{what}, measured and predicted{low}. z is error / noise; a true model has 1.",
    )


def _scale(run: Run) -> tuple[str, float]:
    """Return the unit that a run's force is shown in, and the factor to it from N."""
    return ("kN", 1e-3) if np.ptp(run.force) > _KILO else ("N", 1.0)


def _row(panels: list[Axes], problem: Problem, model: Model, run: Run, cutoff: float) -> None:
    _, factor = _scale(run)
    measured = factor * low_pass(run.force, run.dt, cutoff)
    predicted = factor * low_pass(problem.predict(model, run), run.dt, cutoff)
    every = max(1, len(measured) // _SHOWN)
    axes = (1e3 * run.v, "velocity [mm/s]"), (1e3 * run.x, "displacement [mm]")
    for panel, (along, label) in zip(panels, axes, strict=False):
        panel.plot(along[::every], measured[::every], color=INK, linewidth=1.3, alpha=0.75)
        panel.plot(along[::every], predicted[::every], color=BLUE, linewidth=0.8)
        panel.set_xlabel(label)
    time = np.arange(len(measured)) * run.dt
    part = slice(0, min(len(time), int(3.0 / run.dt) + 1))
    panels[2].plot(time[part], measured[part], color=INK, label="measured", linewidth=1.6)
    panels[2].plot(time[part], predicted[part], color=BLUE, label="predicted", linewidth=0.9)
    panels[2].set_xlabel("time [s]")
    panels[2].margins(x=0.0)
    panels[2].legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, labelcolor="linecolor",
        borderaxespad=0.15,
    )  # fmt: skip
