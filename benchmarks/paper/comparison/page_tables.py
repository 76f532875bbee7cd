"""Tables IV and V and the runs beyond the stroke, as HTML."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bristle.view import html

from .experiment import BEYOND, CONTROLLERS, NONE, Comparison
from .tables import MARK, TABLES, columns, shown, stroke_lines, stroke_text

if TYPE_CHECKING:
    import pandas as pd


def table_html(name: str, table: pd.DataFrame) -> str:
    """Return Table IV or V, the lowest of the controllers bold, drifts beyond the stroke marked.

    Parameters
    ----------
    name : "table4" or "table5"
    table : as `tables.published_table` returns it
    """
    kind, title = TABLES[name]
    listed = columns(kind)
    header = ["Law", *(heading.replace("2]", "²]") for heading, _ in listed)]
    marked = f" {MARK}: beyond the damper's stroke." if kind == "peak" else ""
    window = "" if kind == "peak" else " RMS values are over the record as published."
    parts = [html.paragraphs(f"Bold: the lowest of the three controllers.{marked}{window}")]
    groups: Any = table.groupby(["motion", "intensity [g]"], sort=False)
    for (motion, g), group in groups:
        own = group.set_index("law")
        rows: list[list[str]] = []
        bold: dict[tuple[int, int], str] = {}
        for k, law in enumerate(own.index.astype(str)):
            rows.append([law, *(_cell(own, law, column) for _, column in listed)])
            lowest = [_is_lowest(own, law, column) for _, column in listed]
            bold |= {(k, 1 + i): "strong" for i, one in enumerate(lowest) if one}
        parts.append(f"<h3>{html.escape(motion)}, nominal {g:g} g</h3>")
        parts.append(html.table(header, rows, range(1, len(header)), kinds=bold))
    return html.section(title, *parts, name=name)


def _cell(own: Any, law: str, column: str) -> str:
    if law == NONE and ("force" in column or "voltage" in column):
        return "-"
    beyond = "base drift" in column and BEYOND in own and float(own.loc[law, BEYOND]) > 0.0
    return shown(float(own.loc[law, column]), column) + (MARK if beyond else "")


def _is_lowest(own: Any, law: str, column: str) -> bool:
    """Return whether a controller has the lowest value, as the numbers are shown."""
    value = {one: float(shown(float(own.loc[one, column]), column)) for one in CONTROLLERS}
    return law in value and all(value[law] < value[one] for one in value if one != law)


def stroke_html(comparison: Comparison) -> str:
    """Return a section on the runs that leave the damper's stroke; "" if there are none."""
    text = stroke_text(comparison)
    if not text:
        return ""
    return html.section(
        "Runs beyond the damper's stroke", html.paragraphs(text),
        html.items(stroke_lines(comparison)), name="stroke",
    )  # fmt: skip
