"""Test rigs of devices that no law of the library has, with labels, loggers and engineers' units.

A device is a function of numbers and labels that returns its `force(x, v, u, dt)` [N] and moves its
states on; x [m], v [m/s], u the command [A]. Two labels of a rig matter, a third one does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import copysign, exp, log, tanh
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfilt

from bristle.core.arrays import Array

Force = Callable[[float, float, float, float], float]
Rng = np.random.Generator


@dataclass(frozen=True)
class Labels:
    """The labels of one run: temperature [degC], a second one as a share of its middle level."""

    temperature: float
    second: float

    def warm(self, kelvin: float) -> float:
        """Return the factor of a viscosity with this activation temperature [K], 1 at 25 degC."""
        return exp(kelvin * (1.0 / (self.temperature + 273.15) - 1.0 / 298.15))


Make = Callable[[Rng, float, float], Callable[[Labels], Force]]
"""From draws, stroke [m] and speed [m/s] that are usual, to a device of about 1 N for labels."""


def valve_stack(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Bleed and shims, which blow off and close late; behind a mount, beside a charge of gas."""
    opens, closes, soft = rng.uniform(0.7, 0.9), rng.uniform(0.45, 0.6), rng.uniform(0.15, 0.3)
    bleed, back, K = 1.6 / fast, rng.uniform(0.4, 0.7), rng.uniform(20.0, 60.0) / far

    def of(labels: Labels) -> Force:
        thick, gas = labels.warm(1500.0), 0.25 * labels.second
        bent, lift = 0.0, 0.0

        def force(x: float, v: float, _u: float, dt: float) -> float:
            nonlocal bent, lift
            load = K * bent
            side = 1.0 if load > 0.0 else back
            size = abs(load)
            wanted = 1.0 if size > side * (opens if lift < 0.5 else closes) else 0.0
            lift += (wanted - lift) * min(1.0, dt / 2e-3)
            c = thick * bleed * (side if load < 0.0 else 1.0) * (1.0 - (1.0 - soft) * lift)
            end = load / c
            bent = end * c / K + (v - end) * dt if K * dt < 0.5 * c else v * c / K
            return load + gas / (1.0 + x / (6.0 * far)) - gas

        return force

    return of


