"""Runs of a building with a damper and hidden forces, simulated exactly, with noise on top."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.signal import butter, lfilter

from bristle.data.channels import ChannelSpec, channel_unit
from bristle.data.measurement import measurements_of_frame
from bristle.physics.building import from_data
from bristle.physics.structure import matrices, step_matrices

DT = 0.002


def building(floors, isolated=True, seed=0, stiffness=1400.0):
    """Return a chain of masses of about 1.5 kg, 2 % damping in every mode."""
    random = np.random.default_rng(seed)
    n = floors + isolated
    return from_data(
        {
            "schema": 1,
            "name": f"{floors} floors",
            "masses": list(1.5 * (1.0 + 0.2 * random.uniform(-1, 1, n))),
            "stiffnesses": list(stiffness * (1.0 + 0.2 * random.uniform(-1, 1, n))),
            "base": "isolated" if isolated else "fixed",
            "damping_ratio": 0.02,
        }
    )


def shake(b, seed, damper=None, hidden=None, samples=5000, peak=2.0):
    """Return the clean channels of one run.

    damper(x, v) is the force on the first level that a load cell shows; hidden(x, v), of all
    levels' motion, gives forces (n,) that no channel shows.
    """
    random = np.random.default_rng(seed)
    ground = lfilter(*butter(2, [0.5 * 2 * DT, 12.0 * 2 * DT], "band"), random.normal(size=samples))
    ground *= np.minimum(1.0, np.arange(samples) * DT)
    ground *= peak / np.abs(ground).max()
    m = matrices(b)
    s, n = step_matrices(m, DT), m.n
    phi = np.array(s.phi).reshape(2 * n, 2 * n)
    held, ramp = (np.array(part).reshape(2 * n, n + 1) for part in (s.held, s.ramp))
    inverse, C, K = np.linalg.inv(np.array(b.M)), np.array(b.C), np.array(b.K)
    x, motion, a = np.zeros(2 * n), np.zeros((samples, 2 * n)), np.zeros((samples, n))
    force, load = np.zeros(samples), np.zeros(n + 1)
    for k in range(samples):
        force[k] = damper(x[0], x[n]) if damper else 0.0
        load[:n] = hidden(x[:n], x[n:]) if hidden else 0.0
        load[0] += force[k]
        motion[k], a[k] = x, -inverse @ (K @ x[:n] + C @ x[n:] + load[:n])
        load[n] = ground[k]
        rise = ground[min(k + 1, samples - 1)] - ground[k]
        x = phi @ x + held @ load + ramp[:, n] * rise
    out = {"time": np.arange(samples) * DT, "ground_acceleration": ground}
    for i, level in enumerate(b.levels()):
        out[f"{level}_displacement"], out[f"{level}_velocity"] = motion[:, i], motion[:, n + i]
        out[f"{level}_acceleration_absolute"] = a[:, i]
    return out | ({"force": force} if damper else {})


def measured(clean, seed, noise=0.01, without=(), name="run"):
    """Return clean channels as a measurement, with white noise as a share of each one's RMS."""
    random = np.random.default_rng(seed + 10_000)
    shown, specs = {}, {}
    for channel, values in clean.items():
        if channel in without:
            continue
        spread = 0.0 if channel == "time" else noise * float(np.std(values))
        shown[channel] = values + spread * random.normal(size=len(values))
        unit = "s" if channel == "time" else channel_unit(channel)
        specs[channel] = ChannelSpec(column=channel, unit=unit)
    return measurements_of_frame(pd.DataFrame(shown), name, specs)[0]


def friction(x, v):
    """A damper's force [N]: smooth enough for the step, strong enough to be seen."""
    return 1.5 * np.tanh(v / 0.005) + 8.0 * v
