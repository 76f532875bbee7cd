"""Runs, models, and how a model predicts a run and what it cannot know of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from scipy.ndimage import convolve1d

from ..core.arrays import Array, Flags, Indices
from ..data.channels import Label, Labels
from ..data.corrections import jumps
from ..data.decimate import Finer, between
from ..data.extra_channels import Extra
from ..data.left_out import any_of
from ..errors import RecordError
from ..model.model import Model, parameter
from ..physics.drive import DRIVES, VOLTAGE, unit_for
from ..physics.effect import AT, EFFECTS, Effect, effects_of
from ..physics.laws import LAWS, base_and_variant
from ..user_code.conformance import shown
from .histories import DamperForces, counted
from .run_start import carrying_state, remembering_states, start_in_motion, start_under_load
from .search import HUBER, z_scale

# Instruments that show a channel late or changed: sensor effects inside a fit.
#
# The force that a model predicts is shown through the instrument of the force. Of the velocity the
# instrument's reading is what was measured, so its effect is taken back: the motion that the damper
# felt is the one that the instrument would have shown like that.


LEAST = 0.03
"""Least response, by the largest, that is taken back in full; below, noise would be blown up."""

LEAD = 0.4
"""Time [s] over which a record is led in from rest and out again, so that it may repeat."""


def sensors(effects: tuple[str, ...], channel: str) -> list[type[Effect]]:
    """Return the effects among these that are the instrument of a channel."""
    known = [EFFECTS[name] for name in effects]
    return [effect for effect in known if effect.site == "sensor" and effect.shows == channel]


def own(effect: type[Effect], values: dict[str, float]) -> dict[str, float]:
    """Return the values of an effect's parameters by their own names."""
    begin = effect.name + "."
    return {
        name.removeprefix(begin): value for name, value in values.items() if name.startswith(begin)
    }


def shown_force(
    effects: tuple[str, ...], values: dict[str, float], force: Array, dt: float
) -> Array:
    """Return what the instruments of the force show of it (n,) [N].

    Parameters
    ----------
    effects : names of the effects that are on; those that are no instrument of the force are
        left out
    values : parameters in SI by name, effect.parameter; missing ones take their defaults
    force : (n,) N
    dt : sampling step [s]
    """
    for effect in sensors(effects, "force"):
        force = shown(effect, own(effect, values), force, dt)
    return force


def pure_delay(
    effects: tuple[str, ...], values: dict[str, float]
) -> tuple[float, dict[str, float]]:
    """Return by what time [s] the force is merely late, and the values without that part."""
    total, left = 0.0, values
    for effect in sensors(effects, "force"):
        if effect.late:
            time, share, *_ = (f"{effect.name}.{name}" for name in effect.late)
            known = {f"{effect.name}.{n}": p.value for n, p in effect.parameters.items()} | values
            total += (1.0 - known[share]) * known[time]
            left = {**left, time: known[share] * known[time], share: 1.0}
    return total, left


def earlier(
    motion: tuple[Array, Array, Array, Array], late: float, dt: float
) -> tuple[Array, Array, Array, Array]:
    """Return x, v, a, V (n,) as they were a time `late` [s] before each sample.

    The force at that moment has the jumps of a sign law and of a stepped voltage in full, where the
    force between two samples would smear them. Before the record all is as at its begin.
    """
    whole = int(late / dt)
    rest = late - whole * dt
    x, v, a, V = (_delayed(signal, whole) for signal in motion)
    V_before, a_before = _delayed(V, 1), _delayed(a, 1)
    between = V - (V - V_before) * rest / dt
    V = np.where(jumps(V), V_before, between) if rest > 0.0 else V
    return (
        x - v * rest + 0.5 * a * rest**2,
        v - a * rest,
        a - (a - a_before) * rest / dt,
        V,
    )


def _delayed(signal: Array, count: int) -> Array:
    """Return a signal (n,) shifted by a number of samples, its first value held."""
    if count == 0:
        return signal
    return np.concatenate([np.full(min(count, len(signal)), signal[0]), signal[:-count]])


