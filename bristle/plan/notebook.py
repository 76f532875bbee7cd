"""What a notebook shows of a plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI, as_png
from .outcome import HEADER

if TYPE_CHECKING:
    from .plan import Plan

_RUNS = ["run", "for", "what"]


def plan_html(plan: Plan) -> str:
    """Return a plan as HTML: its tests, what they will show, and the picture of the first one."""
    runs = plan.runs() if plan.worth else []
    rows = [
        [run.name, "training" if run.role == "train" else "held out", run.about] for run in runs
    ]
    told = [one.cells() for one in plan.outcomes]
    title = f"Tests for {plan.study or 'a new rig'}"
    return html.fragment(
        title,
        html.paragraphs("" if rows else " ".join(plan.sentences())),
        html.table(_RUNS, rows) if rows else "",
        html.table(list(HEADER), told, numbers=(2, 3)),
        html.figure(as_png(plan.plot(), DPI), runs[0].about) if rows else "",
    )
