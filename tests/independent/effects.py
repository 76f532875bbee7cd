"""Hidden effects, each in two or more forms of the literature.

A form is a function (s, rng, rig, size) -> fields of the plant: s in (0, 1] is the strength, 0 would
be no effect and 1 the most that is physically plausible on that rig; rng draws the shape and is
handed over in the same state for every s; `size` holds what the rig did without the effect
(travel m of the base, drift m of a storey; buildings only). The equations themselves are the
kernel's; each docstring states them with the source.
Symbols: w speed across the fluid, x displacement, Y yield force, E felt voltage, S top speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .rigs import V_MAX, Rig

Fields = dict[str, Any]
Size = dict[str, float]


@dataclass(frozen=True)
class Form:
    """One functional form of one effect."""

    effect: str
    name: str
    laws: tuple[str, ...]
    beds: tuple[str, ...]
    outside: str  # "" for the library's effects, else the coordinate that organises the effect
    least: float  # s below which the effect is finer than a rig can be built
    fields: Callable[[float, np.random.Generator, Rig, Size], Fields]

    @property
    def source(self) -> str:
        return (self.fields.__doc__ or "").strip()


FORMS: dict[str, dict[str, Form]] = {}
BOTH = ("bingham", "lugre")
BEDS = ("bench", "structure")


def form(
    effect: str,
    name: str,
    laws: tuple[str, ...] = BOTH,
    beds: tuple[str, ...] = BEDS,
    outside: str = "",
    least: float = 1e-6,
) -> Callable[..., Any]:
    """Registers a form; `outside` names the coordinate of an effect that is not in the library."""

    def register(function: Callable[..., Fields]) -> Callable[..., Fields]:
        FORMS.setdefault(effect, {})[name] = Form(
            effect, name, laws, beds, outside, least, function
        )
        return function

    return register


def forms(effect: str, rig: Rig) -> list[Form]:
    """Forms of an effect that this rig and its law can carry; empty if there are none."""
    bed = rig.name.split("_")[0]
    return [f for f in FORMS[effect].values() if rig.law in f.laws and bed in f.beds]


# Effects that one damper cannot carry together, or that are one and the same seen twice.
EXCLUDED = [
    {"backlash", "mount_compliance", "presliding", "fluid_inertia"},
    {"backlash", "stribeck", "flattening"},
    {"backlash", "gas_spring"},
    {"backlash", "base_friction"},
    {"backlash", "force_ripple"},
    {"delay", "fixture_resonance"},
]


def compatible(names: tuple[str, ...]) -> bool:
    """Whether effects can be hidden in one specimen."""
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    for a, b in pairs:
        if a == b:
            return False
        if any(a in group and b in group for group in EXCLUDED):
            return {a, b} == {"stribeck", "flattening"}
    return True


# --- the fluid's force over speed -----------------------------------------------------------


def _stribeck(kind: int, s: float, rng: np.random.Generator, rig: Rig, state: int = 0) -> Fields:
    width = rng.uniform(0.25, 1.5) * rig.values["v_n"]
    return {"st_kind": kind, "st_state": state, "st_s": 2.5 * s, "st_w": width}


@form("stribeck", "gaussian")
def _(s, rng, rig, size):
    """Y (1 + g exp(-(w/w_s)^2)). Armstrong-Helouvry, Dupont & Canudas de Wit (1994), Automatica 30."""
    return _stribeck(1, s, rng, rig)


@form("stribeck", "exponential")
def _(s, rng, rig, size):
    """Y (1 + g exp(-|w|/w_s)). Bo & Pavelescu (1982), Wear 82, 277-289, exponent 1 (Tustin 1947)."""
    return _stribeck(2, s, rng, rig)


@form("stribeck", "lorentzian")
def _(s, rng, rig, size):
    """Y (1 + g / (1 + (w/w_s)^2)). Hess & Soom (1990), J. Tribology 112, 147-152."""
    return _stribeck(3, s, rng, rig)


@form("stribeck", "gaussian_state", laws=("lugre",))
def _(s, rng, rig, size):
    """Bristle turns over at (1 + g exp(-(w/w_s)^2))/kappa. Canudas de Wit et al. (1995), IEEE TAC 40."""
    return _stribeck(1, s, rng, rig, state=1)


@form("stribeck", "exponential_state", laws=("lugre",))
def _(s, rng, rig, size):
    """Bristle turns over at (1 + g exp(-|w|/w_s))/kappa. Olsson et al. (1998), Eur. J. Control 4."""
    return _stribeck(2, s, rng, rig, state=1)


@form("flattening", "rational")
def _(s, rng, rig, size):
    """Whole force / (1 + a |w|): one relaxation time of the chains (Cross 1965, exponent 1)."""
    return {"flat_kind": 1, "flat_a": 6.0 * s / rig.speed}


@form("flattening", "exponential")
def _(s, rng, rig, size):
    """Whole force exp(-a |w|): shear thinning of Eyring type at moderate rates (Eyring 1936)."""
    return {"flat_kind": 2, "flat_a": 2.2 * s / rig.speed}


@form("flattening", "carreau")
def _(s, rng, rig, size):
    """Whole force (1 + (a w)^2)^(-n/2). Carreau (1972), Trans. Soc. Rheology 16, 99-127."""
    return {"flat_kind": 3, "flat_a": 12.0 * s / rig.speed, "flat_n": rng.uniform(0.5, 0.9)}


@form("quadratic_damping", "square")
def _(s, rng, rig, size):
    """b |w| w: turbulent orifice loss (Streeter & Wylie, Fluid Mechanics)."""
    return {"quad_kind": 1, "quad_b": 4.0 * s * rig.force / rig.speed**2}


@form("quadratic_damping", "blasius")
def _(s, rng, rig, size):
    """b |w|^1.75 sgn w: turbulent flow in smooth gaps, friction factor ~ Re^-1/4 (Blasius 1913)."""
    b = 4.0 * s * rig.force / rig.speed**2
    return {"quad_kind": 2, "quad_b": b, "quad_p": 1.75, "quad_w": rig.speed}


@form("quadratic_damping", "transition")
def _(s, rng, rig, size):
    """b w |w| |w|/(|w| + w_t): the loss sets in beyond a laminar range (after Idelchik, Handbook)."""
    b = 5.0 * s * rig.force / rig.speed**2
    return {"quad_kind": 3, "quad_b": b, "quad_w": rng.uniform(0.15, 0.5) * rig.speed}


@form("asymmetry", "step")
def _(s, rng, rig, size):
    """Whole force (1 + a sgn w): other valves for each direction (Dixon, Shock Absorber Handbook)."""
    return {"asym_kind": 1, "asym_s": 0.8 * s * rng.choice([-1.0, 1.0])}


@form("asymmetry", "smooth")
def _(s, rng, rig, size):
    """Whole force (1 + a tanh(w/w_a)): the difference grows with the flow through the valves."""
    width = rng.uniform(0.3, 1.5) * rig.values["v_n"]
    return {"asym_kind": 2, "asym_s": 0.8 * s * rng.choice([-1.0, 1.0]), "asym_w": width}


@form("asymmetry", "check_valve")
def _(s, rng, rig, size):
    """For w > 0 alone: whole force (1 - a (1 - exp(-w/w_a))), a bypass that opens one way."""
    width = rng.uniform(0.5, 2.0) * rig.values["v_n"]
    return {"asym_kind": 3, "asym_s": -0.9 * s, "asym_w": width}


# Least s: an elastic travel before sliding or a play of 1 um at 10 N size, a mount that gives 2 um
# under the largest force, times of 0.05 ms. Below, everything happens between two samples.
# --- the fluid's force before sliding, and with the history -----------------------------------


@form("presliding", "dahl", laws=("bingham",), least=3.3e-4)
def _(s, rng, rig, size):
    """dm/dx = (1 - m sgn w)/l, force Y m. Dahl (1968), TOR-158(3107-18), exponent 1."""
    return {"pre_kind": 1, "pre_n": 1.0, "pre_len": 0.15 * s * rig.stroke}


@form("presliding", "bouc_wen", laws=("bingham",), least=2.5e-4)
def _(s, rng, rig, size):
    """dm/dt = (w - (|w| |m| m + w m^2)/2)/l, force Y m. Wen (1976), J. Eng. Mech. 102, 249-263."""
    return {"pre_kind": 2, "pre_n": 2.0, "pre_len": 0.2 * s * rig.stroke}


@form("presliding", "maxwell_slip", laws=("bingham",), least=2e-4)
def _(s, rng, rig, size):
    """Ten springs with sliders in parallel. Iwan (1966); Lampaert, Al-Bender & Swevers (2003)."""
    return {"pre_kind": 3, "pre_len": 0.25 * s * rig.stroke}


def _heat(rig: Rig, rng: np.random.Generator) -> tuple[float, float]:
    """Energy of a hard run N m, and a cooling time s."""
    return 0.3 * rig.force * 0.35 * rig.speed * 12.0, rng.uniform(8.0, 40.0)


@form("temperature", "linear")
def _(s, rng, rig, size):
    """Whole force (1 - T), C T' = f w - C T/tau. Linear coefficient, as data sheets give it."""
    energy, cool = _heat(rig, rng)
    return {"hot_kind": 1, "hot_cap": energy / (2.0 * s), "hot_tau": cool}


