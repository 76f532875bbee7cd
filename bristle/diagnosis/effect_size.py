"""One number for an effect's size: the size that is named, that runs allow, that they resolve.

What the model's own parameters can absorb of a change is left out by their sensitivities.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np

from ..core.arrays import Array
from ..data.corrections import jumps
from ..identification.fit import Search
from ..identification.problem import BLOCK, Expected, Problem, drawn_noise, noise_of, residuals
from ..identification.search import HUBER, losses, mean_loss
from ..identification.start_grid import initial_guesses
from ..model.model import Model
from ..physics.drive import DRIVES, unit_for
from ..physics.effect import EFFECTS
from .rule import BENCH, DecisionRule

KEPT = 8
"""Changes of an effect that are kept, for sizes that are asked for again."""

FEW = 4
"""Draws of the motion's error from which the noise on the runs that decide is taken."""

IN_PROPORTION = 1e-6
"""What a change may be off, of its largest, to be in proportion to the size."""

REFITS = 10
"""Steps of a robust fit of the model's own parameters, at most."""

SETTLED = 0.05
"""Fall of twice the logarithm of the likelihood that a further step is not taken for."""

TOLD = 1e-3
"""Size of a direction, over the largest, in which the runs tell the model's parameters."""

IDLE = 1e-9
"""What a parameter changes, over the one that changes most, below which it is rounding."""

NEAR = 1.0
"""Change of a parameter's logarithm beyond which its sensitivity says little of what it does."""

SMALL = 0.02
"""Change of a parameter's logarithm that is in proportion to its sensitivity."""


@dataclass(frozen=True)
class SizeSearch:
    """What all limits of some runs are found with: the model's residuals and sensitivities.

    `names` of the model's free parameters; `held_out` how many samples decide a verdict; `judging`
    the runs that these are of, None where a sample of them is taken to be like one of the others.
    """

    problem: Problem
    model: Model
    expected: Expected
    held_out: int
    rule: DecisionRule = BENCH
    judging: Problem | None = None

    @cached_property
    def expected_there(self) -> Expected:
        """What a true model would show on the runs that decide."""
        assert self.judging is not None
        return self.judging.expectation(self.model, FEW)

    @cached_property
    def search(self) -> Search:
        """The model with its free parameters."""
        return Search(self.problem, self.model, self.expected, self.model.free())

    @cached_property
    def left(self) -> Array:
        """The normalised residuals (n,) of the model, those far out clipped."""
        return np.clip(self.plain, -HUBER, HUBER)

    @cached_property
    def counts(self) -> Array:
        """1 for each sample (n,), 0 where the command jumps: no clock says on which side it is."""
        return _counted_in(self.problem)

    @cached_property
    def plain(self) -> Array:
        """The normalised residuals (n,) of the model as they are, of the samples that count."""
        return self.counts * self.search.residuals(self.search.start)

    @cached_property
    def _scaled(self) -> tuple[Array, Array]:
        """What the model's own parameters change (n, p), each column of length one; its length.

        A parameter that changes nothing has a column of zeros, of infinite length: it stays.
        """
        if not self.search.names:
            return np.zeros((len(self.plain), 0)), np.zeros(0)
        columns: Array = self.counts[:, None] * self.search.sensitivities()
        lengths = np.linalg.norm(columns, axis=0)
        lengths[lengths <= IDLE * lengths.max()] = np.inf
        return columns / lengths, lengths

    @property
    def own(self) -> Array:
        """What the model's own parameters change (n, p), each column of length one."""
        return self._scaled[0]

    @cached_property
    def taken(self) -> Array:
        """What of a change (n,) the model's own parameters absorb (p, n), by least squares."""
        return np.asarray(np.linalg.pinv(self.own, rcond=TOLD), dtype=float)

    @cached_property
    def basis(self) -> Array:
        """Orthonormal columns (n, p) that span what the model's own parameters change."""
        return np.linalg.qr(self.own[:, np.isfinite(self._scaled[1])])[0]

    @cached_property
    def noise(self) -> tuple[Array, Array]:
        """The force's own noise (n,) and draws (d, n) of the motion's, as residuals have them."""
        own, drawn = drawn_noise(self.problem, self.expected)
        return self.counts * own, self.counts * drawn

    @cached_property
    def size(self) -> float:
        """The norm of the normalised force."""
        return float(np.linalg.norm(self.problem.force / noise_of(self.problem, self.expected)))

    def beyond(self, change: Array) -> Array:
        """Return what of a change (n,) the model's own parameters do not absorb."""
        kept: Array = change - self.basis @ (self.basis.T @ change)
        return kept

    def refitted(self, left: Array) -> Array:
        """Return normalised residuals (n,) after a fit of the model's own parameters to them.

        A robust fit, as that of the model is: the force jumps where a sign law turns, by a hundred
        times the noise, and least squares would bend the whole model after those few samples.
        """
        for _ in range(REFITS):
            pull = self.basis.T @ np.clip(left, -HUBER, HUBER)
            weight = np.minimum(1.0, HUBER / np.maximum(np.abs(left), HUBER))
            if not pull.size or float(pull @ pull) <= SETTLED * float(np.mean(weight)):
                break
            normal = (self.basis * weight[:, None]).T @ self.basis
            left = left - self.basis @ np.linalg.lstsq(normal, pull, rcond=TOLD)[0]
        return left

    @cached_property
    def lowest(self) -> float:
        """The robust loss of the model as it is."""
        return float(np.sum(losses(self.refitted(self.plain))))

    def moved(self, change: Array) -> tuple[tuple[str, float], ...]:
        """Return by how much [SI] a fit moves the model's own parameters to absorb a change (n,).

        A parameter that the runs hardly tell would have to move beyond what its sensitivity says:
        it stays, and the others absorb what they can.

        Parameters
        ----------
        change : of the normalised residuals
        """
        stay = np.zeros(len(self.search.start), bool)
        steps = self.steps(change)
        while (far := np.where(self.search.log, np.abs(steps), 0.0)).max(initial=0.0) > NEAR:
            stay[np.argmax(far)] = True
            taken = np.linalg.pinv(self.own[:, ~stay], rcond=TOLD) @ change
            steps = np.zeros(len(stay))
            steps[~stay] = -taken / self._scaled[1][~stay]
        there = self.stepped(steps)
        return tuple((n, there.value(n) - self.model.value(n)) for n in self.search.names)

    def steps(self, change: Array) -> Array:
        """Return the steps (p,) of the search that take up a change (n,), by least squares."""
        steps: Array = -(self.taken @ change) / self._scaled[1]
        return steps

    def stepped(self, steps: Array) -> Model:
        """Return the model with its own parameters moved by steps (p,) within their bounds."""
        search = self.search
        return search.at(np.clip(search.start + steps, search.low, search.high))

    def scatter(self, direction: Array) -> float:
        """Return the standard deviation of a direction's (n,) product with the residual."""
        size = mean_loss(np.minimum(self.plain**2, HUBER**2))
        if self.problem.excess or size > self.rule.misfit**2:
            sums = np.add.reduceat(direction * self.left, np.arange(0, len(direction), BLOCK))
            return float(np.linalg.norm(sums))
        own, drawn = self.noise
        moved = np.clip(drawn, -HUBER, HUBER) @ direction
        more = float(np.var(moved, ddof=1)) if len(moved) > 1 else 0.0
        return sqrt(float(np.sum((direction * own) ** 2)) + more)