def true_motion(
    effects: tuple[str, ...], values: dict[str, float], v: Array, a: Array, dt: float
) -> tuple[Array, Array]:
    """Return the velocity and acceleration (n,) [m/s, m/s2] behind those of a velocity channel.

    Parameters
    ----------
    effects : names of the effects that are on; those that are no instrument of the velocity are
        left out
    values : parameters in SI by name, effect.parameter; missing ones take their defaults
    v, a : (n,) m/s, m/s2, as the instrument shows them
    dt : sampling step [s]
    """
    for effect in sensors(effects, "velocity"):
        there = own(effect, values)
        v, a = taken_back(effect, there, v, dt), taken_back(effect, there, a, dt)
    return v, a


def taken_back(effect: type[Effect], values: dict[str, float], reading: Array, dt: float) -> Array:
    """Return the signal (n,) that an instrument shows as this reading.

    The instrument's response to a single pulse is divided out in the frequency domain; where it
    answers with less than `LEAST` of its most, only in part (Tikhonov).

    Parameters
    ----------
    effect : Effect of the site "sensor"
    values : parameters of the effect by their own names ("gain"), in SI; missing ones default
    reading : (n,) in the channel's unit
    dt : sampling step [s]
    """
    n = len(reading)
    lead = max(8, round(LEAD / dt))
    fade = 0.5 - 0.5 * np.cos(np.pi * (np.arange(lead) + 0.5) / lead)
    padded = np.concatenate([fade * reading[0], reading, fade[::-1] * reading[-1]])
    size = 1 << int(np.ceil(np.log2(len(padded) + lead)))
    pulse = np.zeros(size)
    pulse[1] = 1.0  # not in the first sample, with which some states start
    response = np.fft.rfft(np.roll(shown(effect, values, pulse, dt), -1))
    power = np.abs(response) ** 2
    inverse = np.conj(response) / (power + LEAST**2 * power.max())
    inverse *= 1.0 + LEAST**2  # so that the strongest response is divided out in full
    spectrum = np.fft.rfft(padded, size) * inverse
    back: Array = np.fft.irfft(spectrum, size)[lead : lead + n]
    return back


# Parameters of effects that are known of each run: its temperature, a pressure at each sample.


def values_of_labels(effects: Iterable[str], labels: Labels) -> dict[str, float]:
    """Return the values of effects that are labels of a run, by the names of a model."""
    known = {
        f"{name}.{own}": number_of(EFFECTS[name], label, labels[label])
        for name in effects
        for own, label in EFFECTS[name].labels.items()
        if label in labels
    }
    return {name: value for name, value in known.items() if value is not None}


def number_of(effect: type[Effect], label: str, value: Label) -> float | None:
    """Return a label as an effect counts it: a number, or its word's place from 1 on; None else.

    Raises
    ------
    RecordError
        If it is a word that the effect does not know.
    """
    if not isinstance(value, str):
        return value
    words = effect.label_words.get(label, ())
    if words and value not in words:
        raise RecordError(
            f'{label} is "{value}" in a run, and the effect {effect.name} knows '
            f"{', '.join(words)} alone. Leave the run out, or the effect."
        )
    return words.index(value) + 1.0 if words else None


def tracks_of(effects: Iterable[str], extra: Mapping[str, Extra], run: str) -> dict[str, Array]:
    """Return the values (n,) over a run of parameters that follow its channels, by name.

    Parameters
    ----------
    effects : of a model
    extra : the run's channels besides those that bristle knows
    run : its name, for messages

    Raises
    ------
    RecordError
        If the run lacks a channel, or has it in another unit.
    """
    out = {}
    for key, channel in following(effects).items():
        name, _, own = key.partition(".")
        if channel not in extra:
            raise RecordError(
                f"{run}: the effect {name} follows the channel {channel}, which this run does not "
                "hold: [extra] in study.toml names the column. Leave the run out, or the effect."
            )
        unit = EFFECTS[name].parameters[own].unit
        if extra[channel].known_unit != unit:
            raise RecordError(
                f"{run}: {channel} is in {extra[channel].unit}, and the effect {name} follows it "
                f"in {unit}: the unit in [extra.{channel}] of study.toml has changed."
            )
        out[key] = extra[channel].values
    return out