@form("temperature", "arrhenius")
def _(s, rng, rig, size):
    """Viscous part exp(-T), yield part exp(-T/2). Dogruoz et al. (2003), J. Intell. Mater. Syst. 14."""
    energy, cool = _heat(rig, rng)
    return {"hot_kind": 2, "hot_cap": energy / (5.0 * s), "hot_tau": cool}


@form("temperature", "fluid_and_housing")
def _(s, rng, rig, size):
    """As arrhenius, with fluid and housing as two heat stores. Breese & Gordaninejad (2003)."""
    energy, cool = _heat(rig, rng)
    cap = energy / (10.0 * s)
    fields = {"hot_kind": 3, "hot_cap": cap, "hot_cap2": 2.5 * cap}
    return fields | {"hot_tau": rng.uniform(1.5, 4.0), "hot_tau2": cool}


# --- beside the fluid, and in series -----------------------------------------------------------


@form("gas_spring", "linear")
def _(s, rng, rig, size):
    """k x: the accumulator about its working point (Spencer et al. 1997, J. Eng. Mech. 123)."""
    return {"gas_kind": 1, "gas_k": 1.5 * s * rig.force / rig.stroke}


@form("gas_spring", "preloaded", beds=("bench",))
def _(s, rng, rig, size):
    """k x + f_0: the same with the force of the charge on the rod (Spencer et al. 1997, k_1 x_0)."""
    preload = 0.3 * s * rig.force * rng.uniform(0.3, 1.0)
    return {"gas_kind": 1, "gas_k": 1.5 * s * rig.force / rig.stroke, "gas_f": preload}


