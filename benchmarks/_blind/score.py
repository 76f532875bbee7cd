"""From finished cases to counts: what each row of the table calls right, as plain functions.

A line is what `work.do` returns. Strengths are binned by what was reached, not by what was asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from tests.independent.effects import FORMS

from .forms import LIMITS, true_values
from .plan import Task

Line = dict[str, Any]

BINS = {"5 %": (0.025, 0.0866), "15 %": (0.0866, 0.245), "40 %": (0.245, float("inf"))}
"""Shares reached by bin; the edges are the geometric means of the wanted ones."""

FAMILY = ("presliding", "mount_compliance", "backlash")
"""Effects that count as one where the row says so."""

TWINS = {"gas_spring", "duffing"}
"""Effects that add up to one force where it is reconstructed, as do an effect of the layer and the
same one of the damper. (The other such rivals, f_c beside `base_friction` and a mass of the base
beside `fluid_inertia`, are no effects: words name them.)"""

RESOLVED = 3.0
"""Standard deviations from which on the data tell two effects apart (see `inseparable`)."""

LARGEST_CLASS = 3
AT_95 = 1.959964
"""Two-sided 95 % point of the normal distribution."""

COORDINATES = {
    "displacement": ("displacement",),
    "velocity": ("velocity", "speed"),
    "rest": ("rest", "time_at_rest", "time_since_rest", "time_since_reversal"),
    "frequency": ("frequency",),
    "travel": ("travel", "time_since_reversal"),
    "voltage": ("voltage", "recent_voltage"),
}
"""The generator's word for what organises an effect, and what a verdict may call it."""

SWAPPED = {"displacement": "velocity", "velocity": "displacement"}


def wilson(successes: int, trials: int, z: float = AT_95) -> tuple[float, float]:
    """Return the interval of a proportion; (0, 1) without trials.

    Wilson (1927), J. Am. Stat. Assoc. 22, 209-212.
    """
    if trials == 0:
        return 0.0, 1.0
    p, n = successes / trials, float(trials)
    centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n)
    half = z / (1.0 + z * z / n) * sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n))
    return max(0.0, centre - half), min(1.0, centre + half)


