"""What a verdict says of laws, in words and as a table, from the content of verdict.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..compare.names import joined
from ..identify.error import ForceError
from ..physics.forms import LINEAR_FORM
from ..quantity import short_z
from .decision import Z

Row = Mapping[str, Any]

MOST_EQUAL = 3
"""Pairs of law and effects that a verdict names as doing as well."""

HEADER = (
    "law", "command", "fitted", "z, training", "z, held out", "above the best",
    "error, training", "error, held out",
)  # fmt: skip
"""Columns of the table of laws; the last two are those of `ERRORS`."""

ERRORS = ("error_train", "error_holdout")
"""Where a row has the error of the force; one of an earlier version has another error, and none."""

TABLE_NOTE = (
    "z: error / noise; a true model has 1. Above the best: z less that of the best law, the mean "
    "over held-out runs with its 95 % interval. A law that contains a missing effect errs less "
    "than the true law without it."
)


def law_name(row: Row) -> str:
    """Return the name of a law with the form of its command: "lugre with a quadratic command"."""
    form = row.get("command") or LINEAR_FORM
    return f"{row['law']} with a {form} command" if form != LINEAR_FORM else str(row["law"])


def law_sentences(verdict: Row) -> list[str]:
    """Return which law the runs prefer, and what explains them as well.

    None of a law given; where the runs allow no verdict, only which laws were not tried.
    """
    rows = verdict.get("laws") or []
    if not rows:
        return []
    unfit = [str(name) for name in verdict.get("laws_left_out") or []]
    if verdict.get("kind") == "insufficient":
        return [left_out(unfit)] if unfit else []
    own = (verdict["law"], verdict["command"])
    mine = next(row for row in rows if (row["law"], row["command"]) == own)
    z = short_z(mine.get("z_with_effects", mine["z_holdout"]))
    with_what = f" with {joined(mine['effects'])}" if mine.get("kind") == "effect" else ""
    count = len({row["law"] for row in rows})
    if not verdict.get("noise_known", True):
        out = [f"Of {count} laws {law_name(mine)}{with_what} leaves the least on held-out runs."]
    elif verdict.get("kind") == "unknown":
        out = [
            f"None of {count} laws explains the runs, with an effect or without; {law_name(mine)} "
            f"comes nearest, {Z} = {z} without."
        ]
    else:
        out = [
            f"Of {count} laws it is the simplest that explains the runs: "
            f"{law_name(mine)}{with_what} has {Z} = {z} on held-out runs."
        ]
    if unfit:
        out.append(left_out(unfit))
    equal = [_pair_name(row) for row in verdict.get("equivalent") or []]
    if equal:
        more = f", and {len(equal) - MOST_EQUAL} more" if len(equal) > MOST_EQUAL else ""
        verb = "explain" if len(equal) > 1 else "explains"
        text = joined(equal[:MOST_EQUAL]) if not more else ", ".join(equal[:MOST_EQUAL])
        out.append(f"As far as these runs tell, {text}{more} {verb} them as well.")
    return out


def left_out(laws: Sequence[str]) -> str:
    """Return the sentence that tells which laws were not tried, and why."""
    verb = "are" if len(laws) > 1 else "is"
    return f"{joined(laws)} {verb} left out: the force is not a number on these runs."


def _pair_name(row: Row) -> str:
    effects = row.get("effects") or []
    return f"{law_name(row)} with {joined(effects) if effects else 'nothing missing'}"


def law_table(rows: Sequence[Row]) -> list[list[str]]:
    """Return the cells of the table of laws, one row per law as in verdict.json; see `HEADER`."""
    known = [row[key] for row in rows for key in ERRORS if row.get(key)]
    size = max((one["signal_all"] for one in known), default=0.0)
    return [_cells(row, size) for row in rows]


def _cells(row: Row, size: float) -> list[str]:
    half, above = row.get("interval95"), row["z_above_best"]  # None where no noise is known
    spread = f" +- {half:.2f}" if half is not None else ""
    return [
        str(row["law"]), str(row["command"]), str(row["fitted"]),
        short_z(row["z_train"]), short_z(row["z_holdout"]),
        f"{above:.2f}{spread}" if above else "-",
        *(ForceError.of(row[key]).text("N", size) if row.get(key) else "-" for key in ERRORS),
    ]  # fmt: skip
