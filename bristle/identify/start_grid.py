"""Where the search for an effect begins: a net of values, ranked by one linear step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..physics.effect import EFFECTS
from ..physics.laws import LAWS, laws_of
from .fit import Model, Problem
from .search import HUBER, loss
from .search_context import Expected, Search, residuals

Array = NDArray[np.float64]

NET: dict[str, dict[str, tuple[float, ...]]] = {
    "stribeck": {"rise": (1.0, 8.0), "v_s": (0.3, 1.0, 3.0)},
    "flattening": {"v_f": (0.1, 0.3, 1.0), "bend": (1.0, 2.0)},
    "saturation": {"V_s": (0.2, 0.4, 1.0)},
    "coil_lag": {"tau": (0.1, 0.5, 2.0)},
    "temperature": {"E_0": (1.0, 4.0, 15.0), "tau": (0.07, 0.3)},
    "presliding": {"x_s": (0.03, 0.1, 0.3, 1.0)},
    "mount_compliance": {"k": (0.3, 1.0, 3.0, 10.0)},
    "backlash": {"gap": (0.01, 0.017, 0.03, 0.05, 0.09, 0.15, 0.26, 0.45, 0.8, 1.3, 2.3, 4.0)},
    "quadratic_damping": {"shape": (0.875, 1.0, 1.25)},
    "remanence": {"width": (0.3, 1.0)},
    "delay": {"time": (0.02, 0.1, 0.4, 1.0, 2.5), "filtered": (0.0, 0.2, 1.0)},
    "velocity_sensor": {"tau": (0.3, 1.0)},
}
"""The values looked at, as factors on an effect's defaults scaled to the rig."""

RELAXED = ((0.3, 2.0), (0.05, 10.0))
"""Size and width, as factors, of the part of a law that falls with speed, where a start makes room
for an effect of speed: a fit without it inflates that part."""

THIN = 6
"""Of what has no memory every so many samples suffice for a search."""

KEPT = {"none": 24, "memory": 2, "joint": 6}
"""From how many starts a search is made, by what the model has that makes it dear."""

STEPS = (1.0, 0.3)
"""Shares of the linear step that are looked at: a law far from linear overshoots."""


def _contact(own: dict[str, float], problem: Problem) -> None:
    """Tie a contact to its gap: closed, it gives by a small part of it and hardly bounces."""
    own["backlash.k"] = 20.0 * problem.size("N") / own["backlash.gap"]
    own["backlash.c"] = max(
        problem.size("N.s/m"), float(np.sqrt(own["backlash.k"] * own["backlash.mass"]))
    )


def _share_of_yield(own: dict[str, float], _problem: Problem) -> None:
    """Take an excess near rest out of the yield force, which holds part of it in its mean."""
    for name in {name for law in laws_of("damper") for name in law.yield_parameters()}:
        if name in own:
            own[name] /= 1.0 + 0.5 * own["stribeck.rise"]


TIES: dict[str, Callable[[dict[str, float], Problem], None]] = {
    "backlash": _contact,
    "stribeck": _share_of_yield,
}
"""Start values that follow from others."""


def starts(effect: str, base: Model, problem: Problem) -> list[Model]:
    """Return the models from which the search for an effect's parameters begins.

    An effect of speed alone competes with the law's own fall with speed, which has taken up what it
    could: so some of its starts have that part small and wide.
    """
    values = {
        name: problem.scaled(base.law, f"{effect}.{name}") for name in EFFECTS[effect].parameters
    }
    bases = [dict(base.values)]
    falling, over = base.law_class.falling()
    if EFFECTS[effect].needs == ("v",) and over and not {*falling, over} & set(base.held):
        for size, width in RELAXED:
            relaxed = {name: size * base.value(name) for name in falling}
            bases.append({**base.values, **relaxed, over: width * base.value(over)})
    factors = NET.get(effect, {})
    out = []
    for own in bases:
        for combination in product(*factors.values()):
            named = {f"{effect}.{name}": value for name, value in values.items()}
            for name, factor in zip(factors, combination, strict=True):
                named[f"{effect}.{name}"] *= factor
            values_there = {**own, **named}
            if effect in TIES:
                TIES[effect](values_there, problem)
            out.append(replace(base, effects=(*base.effects, effect), values=values_there))
    return out