def at_means(measured: Sequence[Mapping[str, Extra]], count: int) -> dict[str, Extra]:
    """Return the extra channels that all runs have, at their mean, for a run that was not measured.

    Parameters
    ----------
    measured : those of each measured run
    count : samples of the other run
    """
    out = {}
    for name, one in measured[0].items():
        if all(name in run for run in measured):
            mean = float(np.mean([np.mean(run[name].values) for run in measured]))
            out[name] = Extra(np.full(count, mean), one.unit)
    return out


def following(effects: Iterable[str]) -> dict[str, str]:
    """Return the parameters of a model's effects that follow a channel, with the channel's name."""
    return {
        f"{name}.{own}": channel
        for name in effects
        for own, channel in EFFECTS[name].channels.items()
    }


_AROUND = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0

_STEADY = 1e-2  # of its level: what a voltage varies by without telling anything

LOST = 1e4
"""Noise of a sample that was not measured, in noises of the force: it has no say."""

REFERENCE = {
    "N": 4.0, "N/m": 800.0, "N/m2": 1.6e5, "N/m3": 3.2e7, "m": 5e-3, "m/s": 0.07, "N.s/m": 57.0,
    "N.s2/m2": 816.0, "kg": 2.7, "J": 0.02, "V": 5.0,
}  # fmt: skip
"""Typical sizes on the rig of 10 N for which the effects' defaults are written."""


KEPT = 4_000_000
"""Numbers drawn of a model's noise that are kept, for models that are asked for again."""


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


_held_starts: ContextVar[dict[int, dict[str, float]] | None] = ContextVar("starts", default=None)


@contextmanager
def _held(starts: dict[int, dict[str, float]]) -> Iterator[None]:
    """Hold in this context what runs begin with, by their identity."""
    before = _held_starts.set(starts)
    try:
        yield
    finally:
        _held_starts.reset(before)


