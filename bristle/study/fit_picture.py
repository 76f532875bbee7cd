"""The picture of an identification: loops measured and predicted, and the force over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..compare.loops import chosen_cycles
from ..compare.panels import draw_error, draw_history, worst_window
from ..compare.picture import LOOPS, loop_panels
from ..compare.prediction import run_predictions
from ..draw.style import Page, look, png, short_z
from ..identify.rig import DAMPER
from ..physics.forms import shown_law

if TYPE_CHECKING:
    from .identified import Identified

_RUNS = 6
"""Runs that cycles are sought in."""
_HISTORY = 3.1
"""Height of a force over time with its residual [in]."""
_SAMPLES = 1200
"""Samples of a history: more are not told apart."""


def identify_png(found: Identified) -> bytes:
    """Return a PNG: loops of single cycles by the command's level, and the force over time."""
    return png(draw_identified(found), 110)


def draw_identified(found: Identified) -> Page:
    """Return the figure of the judged runs, drawn and not yet written.

    Loops of one cycle per level of the command, the force over time where it is worst, and its
    residual beneath; runs that were held out where there are any.
    """
    problem, role = (found.holdout, "held out") if found.holdout else (found.train, "training")
    predictions = run_predictions(problem.of(problem.runs[:_RUNS]), found.at.model)
    cycles = chosen_cycles(predictions)
    worst = max(predictions, key=lambda one: float((one.normalised**2).mean()))
    window = worst_window(worst, _SAMPLES)
    with look():
        above = LOOPS * bool(cycles)
        page = Page(9.6, above + _HISTORY, *_headings(found, role))
        if cycles:
            loop_panels(page, 0.0, cycles)
        grid = page.grid(2, 1, top=above + 0.35, bottom=0.45, row_gap=0.4, height_ratios=[1.6, 1.0])
        upper = page.figure.add_subplot(grid[0, 0])
        draw_history(upper, worst, window)
        draw_error(page.figure.add_subplot(grid[1, 0], sharex=upper), worst, window)
        upper.tick_params(labelbottom=False)
    return page


def _headings(found: Identified, role: str) -> tuple[str, str]:
    law = " + ".join([shown_law(found.model.law), *found.model.effects])
    site = found.at.site
    what = site.quantity[:1].upper() + site.quantity[1:]
    what += " of the damper" if site.shown == DAMPER else ""
    worst = " at the worst site" if site.shown else ""
    runs = "runs held out" if role == "held out" else "training runs"
    return (
        f"{law}: error {found.error.text()}, z = {short_z(found.z)}{worst}",
        f"{what} in {runs}, measured and predicted. z is error / noise; a true model has 1.",
    )
