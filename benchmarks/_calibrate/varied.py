"""Which values of a decision rule are looked at, and what the rule says of its fields."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

from bristle.diagnosis import rule as module
from bristle.diagnosis.rule import BENCH, SITE, DecisionRule

BENCH_VALUES: dict[str, tuple[float, ...]] = {
    "gain": (0.005, 0.01, 0.02, 0.03, 0.05),
    "chance": (0.001, 0.003, 0.01, 0.03, 0.1),
    "most_rms": (1.02, 1.05, 1.1, 1.2, 1.5),
    "learned": (0.0, 0.05, 0.1, 0.3, 1.0),
    "clean": (1.05, 1.1, 1.15, 1.2, 1.3),
    "organised": (0.03, 0.06, 0.12, 0.24, 0.5),
    "noise_overestimated": (0.8, 0.85, 0.9, 0.95, 0.98),
    "adequate": (1.02, 1.05, 1.08, 1.12, 1.2),
    "share": (0.5, 0.65, 0.75, 0.85, 0.95),
    "least_excess": (0.003, 0.006, 0.01, 0.02, 0.04),
    "close": (0.001, 0.002, 0.004, 0.008, 0.02),
    "rival": (1.05, 1.1, 1.25, 1.5, 2.0),
    "most_alternatives": (1, 2, 3, 4, 5),
    "first": (0.05, 0.1, 0.2, 0.3, 0.5),
    "pair_left": (0.2, 0.35, 0.5, 0.7, 0.9),
    "pair_part": (0.01, 0.02, 0.05, 0.1, 0.2),
    "complete": (1.01, 1.02, 1.04, 1.06, 1.08),
    "rest": (0.01, 0.02, 0.03, 0.06, 0.12),
    "trained": (1.02, 1.05, 1.1, 1.15, 1.3),
    "misfit": (1.05, 1.1, 1.15, 1.2, 1.3),
}
"""The values looked at on the bench, that of today among them: fields that trials suffice for."""

SITE_VALUES: dict[str, tuple[float, ...]] = {
    "gain": (0.01, 0.02, 0.03, 0.05, 0.1),
    "chance": (0.001, 0.003, 0.01, 0.03, 0.1),
    "clean": (1.05, 1.1, 1.15, 1.2, 1.3),
    "share": (0.5, 0.6, 0.7, 0.8, 0.95),
    "least_excess": (0.003, 0.006, 0.01, 0.02, 0.04),
    "close": (0.001, 0.002, 0.005, 0.01, 0.03),
    "rival": (1.1, 1.5, 2.0, 3.0, 5.0),
    "most_alternatives": (1, 2, 3, 4),
    "likelihood": (5.0, 20.0, 40.0, 80.0, 320.0),
    "trained": (1.02, 1.05, 1.1, 1.15, 1.3),
    "misfit": (1.05, 1.1, 1.15, 1.2, 1.3),
}
"""The same at a building's layer and storeys."""


def variants(base: DecisionRule) -> Iterator[tuple[str, float, DecisionRule]]:
    """Yield field, value and rule, one field moved at a time, the rule as it is among them."""
    for name, values in (SITE_VALUES if base == SITE else BENCH_VALUES).items():
        for value in values:
            yield name, value, replace(base, **{name: value})  # type: ignore[arg-type]


@dataclass(frozen=True)
class Told:
    """What the rule says of a field: what it decides, what it trades, how it was found."""

    decides: str
    trades: str
    found: str


def told() -> dict[str, Told]:
    """Return what is said of each field of the rule, from the text below it."""
    tree = ast.parse(inspect.getsource(module))
    (owner,) = (n for n in tree.body if isinstance(n, ast.ClassDef))
    out = {}
    for field, text in zip(owner.body, owner.body[1:], strict=False):
        if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
            continue
        value = text.value.value if isinstance(text, ast.Expr) else ""  # type: ignore[attr-defined]
        out[field.target.id] = _parted(" ".join(str(value).split()))
    return out


def _parted(text: str) -> Told:
    """Return the three parts of a field's text; empty where one is missing."""
    if "Trades and found: " in text:
        decides, _, both = text.partition("Trades and found: ")
        return Told(decides.strip(), both, both)
    decides, _, rest = text.partition("Trades: ")
    trades, _, found = rest.partition("Found: ")
    return Told(decides.strip(), trades.strip(), found.strip())


def instances() -> dict[str, DecisionRule]:
    """Return the rules in use by name."""
    known: dict[str, Any] = vars(module)
    return {n: value for n, value in known.items() if isinstance(value, DecisionRule)}


def values_of(name: str) -> str:
    """Return a field's value in each rule in use: one number where they agree."""
    rules = instances()
    first = getattr(BENCH, name)
    others = [f"{n} {getattr(r, name):g}" for n, r in rules.items() if getattr(r, name) != first]
    return ", ".join([f"{first:g}", *others])


def names() -> list[str]:
    """Return the fields of the rule."""
    return [field.name for field in fields(DecisionRule)]