def cavitating(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """An orifice whose rebound side cavitates: the void closes before the force comes back."""
    c, q = rng.uniform(0.3, 0.6) / fast, rng.uniform(0.3, 0.6) / fast**2
    least = rng.uniform(0.25, 0.4)

    def of(labels: Labels) -> Force:
        thick, cap = labels.warm(1800.0), least * labels.second
        void = 0.0

        def force(_x: float, v: float, _u: float, dt: float) -> float:
            nonlocal void
            full = thick * c * v + q * v * abs(v)
            if full < -cap:
                void += (-full - cap) / (thick * c) * dt
                return -cap
            if void > 0.0:
                void = max(0.0, void - max(v, 0.0) * dt)
                return min(full, 0.1 * cap)
            return full

        return force

    return of


def ageing_friction(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """A contact whose strength grows while it rests and falls with speed, on a bristle."""
    a, b = rng.uniform(0.03, 0.08), rng.uniform(0.1, 0.2)
    way, k = rng.uniform(0.01, 0.04) * far, rng.uniform(60.0, 200.0) / far

    def of(labels: Labels) -> Force:
        load, wet = labels.second, labels.warm(900.0)
        age, bent = 0.1, 0.0

        def force(_x: float, v: float, _u: float, dt: float) -> float:
            nonlocal age, bent
            slides = wet * (0.7 + a * log(1.0 + abs(v) / (0.01 * fast)) + b * log(1.0 + 50.0 * age))
            age = max(1e-4, age + (1.0 - abs(v) * age / way) * dt)
            bent = max(-slides / k, min(slides / k, bent + v * dt))
            return load * (k * bent + 0.1 * wet * v / fast)

        return force

    return of


def jenkins_elements(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Iwan's bolted joint: elements that slip one after the other."""
    slips = np.sort(rng.uniform(0.02, 1.2, 14)) * far
    weight, after = rng.uniform(0.5, 1.5, 14), rng.uniform(0.05, 0.2)
    weight /= float(weight @ slips)

    def of(labels: Labels) -> Force:
        torque, stiff = labels.second, labels.warm(400.0)
        at = [0.0] * 14

        def force(x: float, v: float, _u: float, dt: float) -> float:
            total = after * x / far
            for k in range(14):
                limit = slips[k] * torque
                at[k] = max(-limit, min(limit, at[k] + v * dt))
                total += stiff * weight[k] * at[k]
            return float(total)

        return force

    return of


def pinched(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """A dowelled joint: yielding, then slack that grows with use, other numbers when pushed."""
    slip, width = rng.uniform(0.5, 0.8), rng.uniform(0.15, 0.3) * far
    push, way, post = rng.uniform(0.5, 0.8), 0.2 * far, rng.uniform(0.2, 0.4)

    def of(labels: Labels) -> Force:
        dry, tight = labels.warm(600.0), labels.second
        z, spent = 0.0, 0.0

        def force(x: float, v: float, _u: float, dt: float) -> float:
            nonlocal z, spent
            side = 0.5 * (tight + push + (tight - push) * tanh(5.0 * x / far))
            h = 1.0 - slip * (1.0 - 0.5 / (1.0 + spent)) * exp(-((x / width) ** 2))
            z += (v - (0.6 * abs(v * z) + 0.4 * v * z) * z) / way * dt
            z = max(-1.5, min(1.5, z))
            spent += 0.01 * abs(z * v) / far * dt
            return dry * side * (h * z * 0.7 + post * x / far) + 0.05 * v / fast

        return force

    return of


def mullins_rubber(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Hardening rubber that softens below the most that it was strained, with two relaxations."""
    hard, loss = rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.4)
    taus = (rng.uniform(0.02, 0.06), rng.uniform(0.2, 0.6))

    def of(labels: Labels) -> Force:
        warm, shore = labels.warm(1200.0), labels.second
        most, inner = 0.1 * far, [0.0, 0.0]

        def force(x: float, v: float, _u: float, dt: float) -> float:
            nonlocal most
            most = max(abs(x), most * (1.0 - 0.05 * dt))
            e = x / far
            soft = 1.0 - loss * (1.0 - abs(x) / most)
            for k in (0, 1):
                inner[k] += (e - inner[k]) * min(1.0, dt / taus[k])
            relaxed = 0.3 * (e - inner[0]) + 0.2 * (e - inner[1])
            return shore * (soft * (0.5 * e + hard * e**3) + warm * relaxed)

        return force

    return of


def _mr_fluid(yielding: float, v: float, at: list[float], dt: float, way: float) -> float:
    """Return the force of a fluid that yields over a way [m], its stretch in `at`."""
    at[0] += (v - abs(v) * at[0]) / way * dt
    at[0] = max(-1.0, min(1.0, at[0]))
    return yielding * at[0]


def eddy_mr(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """MR damper with eddy currents, and a fluid whose yield follows the field at its own pace."""
    coil, eddy = rng.uniform(4e-3, 1e-2), rng.uniform(0.01, 0.03)
    fluid, share = rng.uniform(0.02, 0.06), rng.uniform(0.3, 0.6)
    knee, way = rng.uniform(0.8, 1.6), rng.uniform(0.01, 0.04) * far

    def of(labels: Labels) -> Force:
        thick, charge = labels.warm(1500.0), 0.2 * labels.second
        current = flux = slow = 0.0
        at = [0.0]

        def force(x: float, v: float, u: float, dt: float) -> float:
            nonlocal current, flux, slow
            current += (u - current) * min(1.0, dt / coil)
            flux += (current - flux) * min(1.0, dt / eddy)
            slow += (flux - slow) * min(1.0, dt * (1.0 + abs(v) / fast) / fluid)
            field = (1.0 - share) * flux + share * slow
            load = _mr_fluid(0.1 + 0.9 * tanh(field / knee) ** 1.4, v, at, dt, way)
            return load + thick * 0.2 * v / fast + charge * (1.0 + x / (5.0 * far)) - 0.2

        return force

    return of


def two_stage_mr(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """MR damper whose command passes an amplifier, a coil and the fluid, each late."""
    taus = (rng.uniform(4e-3, 8e-3), rng.uniform(0.01, 0.025), rng.uniform(0.01, 0.02))
    bend, way = rng.uniform(1.3, 1.8), rng.uniform(0.01, 0.05) * far
    series = rng.uniform(15.0, 40.0) / far

    def of(labels: Labels) -> Force:
        thick, gap = labels.warm(1500.0), labels.second
        late, at, inner = [0.0, 0.0, 0.0], [0.0], 0.0

        def force(_x: float, v: float, u: float, dt: float) -> float:
            nonlocal inner
            for k, tau in enumerate(taus):
                u = late[k] = late[k] + (u - late[k]) * min(1.0, dt / tau)
            load = series * inner
            c = thick * 0.25 / fast
            yielding = gap * (0.08 + 0.45 * max(u, 0.0) ** bend / 2.0 ** (bend - 1.0))
            inside = max(abs(load) - yielding * abs(at[0]), 0.0) / c
            inside = copysign(inside, load)
            _mr_fluid(1.0, v, at, dt, way)
            inner += (v - inside) * dt
            return load

        return force

    return of


def dead_time_mr(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """MR damper with a supply that answers after a dead time, and steel that stays magnetised."""
    dead, width = rng.uniform(8e-3, 0.02), rng.uniform(0.05, 0.25)
    way, droop = rng.uniform(0.02, 0.05) * far, rng.uniform(0.1, 0.3)

    def of(labels: Labels) -> Force:
        thick, charge = labels.warm(1500.0), 0.2 * labels.second
        waits: list[float] = []
        play, field, at = 0.0, 0.0, [0.0]

        def force(x: float, v: float, u: float, dt: float) -> float:
            nonlocal play, field
            waits.append(u)
            felt = waits[max(0, len(waits) - 1 - round(dead / dt))]
            play = max(felt - width, min(felt + width, play))
            field += (play - field) * min(1.0, dt / 6e-3)
            size = 0.08 + 0.5 * max(field, 0.0) / (1.0 + droop * abs(v) / fast)
            load = _mr_fluid(size, v, at, dt, way)
            return load + thick * 0.2 * v / fast + charge * (1.0 + x / (5.0 * far)) - 0.2

        return force

    return of


def flag_shaped(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Shape-memory bars: a plateau going out, a lower one coming back, hardening at the end."""
    up, down = rng.uniform(0.5, 0.7), rng.uniform(0.2, 0.35)
    first, slope = rng.uniform(3.0, 6.0) / far, rng.uniform(0.1, 0.25) / far

    def of(labels: Labels) -> Force:
        shift, bars = 0.006 * (labels.temperature - 25.0), labels.second
        load = 0.0

        def force(x: float, v: float, _u: float, dt: float) -> float:
            nonlocal load
            e = abs(x)
            top = min(first * e, up + shift + slope * e)
            low = min(first * e, down + shift + slope * e)
            sign = 1.0 if x > 0.0 else -1.0
            load = max(low, min(top, load * sign + first * v * sign * dt)) * sign
            return bars * (load + 0.3 * sign * max(0.0, e / far - 0.8)) + 0.04 * v / fast

        return force

    return of


def wire_rope(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Strands that rub: a loop that widens outwards, on a spring softer one way than the other."""
    grows, skew = rng.uniform(0.5, 1.0), rng.uniform(0.2, 0.5)
    way, hard = rng.uniform(0.1, 0.2) * far, rng.uniform(0.2, 0.5)

    def of(labels: Labels) -> Force:
        turns, warm = labels.second, labels.warm(500.0)
        z = 0.0

        def force(x: float, v: float, _u: float, dt: float) -> float:
            nonlocal z
            z += (v - (0.5 * abs(v) * abs(z) ** 0.5 * z + 0.5 * v * abs(z) ** 1.5)) / way * dt
            z = max(-1.2, min(1.2, z))
            e = x / far
            spring = 0.3 * e * (1.0 - skew * tanh(2.0 * e)) + hard * e**3
            return turns * spring + warm * 0.5 * z * exp(0.5 * grows * e)

        return force

    return of


def air_spring(rng: Rng, far: float, fast: float) -> Callable[[Labels], Force]:
    """Two chambers behind an orifice, with the rub of the bellows."""
    length, other = rng.uniform(2.5, 5.0) * far, rng.uniform(0.4, 1.2)
    orifice, rub = rng.uniform(3.0, 12.0), rng.uniform(0.06, 0.15)

    def of(labels: Labels) -> Force:
        charge, warm = labels.second, labels.warm(1000.0)
        p = [1.0, 1.0]
        at = [0.0]

        def force(x: float, v: float, _u: float, dt: float) -> float:
            room = 1.0 - x / length
            flow = orifice * copysign(abs(p[0] - p[1]) ** 0.6, p[0] - p[1])
            p[0] += (1.3 * p[0] * v / length - flow) / room * dt
            p[1] += flow / other * dt
            return 1.5 * charge * (p[0] - 1.0) + _mr_fluid(rub * warm, v, at, dt, 0.1 * far)

        return force

    return of


COMMANDED = ("eddy_mr", "two_stage_mr", "dead_time_mr")

MAKERS: dict[str, tuple[Make, str, set[str]]] = {
    "valve_stack": (valve_stack, "gas@bar", {"mount_compliance", "asymmetry", "gas_spring"}),
    "cavitating": (cavitating, "pressure@bar", {"quadratic_damping", "asymmetry", "backlash"}),
    "ageing_friction": (ageing_friction, "load@kN", {"stribeck", "presliding"}),
    "jenkins_elements": (jenkins_elements, "torque@Nm", {"presliding"}),
    "pinched": (pinched, "torque@Nm", {"asymmetry", "duffing", "gas_spring"}),
    "mullins_rubber": (mullins_rubber, "load@kN", {"duffing", "mount_compliance", "gas_spring"}),
    "eddy_mr": (eddy_mr, "gas@bar", {"coil_lag", "saturation", "gas_spring"}),
    "two_stage_mr": (two_stage_mr, "pressure@bar", {"coil_lag", "mount_compliance", "delay"}),
    "dead_time_mr": (
        dead_time_mr, "gas@bar", {"delay", "coil_lag", "remanence", "flattening", "gas_spring"}
    ),
    "flag_shaped": (flag_shaped, "torque@Nm", {"duffing", "end_stop", "gas_spring"}),
    "wire_rope": (wire_rope, "torque@Nm", {"duffing", "asymmetry", "gas_spring", "presliding"}),
    "air_spring": (
        air_spring, "pressure@bar", {"gas_spring", "duffing", "mount_compliance", "presliding"}
    ),
}  # fmt: skip
"""Each device, the label that matters beside the temperature, and effects that are in it."""

RATES = (200.0, 500.0, 1000.0, 2000.0, 5000.0)
FINE = 1e-4
"""Longest step of a device [s]."""


@dataclass(frozen=True)
class Rig:
    """A rig that was written: the device's name, labels that matter, one that does not, its rate.

    `near`: effects of the library that this device has as well.
    """

    device: str
    matter: set[str]
    idle: str
    near: set[str]
    rate: float
    noise: float


def write(case: int, folder: Path, runs: int = 10) -> Rig:
    """Write the runs of a case as files of a folder; return what is in them."""
    rng = np.random.default_rng(90_000 + case)
    names = [*MAKERS]
    device = names[case % len(names)]
    make, second, near = MAKERS[device]
    rate = RATES[(case // len(names) + case) % len(RATES)]
    noise = float(rng.uniform(0.005, 0.02))
    far = float(rng.choice([0.008, 0.015, 0.03]))
    fast = far * 2.0 * np.pi * rng.uniform(1.0, 2.5)
    size = float(10.0 ** rng.uniform(1.7, 4.0))
    of = make(rng, far, fast)
    cold, load, idle = _levels(rng, runs)
    temperatures, seconds, sizes = (10.0, 25.0, 40.0), (0.7, 1.0, 1.3), (60, 100, 140)
    in_names = bool(rng.integers(2))
    kind, unit = second.split("@")
    for k in range(runs):
        labels = Labels(temperatures[cold[k]], seconds[load[k]])
        told = {
            "temperature": (f"{labels.temperature:g}", "degC"),
            kind: (f"{sizes[load[k]] * (0.1 if unit == 'kN' else 1.0):g}", unit),
            "batch": (("batch" if in_names else "") + "ABC"[idle[k]], ""),
        }
        file = folder / f"run{k + 1:02d}.csv"
        if in_names:
            tail = "_".join(value + unit for value, unit in told.values())
            file = folder / f"run{k + 1:02d}_{tail}.csv"
        columns = _run(rng, of(labels), device in COMMANDED, far, fast, rate, noise, k)
        columns[f"Force [{'kN' if size > 1e3 else 'N'}]"] = (
            columns.pop("F") * size / (1e3 if size > 1e3 else 1.0)
        )
        title, rows = [*columns], np.column_stack([*columns.values()])
        extra = "" if in_names else "".join(f",{value}" for value, _ in told.values())
        heads = [f"{name} [{unit}]" if unit else name for name, (_, unit) in told.items()]
        with file.open("w", encoding="utf-8") as out:
            out.write(",".join([*title, *([] if in_names else heads)]) + "\n")
            for row in rows:
                out.write(",".join(f"{one:.6g}" for one in row) + extra + "\n")
    return Rig(device, {"temperature", kind}, "batch", near, rate, noise)


def _levels(rng: Rng, runs: int) -> tuple[Sequence[int], Sequence[int], Sequence[int]]:
    """Return levels of three labels for each run, that go with each other and the order little."""
    while True:
        three = [rng.permutation(np.arange(runs) % 3) for _ in range(3)]
        related = np.corrcoef([*three, np.arange(runs) % 5, np.arange(runs)])
        if np.max(np.abs(related - np.eye(5))[:3]) < 0.35:
            return tuple([int(one) for one in levels] for levels in three)  # type: ignore[return-value]


def _run(
    rng: Rng, force: Force, commanded: bool, far: float, fast: float, rate: float, noise: float,
    number: int,
) -> dict[str, Array]:  # fmt: skip
    """Return the columns of a run as a logger has them, the force in units of the device."""
    times = max(1, round(1.0 / (FINE * rate)))
    count = round(max(4.0, 800.0 / rate) * rate)
    dt = 1.0 / (rate * times)
    t = dt * np.arange(count * times)
    share, w = rng.uniform(0.4, 1.0), fast / far
    if number % 5 == 0:
        phase = w * rng.uniform(0.6, 1.0) * t
        x, v = np.sin(phase), np.cos(phase) * np.gradient(phase, dt)
    elif number % 5 == 1:
        phase = w * (0.3 * t + 0.5 * t**2 / t[-1])
        x, v = np.sin(phase), np.cos(phase) * np.gradient(phase, dt)
    else:
        lines = w * rng.uniform(0.15, 1.8, 12)
        sizes = rng.uniform(0.3, 1.0, 12) / (1.0 + (lines / w) ** 2)
        angles = lines[:, None] * t + rng.uniform(0.0, 2.0 * np.pi, (12, 1))
        top = 1.4 * float(np.sqrt(np.sum(sizes**2)))
        x, v = sizes @ np.sin(angles) / top, (sizes * lines) @ np.cos(angles) / top
    ramp = np.minimum(1.0, t / 0.3)
    x, v = far * share * x * ramp, far * share * (v * ramp + x * (t < 0.3) / 0.3)
    u = np.zeros(len(t))
    if commanded:
        holds = rng.uniform(0.2, 0.5)
        steps = rng.choice([0.0, 0.5, 1.0, 1.5, 2.0], round(t[-1] / holds) + 1)
        u = steps[(t / holds).astype(int)] if number % 2 else np.full(len(t), float(steps[0]))
    felt = [force(*one, dt) for one in zip(x.tolist(), v.tolist(), u.tolist(), strict=True)]
    cut = 0.4 if times == 1 else 0.4 / times
    sos = butter(int(rng.choice([2, 4])), 2.0 * cut, output="sos")
    seen = {
        "Time [s]": t, "Stroke [mm]": 1e3 * x, **({"Current [A]": u} if commanded else {}),
        "F": np.array(felt),
    }  # fmt: skip
    out = {"Time [s]": t[::times]}
    for name, values in seen.items():
        if name != "Time [s]":
            logged = sosfilt(sos, values)[::times]
            part = 0.002 if name.startswith(("Stroke", "Current")) else noise
            scale = 2.0 if name.startswith("Current") else float(np.std(logged))
            out[name] = logged + part * scale * rng.standard_normal(len(logged))
    return out