@dataclass(frozen=True)
class Run:
    """A measured run, its motion smoothed.

    `x`, `v`, `a`, `V`, `force` (n,) in SI, evenly spaced by `dt` [s]; `noise` the force channel's
    standard deviation [N]; `draws` (d, n, 4) draws of the error of x, v, a, V; `left_out` why
    samples say nothing, by reason (n,) True where that holds. `drive` is the channel that V holds,
    in its own unit; `labels` what is known of the whole run, such as a temperature; `rest` how many
    samples at its begin the damper rests under load, `opening` in how many a damper that begins in
    motion remembers what was before, 0 where it begins otherwise; `extra` its channels
    besides those that bristle knows; `force_draws` (d, n) [N] draws of the error of a force that
    was not measured and follows from the motion, beside `noise` and each with its draw of `draws`;
    `finer` how models are evaluated between the samples of a decimated or slow run, None for
    others; `untold` names the channels of the force whose noise cannot be told from their signal:
    `noise` is then a lower limit; `pulse` (2 k + 1,) is what a force that was not measured shows
    of a pulse, None where it shows all.
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
    left_out: Mapping[str, Flags] = field(default_factory=dict)
    drive: str = "voltage"
    labels: Mapping[str, Label] = field(default_factory=dict)
    rest: int = 0
    opening: int = 0
    extra: Mapping[str, Extra] = field(default_factory=dict)
    force_draws: Array | None = None
    finer: Finer | None = None
    untold: tuple[str, ...] = ()
    pulse: Array | None = None

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
        force = force if self.finer is None else self.finer.filtered(force)
        return force if self.pulse is None else convolve1d(force, self.pulse, mode="nearest")

    @cached_property
    def whole_noise(self) -> float:
        """The standard deviation of the force's noise [N], with that of its draws."""
        drawn = 0.0 if self.force_draws is None else float(np.sqrt(np.mean(self.force_draws**2)))
        return float(np.hypot(self.noise, drawn))

    @cached_property
    def measured(self) -> Flags | None:
        """Which samples (n,) say something, None where all do."""
        out = any_of(self.left_out)
        return None if out is None else ~out

    @property
    def judged(self) -> Flags:
        """Which of the samples after `skip` were measured (n - skip,)."""
        if self.measured is None:
            return np.ones(max(0, len(self.force) - self.skip), dtype=bool)
        return self.measured[self.skip :]

    def of(self, part: slice) -> Self:
        """Return the run with these of its samples; `dt` and `skip` stay what they were.

        Where some between are left out, nothing is known between samples.
        """
        dense = part.step in (None, 1)
        rest, opening = (
            0 if part.start else len(range(one)[part]) for one in (self.rest, self.opening)
        )
        return replace(
            self, rest=rest, opening=opening, x=self.x[part], v=self.v[part], a=self.a[part],
            V=self.V[part], force=self.force[part], draws=self.draws[:, part],
            left_out={reason: where[part] for reason, where in self.left_out.items()},
            force_draws=None if self.force_draws is None else self.force_draws[:, part],
            extra={name: one.of(part) for name, one in self.extra.items()},
            finer=self.finer.of(part) if self.finer and dense else None,
        )  # fmt: skip

    @property
    def remembered(self) -> tuple[Run, Indices | slice]:
        """The run with all samples that models with memory go through, and which of them count."""
        return self, slice(None)

    @cached_property
    def begun(self) -> Self:
        """The samples that tell how the run began."""
        return self.of(slice(0, self.rest or self.opening))

    def first(self, seconds: float) -> Self:
        """Return the first so many seconds of the run, or all of it."""
        count = max(4 * self.skip, round(seconds / self.dt))
        return self.of(slice(count)) if count < len(self.force) else self

    def coarser(self, parts: int) -> Self:
        """Return the run with models evaluated at so many moments per sample at the most."""
        if self.finer is None or self.finer.parts <= parts:
            return self
        return replace(self, finer=self.finer.cut(parts))

    def every(self, count: int) -> Self:
        """Return the run with one of so many samples, for what has no memory."""
        part = self.of(slice(None, None, count))
        return replace(part, dt=self.dt * count, skip=-(-self.skip // count))

    def entire(self) -> Run:
        """Return the run with all its samples, whatever a fit takes of them."""
        return self


class Problem:
    """Runs held against a model: predictions, and the noise that a true model would show."""

    free_zero = False
    """Whether the force's zero is fitted along with every model; see `zero_of`."""

    zero = 0.0
    """About what that zero is [N]: states that carry the force at a run's start do without it."""

    excess = 0.0
    """Variance [N2] of what no model here explains, beside the noise; see `excess_of`."""

    reconstructed = False
    """Whether the force is a result of equilibrium, not measured."""

    shaken = False
    """Whether the ground makes the motion: each run then has a largest one of its own."""

    def __init__(self, runs: list[Run]) -> None:
        self.runs = runs
        self._benches: dict[tuple[Any, ...], DamperForces] = {}
        self._drawn: dict[tuple[Any, ...], Expected] = {}
        self._sizes: dict[str, float] = {}

    @property
    def force(self) -> Array:
        """The force (n,) [N] at the samples that residuals have, one run after the other."""
        return np.concatenate([run.force[run.skip :] for run in self.runs])

    @property
    def judged(self) -> Flags:
        """Which of these samples (n,) were measured."""
        return np.concatenate([run.judged for run in self.runs])

    @property
    def noise_known(self) -> bool:
        """Whether the force's noise is known in most runs, so that z says something."""
        return 2 * sum(not run.untold for run in self.runs) >= len(self.runs)

    @property
    def joined_with_layer(self) -> bool:
        """Whether the force is that of the damper and the isolation layer together."""
        return False

    def of(self, runs: list[Run]) -> Problem:
        """Return a problem of the same kind for other runs, such as a part of these."""
        made = self._made_of(runs)
        made.free_zero, made.zero = self.free_zero, self.zero
        made.excess, made._benches = self.excess, self._benches
        return made

    def _made_of(self, runs: list[Run]) -> Problem:
        return Problem(runs)

    def by_run(self, values: Array) -> list[Array]:
        """Return what all samples behind the runs' starts have (n, ...) as one part per run."""
        ends = np.cumsum([len(run.force) - run.skip for run in self.runs])[:-1]
        return np.split(values, ends)

    def planned(self, runs: list[Run]) -> Problem:
        """Return a problem for runs that were not measured yet: this rig's sizes are theirs.

        So are the means of its extra channels.
        """
        own = [run.extra for run in self.runs]
        made = self.of([replace(run, extra=at_means(own, len(run.x))) for run in runs])
        self.size("N")
        made._sizes = self._sizes
        return made

    def fits_zero(self, model: Model) -> bool:
        """Return whether the zero of the force is fitted along with a model."""
        return self.free_zero and not has_offset(model)

    def without_zero(self, force: Array, model: Model) -> Array:
        """Return a measured force [N] as a model is to carry it, about free of the zero."""
        return force - self.zero if self.fits_zero(model) else force

    def with_free_zero(self, zero: float = 0.0) -> Problem:
        """Return the same runs with the force's zero, about `zero` [N], fitted along."""
        made = self.of(self.runs)
        made.free_zero, made.zero = True, zero
        return made

    def with_excess(self, excess: float) -> Problem:
        """Return the same runs, what no model explains counted as variance [N2] beside the noise.

        The same for all samples, so that fits and losses weigh them nearly alike where it is large.
        """
        if excess == self.excess:
            return self
        made = self.of(self.runs)
        made.excess = excess
        made._sizes = self._sizes
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
        known = [self._numbers(name, effect) for name in names]
        return all(len({*one}) > 1 and max(one) - min(one) >= effect.label_span for one in known)

    def _moves(self, channel: str) -> bool:
        """Return whether all runs have an extra channel, and it varies in them."""
        if not self.runs or not all(channel in run.extra for run in self.runs):
            return False
        values = np.concatenate([run.extra[channel].values for run in self.runs])
        return float(np.ptp(values)) > 0.0

    def _numbers(self, label: str, effect: type[Effect]) -> list[float]:
        """Return the numbers of a label, one per run; none where a run lacks it."""
        known = [number_of(effect, label, r.labels[label]) for r in self.runs if label in r.labels]
        numbers = [one for one in known if one is not None]
        return numbers if len(numbers) == len(self.runs) else []

    def size(self, unit: str) -> float:
        """Return the typical size on this rig of a parameter of some unit, in SI."""
        if not self._sizes:
            self._sizes = sizes(self.runs)
        as_voltage = (unit_for(unit, VOLTAGE, drive.unit) for drive in DRIVES.values())
        known = next((one for one in as_voltage if one in self._sizes), "1")
        return self._sizes[known]

    def at_size(self, law: str, effects: Iterable[str]) -> dict[str, float]:
        """Return the parameters of effects beside a law at the size of this rig, see `scaled`."""
        names = [f"{effect}.{own}" for effect in effects for own in EFFECTS[effect].parameters]
        return {name: self.scaled(law, name) for name in names}

    def scaled(self, law: str, name: str) -> float:
        """Return a parameter's default brought to the size of this rig, within its bounds."""
        declared = parameter(law, name)
        key, dot, own = name.partition(".")
        if dot:
            effect = EFFECTS[key]
            if effect.of_this_rig():
                return declared.value
            label = effect.labels.get(own) or effect.label_means.get(own, "")
            if numbers := self._numbers(label, effect):
                return float(np.clip(np.mean(numbers), *declared.bounds))
        reference = REFERENCE.get(declared.unit)
        value = declared.value * (self.size(declared.unit) / reference if reference else 1.0)
        return min(max(value, declared.bounds[0]), declared.bounds[1])

    def bench(self, model: Model) -> DamperForces:
        """Return what predicts a model's force, made once."""
        key = _kind(model)
        if key not in self._benches:
            self._benches[key] = DamperForces(model.base_law, list(model.effects))
        return self._benches[key]

    def predict(self, model: Model, run: Run, draw: int | None = None) -> Array:
        """Return the model's force (n,) [N] for a run, or for one draw of its motion."""
        if carrying := self.carrying(model, run):
            model = replace(model, values={**model.values, **carrying})
        return self._force(model, run, draw)

    def steps_of(self, model: Model) -> float:
        """Return the steps of one simulation of all runs, see `histories.Effort`."""
        with counted() as once:
            for run in self.runs:
                self.predict(model, run)
        return once.steps

    @contextmanager
    def starts_held(self, model: Model, runs: Sequence[Run]) -> Iterator[None]:
        """Hold in this context what runs that begin in motion begin with, as it is for a model.

        For derivatives by the parameters: where the starts lower the error the most, it changes
        with them no further.
        """
        with _held({id(run): self.carrying(model, run) for run in runs if run.opening}):
            yield

    @contextmanager
    def begun_at_rest(self) -> Iterator[None]:
        """Let runs that begin in motion begin in this context with nothing held."""
        with _held({id(run): {} for run in self.runs if run.opening}):
            yield

    def carrying(self, model: Model, run: Run) -> dict[str, float]:
        """Return the start values of the states that carry the force of a run's start, by name.

        Nothing where the run sets out from rest without a load, or no state of the model holds one.
        """
        if not (run.rest or run.opening):
            return {}
        if (held := _held_starts.get()) is not None and id(run) in held:
            return held[id(run)]
        part, stroke = run.begun, float(np.ptp(run.x))
        seen = self.without_zero(part.force, model)

        def begun(start: Mapping[str, float]) -> Array:
            return self._force(replace(model, values={**model.values, **start}), part)

        if run.rest:
            load = float(np.mean(seen[run.rest // 2 :]))
            return start_under_load(
                carrying_state(model.base_law, model.effects), load, stroke, begun
            )
        states = remembering_states(model.base_law, model.effects)
        force = seen if part.measured is None else np.where(part.measured, seen, np.nan)
        return start_in_motion(states, force, stroke, begun) if states else {}

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
        key = (*_kind(model), model.law, draws, *sorted(model.values.items()))
        if (found := self._drawn.get(key)) is None:
            found = [self._expected(model, run, draws) for run in self.runs]
            size = draws * sum(len(run.force) for run in self.runs)
            if len(self._drawn) >= KEPT // max(size, 1):
                self._drawn.clear()
            if size <= KEPT:
                self._drawn[key] = found
        return found

    @np.errstate(over="ignore", invalid="ignore")  # of a force that is not finite nothing is
    def _expected(self, model: Model, run: Run, draws: int) -> tuple[Array, Array, Array]:
        with self.starts_held(model, [run]):
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


def _kind(model: Model) -> tuple[Any, ...]:
    """Return law and effects of a model by their classes.

    Another effect may have the name of one that was learned before.
    """
    return (LAWS[model.base_law], *(EFFECTS.get(name, name) for name in model.effects))


def sizes(runs: list[Run]) -> dict[str, float]:
    """Return the typical size of a quantity on a rig by unit, from what was measured."""
    force = _spread([r.force for r in runs])
    x = _spread([r.x - r.x.mean() for r in runs])
    # Powers of a displacement count from the zero of its sensor, which may be many strokes away.
    far = max(x, *(abs(float(r.x.mean())) for r in runs))
    v = _spread([r.v for r in runs])
    a = _spread([r.a for r in runs])
    V = max(max(float(r.V.max()) for r in runs), 1e-9)
    return {
        "N": force, "N/m": force / x, "N/m2": force / far**2, "N/m3": force / far**3, "m": x,
        "m/s": v,
        "N.s/m": force / v, "N.s2/m2": force / v**2, "kg": force / a, "J": force * x, "V": V,
        "N/V": force / V, "N/(m.V)": force / (x * V), "N.s/(m.V)": force / (v * V),
        "N/V2": force / V**2, "N/(m.V2)": force / (x * V**2), "N.s/(m.V2)": force / (v * V**2),
        "1/m": 1.0 / x, "m/N": x / force,
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
        return replace(model, effects=effects)  # what is given of others does no harm
    return model.only(effects).by_plain_names()


def without(model: Model, names: tuple[str, ...]) -> Model:
    """Return a model with more parameters held: at zero, where they may be."""
    kept = {name: model.value(name) for name in names if model.bounds(name)[0] > 0.0}
    values = {**model.values, **dict.fromkeys(names, 0.0), **kept}
    fixed = tuple(dict.fromkeys((*model.fixed, *names)))
    return replace(model, values=values, fixed=fixed)


def uncommanded(problem: Problem) -> bool:
    """Return whether nothing commands the damper: no command was recorded, or it is always zero."""
    return not any(np.any(run.V) for run in problem.runs)


def moved_by(problem: Problem) -> str:
    """Return the words for what acts on the damper: its motion, and its command if it has one."""
    return "motion" if uncommanded(problem) else f"motion and the {problem.runs[0].drive}"


def suited(problem: Problem, laws: Sequence[str]) -> tuple[str, ...]:
    """Return those of some laws, by name, that are tried on runs where nobody names one.

    All where nothing commands the damper; else those of the library that have a command, and a
    user's own.
    """
    if uncommanded(problem):
        return tuple(laws)
    kinds = {name: base_and_variant(name)[0] for name in laws}
    return tuple(name for name, law in kinds.items() if law.has("command") or law.base.own)


def steady(problem: Problem) -> bool:
    """Return whether the voltage stays where it is over all runs."""
    V = np.concatenate([run.V for run in problem.runs])
    return float(np.std(V)) <= _STEADY * float(np.max(np.abs(V), initial=0.0)) or not np.any(V)


# The residual of a model on measured runs, in units of the noise that a true model would show.
#
# Fits minimise it, comparisons look for patterns in it, diagnoses decide by it: so it is written
# once, here.

Expected = list[tuple[Array, Array, Array]]
"""Per run: bias (n,) and noise (n,) expected of a true model's residual, and draws (d, n) of it."""

BLOCK = 250
"""Samples, longer than a residual's correlation."""

PASSES = 5
"""Weighted means until the constant of a residual has settled."""

EXPLAINS = 1.2
"""z up to which a model explains the runs: what it leaves counts as noise."""

FAR = 10.0
"""Robust standard deviations up to which errors count in the variance of what a model misses."""

FINITE = 1e6
"""What counts as the normalised residual where a prediction is not finite."""


def over_noise(error: Array, sigma: Array) -> Array:
    """Return an error (n,) over the noise expected of a true model (n,), always finite."""
    z: Array = error / sigma
    if np.isfinite(z).all():  # the rule, and the rest takes five times as long
        return z
    return np.asarray(np.nan_to_num(z, nan=FINITE, posinf=FINITE, neginf=-FINITE))


def errors(problem: Problem, model: Model, expected: Expected) -> list[Array]:
    """Return per run the error (n - skip,) [N]: measured less predicted, less the expected bias.

    Where the force's zero is fitted along, less that zero as well; a model that has a constant
    force of its own has none besides.
    """
    found = _with_zero(problem, model, expected)
    if not problem.fits_zero(model):
        return found
    zero = _constant(problem, found, expected)
    return [error - zero for error in found]


def _with_zero(problem: Problem, model: Model, expected: Expected) -> list[Array]:
    """Return per run the error (n - skip,) [N], the zero of the force still in it."""
    return [
        (run.force - problem.predict(model, run) - bias)[run.skip :]
        for run, (bias, _, _) in zip(problem.runs, expected, strict=True)
    ]


def noise_of(problem: Problem, expected: Expected) -> Array:
    """Return the noise (n,) expected of a true model's residual, one run after the other."""
    pairs = zip(problem.runs, expected, strict=True)
    return np.concatenate([sigma[run.skip :] for run, (_, sigma, _) in pairs])


def has_offset(model: Model) -> bool:
    """Return whether a model's law or an effect has a constant force that a fit moves."""
    own = model.law_class.offset
    effects = [(name, EFFECTS[name].offset) for name in model.effects]
    constants = [own] * bool(own) + [f"{name}.{offset}" for name, offset in effects if offset]
    return any(name not in model.fixed for name in constants)


def zero_of(
    problem: Problem, model: Model, expected: Expected | None = None
) -> tuple[float, float]:
    """Return the constant [N] by which the force is above a model's, and its standard deviation.

    It is that of Huber's loss over all runs; the deviation is from the scatter of blocks.

    Parameters
    ----------
    problem, model : the runs and what predicts them
    expected : what a true model would show on each run; None draws it for this model
    """
    expected = expected or problem.expectation(model)
    found = _with_zero(problem, model, expected)
    zero = _constant(problem, found, expected)
    weight = noise_of(problem, expected) ** -2.0
    left = (np.concatenate(found) - zero) * weight
    edges = np.arange(0, len(left), min(BLOCK, max(1, len(left) // 20)))
    return zero, float(np.sqrt(np.sum(np.add.reduceat(left, edges) ** 2)) / weight.sum())


def _constant(problem: Problem, found: list[Array], expected: Expected) -> float:
    """Return the constant of errors per run (n - skip,) [N] by weighted Huber means."""
    error, sigma = np.concatenate(found), noise_of(problem, expected)
    finite = np.isfinite(error)
    error, base = error[finite], sigma[finite] ** -2.0
    if not len(error):
        return 0.0
    zero, weight = 0.0, base
    for turn in range(PASSES):
        zero = float(np.dot(weight, error) / weight.sum())
        z = np.abs(error - zero) * np.sqrt(base)
        if turn == 0:  # held from then on, so that the constant is smooth in the parameters
            spread = max(1.0, float(np.median(z)) / 0.6745)
        weight = base * np.minimum(1.0, HUBER * spread / np.maximum(z, 1e-300))
    return zero


def residuals(problem: Problem, model: Model, expected: Expected) -> Array:
    """Return the normalised residuals (n,) of all runs, one run after the other.

    That of a sample that was not measured is 0.
    """
    parts = []
    for error, run, (_, sigma, _) in zip(
        errors(problem, model, expected), problem.runs, expected, strict=True
    ):
        z = over_noise(error, sigma[run.skip :])
        parts.append(z if run.measured is None else np.where(run.judged, z, 0.0))
    return np.concatenate(parts)


def robust_z(problem: Problem, model: Model, expected: Expected | None = None) -> float:
    """Return z, the robust RMS of residual over expected noise: 1 for a true model."""
    expected = expected or problem.expectation(model)
    return z_scale(in_noises(problem, residuals(problem, model, expected), expected))


def z_if_known(problem: Problem, model: Model) -> float:
    """Return z of a model, NaN where the noise is not known and z says nothing."""
    return robust_z(problem, model) if problem.noise_known else float("nan")


@np.errstate(invalid="ignore")  # of a force that is not finite nothing is
def in_noises(problem: Problem, r: Array, expected: Expected) -> Array:
    """Return normalised residuals (n,) over the noise alone, without the problem's excess.

    Parameters
    ----------
    problem : the runs
    r : normalised residuals (n,) of a model on them
    expected : what they were divided by
    """
    if not problem.excess:
        return r
    sigma = noise_of(problem, expected)
    return np.asarray(r * sigma / np.sqrt(sigma**2 - problem.excess))


def excess_of(problem: Problem, model: Model) -> float:
    """Return the variance [N2] of what a fitted model misses, beside the noise; 0 up to `EXPLAINS`.

    Noise says how much a sample tells of a true model. Of a model that misses many times the noise
    it says nothing: a fit by noise alone follows the quiet samples and runs, and counts all others
    by their absolute error. The variance is that of the error, those far out bounded; it grows from
    0 with z.
    """
    expected = problem.expectation(model)
    z = robust_z(problem, model, expected)
    if not z > EXPLAINS:
        return 0.0
    pairs = zip(errors(problem, model, expected), problem.runs, strict=True)
    left = np.abs(np.concatenate([error[run.judged] for error, run in pairs]))
    most = FAR * float(np.median(left)) / 0.6745
    return float((1.0 - (EXPLAINS / z) ** 2) * np.mean(np.minimum(left, most) ** 2))


def drawn_noise(problem: Problem, expected: Expected) -> tuple[Array, Array]:
    """Return a true model's noise as residuals have it, divided by what is expected of it.

    Parameters
    ----------
    problem : the runs
    expected : what a true model would show on each run; see `Problem.expectation`

    Returns
    -------
    (n,) standard deviation of the force's own noise; (d, n) draws of the motion's
    """
    pairs = list(zip(problem.runs, expected, strict=True))
    own = np.concatenate([run.noise / e[1][run.skip :] for run, e in pairs])
    count = min(len(spread) for _, _, spread in expected)
    drawn = [
        np.concatenate([e[2][d][run.skip :] / e[1][run.skip :] for run, e in pairs])
        for d in range(count)
    ]
    return own, np.array(drawn).reshape(count, len(own))
