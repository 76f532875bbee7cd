"""Integration of an example's equations: adaptive, restarted wherever the voltage jumps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ..errors import RunError

Array = NDArray[np.float64]
Rates = Callable[[float, list[float]], list[float]]
FINE, ROUGH = 1e-6, 1e-4
"""Relative tolerances: 1e-6 errs by 2e-5 of the RMS of a building's channels, 1e-4 by 1e-3."""

LONGEST = 0.02
"""Longest step [s]: where all is at rest the integrator would leap over a command that rises."""


def integrate(
    rates: Rates,
    start: Sequence[float],
    scales: Sequence[float],
    time: Array,
    jumps: Sequence[float],
    rtol: float = FINE,
) -> Array:
    """Return the states (n, m) at the instants `time`.

    Parameters
    ----------
    rates : callable
        Rates of the states [1/s of their units] from time [s] and states; smooth between `jumps`.
    start, scales : sequences
        First values (m,) of the states, and their sizes, for the tolerances.
    time : array
        Instants (n,) s, from the start to the end.
    jumps : sequence
        Instants at which the rates jump [s], each one of `time`.
    rtol : float
        Relative tolerance; the absolute one is a tenth of it, in the states' sizes.

    Raises
    ------
    RunError
        If the integrator does not get through.
    """
    found = np.empty((time.size, len(start)))
    found[0] = state = np.array(start, float)
    edges = [time[0], *(j for j in jumps if time[0] < j < time[-1]), time[-1]]
    for begin, end in pairwise(edges):
        inside = (time > begin + 1e-9) & (time <= end + 1e-9)
        # Just inside, so that a programme that jumps at `end` still gives what held before.
        asked = np.minimum(time[inside], end - 1e-8)
        solution = solve_ivp(
            lambda t, y: rates(t, y.tolist()), (begin, end - 1e-8), state, method="LSODA",
            t_eval=asked, rtol=rtol, atol=0.1 * rtol * np.array(scales), max_step=LONGEST,
        )  # fmt: skip
        if not solution.success or not np.all(np.isfinite(solution.y)):
            raise RunError(
                f"The rig's equations were not solved at {begin:.3f} s: {solution.message}"
            )
        found[inside], state = solution.y.T, solution.y[:, -1]
    return found
