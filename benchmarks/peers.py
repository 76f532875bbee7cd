"""How well the methods find hidden effects that users would otherwise try."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ._blind import plan, record, work
from ._blind.methods import METHODS, TESTS
from ._blind.score import answer, count, hidden
from ._blind.table import Figure, binned, of_kind, share
from ._rows import Row


def figures(lines: list[dict[str, Any]]) -> list[Figure]:
    """Return the rows of every method at 1 % noise."""
    rows: list[Figure] = []
    single, none = of_kind(lines, "effect", 0.01), of_kind(lines, "none", 0.01)
    outside = of_kind(lines, "outside", 0.01)
    for method in (*METHODS, *TESTS):
        rows += _rows(method, single, none, outside)
    return rows


def _rows(method: str, single: Any, none: Any, outside: Any) -> list[Figure]:
    def said(line: dict[str, Any]) -> dict[str, Any]:
        return answer(line).get(method) or {"named": [], "unknown": False}

    strong, weak = binned(single, "15 %", "40 %"), binned(single, "5 %")
    seen = binned(outside, "15 %", "40 %")
    alarms = count(none, lambda x: bool(said(x)["named"]) or said(x)["unknown"])
    rows = [("false alarms on none", alarms), ("outside effect seen as unknown", _of(seen, said))]
    if method in METHODS:
        first = [
            (
                f"hidden effect first, {name}",
                count(cases, lambda x: said(x)["named"][:1] == [*hidden(x)]),
            )
            for name, cases in (("15 and 40 %", strong), ("5 %", weak))
        ]
        alone = count(strong, lambda x: said(x)["named"] == [*hidden(x)])
        rows = [*first, ("and nothing else named, 15 and 40 %", alone), *rows]
        rows.append(("library effect called unknown", _of(single, said)))
    return [share(f"{method}: {name}", found, group="peers") for name, found in rows]


def _of(lines: Any, said: Callable[..., Any]) -> Any:
    return count(lines, lambda line: said(line)["unknown"])


def run() -> list[Row]:
    """Return the rows of the peers in the last record of `benchmarks/blind.py`."""
    seed = record.newest()
    if seed is None:
        return [Row("peers of the diagnosis", "not run yet: python benchmarks/blind.py")]
    rows = figures(work.finished(record.path_of(seed), plan.make_plan(seed, plan.CASES), "peers"))
    return [one.row() for one in rows if one.value is not None]
