"""What tests will show beside what the runs at hand show: a row for each thing in question."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

from ..comparison.names import effect_name
from ..core.text import plain, quantity
from ..diagnosis.effect_size import ONE_SIDED, TWO_SIDED
from ..diagnosis.rule import BENCH
from ..model.model import parameter
from ..physics.drive import VOLTAGE, drive_named, unit_for
from .information import Information, PreparedQuestion
from .questions import Purposes, SizedRival, seen, separated

OUTCOMES = "outcomes.json"
"""The file of a plan's folder with the table."""

NEAR = 0.01
"""Distance of rivals below which it is none."""

UNKNOWN = 10.0
"""Standard deviation, over a parameter's size, from which its number says nothing."""

EXCITED = 1e-3
"""Standard deviations that an effect of its asked size changes where anything of it moves."""

HEADER = ("question", "figure", "for a verdict", "now", "with these tests")


@dataclass(frozen=True)
class Outcome:
    """What tests will show of one thing.

    `purpose` "separate", "see", "sharpen" or "learn"; `name` of effect, rivals,
    parameter or coordinate; `what` the quantity is, in `unit`; `now` from the runs at hand, `then`
    with the tests too;
    infinite where no run shows it. `settled` whether a verdict will be able to tell; `beyond`
    whether no test that was looked at would; `excited` whether the tests change anything of it;
    `needs` what a verdict needs of the quantity, "" where none is on it.
    """

    purpose: str
    name: str
    what: str
    unit: str
    now: float
    then: float
    settled: bool = True
    beyond: bool = False
    excited: bool = True
    needs: str = ""

    def cells(self) -> list[str]:
        """Return the row of a table."""
        site, colon, name = self.name.rpartition(": ")
        named = effect_name(name).removesuffix(f" of the {site}")
        shown = self.shown(self.now), self.shown(self.then)
        return [f"{site}{colon}{named}", self.what, self.needs, *shown]

    def shown(self, value: float) -> str:
        """Return one of its numbers with the unit."""
        if not isfinite(value):
            return "not visible"
        if self.purpose == "separate":
            return f"{plain(value, 2) if value >= NEAR else 0} std"
        if self.purpose == "sharpen" and self.unit == "%":
            if value >= UNKNOWN:
                return "not identified"
            return f"{plain(100.0 * value, 2)} %"
        return quantity(value, self.unit, 2, fine=True)

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold: None where a number is not finite."""
        return {
            "purpose": self.purpose, "name": self.name, "what": self.what, "unit": self.unit,
            "needs": self.needs,
            "now": self.now if isfinite(self.now) else None,
            "then": self.then if isfinite(self.then) else None, "settled": self.settled,
            "beyond": self.beyond,
        }  # fmt: skip


def outcomes(
    purposes: Purposes,
    asked: Sequence[PreparedQuestion],
    now: Sequence[Information],
    then: Sequence[Information],
) -> list[Outcome]:  # fmt: skip
    """Return what tests will show.

    Parameters
    ----------
    purposes : of the plan
    asked : its questions
    now, then : what the runs at hand say of them, and what these and the tests would say
    """
    out = _separated(now[1:], then[1:]) if purposes.rivals else []
    out += _seen(purposes, now[0], then[0])
    out += _sharpened(purposes, asked[0], now[0], then[0])
    return out + _learned(purposes, now[0], then[0])


def _separated(now: Sequence[Information], then: Sequence[Information]) -> list[Outcome]:
    needed = BENCH.separating_sigma
    before = {one.name: needed / one.value if one.value else inf for one in separated(now)}
    after = {one.name: needed / one.value if one.value else inf for one in separated(then)}
    return [
        Outcome(
            "separate", name, "distance", "std", before[name], after[name],
            after[name] >= needed, needs=f"{needed:g} std",
        )
        for name in after
    ]  # fmt: skip


def _seen(purposes: Purposes, now: Information, then: Information) -> list[Outcome]:
    """Return from what size each effect is named, largest gain first, and how large it may be."""
    before = {one.name: one.value for one in seen(now, purposes.rule)}
    after = {one.name: one.value for one in seen(then, purposes.rule)}
    near = [known.distances() for known in (now, then)]
    raw = then.raw()
    out = []
    for one in purposes.effects:
        sized, name = one.sized, one.sized.name
        unit = sized.unit
        seen_now = one.limit is not None and not one.limit.why and isfinite(before[name])
        visible = (seen_now, isfinite(after[name]))
        sizes = _allowed(one, *(found[name] for found in near))
        limits = [
            sized.value(max(size, one.least)) if shown else inf
            for size, shown in zip(sizes, visible, strict=True)
        ]
        # Where the model misfits, the runs allow sizes that they would name beside a true one.
        found = max(_named(one, before[name], after[name]), one.least, sizes[1])
        needs = ""
        if visible[1] and not sized.ended(found):
            side = "above" if not sized.falls else "below"
            needs = f"{side} {quantity(sized.value(found), unit, 2, fine=True)}"
        out.append(
            Outcome(
                "see", name, f"{sized.parameter} at 95 %", unit, limits[0], limits[1], visible[1],
                excited=raw[name] > EXCITED, needs=needs,
            )
        )  # fmt: skip
    return out


def _named(one: SizedRival, now: float, then: float) -> float:
    """Return the size from which an effect is named with the tests too.

    From the runs at hand it is what a verdict on them says; tests make it smaller as they see more
    of the effect.

    Parameters
    ----------
    one : the effect at a size
    now, then : from what share of that it would be named if all runs showed it alike
    """
    told = one.limit is not None and one.limit.named is not None and isfinite(now)
    return one.size * (then / now if told else then)


def _allowed(one: SizedRival, now: float, then: float) -> tuple[float, float]:
    """Return the sizes of an effect that runs allow at 95 %: those at hand, and with tests too.

    What the runs at hand allow is what a verdict on them says; tests make it smaller as they see
    more of the effect. Without runs it is what noise alone would allow.

    Parameters
    ----------
    one : the effect at a size
    now, then : how far that is from the model [standard deviations], both above 0 where it is seen
    """
    largest = one.limit.largest if one.limit else None
    if largest is not None and now > 0.0:
        size = one.sized.size_of(largest)
        return size, size * now / then if then > 0.0 else inf
    apart = one.size * (TWO_SIDED if one.sized.signed else ONE_SIDED)
    return apart / now if now > 0.0 else inf, apart / then if then > 0.0 else inf


def _sharpened(
    purposes: Purposes, asked: PreparedQuestion, now: Information, then: Information
) -> list[Outcome]:
    before, after = now.deviations(), then.deviations()
    out = []
    for name in purposes.parameters:
        size, as_share = asked.spread(name)
        unit = unit_for(parameter(purposes.model.law, name).unit, drive_named(purposes.drive))
        value = abs(purposes.model.value(name))
        share = 1.0 if as_share else size / value if value else 0.0
        factor, unit = (share, "%") if share else (size, unit)
        out.append(
            Outcome(
                "sharpen", name, "standard deviation", unit, factor * before[name],
                factor * after[name],
            )
        )  # fmt: skip
    return out


def _learned(purposes: Purposes, now: Information, then: Information) -> list[Outcome]:
    if purposes.parts is None:
        return []
    before, after = now.of_bases(), then.of_bases()
    out = []
    for name in after:
        first, second = (float((one[name] ** 2).mean() ** 0.5) for one in (before, after))
        out.append(
            Outcome(
                "learn", along(name, purposes.drive), "uncertainty of a curve, over noise", "1",
                first, second,
            )
        )  # fmt: skip
    return out


def along(name: str, drive: str) -> str:
    """Return what is learned along a coordinate, the command by the name of its channel.

    Parameters
    ----------
    name : of the coordinate, as `ALONG` names it
    drive : the channel of the command, "" for none
    """
    return f"along {name.replace(VOLTAGE.name, drive) if drive else name}"
