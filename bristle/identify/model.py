"""Runs, models, and how a model predicts a run and what it cannot know of it."""

# Longer than 300 lines: what a model is, and what it predicts of a run, stand together.

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ..data.extra import Extra
from ..data.finer import Finer, between
from ..data.labels import Label
from ..data.left_out import any_of
from ..physics.drive import DRIVES, VOLTAGE, unit_for
from ..physics.effect import AT, EFFECTS, Effect, effects_of, plain_name
from ..physics.laws import LAWS, Law
from ..physics.parameter import CHOICES, Parameter
from .begin import carrying_state, start_under_load
from .bench import Bench
from .instruments import earlier, pure_delay, shown_force, true_motion
from .run_labels import at_means, told_by, tracks_of, values_of_labels

Array = NDArray[np.float64]

_AROUND = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0

_STEADY = 1e-2  # of its level: what a voltage varies by without telling anything

LOST = 1e4
"""Noise of a sample that was not measured, in noises of the force: it has no say."""

REFERENCE = {
    "N": 4.0, "N/m": 800.0, "N/m2": 1.6e5, "N/m3": 3.2e7, "m": 5e-3, "m/s": 0.07, "N.s/m": 57.0,
    "N.s2/m2": 816.0, "kg": 2.7, "J": 0.02, "V": 5.0,
}  # fmt: skip
"""Typical sizes on the rig of 10 N for which the effects' defaults are written."""


class Moments(NamedTuple):
    """Motion and command x, v, a, V (m,) in SI at moments that are `dt` [s] apart."""

    x: Array
    v: Array
    a: Array
    V: Array
    dt: float


class Fed(NamedTuple):
    """What a damper's functions are given: motion and command, values, channels by parameter."""

    moments: Moments
    values: dict[str, float]
    tracks: dict[str, Array]


@dataclass(frozen=True)
class Run:
    """A measured run, its motion smoothed.

    `x`, `v`, `a`, `V`, `force` (n,) in SI, evenly spaced by `dt` [s]; `noise` the force channel's
    standard deviation [N]; `draws` (d, n, 4) draws of the error of x, v, a, V; `left_out` why
    samples say nothing, by reason (n,) True where that holds. `drive` is the channel that V holds,
    in its own unit; `labels` what is known of the whole run, such as a temperature; `rest` how many
    samples at its begin the damper rests under load, 0 where it does not; `extra` its channels
    besides those that bristle knows; `force_draws` (d, n) [N] draws of the error of a force that
    was not measured and follows from the motion, beside `noise` and each with its draw of `draws`;
    `finer` how models are evaluated between the samples of a decimated run, None for others;
    `untold` names the channels of the force whose noise cannot be told from their signal: `noise`
    is then a lower limit.
    """

    name: str
    dt: float
    x: Array
    v: Array
    a: Array
    V: Array
    force: Array
    noise: float
    draws: Array
    skip: int = 25
    left_out: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    drive: str = "voltage"
    labels: Mapping[str, Label] = field(default_factory=dict)
    rest: int = 0
    extra: Mapping[str, Extra] = field(default_factory=dict)
    force_draws: Array | None = None
    finer: Finer | None = None
    untold: tuple[str, ...] = ()

    @cached_property
    def smoothed(self) -> Moments:
        """The smoothed motion and command at the moments of which a model gives the force."""
        return self._moments(self.x, self.v, self.a, self.V)

    def drawn(self, draw: int) -> Moments:
        """Return the motion and command of one draw at these moments."""
        e = self.draws[draw]
        return self._moments(self.x + e[:, 0], self.v + e[:, 1], self.a + e[:, 2], self.V + e[:, 3])

    def _moments(self, x: Array, v: Array, a: Array, V: Array) -> Moments:
        if self.finer is None:
            return Moments(x, v, a, V, self.dt)
        motion = self.finer.motion(x, v, a, self.dt)
        return Moments(*motion, self.finer.command(V), self.dt / self.finer.parts)

    def seen(self, force: Array) -> Array:
        """Return a force at these moments as the measured one is: behind its filter (n,) [N]."""
        return force if self.finer is None else self.finer.filtered(force)

    @cached_property
    def measured(self) -> NDArray[np.bool_] | None:
        """Which samples (n,) say something, None where all do."""
        out = any_of(self.left_out)
        return None if out is None else ~out

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Which of the samples after `skip` were measured (n - skip,)."""
        if self.measured is None:
            return np.ones(max(0, len(self.force) - self.skip), dtype=bool)
        return self.measured[self.skip :]

    def of(self, part: slice) -> Self:
        """Return the run with these of its samples; `dt` and `skip` stay what they were.

        Where some between are left out, nothing is known between samples.
        """
        dense = part.step in (None, 1)
        rest = 0 if part.start else len(range(self.rest)[part])
        return replace(
            self, rest=rest, x=self.x[part], v=self.v[part], a=self.a[part], V=self.V[part],
            force=self.force[part], draws=self.draws[:, part],
            left_out={reason: where[part] for reason, where in self.left_out.items()},
            force_draws=None if self.force_draws is None else self.force_draws[:, part],
            extra={name: one.of(part) for name, one in self.extra.items()},
            finer=self.finer.of(part) if self.finer and dense else None,
        )  # fmt: skip

    def entire(self) -> Run:
        """Return the run with all its samples, whatever a fit takes of them."""
        return self


@dataclass(frozen=True)
class Model:
    """A law with effects and the values of their parameters by name, in SI.

    `fixed` names parameters that a fit leaves alone; `limits` are a user's bounds by name, inside
    of what is physical.
    """

    law: str
    effects: tuple[str, ...] = ()
    values: dict[str, float] = field(default_factory=dict)
    fixed: tuple[str, ...] = ()
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)

    def free(self) -> list[str]:
        """Return the names of the parameters that a fit moves."""
        fixed_of_law = self.law_class.fixed()
        names = [name for name in law_parameters(self.law) if name not in fixed_of_law]
        for effect in self.effects:
            joined = EFFECTS[effect]
            idle = () if self.law_class.has("bristle") else joined.bristles
            fixed = (*CHOICES, *joined.assumed, *idle)
            names += [f"{effect}.{name}" for name in joined.parameters if name not in fixed]
        out = {*self.fixed, *self.law_class.idle(self.values)}
        return [name for name in names if name not in out]

    @property
    def law_class(self) -> type[Law]:
        """The law's class."""
        return LAWS[self.law]

    def value(self, name: str) -> float:
        """Return a parameter's value, its default where none is given."""
        return float(self.values.get(name, parameter(self.law, name).value))

    def bounds(self, name: str) -> tuple[float, float]:
        """Return the bounds of a parameter [SI]: the user's, else those of what is physical."""
        low, high = parameter(self.law, name).bounds
        own = self.limits.get(name, (low, high))
        return max(low, own[0]), min(high, own[1])


