"""Numbers of the model and of the designs, for the ledger and the report's text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bristle.physics.building import frequencies, paper_building
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

from .experiment import Motion

if TYPE_CHECKING:
    from bristle.synthesis import Controller

SPEEDS = tuple(float(v) for v in np.linspace(0.0025, 0.2, 80))
"""m/s, at which the steady force is taken."""
VOLTAGES = (0.0, 4.0, 8.0)


def facts(designs: dict[str, Controller], motions: list[Motion]) -> dict[str, Any]:
    """Return what the ledger asks of the model and of the designs "hinf" and "lpv".

    Keys: "sample_period" [s], "stroke" [m], "k_b" [N/m], "frequencies" [Hz], "first_mode" [rad/s],
    "damping_ratio" of the first mode [1], "speeds" [m/s], "steady" {voltage [V]: forces [N]},
    "force_at_8V" [N], "weight_corner" [rad/s], "paper_windows" {motion: s}, "designs" (facts of
    each).
    """
    from bristle.fmu import catalogue

    building = paper_building()
    own = frequencies(building)
    steady = {V: [steady_force(v, V) for v in SPEEDS] for V in VOLTAGES}
    K = np.array(building.K)
    weight = designs["hinf"].design["weights"]["acceleration"]
    return {
        "sample_period": designs["lpv"].sample_period,
        "stroke": catalogue.instantiate("LuGreDamper")["stroke"],
        "k_b": float(K[0].sum()),
        "frequencies": [float(value) for value in own],
        "first_mode": 2.0 * np.pi * float(own[0]),
        "damping_ratio": first_damping_ratio(building),
        "speeds": list(SPEEDS),
        "steady": steady,
        "force_at_8V": max(steady[8.0]),
        "weight_corner": corner(weight),
        "paper_windows": {motion.name: motion.paper_window for motion in motions},
        "designs": {kind: dict(design.facts) for kind, design in designs.items()},
    }


def steady_force(v: float, V: float) -> float:
    """Return the LuGre force [N] in steady sliding at v [m/s] and V [V]."""
    from bristle.component.control_laws import force_of_law

    p = [parameter.value for parameter in LuGre.parameters.values()]
    bent = 1.0 / LuGre.parameters["a_0"].value
    return force_of_law(law_code(LuGre.name), p, v, V, [bent])


def first_damping_ratio(building: Any) -> float:
    """Return the damping ratio of the first mode [1], from the poles."""
    M, C, K = (np.array(matrix) for matrix in (building.M, building.C, building.K))
    n = len(M)
    lower = -np.linalg.solve(M, np.hstack([K, C]))
    poles = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))
    slowest = poles[np.argmin(np.abs(poles))]
    return float(-slowest.real / abs(slowest))


def corner(weight: dict[str, Any]) -> float:
    """Return the corner of a low-pass weight [rad/s]: the size of its slowest pole."""
    return float(np.abs(np.roots(weight["denominator"])).min())