@form("gas_spring", "polytropic")
def _(s, rng, rig, size):
    """p A ((1 - x/l)^-n - 1): gas at exponent n, the rod displaces x/l of it (Dixon, ch. 7)."""
    length, n = rng.uniform(1.5, 2.5) * rig.stroke, rng.uniform(1.1, 1.4)
    k = 1.4 * s * rig.force / rig.stroke
    return {"gas_kind": 2, "gas_k": k, "gas_a": length, "gas_n": n}


@form("gas_spring", "progressive")
def _(s, rng, rig, size):
    """k x (1 + (x/a)^2): gas and bump rubber to third order (symmetric twin-rod damper)."""
    k = 1.0 * s * rig.force / rig.stroke
    return {"gas_kind": 3, "gas_k": k, "gas_a": rng.uniform(0.7, 1.1) * rig.stroke}


@form("fluid_inertia", "mass")
def _(s, rng, rig, size):
    """m a: the fluid in the gap, its mass times the square of the areas (Smith 2002, inerter)."""
    return {"mass": s * _most_mass(rig)}


@form("fluid_inertia", "with_history")
def _(s, rng, rig, size):
    """m a + b int a(q)/sqrt(pi (t-q)) dq: unsteady shear. Basset (1888), Treatise II, ch. 21."""
    most = s * _most_mass(rig)
    return {"mass": 0.5 * most, "basset": 0.5 * most * 4.5}


def _most_mass(rig: Rig) -> float:
    most = 0.25 * rig.force / rig.scales[2]  # s2/m times N; 2.5 kg of inertance for 10 N
    return most if rig.building is None else min(most, 0.5 * rig.building["masses"][0])


def _mount(s: float, rng: np.random.Generator, rig: Rig) -> Fields:
    drag = rig.lines[2] + V_MAX * rig.lines[3]
    # the drag falls with speed by at most drag/e^2: less damping than that in series chatters
    damping = 0.1353 * drag * rng.uniform(1.4, 2.5)
    return {"se_k": rig.force / (0.2 * s * rig.stroke), "se_c": damping}


@form("mount_compliance", "kelvin_voigt", least=5e-4)
def _(s, rng, rig, size):
    """Spring and dashpot in series with the damper (Yang et al. 2002, Eng. Structures 24)."""
    return {"series_kind": 1, **_mount(s, rng, rig)}


@form("mount_compliance", "hardening", least=5e-4)
def _(s, rng, rig, size):
    """Rubber bush, k u (1 + (u/u_0)^2) + c u' (Dixon, Shock Absorber Handbook, bushes)."""
    fields = _mount(s, rng, rig)
    fields["se_k"] *= 0.7
    return {"series_kind": 2, "se_u": rng.uniform(0.5, 1.0) * rig.force / fields["se_k"], **fields}


@form("mount_compliance", "zener", least=5e-4)
def _(s, rng, rig, size):
    """Rubber as standard linear solid with some own damping (Zener 1948; Christensen 1982)."""
    fields = _mount(s, rng, rig)
    fields["se_k"] *= 0.7
    ratio, time = rng.uniform(0.3, 1.0), rng.uniform(0.02, 0.1)
    return {"series_kind": 3, "se_k1": ratio * fields["se_k"], "se_t1": time, **fields}


