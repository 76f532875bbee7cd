"""Each effect tried inside the model: refitted on training runs, judged on held-out ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Model, Problem, parameter
from ..identify.search import (
    HUBER,
    Descent,
    descend,
    jacobian,
    loss,
    losses,
    z_of,
    z_scale,
)
from ..physics.effect import EFFECTS, effects_of

Array = NDArray[np.float64]
Expected = list[tuple[Array, Array, Array]]

SEARCH: dict[str, dict[str, tuple[float, ...]]] = {
    "stribeck": {"v_s": (0.5, 2.0)},
    "flattening": {"v_f": (0.1, 1.0), "bend": (1.0, 2.0)},
    "saturation": {"V_s": (0.4, 1.0)},
    "coil_lag": {"tau": (0.5, 2.0)},
    "temperature": {"E_0": (2.0, 15.0), "tau": (0.2,)},
    "presliding": {"x_s": (0.1, 0.6)},
    "mount_compliance": {"k": (1.0,)},
    "backlash": {"gap": (0.3, 1.0, 4.0)},
    "quadratic_damping": {"c_2": (0.3, 3.0)},
}
"""Where a search begins, as factors on an effect's defaults scaled to the rig."""

QUICK = 8
"""Sweeps of the first, short search from each start."""

LONG = 20
"""Sweeps of the second search, from the best of the first ones."""

KEPT = 2
"""How many starts get a second search."""

THIN = 6
"""Of what has no memory every so many samples suffice for a search."""

SCREENED = 2
"""How many starts of an effect are looked at where only the most promising effects are searched."""

SECONDS = 4
"""How many effects are searched as the second one of a pair."""

FALL = {"bingham": ("c_0", "c_v"), "lugre": ("sigma_2", "sigma_b")}
"""The parts of the laws that fall with speed: a fit without an effect of speed inflates them."""

WORTH = 0.005
"""Share of the loss that a candidate must gain at least to be refined."""

PROMISING = 0.5
"""Share of the best gain on the training runs below which a candidate is not refined."""


@dataclass(frozen=True)
class Trial:
    """A model tried: fitted on the training runs, judged on the held-out ones.

    `train`, `z` the robust RMS of residual over expected noise there; `losses` (n,) the robust loss
    per held-out sample, `residual` (n,) the normalised residuals, `rms` [N] their plain size.
    `refined` is False where the first, short search already showed that it gains too little.
    """

    model: Model
    train: float
    z: float
    rms: float
    losses: Array
    residual: Array
    refined: bool = True

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects of the model."""
        return self.model.effects


class Search:
    """The search for a model's free parameters on runs: logarithms where a bound is above zero."""

    def __init__(self, problem: Problem, model: Model, expected: Expected, names: Sequence[str]):
        self.problem, self.model, self.expected = problem, model, expected
        self.names = list(names)
        declared = [parameter(model.law, name) for name in self.names]
        value = np.array([model.value(name) for name in self.names])
        bounds = np.array([model.bounds(name) for name in self.names], dtype=float).reshape(-1, 2)
        self.log = (bounds[:, 0] > 0.0) & (bounds[:, 1] > 50.0 * bounds[:, 0])
        sizes = np.array([problem.size(d.unit) for d in declared])
        self.scale = np.where(self.log, 1.0, np.maximum(np.abs(value), 1e-2 * sizes))
        self.low, self.high = self._to(bounds[:, 0]), self._to(bounds[:, 1])
        self.start = self._to(np.clip(value, bounds[:, 0], bounds[:, 1]))

    def _to(self, value: Array) -> Array:
        safe = np.where(self.log, np.maximum(value, 1e-300), 1.0)
        return np.where(self.log, np.log(safe), value / self.scale)

    def at(self, theta: Array) -> Model:
        """Return the model with these parameters."""
        value = np.where(self.log, np.exp(np.where(self.log, theta, 0.0)), theta * self.scale)
        return replace(
            self.model,
            values={**self.model.values, **dict(zip(self.names, value.tolist(), strict=True))},
        )

    def residuals(self, theta: Array) -> Array:
        """Return the normalised residuals of all runs (n,)."""
        return residuals(self.problem, self.at(theta), self.expected)

    def sensitivities(self) -> Array:
        """Return how the normalised residuals change with the parameters (n, p), there."""
        here = self.residuals(self.start)
        return jacobian(self.residuals, self.start, here, self.low, self.high)

    def run(self, sweeps: int) -> tuple[Model, Descent]:
        """Search from the model's own values."""
        found = descend(self.residuals, self.start, self.low, self.high, sweeps)
        return self.at(found.theta), found


def residuals(problem: Problem, model: Model, expected: Expected) -> Array:
    """Return the residuals of all runs over the noise expected there (n,)."""
    parts = []
    for run, (bias, sigma, _) in zip(problem.runs, expected, strict=True):
        z = (run.force - problem.predict(model, run) - bias) / sigma
        parts.append(np.nan_to_num(z[run.skip :], nan=1e6, posinf=1e6, neginf=-1e6))
    return np.concatenate(parts)