def parameter(law: str, name: str) -> Parameter:
    """Return the declaration of a law's or effect's parameter."""
    if "." in name:
        effect, own = name.split(".", 1)
        return EFFECTS[effect].parameters[own]
    return law_parameters(law)[name]


def law_parameters(law: str) -> dict[str, Parameter]:
    """Return the declarations of a law's own parameters by name."""
    return LAWS[law].parameters


class Problem:
    """Runs held against a model: predictions, and the noise that a true model would show."""

    free_zero = False
    """Whether the force's zero is fitted along with every model; see `residuals.zero_of`."""

    excess = 0.0
    """Variance [N2] of what no model here explains, beside the noise; see `residuals.excess_of`."""

    def __init__(self, runs: list[Run]) -> None:
        self.runs = runs
        self._benches: dict[tuple[str, tuple[str, ...]], Bench] = {}
        self._sizes: dict[str, float] = {}

    @property
    def noise_known(self) -> bool:
        """Whether the force's noise is known in most runs, so that z says something."""
        return 2 * sum(not run.untold for run in self.runs) >= len(self.runs)

    def of(self, runs: list[Run]) -> Problem:
        """Return a problem of the same kind for other runs, such as a part of these."""
        made = self._made_of(runs)
        made.free_zero, made.excess = self.free_zero, self.excess
        return made

    def _made_of(self, runs: list[Run]) -> Problem:
        return Problem(runs)

    def planned(self, runs: list[Run]) -> Problem:
        """Return a problem for runs that were not measured yet: this rig's sizes are theirs.

        So are the means of its extra channels.
        """
        own = [run.extra for run in self.runs]
        made = self.of([replace(run, extra=at_means(own, len(run.x))) for run in runs])
        self.size("N")
        made._sizes, made._benches = self._sizes, self._benches
        return made

    def with_free_zero(self) -> Problem:
        """Return the same runs with the force's zero fitted along with every model."""
        made = self.of(self.runs)
        made.free_zero = True
        return made

    def with_excess(self, excess: float) -> Problem:
        """Return the same runs, what no model explains counted as variance [N2] beside the noise.

        The same for all samples, so that fits and losses weigh them nearly alike where it is large.
        """
        if excess == self.excess:
            return self
        made = self.of(self.runs)
        made.excess = excess
        made._sizes, made._benches = self._sizes, self._benches
        return made

    def damper_effects(self, law: str) -> list[str]:
        """Return the effects of the damper, by a model's names, that these runs may tell.

        Not those that a part of the law absorbs entirely.
        """
        return [
            effect.name
            for effect in effects_of("damper", law)
            if not absorbed(effect, law) and self.tells(effect)
        ]

    def tells(self, effect: type[Effect]) -> bool:
        """Return whether the runs have what an effect takes of them, and differ in it.

        Labels of whole runs, and channels besides those that bristle knows.
        """
        if not all(self._moves(channel) for channel in effect.channels.values()):
            return False
        names = {*effect.labels.values(), *effect.label_means.values()}
        known = [self._numbers(name) for name in names]
        return all(len({*one}) > 1 and max(one) - min(one) >= effect.label_span for one in known)

    def _moves(self, channel: str) -> bool:
        """Return whether all runs have an extra channel, and it varies in them."""
        if not self.runs or not all(channel in run.extra for run in self.runs):
            return False
        values = np.concatenate([run.extra[channel].values for run in self.runs])
        return float(np.ptp(values)) > 0.0

    def _numbers(self, label: str) -> list[float]:
        """Return the numbers of a label, one per run; none where a run lacks it."""
        found = [run.labels.get(label, "") for run in self.runs]
        numbers = [one for one in found if not isinstance(one, str)]
        return numbers if len(numbers) == len(found) else []

    def size(self, unit: str) -> float:
        """Return the typical size on this rig of a parameter of some unit, in SI."""
        if not self._sizes:
            self._sizes = sizes(self.runs)
        as_voltage = (unit_for(unit, VOLTAGE, drive.unit) for drive in DRIVES.values())
        known = next((one for one in as_voltage if one in self._sizes), "1")
        return self._sizes[known]

    def scaled(self, law: str, name: str) -> float:
        """Return a parameter's default brought to the size of this rig, within its bounds."""
        declared = parameter(law, name)
        effect, _, own = name.partition(".") if "." in name else ("", "", "")
        if effect and EFFECTS[effect].of_this_rig():
            return declared.value
        if effect and (numbers := self._numbers(told_by(EFFECTS[effect], own))):
            return float(np.clip(np.mean(numbers), *declared.bounds))
        reference = REFERENCE.get(declared.unit)
        value = declared.value * (self.size(declared.unit) / reference if reference else 1.0)
        return min(max(value, declared.bounds[0]), declared.bounds[1])

    def bench(self, model: Model) -> Bench:
        """Return what predicts a model's force, made once."""
        key = (model.law, model.effects)
        if key not in self._benches:
            self._benches[key] = Bench(model.law, list(model.effects))
        return self._benches[key]

    def predict(self, model: Model, run: Run, draw: int | None = None) -> Array:
        """Return the model's force (n,) [N] for a run, or for one draw of its motion."""
        carrying = self.carrying(model, run)
        if carrying:
            model = replace(model, values={**model.values, **carrying})
        return self._force(model, run, draw)

    def carrying(self, model: Model, run: Run) -> dict[str, float]:
        """Return the start value of the state that carries the load of a run at rest, by name.

        Nothing where the run does not begin so, or no state of the model does.
        """
        if not run.rest:
            return {}
        part = run.of(slice(0, run.rest))
        late = slice(run.rest // 2, None)  # a series element has settled by then

        def settled(start: Mapping[str, float]) -> float:
            begun = replace(model, values={**model.values, **start})
            return float(np.mean(self._force(begun, part)[late]))

        load, stroke = float(np.mean(part.force[late])), float(np.ptp(run.x))
        return start_under_load(carrying_state(model.law, model.effects), load, stroke, settled)

    def _force(self, model: Model, run: Run, draw: int | None = None) -> Array:
        """Return the model's force (n,) [N] for a run, its states beginning as the model says."""
        fed = self.fed(model, run, draw)
        force = self.bench(model).force(*fed.moments, fed.values, fed.tracks)
        return self.shown(model, run, fed, force)

    def fed(self, model: Model, run: Run, draw: int | None = None) -> Fed:
        """Return what a damper's functions are given of a run, or of one draw of its motion.

        Behind the instruments of the velocity, and as early as the force is merely late.
        """
        x, v, a, V, dt = run.smoothed if draw is None else run.drawn(draw)
        v, a = true_motion(model.effects, model.values, v, a, dt)
        own = values_of_labels(model.effects, run.labels)
        late, values = pure_delay(model.effects, {**model.values, **own} if own else model.values)
        if late > 0.0:
            x, v, a, V = earlier((x, v, a, V), late, dt)
        tracks = tracks_of(model.effects, run.extra, run.name)
        if run.finer is not None:
            tracks = {name: between(y, None, dt, run.finer.parts) for name, y in tracks.items()}
        return Fed(Moments(x, v, a, V, dt), values, tracks)

    def shown(self, model: Model, run: Run, fed: Fed, force: Array) -> Array:
        """Return a damper's force at a run's moments as the load cell shows it (n,) [N].

        Parameters
        ----------
        model : with the effects of the load cell
        run : behind whose filter the force is
        fed : what the damper was given
        force : (m,) N
        """
        return run.seen(shown_force(model.effects, fed.values, force, fed.moments.dt))

    def expectation(self, model: Model, draws: int = 12) -> list[tuple[Array, Array, Array]]:
        """Return per run: bias (n,) [N] of the prediction, noise (n,) [N], draws (d, n) [N].

        What a true model would show: its prediction from the smoothed motion is off by `bias` in
        the mean, and scatters about that by `noise`, the force's own and the motion's, with
        `excess` if there is any; `draws` are the motion's part alone. Samples that were not
        measured get a noise of `LOST`.
        """
        return [self._expected(model, run, draws) for run in self.runs]

    @np.errstate(over="ignore", invalid="ignore")  # of a force that is not finite nothing is
    def _expected(self, model: Model, run: Run, draws: int) -> tuple[Array, Array, Array]:
        middle = self.predict(model, run)
        spread = np.array(
            [self.predict(model, run, d) - middle for d in range(min(draws, len(run.draws)))]
        )
        if not len(spread):
            spread = np.zeros((1, len(middle)))
        if run.force_draws is not None:
            spread = spread + run.force_draws[: len(spread)]
        bias = spread.mean(axis=0)
        # A jump that no draw put at this sample may still be here if one put it at the next.
        variance = np.mean((spread - bias) ** 2, axis=0)
        around = np.convolve(variance, _AROUND, "same")
        noise = np.sqrt(run.noise**2 + np.maximum(variance, around) + self.excess)
        if run.measured is not None:
            noise = np.where(run.measured, noise, LOST * noise)
        return bias, noise, spread - bias


def sizes(runs: list[Run]) -> dict[str, float]:
    """Return the typical size of a quantity on a rig by unit, from what was measured."""
    force = _spread([r.force for r in runs])
    x = _spread([r.x - r.x.mean() for r in runs])
    v = _spread([r.v for r in runs])
    a = _spread([r.a for r in runs])
    V = max(max(float(r.V.max()) for r in runs), 1e-9)
    return {
        "N": force, "N/m": force / x, "N/m2": force / x**2, "N/m3": force / x**3, "m": x, "m/s": v,
        "N.s/m": force / v, "N.s2/m2": force / v**2, "kg": force / a, "J": force * x, "V": V,
        "N/V": force / V, "N/(m.V)": force / (x * V), "N.s/(m.V)": force / (v * V),
        "N/V2": force / V**2, "N/(m.V2)": force / (x * V**2), "N.s/(m.V2)": force / (v * V**2),
        "1/m": 1.0 / x,
        "s": 0.05, "1": 1.0, "1/K": 0.01,
    }  # fmt: skip


def _spread(parts: list[Array]) -> float:
    """Return a standard deviation that may be divided by."""
    return max(float(np.std(np.concatenate(parts))), 1e-12)


def absorbed(effect: type[Effect], law: str) -> bool:
    """Return whether a part of a damper's law absorbs entirely what an effect does beside it."""
    return bool(effect.absorbed_by) and LAWS[law].has(effect.absorbed_by)


def of_one_site(model: Model, effects: tuple[str, ...]) -> Model:
    """Return a model with those of its effects that act at one site, by their plain names.

    So the functions of a site name them.
    """
    if not any(AT in name for name in model.effects):
        return replace(model, effects=effects)
    values = {
        plain_name(name): value
        for name, value in model.values.items()
        if "." not in name or name.partition(".")[0] in effects
    }
    return replace(model, effects=tuple(map(plain_name, effects)), values=values)


def without(model: Model, names: tuple[str, ...]) -> Model:
    """Return a model with more parameters held at zero."""
    values = {**model.values, **dict.fromkeys(names, 0.0)}
    fixed = tuple(dict.fromkeys((*model.fixed, *names)))
    return replace(model, values=values, fixed=fixed)


def steady(problem: Problem) -> bool:
    """Return whether the voltage stays where it is over all runs."""
    V = np.concatenate([run.V for run in problem.runs])
    return float(np.std(V)) <= _STEADY * float(np.max(np.abs(V), initial=0.0)) or not np.any(V)
