"""Which forms of the generator are bristle's own, shape parameter included, and their true values.

A case is "same form" if some value of bristle's parameters gives the generator's law, or comes as
near as one wishes (a rigid stop is the limit of a stiff one); else it is "other form". The memory
of the fluid's inertia is one: each code has its own sum of exponentials for 1/sqrt(t), and they
differ by some per cent of that force.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Fields = dict[str, Any]
Values = dict[str, float]


def _blasius(f: Fields) -> Values:
    # Both write the power law about a speed of reference, the generator about the rig's top speed.
    return {"c_2": f["quad_b"] * (f["quad_w"] / 0.1) ** (2.0 - f["quad_p"]), "shape": f["quad_p"]}


def _stribeck(shape: float, way: float) -> Callable[[Fields], Values]:
    return lambda f: {"rise": f["st_s"], "v_s": f["st_w"], "shape": shape, "way": way}


def _flattening(shape: float) -> Callable[[Fields], Values]:
    return lambda f: {"v_f": 1.0 / f["flat_a"], "shape": shape, "bend": 1.0}


def _carreau(f: Fields) -> Values:
    shape = 2.0 / f["flat_n"]
    return {"v_f": shape**0.5 / f["flat_a"], "shape": shape, "bend": 2.0}


def _gas(f: Fields) -> Values:
    k_3 = f["gas_k"] / f["gas_a"] ** 2 if f["gas_kind"] == 3 else 0.0
    return {"k": f["gas_k"], "preload": f.get("gas_f", 0.0), "k_2": 0.0, "k_3": k_3}


def _mount(f: Fields) -> Values:
    hard = (1e-3 / f["se_u"]) ** 2 if f["series_kind"] == 2 else 0.0
    return {"k": f["se_k"], "c": f["se_c"], "hard": hard}


def _coil(f: Fields) -> Values:
    up, down = f["coil_up"], f["coil_down"]
    if f["coil_kind"] == 3:
        return {"tau": up, "fall": 1.0, "eddy": down / up}
    return {"tau": (up * down) ** 0.5, "fall": down / up, "eddy": 0.0}


def _rigid(f: Fields) -> Values:
    # The limit of a stiff contact: it gives by 2 % of the gap under the largest force.
    k = 50.0 * f["force"] / f["se_gap"]
    return {"gap": f["se_gap"], "k": k, "c": (k * f["se_m"]) ** 0.5, "mass": f["se_m"]}


SAME: dict[tuple[str, str], Callable[[Fields], Values]] = {
    ("stribeck", "gaussian"): _stribeck(2.0, 0.0),
    ("stribeck", "exponential"): _stribeck(1.0, 0.0),
    ("stribeck", "gaussian_state"): _stribeck(2.0, 1.0),
    ("stribeck", "exponential_state"): _stribeck(1.0, 1.0),
    ("flattening", "rational"): _flattening(1.0),
    ("flattening", "exponential"): _flattening(0.0),
    ("flattening", "carreau"): _carreau,
    ("quadratic_damping", "square"): lambda f: {"c_2": f["quad_b"], "shape": 2.0},
    ("quadratic_damping", "blasius"): _blasius,
    ("asymmetry", "step"): lambda f: {"ratio": f["asym_s"], "v_s": 1e-6, "side": 0.0},
    ("presliding", "dahl"): lambda f: {"x_s": f["pre_len"], "shape": 1.0},
    ("temperature", "arrhenius"): lambda f: {
        "E_0": f["hot_cap"], "tau": f["hot_tau"], "part": 0.5, "housing": 0.0,
    },
    ("gas_spring", "linear"): _gas,
    ("gas_spring", "preloaded"): _gas,
    ("gas_spring", "progressive"): _gas,
    ("fluid_inertia", "mass"): lambda f: {"m_f": f["mass"], "m_h": 0.0},
    ("mount_compliance", "kelvin_voigt"): _mount,
    ("mount_compliance", "hardening"): _mount,
    ("backlash", "rigid"): _rigid,
    ("coil_lag", "first_order"): _coil,
    ("coil_lag", "rise_and_fall"): _coil,
    ("coil_lag", "eddy"): _coil,
    ("remanence", "play"): lambda f: {"width": f["rem_r"], "spread": 0.0},
    ("saturation", "froehlich"): lambda f: {"V_s": f["sat_v"], "shape": 1.0},
    ("delay", "transport"): lambda f: {"time": f["late"], "filtered": 0.0},
    ("velocity_sensor", "lag"): lambda f: {
        "gain": 1.0, "tau": f["time"], "shape": 0.0, "corner": 0.0,
    },
    ("velocity_sensor", "geophone"): lambda f: {
        "gain": 1.0, "tau": 0.0, "shape": 0.0, "corner": f["corner"],
    },
    ("velocity_sensor", "second_order"): lambda f: {
        "gain": 1.0, "tau": 2.0 * f["damping"] / f["corner"], "shape": 0.25 / f["damping"] ** 2,
        "corner": 0.0,
    },
}  # fmt: skip
"""The generator's (effect, form) that bristle has, and what its parameters are there."""

LIMITS = (
    "asymmetry.v_s", "gas_spring.preload", "gas_spring.k_2", "gas_spring.k_3", "backlash.k",
    "backlash.c", "backlash.mass", "delay.filtered", "velocity_sensor.shape",
    "stribeck.way", "asymmetry.side", "temperature.housing", "coil_lag.eddy", "remanence.spread",
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
