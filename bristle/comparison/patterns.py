"""Along which coordinate a residual is organised, with a significance that holds.

A residual is correlated in time, so samples are not independent; blocks longer than the correlation
are. Under a true model the sign of a block says nothing of the next one's: flipping the signs of
whole blocks (the wild bootstrap, Wu 1986, Ann. Statist. 14, 1261-1295; by blocks, Shao 2010, JASA
105, 218-235) shows what chance would organise. Shifting the residual along a periodic motion would
not: it finds the pattern again one period later. The largest of all coordinates is judged against
the largest of all that chance gives (Westfall & Young 1993), so that trying many of them costs
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..identification.search import z_scale
from ..physics.drive import DRIVES
from .predictions import BINS, FINE, SLOW, Bins, cut, rms

FLIPS = 1999
LEVEL = 0.01
"""Chance below which a coordinate is said to organise the residual, all coordinates together."""
CUT_OFF = 8.0
"""Normalised residuals are cut there, times z where that is above 1: spikes are no pattern."""
_SHORTEST = 40  # samples of a block at the least
_MIN_BLOCKS = 30  # blocks at the least, as long as that leaves each `_SHORTEST` samples
_ALIKE = 0.95  # share of the best coordinate's from which another tells the same
_PER_BIN = 8  # blocks per bin of a coordinate that only grows

# Where several tell the same, the one that an engineer would name.
PREFERENCE = (
    "direction",
    "displacement",
    "speed",
    *DRIVES,
    "velocity",
    *(f"{name}_rate" for name in DRIVES),
    "time_since_reversal",
    "rest",
    "acceleration",
    "dissipated_energy",
    "time",
)


@dataclass(frozen=True)
class ResidualPattern:
    """How far one coordinate organises the residual.

    `turned`: the residual was taken times the direction of motion, so that positive means more
    resistance than the model has. `share` is the part of the residual's power that the coordinate
    carries, what chance would carry taken off; `of_excess` its part of what exceeds the noise, NaN
    where nothing does; `p` the chance of such a share under a true model, all coordinates
    together; `alike` the coordinates that tell the same in these runs.

    `centre`, `low`, `high` (b,) are the bins in SI, `mean`, `std` (b,) the residual's mean in each
    with its standard deviation, in the unit of the residual.
    """

    coordinate: str
    turned: bool
    share: float
    of_excess: float
    p: float
    raw: float
    chance: float
    centre: Array
    low: Array
    high: Array
    mean: Array
    std: Array
    alike: tuple[str, ...] = ()

    @property
    def significant(self) -> bool:
        """Whether chance is not a fair explanation."""
        return self.p <= LEVEL

    def as_dict(self) -> dict[str, Any]:
        """Return the pattern as JSON has it."""
        found = asdict(self)
        for key in ("centre", "low", "high", "mean", "std"):
            found[key] = [float(value) for value in found[key]]
        del found["raw"], found["chance"]
        return {**found, "alike": list(self.alike), "significant": self.significant}


class Blocks:
    """Samples in blocks longer than the residual's correlation, none across two runs.

    Parameters
    ----------
    residuals : list of (n,), one per run
    flips : how many random patterns of signs to draw
    length : of a block [samples]; 0: by `block_length`
    """

    def __init__(
        self, residuals: Sequence[Array], flips: int = FLIPS, seed: int = 0, length: int = 0
    ) -> None:
        total = sum(len(r) for r in residuals)
        self.length = length or block_length(residuals)
        label, first = [], 0
        for r in residuals:
            count = max(1, round(len(r) / self.length))
            label.append(first + np.arange(len(r)) * count // max(len(r), 1))
            first += count
        self.label = np.concatenate(label) if label else np.zeros(0, dtype=np.int64)
        self.count, self.total = first, total
        generator = np.random.default_rng(seed)
        self.signs = generator.integers(0, 2, (flips, first)) * 2.0 - 1.0

    def sums(self, values: Array, bins: Bins) -> Array:
        """Return the sums (blocks, bins) of values (n,)."""
        index = self.label * bins.count + bins.label
        flat = np.bincount(index, weights=values, minlength=self.count * bins.count)
        return np.asarray(flat.reshape(self.count, bins.count), dtype=float)

    def spread(self, values: Array, bins: Bins) -> Array:
        """Return the standard deviation (bins,) of the means of values in bins, over blocks."""
        counts = self.sums(np.ones_like(values), bins)
        n = np.maximum(counts.sum(axis=0), 1.0)
        sums = self.sums(values, bins)
        left = sums - counts * (sums.sum(axis=0) / n)
        blocks = np.maximum((counts > 0).sum(axis=0), 2)
        return np.asarray(np.sqrt((left**2).sum(axis=0) * blocks / (blocks - 1.0)) / n)


def block_length(residuals: Sequence[Array]) -> int:
    """Return a length [samples] well above the residuals' correlation, yet enough blocks.

    Eight times the integral time of the autocorrelation, summed to where it is lost in its own
    scatter (Sokal 1997, in Functional Integration, 131-192).
    """
    total = sum(len(r) for r in residuals)
    times = [correlation_time(r) for r in residuals if len(r) > _SHORTEST]
    wanted = 8.0 * max(times, default=1.0)
    return int(max(_SHORTEST, min(wanted, total / _MIN_BLOCKS)))


def correlation_time(r: Array) -> float:
    """Return the integral time [samples] of a residual's (n,) autocorrelation, 1 where white."""
    y = r - r.mean()
    size = 1 << (2 * len(y) - 1).bit_length()
    power = np.abs(np.fft.rfft(y, size)) ** 2
    rho = np.fft.irfft(power, size)[: len(y) // 3]
    if not rho[0] > 0.0:
        return 1.0
    tau = 2.0 * np.cumsum(rho / rho[0]) - 1.0
    stop = np.flatnonzero(np.arange(len(tau)) >= 5.0 * tau)
    return float(max(1.0, tau[stop[0]] if len(stop) else tau.max()))


class Finder:
    """Searches the same runs for the place of a residual, and of what is left of it.

    Parameters
    ----------
    residuals : list of (n,), one per run
        Over the noise expected of a true model.
    raw : list of (n,)
        The same in its unit, for the means in bins.
    coordinates : list of mapping
        Name to (n,); a coordinate must be there in all runs to count.
    flips : int
        How many random signs of blocks say what chance would give.
    """

    def __init__(
        self,
        residuals: Sequence[Array],
        raw: Sequence[Array],
        coordinates: Sequence[Mapping[str, Array]],
        flips: int = FLIPS,
        seed: int = 0,
    ) -> None:
        whole = np.concatenate(list(residuals))
        limit = CUT_OFF * max(1.0, z_scale(whole))
        self.normalised = np.clip(whole, -limit, limit)
        self.raw = np.concatenate(list(raw))
        shared = [name for name in coordinates[0] if all(name in one for one in coordinates)]
        joined = {name: np.concatenate([one[name] for one in coordinates]) for name in shared}
        self.direction = joined.get("direction")
        self.bins: dict[str, Bins] = {}
        self.blocks = Blocks(residuals, 0, seed)
        for length in (self.blocks.length, 0):
            few = int(max(3, min(BINS, self.blocks.count // _PER_BIN)))
            cuts = {
                name: cut(y, few if name in SLOW else FINE.get(name, BINS))
                for name, y in joined.items()
                if name in SLOW or name not in self.bins
            }
            self.bins |= {name: one for name, one in cuts.items() if one is not None}
            if length:
                shorter = self._length_beside(residuals)
                self.blocks = Blocks(residuals, flips, seed, min(length, shorter))

    def _length_beside(self, residuals: Sequence[Array]) -> int:
        """Return the length of blocks for what is left after the most telling coordinate.

        A pattern makes a residual look correlated for as long as the motion is: with blocks of that
        length there would be too few to tell it from chance.
        """
        best, left = 0.0, self.normalised
        for name, bins in self.bins.items():
            for turned in self._ways(name):
                rest = self._less_means(self.normalised, bins, turned)
                gone = 1.0 - float(np.sum(rest**2)) / max(float(np.sum(self.normalised**2)), 1e-300)
                if gone > best:
                    best, left = gone, rest
        return block_length(np.split(left, np.cumsum([len(r) for r in residuals])[:-1]))

    def ranked(
        self, normalised: Array, raw: Array | None = None, leave_out: Sequence[str] = ()
    ) -> list[ResidualPattern]:
        """Return the patterns of a residual (n,), the most telling one first.

        `raw` (n,) is the same in its unit, by default that of the runs.
        """
        raw = self.raw if raw is None else raw
        found: list[ResidualPattern] = []
        scores: list[Array] = []
        for name, bins in self.bins.items():
            if name in leave_out:
                continue
            options = [
                self._pattern(name, bins, normalised, raw, turned) for turned in self._ways(name)
            ]
            scores += [score for _, score in options]
            best = max(range(len(options)), key=lambda i: options[i][0].share)
            found.append(options[best][0])
        if not found:
            return []
        most = np.max(np.array(scores), axis=0)
        tested = [replace(one, p=_chance(one.p, most)) for one in found]
        return preferred(tested)

    def without(self, normalised: Array, pattern: ResidualPattern) -> Array:
        """Return what is left of a residual (n,) after its means along a pattern are taken off."""
        return self._less_means(normalised, self.bins[pattern.coordinate], pattern.turned)

    def _less_means(self, values: Array, bins: Bins, turned: bool) -> Array:
        values = values * self._turn(turned)
        count = np.maximum(np.bincount(bins.label, minlength=bins.count), 1)
        mean = np.bincount(bins.label, weights=values, minlength=bins.count) / count
        return np.asarray((values - mean[bins.label]) * self._turn(turned))

    def mean_along(
        self, pattern: ResidualPattern, values: Array, chosen: Array
    ) -> tuple[Array, Array]:
        """Return means and standard deviations (b,) of some values (n,) along a pattern.

        `chosen` (n,) is 1 for the samples that count and 0 for the others.
        """
        bins = self.bins[pattern.coordinate]
        turned = values * self._turn(pattern.turned)
        counts = self.blocks.sums(chosen, bins)
        sums = self.blocks.sums(turned * chosen, bins)
        n = counts.sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = sums.sum(axis=0) / n
            left = sums - counts * mean
            std = np.sqrt(np.nansum(left**2, axis=0)) / n
        return mean, std

    def _ways(self, name: str) -> tuple[bool, ...]:
        if self.direction is None or name in ("direction", "velocity"):
            return (False,)  # along these the direction is known already
        return (False, True)

    def _turn(self, turned: bool) -> Array | float:
        if not turned:
            return 1.0
        assert self.direction is not None
        return self.direction

    def _pattern(
        self, name: str, bins: Bins, normalised: Array, raw: Array, turned: bool
    ) -> tuple[ResidualPattern, Array]:
        """Return a pattern, its `p` yet its score, and the scores that chance gives (flips,)."""
        values = normalised * self._turn(turned)
        counts = np.maximum(np.bincount(bins.label, minlength=bins.count), 1.0)
        total = max(float(np.sum(normalised**2)), 1e-300)
        sums = self.blocks.sums(values, bins)
        # An odd function of velocity has a mean over speed, too: it belongs to it.
        centred = not (name == "speed" and turned)
        mine = float(_shares(sums.sum(axis=0)[None], counts, total, centred)[0])
        chance = _shares(self.blocks.signs @ sums, counts, total, centred)
        middle, width = float(chance.mean()), float(chance.std()) or 1e-12
        # What noise alone puts into the means: the scatter of blocks about them.
        noise = float(counts @ self.blocks.spread(values, bins) ** 2) / total
        share = max(0.0, (mine - noise) / max(1.0 - noise, 1e-9))
        power = rms(normalised) ** 2
        excess = share * power / (power - 1.0) if power > 1.1 else float("nan")
        raw = raw * self._turn(turned)
        mean = np.bincount(bins.label, weights=raw, minlength=bins.count) / counts
        pattern = ResidualPattern(
            name, turned, share, min(excess, 1.0) if excess == excess else excess,
            (mine - middle) / width, mine, float(np.quantile(chance, 0.99)),
            bins.centre, bins.low, bins.high, mean, self.blocks.spread(raw, bins),
        )  # fmt: skip
        return pattern, (chance - middle) / width


def _shares(sums: Array, counts: Array, total: float, centred: bool) -> Array:
    """Return the explained share of power (f,) for rows of sums in bins (f, b)."""
    if centred:
        sums = sums - counts * (sums.sum(axis=1, keepdims=True) / counts.sum())
    return np.asarray((sums**2 / counts).sum(axis=1) / total)


def _chance(score: float, most: Array) -> float:
    """Return the chance that the largest of all scores under a true model reaches a score."""
    return float((1 + np.count_nonzero(most >= score)) / (1 + len(most)))


def preferred(found: list[ResidualPattern]) -> list[ResidualPattern]:
    """Return patterns by share; of those that tell the same, the one to name comes first."""
    ordered = sorted(found, key=lambda one: -one.share)
    top = ordered[0].share
    # Significance first: a coordinate of few blocks may carry much by chance.
    same = [one for one in ordered if one.share >= _ALIKE * top and one.significant]
    if not same:
        return ordered
    same.sort(key=lambda one: [*PREFERENCE, one.coordinate].index(one.coordinate))
    first = replace(same[0], alike=tuple(one.coordinate for one in same[1:]))
    return [first, *(one for one in ordered if one.coordinate != first.coordinate)]
