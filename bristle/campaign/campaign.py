"""One system, many variations of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite, nan
from typing import NamedTuple, Protocol

from ..engine import Engine
from ..engine.results import Array, RunTable, statistic_of
from ..errors import BristleError, ScenarioError
from ..fmu.description import Value
from ..model.draws import in_short
from ..system.model import Signal, System
from ..system.overrides import FILES
from ..system.scenario import load_scenario

STATISTICS = ("peak", "rms", "max", "min", "mean", "last")
"""What `statistic_of` knows."""


@dataclass(frozen=True)
class Statistic:
    """One number that is kept of each run: a statistic of a column; "peak" is of its size."""

    column: str
    statistic: str
    unit: str = ""

    @property
    def name(self) -> str:
        """The output's name in tables: "peak damper.force"."""
        return f"{self.statistic} {self.column}"

    def of(self, values: Array) -> float:
        """Return the statistic of a column (n,)."""
        return statistic_of(values, self.statistic)


class Variation(NamedTuple):
    """What takes the place of a system's values, by "component.name" as in `System.with_values`.

    Names that a scenario must be read anew for (records, FMUs, steps) are those of overrides.
    """

    values: Mapping[str, Value | Signal]


class Draws(Protocol):
    """Gives each run its values, from its number alone."""

    def values(self, run: int) -> Mapping[str, Value]:
        """Return the values of a run."""

    def with_effect(self, run: int, values: Mapping[str, Value]) -> Mapping[str, Value] | None:
        """Return those of its second time, with an effect that joins it; None: it is made once."""


@dataclass(frozen=True)
class RunOutcome:
    """What became of a run: the kept `numbers`, all rows in a `table`, or why there are none.

    `reason` is "" for a run that is done. `lost` says of such a run why it could not be simulated
    with the effect that joins it.
    """

    run: int = 0
    numbers: tuple[float, ...] = ()
    reason: str = ""
    lost: str = ""
    table: RunTable | None = None


SYSTEMS_KEPT = 64
"""Systems that a campaign keeps: one per combination of records, steps and the like."""


@dataclass(frozen=True)
class Campaign:
    """One system and the engine that runs its variations.

    `keep` is what is kept of each run; None keeps all rows. `draws` give runs of a number their
    values.
    """

    system: System
    engine: Engine
    keep: tuple[Statistic, ...] | None = None
    draws: Draws | None = None
    _read: dict[tuple[tuple[str, object], ...], System] = field(
        default_factory=dict, init=False, repr=False
    )
    _known: dict[tuple[tuple[str, object], ...], RunOutcome] = field(
        default_factory=dict, init=False, repr=False
    )

    @property
    def runs(self) -> int:
        """How many runs `run` has made whose numbers are kept."""
        return len(self._known)

    def run(self, one: Variation) -> RunOutcome:
        """Return what a variation gives, run once for the same values where numbers are kept.

        Raises
        ------
        ScenarioError, PhysicsError, RecordError
            If a value is out of bounds or does not fit.
        RunError
            If the run fails.
        """
        if self.keep is None:
            return RunOutcome(table=self.engine.run(self.varied(one.values)))
        key = tuple(one.values.items())
        if key not in self._known:
            self._known[key] = RunOutcome(numbers=self._numbers(one.values))
        return self._known[key]

    def prepare(self) -> None:
        """Do once what all runs share, compiling above all; best before processes are forked.

        Raises
        ------
        ScenarioError
            If the engine cannot run the system.
        """
        if why := self.engine.refuses(self.system):
            raise ScenarioError(why)
        if self.engine.name == "compiled":
            self.engine.run(replace(self.system, stop=self.system.step))

    def varied(self, values: Mapping[str, Value | Signal]) -> System:
        """Return the system with values in place of its own."""
        given = [(n, v) for n, v in values.items() if not isinstance(v, Signal)]
        anew = tuple((n, v) for n, v in given if is_read_anew(self.system, n))
        if anew and anew not in self._read:
            if len(self._read) >= SYSTEMS_KEPT:
                self._read.clear()
            self._read[anew] = load_scenario(self.system, dict(anew))
        base = self._read[anew] if anew else self.system
        names = dict(anew)
        return base.with_values({n: v for n, v in values.items() if n not in names})

    def outcome(self, run: int) -> RunOutcome:
        """Return what became of a run of the draws; a failure is an outcome as well."""
        assert self.draws is not None
        more, lost = tuple[float, ...](), ""
        try:
            values = self.draws.values(run)
            numbers = self._numbers(values)
            joined = self.draws.with_effect(run, values)
            if joined is not None:
                more, lost = self._with_effect(joined)
        except BristleError as error:
            return RunOutcome(run, reason=_one_line(error))
        except Exception as error:  # whatever a user's effect or a foreign FMU raises, runs go on
            return RunOutcome(run, reason=f"{type(error).__name__}: {_one_line(error)}")
        if wrong := self._not_finite(numbers):
            return RunOutcome(run, reason=f"RunError: {wrong}.")
        return RunOutcome(run, (*numbers, *more), lost=lost)

    def _with_effect(self, values: Mapping[str, Value]) -> tuple[tuple[float, ...], str]:
        """Return the numbers of a run with the effect that joins it, or NaN and why not."""
        try:
            found = self._numbers(values)
            lost = self._not_finite(found)
        except BristleError as error:
            lost = in_short(error)
        except Exception as error:  # what a user's effect raises costs the second run alone
            lost = f"{type(error).__name__}: {_one_line(error)}"
        return (found, "") if not lost else ((nan,) * len(self.keep or ()), lost)

    def _numbers(self, values: Mapping[str, Value | Signal]) -> tuple[float, ...]:
        table = self.engine.run(self.varied(values))
        return tuple(one.of(table[one.column]) for one in self.keep or ())

    def _not_finite(self, numbers: tuple[float, ...]) -> str:
        pairs = zip(self.keep or (), numbers, strict=True)
        return next((f"{one.name} is not finite" for one, x in pairs if not isfinite(x)), "")


def is_read_anew(system: System, name: str) -> bool:
    """Return whether a scenario must be read anew for a value: of a record, an FMU, a step."""
    component, own = system.part(name)
    if component is None or own in FILES:
        return True
    return own not in component.description.variables and not own.startswith("building.")


def _one_line(error: Exception) -> str:
    kind = f"{type(error).__name__}: " if isinstance(error, BristleError) else ""
    return kind + " ".join(str(error).split())