@dataclass(frozen=True)
class Light:
    """Data for a search: runs, what to expect there, and the base model's sensitivities (n, p).

    `kept` says from how many starts a search is worth its cost.
    """

    problem: Problem
    expected: Expected
    known: Array
    kept: int


class Ground:
    """A model that effects are to join, on its training runs: what all their searches share."""

    def __init__(self, base: Model, train: Problem) -> None:
        self.base, self.train = base, train
        self.expected = train.expectation(base)
        self.cost = float(np.mean(loss(residuals(train, base, self.expected))))
        self._light: dict[str, Light] = {}
        self._lock = Lock()

    def light(self, effect: str) -> Light:
        """Return what the search for an effect is made on."""
        kind = _kind((*self.base.effects, effect), self.base.law)
        with self._lock:
            if kind not in self._light:
                problem, expected = _lighter(self.train, self.expected, kind)
                search = Search(problem, self.base, expected, self.base.free())
                self._light[kind] = Light(problem, expected, search.sensitivities(), KEPT[kind])
        return self._light[kind]


def _kind(effects: Sequence[str], law: str) -> str:
    joined = [EFFECTS[name] for name in effects]
    if any(effect.joint for effect in joined):
        return "joint"
    if LAWS[law].states or any(effect.states or effect.site == "sensor" for effect in joined):
        return "memory"
    return "none"


def _lighter(problem: Problem, expected: Expected, kind: str) -> tuple[Problem, Expected]:
    """Return less data for a search: some of the samples without memory, of the runs with a joint.

    Without states a law is a function of the motion at each sample. A series element costs many
    times as much as another effect.
    """
    if kind == "joint":
        few = slice(0, None, 2) if len(problem.runs) > 1 else slice(None)
        return problem.of(problem.runs[few]), expected[few]
    if kind == "memory":
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


@dataclass(frozen=True)
class Begun:
    """A candidate on its way, with its mean loss on the runs looked at."""

    model: Model
    cost: float


def ranked(effect: str, ground: Ground) -> list[Begun]:
    """Return an effect's starts after one linear step of all parameters, the best first."""
    light = ground.light(effect)
    found = [_stepped(start, effect, light) for start in starts(effect, ground.base, ground.train)]
    return sorted(found, key=lambda one: one.cost)


def _stepped(start: Model, effect: str, light: Light) -> Begun:
    """Return a start, or what a linear step from it leads to where that is better.

    The base model's own sensitivities are taken as they are without the effect.
    """
    base = [name for name in start.free() if not name.startswith(f"{effect}.")]
    added = [name for name in start.free() if name.startswith(f"{effect}.")]
    own = Search(light.problem, start, light.expected, added)
    here = own.residuals(own.start)
    J = np.hstack([light.known, own.sensitivities()]) if added else light.known
    weight = np.minimum(1.0, HUBER / np.maximum(np.abs(here), 1e-12))
    normal, gradient = (J * weight[:, None]).T @ J, (J * weight[:, None]).T @ here
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    step = np.linalg.lstsq(normal / np.outer(size, size), gradient / size, rcond=1e-8)[0] / size
    whole = Search(light.problem, start, light.expected, [*base, *added])
    best = Begun(start, float(np.mean(loss(here))))
    for share in STEPS:
        theta = np.clip(whole.start - share * step, whole.low, whole.high)
        cost = float(np.mean(loss(whole.residuals(theta))))
        if cost < best.cost:
            best = Begun(whole.at(theta), cost)
    return best
