"""A closure: a small network for what a model misses and no formula serves, in parallel with it.

Its inputs are the motion of the rod, the command, and exponential traces of both over time and over
travel. First its hidden weights are drawn (random features: Rahimi & Recht 2008, NIPS 20; Huang,
Zhu & Siew 2006, Neurocomputing 70, 489-501) and its output is a ridge regression in closed form, so
that a choice of inputs costs little. On those, small networks are trained with all their weights;
the mean of several is the closure (Hansen & Salamon 1990, IEEE PAMI 12, 993-1001). Folds of whole
runs choose, drawn ones among the rest: they stray less where few runs tell little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from ..comparison.names import effect_name
from ..core.arrays import Array, Flags, Indices
from ..core.progress import tell
from ..core.text import percent, plain, quantity, scale
from ..data.corrections import jumps
from ..data.run_labels import labels_of
from ..diagnosis.prepared import Prepared
from ..diagnosis.trials import Trial, guesses_of, joinable, judge, short_search
from ..identification.error import zero_on
from ..identification.fit import refine
from ..identification.problem import Problem, Run, sensors
from ..identification.search import in_threads
from ..identification.start_grid import SearchContext
from ..model.model import Model
from ..physics.drive import DRIVES, unit_for
from ..physics.effect import CLOSURE, EFFECTS
from ..user_code.load import defined
from ..view import Viewable
from .closure_file import Closure, Input, Region, Store, closure_text, evened, rounded
from .signals import faded

SPREAD = (0.05, 0.2, 0.8, 3.2)
"""Time constants of the traces, in RMS displacements over RMS velocities."""

TRAVELS = (0.05, 0.2, 0.8)
"""Travels of the traces of the direction, in RMS displacements."""

SLOW = 0.1
"""Speed over which the direction changes, in RMS velocities."""

SIZES = (30, 60, 120)
"""Hidden units that are tried."""

STEEP = (0.3, 0.6, 1.2)
"""Spreads of the hidden weights."""

PENALTIES = tuple(10.0**k for k in range(-6, 1))
"""Ridges, in samples."""

MEMBERS, UNITS = 3, 12
"""Networks that are trained, from other weights each, and their hidden units."""

DECAYS = (1e-4, 1e-3, 1e-2)
"""Penalties on their weights, in variances of what is missing."""

DESCENTS, ENOUGH = 400, 6_000
"""Steps of their training; samples of the training runs, about, that it uses."""

FOLDS = 4
"""Parts of the training runs that are left out in turn: whole runs, of a single one stretches."""

FEWEST_REVERSALS = 2 * FOLDS
"""Reversals of a single training run from which on parts of it are folds."""

QUANTILES, END = 20, 1.7
"""Of an input, whose ranks go evenly from -END to END: that of what is even, in deviations."""

MOST = 40_000
"""Samples of the training runs, about, that are used."""

AS_GOOD = 1.02
"""Loss of a smaller network, by the least, at which it is taken."""

MARGIN = 0.15
"""Share of an input's range over which a closure fades beyond it."""

STRETCHES = 8
"""Parts of the held-out runs, at least, over which a gain must not be scatter."""

ROOM = 1.5
"""Times the energy given back in the training runs that a closure may give back."""

BOUND = 4.0
"""Times its largest force in the training runs that a closure comes near at the most."""

SOON = 0.02
"""Time in which the store of energy may run empty, in RMS displacements over RMS velocities."""

REST = 0.01
"""Speed in RMS velocities below which a closure that may give no energy fades."""

ROUND = 0.01
"""Variance that is added to scaled inputs where their region is told: nothing is thinner."""

SWEEPS = 4
"""Jacobians of a refit of the model beside a closure."""

LIVES, TOLD = 0.1, 3
"""Share of a closure's variance that an input takes with it, from which on it is told; how many."""

ALIKE = 0.1
"""Spread of the runs' RMS displacements, by their mean, below which they have one amplitude."""


_Tried = tuple[float, int, Closure]
"""A network that is tried: its loss on left-out folds, its hidden units, itself."""


