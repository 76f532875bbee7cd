"""The table of the docs: what each value trades, and what the rule says of all its fields."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby

from bristle.diagnosis.decision import decide
from bristle.diagnosis.inconsistent_runs import kind_of
from bristle.diagnosis.rule import BENCH, SITE, DecisionRule
from bristle.diagnosis.site import decide_site
from bristle.physics.effect import EFFECTS

from .trials import NotStoredError, Stored, organised
from .varied import names, told, values_of, variants


@dataclass(frozen=True)
class Traded:
    """What one value of a field does on all stored cases, as counts of how many.

    `alarms` cases that hide nothing, or a sensor's fault alone, in which something is said to be
    missing; `missed` hidden effects that the verdict does not name, `wrong` those in whose place it
    names another one; `outside` effects that no effect of the library describes and that got a
    name; `pairs` of which both were named. `left` cases were left out: their trials are not stored.
    """

    field: str
    value: float
    alarms: tuple[int, int]
    missed: tuple[int, int]
    wrong: tuple[int, int]
    outside: tuple[int, int]
    pairs: tuple[int, int]
    left: int = 0


def traded(cases: Iterable[Stored], base: DecisionRule) -> list[Traded]:
    """Return what each value of each field trades, on the bench or at a building's sites."""
    own = [case for case in cases if bool(case.site) == (base == SITE)]
    return [count(own, name, value, rule) for name, value, rule in variants(base)]


def count(cases: Iterable[Stored], name: str, value: float, rule: DecisionRule) -> Traded:
    """Return what one rule makes of all cases."""
    seen: Counter[str] = Counter()
    for case in cases:
        try:
            kind, effects = answer(case, rule)
        except NotStoredError:
            seen["left"] += 1
            continue
        seen.update(marks(case, kind, effects))

    def of(what: str, all_of: str) -> tuple[int, int]:
        return seen[what], seen[all_of]

    return Traded(
        name, value, of("alarm", "none"), of("missed", "effect"), of("wrong", "effect"),
        of("named", "outside"), of("both", "pair"), seen["left"],
    )  # fmt: skip


def answer(case: Stored, rule: DecisionRule) -> tuple[str, tuple[str, ...]]:
    """Return kind and effects of the verdict that a rule gives on stored trials."""
    if case.opened or case.before is None:
        return case.opened or "none", ()
    if case.site:
        decision = decide_site(case.before, case.single, rule)
        return kind_of(decision.kind, case.before, decision.best, rule), decision.effects
    decision = decide(case.before, case.single, case.grow, organised(case, rule), case.reduce, rule)
    kind = kind_of(decision.kind, case.before, decision.best, rule)
    if case.instruments and kind in ("none", "effect"):
        return "effect", (*case.instruments, *decision.effects)
    return kind, decision.effects


def hidden(case: Stored) -> tuple[str, ...]:
    """Return the effects that a case hides, at a site those that can act there."""
    names = () if case.task.effect == "none" else tuple(case.task.effect.split("+"))
    if not case.site:
        return names
    hook = "force" if case.site == "layer" else "spring"
    return tuple(name for name in names if name in EFFECTS and hook in EFFECTS[name].hooks())


def marks(case: Stored, kind: str, effects: tuple[str, ...]) -> list[str]:
    """Return what a verdict counts as."""
    true, what = hidden(case), case.task.kind
    named = kind in ("effect", "ambiguous")
    if what == "fault":
        return ["none"] + ["alarm"] * named
    if what == "outside":
        return ["outside"] + ["named"] * named
    if not true:
        return ["none"] + ["alarm"] * (kind != "none")
    if what == "pair":
        return ["pair"] + ["both"] * (kind == "effect" and set(effects) == set(true))
    families = {_family(name) for name in effects}
    right = named and _family(true[0]) in families
    wrong = named and not right
    return ["effect"] + ["missed"] * (not right) + ["wrong"] * wrong


def _family(name: str) -> str:
    return (EFFECTS[name].family if name in EFFECTS else "") or name


def both(cases: list[Stored]) -> dict[str, list[Traded]]:
    """Return what the values trade on the bench and at a building's sites, empty without cases."""
    out = {"bench": traded(cases, BENCH), "site": traded(cases, SITE)}
    count_of = {"bench": sum(not c.site for c in cases), "site": sum(bool(c.site) for c in cases)}
    return {name: rows for name, rows in out.items() if count_of[name]}


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
