"""A form about a centre of its own, fitted to the values of a learned curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .forms import Form

Array = NDArray[np.float64]

UNCENTRED = ("displacement", "recent_displacement")
"""Signals whose zero says where a rig was mounted, beside those of measured channels."""

CLEAR = 3.0
"""Times its standard error that a centre is from zero: nearer, a form about zero is as good."""

FEWEST = 8
"""Knots of a curve that may have such a form, twice the numbers of one."""

NEAR = 3
"""Knots within a form's own scale of its centre: fewer are no shape, but an outlier."""

FLANKS = 1.75
"""Times its scale that both flanks lie within the knots: a hump without them has many formulas."""

_CENTRES, _SCALES = 24, 16


class About(NamedTuple):
    """A form's values c, m, d and s0, and the weighted RMS that it leaves."""

    values: tuple[float, ...]
    rms: float


def fitted_about(form: Form, s: Array, y: Array, weight: Array) -> About | None:
    """Return a form at its best centre and scale; None where the curve tells no centre.

    Parameters
    ----------
    form : with one column
    s, y : (n,) knots and values
    weight : (n,) one over the uncertainty of each value
    """
    if len(s) < FEWEST:
        return None
    wide, steps = 0.5 * float(np.ptp(s)), np.diff(s)
    scales = np.geomspace(float(np.min(steps)), wide, _SCALES)

    def factors(q: Array) -> tuple[Array, Array]:
        A = form.at(s - q[1], float(np.exp(q[0]))) * weight[:, None]
        return A, np.asarray(np.linalg.lstsq(A, y * weight, rcond=1e-12)[0], dtype=np.float64)

    def off(q: Array) -> Array:
        A, found = factors(q)
        return np.asarray(y * weight - A @ found)

    best = _start(form, s, y, weight, scales)
    bounds = ([np.log(scales[0]), s[1]], [np.log(wide), s[-2]])
    fit = least_squares(off, np.clip(best, *bounds), bounds=bounds, x_scale=(1.0, wide))
    d, centre = float(np.exp(fit.x[0])), float(fit.x[1])
    power = float(np.sum(fit.fun**2))
    std = float(np.sqrt(np.linalg.pinv(fit.jac.T @ fit.jac)[1, 1]))
    near = int(np.count_nonzero(np.abs(s - centre) <= d))
    inside = s[0] + FLANKS * d <= centre <= s[-1] - FLANKS * d
    if power > len(s) - form.count() or not inside or near < NEAR or abs(centre) <= CLEAR * std:
        return None  # most humps are no bell: the form must leave no more than the values' noise
    c, m = (float(one) for one in factors(fit.x)[1])
    return About((c, m, d, centre), float(np.sqrt(power / np.sum(weight**2))))


def _start(form: Form, s: Array, y: Array, weight: Array, scales: Array) -> Array:
    """Return the logarithm of the scale and the centre, of a grid, that leave the least."""
    centres = np.linspace(s[1], s[-2], _CENTRES)
    away, share = (s - centres[:, None]).ravel(), weight**2 / np.sum(weight**2)
    taken = np.empty((len(scales), len(centres)))
    for row, d in enumerate(scales):
        h = form.at(away, float(d))[:, 1].reshape(len(centres), -1)
        h = h - (h @ share)[:, None]
        taken[row] = (h @ (share * y)) ** 2 / np.maximum(h**2 @ share, 1e-300)
    scale, centre = np.unravel_index(int(np.argmax(taken)), taken.shape)
    return np.array([np.log(scales[scale]), centres[centre]])
