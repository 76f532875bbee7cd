"""What runs say of a model: its parameters, and what might be beside them.

Those of several runs add up, measured ones and planned ones alike; so a plan is judged without a
fit. What a refit of the model's parameters would absorb of a change is left out by them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import Array
from ..data.corrections import jumps
from ..identification.fit import Search
from ..identification.problem import Expected, Problem, Run, residuals
from ..learning.signals import ALONG
from ..model.model import Model
from .limits import RESERVE, PrescribedSignals, RigLimits, Test

# Parts without a form, along a coordinate: what runs must cover for a curve to be learned.


KNOTS = 7
"""Knots of a curve along a coordinate."""

USUAL = ("displacement", "speed", "acceleration", "voltage", "recent_speed")
"""Coordinates that a plan covers where nobody names others."""

FADES = 0.5
"""Time [s] over which a memory of a coordinate fades."""

SHARE = 0.8
"""Largest mean of the speed of late, over the largest speed."""

SIGNED = ("velocity",)
"""Coordinates along which a force has its sign already; along others it may be friction."""


@dataclass(frozen=True)
class Basis:
    """Hat functions along a coordinate, as an added force and as friction.

    `name` of the coordinate, one of `ALONG`; `knots` (k,) of it, in SI; `memory` the parameters of
    its history.
    """

    name: str
    knots: tuple[float, ...]
    memory: tuple[tuple[str, float], ...] = ()

    @property
    def friction(self) -> bool:
        """Whether the part may turn with the velocity."""
        return self.name not in SIGNED

    @property
    def size(self) -> int:
        """The number of columns."""
        return len(self.knots) * (2 if self.friction else 1)

    def history(self, run: Run) -> Array:
        """Return the coordinate (n,) on a run, at the samples that count."""
        whole, keep = run.remembered
        return ALONG[self.name].history(whole, dict(self.memory))[keep]

    def columns(self, run: Run) -> Array:
        """Return the parts (n, size) on a run, 1 where they are whole."""
        at = self.history(run)
        hats = np.stack([np.interp(at, self.knots, row) for row in np.eye(len(self.knots))], axis=1)
        return np.hstack([hats, hats * np.sign(run.v)[:, None]]) if self.friction else hats


def ranges(limits: RigLimits) -> dict[str, tuple[float, float]]:
    """Return what each coordinate spans within a rig's limits, in SI."""
    stroke, speed = RESERVE * limits.stroke, RESERVE * limits.speed
    quick = 2.0 * np.pi * limits.usable_band[1] * speed
    acceleration = min(quick, RESERVE * limits.acceleration)
    found = {
        "displacement": (-stroke, stroke), "recent_displacement": (-stroke, stroke),
        "travel": (0.0, 2.0 * stroke), "speed": (0.0, speed), "velocity": (-speed, speed),
        "recent_speed": (0.0, SHARE * speed), "acceleration": (-acceleration, acceleration),
        "slowing": (-acceleration, acceleration), "rebuilding": (0.0, 1.0),
        "voltage": limits.command, "recent_voltage": limits.command,
    }  # fmt: skip
    return {name: one for name, one in found.items() if one[1] > one[0]}


def basis_along(name: str, limits: RigLimits) -> Basis:
    """Return the basis along a coordinate of `ranges` over what a rig's limits span."""
    low, high = ranges(limits)[name]
    known = {"tau": FADES, "way": limits.stroke}
    memory = tuple((one, known[one]) for one in ALONG[name].memory)
    return Basis(name, tuple(np.linspace(low, high, KNOTS).tolist()), memory)


SPREAD = 0.3
"""Standard deviation at most, over its size, of a parameter that is drawn."""

ROUNDING = 1e-10
"""Of normal equations of columns of length one: directions that weigh less tell nothing."""

DRAWS = 12
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


