"""The damper of an example: a yield force, a drag, and what may be hidden in it.

Symbols: w speed across the fluid, Y yield force, D drag, E the voltage that the coil's field
follows, m the bristle's share of its largest deflection.

    fluid  = shape(w) (Y(E) m + D(E) w exp(-|w|/w_n)),   Y = Y_0 + Y_1 E,   D = D_0 + D_1 E
    bingham     m = sgn w
    lugre       m' = (w - |w| m)/l, and a damping c l m' beside
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import copysign, exp, inf, pi, sin, tanh

STICK, SETTLE = 2e-5, 2e-4
"""Travel [m] over which a yield force builds up where a free body has to come to rest, and the time
[s] within which the body then settles."""

STILL = 1e-8
"""Speed [m/s] below which a bench stands still: its spline leaves rest to rounding."""

Values = Mapping[str, float]


NAMES = {
    "bingham": {"f_c": "Y_0", "f_v": "Y_1", "c_0": "D_0", "c_v": "D_1", "v_n": "w_n"},
    "lugre": {"sigma_2": "D_0", "sigma_b": "D_1", "v_n": "w_n", "sigma_1": "c"},
}
"""The library's names of values that are the same in both."""


def in_library_names(law: str, values: Values) -> dict[str, float]:
    """Return the values of a damper under the names, and in the form, that the library gives."""
    same = {name: values[own] for name, own in NAMES[law].items()}
    if law == "bingham":
        return same
    bent = {"sigma_a": values["Y_0"], "sigma_0": values["Y_1"], "a_0": 1.0}
    return {name: value / values["l"] for name, value in bent.items()} | same


@dataclass
class Damper:
    """A damper with what is hidden in it; states are a plain list in the order of `states`.

    `values` of the law, `hidden` of the effects, both in SI.
    """

    law: str
    values: Values
    hidden: Values = field(default_factory=dict)
    states: list[str] = field(init=False)

    def __post_init__(self) -> None:
        h = self.hidden
        groups = {
            "share": self.law != "bingham" or "mount_k" in h,
            "field": "coil_tau" in h,
            "heat": "heat_capacity" in h,
            "piston": "mount_k" in h,
            "piston_speed": "mount_k" in h,
        }
        self.states = [name for name, there in groups.items() if there]

    def scales(self, stroke: float, speed: float) -> list[float]:
        """Return the size of each state, for the integrator's tolerances."""
        sizes = {"share": 1.0, "field": 1.0, "heat": 0.1, "piston": 0.1 * stroke}
        return [sizes.get(name, speed) for name in self.states]

    def respond(
        self, motion: tuple[float, float, float], volts: float, states: list[float]
    ) -> tuple[float, list[float]]:
        """Return the force on the rod and the rates of the states.

        Parameters
        ----------
        motion : tuple
            Displacement [m], velocity [m/s] and acceleration [m/s2] of the rod.
        volts : float
            The commanded voltage [V].
        states : list
            In the order of `states`.
        """
        x, v, a = motion
        h, now = self.hidden, dict(zip(self.states, states, strict=True))
        rates: dict[str, float] = {}
        e = volts
        if "field" in now:
            e = now["field"]
            rates["field"] = (volts - e) / h["coil_tau"]
        if "field_limit" in h:
            e = h["field_limit"] * tanh(e / h["field_limit"])
        w = now.get("piston_speed", v)
        where = now.get("piston", x)
        fluid = self._fluid(w, e, now, rates) * self._shape(where, w)
        if "heat" in now:
            fluid *= exp(-now["heat"])
            rates["heat"] = fluid * w / h["heat_capacity"] - now["heat"] / h["heat_tau"]
        if "piston" in now:  # a light piston behind a rubber bush
            bush = h["mount_k"] * (x - where) + h["mount_c"] * (v - w)
            rates["piston"], rates["piston_speed"] = w, (bush - fluid) / h["mount_mass"]
            fluid = bush
        return fluid + self._beside(x, v, a), [rates[name] for name in self.states]

    def _fluid(self, w: float, e: float, now: dict[str, float], rates: dict[str, float]) -> float:
        """Return the law's force; the share's rate goes into `rates`."""
        p = self.values
        limit = p["Y_0"] + p["Y_1"] * e
        limit *= 1.0 + self.hidden.get("creep_rise", 0.0) * exp(
            -((w / self.hidden.get("creep_speed", inf)) ** 2)
        )
        drag = (p["D_0"] + p["D_1"] * e) * w * exp(-abs(w) / p["w_n"])
        if "share" not in now:
            return limit * (copysign(1.0, w) if abs(w) > STILL else 0.0) + drag
        m, length = now["share"], p.get("l", STICK)
        turn = w - abs(w) * m
        rates["share"] = turn / length
        return limit * m + p.get("c", limit * SETTLE / length) * turn + drag

    def _shape(self, x: float, w: float) -> float:
        """Return the factor of what changes the fluid's whole force."""
        h, factor = self.hidden, 1.0
        if "valve_ratio" in h:
            factor *= 1.0 + h["valve_ratio"] * tanh(w / h["valve_speed"])
        if "thinning" in h:
            factor /= 1.0 + h["thinning"] * abs(w)
        if "bore_loss" in h:
            factor *= 1.0 - h["bore_loss"] * exp(-((x / h["bore_length"]) ** 2))
        return factor

    def _beside(self, x: float, v: float, a: float) -> float:
        """Return the forces in parallel with the fluid."""
        h = self.hidden
        total = h.get("fluid_mass", 0.0) * a
        if "gas_k" in h:  # a polytropic gas column that the rod shortens
            length, power = h["gas_length"], h["gas_power"]
            total += h["gas_k"] * length / power * ((1.0 - x / length) ** -power - 1.0)
        if "orifice" in h:
            total += copysign(h["orifice"] * abs(v) ** h["orifice_power"], v)
        if "ripple" in h:
            total += h["ripple"] * sin(2.0 * pi * x / h["ripple_length"])
        return total
