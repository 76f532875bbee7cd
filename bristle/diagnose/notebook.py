"""What a notebook shows of a verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..draw import html
from ..draw.figure import DPI
from ..draw.style import png, short_z
from ..quantity import percent
from .picture import MOST, draw_diagnosis, headline

if TYPE_CHECKING:
    from .verdict import Diagnosis

_HEADER = ["model", "z, training", "z, held out", "error lower by"]


def diagnosis_html(found: Diagnosis) -> str:
    """Return a verdict as HTML: its words, the trials in a table, and their picture."""
    rows, strong = _rows(found)
    table = html.table(_HEADER, rows, numbers=(1, 2, 3), strong=strong)
    if not rows:  # data that carry no verdict: what was found of the channels
        faults = [[one.channel, one.fault, f"{one.value:.4g}"] for one in found.sensors]
        table = html.table(["channel", "fault", "value"], faults, numbers=(2,))
    return html.fragment(
        headline(found),
        html.paragraphs(found.words),
        table,
        html.paragraphs("z: error / noise; a true model has 1." if rows else ""),
        html.figure(png(draw_diagnosis(found), DPI), headline(found)),
    )


def _rows(found: Diagnosis) -> tuple[list[list[str]], list[int]]:
    """Return the rows of the trials, and which of them the verdict names."""
    before = found.before
    if before is None:
        return [], []
    worst = found.worst
    assert worst is not None
    known = found.noise_known

    def z(value: float) -> str:
        return short_z(value if known else None)

    rows = [["present model", z(before.train), z(before.z), ""]]
    strong = []
    for trial in found.trials[:MOST]:
        if trial.effects[-1] in found.effects:
            strong.append(len(rows))
        gain = percent(worst.gain(trial)) if before.z > 0.0 else ""
        rows.append([f"with {trial.effects[-1]}", z(trial.train), z(trial.z), gain])
    return rows, strong