def _piston(rig: Rig) -> float:
    """Mass of a piston, kg: it settles where a bristle throws a free piston (4 g for 10 N)."""
    return 4e-4 * rig.force / rig.scales[2]


@form("backlash", "rigid", least=6e-4)
def _(s, rng, rig, size):
    """Joint with play 2 b and hard stops (Nordin & Gutman 2002, Automatica 38).

    A Bingham piston rests when free; one that a bristle pulls flies with its small mass.
    """
    return {"series_kind": 4, "se_gap": 0.08 * s * rig.stroke, "se_m": _piston(rig)}


def _contact(s: float, rng: np.random.Generator, rig: Rig, n: float) -> Fields:
    gap = 0.08 * s * rig.stroke
    dent = rng.uniform(0.06, 0.15) * gap  # at the largest force
    # damping over closing speed: above drag/e^2 at the yield force of 0 V, else it chatters
    chi = 0.6 / rig.values["v_n"]
    fields = {"se_gap": gap, "se_k": rig.force / dent**n}
    return {"series_kind": 5, "se_n": n, "se_chi": chi, "se_m": _piston(rig), **fields}


@form("backlash", "elastic", least=6e-4)
def _(s, rng, rig, size):
    """Play between springs of finite stiffness with lossy contact (Nordin, Galic & Gutman 1997)."""
    return _contact(s, rng, rig, 1.0)


@form("backlash", "hunt_crossley", least=6e-4)
def _(s, rng, rig, size):
    """Play with contact K d^1.5 (1 + chi d'). Hunt & Crossley (1975), J. Appl. Mech. 42, 440-445."""
    return _contact(s, rng, rig, 1.5)


# --- from the voltage to the field ------------------------------------------------------------


@form("coil_lag", "first_order")
def _(s, rng, rig, size):
    """tau E' = V - E: inductance and resistance (Spencer et al. 1997, eq. for u)."""
    return {"coil_kind": 1, "coil_up": 0.12 * s, "coil_down": 0.12 * s}


@form("coil_lag", "rise_and_fall")
def _(s, rng, rig, size):
    """Two times, for rising and falling field. Koo, Goncalves & Ahmadian (2006), Smart Mater. 15."""
    ratio = rng.uniform(1.8, 3.0) ** rng.choice([-1.0, 1.0])
    return {"coil_kind": 2, "coil_up": 0.1 * s * ratio**0.5, "coil_down": 0.1 * s * ratio**-0.5}


@form("coil_lag", "eddy")
def _(s, rng, rig, size):
    """Coil and eddy currents, two lags one behind the other (Takesue, Furusho & Kiyota 2004)."""
    return {"coil_kind": 3, "coil_up": 0.09 * s, "coil_down": 0.09 * s * rng.uniform(0.3, 0.8)}


@form("remanence", "play")
def _(s, rng, rig, size):
    """E follows V with play r (Krasnosel'skii & Pokrovskii 1989); r remains at 0 V."""
    return {"rem_kind": 1, "rem_r": 2.0 * s}


@form("remanence", "prandtl_ishlinskii")
def _(s, rng, rig, size):
    """Mean of eight plays of widths up to 2 r (Visintin 1994, Differential Models of Hysteresis)."""
    return {"rem_kind": 2, "rem_r": 2.0 * s}


@form("remanence", "duhem")
def _(s, rng, rig, size):
    """dE/dV = (V - E)/(r sgn V') where that is positive: Coleman & Hodgdon (1986), Int. J. Eng. Sci."""
    return {"rem_kind": 3, "rem_r": 2.0 * s}


@form("saturation", "tanh")
def _(s, rng, rig, size):
    """E = V_s tanh(V/V_s). Magnetic saturation as in Guo, Yang & Pan (2006)."""
    return {"sat_kind": 1, "sat_v": V_MAX / (3.0 * s)}


@form("saturation", "froehlich")
def _(s, rng, rig, size):
    """E = V/(1 + V/V_s). Froehlich (1881), the rational curve of iron circuits."""
    return {"sat_kind": 2, "sat_v": V_MAX / (4.0 * s)}


@form("saturation", "langevin")
def _(s, rng, rig, size):
    """E = V_s L(3 V/V_s), L(q) = coth q - 1/q (Langevin 1905; Rosensweig 1985)."""
    return {"sat_kind": 3, "sat_v": V_MAX / (3.5 * s)}


# --- instruments that belong to the library ----------------------------------------------------


def chain(a: list[list[float]], b: list[float], c: list[float], d: float) -> tuple[Any, float]:
    """Linear filter q' = A q + b u, y = c q + d u, padded to four states."""
    n = len(b)
    box = np.zeros((6, 4))
    box[:n, :n], box[4, :n], box[5, :n] = a, b, c
    return box, d


