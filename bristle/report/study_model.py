"""The model in a study's report: its equations with numbers, and what makes its force."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ..data.equation import equations
from ..physics.drive import DRIVES
from ..study.budget_picture import budgets, draw_budget, sentence
from ..view import html

if TYPE_CHECKING:
    from .study_content import Content


def model_section(content: Content) -> str:
    """Return the section: equations with intervals, the force budget; "" where there is neither."""
    parts = [*_equations(content), *_budget(content)]
    return html.section("The model", *parts) if parts else ""


def _equations(content: Content) -> list[str]:
    found = equations(content.model)
    if not found:
        return []
    drive = DRIVES[content.model.drive]
    parts: list[str] = []
    for of in dict.fromkeys(one.of for one in found):
        parts.append(f"<h3>{html.escape(of)}</h3>")
        parts += [html.formula(one.intervals) for one in found if one.of == of]
    acts = any(re.search(rf"\b{drive.symbol}(_felt)?\b", one.intervals) for one in found)
    command = f"{drive.symbol} is the {drive.name} [{drive.unit}], " if acts else ""
    note = (
        f"In SI units; {command}x and v are displacement "
        "and velocity of the rod. The numbers are those of the present model with half of their "
        "95 % intervals; a number without one was held, or these data do not identify it."
    )
    return [*parts, html.paragraphs(note, kind="soft")]


def _budget(content: Content) -> list[str]:
    at = content.damper
    if at is None:
        return []
    from ..draw.style import png

    problem = at.site.holdout or at.site.train
    page, said = draw_budget(problem, at.model), sentence(budgets(problem, at.model))
    if page is None or not said:
        return []
    caption = (
        "The parts of the model's force in single cycles, stacked: what resists above and below "
        "zero, their sum the line. An effect's part is what the force loses without it."
    )
    return [
        "<h3>The force budget</h3>",
        html.paragraphs(said),
        html.figure(png(page), said, caption),
    ]
