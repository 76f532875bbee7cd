"""Runs of a building with devices at its levels, integrated here and not by bristle.

Equations of motion in state-space form, exact between samples (matrix exponential) for forces held
over a step and a ground motion that is linear between samples; so equilibrium holds at each sample
with the force of that sample.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, lfilter

from bristle.physics.building import from_data

DT = 0.002


def tower(devices, floors=3, isolated=False, **other):
    """Return a building of floors of 1.5 kg on springs of about 1400 N/m with devices."""
    n = floors + isolated
    return from_data(data(devices, n, isolated) | other)


def data(devices, n=3, isolated=False):
    """Return the content of a building file of n masses."""
    return {
        "schema": 1,
        "name": "tower",
        "masses": [1.5 + 0.1 * i for i in range(n)],
        "stiffnesses": [1400.0 - 90.0 * i for i in range(n)],
        "base": "isolated" if isolated else "fixed",
        "damping_ratio": 0.02,
        "devices": devices,
    }


def brace(x, v, V):
    """Return the force [N] of a damper by the hyperbolic tangent law with `BRACE`."""
    p = BRACE
    hysteresis = np.tanh(v / p["v_s"] + p["delta"] * np.tanh(x / 2e-4))
    return (p["f_c"] + p["f_v"] * V) * hysteresis + (p["c_0"] + p["c_v"] * V) * v + p["k"] * x


BRACE = {"f_c": 0.8, "f_v": 0.4, "c_0": 9.0, "c_v": 3.0, "k": 80.0, "v_s": 0.012, "delta": 0.6}


def tie(x, v, V):
    """Return the force [N] of another damper, which no law here has."""
    return 6.0 * v + 0.5 * np.arctan(v / 0.01) + 20.0 * x


def shake(building, seed, laws, samples=6000, peak=4.0, step=DT):
    """Return the clean channels of a run, with forces and voltages of devices by name.

    laws: device to (force of x, v, V; whether it is commanded).
    """
    random = np.random.default_rng(seed)
    ground = lfilter(
        *butter(2, [0.5 * 2 * step, 12.0 * 2 * step], "band"), random.normal(size=samples)
    )
    ground *= np.minimum(1.0, np.arange(samples) * step)
    ground *= peak / np.abs(ground).max()
    M, C, K = (np.array(part) for part in (building.M, building.C, building.K))
    n = building.size
    ends = {d.name: np.array(d.incidence(n)) for d in building.devices} or {"": np.eye(n)[0]}
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
    B = np.zeros((2 * n, len(laws) + 1))
    B[n:, -1] = -1.0
    for j, name in enumerate(laws):
        B[n:, j] = -inverse @ ends[name]
    # States with inputs and their slopes: the exponential of one matrix has all three parts.
    m = B.shape[1]
    whole = np.zeros((2 * n + 2 * m, 2 * n + 2 * m))
    whole[: 2 * n, : 2 * n], whole[: 2 * n, 2 * n : 2 * n + m] = A, B
    whole[2 * n : 2 * n + m, 2 * n + m :] = np.eye(m)
    advance = expm(whole * step)[: 2 * n]
    held = round(1.0 / step)
    switched = np.repeat(random.choice([0.0, 1.5, 3.0], samples // held + 1), held)[:samples]
    volts = {name: switched * commanded for name, (_, commanded) in laws.items()}
    state, rows = np.zeros(2 * n), np.zeros((samples, 2 * n))
    forces, a = np.zeros((samples, len(laws))), np.zeros((samples, n))
    for k in range(samples):
        x, v = state[:n], state[n:]
        for j, (name, (law, _)) in enumerate(laws.items()):
            forces[k, j] = law(ends[name] @ x, ends[name] @ v, volts[name][k])
        u = np.append(forces[k], ground[k])
        rise = np.append(np.zeros(len(laws)), ground[min(k + 1, samples - 1)] - ground[k]) / step
        rows[k], a[k] = state, (A @ state + B @ u)[n:] + ground[k]
        state = advance @ np.concatenate([state, u, rise])
    out = {"time": np.arange(samples) * step, "ground_acceleration": ground}
    for i, level in enumerate(building.levels()):
        out[f"{level}_displacement"], out[f"{level}_velocity"] = rows[:, i], rows[:, n + i]
        out[f"{level}_acceleration_absolute"] = a[:, i]
    for j, (name, (_, commanded)) in enumerate(laws.items()):
        before = f"{name}_" if name else ""
        out[f"{before}force"] = forces[:, j]
        if commanded:
            out[f"{before}voltage"] = volts[name]
    return out


def noisy(clean, seed, noise=0.005, without=()):
    """Return clean channels with white noise, a share of each one's RMS; voltages are exact."""
    random = np.random.default_rng(seed + 10_000)
    return {
        channel: values
        if channel == "time" or channel.endswith("voltage")
        else values + noise * float(np.std(values)) * random.normal(size=len(values))
        for channel, values in clean.items()
        if channel not in without
    }
