"""Tables IV and V of the comparison, and the runs in which the base leaves the damper's stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .experiment import BEYOND, LAWS, NONE, QUANTITIES, Comparison

if TYPE_CHECKING:
    import pandas as pd

TABLES = {
    "table4": ("peak", "Table IV: peaks of all motions"),
    "table5": ("rms", "Table V: RMS of all motions"),
}
"""File name to what is tabled of each quantity, and the title."""

DIGITS = {
    "peak": {"base drift": 1, "voltage": 1},
    "rms": {"damper force": 2, "voltage": 2, "base drift": 2},
}
_USUAL = {"peak": 2, "rms": 3}
MARK = "†"
"""Behind a drift that is larger than the damper's stroke."""


def published_table(comparison: Comparison, kind: str) -> pd.DataFrame:
    """Return Table IV or V of the comparison: a row per motion, intensity and law.

    Parameters
    ----------
    comparison : Comparison
    kind : {"peak", "rms"}
        "peak" gives Table IV, with a column `BEYOND`; "rms" gives Table V, over the record as
        published.

    Returns
    -------
    DataFrame
        Columns "motion", "intensity [g]", "law" and one per quantity, named as in
        `Comparison.table`.
    """
    part = comparison.table[comparison.table["law"].isin(LAWS)].copy()
    order = {law: i for i, law in enumerate(LAWS)}
    places = {motion.name: i for i, motion in enumerate(comparison.motions)}
    part["_place"], part["_law"] = part["motion"].map(places), part["law"].map(order)
    part = part.sort_values(["_place", "intensity [g]", "_law"])
    keep = [column for _, column in columns(kind)] + [BEYOND] * (kind == "peak")
    return part[["motion", "intensity [g]", "law", *keep]].reset_index(drop=True)


def columns(kind: str) -> list[tuple[str, str]]:
    """Return heading and column of each quantity of a table, kind "peak" or "rms"."""
    return [
        (f"{quantity} [{unit}]", f"{kind} {quantity} [{unit}]")
        for quantity, (_, unit, _) in QUANTITIES.items()
    ]


def shown(value: float, column: str) -> str:
    """Return a number of a table as text, with the digits that its column has.

    Parameters
    ----------
    value : in the unit of the column
    column : name of the column, such as "peak base drift [mm]"
    """
    kind, _, rest = column.partition(" ")
    digits = DIGITS[kind].get(rest.partition(" [")[0], _USUAL[kind])
    return f"{value:.{digits}f}"


def beyond_stroke(comparison: Comparison) -> pd.DataFrame:
    """Return the rows of all runs in which the base drifts beyond the damper's stroke."""
    return comparison.table[comparison.table[BEYOND] > 0.0]


def stroke_text(comparison: Comparison) -> str:
    """Return in one sentence how many runs leave the stroke, and what that means; "" if none."""
    rows = beyond_stroke(comparison)
    if rows.empty:
        return ""
    with_damper = int((comparison.table["law"] != NONE).sum())
    drift = rows["peak base drift [mm]"]
    stroke = float((drift - rows[BEYOND]).iloc[0])
    return (
        f"In {len(rows)} of {with_damper} runs with a damper the base drifts beyond the damper's "
        f"stroke of {stroke:.0f} mm, by up to {rows[BEYOND].max():.0f} mm. The model has no end "
        "stop there: a real damper of this stroke would hit its end, so these rows hold for a "
        "longer one."
    )


def stroke_lines(comparison: Comparison) -> list[str]:
    """Return a line per motion and intensity: the laws that leave the stroke, with the drift."""
    groups: dict[tuple[str, float], list[str]] = {}
    rows = beyond_stroke(comparison)[["motion", "intensity [g]", "law", "peak base drift [mm]"]]
    for motion, g, law, drift in rows.itertuples(index=False, name=None):
        groups.setdefault((motion, g), []).append(f"{law} {drift:.1f} mm")
    places = [motion.name for motion in comparison.motions]
    ordered = sorted(groups, key=lambda case: (places.index(case[0]), case[1]))
    return [f"{motion} {g:g} g: {'; '.join(groups[motion, g])}" for motion, g in ordered]
