"""The picture of a verdict: what each effect that was tried leaves of the error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw.ranking import ROW, draw_ranking
from ..draw.style import Page, look

if TYPE_CHECKING:
    from .verdict import Diagnosis

MOST = 10
"""Effects that are drawn."""


def draw_diagnosis(found: Diagnosis) -> Page:
    """Return the figure of a verdict, drawn and not yet written.

    Of a building it shows the site where the model errs the most. Data that carry no verdict have
    no trials: then the figure is the verdict's words.
    """
    trials = found.trials[:MOST]
    with look():
        if not trials or found.before is None:
            return Page(7.6, 0.0, headline(found), found.words)
        page = Page(7.6, ROW * len(trials) + 1.0, headline(found), _subtitle(found))
        grid = page.grid(1, 1, top=0.15, bottom=0.5, left=1.9, right=0.7)
        axes = page.figure.add_subplot(grid[0, 0])
        names = [f"with {trial.effects[-1]}" for trial in trials]
        strong = [f"with {name}" for name in found.effects]
        draw_ranking(axes, names, [trial.z for trial in trials], found.before.z, strong)
        axes.set_xlabel("error / noise on held-out runs (z)")
    return page


def headline(found: Diagnosis) -> str:
    """Return a verdict in one line."""
    return TITLES.get(found.kind, TITLES["ambiguous"]).format(names=", ".join(found.effects))


def _subtitle(found: Diagnosis) -> str:
    site = found.worst.site if found.worst is not None and found.force else ""
    where = f" at the {site}" if site else ""
    return (
        f"Dashed: the present model{where}. Each dot: the model with that effect, fitted again. "
        "Green: the noise floor."
    )


TITLES = {
    "none": "No effect is missing",
    "effect": "Missing: {names}",
    "ambiguous": "One of these is missing: {names}",
    "unknown": "Something is missing that no effect explains",
    "insufficient": "These data do not allow a verdict",
}
"""Headings by kind of verdict."""
