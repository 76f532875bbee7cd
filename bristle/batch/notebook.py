"""What a notebook shows of an ensemble, and of the best constant voltages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI
from ..draw.style import png
from ..quantity import plain
from .passive_picture import draw_passive
from .picture import draw_ensemble

if TYPE_CHECKING:
    from .execute import Ensemble
    from .passive import Passive


def ensemble_html(found: Ensemble) -> str:
    """Return an ensemble as HTML: quantiles in a table, failures, and its picture."""
    done = int((found.runs["status"] == "done").sum())
    columns = [str(name) for name in found.quantiles.columns]
    rows = [
        [str(name), *(_cell(value) for value in row)]
        for name, row in zip(found.quantiles.index, found.quantiles.to_numpy(), strict=True)
    ]
    failures = [f"{one.count} failed: {one.reason}" for one in found.failures]
    picture = ""
    if done > 1:
        picture = html.figure(png(draw_ensemble(found), DPI), found.plan.title)
    return html.fragment(
        found.plan.title,
        html.paragraphs(f"{done} of {found.plan.runs} runs are done."),
        html.table(["output", *columns], rows, range(2, len(columns) + 1)),
        html.items([*failures, *found.notes]),
        picture,
    )


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def passive_html(found: Passive) -> str:
    """Return best constant voltages as HTML: of each motion and of all, and their picture."""
    value = f"{found.what} [{found.unit}]"
    best = [
        [motion.name, f"{one.voltage:.2f}", plain(one.value, 4)]
        for motion, one in zip(found.motions, found.best, strict=True)
    ]
    title = f"Best constant voltages: least {found.what}"
    return html.fragment(
        title,
        html.table(["ground motion", "voltage [V]", value], best, (1, 2)),
        html.table(
            ["for all of them", "voltage [V]", ""],
            [[text, f"{v:.2f}", said] for text, v, said in found.for_all()], (1,),
        ),
        html.figure(png(draw_passive(found), DPI), title),
    )  # fmt: skip
