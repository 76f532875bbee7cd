"""Tables IV and V and the runs beyond the stroke, as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

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
    heads = "".join(f"<th>{escape(heading).replace('2]', '²]')}</th>" for heading, _ in listed)
    body = []
    groups: Any = table.groupby(["motion", "intensity [g]"], sort=False)
    for (motion, g), group in groups:
        body.append(
            f'<tr class="group"><td colspan="{1 + len(listed)}">{escape(motion)}, nominal '
            f"{g:g} g</td></tr>"
        )
        own = group.set_index("law")
        for law in own.index:
            cells = "".join(_cell(own, str(law), column) for _, column in listed)
            body.append(f"<tr><td>{escape(str(law))}</td>{cells}</tr>")
    rows = "\n".join(body)
    marked = f" {MARK}: beyond the damper's stroke." if kind == "peak" else ""
    window = "" if kind == "peak" else " RMS values are over the record as published."
    return f"""<section>
<h2 id="{name}">{escape(title)}</h2>
<p>Bold: the lowest of the three controllers.{marked}{window}</p>
<div class="scroll"><table class="numbers"><thead><tr><th>Law</th>{heads}</tr></thead><tbody>
{rows}
</tbody></table></div>
</section>
"""


def _cell(own: Any, law: str, column: str) -> str:
    value = float(own.loc[law, column])
    text = shown(value, column)
    others = [shown(float(own.loc[c, column]), column) for c in CONTROLLERS if c != law]
    if law in CONTROLLERS and float(text) < min(map(float, others)):
        text = f"<b>{text}</b>"
    if law == NONE and ("force" in column or "voltage" in column):
        text = "-"
    beyond = "base drift" in column and BEYOND in own and float(own.loc[law, BEYOND]) > 0.0
    return f"<td>{text}{MARK if beyond else ''}</td>"


def stroke_html(comparison: Comparison) -> str:
    """Return a section on the runs that leave the damper's stroke; "" if there are none."""
    text = stroke_text(comparison)
    if not text:
        return ""
    rows = "".join(f"<li>{escape(line)}</li>" for line in stroke_lines(comparison))
    return f"""<section>
<h2 id="stroke">Runs beyond the damper's stroke</h2>
<p>{escape(text)}</p>
<ul>{rows}</ul>
</section>
"""