@form("delay", "transport", least=1.7e-3)
def _(s, rng, rig, size):
    """The force reaches the recorder late by T: buffered transmission."""
    return {"late": 0.03 * s}


@form("delay", "bessel", least=1.7e-3)
def _(s, rng, rig, size):
    """Third-order anti-alias filter of Bessel type, group delay T (Thomson 1949, Proc. IEE 96)."""
    t = 0.03 * s
    a = [[0.0, 1 / t, 0.0], [0.0, 0.0, 1 / t], [-15.0 / t, -15.0 / t, -6.0 / t]]
    box, direct = chain(a, [0.0, 0.0, 15.0 / t], [1.0, 0.0, 0.0], 0.0)
    return {"force_filter": box, "ff_d": direct, "late_nominal": t}


@form("velocity_sensor", "lag", least=1e-3)
def _(s, rng, rig, size):
    """The transducer follows with a first-order lag (Doebelin, Measurement Systems)."""
    t = 0.05 * s
    box, direct = chain([[-1.0 / t]], [1.0 / t], [1.0], 0.0)
    return {"velocity_filter": box, "vf_d": direct, "time": t}


@form("velocity_sensor", "geophone")
def _(s, rng, rig, size):
    """A first-order high-pass: no answer at rest, leads at low frequency (Doebelin)."""
    w = 2.0 * np.pi * 2.5 * s
    box, direct = chain([[-w]], [w], [-1.0], 1.0)
    return {"velocity_filter": box, "vf_d": direct, "corner": w}


@form("velocity_sensor", "second_order", least=1e-3)
def _(s, rng, rig, size):
    """A seismic transducer below its resonance, w^2/(p^2 + 2 z w p + w^2) (Doebelin)."""
    w, z = 2.0 * np.pi * 4.0 / s, rng.uniform(0.5, 0.8)
    box, direct = chain([[0.0, w], [-w, -2.0 * z * w]], [0.0, w], [1.0, 0.0], 0.0)
    return {"velocity_filter": box, "vf_d": direct, "corner": w, "damping": z}


# --- the building ------------------------------------------------------------------------------

BUILDING = ("structure",)


@form("base_friction", "coulomb", beds=BUILDING)
def _(s, rng, rig, size):
    """mu N sgn(v) under the base, stick included (Mostaghel & Tanbakuchi 1983)."""
    return {"bf_kind": 1, "bf_f": 0.6 * s * rig.force}


@form("base_friction", "velocity_dependent", beds=BUILDING)
def _(s, rng, rig, size):
    """mu(v) = mu_f - (mu_f - mu_s) exp(-|v|/v_r). Constantinou, Mokha & Reinhorn (1990)."""
    width = rng.uniform(0.01, 0.03) * rig.scales[1]
    ratio = rng.uniform(0.3, 0.6)
    return {"bf_kind": 2, "bf_f": 0.7 * s * rig.force, "bf_r": ratio, "bf_w": width}


@form("base_friction", "hysteretic", beds=BUILDING)
def _(s, rng, rig, size):
    """mu N m, m of Bouc and Wen with a short elastic travel (Wen 1976; Nagarajaiah 1991)."""
    travel = rng.uniform(2e-4, 8e-4) * rig.scales[2]
    return {"bf_kind": 3, "bf_f": 0.6 * s * rig.force, "bf_w": travel}


def _isolator(rig: Rig) -> float:
    assert rig.building is not None
    return float(rig.building["stiffnesses"][0])


@form("duffing", "cubic", beds=BUILDING)
def _(s, rng, rig, size):
    """k_3 x^3 beside the linear isolator (Duffing 1918)."""
    return {"du_kind": 1, "du_k": 8.0 * s * _isolator(rig), "du_x": size["travel"]}


@form("duffing", "sinh", beds=BUILDING)
def _(s, rng, rig, size):
    """k (l sinh(x/l) - x): rubber that stiffens exponentially (after Arruda & Boyce's long range)."""
    return {"du_kind": 2, "du_k": 6.0 * s * _isolator(rig), "du_x": 0.45 * size["travel"]}


@form("duffing", "quintic", beds=BUILDING)
def _(s, rng, rig, size):
    """k_5 x^5: stiffening late in the stroke (Kelly 1997, rubber at large shear)."""
    return {"du_kind": 3, "du_k": 12.0 * s * _isolator(rig), "du_x": size["travel"]}


@form("storey_softening", "cubic", beds=BUILDING)
def _(s, rng, rig, size):
    """k d (1 - (d/d_0)^2/3) up to its top at d_0, constant beyond (Duffing, softening)."""
    return {"ss_kind": 1, "ss_d": size["drift"] / (1.5 * s)}


