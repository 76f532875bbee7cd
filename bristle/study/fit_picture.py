"""The picture of an identification: loops measured and predicted, and the error over time."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from ..identify.fit import Model, Problem, Run
from ..identify.table import low_pass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .identified import Identified

_MEASURED, _PREDICTED = "#666666", "#D55E00"  # Okabe & Ito (2008), and a grey
_RUNS = 3
_SHOWN = 5000  # samples per line: more are not seen


def identify_png(found: Identified) -> bytes:
    """Return a PNG: force over velocity, displacement and time, of up to three judged runs."""
    from matplotlib.figure import Figure

    problem, role = (found.holdout, "held out") if found.holdout else (found.train, "training")
    runs = problem.runs[:_RUNS]
    figure = Figure(figsize=(11.0, 2.7 * len(runs) + 0.9), layout="constrained")
    grid = figure.subplots(len(runs), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.6))
    for row, run in zip(grid, runs, strict=True):
        _row(list(row), problem, found.at.model, run, found.cutoff, role)
    figure.suptitle(_title(found), fontsize=10, x=0.01, ha="left")
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=110)
    return file.getvalue()


def _title(found: Identified) -> str:
    z = found.after.get("z_holdout", found.after["z_train"])
    share = found.after.get("share_holdout", found.after["share_train"])
    low = f"below {found.cutoff:g} Hz" if found.cutoff else "without a filter"
    law = " + ".join([found.model.law, *found.model.effects])
    return f"{law}: error {share:.1%} of the force's RMS {low}; z = {z:.2f} (1: nothing but noise)"


def _row(
    panels: list[Axes], problem: Problem, model: Model, run: Run, cutoff: float, role: str
) -> None:
    unit, factor = ("kN", 1e-3) if np.ptp(run.force) > 2e3 else ("N", 1.0)
    measured = factor * low_pass(run.force, run.dt, cutoff)
    predicted = factor * low_pass(problem.predict(model, run), run.dt, cutoff)
    every = max(1, len(measured) // _SHOWN)
    axes = (1e3 * run.v, "velocity [mm/s]"), (1e3 * run.x, "displacement [mm]")
    for panel, (along, label) in zip(panels, axes, strict=False):
        panel.plot(along[::every], measured[::every], color=_MEASURED, linewidth=1.6)
        panel.plot(along[::every], predicted[::every], color=_PREDICTED, linewidth=0.6)
        panel.set_xlabel(label)
    panels[0].set_ylabel(f"force [{unit}]")
    panels[0].set_title(f"{run.name} ({role})", fontsize=8, loc="left")
    time = np.arange(len(measured)) * run.dt
    part = slice(0, min(len(time), int(3.0 / run.dt) + 1))
    panels[2].plot(time[part], measured[part], color=_MEASURED, label="measured", linewidth=2.0)
    panels[2].plot(time[part], predicted[part], color=_PREDICTED, label="predicted", linewidth=0.8)
    panels[2].set_xlabel("time [s]")
    panels[2].legend(frameon=False, fontsize=8, loc="upper right")