class PreparedQuestion:
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

    def evidence(self, runs: Sequence[Run], draws: int = DRAWS) -> Evidence:
        """Return what runs say that a model is fitted to."""
        width = self.question.width
        normal, scatter = np.zeros((2, width, width))
        for run in runs:
            expected = self.problem.planned([run]).expectation(self.question.model, draws)
            columns = self.columns(run, expected)
            normal += columns.T @ columns
            scatter += _scatter(columns, run, expected)
        return Evidence(normal, normal, scatter, samples_of(runs))

    def columns(self, run: Run, expected: Expected) -> Array:
        """Return what each parameter, rival and part of a basis changes on a run (n, w).

        In standard deviations of the noise; `expected` is what a true model would show there.
        """
        model = self.question.model
        one = self.problem.planned([run])
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

    def drawn(self, known: Information, generator: np.random.Generator) -> PreparedQuestion:
        """Return the question with other values of the parameters, drawn from what is known.

        Parameters
        ----------
        known : what runs say of the question
        generator : draws
        """
        p = len(self.names)
        covariance = np.linalg.inv(known.told.fitted[:p, :p] + np.eye(p) / SPREAD**2)
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
        return PreparedQuestion(question, self.problem, self._z)

    def _change(self, rival: Rival, problem: Problem, expected: Expected) -> Array:
        return residuals(problem, rival.model, expected) - residuals(
            problem, rival.without, expected
        )


def _with(model: Model, values: Mapping[str, float]) -> Model:
    return replace(model, values={**model.values, **values})


@dataclass(frozen=True, eq=False)
class Evidence:
    """What runs say: normal equations (w, w), and how many samples they have.

    `normal` of all runs; `fitted` of those that a model is fitted to, `scatter` (w, w) how their
    noise scatters its products with the columns, more than `fitted` where it lasts over samples;
    `held_out` of the `samples` decide a verdict.
    """

    normal: Array
    fitted: Array
    scatter: Array
    samples: int = 0
    held_out: int = 0

    def judging(self) -> Evidence:
        """Return what the same runs say where they are held out."""
        nothing = np.zeros_like(self.normal)
        return Evidence(self.normal, nothing, nothing, self.samples, self.samples)

    def __add__(self, other: Evidence) -> Evidence:
        """Return what the runs of both say."""
        return Evidence(
            self.normal + other.normal, self.fitted + other.fitted, self.scatter + other.scatter,
            self.samples + other.samples, self.held_out + other.held_out,
        )  # fmt: skip


def _scatter(columns: Array, run: Run, expected: Expected) -> Array:
    """Return the covariance (w, w) of the products of a run's noise with columns (n, w)."""
    sigma, draws = expected[0][1][run.skip :], expected[0][2][:, run.skip :]
    own = columns * (run.noise / sigma)[:, None]
    total = own.T @ own
    if len(draws) < 2:
        return np.asarray(total)
    scores = (draws / sigma) @ columns
    scores -= scores.mean(axis=0)
    return np.asarray(total + scores.T @ scores / (len(draws) - 1))


def samples_of(runs: Sequence[Run]) -> int:
    """Return how many samples of runs count."""
    return sum(len(run.x) - run.skip for run in runs)


@dataclass(frozen=True, eq=False)
class Information:
    """What runs say of a question.

    Parameters are known from the runs that are fitted to, what is beside them from all. `typical`
    (w, w) are normal equations of a sample of what the rig can do, None where nobody looked.
    """

    question: Question
    told: Evidence
    typical: Array | None = None

    def with_runs(self, told: Iterable[Evidence]) -> Information:
        """Return what these runs and further ones say."""
        return replace(self, told=sum(told, start=self.told))

    @property
    def _own(self) -> int:
        return len(self.question.model.free())

    def left(self) -> Array:
        """Return the normal equations (w - p, w - p) of what is beside the model, refitted.

        Every parameter is known to about its own size beforehand.
        """
        return self._left(self.told.normal)

    def _left(self, normal: Array) -> Array:
        p = self._own
        across = normal[:p, p:]
        own = normal[:p, :p] + np.eye(p)
        return np.asarray(normal[p:, p:] - across.T @ np.linalg.solve(own, across))

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
            rival.name: float(np.sqrt(max(self.told.normal[p + i, p + i], 0.0)))
            for i, rival in enumerate(self.question.rivals)
        }

    def kept(self) -> dict[str, float]:
        """Return the share of each rival's change that no parameter absorbs, by the runs alone.

        What is known of a parameter beforehand would tell of an effect that it absorbs entirely.
        """
        p = self._own
        size = np.sqrt(np.maximum(np.diag(self.told.normal), 1e-300))
        normal = self.told.normal / np.outer(size, size)
        across, own = normal[:p, p:], normal[:p, :p] + ROUNDING * np.eye(p)
        left = np.diag(normal[p:, p:]) - np.sum(across * np.linalg.solve(own, across), axis=0)
        return {
            rival.name: float(np.sqrt(max(left[i], 0.0)))
            for i, rival in enumerate(self.question.rivals)
        }

    def deviations(self) -> dict[str, float]:
        """Return the standard deviation of each parameter of the model, over its size."""
        p = self._own
        inverse = np.linalg.inv(self.told.fitted[:p, :p] + np.eye(p))
        covariance = inverse @ (self.told.scatter[:p, :p] + np.eye(p)) @ inverse
        return dict(
            zip(self.question.model.free(), np.sqrt(np.diag(covariance)).tolist(), strict=True)
        )

    def of_force(self) -> float:
        """Return the standard deviation of the force over all that the rig can do, over its noise.

        By the parameters and the free parts together: what a model with a learned curve errs by.
        """
        assert self.typical is not None
        p, q = self._own, self._own + len(self.question.rivals)
        kept = [*range(p), *range(q, len(self.typical))]
        prior = [np.ones(p), *(np.full(one.size, one.size**-2.0) for one in self.question.bases)]
        normal = self.told.fitted[np.ix_(kept, kept)] + np.diag(np.concatenate(prior))
        return float(np.sqrt(np.trace(np.linalg.solve(normal, self.typical[np.ix_(kept, kept)]))))

    def of_bases(self) -> Mapping[str, Array]:
        """Return the standard deviations (m,) of a free part along each basis, law refitted.

        Over the noise of a sample: 1 is a part that is known no better than one sample shows.
        """
        left, first, out = self._left(self.told.fitted), len(self.question.rivals), {}
        for basis in self.question.bases:
            block = left[first : first + basis.size, first : first + basis.size]
            block = block + np.eye(basis.size) * basis.size**-2.0
            out[basis.name] = np.sqrt(np.diag(np.linalg.inv(block)))
            first += basis.size
        return out