@form("storey_softening", "tanh", beds=BUILDING)
def _(s, rng, rig, size):
    """k d_0 tanh(d/d_0): nonlinear elastic frame (hyperbolic backbone, Kondner 1963 in kind)."""
    return {"ss_kind": 2, "ss_d": size["drift"] / (2.5 * s)}


@form("storey_softening", "hysteretic", beds=BUILDING)
def _(s, rng, rig, size):
    """a k d + (1 - a) k d_0 m, m of Bouc and Wen: yielding columns. Wen (1976)."""
    yield_drift = rng.uniform(0.25, 0.4) * size["drift"]
    return {"ss_kind": 3, "ss_a": 1.0 - 0.9 * s, "ss_d": yield_drift, "ss_n": 2.0}


def _bumper(rng: np.random.Generator, rig: Rig, size: Size) -> tuple[float, float]:
    # A damper's motion is prescribed: its stops are met late in the stroke.
    gap = rng.uniform(*((0.4, 0.65) if rig.building else (0.55, 0.8))) * size["travel"]
    return gap, size["travel"] - gap


@form("end_stop", "kelvin")
def _(s, rng, rig, size):
    """Spring and dashpot behind a gap, never pulling (Anagnostopoulos 1988, EESD 16)."""
    gap, deep = _bumper(rng, rig, size)
    if rig.building is None:
        k = 20.0 * s * rig.force / deep
        return {"es_kind": 1, "es_gap": gap, "es_k": k, "es_c": 0.1 * k * deep / rig.speed}
    k = 30.0 * s * _isolator(rig)
    damping = 2.0 * 0.1 * np.sqrt(k * sum(rig.building["masses"]))
    return {"es_kind": 1, "es_gap": gap, "es_k": k, "es_c": damping}


@form("end_stop", "hunt_crossley")
def _(s, rng, rig, size):
    """K d^1.5 (1 + chi d') behind a gap. Hunt & Crossley (1975); Muthukumar & DesRoches (2006)."""
    gap, deep = _bumper(rng, rig, size)
    if rig.building is None:
        k = 20.0 * s * rig.force / deep**1.5
        return {"es_kind": 2, "es_gap": gap, "es_k": k, "es_c": 0.3 / rig.speed}
    k = 30.0 * s * _isolator(rig) / np.sqrt(0.3 * deep)
    return {"es_kind": 2, "es_gap": gap, "es_k": k, "es_c": 0.3 / rig.speed}


# --- outside the library -------------------------------------------------------------------------


@form("position_friction", "bow", outside="displacement")
def _(s, rng, rig, size):
    """Y (1 + g (x/X)^2): a tube that is narrower towards its ends."""
    return {"pos_kind": 1, "pos_s": 10.0 * s, "pos_x": rig.stroke}


@form("position_friction", "taper", outside="displacement")
def _(s, rng, rig, size):
    """Y (1 + g x/X): a tube with a taper."""
    return {"pos_kind": 2, "pos_s": 0.95 * s * rng.choice([-1.0, 1.0]), "pos_x": rig.stroke}


def _ripple(kind: int, top: float, rng: np.random.Generator, rig: Rig) -> Fields:
    length = rng.uniform(0.15, 0.4) * rig.stroke
    return {"rip_kind": kind, "rip_s": top, "rip_len": length, "rip_phase": rng.uniform(0.0, 6.28)}


@form("force_ripple", "detent", outside="displacement")
def _(s, rng, rig, size):
    """A sin(2 pi x/p + phase): magnetic detent forces along the stroke, conservative."""
    return _ripple(1, 0.9 * s * rig.force, rng, rig)


@form("force_ripple", "rings", outside="displacement")
def _(s, rng, rig, size):
    """Y (1 + g sin(2 pi x/p + phase)): rings worn into the wall."""
    return _ripple(2, 0.95 * s, rng, rig)


@form("rebuilding", "thixotropic", outside="rest")
def _(s, rng, rig, size):
    """Y (1 + g m), m' = (1 - m)/tau - |w| m/l. Moore (1959), Trans. Brit. Ceram. Soc. 58."""
    time, length = rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.4) * rig.stroke
    return {"age_kind": 1, "age_s": 6.0 * s, "age_tau": time, "age_len": length}


@form("rebuilding", "ageing", outside="rest")
def _(s, rng, rig, size):
    """Y (1 + g ln(1 + q/q_0)), q' = 1 - |w| q/l. Dieterich (1979), Ruina (1983), ageing law."""
    time, length = rng.uniform(0.01, 0.03), rng.uniform(0.05, 0.2) * rig.stroke
    return {"age_kind": 2, "age_s": 2.0 * s, "age_tau": time, "age_len": length}


