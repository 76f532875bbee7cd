"""How well each damper law fits a damper that is known: the paper's identification, done anew.

The rig of the paper's section III-C on the model: the table shakes by a chirp of 1 to 10 Hz for
70 s, the voltage is a sine of 2 Hz and 5 V, signals are low-passed at 18 Hz. What the specimen was
there is lost; here it is the LuGre law itself, with the reconstructed bristle and with one four
times stiffer, and noise on its force.
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp, log
from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.component.control_laws import estimate_states
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

from ..runs import Runs

if TYPE_CHECKING:
    import pandas as pd

Array = np.ndarray[Any, Any]

STEP = 0.002
CUT_OFF = 18.0  # Hz
NOISE = 0.03
"""Standard deviation of the noise as a share of the force's RMS."""
STIFFNESS = {"bristle a_0 = 500 1/m": 1.0, "bristle a_0 = 2000 1/m": 4.0}
"""Specimens: the reconstructed bristle, and one so many times stiffer; same steady sliding."""
RUNS = len(STIFFNESS)
LAWS = ("Bingham", "Bingham, standard", "LuGre", "LuGre, standard")
_SCENARIO = "stiction_base_acceleration"


def errors(runs: Runs) -> pd.DataFrame:
    """Return the error of each law's best fit to each specimen.

    Returns
    -------
    DataFrame
        "specimen", "law", "error [N]" (RMS over the test) and "share" of the force's RMS.
    """
    import pandas as pd

    rows = []
    for specimen, factor in STIFFNESS.items():
        frame = runs(_SCENARIO, experiment(factor))
        v = frame["structure.base_velocity"].to_numpy()
        V = frame["voltage.value"].to_numpy()
        force = frame["damper.force"].to_numpy()
        spread = NOISE * float(np.sqrt(np.mean(force**2)))
        noisy = force + np.random.default_rng(1).normal(0.0, spread, len(force))
        found = fits(v, V, noisy)
        size = float(np.sqrt(np.mean(low_passed(force) ** 2)))
        rows += [(specimen, law, found[law], found[law] / size) for law in LAWS]
    return pd.DataFrame(rows, columns=["specimen", "law", "error [N]", "share"])


def experiment(factor: float) -> dict[str, object]:
    """Return the overrides that make the stock scenario the rig, the bristle so much stiffer."""
    a_0, sigma_a, sigma_0 = (LuGre.parameters[name].value for name in ("a_0", "sigma_a", "sigma_0"))
    chirp = {"kind": "chirp", "amplitude": 0.65, "frequency": 1.0, "frequency_end": 10.0}
    sine = {"kind": "sine", "amplitude": 2.5, "offset": 2.5, "frequency": 2.0}
    specimen = {"a_0": a_0, "sigma_a": sigma_a, "sigma_0": sigma_0}
    return {
        "run.stop": 70.0,
        "run.step": STEP,
        **{f"ground.{key}": value for key, value in chirp.items()},
        "ground.duration": 70.0,
        "voltage.fmu": "SignalSource",
        "voltage.level": 0.0,
        **{f"voltage.{key}": value for key, value in sine.items()},
        "connections.damper.voltage": "voltage.value",
        **{f"damper.{key}": factor * value for key, value in specimen.items()},
    }


def fits(v: Array, V: Array, force: Array) -> dict[str, float]:
    """Return the RMS error [N] of the best fit of each law to a force (n,) [N].

    At given v_n and a_0 the laws are linear in what is left: so these two are searched for, and
    the rest follows by least squares.

    Parameters
    ----------
    v, V : (n,) arrays
        Velocity [m/s] and voltage [V], every `STEP`.
    """
    target = low_passed(force)

    def left(columns: list[Array]) -> float:
        basis = low_passed(np.column_stack(columns))
        values = np.linalg.lstsq(basis, target, rcond=None)[0]
        return float(np.sqrt(np.mean((basis @ values - target) ** 2)))

    def bingham(v_n: float) -> float:
        s, w = np.sign(v), v * np.exp(-np.abs(v) / v_n)
        return left([s, s * V, w, w * V])

    def lugre(a_0: float, v_n: float) -> float:
        z, w = deflection(v, a_0), v * np.exp(-np.abs(v) / v_n)
        return left([z, z * V, v - a_0 * np.abs(v) * z, w, w * V])

    plain = 1e6  # m/s: the exponential is 1
    return {
        "Bingham": least(lambda x: bingham(exp(x[0])), [log(0.03)]),
        "Bingham, standard": bingham(plain),
        "LuGre": least(lambda x: lugre(exp(x[0]), exp(x[1])), [log(800.0), log(0.03)]),
        "LuGre, standard": least(lambda x: lugre(exp(x[0]), plain), [log(800.0)]),
    }


def least(error: Callable[[Any], float], start: list[float]) -> float:
    """Return the least error that a simplex search from `start` finds."""
    from scipy.optimize import minimize

    found = minimize(error, start, method="Nelder-Mead", options={"xatol": 0.01, "fatol": 1e-5})
    return float(found.fun)


def deflection(v: Array, a_0: float) -> Array:
    """Return the bristle deflection (n,) [m] from 0 on, the velocity linear between samples."""
    law, p = (
        law_code(LuGre.name),
        [{"a_0": a_0}.get(n, one.value) for n, one in LuGre.parameters.items()],
    )
    z, found = [0.0], [0.0]
    for mean in (0.5 * (v[1:] + v[:-1])).tolist():
        estimate_states(law, p, mean, 0.0, STEP, z)
        found.append(z[0])
    return np.array(found)


def low_passed(values: Array) -> Array:
    """Return signals (n,) or (n, m) below 18 Hz, without lag."""
    from scipy.signal import butter, sosfiltfilt

    filtered: Array = sosfiltfilt(butter(2, CUT_OFF * 2.0 * STEP, output="sos"), values, axis=0)
    return filtered


def gain(table: pd.DataFrame, specimen: str, law: str) -> float:
    """Return by which share the modified law's error lies below the standard law's."""
    part = table[table["specimen"] == specimen].set_index("law")["error [N]"]
    return float(1.0 - part[law] / part[f"{law}, standard"])
