"""Buildings on a shake table, simulated by steps of velocity: a second generator of cases.

It shares no code with bristle nor with the generator of the blind benchmark. Dry friction is an
impulse that a step cannot exceed (Moreau 1988), so sticking needs no events. Masses and stiffnesses
are drawn, and so are the number of floors, the rate and the damping.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from bristle.core.arrays import Array

FINE = 2e-5
"""Step of the simulation [s]."""

RATES = (200, 250, 500)
HIDDEN = (
    "gas_spring", "fluid_inertia", "quadratic_damping", "asymmetry", "saturation", "coil_lag",
    "stribeck", "delay", "base_friction", "duffing", "storey_softening", "end_stop",
)  # fmt: skip
SITES = ("base_friction", "duffing", "storey_softening", "end_stop")
"""Those of the structure."""


@dataclass(frozen=True)
class Shaken:
    """Runs of a building, each a dictionary of arrays (n,) [SI] with name and role; its numbers."""

    runs: list[dict[str, Any]]
    masses: list[float]
    stiffnesses: list[float]
    ratio: float


def shaken(
    seed: int, law: str, hidden: str = "", share: float = 0.0, noise: float = 0.01
) -> Shaken:
    """Return what the instruments of a building show.

    Parameters
    ----------
    seed : of everything that is drawn
    law : "bingham" or "lugre"
    hidden : one of `HIDDEN`, "" for nothing
    share : about the RMS of what is hidden by that of the force of its site
    noise : standard deviation of each channel's white noise by its RMS
    """
    rng = np.random.default_rng([seed, 71])
    n = int(rng.integers(2, 6))
    size = float(rng.choice((1.0, 60.0)))
    m = size * np.append(rng.uniform(1.5, 3.0), rng.uniform(0.8, 1.6, n - 1))
    k = np.append(rng.uniform(11.0, 15.0) ** 2 * m.sum(), np.zeros(n - 1))
    k[1:] = (rng.uniform(22.0, 34.0) * n / 3.0) ** 2 * m[1:].mean() * rng.uniform(0.9, 1.2, n - 1)
    k[0] *= rng.uniform(0.6, 1.0)
    ratio, rate = float(rng.uniform(0.008, 0.025)), int(rng.choice(RATES))
    C = _damping(m, k, ratio)
    stroke, fast = rng.uniform(0.015, 0.03), rng.uniform(0.15, 0.3)
    pull = 0.2 * size * 9.81 * rng.uniform(0.5, 0.9)  # [N] at full voltage
    d = {
        "yield": 0.25 * pull, "by_volt": 0.09 * pull, "drag": rng.uniform(3.0, 9.0) * pull,
        "drag_by_volt": rng.uniform(0.4, 1.2) * pull, "v_n": rng.uniform(0.015, 0.05),
        "turn": rng.uniform(300.0, 700.0) * float(law == "lugre"),
        "inner": rng.uniform(0.1, 0.6) * pull, "law": float(law == "lugre"),
    }  # fmt: skip
    plan = [("train", "quake"), ("train", "sweep"), ("train", "quake")]
    plan += [("holdout", "quake"), ("holdout", "random")]
    inputs = [_input(kind, rate, rng) for _, kind in plan]
    plain = dict.fromkeys(HIDDEN, 0.0)
    strong = 1.0
    for _ in range(5):  # the ground is scaled until the base goes as far as it is meant to
        first = _run(m, k, C, d, plain, inputs[0], strong, rate)
        reach = np.max(np.abs(first["base_displacement"])) / stroke
        speed = np.max(np.abs(first["base_velocity"])) / fast
        strong /= max(0.5 * (reach + speed), 0.05)
    extra = dict(plain)
    if hidden:
        extra[hidden] = _amount(hidden, share, m, k, first)
    runs = []
    for number, ((role, _), one) in enumerate(zip(plan, inputs, strict=True)):
        run = _run(m, k, C, d, extra, one, strong * rng.uniform(0.8, 1.2), rate)
        if hidden == "delay":
            late = np.interp(run["time"] - extra["delay"], run["time"], run["force"])
            run["force"] = late
        for name in [c for c in run if c != "time"]:
            spread = noise * float(np.sqrt(np.mean(run[name] ** 2)))
            run[name] = run[name] + spread * rng.standard_normal(len(run[name]))
        runs.append({"name": f"{role}_{number}", "role": role, **run})
    return Shaken(runs, m.tolist(), k.tolist(), ratio)


def _damping(m: Array, k: Array, ratio: float) -> Array:
    """Return Rayleigh's damping with one ratio in the first mode and the last."""
    K = _stiffness(k)
    omega = np.sqrt(np.linalg.eigvalsh(K / np.sqrt(np.outer(m, m))))
    low, high = omega[0], omega[-1]
    return 2.0 * ratio / (low + high) * (low * high * np.diag(m) + K)


