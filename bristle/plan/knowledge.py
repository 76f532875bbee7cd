"""What runs say of a model: normal equations of its parameters and of what might be beside them.

Those of several runs add up, measured ones and planned ones alike; so a plan is judged without a
fit. What a refit of the model's parameters would take up of a change is left out by them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..data.command_limits import jumps
from ..identify.model import Model, Problem, Run
from ..identify.residuals import residuals
from ..identify.search_context import Expected, Search
from .basis import Basis

Array = NDArray[np.float64]

SPREAD = 0.3
"""Standard deviation at most, over its size, of a parameter that is drawn."""

DRAWS = 4
"""Draws of the motion's error from which the noise on a planned run is taken."""


@dataclass(frozen=True)
class Rival:
    """Another model that the same runs may come from, as something beside a first one.

    `name` what is told of it; `model` with its values; `without` the first model as it stands
    beside it, the same but for what is asked.
    """

    name: str
    model: Model
    without: Model


@dataclass(frozen=True)
class Question:
    """A model, and what might be beside it.

    `rivals` each change the prediction by one column; each `Basis` by several, of a part that has
    no form yet.
    """

    model: Model
    rivals: tuple[Rival, ...] = ()
    bases: tuple[Basis, ...] = ()

    @property
    def width(self) -> int:
        """The number of columns."""
        return len(self.model.free()) + len(self.rivals) + sum(one.size for one in self.bases)


class Asked:
    """A question on a rig: makes the normal equations of runs, with one scale for all of them.

    Parameters
    ----------
    question : the model, and what might be beside it
    problem : the runs at hand, or runs that stand for the rig's sizes
    z : error over noise of the model: where it is above 1, noise counts that many times
    """

    def __init__(self, question: Question, problem: Problem, z: float = 1.0) -> None:
        self.question, self.problem, self._z = question, problem, max(z, 1.0)
        model = question.model
        self.names = model.free()
        self._scaled = Search(problem, model, problem.expectation(model, 0), self.names)

    def of(self, runs: Sequence[Run], draws: int = DRAWS) -> Array:
        """Return the normal equations (w, w) of runs, in standard deviations of their noise."""
        total = np.zeros((self.question.width, self.question.width))
        for run in runs:
            columns = self.columns(run, draws)
            total += columns.T @ columns
        return total

    def columns(self, run: Run, draws: int = DRAWS) -> Array:
        """Return what each parameter, rival and part of a basis changes on a run (n, w)."""
        model = self.question.model
        one = self.problem.planned([run])
        expected = one.expectation(model, draws)
        search = Search(one, model, expected, self.names)
        search.log, search.scale = self._scaled.log, self._scaled.scale
        search.low, search.high = self._scaled.low, self._scaled.high
        search.start = self._scaled.start
        parts = [search.sensitivities()] if self.names else []
        parts += [self._change(rival, one, expected)[:, None] for rival in self.question.rivals]
        sigma = expected[0][1][run.skip :, None]
        parts += [basis.columns(run)[run.skip :] / sigma for basis in self.question.bases]
        counts = ~jumps(run.V)[run.skip :]
        return np.asarray(counts[:, None] * np.nan_to_num(np.hstack(parts)) / self._z)

    def spread(self, name: str) -> tuple[float, bool]:
        """Return what a standard deviation of 1 of a parameter is [SI], and whether as a share."""
        k = self.names.index(name)
        if self._scaled.log[k]:
            return abs(self.question.model.value(name)), True
        return float(self._scaled.scale[k]), False

    def drawn(self, known: Known, generator: np.random.Generator) -> Asked:
        """Return the question with other values of the parameters, drawn from what is known.

        Parameters
        ----------
        known : what runs say of the question
        generator : draws
        """
        p = len(self.names)
        covariance = np.linalg.inv(known.normal[:p, :p] + np.eye(p) / SPREAD**2)
        step = generator.multivariate_normal(np.zeros(p), covariance, method="eigh")
        theta = np.clip(self._scaled.start + step, self._scaled.low, self._scaled.high)
        moved = {n: v for n, v in self._scaled.at(theta).values.items() if n in self.names}
        question = replace(
            self.question, model=_with(self.question.model, moved),
            rivals=tuple(
                replace(one, model=_with(one.model, moved), without=_with(one.without, moved))
                for one in self.question.rivals
            ),
        )  # fmt: skip
        return Asked(question, self.problem, self._z)

    def _change(self, rival: Rival, problem: Problem, expected: Expected) -> Array:
        return residuals(problem, rival.model, expected) - residuals(
            problem, rival.without, expected
        )


def _with(model: Model, values: Mapping[str, float]) -> Model:
    return replace(model, values={**model.values, **values})


@dataclass(frozen=True)
class Known:
    """What runs say of a question: normal equations (w, w), and how many samples they have.

    `held_out` of the `samples` decide a verdict.
    """

    question: Question
    normal: Array
    samples: int = 0
    held_out: int = 0

    def with_runs(self, normal: Array, samples: int, held_out: int) -> Known:
        """Return what these runs and further ones say."""
        return Known(
            self.question, self.normal + normal, self.samples + samples, self.held_out + held_out
        )

    @property
    def _own(self) -> int:
        return len(self.question.model.free())

    def left(self) -> Array:
        """Return the normal equations (w - p, w - p) of what is beside the model, refitted.

        Every parameter is known to about its own size beforehand.
        """
        p = self._own
        own = self.normal[:p, :p] + np.eye(p)
        across = self.normal[:p, p:]
        return np.asarray(self.normal[p:, p:] - across.T @ np.linalg.solve(own, across))

    def distances(self) -> dict[str, float]:
        """Return how far each rival is from the model, refitted, in standard deviations."""
        left = self.left()
        return {
            rival.name: float(np.sqrt(max(left[i, i], 0.0)))
            for i, rival in enumerate(self.question.rivals)
        }

    def raw(self) -> dict[str, float]:
        """Return how far each rival is from the model as it is, in standard deviations."""
        p = self._own
        return {
            rival.name: float(np.sqrt(max(self.normal[p + i, p + i], 0.0)))
            for i, rival in enumerate(self.question.rivals)
        }

    def deviations(self) -> dict[str, float]:
        """Return the standard deviation of each parameter of the model, over its size."""
        p = self._own
        covariance = np.linalg.inv(self.normal[:p, :p] + np.eye(p))
        return dict(
            zip(self.question.model.free(), np.sqrt(np.diag(covariance)).tolist(), strict=True)
        )

    def of_bases(self) -> Mapping[str, Array]:
        """Return the standard deviations (m,) of a free part along each basis, law refitted.

        Over the noise of a sample: 1 is a part that is known no better than one sample shows.
        """
        left, first, out = self.left(), len(self.question.rivals), {}
        for basis in self.question.bases:
            block = left[first : first + basis.size, first : first + basis.size]
            block = block + np.eye(basis.size) * basis.size**-2.0
            out[basis.name] = np.sqrt(np.diag(np.linalg.inv(block)))
            first += basis.size
        return out
