"""The response as a function of the voltage's history, and its derivative."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..jit import compiled
from .case import Case, room
from .derivative import Gradient
from .horizon import PULL_BACK, RECEDE, RESPOND, SLOPES, START, Horizon, compute
from .response import STATES, TRIED, VOLTAGE_0, X_0, Course

Array = NDArray[np.float64]

ROUNDING = 1e-15
"""Least change by which a derivative is told, in the unit of what changes."""


class Problem:
    """The response of a case to a voltage history, within a window from its begin.

    Parameters
    ----------
    case : Case
    every : int
        Steps from one node of the voltage to the next; it is linear between.
    last : int or None
        Last instant of the window; None: that of the case.

    Attributes
    ----------
    course : Course
        The response that was computed last.
    nodes : (n,) array
        Instants of the nodes.
    """

    def __init__(self, case: Case, every: int = 1, last: int | None = None) -> None:
        self.case = case
        self._run = compiled(case.functions.link(compute))
        self.last = len(case.ground) - 1 if last is None else last
        self.nodes = np.unique(np.append(np.arange(0, self.last, every), self.last))
        self._instants = np.arange(self.last + 1)
        self.course = self.course_of(self.last)
        self._gradient = self.gradient_of(0)
        self._idle = Horizon(
            1, 1, 0, 0, 1.0, 2.0, case.v_max, np.zeros(1), np.zeros((5, 2)), np.zeros((4, 2)),
            self.course_of(1), self.gradient_of(0),
        )  # fmt: skip
        self._gradient = self.gradient_of(self.last)

    def respond(self, voltage: Array, last: int | None = None) -> Array:
        """Return the output (N + 1,) under the voltage (N + 1,) [V] at the instants, to `last`."""
        self._compute(START, voltage)
        self._compute(RESPOND, voltage, last)
        y: Array = self.course.y
        return y

    def slopes(self, voltage: Array) -> None:
        """Keep how the response that was computed last follows the voltage."""
        self._compute(SLOPES, voltage)

    def pull_back(self, weights: Array, last: int | None = None) -> Array:
        """Return what the voltages at the instants (N + 1,) do to the sum of weights and outputs.

        After `slopes`; `last` is the last instant with a weight.
        """
        self._compute(PULL_BACK, weights, last, weights)
        found: Array = self._gradient.by_voltage
        return found

    def recede(self, voltage: Array, horizon: Horizon) -> None:
        """Fill in the voltage (N + 1,) [V] of a receding horizon; its first value is given."""
        self._compute(START, voltage)
        self._compute(RECEDE, voltage, horizon=horizon)

    def level(self, voltage: float) -> Array:
        """Return a constant voltage [V] at the instants (N + 1,)."""
        return np.full(self.last + 1, float(voltage))

    def between(self, values: Array) -> Array:
        """Return a voltage at the instants (N + 1,), linear between its values at the nodes."""
        found: Array = np.interp(self._instants, self.nodes, values)
        return found

    def to_nodes(self, by_voltage: Array) -> Array:
        """Return a derivative by the voltages at the nodes (n,) from that at the instants."""
        right = np.searchsorted(self.nodes, self._instants, side="left").clip(1)
        low, high = self.nodes[right - 1], self.nodes[right]
        share = (self._instants - low) / (high - low)
        n = len(self.nodes)
        found: Array = np.zeros(n)
        found += np.bincount(right - 1, (1.0 - share) * by_voltage, n)
        found += np.bincount(right, share * by_voltage, n)
        return found

    def course_of(self, N: int) -> Course:
        """Return room for a response of N steps, the damper's states at its begin given."""
        m, k = len(self.case.plant.phi), len(self.case.states)
        course = Course(
            np.zeros((N + 1, m)), np.zeros((N + 1, k)), np.zeros(N + 1), np.zeros(N + 1),
            np.zeros(N + 1), np.zeros(room(self.case)),
        )  # fmt: skip
        course.z[0] = self.case.states
        return course

    def gradient_of(self, N: int) -> Gradient:
        """Return room for the derivative of a response of N steps; with 0 none can be told."""
        active = self._moving_states() if N else np.zeros(0, dtype=np.int64)
        q = len(active)
        return Gradient(
            active, self._changes(active), np.zeros((N, 1 + q, STATES + q)), np.zeros(N + 1),
            np.zeros((2, len(self.case.plant.phi) + q)),
        )  # fmt: skip

    def _compute(
        self, task: int, voltage: Array, last: int | None = None, weights: Array | None = None,
        horizon: Horizon | None = None,
    ) -> None:  # fmt: skip
        c = self.case
        self._run(
            task, c.plant, c.setup, c.ground, voltage, voltage if weights is None else weights, 0,
            self.last if last is None else last, self.course, self._gradient,
            horizon or self._idle, np.zeros(STATES),
        )  # fmt: skip

    def _moving_states(self) -> NDArray[np.int64]:
        """Return the damper's states that move in a response to a lively voltage."""
        self.respond(self.case.v_max * (0.5 - 0.5 * np.cos(0.3 * self._instants)))
        return np.flatnonzero(np.ptp(self.course.z, axis=0) > 0.0)

    def _changes(self, active: NDArray[np.int64]) -> Array:
        """Return small changes of what a step of the damper follows, by the last response."""
        plant = self.case.plant
        motion = self.course.x @ np.array([plant.displacement, plant.velocity]).T
        changes = np.zeros(STATES + len(active))
        changes[X_0:VOLTAGE_0] = np.tile(np.abs(motion).max(axis=0), 2)
        changes[VOLTAGE_0:TRIED] = self.case.v_max
        changes[TRIED] = np.abs(self.course.force).max()
        changes[STATES:] = np.abs(self.course.z[:, active]).max(axis=0)
        return 1e-6 * changes + ROUNDING
