"""A study's building on its shaking table, simulated, and the search for its tests.

Each candidate is simulated, then judged at every site.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import ClassVar

import numpy as np

from ..core.arrays import Array
from ..data.channels import channel_unit
from ..data.measurement import Measurement
from ..data.sampling import Sampling
from ..errors import RecordError, RunError
from ..identification.building_sites import StructureProblem
from ..model.model import Model
from ..physics.drive import VOLTAGE
from ..prediction.model_system import BuildingWithFile, Excitation, signals_of
from ..prediction.monte_carlo import Simulator
from .information import JudgedTest
from .limits import RESERVE, PrescribedSignals, RigLimits, Test
from .search import LEAST, Planner
from .waveforms import Waveform

Columns = Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class SimulatedTest:
    """A test, simulated.

    `signals` what it prescribes; `columns` every output; `held_out` whether it is to judge by.
    """

    signals: PrescribedSignals
    columns: Columns
    held_out: bool


FORCE = "force"
KINDS = ("displacement", "velocity", "acceleration_absolute")
"""What can be measured of a level."""


@dataclass(frozen=True, eq=False)
class ShakingTable:
    """Runs planned tests of a study's building.

    Parameters
    ----------
    model : Model
        The damper's law with the effects of all sites.
    house : BuildingWithFile
    like : Measurement
        A run of the study: planned ones have its channels, and its labels.
    noise : mapping
        Standard deviation of each channel in SI.
    most : float
        The largest command.
    """

    model: Model
    house: BuildingWithFile
    like: Measurement
    noise: Mapping[str, float]
    most: float
    _made: dict[int, Simulator] = field(default_factory=dict, repr=False)
    _one_at_a_time: Lock = field(default_factory=Lock, repr=False)

    @property
    def levels(self) -> list[str]:
        """The building's levels, the first one above the ground first."""
        return list(self.house.building.levels())

    @property
    def drive(self) -> str:
        """The channel of the command, "" where none was measured."""
        return self.like.drive

    def response(self, signals: PrescribedSignals) -> Columns | None:
        """Return every output (n,) of the simulation in SI; None where it has no solution."""
        with self._one_at_a_time:
            found = self._ready(signals).tried(signals_of(self._shaking(signals)))
            return None if isinstance(found, RunError) else found

    def _shaking(self, signals: PrescribedSignals) -> Excitation:
        command = signals.V if self.drive else None
        return Excitation("plan", signals.time, signals.a, command, drive=VOLTAGE)

    def _ready(self, signals: PrescribedSignals) -> Simulator:
        """Return what simulates a test of that length, made once."""
        count = len(signals.time)
        if count not in self._made:
            largest = replace(signals, V=np.full(count, self.most))
            shaking = self._shaking(largest)
            self._made[count] = Simulator(self.model, self.house, False, shaking)
        return self._made[count]

    def demands(self, columns: Columns) -> dict[str, float]:
        """Return the largest values that a test asks for, by the names of `RigLimits`, in SI."""
        first, *above = self.levels
        drifts = {
            one: float(np.max(np.abs(self._drift(columns, one, below))))
            for one, below in zip(above, [first, *above], strict=False)
        }
        if not self.house.building.isolated:
            drifts[first] = float(np.max(np.abs(columns[_port(f"{first}_displacement")])))
        energy = columns.get("damper.dissipated_energy", np.zeros(1))
        return {
            "damper_stroke": float(np.max(np.abs(columns[_port(f"{first}_displacement")]))),
            "drift": max(drifts.values(), default=0.0),
            "force": float(np.max(np.abs(columns["damper.force"]))),
            "heat": float(energy[-1]),
        }

    @staticmethod
    def _drift(columns: Columns, level: str, below: str) -> Array:
        return columns[_port(f"{level}_displacement")] - columns[_port(f"{below}_displacement")]

    def excess(self, columns: Columns, limits: RigLimits) -> float:
        """Return the largest value that a test asks for, over nine tenths of its limit."""
        asked = self.demands(columns)
        return max(
            value / (RESERVE * float(getattr(limits, name))) for name, value in asked.items()
        )

    def measured(self, signals: PrescribedSignals, columns: Columns) -> Measurement:
        """Return a test as it would be measured: the study's channels, with noise."""
        generator = np.random.default_rng(0)
        clean = {name: columns[_port(name)] for name in self._shown() if _port(name) in columns}
        clean["ground_acceleration"] = signals.a
        if self.drive:
            clean[self.drive] = signals.V
        std = {name: self.noise[name] for name in clean}
        channels = {
            name: values + std[name] * generator.standard_normal(len(values))
            for name, values in clean.items()
        }
        count = len(signals.time)
        return replace(
            self.like, name="plan", time=signals.time, channels=channels,
            units={name: channel_unit(name) for name in channels},
            measured=np.ones(count, dtype=np.bool_), noise=std,
            noise_facts=dict.fromkeys(std), sampling=Sampling(signals.dt, count), source="plan",
            notes=(), lost={}, saturated={}, masked=None, parts=1, since={}, spikes=(),
        )  # fmt: skip

    def _shown(self) -> list[str]:
        """Return the channels of the building and its damper that the study has."""
        of_levels = [f"{level}_{kind}" for level in self.levels for kind in KINDS]
        return [name for name in (*of_levels, FORCE) if self.like.has(name)]


def _port(channel: str) -> str:
    """Return the output of the simulation that a channel shows."""
    return f"damper.{channel}" if channel == FORCE else f"structure.{channel}"


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

    table: ShakingTable = field(kw_only=True)
    show: Callable[[list[Measurement]], dict[str, StructureProblem]] = field(kw_only=True)
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
        signals = one.test.signals(self.limits, self.rate)
        columns = self.table.response(signals)
        assert columns is not None
        return SimulatedTest(signals, columns, one.held_out)

    def _look(self, test: Test) -> JudgedTest | None:
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

    def _judged(
        self, test: Test, signals: PrescribedSignals, columns: Columns
    ) -> JudgedTest | None:
        """Return a test that keeps the limits as it would be seen, None where nothing moves."""
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
