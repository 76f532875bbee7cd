"""The picture of a verdict: what each effect that was tried leaves of the error."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..compare.names import joined
from ..draw.ranking import ROW, draw_ranking
from ..draw.style import Page, look, short_z
from .law_text import law_name

if TYPE_CHECKING:
    from .verdict import Diagnosis

MOST = 10
"""Effects that are drawn."""


def draw_diagnosis(found: Diagnosis) -> Page:
    """Return the figure of a verdict, drawn and not yet written.

    Of a building it shows the site where the model errs the most. Data that carry no verdict have
    no trials, without a known noise there is no z: then the figure is the verdict's words.
    """
    trials = found.trials[:MOST]
    with look():
        if not trials or found.before is None or found.worst is None or not found.noise_known:
            return Page(7.6, 0.0, headline(found), found.words)
        worst, without = found.worst, _without(found.laws.as_dict() if found.laws else {})
        rows = [(trial.effects[-1], trial.z) for trial in trials]
        rows = _with_winner(rows, worst.kind, worst.effects, worst.z_after)
        strong = {*found.effects, joined(worst.effects)}
        texts = (headline(found), _subtitle(found, without))
        return _bars(rows, found.before.z, strong, without, texts)


def draw_evidence(verdict: Mapping[str, Any]) -> Page | None:
    """Return the trials of a verdict.json as bars, at the site where the model errs the most.

    None where it holds none.
    """
    if not verdict.get("noise_known", True):
        return None
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
    before, own = float(at["z_holdout_before"]), [str(name) for name in at.get("effects") or []]
    if at.get("z_holdout_after") is not None:
        rows = _with_winner(rows, str(at.get("kind")), own, float(at["z_holdout_after"]))
    strong = {*(verdict.get("effects") or []), joined(own)}
    with look():
        return _bars(rows, before, strong, _without(verdict), ("", ""))


def _with_winner(
    rows: Sequence[tuple[str, float]], kind: str, effects: Sequence[str], z: float
) -> list[tuple[str, float]]:
    """Return the effects with their z, the best first, and among them the pair that was found.

    Parameters
    ----------
    rows : single effects
    kind, effects : what the site lacks
    z : what the model with these effects leaves
    """
    pair = [(joined(effects), z)] if kind == "effect" and len(effects) > 1 else []
    return sorted([*pair, *rows], key=lambda row: row[1])


def _without(verdict: Mapping[str, Any]) -> str:
    """Return which model the effects are added to: of a verdict with all laws its own law."""
    if not verdict.get("laws"):
        return "the present model"
    return f"{law_name(verdict)}, the law of this verdict, without the effect"


def _bars(
    rows: Sequence[tuple[str, float]], before: float, named: Collection[str], without: str,
    texts: tuple[str, str],
) -> Page:  # fmt: skip
    """Return the page of the trials.

    Parameters
    ----------
    rows : effects with their z
    before : z of the model without them
    named : the effects of the verdict, which are drawn in colour
    without : what that model is
    texts : title of the page, and what stands beneath
    """
    effects, values = [name for name, _ in rows], [z for _, z in rows]
    page = Page(7.6, ROW * len(effects) + 1.0, *texts)
    grid = page.grid(1, 1, top=0.3, bottom=0.5, left=1.9, right=0.7)
    axes = page.figure.add_subplot(grid[0, 0])
    names, strong = ([_label(name) for name in some] for some in (effects, named))
    draw_ranking(axes, names, values, before, strong)
    axes.set_title(f"dashed: {without}, z = {short_z(before)}", loc="right", fontsize=8.5)
    axes.set_xlabel("error / noise on held-out runs (z)")
    return page


def _label(name: str) -> str:
    """Return an effect, or a pair of them, as it stands beside its bar: a pair in two lines."""
    return f"with {name}".replace(" and ", "\nand ")


def headline(found: Diagnosis) -> str:
    """Return a verdict in one line."""
    return TITLES.get(found.kind, TITLES["ambiguous"]).format(names=", ".join(found.effects))


def _subtitle(found: Diagnosis, without: str) -> str:
    site = found.worst.site if found.worst is not None and found.force else ""
    where = f" at the {site}" if site else ""
    return (
        f"Dashed: {without}{where}. Each bar: the model with that effect, fitted again. "
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