def judge(
    model: Model, train: Problem, held_out: Problem, noise: tuple[Expected, Expected] | None = None
) -> Trial:
    """Return how a fitted model does on the runs that it was fitted to and on the others.

    `noise` is what to expect there of a true model where that is not worth drawing for this one.
    """
    fitted, expected = noise or (train.expectation(model), held_out.expectation(model))
    z = residuals(held_out, model, expected)
    own = residuals(train, model, fitted)
    raw = np.concatenate(list(_raw(held_out, model, expected)))
    lost = losses(z)
    return Trial(
        model, z_scale(own), z_of(float(np.mean(lost))),
        float(np.sqrt(np.mean(raw**2))), lost, z, noise is None,
    )  # fmt: skip


def _raw(problem: Problem, model: Model, expected: Expected) -> Iterable[Array]:
    for run, (bias, _, _) in zip(problem.runs, expected, strict=True):
        yield (run.force - problem.predict(model, run) - bias)[run.skip :]


def _stiff_contact(own: dict[str, float], problem: Problem) -> None:
    """Tie a contact's stiffness to its gap: closed, it gives by a small part of it."""
    own["backlash.k"] = 50.0 * problem.size("N") / own["backlash.gap"]
    own["backlash.c"] = float(np.sqrt(own["backlash.k"] * own["backlash.mass"]))


TIES: dict[str, Callable[[dict[str, float], Problem], None]] = {"backlash": _stiff_contact}
"""Start values that follow from others."""


def starts(effect: str, base: Model, problem: Problem) -> list[Model]:
    """Return the models from which the search for an effect's parameters begins.

    An effect of speed alone competes with the law's own fall with speed, which has taken up what it
    could: so half of its starts have that part small and wide.
    """
    values = {
        name: problem.scaled(base.law, f"{effect}.{name}") for name in EFFECTS[effect].parameters
    }
    bases = [dict(base.values)]
    if EFFECTS[effect].needs == ("v",) and not {*FALL[base.law], "v_n"} & set(base.held):
        relaxed = {name: 0.3 * base.value(name) for name in FALL[base.law]}
        bases.append({**base.values, **relaxed, "v_n": 2.0 * base.value("v_n")})
    factors = SEARCH.get(effect, {})
    out = []
    for own in bases:
        for combination in product(*factors.values()):
            named = {f"{effect}.{name}": value for name, value in values.items()}
            for name, factor in zip(factors, combination, strict=True):
                named[f"{effect}.{name}"] *= factor
            if effect in TIES:
                TIES[effect](named, problem)
            out.append(replace(base, effects=(*base.effects, effect), values={**own, **named}))
    return out


@dataclass(frozen=True)
class Begun:
    """A candidate after its first search, with its mean loss on the training runs."""

    model: Model
    cost: float


def begin(effect: str, base: Model, train: Problem, expected: Expected, deep: bool = True) -> Begun:
    """Search shortly from every start of an effect, and longer from the best; return the best.

    All parameters move at once: with the law's held, an effect that the law has taken up vanishes.
    """
    problem, expected_there = lighter(train, expected, (*base.effects, effect), base.law)
    found = []
    for model in starts(effect, base, train)[: None if deep else 2]:
        model, ended = Search(problem, model, expected_there, model.free()).run(QUICK)
        found.append(Begun(model, ended.cost))
    found.sort(key=lambda one: one.cost)
    dear = not deep or bool(EFFECTS[effect].joint)
    longer = []
    for one in found[: 1 if dear else KEPT]:
        search = Search(problem, one.model, expected_there, one.model.free())
        longer.append(search.run(QUICK if dear else LONG))
    best = min(longer, key=lambda pair: pair[1].cost)[0]
    return Begun(best, float(np.mean(loss(residuals(train, best, expected)))))


