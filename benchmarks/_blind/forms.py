"""Which forms of the generator are bristle's own, shape parameter included, and their true values.

A case is "same form" if some value of bristle's parameters gives the generator's law, or comes as
near as one wishes (a rigid stop is the limit of a stiff one); else it is "other form".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Fields = dict[str, Any]
Values = dict[str, float]


def _blasius(f: Fields) -> Values:
    # The generator scales b so that both exponents give equal forces at quad_w.
    return {"c_2": f["quad_b"] * f["quad_w"] ** (2.0 - f["quad_p"]), "shape": f["quad_p"]}


def _rigid(f: Fields) -> Values:
    # The limit of a stiff contact: it gives by 2 % of the gap under the largest force.
    k = 50.0 * f["force"] / f["se_gap"]
    return {"gap": f["se_gap"], "k": k, "c": (k * f["se_m"]) ** 0.5, "mass": f["se_m"]}


SAME: dict[tuple[str, str], Callable[[Fields], Values]] = {
    ("stribeck", "gaussian"): lambda f: {"rise": f["st_s"], "v_s": f["st_w"], "shape": 2.0},
    ("stribeck", "exponential"): lambda f: {"rise": f["st_s"], "v_s": f["st_w"], "shape": 1.0},
    ("flattening", "rational"): lambda f: {"v_f": 1.0 / f["flat_a"], "shape": 1.0},
    ("flattening", "exponential"): lambda f: {"v_f": 1.0 / f["flat_a"], "shape": 0.0},
    ("quadratic_damping", "square"): lambda f: {"c_2": f["quad_b"], "shape": 2.0},
    ("quadratic_damping", "blasius"): _blasius,
    ("asymmetry", "step"): lambda f: {"ratio": f["asym_s"], "v_s": 1e-6},
    ("presliding", "dahl"): lambda f: {"x_s": f["pre_len"], "shape": 1.0},
    ("temperature", "arrhenius"): lambda f: {
        "E_0": f["hot_cap"], "tau": f["hot_tau"], "part": 0.5,
    },
    ("gas_spring", "linear"): lambda f: {"k": f["gas_k"], "preload": 0.0, "k_2": 0.0, "k_3": 0.0},
    ("gas_spring", "preloaded"): lambda f: {
        "k": f["gas_k"], "preload": f["gas_f"], "k_2": 0.0, "k_3": 0.0,
    },
    ("gas_spring", "progressive"): lambda f: {
        "k": f["gas_k"], "preload": 0.0, "k_2": 0.0, "k_3": f["gas_k"] / f["gas_a"] ** 2,
    },
    ("fluid_inertia", "mass"): lambda f: {"m_f": f["mass"]},
    ("mount_compliance", "kelvin_voigt"): lambda f: {"k": f["se_k"], "c": f["se_c"]},
    ("backlash", "rigid"): _rigid,
    ("coil_lag", "first_order"): lambda f: {"tau": f["coil_up"]},
    ("remanence", "play"): lambda f: {"width": f["rem_r"]},
    ("saturation", "froehlich"): lambda f: {"V_s": f["sat_v"], "shape": 1.0},
    ("delay", "transport"): lambda f: {"tau": f["late"]},
    ("velocity_sensor", "lag"): lambda f: {"tau": f["time"]},
}  # fmt: skip
"""The generator's (effect, form) that bristle has, and what its parameters are there."""

LIMITS = (
    "asymmetry.v_s", "gas_spring.preload", "gas_spring.k_2", "gas_spring.k_3", "backlash.k",
    "backlash.c", "backlash.mass",
)  # fmt: skip
"""True values at zero or at a limit: an interval about them says nothing of coverage."""


def is_same(effect: str, form: str) -> bool:
    """Return whether bristle's form of the effect contains the generator's."""
    return (effect, form) in SAME


def true_values(found: dict[str, Any], force: float) -> Values | None:
    """Return bristle's parameters of a hidden effect, `effect.name` to SI; None for other forms.

    `found` is one entry of the truth's effects, `force` [N] about the rig's largest.
    """
    convert = SAME.get((found["effect"], found["form"]))
    if convert is None:
        return None
    own = convert({**found["parameters"], "force": force})
    return {f"{found['effect']}.{name}": float(value) for name, value in own.items()}