def _stiffness(k: Array) -> Array:
    return np.diag(k + np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)


def _input(kind: str, rate: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return ground acceleration of unit peak and voltage at the samples (n,)."""
    t = np.arange(round(rng.uniform(12.0, 20.0) * rate)) / rate
    if kind == "sweep":
        low, high = rng.uniform(0.7, 1.0), rng.uniform(6.0, 10.0)
        a = np.sin(2.0 * np.pi * (low * t + 0.5 * (high - low) * t * t / t[-1]))
        a *= 0.3 + 0.7 * t / t[-1]
    else:
        f = np.fft.rfftfreq(2 * len(t), 1.0 / rate)
        top, edge = (rng.uniform(1.5, 3.0), 12.0) if kind == "quake" else (4.0, 9.0)
        shape = (f / 0.7) ** 2 / (1.0 + (f / 0.7) ** 2) / (1.0 + (f / top) ** 2)
        shape /= 1.0 + (f / edge) ** 6
        white = rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))
        a = np.fft.irfft(shape * white)[: len(t)]
        if kind == "quake":
            top = rng.uniform(0.15, 0.3) * t[-1]
            a *= (t / top) ** 2 * np.exp(2.0 * (1.0 - t / top))
    a *= np.minimum(t / 0.5, 1.0)
    holds = max(1, round(rng.uniform(0.2, 1.0) * rate))
    volts = np.repeat(rng.uniform(0.0, 8.0, len(t) // holds + 1), holds)[: len(t)]
    if rng.random() < 0.4:
        volts = 3.0 * (1.0 + np.sin(2.0 * np.pi * rng.uniform(0.3, 1.5) * t))
    return a / np.max(np.abs(a)), volts


def _amount(name: str, share: float, m: Array, k: Array, run: dict[str, Array]) -> float:
    """Return the size of an effect that makes about a share of its site's force."""
    force, x, v = run["force"], run["base_displacement"], run["base_velocity"]
    a = run["base_acceleration_absolute"] - run["ground_acceleration"]

    def by(signal: Array, of: Array = force) -> float:
        return share * float(np.std(of) / np.std(signal))

    if name in ("gas_spring", "fluid_inertia", "quadratic_damping", "base_friction"):
        signal = {
            "gas_spring": x, "fluid_inertia": a, "quadratic_damping": v * np.abs(v),
            "base_friction": np.sign(v),
        }[name]  # fmt: skip
        return 1.5 * by(signal)
    if name == "stribeck":
        return 3.0 * share
    if name == "duffing":
        return 2.0 * by(x**3, k[0] * x)
    if name == "storey_softening":
        drift = run["floor1_displacement"] - x
        return 2.0 * share / float(np.std(drift)) ** 2
    if name == "end_stop":
        gap = 0.5 * float(np.max(np.abs(x)))
        return by(np.maximum(np.abs(x) - gap, 0.0), k[0] * x) + 1j * gap  # type: ignore[return-value]
    if name == "saturation":
        return 0.6 * share  # of 1 / V
    return {"asymmetry": share, "coil_lag": 0.15 * share, "delay": 0.02 * share}[name]


def _run(
    m: Array, k: Array, C: Array, d: dict[str, float], extra: dict[str, Any],
    given: tuple[Array, Array], strong: float, rate: int,
) -> dict[str, Array]:  # fmt: skip
    """Return the channels of a run (n,), without noise."""
    ground, volts = given
    ground = strong * ground
    sub = round(1.0 / (rate * FINE))
    stop = complex(extra["end_stop"])
    sizes = np.array(
        [float(extra[one]) for one in HIDDEN[:-1]] + [stop.real, stop.imag], dtype=float
    )
    numbers = np.array(list(d.values()))
    x, v, a, f = _march(m, k, C, numbers, sizes, ground, volts, sub, 1.0 / (rate * sub))
    ground, volts = ground[:-1], volts[:-1]
    t = np.arange(len(ground)) / rate
    run = {"time": t, "ground_acceleration": ground, "voltage": volts, "force": f}
    for i in range(len(m)):
        level = f"floor{i}" if i else "base"
        run[f"{level}_displacement"], run[f"{level}_velocity"] = x[:, i], v[:, i]
        run[f"{level}_acceleration_absolute"] = a[:, i] + ground
    return run


@njit(cache=True)
def _march(m, k, C, d, e, ground, volts, sub, h):  # type: ignore[no-untyped-def]
    n, count = len(m), len(ground)
    X, V, A, F = np.zeros((count, n)), np.zeros((count, n)), np.zeros((count, n)), np.zeros(count)
    x, v, new, load = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    z, felt = 0.0, volts[0]
    heavy = m[0] + e[1]
    for s in range(count - 1):
        for j in range(sub):
            ag = ground[s] + (ground[s + 1] - ground[s]) * j / sub
            felt += (volts[s] - felt) * (1.0 if e[5] <= 0.0 else min(1.0, h / e[5]))
            E = felt
            if e[4] > 0.0:
                E = felt / np.sqrt(1.0 + (felt * e[4]) ** 2)
            for i in range(n):
                load[i] = -m[i] * ag
                for q in range(n):
                    load[i] -= C[i, q] * v[q]
            for i in range(n):
                drift = x[i] - (x[i - 1] if i else 0.0)
                force = k[i] * drift
                if i == 1 and e[10] > 0.0:
                    force /= np.sqrt(1.0 + e[10] * drift * drift)
                load[i] -= force
                if i:
                    load[i - 1] += force
            w = v[0]
            load[0] -= e[9] * x[0] ** 3
            if abs(x[0]) > e[12]:
                load[0] -= e[11] * (abs(x[0]) - e[12]) * np.sign(x[0])
            side = 1.0 + e[3] * np.tanh(w / 1e-3)
            smooth = (d[2] + d[3] * E) * w * np.exp(-abs(w) / d[4]) * side
            smooth += e[0] * x[0] + e[2] * w * abs(w)
            Y = (d[0] + d[1] * E) * side
            Y += e[6] * d[0] * np.exp(-((w / 0.02) ** 2))
            dry = 0.0
            if d[7] > 0.0:
                rate = w - d[5] * abs(w) * z
                smooth += Y * d[5] * z + d[6] * rate * side
                z += h * rate
            else:
                dry = Y
            free = v[0] + h * (load[0] - smooth) / heavy
            most = (dry + e[8]) * h / heavy
            new[0] = 0.0 if abs(free) <= most else free - np.sign(free) * most
            total = heavy * (free - new[0]) / h
            own = total * (dry / (dry + e[8]) if dry + e[8] > 0.0 else 0.0)
            for i in range(1, n):
                new[i] = v[i] + h * load[i] / m[i]
            if j == 0:
                F[s] = smooth + own + e[1] * (new[0] - v[0]) / h
                for i in range(n):
                    X[s, i], V[s, i], A[s, i] = x[i], v[i], (new[i] - v[i]) / h
            for i in range(n):
                x[i] += 0.5 * h * (v[i] + new[i])
                v[i] = new[i]
    return X[:-1], V[:-1], A[:-1], F[:-1]