def lighter(
    problem: Problem, expected: Expected, effects: Sequence[str], law: str
) -> tuple[Problem, Expected]:
    """Return less data for a search: a part of the samples without memory, of the runs with it.

    Without states a law is a function of the motion at each sample. A series element costs thirty
    times as much as another effect.
    """
    joined = [EFFECTS[name] for name in effects]
    if any(effect.joint for effect in joined):
        few = slice(0, None, 2) if len(problem.runs) > 1 else slice(None)
        return problem.of(problem.runs[few]), expected[few]
    if law != "bingham" or any(effect.states or effect.site == "sensor" for effect in joined):
        return problem, expected
    runs, thinned = [], []
    for run, (bias, sigma, draws) in zip(problem.runs, expected, strict=True):
        every = slice(None, None, THIN)
        runs.append(
            replace(
                run, dt=run.dt * THIN, x=run.x[every], v=run.v[every], a=run.a[every],
                V=run.V[every], force=run.force[every], draws=run.draws[:, every],
                skip=-(-run.skip // THIN),
                measured=None if run.measured is None else run.measured[every],
            )
        )  # fmt: skip
        thinned.append((bias[every], sigma[every], draws[:, every]))
    return problem.of(runs), thinned


def refine(begun: Model, train: Problem, sweeps: int = 12) -> Model:
    """Fit all free parameters, the noise expected of the model renewed on the way."""
    model = begun
    for share in (0.5, 1.0):
        model, _ = Search(train, model, train.expectation(model), model.free()).run(
            max(3, int(share * sweeps))
        )
    return model


def joinable(base: Model, instruments: Sequence[str] = ("delay",)) -> list[str]:
    """Return the effects that can join a model on a test bench, the slow ones first.

    `instruments` are the sensor effects that no redundancy of the channels has judged already.
    """
    taken = set(base.effects)
    for name in base.effects:
        taken |= set(EFFECTS[name].excludes)
    able = [
        *effects_of("damper", base.law),
        *(effect for effect in effects_of("sensor") if effect.name in instruments),
    ]
    names = [
        effect.name
        for effect in able
        if effect.name not in taken and not set(effect.excludes) & set(base.effects)
    ]
    return sorted(names, key=lambda name: not EFFECTS[name].joint)


def try_all(
    base: Model,
    train: Problem,
    held_out: Problem,
    instruments: Sequence[str] = ("delay",),
    most: int | None = None,
) -> list[Trial]:
    """Try every effect that can join the model, on all cores; best on the held-out runs first.

    Every effect is searched shortly from several starts; those that gain a fair share of what the
    best one gains on the training runs are refined. With `most`, only so many are searched, those
    that promise most, from fewer starts: for a second effect.
    """
    expected, there = train.expectation(base), held_out.expectation(base)
    before = float(np.mean(loss(residuals(train, base, expected))))
    names = joinable(base, instruments)
    with ThreadPoolExecutor(cpu_count()) as pool:
        if most is not None:
            names = _most_promising(names, base, train, expected, most, pool)
        deep = most is None
        begun = list(pool.map(lambda name: begin(name, base, train, expected, deep), names))
        gained = max(before - one.cost for one in begun)
        least = max(PROMISING * gained, WORTH * before)
        worth = [before - one.cost >= least for one in begun]

        def finish(pair: tuple[Begun, bool]) -> Trial:
            one, fine = pair
            if fine:
                return judge(refine(one.model, train), train, held_out)
            return judge(one.model, train, held_out, (expected, there))

        trials = list(pool.map(finish, zip(begun, worth, strict=True)))
    return sorted(trials, key=lambda trial: trial.z)


def _most_promising(
    names: Sequence[str], base: Model, train: Problem, expected: Expected, most: int,
    pool: ThreadPoolExecutor,
) -> list[str]:  # fmt: skip
    """Return the names of the effects that promise most, in the order given."""
    light: dict[bool, tuple[Problem, Expected, Array]] = {}
    for dear in {bool(EFFECTS[name].joint) for name in names}:
        joint = ["backlash"] if dear else []
        problem, there = lighter(train, expected, (*base.effects, *joint), base.law)
        own = Search(problem, base, there, base.free())
        light[dear] = problem, there, own.sensitivities()

    def promised(name: str) -> float:
        problem, there, known = light[bool(EFFECTS[name].joint)]
        return min(
            _promise(start, name, known, problem, there)
            for start in starts(name, base, train)[:SCREENED]
        )

    found = dict(zip(names, pool.map(promised, names), strict=True))
    best = sorted(names, key=lambda name: found[name])[:most]
    return [name for name in names if name in best]


def _promise(
    start: Model, effect: str, known: Array, problem: Problem, expected: Expected
) -> float:
    """Return the mean loss after one linear step of an effect's and the base's parameters.

    `known` (n, p) are the sensitivities of the base model's own parameters without the effect.
    """
    free = [name for name in start.free() if name.startswith(f"{effect}.")]
    search = Search(problem, start, expected, free)
    here = search.residuals(search.start)
    J = np.hstack([known, search.sensitivities()]) if free else known
    weight = np.minimum(1.0, HUBER / np.maximum(np.abs(here), 1e-12))
    normal = (J * weight[:, None]).T @ J
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    gradient = (J * weight[:, None]).T @ here
    step = np.linalg.lstsq(normal / np.outer(size, size), gradient / size, rcond=1e-8)[0] / size
    return float(np.mean(loss(here - J @ step)))


def try_members(pair: Trial, base: Model, train: Problem, held_out: Problem) -> list[Trial]:
    """Try each new effect of a model alone, its search begun from the values found together."""
    out = []
    for name in pair.effects:
        if name in base.effects:
            continue
        others = [e for e in pair.effects if e not in base.effects and e != name]
        kept = tuple(e for e in pair.effects if e not in others)
        values = {
            key: value
            for key, value in pair.model.values.items()
            if key.partition(".")[0] not in others
        }
        alone = refine(replace(pair.model, effects=kept, values=values), train, 2 * LONG)
        out.append(judge(alone, train, held_out))
    return out