class Sized:
    """An effect in a model with one number for its size: 1 is that of a first guess, 0 is none."""

    def __init__(self, name: str, known: SizeSearch) -> None:
        effect, self.known = EFFECTS[name], known
        self.name, self.parameter = name, effect.amount.removeprefix("1/")
        self.falls = effect.amount.startswith("1/")
        self.key = f"{name}.{self.parameter}"
        self.model = _first_guess(name, known.model, known.problem)
        self.one = self.model.value(self.key)
        self.low, self.high = self.model.bounds(self.key)
        self.signed = self.low < 0.0 and not self.falls
        self._without = self._counted(self.without())
        self._changes: dict[float, Array] = {}
        self._first: tuple[float, Array] | None = None
        self._straight = (0.0, 0.0)

    @property
    def unit(self) -> str:
        """Return the parameter's unit with the command of the runs: A, not V, with a current."""
        drive = DRIVES[self.known.problem.runs[0].drive]
        return unit_for(EFFECTS[self.name].parameters[self.parameter].unit, drive)

    def value(self, size: float) -> float:
        """Return the parameter's value [SI] at a size, within its bounds."""
        return float(np.clip(self._wanted(size), self.low, self.high))

    def size_of(self, value: float) -> float:
        """Return the size at which the parameter has a value [SI]."""
        return self.one / value if self.falls else value / self.one

    def change(self, size: float) -> Array:
        """Return by how much the effect changes the normalised residuals (n,) at a size."""
        value = self.value(size)
        if value not in self._changes:
            if len(self._changes) == KEPT:
                del self._changes[next(iter(self._changes))]
            self._changes[value] = self._changed(value)
        return self._changes[value]

    def _changed(self, value: float) -> Array:
        """Return the change (n,) at a value of the parameter [SI].

        Between none and values at which it was found in proportion to the first, it is.
        """
        low, high = self._straight
        if self._first is not None and low <= value <= high:
            return self._first[1] * (value / self._first[0])
        found: Array = self._counted(self.with_value(value)) - self._without
        if self._first is None:
            self._first = value, found
        elif self._first is not None:
            off = found - self._first[1] * (value / self._first[0])
            if np.abs(off).max() <= IN_PROPORTION * np.abs(found).max():
                known = self._first[0], value
                self._straight = min(low, *known), max(high, *known)
        return found

    def change_there(self, size: float) -> Array:
        """Return what is left (n,) of the effect on the runs that decide, the model refitted.

        Of the normalised residuals there; the model's parameters absorb of the effect what they
        can on the runs that are fitted to. Where that is far, it is what a small part of the way
        changes, in proportion: sensitivities said how far, so that they say what it does.
        """
        known, found, none = self.known, self.with_value(self.value(size)), self.without()
        search, steps = known.search, known.steps(self.change(size))
        far = float(np.abs(steps[search.log]).max(initial=0.0))
        part = 1.0 if far <= NEAR else SMALL / far
        there = known.stepped(steps) if part == 1.0 else search.at(search.start + part * steps)
        moved = {name: there.value(name) for name in search.names}
        if part == 1.0:
            return self._there(replace(found, values={**found.values, **moved}), none)
        own = self._there(replace(none, values={**none.values, **moved}), none)
        return self._there(found, none) + own / part

    def _there(self, one: Model, other: Model) -> Array:
        """Return by how much two models differ (n,) on the runs that decide, over the noise."""
        judging, expected = self.known.judging, self.known.expected_there
        assert judging is not None
        first, second = (residuals(judging, model, expected) for model in (one, other))
        return _counted_in(judging) * (first - second)

    def _counted(self, model: Model) -> Array:
        known = self.known
        return known.counts * residuals(known.problem, model, known.expected)

    def ended(self, size: float) -> bool:
        """Return whether a bound keeps the parameter from a size."""
        return not self.low <= self._wanted(size) <= self.high

    def _wanted(self, size: float) -> float:
        return self.one / size if self.falls else self.one * size

    def without(self) -> Model:
        """Return the model with none of the effect: at zero where its parameter may be zero."""
        at_zero = not self.falls and self.low <= 0.0
        return self.with_value(0.0) if at_zero else self.known.model

    def with_value(self, value: float) -> Model:
        """Return the model with the effect at a value of its parameter [SI]."""
        return replace(self.model, values={**self.model.values, self.key: value})


