"""A plan: the next tests of a rig, what they will show, and the files for its controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..comparison.names import effect_name, site_name
from ..core.files import json_text
from ..core.text import plain, quantity
from ..diagnosis.effect_size import ONE_SIDED, TWO_SIDED
from ..diagnosis.rule import BENCH
from ..errors import StudyError
from ..model.model import parameter
from ..physics.drive import DRIVES, VOLTAGE, drive_named, unit_for
from ..physics.effect import EFFECTS, plain_name
from ..view import Viewable
from .folder import PlanFolder, PlannedRun, write_plan
from .information import Information, JudgedTest, PreparedQuestion
from .limits import PrescribedSignals, RigLimits, Test
from .questions import Purposes, SizedRival, Stated, cost_of, seen, separated
from .search import Planner

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..view.style import Page

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

    @property
    def named(self) -> str:
        """The question as people write it: of an effect its name in words."""
        site, colon, name = self.name.rpartition(": ")
        own = effect_name(name).removesuffix(f" of {site_name(site)}")
        return f"{site.replace('storey', 'storey ')}{colon}{own}"

    def cells(self) -> list[str]:
        """Return the row of a table."""
        return [self.named, self.what, self.needs, self.shown(self.now), self.shown(self.then)]

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


def searched(
    stand: Mapping[str, Stated],
    planner: Planner,
    told: Callable[[Mapping[str, Sequence[Information]]], list[Outcome]],
) -> tuple[list[JudgedTest], list[Outcome], float]:
    """Return tests that serve the goals of sites, what they will show, and by what factor.

    What they leave open is told with whether a test of its own would settle it. The factor is that
    by which the figures become smaller on average.

    Parameters
    ----------
    stand : by site what is asked, and what the runs at hand say of it
    planner : finds the tests for all sites together
    told : returns the outcomes of what runs would say, by site
    """
    tests = planner.plan()

    def shown(known: Sequence[Information]) -> dict[str, Sequence[Information]]:
        out, first = {}, 0
        for site, one in stand.items():
            out[site] = known[first : first + one.goal.count]  # with the fitted parameters
            first += len(one.goal.asked)
        return out

    then = shown(planner.goal.with_tests(tests))
    costs = [
        cost_of(one.purposes.figures(one.known)) - cost_of(one.purposes.figures(then[site]))
        for site, one in stand.items()
    ]
    rows = told(then)
    if not all(one.settled for one in rows):
        alone = (told(shown(planner.goal.with_pair(one))) for one in planner.looked_at())
        able = {one.name for found in alone for one in found if one.settled}
        rows = [one if one.settled else replace(one, beyond=one.name not in able) for one in rows]
    return tests, rows, float(np.exp(np.mean(costs)))


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


MANY = 10
"""How many times as many tests as are planned are still told of."""

NAMED = "plan_"
"""How the names of tests begin; a number follows."""

GAINED = 0.1
"""Share by which a plan must lower its figures on average; below that nothing is left to gain."""


@dataclass(frozen=True, repr=False)
class Plan(Viewable):
    """The next tests of a rig.

    Attributes
    ----------
    study : str
        The study's name, "" before the first measurement.
    tests : tuple of Test
        The tests, in order.
    signals : tuple of PrescribedSignals
        What each prescribes, at the controller's rate.
    outcomes : tuple of Outcome
        What they will show, beside what the runs at hand show.
    limits : RigLimits
        Within which they are.
    drive : str
        The channel of the command, "" where there is none.
    gain : float
        By what factor the figures become smaller on average.
    roles : tuple of str
        What each test is for: "train" or "holdout".
    notes : tuple of str
        What weakens the plan, in sentences.
    first : int
        The number in the name of the first test; the others count on.

    Examples
    --------
    >>> import bristle, pathlib, tempfile
    >>> sheet = pathlib.Path(tempfile.mkdtemp()) / "rig.toml"
    >>> _ = sheet.write_text('''schema = 1
    ... [damper]
    ... law = "bingham"
    ... max_force = "2 kN"
    ... [limits]
    ... stroke = "20 mm"
    ... speed = "250 mm/s"
    ... command = ["0 V", "5 V"]
    ... rate = "100 Hz"
    ... duration = "5 s"
    ... ''')
    >>> tests = bristle.plan(sheet, sharpen="f_v", runs=2)
    >>> tests.worth, [one.name for one in tests.outcomes]
    (True, ['f_v'])
    >>> figure = tests.plot(2)  # the second test; tests.write("plan") writes all as files
    """

    study: str
    tests: tuple[Test, ...]
    signals: tuple[PrescribedSignals, ...] = field(repr=False)
    outcomes: tuple[Outcome, ...]
    limits: RigLimits
    drive: str
    gain: float
    roles: tuple[str, ...]
    notes: tuple[str, ...] = ()
    first: int = 1
    rig: ClassVar[str] = "bench"

    @property
    def worth(self) -> bool:
        """Whether the tests would show what the runs at hand do not."""
        return self.gain > 1.0 + GAINED

    def runs(self) -> list[PlannedRun]:
        """Return the runs as a plan's folder holds them."""
        drive = DRIVES.get(self.drive)
        out = []
        for k, (test, signals) in enumerate(zip(self.tests, self.signals, strict=True)):
            channels = {"displacement": signals.x}
            if drive is not None:
                channels[drive.name] = signals.V
            about = test.words(signals, drive)
            out.append(PlannedRun(self.name(k), self.roles[k], about, signals.time, channels))
        return out

    def name(self, k: int) -> str:
        """Return the name of test k, counted from 0: of its run, of its file, and measured too."""
        return f"{NAMED}{self.first + k}"

    def sentences(self) -> list[str]:
        """Return the plan as an engineer would say it."""
        if not self.worth:
            return [
                *self.notes,
                *self._left_open(),
                "Nothing is left to gain: no test within these limits would show more.",
            ]
        return [
            *self.notes,
            *(f"{run.name} ({run.role}): {run.about}." for run in self.runs()),
            *self._left_open(),
        ]

    def _left_open(self) -> list[str]:
        """Return what the tests do not settle, and whether another one would."""
        return [f"{one.named}: {self._why(one)}" for one in self.outcomes if not one.settled]

    def _why(self, one: Outcome) -> str:
        """Return why the tests do not settle something."""
        if not one.beyond:
            return f"not settled by these tests; --{one.purpose} it alone."
        if one.purpose != "separate":
            return self._why_hidden(one)
        differ = plain(one.then, 2) if one.then >= NEAR else "0"
        return (
            "no test within these limits tells them apart; at best they differ by "
            f"{differ} standard deviations{self._more(one)}."
        )

    def _why_hidden(self, one: Outcome) -> str:
        """Return why no test shows an effect: the model absorbs it, or nothing moves it."""
        none = "no test within these limits shows it"
        if one.excited:
            return f"{none}; the model absorbs it."
        held = self.limits.command[0] == self.limits.command[1] or {*self.limits.commands} == {
            "held"
        }
        effect = EFFECTS[plain_name(one.name.rpartition(": ")[2])]
        if held and "V" in effect.needs:
            return f"{none}: the command does not move."
        return f"{none}: none excites it."

    def _more(self, one: Outcome) -> str:
        """Return how many tests of this kind would tell rivals apart, "" where far too many."""
        gained = one.then**2 - one.now**2
        if one.purpose != "separate" or gained <= 0.0:
            return ""
        count = len(self.tests) * (BENCH.separating_sigma**2 - one.now**2) / gained
        return f"; about {ceil(count)} such tests would" if count <= MANY * len(self.tests) else ""

    def write(self, folder: Path | str) -> Path:
        """Write the tests as files for a controller, a picture each; return the folder.

        Raises
        ------
        StudyError
            If the folder is there already or cannot be written.
        """
        path = Path(folder)
        write_plan(
            PlanFolder(self.rig, self.study, self.limits.rate, tuple(self.runs())), path,
            self.files(),
        )  # fmt: skip
        return path

    def files(self) -> dict[str, str | bytes]:
        """Return the further files of the plan's folder by name: pictures, plan.md, the table."""
        from ..view.style import png

        runs = enumerate(self.runs())
        pictures = {f"{run.name}.png": png(self._page(k), 110) for k, run in runs}
        told = {"header": HEADER, "rows": [one.cells() for one in self.outcomes]}
        table = json_text(told) + "\n"
        return {**pictures, "plan.md": "\n".join([*self._text(), ""]), OUTCOMES: table}

    def _text(self) -> list[str]:
        """Return the lines of the plan as a page of text."""
        lines = [f"# Tests for {self.study or 'a new rig'}", "", self._demand()]
        if self.limits.pause:
            rest = quantity(self.limits.pause, "s")
            lines.append(f"The rig rests for {rest} between two of them.")
        lines += ["", "## Runs", "", "| run | for | what |", "|---|---|---|"]
        lines += [
            f"| [{run.name}]({run.name}.csv) | {run.purpose} | {run.about} |" for run in self.runs()
        ]
        lines += [
            "",
            "## What they will show",
            "",
            f"| {' | '.join(HEADER)} |",
            f"|{'---|' * len(HEADER)}",
        ]
        return lines + [f"| {' | '.join(one.cells())} |" for one in self.outcomes]

    def _peaks(self) -> list[float]:
        """Return the largest displacement, velocity and acceleration of all tests, in SI."""
        motions = ((one.x, one.v, one.a) for one in self.signals)
        return [
            max(float(np.max(np.abs(values))) for values in column)
            for column in zip(*motions, strict=True)
        ]

    def _demand(self) -> str:
        """Return what the largest motion asks of the rig."""
        stroke, speed, acceleration = self._peaks()
        return (
            f"The tests ask for {1e3 * stroke:.3g} mm to either side, {1e3 * speed:.3g} mm/s and "
            f"{acceleration:.3g} m/s2 at the most: nine tenths of what the rig can do, or less. "
            "Each begins and ends at rest."
        )

    def plot(self, number: int = 1) -> Figure:
        """Return the figure of a test, the first one being number 1: motion and command.

        Raises
        ------
        StudyError
            If there is no such test.
        """
        if not 1 <= number <= len(self.tests):
            raise StudyError(f"test {number}: there are 1 to {len(self.tests)}.")
        return self._page(number - 1).figure

    def _page(self, k: int) -> Page:
        from .pictures import draw_test

        return draw_test(self.runs()[k], self.signals[k], self.drive)

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        return {
            "study": self.study, "gain": round(self.gain, 4), "worth": self.worth,
            "notes": list(self.notes),
            "runs": [
                {"name": run.name, "role": run.role, "about": run.about} for run in self.runs()
            ],
            "outcomes": [one.as_dict() for one in self.outcomes],
        }  # fmt: skip
