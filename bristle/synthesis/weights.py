"""Weights: what a design asks for, as transfer functions."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..errors import DesignError


@dataclass(frozen=True)
class Weight:
    """A transfer function of one input and output, coefficients by falling power of s.

    Raises
    ------
    DesignError
        If it is improper, unstable, zero, or a coefficient is not finite.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]

    def __post_init__(self) -> None:
        coefficients = (*self.numerator, *self.denominator)
        if not self.numerator or not self.denominator or not all(map(isfinite, coefficients)):
            raise DesignError(f"weight {self}: coefficients must be finite numbers.")
        if not any(self.denominator[:1]) or not any(self.numerator):
            raise DesignError(f"weight {self}: zero, or its denominator begins with zero.")
        if len(np.trim_zeros(self.numerator, "f")) > len(self.denominator):
            raise DesignError(
                f"weight {self} is improper: the numerator's degree is above the denominator's. "
                "Add poles above the band of interest."
            )
        poles = np.roots(self.denominator)
        if len(poles) and poles.real.max() >= 0.0:
            raise DesignError(f"weight {self}: the pole at {poles.real.max():g} rad/s must be < 0.")

    def __str__(self) -> str:
        return f"{_polynomial(self.numerator)} / {_polynomial(self.denominator)}"

    @classmethod
    def low_pass(cls, gain: float, corner: float) -> Weight:
        """Return gain w / (s + w), w the corner [rad/s]."""
        return cls((gain * corner,), (1.0, corner))

    @classmethod
    def lead(cls, gain: float, zero: float, pole: float) -> Weight:
        """Return gain (s + zero) / (s + pole), corners in rad/s; `gain` holds at high frequency."""
        return cls((gain, gain * zero), (1.0, pole))

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.denominator) - 1

    @property
    def feedthrough(self) -> float:
        """Gain at infinite frequency."""
        return self.state_space()[3]

    def state_space(self) -> tuple[Array, Array, Array, float]:
        """Return A (n, n), B (n, 1), C (1, n), D in controllable form."""
        n = self.order
        den = np.array(self.denominator) / self.denominator[0]
        num = np.zeros(n + 1)
        given = np.trim_zeros(np.array(self.numerator), "f") / self.denominator[0]
        num[n + 1 - len(given) :] = given
        A = np.zeros((n, n))
        A[1:, :-1] = np.eye(max(n - 1, 0))
        B = np.zeros((n, 1))
        if n:
            A[0] = -den[1:]
            B[0] = 1.0
        C = (num[1:] - num[0] * den[1:])[None]
        return A, B, C, float(num[0])

    def response(self, omega: Array) -> NDArray[np.complex128]:
        """Return the frequency response at `omega` [rad/s]."""
        s = 1j * np.asarray(omega)
        value: NDArray[np.complex128] = np.polyval(self.numerator, s) / np.polyval(
            self.denominator, s
        )
        return value

    def data(self) -> dict[str, Any]:
        """Return the weight as a table of a design file."""
        return {"numerator": list(self.numerator), "denominator": list(self.denominator)}


@dataclass(frozen=True)
class Weights:
    """The weights of an H-infinity or LPV design.

    Attributes
    ----------
    acceleration : Weight
        On the top floor's absolute acceleration [s2/m]; rolls off before the first mode.
    command : Weight
        On the command: 1/N for a force, 1/V for the signed voltage; a high-pass.
    noise : float
        Noise of the measured acceleration [m/s2], which keeps the problem regular.

    Raises
    ------
    DesignError
        If the problem would be singular: no noise, or a command that costs nothing at high
        frequency.
    """

    acceleration: Weight = field(default_factory=lambda: Weight.low_pass(1.5, 12.0))
    command: Weight = field(default_factory=lambda: Weight.lead(2.0, 15.0, 50.0))
    noise: float = 0.04

    def __post_init__(self) -> None:
        if not (isfinite(self.noise) and self.noise > 0.0):
            raise DesignError(
                f"weights: noise = {self.noise!r} makes the problem singular (the measurement has "
                "no direct path from the ground): a positive noise [m/s2] is right."
            )
        if self.command.feedthrough == 0.0:
            raise DesignError(
                f"weights: the weight on the command, {self.command}, vanishes at high frequency "
                "and makes the problem singular: as many zeros as poles are right."
            )


@dataclass(frozen=True)
class LqgWeights:
    """The cost and noise of an LQG design.

    The regulator minimises the mean of acceleration y^2 + drift x^2 + force u^2, with y the top
    floor's absolute acceleration, x the first level's displacement and u the damper's force.

    Attributes
    ----------
    acceleration, drift, force : float
        Weights [s4/m2], [1/m2], [1/N2]. The defaults suit the paper's model (chosen on El Centro).
    ground, noise : float
        Intensities of the white ground acceleration and of the measured acceleration's noise, as
        standard deviations in the same unit; only their ratio counts.
    """

    acceleration: float = 1.0
    drift: float = 1e4
    force: float = 0.2
    ground: float = 1.0
    noise: float = 0.04

    def __post_init__(self) -> None:
        values = vars(self)
        for name, value in values.items():
            if not (isfinite(value) and value >= 0.0):
                raise DesignError(f"lqg: {name} = {value!r} must be finite and not negative.")
        for name in ("force", "ground", "noise"):
            if values[name] == 0.0:
                raise DesignError(f"lqg: {name} = 0 makes the problem singular.")
        if self.acceleration == 0.0 and self.drift == 0.0:
            raise DesignError("lqg: acceleration and drift are both 0: nothing would be damped.")


def _polynomial(coefficients: tuple[float, ...]) -> str:
    n = len(coefficients) - 1
    powers = ("" if k == n else " s" if k == n - 1 else f" s^{n - k}" for k in range(n + 1))
    terms = (f"{value:g}{power}" for value, power in zip(coefficients, powers, strict=True))
    return "(" + " + ".join(terms) + ")"