def _counted_in(problem: Problem) -> Array:
    """Return 1 for each sample (n,) of a problem's runs, 0 where the command jumps."""
    return np.concatenate([~jumps(run.V)[run.skip :] for run in problem.runs]).astype(float)


def _first_guess(name: str, model: Model, problem: Problem) -> Model:
    """Return a model with an effect at its default shape, scaled to the rig."""
    guess = initial_guesses(name, model, problem)[0]
    if EFFECTS[name].start_shares:
        return guess
    at_size = problem.at_size(model.law, [name])
    return replace(guess, values={**guess.values, **model.values, **at_size})


# From what size on what an effect changes is its own, not that of the integration's steps.

SMALLEST, LARGEST = 1e-4, 1e3
"""Sizes between which an effect is looked at, over that of a first guess."""

GROWS = 1.1
"""By what factor a change must grow with twice the size to be the effect's own."""

ROUGHEST, RIGID = 1e-2, 0.1
"""Size below which the impacts of a joint are those of the integration, over a first guess; share
of it at which the joint counts as rigid."""

STANDS_OUT = 1.5
"""How large a joint's change must be, over that of a rigid one."""


def resolved(sized: Sized, size: float) -> float:
    """Return a size, raised to where the effect's change is its own.

    Below that the steps of the integration decide: a lag of less than half a sample, where the
    change no longer falls with the size; a joint that is nearly rigid, whose impacts and stops are
    those of the integration, so that the change must stand out of that of a joint still stiffer.
    An impact that comes a sample later is a spike of any height: each sample counts so far as the
    robust loss is quadratic.
    """
    known = sized.known

    def beyond(size: float) -> float:
        change = known.beyond(sized.change(size))
        return float(np.linalg.norm(np.clip(change, -HUBER, HUBER) if rough else change))

    rough = bool(EFFECTS[sized.name].joint)
    size = float(np.clip(size, ROUGHEST if rough else SMALLEST, 1.0))
    floor = STANDS_OUT * beyond(RIGID * ROUGHEST) if rough else GROWS * beyond(0.5 * size)
    while size < 1.0:
        whole = beyond(size)
        if whole >= floor:
            break
        size, floor = 2.0 * size, floor if rough else GROWS * whole
    return size