@form("shear_thickening", "jamming", outside="velocity")
def _(s, rng, rig, size):
    """Whole force (1 + g (E/8)/(1 + exp((w_j - |w|)/d))): chains jam at speed, only under a field.

    Own form, in kind after Tian et al. (2010), Rheol. Acta 49: thickening of MR fluids.
    """
    knee = rng.uniform(0.3, 0.5) * rig.speed
    fields = {"thick_w": knee, "thick_d": 0.12 * knee, "thick_v": V_MAX}
    return {"thick_kind": 1, "thick_s": 8.0 * s, **fields}


@form("shear_thickening", "power", outside="velocity")
def _(s, rng, rig, size):
    """Whole force (1 + g (E/8) q/(1 + q)), q = (|w|/w_j)^4. Own form."""
    knee = rng.uniform(0.3, 0.5) * rig.speed
    return {"thick_kind": 2, "thick_s": 8.0 * s, "thick_w": knee, "thick_v": V_MAX}


def _mode(s: float, rng: np.random.Generator, shares: list[float]) -> Fields:
    box = np.zeros((6, 4))
    frequencies = []
    for i, part in enumerate(shares):
        w, z = 2.0 * np.pi * rng.uniform(8.0 + 5.0 * i, 12.0 + 6.0 * i), rng.uniform(0.01, 0.04)
        box[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[0.0, w], [-w, -2.0 * z * w]]
        box[4, 2 * i + 1] = w
        box[5, 2 * i] = s * part
        frequencies.append(w / (2.0 * np.pi))
    return {"force_filter": box, "ff_d": 1.0 - s * sum(shares), "frequencies": frequencies}


@form("fixture_resonance", "one_mode", outside="frequency")
def _(s, rng, rig, size):
    """The load cell's fixture rings: (1 - g) f + g r, r'' + 2 z w r' + w^2 r = w^2 f. Own form."""
    return _mode(s, rng, [1.0])


@form("fixture_resonance", "two_modes", outside="frequency")
def _(s, rng, rig, size):
    """As one_mode with two modes of the frame. Own form."""
    return _mode(s, rng, [0.6, 0.4])


# --- outside the library too, with plans of their own: on a bench alone ----------------------------


def _one_side(kind: int, s: float, rng: np.random.Generator, rig: Rig, size: Size) -> Fields:
    gap = size["travel"] * rng.uniform(0.2, 0.6)
    deep = size["travel"] - gap
    k = 3.0 * s * rig.force / (deep if kind == 1 else deep**1.5)
    return {"one_kind": kind, "one_k": k, "one_gap": gap, "one_side": rng.choice([-1.0, 1.0])}


