"""The coupled equations of a specimen and their integrator.

Formulation. The plant is a set of continuous states with right-hand sides that are smooth between
*stops*: samples, reversals of a prescribed motion, jumps of the voltage. What is set valued or
unilateral (dry friction of a free base, a joint with play) is a mode that changes at events, which
are located on the step length. Prescribed motion is a quintic in time between samples, so
displacement, velocity and acceleration belong together exactly.

Integrator: Dormand and Prince (1980), J. Comput. Appl. Math. 6, 19-26, order 5(4), step by the
local error. All code that numba compiles stands in this one file, for its cache does not see
edits in other files; that is why the file is long.
"""

from __future__ import annotations

from math import copysign, exp, log1p, sin, sinh, tanh

import numpy as np
from numba import njit

INTEGERS = [
    "law",
    "pre_kind",
    "st_kind",
    "st_state",
    "flat_kind",
    "asym_kind",
    "hot_kind",
    "gas_kind",
    "quad_kind",
    "series_kind",
    "pos_kind",
    "rip_kind",
    "age_kind",
    "thick_kind",
    "one_kind",
    "brk_kind",
    "acc_kind",
    "heat_kind",
    "cav_kind",
    "pat_kind",
    "edge_kind",
    "building",
    "bf_kind",
    "du_kind",
    "ss_kind",
    "es_kind",
    "i_z",
    "i_y",
    "i_w",
    "i_r",
    "i_hot",
    "i_age",
    "i_bas",
    "i_ff",
    "i_vf",
    "i_q",
    "i_bw",
    "i_bf",
    "i_heat",
    "i_void",
]
REALS = [
    "y0",
    "y1",
    "c0",
    "c1",
    "wn",
    "kap",
    "sg1",
    "pre_len",
    "pre_n",
    "st_s",
    "st_w",
    "flat_a",
    "flat_n",
    "asym_s",
    "asym_w",
    "hot_cap",
    "hot_tau",
    "hot_cap2",
    "hot_tau2",
    "gas_k",
    "gas_a",
    "gas_n",
    "gas_f",
    "quad_b",
    "quad_p",
    "quad_w",
    "mass",
    "basset",
    "se_k",
    "se_c",
    "se_u",
    "se_k1",
    "se_t1",
    "se_gap",
    "se_n",
    "se_chi",
    "se_m",
    "pos_s",
    "pos_x",
    "rip_s",
    "rip_len",
    "rip_phase",
    "age_s",
    "age_tau",
    "age_len",
    "thick_s",
    "thick_w",
    "thick_d",
    "thick_v",
    "one_k",
    "one_gap",
    "one_side",
    "brk_s",
    "brk_len",
    "acc_s",
    "acc_a",
    "acc_w",
    "heat_k",
    "heat_c",
    "heat_tau",
    "heat_len",
    "cav_s",
    "cav_w",
    "cav_d",
    "cav_len",
    "pat_f",
    "pat_x",
    "pat_len",
    "pat_w",
    "pat_d",
    "edge_s",
    "edge_x",
    "edge_w",
    "edge_v",
    "ff_d",
    "vf_d",
    "mb",
    "m1",
    "m2",
    "kb",
    "k1",
    "k2",
    "alpha",
    "beta",
    "bf_f",
    "bf_r",
    "bf_w",
    "du_k",
    "du_x",
    "ss_d",
    "ss_a",
    "ss_n",
    "es_gap",
    "es_k",
    "es_c",
]
PLANT = np.dtype([(n, np.int64) for n in INTEGERS] + [(n, np.float64) for n in REALS])

