"""Stored trials decided anew, with one value of the rule moved at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from bristle.diagnosis.decision import decide
from bristle.diagnosis.inconsistent_runs import kind_of
from bristle.diagnosis.rule import BENCH, SITE, DecisionRule
from bristle.diagnosis.site import decide_site
from bristle.physics.effect import EFFECTS

from .trials import NotStoredError, Stored, organised
from .varied import variants


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
