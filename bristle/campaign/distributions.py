"""What a value of an ensemble is drawn from.

A draw needs one number between 0 and 1 per run and name, taken from a hash of seed, run and name:
so run i is the same whatever runs before it, on however many processes, with whatever library.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import accumulate
from math import exp, isfinite, log
from statistics import NormalDist

Value = bool | int | float | str

KINDS = ("uniform", "log_uniform", "normal", "integers", "choice", "each")


def share(seed: int, run: int, name: str) -> float:
    """Return a number within (0, 1), even over runs and names."""
    digest = hashlib.sha256(f"{seed}/{run}/{name}".encode()).digest()
    return ((int.from_bytes(digest[:8], "big") >> 11) + 0.5) / 2.0**53


@dataclass(frozen=True)
class Distribution:
    """What one name is drawn from.

    Attributes
    ----------
    kind : str
        One of `KINDS`. "each" takes every value equally often, in turn, not by chance.
    values : tuple
        uniform, log_uniform, integers: both ends; normal: mean and standard deviation; choice,
        each: the values themselves.
    within : tuple of float, optional
        normal: both ends between which it is cut off.
    weights : tuple of float, optional
        choice: how likely each value is, in any scale.
    """

    kind: str
    values: tuple[Value, ...]
    within: tuple[float, float] | None = None
    weights: tuple[float, ...] = ()

    def mistake(self) -> str:
        """Return the words for what is wrong with it, "" for nothing."""
        if self.kind in ("choice", "each"):
            return self._mistake_of_list()
        if len(self.values) != 2 or not all(_is_number(v) for v in self.values):
            return f"{self.kind} needs a list of two finite numbers."
        low, high = float(self.values[0]), float(self.values[1])
        if self.kind == "normal":
            return self._mistake_of_normal(low, high)
        if self.kind == "integers" and not all(isinstance(v, int) for v in self.values):
            return "integers needs two whole numbers."
        if self.kind == "log_uniform" and low <= 0.0:
            return f"log_uniform begins at {low:g}; it must begin above 0."
        if low > high or (low == high and self.kind != "integers"):
            return f"{self.kind} = [{low:g}, {high:g}] must rise."
        return ""

    def _mistake_of_list(self) -> str:
        if not self.values:
            return f"{self.kind} needs a list with at least one value."
        if not all(isinstance(v, str | bool) or _is_number(v) for v in self.values):
            return f"{self.kind} holds numbers, texts, true and false."
        if self.weights and len(self.weights) != len(self.values):
            return f"{len(self.values)} values need as many weights, found {len(self.weights)}."
        if self.weights and (min(self.weights) < 0.0 or sum(self.weights) <= 0.0):
            return "weights must not be negative, and one at least must be positive."
        return ""

    def _mistake_of_normal(self, mean: float, deviation: float) -> str:
        if deviation <= 0.0:
            return f"normal has the standard deviation {deviation:g}; it must be positive."
        if self.within is None:
            return ""
        low, high = self.within
        if not low < high:
            return f"within = [{low:g}, {high:g}] must rise."
        normal = NormalDist(mean, deviation)
        if normal.cdf(high) - normal.cdf(low) < 1e-6:
            return (
                f"within = [{low:g}, {high:g}] lies where normal = [{mean:g}, {deviation:g}] "
                "never comes."
            )
        return ""

    def draw(self, u: float) -> Value:
        """Return the value at the share u of the distribution, 0 < u < 1."""
        if self.kind == "choice":
            weights = self.weights or (1.0,) * len(self.values)
            reached = list(accumulate(weights))
            place = next((k for k, edge in enumerate(reached) if u * reached[-1] < edge), -1)
            return self.values[place]
        a, b = self.values[0], self.values[1]
        if self.kind == "integers":
            return int(a) + int(u * (int(b) - int(a) + 1))
        a, b = float(a), float(b)
        if self.kind == "uniform":
            return a + u * (b - a)
        if self.kind == "log_uniform":
            return min(max(exp(log(a) + u * (log(b) - log(a))), a), b)
        normal = NormalDist(a, b)
        if self.within is None:
            return normal.inv_cdf(u)
        low, high = (normal.cdf(end) for end in self.within)
        value = normal.inv_cdf(min(max(low + u * (high - low), 1e-300), 1.0 - 2.0**-53))
        return min(max(value, self.within[0]), self.within[1])

    def extremes(self) -> tuple[Value, ...]:
        """Return values that show whether a variable can take what will be drawn.

        The ends of a bounded distribution, the mean of an unbounded one, every value of a list.
        """
        if self.kind in ("choice", "each", "integers"):
            return self.values
        bounds = self.values if self.kind != "normal" else self.within or self.values[:1]
        return tuple(map(float, bounds))  # as they are drawn, also between whole numbers


@dataclass(frozen=True)
class Varied:
    """One name that varies, e.g. "damper.sigma_a", and what it is drawn from.

    `place` says where the value goes: "parameter" of a component, "building" for a number of a
    building's data, "scenario" for what the scenario must be read anew for (records, steps, FMUs).
    """

    name: str
    distribution: Distribution
    place: str = "parameter"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
