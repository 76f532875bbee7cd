"""Checks a designed controller without the solver: poles, sampling, closed-loop norms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..errors import DesignError
from ..progress import counted
from .norms import hinf_norm
from .plant import Plant
from .table import Bank
from .task import FASTEST_TIMES_PERIOD

Array = NDArray[np.float64]

BEYOND = 1e-3
"""Relative excess of a closed-loop norm over gamma that counts as rounding."""


def check_poles(bank: Bank, r: Array, h: float) -> dict[str, float]:
    """Refuse controllers that are unstable, or too fast for the sample period h [s].

    An unstable controller behind a saturated actuator drifts into saturation and stays there.

    Returns
    -------
    dict
        `largest_real_part` [1/s] and `fastest_pole` [rad/s] over all speeds r (k,) [m/s].

    Raises
    ------
    DesignError
        With the pole and the speed.
    """
    poles = bank.poles
    worst = np.unravel_index(np.argmax(poles.real), poles.shape)
    fastest = np.unravel_index(np.argmax(np.abs(poles)), poles.shape)
    if poles[worst].real >= 0.0:
        raise DesignError(
            f"the controller is unstable{_at(r, int(worst[0]))}: pole {_number(poles[worst])} "
            "rad/s. A larger tau or less demanding weights would help."
        )
    if abs(poles[fastest]) * h > FASTEST_TIMES_PERIOD:
        raise DesignError(
            f"the controller is too fast for its sample period of {h:g} s"
            f"{_at(r, int(fastest[0]))}: pole {_number(poles[fastest])} rad/s, at most "
            f"{FASTEST_TIMES_PERIOD / h:.4g} rad/s can be sampled. A larger tau, less demanding "
            "weights or a shorter sample period would help."
        )
    return {
        "largest_real_part": float(poles[worst].real),
        "fastest_pole": float(abs(poles[fastest])),
    }


def check_sampled_loop(plants: list[Plant], discrete: Bank, r: Array, h: float) -> float:
    """Refuse a controller whose sampled loop, with the plant held at each speed, is unstable.

    Parameters
    ----------
    plants : k plants in SI, one per speed
    discrete : the k controllers in discrete time
    r : (k,) m/s, for the message
    h : sample period [s]

    Returns
    -------
    float
        The largest modulus of a closed-loop pole in discrete time, below 1.

    Raises
    ------
    DesignError
        With the modulus and the speed.
    """
    n, m = plants[0].order, discrete.A.shape[1]
    k = len(plants)
    together = np.zeros((k, n + 1, n + 1))
    together[:, :n, :n] = [plant.A for plant in plants]
    together[:, :n, n:] = [plant.B2 for plant in plants]
    stepped = linalg.expm(together * h)
    loop = np.zeros((k, n + m, n + m))
    loop[:, :n, :n] = stepped[:, :n, :n]
    loop[:, :n, n:] = stepped[:, :n, n:] @ discrete.C
    loop[:, n:, :n] = discrete.B @ np.array([plant.C2 for plant in plants])
    direct = np.array([plant.D22 for plant in plants])
    loop[:, n:, n:] = discrete.A + discrete.B @ direct @ discrete.C
    moduli = np.abs(np.linalg.eigvals(loop)).max(axis=1)
    worst = int(np.argmax(moduli))
    if moduli[worst] >= 1.0:
        raise DesignError(
            f"sampled at {h:g} s the closed loop is unstable{_at(r, worst)}: a pole of modulus "
            f"{moduli[worst]:.6g}. A shorter sample period or less demanding weights would help."
        )
    return float(moduli[worst])


def closed_loop_norms(plants: list[Plant], bank: Bank, r: Array) -> Array:
    """Return the closed-loop H-infinity norms with plant and controller held at each speed r (k,).

    Raises
    ------
    DesignError
        If a closed loop is unstable.
    """
    pairs = counted(list(enumerate(plants)), "verifying the closed loop: norm")
    norms = np.array([hinf_norm(plant.closed_loop(bank.at(k))) for k, plant in pairs])
    if not np.all(np.isfinite(norms)):
        k = int(np.argmax(~np.isfinite(norms)))
        raise DesignError(f"the closed loop is unstable{_at(r, k)}, whatever the solver said.")
    return norms


def check_bound(norms: Array, bound: float, r: Array) -> None:
    """Refuse norms (k,) above the bound that the solver promised.

    Raises
    ------
    DesignError
        With both.
    """
    k = int(np.argmax(norms))
    if norms[k] > bound * (1.0 + BEYOND):
        raise DesignError(
            f"the closed-loop norm{_at(r, k)} is {norms[k]:.6g}, above the bound {bound:.6g}: "
            "the solution cannot be trusted. A larger tau or a higher order would help."
        )


def _at(r: Array, k: int) -> str:
    return f" at {r[k]:.4g} m/s" if len(r) > 1 else ""


def _number(value: complex) -> str:
    sign = "+" if value.imag >= 0.0 else "-"
    return f"{value.real:.4g}{sign}{abs(value.imag):.4g}j" if value.imag else f"{value.real:.4g}"