SLIPS = 10  # elements of a Maxwell-slip chain
RATES = 0.2 * 10000.0 ** (np.arange(7) / 6.0)  # 1/s, memory of the unsteady shear force
WEIGHTS = 2.0 / np.pi * np.sqrt(RATES) * np.log(10000.0) / 12.0  # of 1/sqrt(pi t) in exponentials
OUTPUTS = [
    "displacement",
    "velocity",
    "acceleration",
    "force",
    "force_shown",
    "velocity_shown",
    "felt",
    "piston",
    "slip",
    "bristle",
    "heat",
    "ground",
    "base",
    "floor1",
    "floor2",
    "base_rate",
    "floor1_rate",
    "floor2_rate",
    "base_acceleration",
    "floor1_acceleration",
    "floor2_acceleration",
    "friction",
]
ROOT6 = 6.0**0.5
RADAU_C = np.array([(4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0, 1.0])
RADAU_A = np.array(
    [
        [(88 - 7 * ROOT6) / 360, (296 - 169 * ROOT6) / 1800, (-2 + 3 * ROOT6) / 225],
        [(296 + 169 * ROOT6) / 1800, (88 + 7 * ROOT6) / 360, (-2 - 3 * ROOT6) / 225],
        [(16 - ROOT6) / 36, (16 + ROOT6) / 36, 1 / 9],
    ]
)
RADAU_E = np.array([-(13 + 7 * ROOT6) / 3, (-13 + 7 * ROOT6) / 3, -1 / 3])
RADAU_G = 30.0 / (6.0 + 81.0 ** (1 / 3) - 9.0 ** (1 / 3))
LIMIT = 3_000_000  # steps in a run; more than that is chatter
FINE = 8  # points of the felt voltage between two samples


@njit(cache=True)
def _decline(kind, u):
    """Three ways from 1 at rest to 0 at speed."""
    if kind == 1:
        return exp(-u * u)
    if kind == 2:
        return exp(-u)
    return 1.0 / (1.0 + u * u)


@njit(cache=True)
def _bristle_rate(p, w, z, reach):
    """Rate of the bristle, or of the yield force's share that is mobilised before sliding."""
    u = abs(w)
    if p.law == 1:
        return w - p.kap * u * z / reach
    if p.pre_kind == 2:  # hysteresis of Bouc and Wen, elastic on the way back
        h = abs(z) ** (p.pre_n - 1.0)
        return (w - 0.5 * (u * h * z + w * h * abs(z))) / p.pre_len
    rest = 1.0 - z if w >= 0.0 else 1.0 + z
    if p.pre_n == 1.0:
        return w * rest / p.pre_len
    return w * copysign(abs(rest) ** p.pre_n, rest) / p.pre_len


@njit(cache=True)
def _fluid(p, x, w, d, e, z, hot, age, more):
    """Force of the fluid between piston and wall, and the bristle's rate.

    d is the sense of sliding where w = 0 leaves it open; e the voltage that the fluid feels;
    more a factor of the yield force.
    """
    u = abs(w)
    grip = (p.y0 + p.y1 * e) * more
    drag = (p.c0 + p.c1 * e) * exp(-u / p.wn)
    reach = 1.0
    if p.st_kind > 0:
        rise = 1.0 + p.st_s * _decline(p.st_kind, u / p.st_w)
        if p.st_state == 1:
            reach = rise
        else:
            grip *= rise
    if p.hot_kind == 1:
        soft = max(1.0 - hot, 0.05)
        grip *= soft
        drag *= soft
    elif p.hot_kind >= 2:
        grip *= exp(-0.5 * hot)
        drag *= exp(-hot)
    if p.age_kind == 1:
        grip *= 1.0 + p.age_s * age
    elif p.age_kind == 2:
        grip *= 1.0 + p.age_s * log1p(max(age, 0.0) / p.age_tau)
    if p.pos_kind == 1:
        grip *= 1.0 + p.pos_s * (x / p.pos_x) ** 2
    elif p.pos_kind == 2:
        grip *= 1.0 + p.pos_s * x / p.pos_x
    if p.rip_kind == 2:
        grip *= 1.0 + p.rip_s * sin(6.283185307179586 * x / p.rip_len + p.rip_phase)
    if p.edge_kind > 0:
        out = (abs(x) if p.edge_kind == 1 else x) - p.edge_x * (1.0 + e / p.edge_v)
        grip *= 1.0 - p.edge_s / (1.0 + exp(-out / p.edge_w))
    rate = 0.0
    if p.law == 1:
        rate = _bristle_rate(p, w, z, reach)
        f = grip * p.kap * z + p.sg1 * rate + drag * w
    elif p.pre_kind > 0:
        if p.pre_kind != 3:
            rate = _bristle_rate(p, w, z, reach)
        f = grip * z + drag * w
    else:
        f = grip * d + drag * w
    if p.flat_kind == 1:
        f /= 1.0 + p.flat_a * u
    elif p.flat_kind == 2:
        f *= exp(-p.flat_a * u)
    elif p.flat_kind == 3:
        f *= (1.0 + (p.flat_a * u) ** 2) ** (-0.5 * p.flat_n)
    if p.asym_kind == 1:
        f *= 1.0 + p.asym_s * d
    elif p.asym_kind == 2:
        f *= 1.0 + p.asym_s * tanh(w / p.asym_w)
    elif p.asym_kind == 3 and w > 0.0:
        f *= 1.0 + p.asym_s * (1.0 - exp(-w / p.asym_w))
    if p.thick_kind == 1:
        f *= 1.0 + p.thick_s * e / p.thick_v / (1.0 + exp(-(u - p.thick_w) / p.thick_d))
    elif p.thick_kind == 2:
        q = (u / p.thick_w) ** 4
        f *= 1.0 + p.thick_s * e / p.thick_v * q / (1.0 + q)
    return f, rate


@njit(cache=True)
def _more(p, way, w, a):
    """Factor of the yield force by the way since the last reversal, and by acceleration."""
    more = 1.0
    if p.brk_kind == 1:
        more += p.brk_s * exp(-way / p.brk_len)
    elif p.brk_kind == 2:
        more += p.brk_s * way / p.brk_len * exp(1.0 - way / p.brk_len)
    if p.acc_kind == 1:
        more += p.acc_s * tanh(a / p.acc_a * tanh(w / p.acc_w))
    elif p.acc_kind == 2:
        q = (a / p.acc_a) ** 2
        more += p.acc_s * q / (1.0 + q)
    return more


@njit(cache=True)
def _kept(p, w, void):
    """Share of the fluid's force that a vapour space leaves."""
    if p.cav_kind == 1:
        return 1.0 - p.cav_s / (1.0 + exp(-(w - p.cav_w) / p.cav_d))
    if p.cav_kind == 2:
        return 1.0 - p.cav_s * void / (void + p.cav_len)
    return 1.0


@njit(cache=True)
def _voids(p, w, void):
    """Rate at which the vapour space grows in one direction, beyond a speed, and closes again."""
    if w > 0.0:
        return max(w - p.cav_w, 0.0)
    return w * void / (void + 0.1 * p.cav_len)


@njit(cache=True)
def _accumulator(p, q, x, v):
    """Force of a gas that exchanges heat with its wall, and the rate of its state q."""
    if p.heat_kind == 1:
        return p.heat_k * (x + p.heat_c * (x - q)), (x - q) / p.heat_tau
    left = p.heat_len - x
    force = p.heat_k * p.heat_len * ((1.0 + q) * p.heat_len / left - 1.0)
    return force, p.heat_c * (1.0 + q) * v / left - q / p.heat_tau


@njit(cache=True)
def _stop(p, x, v):
    """Push of a buffer behind a gap to either side."""
    dent = abs(x) - p.es_gap
    if dent <= 0.0:
        return 0.0
    side = copysign(1.0, x)
    if p.es_kind == 1:
        push = p.es_k * dent + p.es_c * side * v
    else:
        push = p.es_k * dent**1.5 * (1.0 + p.es_c * side * v)
    return side * max(push, 0.0)


@njit(cache=True)
def _beside(p, x, w):
    """Forces inside the damper's body, beside the fluid."""
    f = 0.0
    if p.building == 0 and p.es_kind > 0:
        f += _stop(p, x, w)
    if p.one_kind > 0:
        dent = p.one_side * x - p.one_gap
        if dent > 0.0:
            f += p.one_side * p.one_k * (dent if p.one_kind == 1 else dent**1.5)
    if p.pat_kind > 0:
        at = (x - p.pat_x) / p.pat_len
        place = exp(-at * at) if p.pat_kind == 1 else 0.5 * (1.0 + tanh(at))
        f += p.pat_f * place * tanh(w / p.pat_w) * exp(-abs(w) / p.pat_d)
    if p.gas_kind == 1:
        f += p.gas_k * x + p.gas_f
    elif p.gas_kind == 2:
        f += p.gas_k * p.gas_a / p.gas_n * ((1.0 - x / p.gas_a) ** (-p.gas_n) - 1.0)
    elif p.gas_kind == 3:
        f += p.gas_k * x * (1.0 + (x / p.gas_a) ** 2)
    if p.quad_kind == 1:
        f += p.quad_b * abs(w) * w
    elif p.quad_kind == 2:
        f += p.quad_b * p.quad_w**2 * copysign((abs(w) / p.quad_w) ** p.quad_p, w)
    elif p.quad_kind == 3:
        f += p.quad_b * w * w * abs(w) / (abs(w) + p.quad_w) * copysign(1.0, w)
    if p.rip_kind == 1:
        f += p.rip_s * sin(6.283185307179586 * x / p.rip_len + p.rip_phase)
    return f


@njit(cache=True)
def _link(p, u, rel, r):
    """Force of the element in series: u its stretch, rel the rate of u, r the Maxwell stretch."""
    if p.series_kind == 1:
        return p.se_k * u + p.se_c * rel
    if p.series_kind == 2:
        return p.se_k * u * (1.0 + (u / p.se_u) ** 2) + p.se_c * rel
    if p.series_kind == 3:
        return p.se_k * u + p.se_k1 * r + p.se_c * rel
    if p.series_kind == 5:
        dent = abs(u) - p.se_gap
        if dent <= 0.0:
            return 0.0
        push = p.se_k * dent**p.se_n * (1.0 + p.se_chi * copysign(1.0, u) * rel)
        return copysign(max(push, 0.0), u)
    return 0.0


@njit(cache=True)
def _excess(p, w, d, y, v, u, r, e, z, hot, age):
    f, _ = _fluid(p, y, w, d, e, z, hot, age, 1.0)
    return f + _beside(p, y, w) - _link(p, u, v - w, r)


@njit(cache=True)
def _slip(p, y, v, u, r, e, z, hot, age):
    """Speed at which a piston without mass balances the element in series (0 while it sticks).

    Of several balances the one nearest to rest: the branch a piston starting from rest reaches.
    """
    up = _excess(p, 0.0, 1.0, y, v, u, r, e, z, hot, age)
    down = _excess(p, 0.0, -1.0, y, v, u, r, e, z, hot, age)
    if up >= 0.0 and down <= 0.0:
        return 0.0
    d = 1.0 if up < 0.0 else -1.0
    lo, glo = 0.0, (up if up < 0.0 else -down)
    hi, ghi = 0.0, glo
    step = 0.25 * p.wn
    if p.wn > 1e3:  # the standard law has no such speed
        step = 1e-3
    for _ in range(24):
        hi = lo + step
        ghi = d * _excess(p, d * hi, d, y, v, u, r, e, z, hot, age)
        if ghi >= 0.0:
            break
        lo, glo = hi, ghi
        step *= 2.0
    side = 0
    for _ in range(80):
        if hi - lo <= 1e-15 + 1e-14 * hi or ghi == 0.0:
            break
        mid = (glo * hi - ghi * lo) / (glo - ghi)
        if not (lo < mid < hi):
            mid = 0.5 * (lo + hi)
        g = d * _excess(p, d * mid, d, y, v, u, r, e, z, hot, age)
        if g >= 0.0:
            hi, ghi = mid, g
            if side == 1:
                glo *= 0.5
            side = 1
        else:
            lo, glo = mid, g
            if side == -1:
                ghi *= 0.5
            side = -1
    return d * hi


@njit(cache=True)
def _memory(mem, lens, y):
    """Mean stretch of the slip chain at y; the stretches hold at position mem[-1]."""
    total = 0.0
    for i in range(lens.size):
        total += min(max(mem[i] + (y - mem[lens.size]) / lens[i], -1.0), 1.0)
    return total / lens.size


@njit(cache=True)
def _remember(mem, lens, y):
    for i in range(lens.size):
        mem[i] = min(max(mem[i] + (y - mem[lens.size]) / lens[i], -1.0), 1.0)
    mem[lens.size] = y


@njit(cache=True)
def _device(p, s, ds, play, mem, lens, x, v, a, d, e, free):
    """Force of the whole damper without its inertia; fills the rates of its states.

    a is the acceleration of a prescribed motion; no free motion has what depends on it. Returns
    force, piston position, piston speed, and the force that the free piston's contact would carry
    (used by the events of a joint with play).
    """
    z = d
    if p.i_z >= 0:
        z = s[p.i_z]
    hot = 0.0
    if p.i_hot >= 0:
        hot = s[p.i_hot]
    age = 0.0
    if p.i_age >= 0:
        age = s[p.i_age]
    y, w, side = x, v, d
    shown = -1
    if p.series_kind == 4 and play != 0:
        y = x - play * p.se_gap
    elif p.series_kind > 0:
        y = s[p.i_y]
        r = s[p.i_r] if p.i_r >= 0 else 0.0
        w = s[p.i_w] if p.i_w >= 0 else _slip(p, y, v, x - y, r, e, z, hot, age)
        side = copysign(1.0, w) if w != 0.0 else 0.0
        shown = 1
    if p.pre_kind == 3:
        z = _memory(mem, lens, y)
    more = _more(p, abs(y - mem[lens.size]), w, a)
    f, rate = _fluid(p, y, w, side, e, z, hot, age, more)
    if p.cav_kind > 0:
        f *= _kept(p, w, s[p.i_void] if p.i_void >= 0 else 0.0)
    total = f + _beside(p, y, w)
    if p.i_heat >= 0:
        push, flow = _accumulator(p, s[p.i_heat], y, w)
        total += push
        if not free:
            ds[p.i_heat] = flow
    inner = total
    if shown == 1:
        total = 0.0
        if p.series_kind != 4:
            r = s[p.i_r] if p.i_r >= 0 else 0.0
            total = _link(p, x - y, v - w, r)
    if free:
        return total, y, w
    if p.i_z >= 0:
        ds[p.i_z] = rate
    if p.i_y >= 0:
        ds[p.i_y] = w
    if p.i_w >= 0:
        ds[p.i_w] = (total - inner) / p.se_m
    if p.i_r >= 0:
        ds[p.i_r] = (v - w) - s[p.i_r] / p.se_t1
    if p.i_hot >= 0:
        if p.hot_kind == 3:
            flow = (s[p.i_hot] - s[p.i_hot + 1]) / p.hot_tau
            ds[p.i_hot] = f * w / p.hot_cap - flow
            ds[p.i_hot + 1] = flow * p.hot_cap / p.hot_cap2 - s[p.i_hot + 1] / p.hot_tau2
        else:
            ds[p.i_hot] = f * w / p.hot_cap - s[p.i_hot] / p.hot_tau
    if p.i_age >= 0:
        if p.age_kind == 1:
            ds[p.i_age] = (1.0 - age) / p.age_tau - abs(w) * age / p.age_len
        else:
            ds[p.i_age] = 1.0 - abs(w) * age / p.age_len
    if p.i_void >= 0:
        ds[p.i_void] = _voids(p, w, s[p.i_void])
    return total, y, w


@njit(cache=True)
def _old_shear(p, s):
    """Force from the past accelerations of the fluid."""
    f = 0.0
    if p.i_bas >= 0:
        for i in range(RATES.size):
            f += WEIGHTS[i] * s[p.i_bas + i]
    return p.basset * f


@njit(cache=True)
def _carried(p, mode):
    """Mass of a piston that a joint with play moves at present."""
    return p.se_m if p.series_kind == 4 and p.i_w >= 0 and mode[1] != 0.0 else 0.0


@njit(cache=True)
def _storey(p, d, hyst, k):
    if p.ss_kind == 1:
        c = min(max(d, -p.ss_d), p.ss_d)
        return k * c * (1.0 - (c / p.ss_d) ** 2 / 3.0)
    if p.ss_kind == 2:
        return k * p.ss_d * tanh(d / p.ss_d)
    if p.ss_kind == 3:
        return k * (p.ss_a * d + (1.0 - p.ss_a) * p.ss_d * hyst)
    return k * d


@njit(cache=True)
def _layer(p, x, v):
    """What the isolation layer adds to its linear spring, dry friction apart."""
    f = 0.0
    if p.du_kind == 1:
        f += p.du_k * x * (x / p.du_x) ** 2
    elif p.du_kind == 2:
        f += p.du_k * (p.du_x * sinh(x / p.du_x) - x)
    elif p.du_kind == 3:
        f += p.du_k * x * (x / p.du_x) ** 4
    if p.es_kind > 0:
        f += _stop(p, x, v)
    return f


@njit(cache=True)
def _dry(p, v):
    """Size of the base's dry friction at speed v."""
    if p.bf_kind == 1:
        return p.bf_f
    if p.bf_kind == 2:
        return p.bf_f * (1.0 - (1.0 - p.bf_r) * exp(-abs(v) / p.bf_w))
    return 0.0


@njit(cache=True)
def _set_valued(p, mode):
    """Whether the base can be held by dry friction, its own or the damper's."""
    bare = p.law == 0 and p.pre_kind == 0
    bare = bare and (p.series_kind == 0 or (p.series_kind == 4 and mode[1] != 0.0))
    return p.building == 1 and (bare or p.bf_kind == 1 or p.bf_kind == 2)


@njit(cache=True)
def _grasp(p, s, ds, mode, mem, lens, x, e):
    """Least and largest force of the damper while the base rests.

    A rod that only pushes on its piston cannot pull: beyond that end the joint opens.
    """
    lo, _, _ = _device(p, s, ds, mode[1], mem, lens, x, 0.0, 0.0, -1.0, e, True)
    hi, _, _ = _device(p, s, ds, mode[1], mem, lens, x, 0.0, 0.0, 1.0, e, True)
    if p.series_kind == 4 and p.law == 0:
        if mode[1] > 0.0:
            lo = 0.0
        elif mode[1] < 0.0:
            hi = 0.0
    return lo, hi


@njit(cache=True)
def _base_balance(p, s, ag, v, old):
    """Force at which the base would not accelerate: all but damper and dry friction."""
    i = p.i_q
    x0, x1 = s[i], s[i + 1]
    v1 = s[i + 4]
    h1 = s[p.i_bw] if p.i_bw >= 0 else 0.0
    r1 = _storey(p, x1 - x0, h1, p.k1)
    c = p.alpha * p.mb * v + p.beta * (p.kb * v + p.k1 * (v - v1))
    f = r1 - p.kb * x0 - _layer(p, x0, v) - c - p.mb * ag - old
    if p.i_bf >= 0:
        f -= p.bf_f * s[p.i_bf]
    return f


@njit(cache=True)
def _motion(mot, k, tau):
    x, v, a = 0.0, 0.0, 0.0
    for m in range(5, -1, -1):
        a = a * tau + 2.0 * v
        v = v * tau + x
        x = x * tau + mot[m, k]
    return x, v, a


@njit(cache=True)
def _felt(volt, k, tau, h):
    """Felt voltage inside sample interval k: cubic through points FINE to the interval."""
    g = h / FINE
    j = min(max(int(tau / g), 0), FINE - 1)
    q = tau / g - j
    a, b = volt[k, j], volt[k, j + 1]
    left = 0.5 * (b - volt[k, j - 1]) if j > 0 else 2.0 * b - 1.5 * a - 0.5 * volt[k, 2]
    right = 0.5 * (volt[k, j + 2] - a) if j < FINE - 1 else 1.5 * b - 2.0 * a + 0.5 * volt[k, j - 1]
    return (
        a
        + q * left
        + q * q * (3.0 * (b - a) - 2.0 * left - right)
        + q * q * q * (left + right - 2.0 * (b - a))
    )


@njit(cache=True)
def _flow(p, t, k, h, s, ds, mode, mem, lens, filt, mot, volt, ground, row):
    """Rates of all states; if row is not empty, everything that an instrument could show."""
    for i in range(ds.size):
        ds[i] = 0.0
    tau = t - k * h
    e = _felt(volt, k, tau, h)
    old = _old_shear(p, s)
    friction, f = 0.0, 0.0
    y, w = 0.0, 0.0
    if p.building == 0:
        x, v, a = _motion(mot, k, tau)
        d = mode[2]
        if row.size > 0:
            d = 0.0 if v == 0.0 else copysign(1.0, v)
        f, y, w = _device(p, s, ds, mode[1], mem, lens, x, v, a, d, e, False)
        f += (p.mass + _carried(p, mode)) * a + old
    else:
        i = p.i_q
        ag = ground[k] + (ground[k + 1] - ground[k]) * tau / h
        x, v = s[i], s[i + 3]
        dry = _set_valued(p, mode)
        a = 0.0
        if dry and mode[0] == 0:
            v = 0.0
            held = _base_balance(p, s, ag, v, old)
            lo, hi = _grasp(p, s, ds, mode, mem, lens, x, e)
            _mid, y, w = _device(p, s, ds, mode[1], mem, lens, x, v, 0.0, 0.0, e, False)
            bf = _dry(p, 0.0)
            span = hi - lo + 2.0 * bf
            part = (held - lo + bf) / span if span > 0.0 else 0.5
            f = lo + (hi - lo) * part + old
            friction = bf * (2.0 * part - 1.0)
        else:
            d = copysign(1.0, v) if v != 0.0 else 0.0
            if dry:
                d = mode[0]
            f, y, w = _device(p, s, ds, mode[1], mem, lens, x, v, 0.0, d, e, False)
            if dry:
                friction = _dry(p, v) * d
            mass = p.mass + _carried(p, mode)
            a = (_base_balance(p, s, ag, v, old) - f - friction) / (p.mb + mass)
            f += mass * a + old
        x0, x1, x2 = s[i], s[i + 1], s[i + 2]
        v1, v2 = s[i + 4], s[i + 5]
        h1, h2 = 0.0, 0.0
        if p.i_bw >= 0:
            h1, h2 = s[p.i_bw], s[p.i_bw + 1]
        r1 = _storey(p, x1 - x0, h1, p.k1)
        r2 = _storey(p, x2 - x1, h2, p.k2)
        c1 = p.alpha * p.m1 * v1 + p.beta * (p.k1 * (v1 - v) + p.k2 * (v1 - v2))
        c2 = p.alpha * p.m2 * v2 + p.beta * p.k2 * (v2 - v1)
        a1 = (r2 - r1 - c1) / p.m1 - ag
        a2 = (-r2 - c2) / p.m2 - ag
        ds[i], ds[i + 1], ds[i + 2] = v, v1, v2
        ds[i + 3], ds[i + 4], ds[i + 5] = a, a1, a2
        if p.i_bw >= 0:
            for j in range(2):
                rel = (v1 - v if j == 0 else v2 - v1) / p.ss_d
                hy = h1 if j == 0 else h2
                g = abs(hy) ** (p.ss_n - 1.0)
                ds[p.i_bw + j] = rel - 0.5 * (abs(rel) * g * hy + rel * g * abs(hy))
        if p.i_bf >= 0:
            b = s[p.i_bf]
            ds[p.i_bf] = (v - 0.5 * (abs(v) * abs(b) * b + v * b * b)) / p.bf_w
            friction += p.bf_f * b
        if row.size > 0:
            row[11], row[12], row[13], row[14] = ag, x0, x1, x2
            row[15], row[16], row[17] = v, v1, v2
            row[18], row[19], row[20] = a + ag, a1 + ag, a2 + ag
            row[21] = friction
    if p.i_bas >= 0:
        for j in range(RATES.size):
            ds[p.i_bas + j] = a - RATES[j] * s[p.i_bas + j]
    fs, vs = f, v
    if p.i_ff >= 0:
        fs = p.ff_d * f
        for m in range(4):
            acc = filt[0, 4, m] * f
            for n in range(4):
                acc += filt[0, m, n] * s[p.i_ff + n]
            ds[p.i_ff + m] = acc
            fs += filt[0, 5, m] * s[p.i_ff + m]
    if p.i_vf >= 0:
        vs = p.vf_d * v
        for m in range(4):
            acc = filt[1, 4, m] * v
            for n in range(4):
                acc += filt[1, m, n] * s[p.i_vf + n]
            ds[p.i_vf + m] = acc
            vs += filt[1, 5, m] * s[p.i_vf + m]
    if row.size > 0:
        row[0], row[1], row[2], row[3], row[4], row[5] = x, v, a, f, fs, vs
        row[6], row[7], row[8] = e, y, w
        row[9] = s[p.i_z] if p.i_z >= 0 else 0.0
        row[10] = s[p.i_hot] if p.i_hot >= 0 else 0.0


@njit(cache=True)
def _margin(p, t, k, h, s, ds, mode, mem, lens, mot, volt, ground):
    """Distance to the next event: negative where the present mode no longer holds.

    Returns the distance and which mode it belongs to (0 friction, 1 play, 2 reversal).
    """
    least, which = 1.0, -1
    tau = t - k * h
    e = _felt(volt, k, tau, h)
    a, friction, held = 0.0, 0.0, 0.0
    if p.building == 0:
        x, v, a = _motion(mot, k, tau)
        d = mode[2]
    else:
        x, v = s[p.i_q], s[p.i_q + 3]
        d = copysign(1.0, v) if v != 0.0 else 0.0
        ag = ground[k] + (ground[k + 1] - ground[k]) * tau / h
        held = _base_balance(p, s, ag, v, _old_shear(p, s))
        if _set_valued(p, mode):
            if mode[0] != 0:
                d = mode[0]
                least, which = mode[0] * v / p.wn, 0
                friction = _dry(p, v) * d
            else:
                lo, hi = _grasp(p, s, ds, mode, mem, lens, x, e)
                bf = _dry(p, 0.0)
                return min(hi + bf - held, held - lo + bf) / (p.y0 + bf), 0
        if p.pre_kind == 3:
            g = mode[2] * v / p.wn
            if g < least:
                least, which = g, 2
    if p.series_kind == 4:
        if mode[1] == 0:
            g = (p.se_gap - abs(x - s[p.i_y])) / p.se_gap
        else:
            f, _, _ = _device(p, s, ds, mode[1], mem, lens, x, v, a, d, e, True)
            m = _carried(p, mode)
            if p.building == 1:
                a = (held - f - friction) / (p.mb + p.mass + m)
            g = mode[1] * (f + m * a) / p.y0
        if g < least:
            least, which = g, 1
    return least, which


@njit(cache=True)
def _switch(p, which, t, k, h, s, ds, mode, mem, lens, mot, volt, ground):
    """Takes the mode that holds after an event."""
    tau = t - k * h
    e = _felt(volt, k, tau, h)
    if which == 1:
        x, v, _ = _motion(mot, k, tau) if p.building == 0 else (s[p.i_q], s[p.i_q + 3], 0.0)
        if mode[1] == 0:
            mode[1] = copysign(1.0, x - s[p.i_y])
            if not (p.bf_kind == 1 or p.bf_kind == 2):
                mode[0] = mode[1]
        else:
            s[p.i_y] = x - mode[1] * p.se_gap
            if p.i_w >= 0:
                s[p.i_w] = v
            mode[1] = 0.0
    elif which == 2:
        mode[2] = -mode[2]
    else:
        ag = ground[k] + (ground[k + 1] - ground[k]) * tau / h
        s[p.i_q + 3] = 0.0
        x = s[p.i_q]
        held = _base_balance(p, s, ag, 0.0, _old_shear(p, s))
        lo, hi = _grasp(p, s, ds, mode, mem, lens, x, e)
        bf = _dry(p, 0.0)
        mode[0] = 0.0
        if held > hi + bf:
            mode[0] = 1.0
        elif held < lo - bf:
            mode[0] = -1.0
        if p.series_kind == 4 and p.law == 0 and mode[0] * mode[1] < 0.0:
            s[p.i_y] = x - mode[1] * p.se_gap
            mode[1] = 0.0


@njit(cache=True)
def _settle(p, t, k, h, s, ds, mode, mem, lens, mot, volt, ground):
    """Leaves modes that ended at once, by a jump of the voltage or with the event before."""
    count = 0
    for _ in range(4):
        g, which = _margin(p, t, k, h, s, ds, mode, mem, lens, mot, volt, ground)
        if g >= -1e-12 or which == 2 or (which == 0 and mode[0] != 0.0):
            break
        _switch(p, which, t, k, h, s, ds, mode, mem, lens, mot, volt, ground)
        count += 1
    return count


@njit(cache=True)
def _weight(scale, s):
    """Size against which an error counts; a negative scale takes no account of the state's own."""
    return scale + abs(s) if scale > 0.0 else -scale


@njit(cache=True)
def _try_step(p, t, k, h, dt, s, new, stage, err, mode, mem, lens, filt, mot, volt, ground, none):
    """One Dormand-Prince step; stage[0] holds the rates at its beginning."""
    n = s.size
    for i in range(n):
        new[i] = s[i] + dt * stage[0, i] / 5.0
    _flow(p, t + dt / 5.0, k, h, new, stage[1], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        new[i] = s[i] + dt * (3.0 / 40.0 * stage[0, i] + 9.0 / 40.0 * stage[1, i])
    _flow(p, t + 0.3 * dt, k, h, new, stage[2], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        new[i] = s[i] + dt * (
            44.0 / 45.0 * stage[0, i] - 56.0 / 15.0 * stage[1, i] + 32.0 / 9.0 * stage[2, i]
        )
    _flow(p, t + 0.8 * dt, k, h, new, stage[3], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        new[i] = s[i] + dt * (
            19372.0 / 6561.0 * stage[0, i]
            - 25360.0 / 2187.0 * stage[1, i]
            + 64448.0 / 6561.0 * stage[2, i]
            - 212.0 / 729.0 * stage[3, i]
        )
    _flow(p, t + 8 * dt / 9, k, h, new, stage[4], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        new[i] = s[i] + dt * (
            9017.0 / 3168.0 * stage[0, i]
            - 355.0 / 33.0 * stage[1, i]
            + 46732.0 / 5247.0 * stage[2, i]
            + 49.0 / 176.0 * stage[3, i]
            - 5103.0 / 18656.0 * stage[4, i]
        )
    _flow(p, t + dt, k, h, new, stage[5], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        new[i] = s[i] + dt * (
            35.0 / 384.0 * stage[0, i]
            + 500.0 / 1113.0 * stage[2, i]
            + 125.0 / 192.0 * stage[3, i]
            - 2187.0 / 6784.0 * stage[4, i]
            + 11.0 / 84.0 * stage[5, i]
        )
    _flow(p, t + dt, k, h, new, stage[6], mode, mem, lens, filt, mot, volt, ground, none)
    for i in range(n):
        err[i] = dt * (
            71.0 / 57600.0 * stage[0, i]
            - 71.0 / 16695.0 * stage[2, i]
            + 71.0 / 1920.0 * stage[3, i]
            - 17253.0 / 339200.0 * stage[4, i]
            + 22.0 / 525.0 * stage[5, i]
            - 1.0 / 40.0 * stage[6, i]
        )


@njit(cache=True)
def _factor(m, order):
    """LU factors in place, partial pivoting; False where the matrix is singular."""
    n = order.size
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(m[i, j]) > abs(m[best, j]):
                best = i
        if m[best, j] == 0.0:
            return False
        order[j] = best
        if best != j:
            for i in range(n):
                m[j, i], m[best, i] = m[best, i], m[j, i]
        for i in range(j + 1, n):
            q = m[i, j] / m[j, j]
            m[i, j] = q
            if q != 0.0:
                for c in range(j + 1, n):
                    m[i, c] -= q * m[j, c]
    return True


@njit(cache=True)
def _backsolve(m, order, b):
    n = order.size
    for j in range(n):
        best = order[j]
        if best != j:
            b[j], b[best] = b[best], b[j]
    for j in range(n):
        for i in range(j + 1, n):
            b[i] -= m[i, j] * b[j]
    for j in range(n - 1, -1, -1):
        b[j] /= m[j, j]
        for i in range(j):
            b[i] -= m[i, j] * b[j]


@njit(cache=True)
def _slopes(p, t, k, h, s, f0, jac, scale, mode, mem, lens, filt, mot, volt, ground, none, w1, w2):
    """Jacobian of the rates by forward differences."""
    n = s.size
    for i in range(n):
        w1[i] = s[i]
    for j in range(n):
        d = 1e-7 * _weight(scale[j], s[j])
        w1[j] = s[j] + d
        _flow(p, t, k, h, w1, w2, mode, mem, lens, filt, mot, volt, ground, none)
        for i in range(n):
            jac[i, j] = (w2[i] - f0[i]) / d
        w1[j] = s[j]


@njit(cache=True)
def _implicit(
    p, t, k, h, dt, s, new, f0, jac, big, small, stage, err, scale, rtol,
    mode, mem, lens, filt, mot, volt, ground, none, z, b, order, order1, w1,
):  # fmt: skip
    """One step of Radau IIA, order 5 (Hairer & Wanner, Solving ODEs II, IV.8); False: no solution.

    The error estimate is of order 3 and filtered, as there.
    """
    n = s.size
    for i in range(3):
        for j in range(3):
            for r in range(n):
                for c in range(n):
                    unit = 1.0 if i == j and r == c else 0.0
                    big[i * n + r, j * n + c] = unit - dt * RADAU_A[i, j] * jac[r, c]
    if not _factor(big, order):
        return False
    for i in range(3):
        for r in range(n):
            z[i * n + r] = RADAU_C[i] * dt * f0[r]
    last = 1e300
    done = False
    for turn in range(12):
        for i in range(3):
            for r in range(n):
                w1[r] = s[r] + z[i * n + r]
            _flow(
                p, t + RADAU_C[i] * dt, k, h, w1, stage[i + 1], mode, mem, lens, filt, mot, volt,
                ground, none,
            )  # fmt: skip
        for i in range(3):
            for r in range(n):
                q = -z[i * n + r]
                for j in range(3):
                    q += dt * RADAU_A[i, j] * stage[j + 1, r]
                b[i * n + r] = q
        _backsolve(big, order, b)
        size = 0.0
        for i in range(3):
            for r in range(n):
                z[i * n + r] += b[i * n + r]
                q = b[i * n + r] / (rtol * _weight(scale[r], s[r]))
                size += q * q
        size = (size / (3 * n)) ** 0.5
        if size < 1e-3:
            done = True
            break
        if turn > 1 and size > 0.9 * last:
            break
        last = size
    if not done:
        return False
    for r in range(n):
        new[r] = s[r] + z[2 * n + r]
        for c in range(n):
            small[r, c] = -jac[r, c]
        small[r, r] += RADAU_G / dt
        err[r] = f0[r]
        for i in range(3):
            err[r] += RADAU_E[i] * z[i * n + r] / dt
    if not _factor(small, order1):
        return False
    _backsolve(small, order1, err)
    return True


@njit(cache=True)
def march(plant, s, scale, rtol, h, stops, where, wanted, lens, filt, mot, volt, ground, out):
    """Integrates over all stops and fills out, one row for each wanted stop.

    stops (m,) s rising, stops[0] the start; where (m,) sample interval that follows each stop;
    wanted (m,) 1 where a row is recorded. Returns (steps, events, smallest step).
    """
    p = plant[0]
    n = s.size
    stage = np.zeros((7, n))
    new, err = np.zeros(n), np.zeros(n)
    none = np.zeros(0)
    mode = np.zeros(3)  # friction of the base, play, sense of a prescribed motion
    mode[2] = 1.0
    mem = np.zeros(lens.size + 1)
    stiff = p.series_kind in (1, 2, 3, 5) or p.i_w >= 0 or p.pre_kind == 1 or p.pre_kind == 2
    jac, small = np.zeros((n, n)), np.zeros((n, n))
    big = np.zeros((3 * n, 3 * n)) if stiff else np.zeros((0, 0))
    z, b, w1 = np.zeros(3 * n), np.zeros(3 * n), np.zeros(n)
    order, order1 = np.zeros(3 * n, np.int64), np.zeros(n, np.int64)
    if stiff:  # the estimate is two orders below the solution
        rtol = rtol ** (2.0 / 3.0)
    power = -0.25 if stiff else -0.2
    steps, events, row = 0, 0, 0
    dt, least = h, h
    eventful = p.series_kind == 4 or _set_valued(p, mode) or (p.building == 1 and p.pre_kind == 3)
    for j in range(stops.size):
        t, k = stops[j], where[j]
        end = stops[j + 1] if j + 1 < stops.size else t
        if p.building == 0 and end > t:
            v = _motion(mot, k, 0.5 * (t + end) - k * h)[1]
            was = mode[2]
            mode[2] = copysign(1.0, v) if v != 0.0 else 0.0
            if p.brk_kind > 0 and mode[2] * was < 0.0:
                mem[lens.size] = _motion(mot, k, t - k * h)[0]
        elif p.pre_kind == 3 and p.building == 1 and s[p.i_q + 3] != 0.0:
            mode[2] = copysign(1.0, s[p.i_q + 3])
        if eventful and end > t:
            events += _settle(p, t, k, h, s, stage[1], mode, mem, lens, mot, volt, ground)
        if wanted[j] == 1:
            _flow(p, t, k, h, s, stage[0], mode, mem, lens, filt, mot, volt, ground, out[row])
            row += 1
        if j + 1 == stops.size:
            break
        if n == 0:
            if p.pre_kind == 3:
                _remember(mem, lens, _motion(mot, k, end - k * h)[0])
            continue
        fresh, stuck = True, 0
        while t < end:
            if fresh:
                _flow(p, t, k, h, s, stage[0], mode, mem, lens, filt, mot, volt, ground, none)
                if stiff:
                    _slopes(
                        p, t, k, h, s, stage[0], jac, scale, mode, mem, lens, filt, mot, volt,
                        ground, none, w1, stage[1],
                    )  # fmt: skip
                fresh = False
            last = dt >= end - t
            step = min(dt, end - t)
            if stiff:
                if not _implicit(
                    p, t, k, h, step, s, new, stage[0], jac, big, small, stage, err, scale, rtol,
                    mode, mem, lens, filt, mot, volt, ground, none, z, b, order, order1, w1,
                ):  # fmt: skip
                    dt = 0.3 * step
                    if dt < 1e-13:
                        return -1, events, least
                    continue
            else:
                _try_step(
                    p, t, k, h, step, s, new, stage, err, mode, mem, lens, filt, mot, volt,
                    ground, none,
                )  # fmt: skip
            size = 0.0
            for i in range(n):
                q = err[i] / (rtol * _weight(scale[i], max(abs(s[i]), abs(new[i]))))
                size += q * q
            size = (size / n) ** 0.5
            if size > 1.0 and step > 1e-9:
                dt = step * max(0.2, 0.9 * size**power)
                continue
            grow = min(5.0, 0.9 * max(size, 1e-6) ** power)
            hit = -1
            if eventful:
                tn = end if last else t + step
                g, which = _margin(p, tn, k, h, new, stage[1], mode, mem, lens, mot, volt, ground)
                if g < 0.0:
                    hit = which
                    lo, hi = 0.0, step
                    for turn in range(62):
                        mid = 0.5 * (lo + hi)
                        if hi - lo <= 1e-12 or turn == 61:
                            mid = hi
                        if stiff:
                            _implicit(
                                p, t, k, h, mid, s, new, stage[0], jac, big, small, stage, err,
                                scale, rtol, mode, mem, lens, filt, mot, volt, ground, none, z, b,
                                order, order1, w1,
                            )  # fmt: skip
                        else:
                            _try_step(
                                p, t, k, h, mid, s, new, stage, err, mode, mem, lens, filt, mot,
                                volt, ground, none,
                            )  # fmt: skip
                        if mid == hi:
                            break
                        g, which = _margin(
                            p, t + mid, k, h, new, stage[1], mode, mem, lens, mot, volt, ground
                        )
                        if g < 0.0:
                            hi, hit = mid, which
                        else:
                            lo = mid
                    step, last = hi, hi >= end - t
            for i in range(n):
                s[i] = new[i]
                stage[0, i] = stage[6, i]
            fresh = stiff
            t = end if last else t + step
            steps += 1
            if steps > LIMIT:
                return -1, events, least
            if hit < 0 and not last:
                least = min(least, step)
            if p.pre_kind == 3:
                y = s[p.i_q] if p.building == 1 else _motion(mot, k, t - k * h)[0]
                _remember(mem, lens, y)
            if hit >= 0:
                _switch(p, hit, t, k, h, s, stage[1], mode, mem, lens, mot, volt, ground)
                events += 1 + _settle(p, t, k, h, s, stage[1], mode, mem, lens, mot, volt, ground)
                stuck += 1
                fresh = True
                if stuck > 1000:
                    return -1, events, least
            else:
                dt = max(step * grow, 1e-9) if not last or step >= dt else max(dt, step * grow)
                dt = min(dt, h)
    return steps, events, least


@njit(cache=True)
def electric_path(fine, kind, t_up, t_down, rem_kind, rem_r, sat_kind, sat_v):
    """Voltage that the fluid feels, in place.

    fine (n, FINE + 1) V: the command at equal points of each sample interval, both ends
    included, so that a jump stands between fine[k, -1] and fine[k + 1, 0]. t_up, t_down are
    times of the coil in units of one slice. The lag is integrated exactly for a command that is
    linear over a slice; memory by the path itself, whatever its speed.
    """
    n = fine.shape[0]
    i1 = fine[0, 0]
    i2 = i1
    plays = np.zeros(8)
    current = 0.0
    for k in range(n):
        held = fine[k, 0]
        for j in range(fine.shape[1]):
            command = fine[k, j]
            if kind > 0 and j > 0:
                i1, i2 = _lag(kind, i1, i2, held, command, t_up, t_down)
            held = command
            now = command
            if kind > 0:
                now = i2 if kind == 3 else i1
            felt = now
            if rem_kind == 1:
                plays[0] = min(max(plays[0], now - rem_r), now + rem_r)
                felt = max(plays[0], 0.0)
            elif rem_kind == 2:
                felt = 0.0
                for m in range(8):
                    width = rem_r * (2.0 * m + 1.0) / 8.0
                    plays[m] = min(max(plays[m], now - width), now + width)
                    felt += plays[m] / 8.0
                felt = max(felt, 0.0)
            elif rem_kind == 3:
                plays[0] = _duhem(plays[0], current, now, rem_r)
                felt = max(plays[0], 0.0)
            current = now
            if sat_kind == 1:
                felt = sat_v * tanh(felt / sat_v)
            elif sat_kind == 2:
                felt = felt / (1.0 + felt / sat_v)
            elif sat_kind == 3:
                q = 3.0 * felt / sat_v
                felt = (
                    felt * (1.0 - q * q / 15.0) if q < 1e-3 else sat_v * (1.0 / tanh(q) - 1.0 / q)
                )
            fine[k, j] = felt


@njit(cache=True)
def _first_order(state, a, b, time):
    """Exact answer of a first-order lag to a command going from a to b in one unit of time."""
    slope = b - a
    fade = exp(-1.0 / time)
    return b - slope * time + (state - a + slope * time) * fade


@njit(cache=True)
def _lag(kind, i1, i2, a, b, t_up, t_down):
    if kind == 1:
        return _first_order(i1, a, b, t_up), i2
    if kind == 2:
        done = 0.0
        for _ in range(3):  # the lag meets its command at most twice in a slice
            c = a + (b - a) * done
            climbing = c >= i1 if c != i1 else b >= a
            time = t_up if climbing else t_down
            full = _first_order(i1, c, b, time / (1.0 - done))
            if (b >= full) == climbing or full == b:
                return full, i2
            lo, hi = 0.0, 1.0 - done
            for _ in range(50):
                mid = 0.5 * (lo + hi)
                end = a + (b - a) * (done + mid)
                if (end >= _first_order(i1, c, end, time / mid)) == climbing:
                    lo = mid
                else:
                    hi = mid
            done += hi
            i1 = a + (b - a) * done
            if done >= 1.0:
                break
        return i1, i2
    # eddy currents: a second lag behind the first, integrated in small slices
    m = int(min(max(20.0 / min(t_up, t_down), 4.0), 400.0))
    for q in range(m):
        c0 = a + (b - a) * q / m
        c1 = a + (b - a) * (q + 0.5) / m
        c2 = a + (b - a) * (q + 1.0) / m
        k1, l1 = (c0 - i1) / t_up, (i1 - i2) / t_down
        p1, p2 = i1 + 0.5 * k1 / m, i2 + 0.5 * l1 / m
        k2, l2 = (c1 - p1) / t_up, (p1 - p2) / t_down
        p1, p2 = i1 + 0.5 * k2 / m, i2 + 0.5 * l2 / m
        k3, l3 = (c1 - p1) / t_up, (p1 - p2) / t_down
        p1, p2 = i1 + k3 / m, i2 + l3 / m
        k4, l4 = (c2 - p1) / t_up, (p1 - p2) / t_down
        i1 += (k1 + 2.0 * k2 + 2.0 * k3 + k4) / (6.0 * m)
        i2 += (l1 + 2.0 * l2 + 2.0 * l3 + l4) / (6.0 * m)
    return i1, i2


@njit(cache=True)
def _duhem(flux, old, now, width):
    """Flux that follows the current with a lag in current: d flux = (1 - gap / width) d current.

    gap = what the flux is behind; while the current comes back over the flux nothing moves.
    """
    if now == old:
        return flux
    d = 1.0 if now > old else -1.0
    behind = d * (old - flux)
    travel = d * (now - old)
    if behind < 0.0:
        idle = min(travel, -behind)
        travel -= idle
        behind += idle
        if behind < 0.0:
            return flux
    if travel <= 0.0:
        return flux
    behind = width + (behind - width) * exp(-travel / width)
    return now - d * behind


@njit(cache=True)
def bristle_along_path(x, v, h, kappa, z):
    """Bristle deflection along a sampled motion, from displacement alone; fills z (n,) m.

    Over the path |dx| the bristle relaxes to 1/kappa in the sense of motion; between samples of
    opposite velocity the turning point is that of the cubic through both ends.
    """
    z[0] = 0.0
    for i in range(1, x.size):
        va, vb = v[i - 1], v[i]
        if va * vb < 0.0:
            a = x[i - 1]
            m = x[i] - a
            c2 = 3.0 * m - h * (2.0 * va + vb)
            c3 = h * (va + vb) - 2.0 * m
            lo, hi = 0.0, 1.0
            for _ in range(60):
                q = 0.5 * (lo + hi)
                g = h * va + q * (2.0 * c2 + 3.0 * c3 * q)
                if (g > 0.0) == (va > 0.0):
                    lo = q
                else:
                    hi = q
            turn = a + q * (h * va + q * (c2 + c3 * q))
            zm = _relax(z[i - 1], turn - a, kappa)
            z[i] = _relax(zm, x[i] - turn, kappa)
        else:
            z[i] = _relax(z[i - 1], x[i] - x[i - 1], kappa)


@njit(cache=True)
def _relax(z, dx, kappa):
    goal = copysign(1.0, dx) / kappa
    return goal + (z - goal) * exp(-kappa * abs(dx))