# The largest size of an effect that runs still allow, where the likelihood has fallen enough.

TURNS = 4
"""Sizes that are tried between two that a limit lies between."""

ALIKE = 0.1
"""Relative change of a size below which it is found."""

ONE_SIDED, TWO_SIDED = 1.645, 1.96
"""Standard deviations of a 95 % limit."""

STEP = 2.0
"""Factor by which a size is raised until it is beyond what is sought."""

NEARLY = 0.1
"""By how much a likelihood may differ, of its fall, from that of a change in proportion."""

AHEAD, RISES = 6, 2
"""Sizes beyond the first one that are looked at where that one is excluded already, at most; rises
of the likelihood in succession after which it will not fall again."""

BESIDE = (-0.1, -0.05, 0.0, 0.05, 0.1)
"""Sizes beside one, over it, from which the roughness of a likelihood is taken."""


def largest_allowed(sized: Sized, least: float) -> float:
    """Return the largest size that the runs allow at 95 %: the profile of the likelihood over it.

    Parameters
    ----------
    sized : the effect
    least : where it is looked at first, resolved
    """
    apart = (TWO_SIDED if sized.signed else ONE_SIDED) ** 2
    return max(
        _end(sized, least, sign, apart) for sign in ((1.0, -1.0) if sized.signed else (1.0,))
    )


def _end(sized: Sized, least: float, sign: float, apart: float) -> float:
    """Return the size at which a likelihood has fallen so far below its best.

    Parameters
    ----------
    sized, least : the effect, and the size at which it is looked at first
    sign : of the effect
    apart : twice the fall of the logarithm of the likelihood
    """
    known, lowest = sized.known, 0.0

    def above(size: float) -> float:
        """Return twice the logarithm of the likelihood, over `apart`, with its sign turned."""
        change = known.beyond(sized.change(sign * size))
        length = float(np.linalg.norm(change))
        if length == 0.0:
            return 0.0
        rise = 2.0 * (float(np.sum(losses(known.refitted(known.plain + change)))) - known.lowest)
        return rise / (apart * known.scatter(change / length) ** 2)

    first = known.beyond(sized.change(sign * least))
    if not first.any() and not sized.change(sign).any():
        return 0.0  # it has one sign alone
    straight, lowest_there = _if_linear(known, first / least, apart)
    if least < straight < LARGEST and abs(above(straight) - lowest_there - 1.0) <= NEARLY:
        return straight
    size = low = best = least
    found = above(least)
    if found >= 1.0:
        ahead = _falls_again(above, least, found)
        if ahead is None:
            return least
        size, found = ahead
    unsure: float | None = None if EFFECTS[sized.name].joint else 0.0
    while True:
        while found < lowest + 1.0 + (unsure or 0.0):
            if size >= LARGEST:
                return LARGEST
            if found < lowest:
                lowest, best = found, size
            low, size = size, min(STEP * size, LARGEST)
            found = above(size)
        if unsure is not None:
            break
        unsure = _roughness(above, best)
    return crossing(lambda at: above(at) - lowest - 1.0 - unsure, low, size)


def _falls_again(
    likelihood: Callable[[float], float], size: float, found: float
) -> tuple[float, float] | None:
    """Return where a rough likelihood falls below that of none, and its value there; None: nowhere.

    Parameters
    ----------
    likelihood : with its sign turned, 0 of none
    size, found : where it is above that, and what it is there
    """
    rises = 0
    for _ in range(AHEAD):
        size, before = STEP * size, found
        found = likelihood(size)
        if found < 0.0:
            return size, found
        rises = rises + 1 if found > before else 0
        if rises == RISES:
            break
    return None


def _roughness(likelihood: Callable[[float], float], size: float) -> float:
    """Return what chance does to a likelihood near a size: twice its scatter about a parabola.

    Which impacts of a joint come a sample later is chance, and moves the likelihood by more than
    the noise does.
    """
    shares = np.array(BESIDE)
    found = [likelihood(size * (1.0 + share)) for share in shares]
    left = found - np.polyval(np.polyfit(shares, found, 2), shares)
    return 2.0 * sqrt(float(left @ left) / (len(shares) - 3))