# A test as it would be seen, and what tests are to serve: the goal that a search makes small.

HELD_OUT = 4
"""Of so many tests one is held out where parameters and curves are all that is asked for."""


def roles_of(count: int, judged: bool) -> list[bool]:
    """Return for each test whether it is held out: each such test is like the one before it.

    Parameters
    ----------
    count : of the tests
    judged : whether a verdict is asked for, which held-out runs decide: then every second one is
    """
    every = 2 if judged or count < HELD_OUT else HELD_OUT
    return [k % every == 1 for k in range(count)]


@dataclass(frozen=True, eq=False)
class JudgedTest:
    """A test as it would be seen: what it prescribes.

    `shown` what it would say per question if it is fitted to; `held_out` whether it is to judge by.
    """

    test: Test
    signals: PrescribedSignals
    shown: tuple[Evidence, ...]
    held_out: bool = False

    @property
    def role(self) -> str:
        """What the test is for, as files have it."""
        return "holdout" if self.held_out else "train"

    def evidence_for(self, k: int) -> Evidence:
        """Return what it would say of a question."""
        return self.shown[k].judging() if self.held_out else self.shown[k]


@dataclass(frozen=True)
class Goal:
    """What a plan is to reach.

    `asked` the questions, over and over where parameters are drawn, the `count` first ones with the
    fitted ones; `known` what the runs at hand say of them; `cost` what is to become small, of what
    runs would say; `judged` whether it is a verdict, which the tests that are held out decide.
    """

    asked: tuple[PreparedQuestion, ...]
    known: tuple[Information, ...]
    count: int
    cost: Callable[[Sequence[Information]], float]
    judged: bool = True

    def with_tests(self, tests: Sequence[JudgedTest]) -> list[Information]:
        """Return what the runs at hand and tests would say of each question."""
        return [
            known.with_runs(one.evidence_for(k) for one in tests)
            for k, known in enumerate(self.known)
        ]

    def with_pair(self, one: JudgedTest) -> list[Information]:
        """Return what the runs at hand, a test and another one to judge by would say."""
        return self.with_tests([one, replace(one, held_out=True)])

    def among(self, tests: Sequence[JudgedTest]) -> Goal:
        """Return the goal where tests show what the rig can do."""
        known = []
        for k, one in enumerate(self.known):
            told = [test.shown[k] for test in tests if test.shown[k].samples]
            normals = [each.normal / each.samples for each in told]
            known.append(replace(one, typical=np.mean(normals, axis=0) if told else None))
        return replace(self, known=tuple(known))

    def value(self, tests: Sequence[JudgedTest]) -> float:
        """Return the cost of the runs at hand with tests."""
        return self.cost(self.with_tests(tests))
