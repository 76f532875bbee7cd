"""The search for tests: many candidates, the best ones picked one by one, each then improved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from ..core.arrays import Array
from ..core.progress import Count, tell
from ..core.text import percent, quantity
from ..data.noise import white_noise
from ..errors import StudyError
from ..identification.problem import Run
from ..identification.search import in_threads
from .information import Goal, JudgedTest, PreparedQuestion, roles_of
from .limits import RESERVE, PrescribedSignals, RigLimits, Test
from .waveforms import Command, Waveform

CANDIDATES = 256
"""Tests that are looked at before the best ones are picked."""

IMPROVED = 40
"""Evaluations in which a picked test is improved."""

LEAST = 0.04
"""Smallest motion that is planned, over the stroke."""

SMALLER = 0.8
"""Factor on a motion that asks too much of force or heat."""

TRIES = 6
"""How often a motion is made smaller until it is given up."""

DWELLS = (0.25, 3.0)
"""Shortest and longest time [s] of a level of the command."""

TWIN_SIZE, TWIN_PITCH = 0.93, 1.07
"""Size and frequencies of the second run of a test, over those of the first: no mere repeat."""

SECOND = 1000
"""Distance between the seeds of the two."""


@dataclass(frozen=True)
class Planner:
    """Finds the tests of a rig that serve a goal best.

    Parameters
    ----------
    goal : Goal
    limits : RigLimits
    noise : float
        Standard deviation of the measured force [N].
    errors : Array
        (d, n, 4) draws of the error of x, v, a and the command, as the rig's instruments leave it.
    rate : float
        Samples per second at which tests are judged.
    record : Waveform or None
        A motion that was recorded, offered along with the others.
    seed : int
    drive : str
        The channel of the command.
    candidates, improved : int
        Tests that are looked at before the best ones are picked, and evaluations in which a picked
        one is improved.
    """

    goal: Goal
    limits: RigLimits
    noise: float
    errors: Array
    rate: float
    record: Waveform | None = None
    seed: int = 1
    drive: str = "voltage"
    candidates: int = CANDIDATES
    improved: int = IMPROVED
    _seen: dict[Test, JudgedTest | None] = field(default_factory=dict, repr=False)
    nothing_kept: ClassVar[str] = (
        "no test stays within the limits: even small motions ask for more force or put more heat "
        "into the damper than the rig allows. More force, more heat or a smaller command is needed."
    )

    def plan(self) -> list[JudgedTest]:
        """Return the tests: those to fit to, and others of their kind to judge by.

        Raises
        ------
        StudyError
            If the limits allow none of them.
        """
        tests = self._candidates()
        count = Count("test", len(tests))

        def look(test: Test) -> JudgedTest | None:
            found = self.see(test)
            count.done(test.motion.kind)
            return found

        found = [one for one in in_threads(look, tests) if one is not None]
        if not found:
            raise StudyError(self._why_nothing(tests))
        roles = roles_of(self.limits.runs, self.goal.judged)
        goal, picked = self.goal.among(found), list[JudgedTest]()
        for own, following in pairwise([*roles, False]):
            if not own:
                tell(f"improving test {len(picked) + 1}")
                picked += self._next(goal, found, picked, following)
        return picked

    def _next(
        self, goal: Goal, found: list[JudgedTest], picked: Sequence[JudgedTest], judged: bool
    ) -> list[JudgedTest]:
        """Return the test that serves best beside others, and where it is judged one of its kind.

        Parameters
        ----------
        goal : what the tests shall serve
        found : tests that may be picked; the one that is picked leaves them
        picked : those that are picked already
        judged : whether a second one is held out
        """

        def cost(one: JudgedTest) -> float:
            second = [replace(one, held_out=True)] if judged else []  # until it matters alike
            return goal.value([*picked, one, *second])

        best = min(found, key=cost)
        if len(found) > 1:
            found.remove(best)  # the next test shall be another one
        best = self._improved(best, cost)
        if not judged:
            return [best]
        twin = self.see(self.twin(best.test)) or best
        return [best, replace(twin, held_out=True)]

    def _why_nothing(self, tests: Sequence[Test]) -> str:
        """Return why the limits allow none of the tests."""
        rig = self.limits
        most = max(float(np.max(np.abs(one.signals(rig, self.rate).x))) for one in tests)
        if most >= LEAST * rig.stroke:
            return self.nothing_kept
        kept = f"a speed of {quantity(rig.speed, 'm/s')}"
        if np.isfinite(rig.acceleration):
            kept += f" and an acceleration of {quantity(rig.acceleration, 'm/s2')}"
        return (
            f"no test stays within the limits: {kept} allow {quantity(most, 'm')} from "
            f"{rig.usable_band[0]:.3g} Hz on, less than {percent(LEAST, 0)} of the stroke of "
            f"{quantity(rig.stroke, 'm')}. More of these, a lower band or a smaller stroke is "
            "needed."
        )

    def looked_at(self) -> list[JudgedTest]:
        """Return the tests that were looked at and keep the limits."""
        return [one for one in self._seen.values() if one is not None]

    def see(self, test: Test) -> JudgedTest | None:
        """Return a test as it would be seen, with less motion where that keeps force and heat.

        None where no motion does.
        """
        if test not in self._seen:
            self._seen[test] = self._look(test)
        return self._seen[test]

    def _look(self, test: Test) -> JudgedTest | None:
        for _ in range(TRIES):
            signals = test.signals(self.limits, self.rate)
            if float(np.max(np.abs(signals.x))) < LEAST * self.limits.stroke:
                return None
            run = self._run(signals)
            if self._keeps(run):
                break
            test = test.smaller(SMALLER)
        else:
            return None
        shown = (asked.evidence([self._recorded(asked, run)]) for asked in self.goal.asked)
        return JudgedTest(test, signals, tuple(shown))

    def _run(self, signals: PrescribedSignals) -> Run:
        count = len(signals.x)
        turns = -(-count // self.errors.shape[1])
        draws = np.tile(self.errors, (1, turns, 1))[:, :count]
        nothing = np.zeros(count)
        return Run(
            "plan", signals.dt, signals.x, signals.v, signals.a, signals.V, nothing, self.noise,
            draws, drive=self.drive,
        )  # fmt: skip

    def _recorded(self, asked: PreparedQuestion, run: Run) -> Run:
        """Return a run with the noise that will be estimated of its force.

        A force that turns within a few samples is taken for noise in part, and weighs less.
        """
        force = asked.problem.planned([run]).predict(asked.question.model, run)
        white = np.random.default_rng(self.seed).normal(0.0, self.noise, len(force))
        return replace(run, noise=max(self.noise, white_noise(force + white)))

    def _keeps(self, run: Run) -> bool:
        """Return whether a run keeps the limits of force and heat, by every model in question."""
        if np.isinf(self.limits.force) and np.isinf(self.limits.heat):
            return True
        for asked in self.goal.asked[: self.goal.count]:
            force = asked.problem.planned([run]).predict(asked.question.model, run)
            if np.max(np.abs(force)) > RESERVE * self.limits.force:
                return False
            if float(np.sum(np.abs(force * run.v))) * run.dt > RESERVE * self.limits.heat:
                return False
        return True

    def twin(self, test: Test) -> Test:
        """Return the second test of a kind: other phases and levels, nearly the same motion."""
        motion, command = test.motion, test.command
        low, high = self.limits.usable_band
        moved = replace(
            motion, seed=motion.seed + SECOND, low=min(motion.low * TWIN_PITCH, high),
            high=max(low, min(motion.high / TWIN_PITCH, high)),
        )  # fmt: skip
        if moved.low > moved.high:
            moved = replace(moved, low=motion.low, high=motion.high)
        other = replace(command, seed=command.seed + SECOND, period=command.period * TWIN_PITCH)
        return replace(test, motion=moved, command=other, share=test.share * TWIN_SIZE)

    def _candidates(self) -> list[Test]:
        """Return tests spread evenly over all that the rig can do (scrambled Sobol points)."""
        points = qmc.Sobol(8, seed=self.seed).random(self.candidates)
        return [self._test(row) for row in points]

    def _test(self, row: Array) -> Test:
        """Return the test of a point (8,) between 0 and 1."""
        seed = self.seed + int(1e4 * row[1])
        share = LEAST ** ((1.0 - float(row[3])) ** 2)
        motion = self._motion(float(row[0]), float(row[2]), seed)
        return Test(motion, self._command(row[4:], seed), share, self.limits.duration)

    def _motion(self, which: float, at: float, seed: int) -> Waveform:
        """Return a motion by two numbers between 0 and 1: its kind, and its highest frequency."""
        kinds = [*self.limits.motions, *(["record"] if self.record else [])]
        kind = kinds[min(int(which * len(kinds)), len(kinds) - 1)]
        low, high = self.limits.usable_band
        if kind == "record" and self.record is not None:
            return self.record
        if kind in ("sine", "triangle"):
            return Waveform(kind, low, low * (high / low) ** at)
        return Waveform(kind, low, low * (high / low) ** (0.3 + 0.7 * at), seed)

    def _command(self, row: Array, seed: int) -> Command:
        low, high = self.limits.command
        if high <= low:
            return Command("held", low, high)
        kind = self.limits.commands[
            min(int(row[0] * len(self.limits.commands)), len(self.limits.commands) - 1)
        ]
        bottom = low + (high - low) * max(0.0, 0.8 * float(row[1]) - 0.4)
        top = bottom + (high - bottom) * (0.3 + 0.7 * float(row[2]))
        period = DWELLS[0] * (DWELLS[1] / DWELLS[0]) ** float(row[3])
        if kind == "held":
            top = low + (high - low) * float(row[2])
        bottom, top = self.limits.nearest(bottom), self.limits.nearest(top)
        return Command(kind, bottom, top, period, seed)

    def _improved(self, best: JudgedTest, cost: Callable[[JudgedTest], float]) -> JudgedTest:
        """Return a test after a search about it for size, frequencies, levels and dwell."""
        known = {best.test: best}

        def at(point: Array) -> float:
            one = self.see(self._moved(best.test, point))
            if one is None:
                return 1e3
            known[one.test] = one
            return cost(one)

        start = np.zeros(5)
        simplex = np.vstack([start, 0.4 * np.eye(5)])
        options = {"maxfev": self.improved, "initial_simplex": simplex}
        minimize(at, start, method="Nelder-Mead", options=options)
        return min(known.values(), key=cost)

    def _moved(self, test: Test, point: Array) -> Test:
        """Return a test with its numbers moved by a point (5,) of logarithms and shares."""
        low, high = self.limits.usable_band
        motion, command = test.motion, test.command
        if motion.kind != "record":
            bottom = float(np.clip(motion.low * np.exp(point[0]), low, high))
            top = float(np.clip(motion.high * np.exp(point[1]), bottom, high))
            motion = replace(motion, low=bottom, high=top)
        share = float(np.clip(test.share * np.exp(point[2]), LEAST, 1.0))
        period = float(np.clip(command.period * np.exp(point[3]), *DWELLS))
        least, most = self.limits.command
        level = command.high + 0.5 * float(point[4]) * (most - least)
        top_level = self.limits.nearest(float(np.clip(level, command.low, most)))
        changed = replace(command, period=period, high=top_level)
        return replace(test, motion=motion, command=changed, share=share)