@dataclass(frozen=True)
class Count:
    """How many of how many, with the Wilson interval at 95 %."""

    good: int
    of: int

    @property
    def share(self) -> float:
        """Return the proportion, nan without cases."""
        return self.good / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Return the interval of the proportion."""
        return wilson(self.good, self.of)


def count(lines: Iterable[Line], is_good: Callable[[Line], bool]) -> Count:
    """Return how many lines are good."""
    marks = [is_good(line) for line in lines]
    return Count(sum(marks), len(marks))


# --- which cases belong to a row ----------------------------------------------------------------


def task(line: Line) -> Task:
    """Return the task of a line."""
    return Task.of(line["task"])


def hidden(line: Line) -> tuple[str, ...]:
    """Return the names of the hidden effects."""
    return tuple(one["effect"] for one in line["truth"]["effects"])


def bin_of(line: Line) -> str:
    """Return the bin of the share reached, "" below the lowest."""
    share = line["truth"]["share"]
    return next((name for name, (low, high) in BINS.items() if low <= share < high), "")


def unreachable(line: Line) -> bool:
    """Return whether physical bounds kept the effect below 0.9 of the wanted share."""
    wanted = line["truth"]["wanted"]
    bound = any(one["bound"] for one in line["truth"]["effects"])
    return bool(bound and line["truth"]["share"] < 0.9 * wanted)


def answer(line: Line) -> dict[str, Any]:
    """Return the answer; an error counts as the verdict "error", which is never right."""
    empty = {"kind": "error", "effects": [], "sensors": [], "coordinate": "", "ranking": []}
    said = line.get("answer") or empty
    # Answers that were stored when an ambiguous verdict was called a class.
    return {**said, "kind": "ambiguous"} if said["kind"] == "class" else said


# --- what is right ------------------------------------------------------------------------------


def _family(names: Iterable[str]) -> set[str]:
    return {FAMILY[0] if name in FAMILY else name for name in names}


def names_effect(line: Line) -> bool:
    """Single effect: it is the verdict, or in a class of at most three inseparable rivals."""
    said, (true,) = answer(line), hidden(line)
    if said["kind"] == "effect":
        return bool(_family(said["effects"]) == _family([true]))
    return in_class(line) and inseparable(line)


def names_effect_or_class(line: Line) -> bool:
    """Return what `names_effect` does with the separate test left out: the name is among three."""
    return names_effect(line) or in_class(line)


def in_class(line: Line) -> bool:
    """Return whether the verdict is a class of at most three with the hidden effect."""
    said, (true,) = answer(line), hidden(line)
    return (
        said["kind"] == "ambiguous"
        and len(said["effects"]) <= LARGEST_CLASS
        and true in said["effects"]
    )


def inseparable(line: Line) -> bool:
    """Return whether the separate test finds that these data resolve no rival of the class.

    Rivals of one family count as one.
    """
    said, (true,) = answer(line), hidden(line)
    resolved = said.get("resolved", {})
    rivals = [r for r in said["effects"] if r != true and not {r, true} <= set(FAMILY)]
    return all(r in resolved and resolved[r] < RESOLVED for r in rivals)


def names_in_building(line: Line) -> bool:
    """Return whether a building's effect is the verdict, or in a class that cannot be told apart.

    Where the force was reconstructed, rivals that add up to one force with the hidden effect need
    no test: equilibrium itself cannot part them. Other rivals must be shown inseparable.
    """
    said, (true,) = answer(line), hidden(line)
    if names_effect(line):
        return True
    if not in_class(line) or not line["task"].get("reconstructed"):
        return False
    resolved = said.get("resolved", {})
    own = [r for r in said["effects"] if r.partition("@")[0] != true]
    rivals = [r for r in own if not (_adds_up(r, true) or {r, true} <= set(FAMILY))]
    return all(r == true or resolved.get(r, RESOLVED) < RESOLVED for r in rivals)


def _adds_up(one: str, other: str) -> bool:
    return {one.partition("@")[0], other} <= TWINS


def tells_twin(line: Line) -> bool:
    """Return whether the verdict names something else that adds up to one force with the effect.

    Equilibrium without a load cell cannot part them; but then the verdict ought to name both.
    """
    said, (true,) = answer(line), hidden(line)
    return true in TWINS and bool(set(said["effects"]) & TWINS) and true not in said["effects"]


def names_it_alone(line: Line) -> bool:
    """Single effect: named and nothing else beside it, one family counting as one."""
    said = answer(line)
    return said["kind"] in ("effect", "ambiguous") and _family(said["effects"]) == _family(
        hidden(line)
    )


def false_alarm(line: Line) -> bool:
    """Nothing hidden: whether anything but "none" was said, a sensor fault included."""
    said = answer(line)
    return said["kind"] != "none" or bool(said["sensors"])


def calls_unknown(line: Line) -> bool:
    """Return whether the verdict is that something outside the library is missing."""
    return bool(answer(line)["kind"] == "unknown")


def coordinate_right(line: Line) -> bool:
    """Outside effect: the coordinate along which it is organised is named."""
    one = line["truth"]["effects"][0]
    true = FORMS[one["effect"]][one["form"]].outside
    return calls_unknown(line) and answer(line)["coordinate"] in COORDINATES.get(true, (true,))


def separated(line: Line) -> bool:
    """Class: after the proposed experiment the verdict is the hidden effect."""
    after = answer(line).get("separated") or {}
    return after.get("kind") == "effect" and _family(after["effects"]) == _family(hidden(line))


def reports_fault(line: Line) -> bool:
    """Sensor fault: channel and kind are reported, and no effect is named.

    Of displacement and velocity a wrong factor or sign shows in their ratio alone, so either
    channel is right there.
    """
    said, fault = answer(line), line["truth"]["fault"]
    kind = fault["kind"].removeprefix("sensor_")
    channels = {fault["channel"]}
    if kind in ("gain", "sign"):
        channels.add(SWAPPED.get(fault["channel"], fault["channel"]))
    told = any(s["channel"] in channels and s["fault"] == kind for s in said["sensors"])
    return told and not (said["kind"] in ("effect", "ambiguous") and said["effects"])


def names_both(line: Line) -> bool:
    """Pair: both are named and nothing else."""
    said = answer(line)
    return said["kind"] == "effect" and set(said["effects"]) == set(hidden(line))


def names_one_at_least(line: Line) -> bool:
    """Pair: one of them at least, and nothing that is not there.

    A class says that one of its members is missing: true if one of them is hidden.
    """
    said, pair = answer(line), set(hidden(line))
    if said["kind"] == "effect":
        return bool(said["effects"]) and set(said["effects"]) <= pair
    return (
        said["kind"] == "ambiguous"
        and len(said["effects"]) <= LARGEST_CLASS
        and bool(set(said["effects"]) & pair)
    )


# --- parameters ---------------------------------------------------------------------------------


def truths(line: Line) -> dict[str, float] | None:
    """Return the true values of all parameters in bristle's names; None for other forms."""
    values = dict(line["truth"]["base"])
    for one in line["truth"]["effects"]:
        own = true_values(one, line["truth"]["scales"]["force"])
        if own is None:
            return None
        values |= own
    return values


def intervals(line: Line) -> list[tuple[str, bool, float]]:
    """Return name, whether the 95 % interval covers the truth, its width over the true value.

    For cases whose model is right in kind and form; parameters at a limit are left out.
    """
    true = truths(line)
    said = answer(line)
    if true is None or sorted(said["effects"]) != sorted(hidden(line)):
        return []
    rows = []
    for name, (value, std) in said.get("best", {}).items():
        if name in LIMITS or name not in true or true[name] == 0.0:
            continue
        covers = abs(value - true[name]) <= AT_95 * std
        rows.append((name, bool(covers), 2.0 * AT_95 * std / abs(true[name])))
    return rows


def quantile(values: Iterable[float], q: float) -> float:
    """Return a quantile, nan without values."""
    given = [v for v in values if v is not None and np.isfinite(v)]
    return float(np.quantile(given, q)) if given else float("nan")