@dataclass(frozen=True, repr=False)
class LearnedClosure(Viewable):
    """What `learn_closure` came to.

    `closure` the network, None where none was trained; `before`, `after` the trials without and
    with it; `folds` its error on left-out parts of the training runs by that without it; `share`
    RMS of its force over RMS of the measured one, on held-out runs; `lives_on` the groups of its
    inputs with the share of its variance that goes without each; `outside` the share of held-out
    samples where it has faded by half or more; `stroke` [m] RMS displacement of the training runs
    where all have one amplitude, else 0; `single` the name of the only one, else ""; `nearest` the
    effect of the library that is; `refused` why it is not kept, "" where it is; `file` its
    effect's, None where none is written; `falls` the error on held-out runs without and with it,
    over the RMS of the force, as the step has it that adds it: () where none does.
    """

    name: str
    closure: Closure | None
    before: Trial
    after: Trial | None = None
    folds: float = 1.0
    share: float = 0.0
    lives_on: tuple[tuple[str, float], ...] = ()
    outside: float = 0.0
    stroke: float = 0.0
    single: str = ""
    nearest: Nearest | None = None
    refused: str = ""
    file: Path | None = None
    falls: tuple[float, ...] = ()

    def sentences(self) -> list[str]:
        """Return what was learned, as an engineer would say it."""
        if self.refused or self.closure is None or self.after is None:
            return [f"No closure is kept. {self.refused}", *self._narrow()]
        errors = [one.error for one in (self.before, self.after)]
        falls = self.falls or [one.headline[1] for one in errors if one is not None]
        fall = " to ".join(map(percent, falls))
        lives = [(words, part) for words, part in self.lives_on if part >= LIVES][:TOLD]
        inputs = ", ".join(f"{words} ({percent(part, 0)})" for words, part in lives)
        return [
            f"{self.name} is a closure: a network of {len(self.closure.out)} units for what the "
            "model misses and no formula serves. It is no effect of physics, and the verdict stays "
            f"unknown. With it the error on held-out runs falls from {fall} of the force; its own "
            f"force is {percent(self.share)} of it.",
            f"Look for the physics in what it lives on: {inputs}; in brackets how much of its "
            "variance goes without that.",
            *([self.nearest.sentence(self.closure.drive)] if self.nearest else []),
            f"It is not supported beyond {self._region()}: it fades to zero there. Of the held-out "
            f"samples {percent(self.outside)} are outside.",
            *self._narrow(),
        ]

    def _region(self) -> str:
        """Return the ranges of motion and command in the training runs, in words."""
        assert self.closure is not None
        out, c = [], self.closure
        units = {"v": "m/s", "x": "m", "V": DRIVES[c.drive].unit}
        for k, one in enumerate(c.inputs):
            if one.kind in units:
                low, high = (
                    float(end[k] * c.spread[k] + c.middle[k])
                    for end in (c.region.low, c.region.high)
                )
                factor, unit = scale(units[one.kind], max(abs(low), abs(high)))
                name = c.drive if one.kind == "V" else one.words
                out.append(f"{name} {plain(factor * low, 3)} to {plain(factor * high, 3)} {unit}")
        return ", ".join(out)

    def _narrow(self) -> list[str]:
        if self.single:
            return [
                f"One run is for training ({self.single}): parts of it chose the closure, which "
                "knows nothing that this run did not do. Add runs with other amplitudes and "
                "commands:  bristle study extend"
            ]
        if not self.stroke:
            return []
        return [
            "The training runs all move with one amplitude "
            f"({quantity(self.stroke, 'm')} RMS): a closure knows no other one. Measure two or "
            "more, over the range in which the model is to be used."
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        out: dict[str, Any] = {
            "name": self.name, "kind": CLOSURE, "kept": not self.refused, "why": self.refused,
            "sentences": self.sentences(), "z_before": self.before.z, "forms": [],
        }  # fmt: skip
        if self.closure is None or self.after is None:
            return out
        errors = {
            f"error_{when}": one.error.headline[1]
            for when, one in (("before", self.before), ("after", self.after))
            if one.error is not None
        }
        return out | errors | {
            "z": self.after.z, "folds": self.folds, "share": self.share,
            "units": len(self.closure.out), "weights": self.closure.weights,
            "lives_on": dict(self.lives_on), "outside": self.outside,
            **({"nearest": self.nearest.effect, "nearest_explains": self.nearest.explains,
                "nearest_z": self.nearest.trial.z} if self.nearest else {}),
        }  # fmt: skip


def learn_closure(prepared: Prepared, name: str, *, names: bool = True) -> LearnedClosure:
    """Learn what the model of an opening misses, as a network in parallel with the damper.

    Parameters
    ----------
    prepared : runs and the fitted model, as a diagnosis begins with them
    name : of the effect that the network becomes
    names : whether the effect of the library that comes nearest is looked for
    """
    before, train = prepared.before, prepared.problem
    alike = one_amplitude(train.runs)
    stroke = float(np.mean([np.std(run.x) for run in train.runs])) if alike else 0.0
    single = train.runs[0].name if len(train.runs) == 1 else ""
    found = LearnedClosure(name, None, before, stroke=stroke, single=single)
    if before.z <= prepared.rule.clean:
        why = f"The model leaves {before.z:.2f} times the noise (z): nothing is missing."
        return replace(found, refused=why)
    trained = trained_beside(train, before.model)
    if trained is None:
        why = "No network lowers the error on parts of the training runs that it has not seen."
        return replace(found, refused=why)
    closure, model, folds = trained
    tell(f"closure: {len(closure.hidden)} units, judged on held-out runs")
    with defined({name: closure_text(name, closure, "a trial")}):
        joined = replace(model, effects=(*model.effects, name))
        fitted, held = (one.of(one.runs) for one in (train, prepared.held_out))
        after = judge(joined, fitted, held)
        errors = [errors_of(one, held) for one in (before.model, joined)]
    told = [_Seen(held, model, run, closure.inputs) for run in held.runs]
    carried = [one.forces(closure) for one in told]
    force = np.concatenate([run.force[run.skip :] for run in held.runs])
    inside = np.concatenate(
        [one.inside(closure)[run.skip :] for one, run in zip(told, held.runs, strict=True)]
    )
    own = np.concatenate([c[run.skip :] for c, run in zip(carried, held.runs, strict=True)])
    found = replace(
        found, closure=closure, after=after, folds=folds,
        share=float(np.sqrt(np.mean(own**2) / np.mean(force**2))),
        lives_on=_lives_on(closure, told, own, held.runs), outside=float(np.mean(inside < 0.5)),
    )  # fmt: skip
    if not lowers(errors[0], errors[1], prepared.rule.gain):
        rms = [float(np.sqrt(np.mean(np.concatenate(one) ** 2))) for one in errors]
        why = (
            "A network lowers the error on parts of the training runs, but not over the held-out "
            f"runs beyond their scatter ({rms[0]:.4g} N before, {rms[1]:.4g} N with it)."
        )
        return replace(found, refused=why)
    if not names:
        return found
    part = prepared.searched
    shown = [_Seen(part, before.model, run, closure.inputs).forces(closure) for run in part.runs]
    return replace(found, nearest=nearest_effect(prepared, before.model, part, shown))


def one_amplitude(runs: Sequence[Run]) -> bool:
    """Return whether all runs move about alike: each with one amplitude, and the same one."""
    sizes = np.array([float(np.std(run.x)) for run in runs])
    tops = np.array([0.5 * float(np.ptp(run.x)) for run in runs])
    steady = bool(np.all(tops < 1.6 * sizes))  # a sine has 1.41, what is random 2.5 or more
    return steady and bool(np.ptp(sizes) <= ALIKE * np.mean(sizes))


def reversals(run: Run) -> int:
    """Return how often the motion of a run turns, of what is faster than SLOW."""
    ways = np.sign(run.v[np.abs(run.v) > SLOW * np.std(run.v)])
    return int(np.count_nonzero(np.diff(ways)))


def errors_of(model: Model, problem: Problem) -> list[Array]:
    """Return per run the error of a model's force at the samples that count [N]."""
    zero = zero_on(problem, model)
    return [(run.force - problem.predict(model, run) - zero)[_counts(run)] for run in problem.runs]


def lowers(
    before: Sequence[Array], after: Sequence[Array], gain: float, beyond: float = 2.0
) -> bool:
    """Return whether errors (per run) fall by a gain, and beyond their scatter over the runs.

    Of few runs it is that over stretches of them, each with as much of the error before: what an
    earthquake does in its strong seconds would else be one stretch, and the rest silence.

    Parameters
    ----------
    before, after : of each run (n,), over its samples
    gain : share of the error of all runs that they take at least
    beyond : so many standard errors over the runs
    """
    total = [float(np.mean(np.concatenate([*one]) ** 2)) for one in (before, after)]
    if total[1] > (1.0 - gain) ** 2 * total[0]:
        return False
    each = max(1, -(-STRETCHES // len(before)))
    falls: list[float] = []
    for one, other in zip(before, after, strict=True):
        power = np.cumsum(one**2)
        ends = np.searchsorted(power, power[-1] * np.arange(1, each) / each)
        parts = zip(np.split(one, ends), np.split(other, ends), strict=True)
        falls += [float(a @ a - b @ b) * each / len(one) for a, b in parts if len(a)]
    return bool(np.mean(falls) > beyond * np.std(falls, ddof=1) / np.sqrt(len(falls)))


def trained_beside(train: Problem, model: Model) -> tuple[Closure, Model, float] | None:
    """Return a network, the model refitted beside it, and its error on left-out folds.

    That error is by the error without a network there. None where no network lowers it.

    Parameters
    ----------
    train : the training runs; they alone are looked at
    model : fitted to them
    """
    best: tuple[Closure, Model, float] | None = None
    present, least, begun = model, float("inf"), 0.0
    for turn in range(2):
        tell("training a closure" if turn == 0 else "training it beside the model refitted")
        found = _chosen(train, present)
        if found is None:
            break
        closure, loss, without = found
        if loss >= (AS_GOOD**-0.5) * least:
            break
        begun = begun or without  # the error of the model as given
        least, best = loss, (closure, present, float(np.sqrt(loss / begun)))
        present = _refitted(train, present, closure)
    return best


def _refitted(train: Problem, model: Model, closure: Closure) -> Model:
    """Return a model fitted to what a closure leaves of the force: both add up at the rod."""
    runs = [
        replace(run, force=run.force - _Seen(train, model, run, closure.inputs).forces(closure))
        for run in train.runs
    ]
    return refine(model, train.of(runs), SWEEPS)


def promised(train: Problem, model: Model) -> float:
    """Return the error that a closure may leave on left-out folds, by that without one [1].

    It is told by networks with one penalty, beside the model as it is.

    Parameters
    ----------
    train : the training runs; they alone are looked at
    model : fitted to them
    """
    if len(train.runs) == 1 and reversals(train.runs[0]) < FEWEST_REVERSALS:
        return 1.0
    tried, without = _tried(train, model, DECAYS[1:2])
    return min(1.0, float(np.sqrt(min(loss for loss, _, _ in tried) / without)))


def _tried(train: Problem, model: Model, decays: Sequence[float]) -> tuple[list[_Tried], float]:
    """Return networks, those that are trained last, and the loss without one.

    Drawn ones are without and with the displacement, without and with the labels of the runs; with
    the inputs that are best for them others are trained.

    Parameters
    ----------
    train, model : the training runs, and the model that networks are beside
    decays : penalties of those that are trained
    """
    zero = zero_on(train, model)
    total = sum(int(np.count_nonzero(_counts(run))) for run in train.runs)
    rows = [np.flatnonzero(_counts(run))[:: max(1, total // MOST)] for run in train.runs]
    y = [
        (run.force - train.predict(model, run) - zero)[row]
        for run, row in zip(train.runs, rows, strict=True)
    ]
    fold, of_inputs = _folds(rows), list[tuple[float, list[_Tried], _Grid]]()
    of_runs = label_inputs(train.runs)
    for position, labels in product((False, True), (True, False) if of_runs else (False,)):
        inputs = (*inputs_of(train.runs, position), *(of_runs if labels else ()))
        grid = _Grid([_Seen(train, model, run, inputs) for run in train.runs], rows, y, fold)
        drawn = [one for steep in STEEP for one in grid.drawn(steep)]
        of_inputs.append((min(loss for loss, _, _ in drawn), drawn, grid))
    _, _, best = min(of_inputs, key=lambda one: one[0])
    tried = [one for _, drawn, _ in of_inputs for one in drawn]
    return [*tried, *map(best.trained, decays)], float(np.mean(np.concatenate(y) ** 2))


def _chosen(train: Problem, model: Model) -> tuple[Closure, float, float] | None:
    """Return the best network beside a model, its loss on left-out folds, and that without one."""
    decays = DECAYS if len(train.runs) > 1 else DECAYS[1:]
    tried, without = _tried(train, model, decays)
    if len(train.runs) == 1:  # its parts are alike: they would not see a drawn one stray
        tried = tried[-len(decays) :]
    least = min(loss for loss, _, _ in tried)
    if least > without:  # few folds promise less than all runs give: what is left out is outermost
        return None
    able = [one for one in tried if one[0] <= AS_GOOD * least]
    loss, _, closure = min(able, key=lambda one: one[:2][::-1])
    return replace(closure, store=_store(train, model, closure)), loss, without


def _counts(run: Run) -> Flags:
    """Return which samples of a run count (n,)."""
    out = np.zeros(len(run.force), dtype=bool)
    out[run.skip :] = run.judged
    return out


def _folds(rows: Sequence[Indices]) -> Indices:
    """Return the fold of each sample: whole runs, of a single one stretches."""
    if len(rows) > 1:
        return np.concatenate([np.full(len(row), k % FOLDS) for k, row in enumerate(rows)])
    return np.concatenate([np.arange(len(row)) * FOLDS // max(len(row), 1) for row in rows])


def inputs_of(runs: Sequence[Run], position: bool) -> tuple[Input, ...]:
    """Return the inputs of a network for runs; time constants and travels are of their scales.

    Parameters
    ----------
    runs : of the training
    position : whether the displacement itself is an input: its zero may be anywhere
    """
    x = np.concatenate([run.x - np.mean(run.x) for run in runs])
    v, V = (np.concatenate([getattr(run, name) for run in runs]) for name in ("v", "V"))
    way, speed, top = float(np.std(x)), float(np.std(v)), float(np.max(np.abs(V)))
    step, time = max(run.dt for run in runs), _time(runs)
    times = rounded(np.unique(np.maximum(time * np.array(SPREAD), 2.0 * step))).tolist()
    travels, (slow,) = rounded(way * np.array(TRAVELS)).tolist(), rounded(SLOW * np.array([speed]))
    out = [Input("v", 0.0), Input("direction", 0.0, float(slow))]
    if position:
        out.append(Input("x", 0.0))
    out += [Input("recent_v", tau) for tau in times]
    out += [Input("way", travel, float(slow)) for travel in travels]
    if top > 0.0:
        moving = max(float(np.std(run.V)) for run in runs) > 1e-3 * top
        if float(np.ptp(V)) > 1e-3 * top:
            out.append(Input("V", 0.0))
        out += [Input("recent_V", tau) for tau in times if moving]
    return tuple(out)


def label_inputs(runs: Sequence[Run]) -> tuple[Input, ...]:
    """Return the inputs that are numbers of whole runs."""
    every = [one for one in labels_of([run.labels for run in runs]) if one.is_number]
    return tuple(
        Input("label", 0.0, 1.0, one.name, *rounded(np.array([low, high, middle])).tolist())
        for one in every
        for numbers in [one.numbers()]
        for low, high, middle in [(numbers.min(), numbers.max(), numbers.mean())]
    )


def _time(runs: Sequence[Run]) -> float:
    """Return the time scale of a motion [s]: RMS displacement over RMS velocity."""
    x = np.concatenate([run.x - np.mean(run.x) for run in runs])
    return float(np.std(x) / np.std(np.concatenate([run.v for run in runs])))


class _Seen:
    """What a network sees of a run, and what the load cell shows of its force.

    `signals` (m, k) the inputs at the moments of which a model gives the force.
    """

    def __init__(self, problem: Problem, model: Model, run: Run, inputs: Sequence[Input]) -> None:
        self.problem, self.model, self.run, self.inputs = problem, model, run, tuple(inputs)
        self.fed = problem.fed(model, run)
        x, v, _, V, dt = self.fed.moments
        held = np.where(jumps(V), np.append(V[:1], V[:-1]), V)  # what acted up to a jump
        self.signals = np.column_stack(
            [
                np.full(len(v), _number(one, run)) if one.label
                else _history(one, x, v, V, held, dt)
                for one in inputs
            ]
        )  # fmt: skip

    @property
    def plain(self) -> bool:
        """Whether the load cell shows a force as it is."""
        filtered = self.run.finer is not None or self.run.pulse is not None
        return not filtered and not sensors(self.model.effects, "force")

    def at(self, values: Array, rows: Indices) -> Array:
        """Return values (m, ...) of the moments at samples of the run."""
        return values[rows * (1 if self.run.finer is None else self.run.finer.parts)]

    def shown(self, columns: Array) -> Array:
        """Return what the load cell shows (n, c) of forces (m, c)."""
        if self.plain:
            return columns
        none = self.problem.shown(self.model, self.run, self.fed, np.zeros(len(columns)))
        rows = [self.problem.shown(self.model, self.run, self.fed, one) for one in columns.T]
        return np.column_stack([row - none for row in rows])

    def forces(self, closure: Closure) -> Array:
        """Return a network's force (n,) [N], whatever its store of energy allows."""
        return self.shown(closure.force(self.signals)[:, None])[:, 0]

    def inside(self, closure: Closure) -> Array:
        """Return how far a network is supported (n,): 1 inside its region, 0 far outside."""
        inside = closure.region.inside(closure.scaled(self.signals))
        return self.at(inside, np.arange(len(self.run.force)))


def _number(one: Input, run: Run) -> float:
    """Return the number of a run that an input is."""
    told = run.labels.get(one.label, one.usual)
    return min(max(one.usual if isinstance(told, str) else told, one.low), one.high)


def _history(one: Input, x: Array, v: Array, V: Array, held: Array, dt: float) -> Array:
    """Return an input (m,) along a motion and command that are linear between the samples."""
    if one.kind in ("v", "x", "V"):
        return {"v": v, "x": x, "V": V}[one.kind]
    if one.kind == "direction":
        return np.asarray(np.tanh(v / one.slow))
    if one.kind == "recent_v":
        return v - faded(v, dt, one.over, float(v[0]))
    keep = np.exp(-dt / one.over) if one.kind == "recent_V" else 0.0
    if one.kind == "recent_V":
        middle = 0.5 * (V[:-1] + held[1:])
        late = lfilter([1.0 - keep], [1.0, -keep], middle, zi=[keep * V[0]])[0]
        return np.asarray(V - np.append(V[:1], late))
    middle = 0.5 * (v[1:] + v[:-1])
    kept, to = np.exp(-np.abs(middle) * dt / one.over).tolist(), np.tanh(middle / one.slow).tolist()
    out, now = [0.0], 0.0
    for k, goal in zip(kept, to, strict=True):
        now = goal + (now - goal) * k
        out.append(now)
    return np.array(out)


def region_of(u: Array) -> Region:
    """Return where scaled inputs (m, k) of training runs are."""
    low, high = np.min(u, axis=0), np.max(u, axis=0)
    margin = np.maximum(MARGIN * (high - low), 1e-3)
    spread = u.T @ u / len(u) + ROUND * np.eye(u.shape[1])
    axes = np.tril(np.linalg.inv(np.linalg.cholesky(spread)))
    reach = float(np.sqrt(np.max(np.sum((u @ axes.T) ** 2, axis=1))))
    low, high, margin, axes, reaches = map(rounded, (low, high, margin, axes, np.array([reach])))
    return Region(low, high, margin, axes, float(reaches[0]))


class _Grid:
    """Networks on some inputs, of which folds tell the loss.

    A fold is judged by a network that fades beyond what the other folds did.

    Parameters
    ----------
    seen : the runs as a network sees them
    rows : per run the samples that are used
    y : per run what the model leaves there [N]
    fold : (n,) of all these samples
    """

    def __init__(
        self, seen: Sequence[_Seen], rows: Sequence[Indices], y: Sequence[Array], fold: Indices
    ) -> None:
        self.seen, self.rows, self.y = seen, rows, np.concatenate(y)
        every = np.concatenate([one.signals for one in seen])
        middle, spread = np.mean(every, axis=0), np.std(every, axis=0)
        self.middle = rounded(middle)
        self.spread = rounded(np.maximum(spread, 1e-9 * (1.0 + np.abs(middle))))
        scaled = (every - self.middle) / self.spread
        self.knots = tuple(map(_line, scaled.T))
        self.evened = [
            evened((one.signals - self.middle) / self.spread, self.knots) for one in seen
        ]
        self.parts = [fold == k for k in range(FOLDS) if np.any(fold == k)]
        moving = len([one for one in seen[0].inputs if not one.label])
        self.region = region_of(scaled[:, :moving])
        used = np.concatenate(
            [one.at(one.signals, row) for one, row in zip(seen, rows, strict=True)]
        )
        used = ((used - self.middle) / self.spread)[:, :moving]
        self.windows = [region_of(used[~part]).inside(used[part]) for part in self.parts]
        self.powers = [float(self.y[part] @ self.y[part]) for part in self.parts]

    def _runs(self) -> list[tuple[_Seen, Array, Indices]]:
        return list(zip(self.seen, self.evened, self.rows, strict=True))

    def drawn(self, steep: float) -> list[_Tried]:
        """Return networks of all sizes and penalties: loss on left-out folds, hidden units, itself.

        Their hidden weights are drawn, with a spread of `steep`.
        """
        most, k = max(SIZES), len(self.middle)
        draw = np.random.default_rng(1)
        hidden = rounded(steep * draw.standard_normal((most, k)))
        bias = rounded(draw.uniform(-1.5, 1.5, most))
        A = np.concatenate(
            [
                _columns(u[row], hidden, bias) if one.plain
                else one.shown(_columns(u, hidden, bias))[row]
                for one, u, row in self._runs()
            ]
        )  # fmt: skip
        own = [A[part] for part in self.parts]
        faded = [one * window[:, None] for one, window in zip(own, self.windows, strict=True)]
        out = []
        grams = [one.T @ one for one in own]
        sides = [one.T @ self.y[part] for one, part in zip(own, self.parts, strict=True)]
        judged = [
            (power, one.T @ self.y[part], one.T @ one)
            for power, one, part in zip(self.powers, faded, self.parts, strict=True)
        ]
        for size, penalty in product(SIZES, PENALTIES):
            n = 1 + k + size
            ridge = penalty * len(A) * np.eye(n)
            gram, side = sum(grams)[:n, :n] + ridge, sum(sides)[:n]
            loss = 0.0
            for G, s, (power, t, H) in zip(grams, sides, judged, strict=True):
                theta = np.linalg.solve(gram - G[:n, :n], side - s[:n])
                loss += power - 2.0 * float(theta @ t[:n]) + float(theta @ H[:n, :n] @ theta)
            theta = rounded(np.linalg.solve(gram, side))
            closure = self._closure(hidden[:size], bias[:size], theta, A[:, :n] @ theta)
            out.append((loss / len(A), size, closure))
        return out

    def trained(self, decay: float) -> _Tried:
        """Return the mean of networks that are trained with all their weights, as `drawn` does.

        They see the inputs as the load cell shows the force: late and smooth as it does.

        Parameters
        ----------
        decay : penalty on the weights
        """
        u = np.concatenate(
            [
                one.at(u, row) if one.plain else one.shown(u)[row]
                for one, u, row in self._runs()
            ]
        )  # fmt: skip
        thin, size, loss = max(1, len(u) // ENOUGH), float(np.std(self.y)) or 1.0, 0.0

        def mean_of(rows: Flags) -> list[Array]:
            """Return hidden weights and biases of all networks, and the output of their mean."""
            own, y = u[rows][::thin], self.y[rows][::thin] / size
            every = [_descended(own, y, decay, seed) for seed in range(MEMBERS)]
            hidden, bias, out, rest = (np.concatenate(part) for part in zip(*every, strict=True))
            rest = np.sum(rest.reshape(MEMBERS, -1), axis=0)
            return [hidden, bias, size / MEMBERS * np.append(rest, out)]

        for part, window in zip(self.parts, self.windows, strict=True):
            hidden, bias, theta = mean_of(~part)
            loss += float(
                np.sum((self.y[part] - window * (_columns(u[part], hidden, bias) @ theta)) ** 2)
            )
        hidden, bias, theta = map(rounded, mean_of(np.ones(len(u), dtype=bool)))
        closure = self._closure(hidden, bias, theta, _columns(u, hidden, bias) @ theta)
        return loss / len(u), len(bias), closure

    def _closure(self, hidden: Array, bias: Array, theta: Array, force: Array) -> Closure:
        """Return a network of some hidden weights and output weights, with its force there."""
        k = len(self.middle)
        largest = max(float(np.max(np.abs(force))), 1e-9)
        return Closure(
            self.seen[0].inputs, self.middle, self.spread, self.region, self.knots, hidden, bias,
            theta[1 + k :], theta[1 : 1 + k], float(theta[0]),
            float(rounded(np.array([BOUND * largest]))[0]), Store(0.0, 0.0, 0.0, 0.0),
            self.seen[0].run.drive,
        )  # fmt: skip


def _line(u: Array) -> tuple[Array, Array]:
    """Return the quantiles of an input (m,), each once, and their ranks."""
    at, first = np.unique(rounded(np.quantile(u, np.linspace(0.0, 1.0, QUANTILES))), True)
    return at, rounded(np.linspace(-END, END, QUANTILES))[first]


def _columns(u: Array, hidden: Array, bias: Array) -> Array:
    """Return what a network's output is linear in (m, 1 + k + n), at scaled inputs (m, k)."""
    return np.column_stack([np.ones(len(u)), u, np.tanh(u @ hidden.T + bias)])


def _descended(u: Array, y: Array, decay: float, seed: int) -> list[Array]:
    """Return a network trained on scaled inputs (m, k): hidden, bias, out, constant and linear.

    Parameters
    ----------
    u, y : inputs (m, k) and what it is to give (m,), of the order of one
    decay : penalty on its weights
    seed : of its first hidden weights
    """
    m, k = u.shape
    draw = np.random.default_rng(seed)
    hidden, bias = STEEP[0] * draw.standard_normal((UNITS, k)), draw.uniform(-1.5, 1.5, UNITS)
    A = _columns(u, hidden, bias)
    theta = np.linalg.solve(A.T @ A + 1e-3 * m * np.eye(A.shape[1]), A.T @ y)
    ends = np.cumsum([hidden.size, UNITS, UNITS, 1 + k])

    def split(weights: Array) -> list[Array]:
        *parts, _ = np.split(weights, ends)
        return [parts[0].reshape(UNITS, k), *parts[1:]]

    held = decay * np.concatenate([np.ones(hidden.size), 0.1 * np.ones(UNITS), np.ones(UNITS),
                                   np.append(0.0, np.ones(k))])  # fmt: skip

    def loss(weights: Array) -> tuple[float, Array]:
        hidden, bias, out, rest = split(weights)
        H = np.tanh(u @ hidden.T + bias)
        left = H @ out + u @ rest[1:] + rest[0] - y
        down = 2.0 / m * left
        back = (1.0 - H * H) * (down[:, None] * out)
        slope = np.concatenate([(back.T @ u).ravel(), back.sum(axis=0), H.T @ down,
                                np.append(down.sum(), u.T @ down)])  # fmt: skip
        cost = float(left @ left) / m + float(held @ weights**2)
        return cost, slope + 2.0 * held * weights

    begin = np.concatenate([hidden.ravel(), bias, theta[1 + k :], theta[: 1 + k]])
    options = {"maxiter": DESCENTS, "maxcor": 20}
    return split(minimize(loss, begin, jac=True, method="L-BFGS-B", options=options).x)


def held_by_springs(train: Problem, model: Model) -> float:
    """Return the energy [J] that springs of a model hold at the most, within the runs' motion.

    It is the work of the force at rest, without any history, from one end to the other.
    """
    every = np.concatenate([run.x for run in train.runs])
    x, most, still = np.linspace(float(np.min(every)), float(np.max(every)), 41), 0.0, np.zeros(2)
    for run in train.runs:
        fed = train.fed(model, run)
        V, dt = np.full(2, float(np.mean(fed.moments.V))), fed.moments.dt
        tracks = {name: values[:2] for name, values in fed.tracks.items()}
        bench = train.bench(model)
        force = np.array(
            [bench.force(np.full(2, at), still, still, V, dt, fed.values, tracks)[0] for at in x]
        )
        work = np.append(0.0, np.cumsum(0.5 * np.diff(x) * (force[1:] + force[:-1])))
        most = max(most, float(np.ptp(work)))
    return most


def _store(train: Problem, model: Model, closure: Closure) -> Store:
    """Return the energy that the device may give back: what the rig gave in the training runs."""
    begin = back = 0.0
    for run in train.runs:
        power = run.force * run.v
        taken = run.dt * np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1])))
        begin = max(begin, -float(np.min(taken)))
        back = max(back, float(np.max(np.maximum.accumulate(taken) - taken)))
    speeds = np.concatenate([run.v for run in train.runs])
    soon = max(4.0 * max(run.dt for run in train.runs), SOON * _time(train.runs))
    least = closure.size * float(np.max(np.abs(speeds))) * soon
    sizes = [begin, max(ROOM * back, begin, least), soon, REST * float(np.std(speeds))]
    sizes.append(held_by_springs(train, model))
    return Store(*rounded(np.array(sizes)).tolist())


def _lives_on(
    closure: Closure, seen: Sequence[_Seen], own: Array, runs: Sequence[Run]
) -> tuple[tuple[str, float], ...]:
    """Return the groups of inputs with the share of a network's variance that goes without each.

    Without an input is with its middle over the training runs.
    """
    total = max(float(np.var(own)), 1e-300)
    out = []
    for words in dict.fromkeys(one.words for one in closure.inputs):
        still = np.array([one.words == words for one in closure.inputs])
        rest = []
        for one, run in zip(seen, runs, strict=True):
            near = closure.region.inside(closure.scaled(one.signals))
            force = near * closure.output(np.where(still, closure.middle, one.signals))
            rest.append(one.shown(force[:, None])[run.skip :, 0])
        changed = float(np.mean((np.concatenate(rest) - own) ** 2))
        out.append((words, min(changed / total, 1.0)))
    return tuple(sorted(out, key=lambda pair: -pair[1]))


# The effect of the library that comes nearest to what a closure carries.

LOOKED = 3
"""Effects that are searched, of those whose first steps come nearest."""

NEAREST_SWEEPS = 12
"""Jacobians of the refit of the nearest one to the runs themselves."""

NEAR = 0.3
"""Share of what a closure carries from which on an effect is named as near to it."""


@dataclass(frozen=True)
class Nearest:
    """The effect that comes nearest to what a network carries, and how it does in its place.

    `explains` its share of the network's squared force that the model alone cannot take over;
    `trial` the model with it, fitted to the runs.
    """

    effect: str
    explains: float
    trial: Trial

    def sentence(self, drive: str) -> str:
        """Return what is said of it; `drive` is the command's channel."""
        share, name = percent(self.explains, 0), effect_name(self.effect)
        if self.explains < NEAR:
            return (
                f"No effect of the library is near: the nearest, {name}, explains {share} of what "
                "the network carries."
            )
        effect, values = EFFECTS[self.effect], self.trial.model
        sizes = ", ".join(
            f"{own} = {quantity(values.value(f'{self.effect}.{own}'), unit)}"
            for own, one in effect.parameters.items()
            if own not in effect.assumed
            for unit in (unit_for(one.unit, DRIVES[drive]),)
        )
        error = self.trial.error
        left = f" leaves {percent(error.headline[1])} of the force" if error is not None else ""
        return (
            f"Nearest in the library: {name}, which explains {share} of what the network carries. "
            f"In its place, fitted to the runs, it{left or ' was tried'} ({sizes})."
        )


def nearest_effect(
    prepared: Prepared, base: Model, train: Problem, carried: Sequence[Array]
) -> Nearest | None:
    """Return the effect of the library that comes nearest to what a network carries.

    Every effect that can join is fitted, with the model, to the model's force with the network's.

    Parameters
    ----------
    prepared : the runs that judge
    base : the model that the network is beside
    train : runs of the training
    carried : per run of them the network's force (n,) [N]
    """
    forces = [train.predict(base, run) for run in train.runs]
    runs = [
        replace(run, force=force + own)
        for run, force, own in zip(train.runs, forces, carried, strict=True)
    ]
    told = train.of(runs)
    told.free_zero = False
    tell("comparing the closure with the effects of the library")
    context, alone = (
        SearchContext(base, told),
        _squares_left(told, refine(base, told, NEAREST_SWEEPS)),
    )
    names = joinable(base, prepared.shown, told)
    if not names or alone <= 0.0:
        return None
    guesses = guesses_of(names, context)
    able = sorted(names, key=lambda name: guesses[name][0].cost)[:LOOKED]
    ends = in_threads(lambda name: short_search(name, context, guesses[name], True).model, able)
    left = [_squares_left(told, end) for end in ends]
    k = int(np.argmin(left))
    trial = judge(refine(ends[k], train, NEAREST_SWEEPS), train, prepared.held_out)
    return Nearest(able[k], max(0.0, 1.0 - left[k] / alone), trial)


def _squares_left(problem: Problem, model: Model) -> float:
    """Return the sum of the squared errors of a model over the samples that count [N2]."""
    errors = [(run.force - problem.predict(model, run))[run.skip :] for run in problem.runs]
    return float(
        sum(np.sum(one[run.judged] ** 2) for one, run in zip(errors, problem.runs, strict=True))
    )