def _if_linear(known: SizeSearch, slope: Array, apart: float) -> tuple[float, float]:
    """Return where a likelihood ends, and its best, if the change is in proportion to the size.

    Parameters
    ----------
    known : the runs
    slope : (n,) change per size
    apart : twice the fall of the logarithm of the likelihood, the unit of what is returned
    """
    near = slope[np.abs(known.plain) <= HUBER]  # beyond, the robust loss is straight
    sharp, size = float(near @ near), float(np.linalg.norm(slope))
    if sharp == 0.0:
        return LARGEST, 0.0
    unit = apart * known.scatter(slope / size) ** 2
    push = float(slope @ known.left)
    lowest = -(push**2) / sharp if push < 0.0 else 0.0
    return (-push + sqrt(push**2 + sharp * (lowest + unit))) / sharp, lowest / unit


def crossing(rising: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function between two sizes is zero: regula falsi (Illinois) in logarithms."""
    at_low, at_high = rising(low), rising(high)
    for _ in range(TURNS):
        share = -at_low / (at_high - at_low) if at_high > at_low else 0.5
        size = low * (high / low) ** min(max(share, 0.05), 0.95)
        at = rising(size)
        if at < 0.0:
            low, at_low, at_high = size, at, 0.5 * at_high
        else:
            high, at_high, at_low = size, at, 0.5 * at_low
        if high / low <= 1.0 + ALIKE:
            break
    return high


# From what size on a verdict names an effect 9 times of 10.

UNSHOWN = 0.05
"""What the runs that decide show of an effect at the least, over those that are fitted to."""

NINE_OF_TEN = 1.282
"""Standard deviations above the mean that 9 of 10 stay below."""

MARGIN = 1.08
"""Factor on the distance from which an effect is named: z is robust, so that large residuals count
less than their squares, and other effects absorb a part. `python -m benchmarks limits --named`
counts what comes of it."""

STRAIGHT = 2
"""How often a size is sought in proportion to its change."""


def named_distance(samples: int, held_out: int, rule: DecisionRule = BENCH) -> float:
    """Return the distance, in standard deviations, from which 9 of 10 verdicts name an effect.

    A verdict asks that z on held-out runs falls by `rule.gain`, which scatters with the noise.

    Parameters
    ----------
    samples : over which the distance is taken
    held_out : samples that decide
    rule : the numbers that decide
    """
    asked = held_out * ((1.0 + rule.gain) ** 2 - 1.0)
    whole = NINE_OF_TEN + sqrt(NINE_OF_TEN**2 + asked)
    return MARGIN * whole * sqrt(samples / held_out)


def named_size(sized: Sized, least: float) -> tuple[float | None, float | None]:
    """Return the value and the share of the force from which 9 of 10 verdicts name an effect.

    Both are None where that is beyond the parameter's bounds.

    Parameters
    ----------
    sized : the effect
    least : the size that the runs still allow
    """
    known = sized.known
    wanted = named_distance(len(known.plain), known.held_out, known.rule)
    size = _distant(sized, least, wanted)
    if size is not None and known.judging is not None:
        wanted /= max(_shown_there(sized, size), UNSHOWN)
        size = _distant(sized, size, wanted)
    if size is not None and size <= least:
        # Where the model errs, the runs allow sizes that they would name beside a true one.
        size = None if sized.ended(least) else least
        wanted = float(np.linalg.norm(known.beyond(sized.change(least))))
    return (None, None) if size is None else (sized.value(size), wanted / known.size)


def _shown_there(sized: Sized, size: float) -> float:
    """Return what a sample that decides shows of an effect, over one that is fitted to."""
    there = sized.change_there(size)
    here = sized.known.beyond(sized.change(size))
    return float(np.linalg.norm(there) / np.linalg.norm(here) * sqrt(len(here) / len(there)))


def _distant(sized: Sized, least: float, wanted: float) -> float | None:
    """Return the size at which an effect is so many standard deviations from none.

    None beyond the parameter's bounds; `least` is the size that is looked at first.
    """
    known, size = sized.known, least

    def beyond(size: float) -> float:
        return float(np.linalg.norm(known.beyond(sized.change(size)))) / wanted - 1.0

    for _ in range(STRAIGHT):  # in proportion, as a rule
        size = float(np.clip(size / (1.0 + beyond(size)), SMALLEST, LARGEST))
        off = beyond(size)
        if not sized.ended(size) and abs(off) <= ALIKE:
            return size / (1.0 + off)
    low = size = least
    while beyond(size) < 0.0:
        if sized.ended(size) or size >= LARGEST:
            return None
        low, size = size, STEP * size
    size = crossing(beyond, low, size) if low < size else size
    return None if sized.ended(size) else size