@form("one_sided_contact", "bumper", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """k max(x - d, 0) on one side of the stroke: a bumper of rubber. Dixon (2007), ch. 5."""
    return _one_side(1, s, rng, rig, size)


@form("one_sided_contact", "rounded", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """k max(x - d, 0)^1.5 on one side: a rounded bumper. Hertz (1882), J. reine angew. Math. 92."""
    return _one_side(2, s, rng, rig, size)


def _after_reversal(kind: int, s: float, rng: np.random.Generator, rig: Rig) -> Fields:
    return {"brk_kind": kind, "brk_s": 3.0 * s, "brk_len": rng.uniform(0.05, 0.25) * rig.stroke}


@form("breakaway", "fall", laws=("bingham",), beds=("bench",), outside="travel")
def _(s, rng, rig, size):
    """Y (1 + g exp(-q/l)), q the way since the last reversal: chains break over l. Own form."""
    return _after_reversal(1, s, rng, rig)


@form("breakaway", "hump", beds=("bench",), outside="travel")
def _(s, rng, rig, size):
    """Y (1 + g q/l exp(1 - q/l)): the same, the chains stretched before they break. Own form."""
    return _after_reversal(2, s, rng, rig)


def _by_acceleration(kind: int, top: float, rng: np.random.Generator, rig: Rig) -> Fields:
    usual = rig.speed**2 / rig.stroke
    at, width = rng.uniform(0.5, 2.0) * usual, 0.3 * rig.values["v_n"]
    return {"acc_kind": kind, "acc_s": top, "acc_a": at, "acc_w": width}


@form("acceleration_yield", "sense", beds=("bench",), outside="acceleration")
def _(s, rng, rig, size):
    """Y (1 + g tanh((a/A) tanh(w/w_a))): more where it speeds up, less where it slows. Own form."""
    return _by_acceleration(1, 0.95 * s, rng, rig)


@form("acceleration_yield", "size", beds=("bench",), outside="acceleration")
def _(s, rng, rig, size):
    """Y (1 + g q/(1 + q)), q = (a/A)^2: particles lag the carrier in both senses. Own form."""
    return _by_acceleration(2, 4.0 * s, rng, rig)


@form("command_map", "steep", beds=("bench",), outside="voltage")
def _(s, rng, rig, size):
    """E' = E (E/8 V)^g: yield over field. Ginder, Davis & Elie (1996), IJMP B 10, 3293."""
    return {"bend_kind": 1, "bend_s": 2.0 * s, "bend_v": V_MAX}


@form("command_map", "parabola", beds=("bench",), outside="voltage")
def _(s, rng, rig, size):
    """E' = E (1 - g (1 - E/8 V)): the quadratic start of the same curve."""
    return {"bend_kind": 2, "bend_s": s, "bend_v": V_MAX}


def _with_heat(kind: int, s: float, rng: np.random.Generator, rig: Rig) -> Fields:
    fields = {"heat_kind": kind, "heat_k": 2.0 * s * rig.force / rig.stroke, "heat_c": 0.4}
    return {
        **fields,
        "heat_tau": rng.uniform(0.1, 0.6),
        "heat_len": rng.uniform(2.0, 3.5) * rig.stroke,
    }


@form("warm_accumulator", "relaxing", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """k (x + 0.4 (x - r)), r' = (x - r)/tau: isothermal to adiabatic. Pourmovahed & Otis (1990)."""
    return _with_heat(1, s, rng, rig)


@form("warm_accumulator", "gas", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """p A ((1 + h)/(1 - x/l) - 1), h' = 0.4 (1 + h) v/(l - x) - h/tau: J. Dyn. Sys. Meas. 112, 116."""
    return _with_heat(2, s, rng, rig)


def _vapour(kind: int, top: float, rng: np.random.Generator, rig: Rig) -> Fields:
    at = rng.uniform(0.08, 0.3) * rig.speed
    fields = {"cav_kind": kind, "cav_s": top, "cav_w": at, "cav_d": 0.15 * at}
    return {**fields, "cav_len": rng.uniform(0.05, 0.2) * rig.stroke}


@form("cavitation", "choked", beds=("bench",), outside="velocity")
def _(s, rng, rig, size):
    """Whole force (1 - g/(1 + exp((w_c - w)/d))): in one direction alone. In kind, Duym (2000)."""
    return _vapour(1, 0.95 * s, rng, rig)


@form("cavitation", "void", beds=("bench",), outside="velocity")
def _(s, rng, rig, size):
    """Whole force (1 - g q/(q + l)), q' = w - w_c while that is positive; w < 0 closes it. Own form."""
    return _vapour(2, 0.95 * s, rng, rig)


# --- outside the library, and along two signals at once ------------------------------------------


def _patch(kind: int, s: float, rng: np.random.Generator, rig: Rig) -> Fields:
    fields = {"pat_kind": kind, "pat_f": 3.0 * s * rig.force, "pat_w": 0.3 * rig.values["v_n"]}
    return {
        **fields,
        "pat_x": rng.uniform(-0.3, 0.3) * rig.stroke,
        "pat_len": rng.uniform(0.2, 0.4) * rig.stroke,
        "pat_d": rng.uniform(0.1, 0.3) * rig.speed,
    }


@form("sticking_patch", "patch", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """F exp(-((x - x_0)/l)^2) exp(-|w|/w_d) tanh(w/w_0): dry there, and slow alone. Own form."""
    return _patch(1, s, rng, rig)


@form("sticking_patch", "half", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """F (1 + tanh((x - x_0)/l))/2 exp(-|w|/w_d) tanh(w/w_0): one half of the stroke. Own form."""
    return _patch(2, s, rng, rig)


def _edge(kind: int, s: float, rng: np.random.Generator, rig: Rig) -> Fields:
    at = rng.uniform(0.1, 0.3) * rig.stroke
    return {
        "edge_kind": kind, "edge_s": 0.95 * s, "edge_x": at, "edge_w": 0.1 * rig.stroke,
        "edge_v": V_MAX,
    }  # fmt: skip


@form("field_edge", "both", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """Y (1 - g/(1 + exp((x_e (1 + E/8) - |x|)/l))): the field reaches further with the command."""
    return _edge(1, s, rng, rig)


@form("field_edge", "one", beds=("bench",), outside="displacement")
def _(s, rng, rig, size):
    """The same at one end of the stroke, x in the place of |x|. Own form."""
    return _edge(2, s, rng, rig)


LIBRARY = tuple(name for name, group in FORMS.items() if not next(iter(group.values())).outside)
FURTHER = (
    "one_sided_contact", "breakaway", "acceleration_yield", "command_map", "warm_accumulator",
    "cavitation",
)  # fmt: skip
"""Outside the library; the plans of the other outside effects stay what they are without them."""
CROSSED = ("sticking_patch", "field_edge")
"""The same, of two signals at once."""
OUTSIDE = tuple(name for name in FORMS if name not in (*LIBRARY, *FURTHER, *CROSSED))
