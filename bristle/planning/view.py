"""Figures and tables of a plan."""

from __future__ import annotations

from ..view.blocks import Figure, Table, Text, View, view_of
from .plan import HEADER, Plan


@view_of(Plan)
def plan_view(plan: Plan) -> View:
    """Return the view of a plan."""
    runs = plan.runs() if plan.worth else []
    rows = [[run.name, run.purpose, run.about] for run in runs]
    told = Table(HEADER, [one.cells() for one in plan.outcomes], (3, 4))
    return View(
        f"{len(runs) or 'No'} tests planned for {plan.study or 'a new rig'}.",
        (*map(Text, plan.sentences()), *((told,) if plan.outcomes else ())),
        (Table(("run", "for", "what"), rows), Figure(plan.plot, runs[0].about)) if rows else (),
    )
