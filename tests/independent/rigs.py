"""Test rigs of two sizes, and their base laws.

Symbols here: Y the yield force, D the drag, both straight lines in the voltage; w the speed;
kappa the inverse length over which a bristle turns over. The two laws are those of the project's
physics notes, sections 3.1 and 3.2, whose table is the centre of the parameters:

    Bingham    force = Y(E) sgn(w) + D(E) w / exp(|w| / w_n)
    LuGre      over the path s = integral of |w| dt the bristle's share m = kappa z relaxes,
                   dm/ds = kappa (sgn(w) - m),
               force = Y(E) m + (sigma_1 / kappa) w dm/ds sgn(w) + D(E) w / exp(|w| / w_n)

Over a prescribed motion the share m therefore has a closed form between reversals.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

V_MAX = 8.0  # V, both sizes

# Centre of the parameters, 10 N size, SI units.
BINGHAM = {"f_c": 1.3, "f_v": 0.83, "c_0": 100.0, "c_v": 20.0, "v_n": 0.02}
LUGRE = {
    "sigma_a": 650.0,
    "sigma_0": 415.0,
    "sigma_1": 5.0,
    "sigma_2": 100.0,
    "sigma_b": 20.0,
    "v_n": 0.02,
    "a_0": 500.0,
}
# Powers of force, speed and length with which each parameter grows from one size to another.
GROWTH = {
    "f_c": (1, 0, 0),
    "f_v": (1, 0, 0),
    "c_0": (1, -1, 0),
    "c_v": (1, -1, 0),
    "v_n": (0, 1, 0),
    "sigma_a": (1, 0, -1),
    "sigma_0": (1, 0, -1),
    "sigma_1": (1, -1, 0),
    "sigma_2": (1, -1, 0),
    "sigma_b": (1, -1, 0),
    "a_0": (0, 0, -1),
}
SIZES = {"10N": (1.0, 1.0, 1.0), "2kN": (200.0, 2.5, 2.5)}  # force, speed, length
RIGS = ("bench_10N", "bench_2kN", "structure_10N", "structure_2kN")
LAWS = ("bingham", "lugre")

# The building of the physics notes, section 2.2 to 2.4 (masses kg, stiffnesses N/m).
MASSES = (1.96935633694460, 1.23224427177553, 1.23224427177553)
STIFFNESSES = (1057.0, 1366.48048703339, 1366.48048703339)
RATIO, MODES = 0.01, (1, 3)


@dataclass(frozen=True)
class Rig:
    """A damper, what it is mounted in, and the scales that bounds refer to."""

    name: str
    law: str
    values: dict[str, float]  # parameters of the base law under their usual names, SI
    force: float  # N, about the largest force
    speed: float  # m/s, the largest test speed
    stroke: float  # m, from the middle to either end
    building: dict[str, Any] | None = None  # masses kg, stiffnesses N/m, alpha 1/s, beta s
    scales: tuple[float, float, float] = field(default=(1.0, 1.0, 1.0))

    @property
    def lines(self) -> tuple[float, float, float, float]:
        """Y(0) N, dY/dE N/V, D(0) N s/m, dD/dE N s/(m V)."""
        p = self.values
        if self.law == "bingham":
            return p["f_c"], p["f_v"], p["c_0"], p["c_v"]
        return p["sigma_a"] / p["a_0"], p["sigma_0"] / p["a_0"], p["sigma_2"], p["sigma_b"]


def centre(law: str, size: str) -> dict[str, float]:
    """Parameters of the table, grown to a size."""
    table = BINGHAM if law == "bingham" else LUGRE
    grown = {}
    for name, value in table.items():
        powers = zip(SIZES[size], GROWTH[name], strict=True)
        grown[name] = value * float(np.prod([scale**power for scale, power in powers]))
    return grown


def draw_rig(name: str, law: str, rng: np.random.Generator, spread: float = 0.15) -> Rig:
    """A rig whose parameters lie up to `spread` off the table, each by itself.

    Raises
    ------
    ValueError
        If the rig or the law is not known.
    """
    if name not in RIGS or law not in LAWS:
        raise ValueError(f"rig {name!r} and law {law!r}: there are {RIGS} and {LAWS}")
    bed, size = name.split("_")
    scales = SIZES[size]
    values = {
        key: value * (1.0 + rng.uniform(-spread, spread))
        for key, value in centre(law, size).items()
    }
    speed = rng.uniform(0.14, 0.22) if size == "10N" else rng.uniform(0.32, 0.5)
    building = None
    if bed == "structure":
        mass = scales[0] / scales[2]  # frequencies stay, displacements grow with the stroke
        m = np.array(MASSES) * mass * (1.0 + rng.uniform(-spread, spread, 3))
        k = np.array(STIFFNESSES) * mass * (1.0 + rng.uniform(-spread, spread, 3))
        alpha, beta = rayleigh(m, k)
        building = {
            "masses": m.tolist(),
            "stiffnesses": k.tolist(),
            "alpha": alpha,
            "beta": beta,
            "ratio": RATIO,
            "modes": list(MODES),
        }
    return Rig(name, law, values, 10.0 * scales[0], speed, 0.02 * scales[2], building, scales)


def rayleigh(masses: Array, stiffnesses: Array) -> tuple[float, float]:
    """Coefficients alpha [1/s], beta [s] that give RATIO in the two MODES (first mode = 1)."""
    k = np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
    k -= np.diag(stiffnesses[1:], 1) + np.diag(stiffnesses[1:], -1)
    root = np.sqrt(1.0 / masses)
    omega = np.sqrt(np.linalg.eigvalsh(root[:, None] * k * root[None, :]))
    a, b = omega[MODES[0] - 1], omega[MODES[1] - 1]
    return 2.0 * RATIO * a * b / (a + b), 2.0 * RATIO / (a + b)


def damper_force(rig: Rig, w: Array, volts: Array, share: Array | None = None) -> Array:
    """Closed form of the base law, N; share (n,) is m = kappa z of the LuGre law."""
    y0, y1, d0, d1 = rig.lines
    drag = (d0 + d1 * volts) * w * np.exp(-np.abs(w) / rig.values["v_n"])
    if rig.law == "bingham":
        return (y0 + y1 * volts) * np.sign(w) + drag
    if share is None:
        raise ValueError("the LuGre law needs the bristle's share")
    turn = rig.values["sigma_1"] * (w - np.abs(w) * share)
    return (y0 + y1 * volts) * share + turn + drag
