"""The picture of a verdict: what each effect that was tried leaves of the error."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..draw.ranking import ROW, draw_ranking
from ..draw.style import Page, look, short_z

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
        return _bars(
            [trial.effects[-1] for trial in trials], [trial.z for trial in trials],
            found.before.z, found.effects, (headline(found), _subtitle(found)),
        )  # fmt: skip


def draw_evidence(verdict: Mapping[str, Any]) -> Page | None:
    """Return the trials of a verdict.json as bars, at the site where the model errs the most.

    None where it holds none.
    """
    findings = [one for one in verdict.get("findings") or [] if "z_holdout_before" in one]
    at = max(findings, key=lambda one: float(one["z_holdout_before"]), default=verdict)
    rows = [
        (str(row["effect"]), float(row["z_holdout"]))
        for row in verdict.get("ranking") or []
        if row.get("z_holdout") is not None and row.get("site") == at.get("site", row.get("site"))
    ][:MOST]
    if at.get("z_holdout_before") is None:
        return None
    if not rows:
        return None
    named, before = verdict.get("effects") or [], float(at["z_holdout_before"])
    with look():
        return _bars([name for name, _ in rows], [z for _, z in rows], before, named, ("", ""))


def _bars(
    effects: Sequence[str], values: Sequence[float], before: float, named: Collection[str],
    texts: tuple[str, str],
) -> Page:  # fmt: skip
    """Return the page of the trials; `texts` are its title and what stands beneath."""
    page = Page(7.6, ROW * len(effects) + 1.0, *texts)
    grid = page.grid(1, 1, top=0.3, bottom=0.5, left=1.9, right=0.7)
    axes = page.figure.add_subplot(grid[0, 0])
    names, strong = [f"with {name}" for name in effects], [f"with {name}" for name in named]
    draw_ranking(axes, names, values, before, strong)
    axes.set_title(f"dashed: the present model, z = {short_z(before)}", loc="right", fontsize=8.5)
    axes.set_xlabel("error / noise on held-out runs (z)")
    return page


def headline(found: Diagnosis) -> str:
    """Return a verdict in one line."""
    return TITLES.get(found.kind, TITLES["ambiguous"]).format(names=", ".join(found.effects))


def _subtitle(found: Diagnosis) -> str:
    site = found.worst.site if found.worst is not None and found.force else ""
    where = f" at the {site}" if site else ""
    return (
        f"Dashed: the present model{where}. Each bar: the model with that effect, fitted again. "
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
