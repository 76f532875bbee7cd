"""Devices of examples that nothing commands, each with what may be hidden in it.

Symbols: w speed across the device, x its displacement; all in SI.

    shock_absorber  valves K s = A(u), s' = w - u, A = a_2 u + (a_1 - a_2) b tanh(u/b), other
                    numbers either way; seals B m, m' = (w - |w| m)/l; gas G (1 - (1 + x/L)^-n) - G
    friction_damper R n, n = s beyond the gap/l, s' = w - |w| n; beside a drag and a spring
    isolator        lead Y y, y' = (w - (t |w y| + (1 - t) w y) y)/l; rubber R x + H x^3 + D w
    fluid_viscous   K s, s' = w - W sgn(s) |K s/P|^(1/p), W = 1 m/s
"""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, tanh

Values = dict[str, float]

DEVICES: dict[str, Values] = {
    "shock_absorber": {
        "out_1": 70.0, "out_2": 25.0, "out_b": 0.05, "back_1": 25.0, "back_2": 40.0, "back_b": 0.06,
        "K": 8e3, "B": 1.0, "l": 5e-4, "G": 2.0, "L": 0.1, "n": 1.3,
    },
    "friction_damper": {"R": 6.0, "l": 1e-3, "gap": 6e-4, "D": 6.0, "S": 60.0},
    "isolator": {"Y": 4.0, "l": 1.2e-3, "t": 0.8, "R": 250.0, "H": 3e5, "D": 6.0},
    "fluid_viscous": {"P": 20.0, "p": 0.5, "K": 6e3},
}  # fmt: skip
"""Numbers of devices of about 10 N, by the library's name of the law."""

Now = dict[str, float]


def _shock_absorber(p: Values, w: float, now: Now, rates: Now) -> float:
    force, m = p["K"] * now["strain"], now["seal"]
    side = "out" if force >= 0.0 else "back"
    first, fast, knee = (p[f"{side}_{what}"] for what in ("1", "2", "b"))
    slow, quick = 0.0, abs(force) / min(first, fast)
    for _ in range(48):  # the speed at which the valves carry that
        u = 0.5 * (slow + quick)
        if fast * u + (first - fast) * knee * tanh(u / knee) > abs(force):
            quick = u
        else:
            slow = u
    rates["strain"] = w - copysign(0.5 * (slow + quick), force)
    rates["seal"] = (w - abs(w) * m) / p["l"]
    return force + p["B"] * m


def _friction_damper(p: Values, w: float, now: Now, rates: Now) -> float:
    s = now["offset"]
    bent = copysign(max(abs(s) - p["gap"], 0.0), s) / p["l"]
    rates["offset"] = w - abs(w) * bent
    return p["R"] * bent + p["D"] * w


def _isolator(p: Values, w: float, now: Now, rates: Now) -> float:
    y = now["core"]
    rates["core"] = (w - (p["t"] * abs(w * y) + (1.0 - p["t"]) * w * y) * y) / p["l"]
    return p["Y"] * y + p["D"] * w


def _fluid_viscous(p: Values, w: float, now: Now, rates: Now) -> float:
    force = p["K"] * now["strain"]
    rates["strain"] = w - copysign(abs(force / p["P"]) ** (1.0 / p["p"]), force)
    return force


FORCE: dict[str, Callable[[Values, float, Now, Now], float]] = {
    "shock_absorber": _shock_absorber,
    "friction_damper": _friction_damper,
    "isolator": _isolator,
    "fluid_viscous": _fluid_viscous,
}
"""Each device's force [N] from its numbers, speed [m/s] and states, whose rates it fills in."""

STATES = {
    "shock_absorber": {"strain": 1e-3, "seal": 1.0},
    "friction_damper": {"offset": 1e-3},
    "isolator": {"core": 1.0},
    "fluid_viscous": {"strain": 1e-3},
}
"""States of each device and their sizes, for the integrator's tolerances."""


def beside(law: str, p: Values, x: float) -> float:
    """Return the springs of a device at the displacement x [m]."""
    if law == "shock_absorber":
        return float(-p["G"] * (1.0 + x / p["L"]) ** -p["n"])
    if law == "isolator":
        return p["R"] * x + p["H"] * x**3
    return p.get("S", 0.0) * x


def in_library_names(law: str, p: Values) -> Values:
    """Return the values of a device under the names, and in the form, that the library gives."""
    if law == "shock_absorber":
        stiffness = p["n"] * p["G"] / p["L"]
        valves = {
            f"{name}{own}": p[f"{side}_{what}"]
            for side, tail in (("out", "r"), ("back", "c"))
            for name, own, what in (("c_", f"{tail}1", "1"), ("c_", f"{tail}2", "2"),
                                    ("v_", tail, "b"))
        }  # fmt: skip
        gas = {"f_0": -p["G"], "k_g": stiffness, "k_g2": -stiffness * (p["n"] + 1.0) / 2.0 / p["L"]}
        return {**valves, "f_s": p["B"], "rho": 1.0 / p["l"], "give": 1.0 / p["K"], **gas}
    if law == "friction_damper":
        return {"f_c": p["R"], "rho": 1.0 / p["l"], "play": p["gap"], "c": p["D"], "k": p["S"]}
    if law == "isolator":
        rubber = {"k": p["R"], "k_3": p["H"], "c": p["D"]}
        return {"q": p["Y"], "rho": 1.0 / p["l"], "sigma": p["t"], **rubber}
    c = p["P"] * 0.1 ** p["p"]
    return {"c": c, "alpha": p["p"], "give": c / p["K"]}
