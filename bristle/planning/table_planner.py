"""The search for tests of a building: each candidate is simulated, then judged at every site."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..data.measurement import Measurement
from ..errors import RecordError
from ..identification.building_sites import StructureProblem
from .information import JudgedTest
from .limits import Signals, Test
from .search import LEAST, Planner
from .shaking_table import Columns, ShakingTable, SimulatedTest
from .waveforms import Waveform

TRIES, GENTLE, STEEP = 6, 0.97, 0.3
"""How often a motion beyond a limit is made smaller, how far below that limit, at the most by."""

RECORDS = 0.5
"""Share of the tests that are looked at with a recorded ground motion."""


@dataclass(frozen=True)
class TablePlanner(Planner):
    """Finds the tests of a building on its table; `places` has the site of each question.

    `table` simulates them; `show` returns the sites of runs that were not measured yet; `records`
    are motions that may be scaled.
    """

    table: ShakingTable | None = None
    show: Callable[[list[Measurement]], dict[str, StructureProblem]] | None = None
    places: tuple[str, ...] = ()
    records: tuple[Waveform, ...] = ()
    nothing_kept: ClassVar[str] = (
        "no ground motion stays within the limits and moves the building: a larger stroke, speed "
        "or acceleration of the table, or a larger stroke of the damper or drift, is needed."
    )

    def _why_nothing(self, tests: Sequence[Test]) -> str:
        return self.nothing_kept

    def response(self, one: JudgedTest) -> SimulatedTest:
        """Return what a test prescribes, and every output of the simulation."""
        assert self.table is not None
        signals = one.test.signals(self.limits, self.rate)
        columns = self.table.response(signals)
        assert columns is not None
        return SimulatedTest(signals, columns, one.held_out)

    def _look(self, test: Test) -> JudgedTest | None:
        assert self.table is not None
        for _ in range(TRIES):
            signals = test.signals(self.limits, self.rate)
            columns = self.table.response(signals)
            if columns is None:
                return None
            most = self.table.excess(columns, self.limits)
            if most <= 1.0:
                return self._judged(test, signals, columns) if most >= LEAST else None
            test = test.smaller(max(STEEP, GENTLE / most))
        return None

    def _judged(self, test: Test, signals: Signals, columns: Columns) -> JudgedTest | None:
        """Return a test that keeps the limits as it would be seen, None where nothing moves."""
        assert self.table is not None
        assert self.show is not None
        try:
            found = self.show([self.table.measured(signals, columns)])
        except RecordError:  # the base does not move
            return None
        shown = (
            asked.evidence(found[site].runs if site in found else [])
            for site, asked in zip(self.places, self.goal.asked, strict=True)
        )
        return JudgedTest(test, signals, tuple(shown))

    def _motion(self, which: float, at: float, seed: int) -> Waveform:
        """Return a motion by two numbers between 0 and 1: a record, or its kind and frequency."""
        if not self.records or which >= RECORDS:
            low = RECORDS if self.records else 0.0
            return super()._motion((which - low) / (1.0 - low), at, seed)
        count = len(self.records)
        return self.records[min(int(which / RECORDS * count), count - 1)]
