"""The table of the docs: what each value trades, and what the rule says of all its fields."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from bristle.diagnosis.rule import BENCH, SITE, DecisionRule

from .replay import Traded
from .trials import Stored
from .varied import names, told, values_of

BEGIN, END = "<!-- calibrate -->", "<!-- /calibrate -->"
COLUMNS: dict[str, Callable[[Traded], tuple[int, int]]] = {
    "false alarms": lambda row: row.alarms,
    "missed": lambda row: row.missed,
    "another named": lambda row: row.wrong,
    "outside named": lambda row: row.outside,
    "pairs: both": lambda row: row.pairs,
}
RULES: dict[str, DecisionRule] = {"bench": BENCH, "site": SITE}
TITLES = {"bench": "On the bench", "site": "At a building's layer and storeys"}


def text(rows: dict[str, list[Traded]], cases: list[Stored], seed: int) -> str:
    """Return the block of the docs in Markdown."""
    out = [conditions(cases, seed)]
    for name, found in rows.items():
        out += [f"### {TITLES[name]}", sensitivity(found), table(found, RULES[name])]
    return "\n\n".join(out)


def conditions(cases: list[Stored], seed: int) -> str:
    """Return on what the tables rest."""
    bench = sum(not case.site for case in cases)
    buildings = len({case.task.key for case in cases if case.site})
    codes = len({case.code for case in cases})
    more = f" {codes} versions of the code made them." if codes > 1 else ""
    return (
        f"Seed {seed}: {bench} cases on the bench, {buildings} buildings. Each site of a building "
        f"counts as a case.{more} Today's value is in bold."
    )


def sensitivity(rows: list[Traded]) -> str:
    """Return which fields these cases can say anything about: those that move a count at all."""
    fields = list(dict.fromkeys(row.field for row in rows))
    moved = [name for name in fields if _moves([row for row in rows if row.field == name])]
    if not moved:
        return (
            "**No value of any field changes a count here. These cases are too far from every "
            "threshold to distinguish values: they neither support today's values nor show that "
            "values do not matter.**"
        )
    still = len(fields) - len(moved)
    return (
        f"Counts change with {', '.join(f'`{name}`' for name in moved)}. These cases say nothing "
        f"about the other {still} fields, because no case is near their thresholds. The table "
        "leaves them out."
    )


def _moves(rows: list[Traded]) -> bool:
    return len({tuple(of(row) for of in COLUMNS.values()) for row in rows}) > 1


def table(rows: list[Traded], base: DecisionRule) -> str:
    """Return a line per field that moves a count or leaves cases out: its values, and counts."""
    used = {what: of for what, of in COLUMNS.items() if any(of(row)[1] for row in rows)}
    most = {what: max(of(row)[1] for row in rows) for what, of in used.items()}
    titles = [f"{what} of {most[what]}" for what in used]
    lines = [["field", "values", *titles], ["---"] * (2 + len(used))]
    for name, group in groupby(rows, key=lambda row: row.field):
        own = list(group)
        left = sum(row.left for row in own)
        if not (left or _moves(own)):
            continue
        today = [row.value == getattr(base, name) for row in own]
        cells = [f"{row.value:g}" for row in own]
        lines.append(
            [f"`{name}`" + (f" ({left} left out)" if left else ""), _marked(cells, today)]
            + [_marked([str(of(row)[0]) for row in own], today) for of in used.values()]
        )
    if len(lines) == 2:
        return ""
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _marked(cells: list[str], today: list[bool]) -> str:
    """Return the cells with today's in bold; one alone, where they are all the same."""
    if len(set(cells)) == 1:
        return cells[0]
    return "/".join(f"**{c}**" if now else c for c, now in zip(cells, today, strict=True))


def every_field() -> str:
    """Return what the rule says of each field, replayed or not: a page of its own."""
    known = told()
    lines = [["field", "value", "decides", "trades", "found"], ["---"] * 5]
    lines += [
        [f"`{n}`", values_of(n), known[n].decides, known[n].trades, known[n].found] for n in names()
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write(page: Path, block: str) -> None:
    """Write the block between the marks of a page.

    Raises
    ------
    ValueError
        If the page has no marks.
    """
    whole = page.read_text(encoding="utf-8")
    if BEGIN not in whole or END not in whole:
        raise ValueError(f"{page}: no {BEGIN} and {END} are there to write between.")
    head, _, rest = whole.partition(BEGIN)
    tail = rest.partition(END)[2]
    page.write_text(f"{head}{BEGIN}\n\n{block}\n\n{END}{tail}", encoding="utf-8")
