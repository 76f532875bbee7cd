"""The step from which the coupling of a mass with a damper is unstable, for each algorithm."""

from __future__ import annotations

from math import sqrt

_FINENESS = 1.02
"""Ratio [1] of neighbouring steps in the search for the first unstable one."""


def longest_step(algorithm: str, mass: float, c: float, k: float) -> float:
    """Return the step [s] from which the coupling of a mass with a damper is unstable.

    For m v' = -f, f = k z + c v, z' = v, with g = c h/m and q = k h^2/m. Jacobi, where f uses the
    velocity of one step before, has the characteristic equation (s - 1)^2 s + q s + g (s - 1) = 0,
    Gauss-Seidel (s - 1)(s - 1 + g) + q s = 0. Jury's criterion (Jury 1964, Theory and Application
    of the z-Transform Method) gives q < g (1 - g) and 2 g + q < 4. The exact step of the structure
    leaves its own stiffness out of this.

    With midpoint s (s - 1)^2 + (3 s - 1)/2 (a s + b) = 0, a = q/2 + g, b = q/2 - g, whichever of
    the two steps first: one of them is told ahead. Jury's criterion gives g < 1 and
    q^2 < 4 g + 2 g^2 + g q. One rollback makes it
    s (s - 1)(s - 1 + q/2) + (a s + b)((1 - 3 a/4) s + a/4) = 0.

    Parameters
    ----------
    algorithm : str
        One of `parts.ALGORITHMS`.
    mass, c, k : float
        kg; N.s/m, above 0; N/m.
    """
    if algorithm == "jacobi":
        return mass * c / (c * c + k * mass)
    if algorithm == "gauss-seidel":
        return 4.0 * mass / (c + sqrt(c * c + 4.0 * k * mass))
    k = max(k, 1e-9 * c * c / mass)  # without bristles a root of 1 stands for where the mass is
    low = high = 1e-3 * mass / (c + sqrt(k * mass))
    while _settles(_cubic(algorithm, c * high / mass, k * high * high / mass)):
        low, high = high, high * _FINENESS
    for _ in range(50):
        middle = 0.5 * (low + high)
        stable = _settles(_cubic(algorithm, c * middle / mass, k * middle * middle / mass))
        low, high = (middle, high) if stable else (low, middle)
    return low


def _cubic(algorithm: str, g: float, q: float) -> tuple[float, float, float]:
    """Return the coefficients of s^2, s and 1 beside s^3 in the characteristic equation."""
    a, b = 0.5 * q + g, 0.5 * q - g
    if algorithm == "midpoint":
        return 1.5 * a - 2.0, 1.0 + 1.5 * b - 0.5 * a, -0.5 * b
    slope, rest = 1.0 - 0.75 * a, 0.25 * a
    return 0.5 * q - 2.0 + a * slope, 1.0 - 0.5 * q + a * rest + b * slope, b * rest


def _settles(cubic: tuple[float, float, float]) -> bool:
    """Return whether all roots lie within the unit circle, by Jury's criterion."""
    a2, a1, a0 = cubic
    return (
        1.0 + a2 + a1 + a0 > 0.0
        and 1.0 - a2 + a1 - a0 > 0.0
        and abs(a0) < 1.0
        and 1.0 - a0 * a0 > abs(a1 - a0 * a2)
    )
