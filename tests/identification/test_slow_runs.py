"""Runs that were sampled slowly: between two samples a law's states go on as in the damper."""

import numpy as np

import bristle
from bristle.model.model import Model

RATE, FINE = 200.0, 500  # Hz, and steps of the reference between two samples
VALUES = {"c": 8.0, "alpha": 0.5, "give": 1e-3}  # N, 1, m: a dashpot behind its spring


NOISE = {"displacement": 2e-5, "force": 0.003}  # of each standard deviation


def recorded(seed):
    """Return a run of a fluid viscous damper, integrated in small steps."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, 6.0, 1.0 / RATE / FINE)
    f, phase = np.array([1.1, 2.9, 4.7]), random.uniform(0.0, 6.3, 3)  # Hz
    w = 2.0 * np.pi * f[:, None]
    x = np.sum(0.1 / w * np.sin(w * t + phase[:, None]), axis=0)
    v = np.sum(0.1 * np.cos(w * t + phase[:, None]), axis=0)
    y, carried, dt = 0.0, np.empty(len(t)), t[1]
    power = 1.0 / VALUES["alpha"]
    for k, speed in enumerate(v.tolist()):
        carried[k] = y
        y += dt / VALUES["give"] * (speed - np.copysign(0.1 * abs(y) ** power, y))
    force = (VALUES["c"] * carried)[::FINE]
    run = {"time": t[::FINE], "displacement": x[::FINE], "force": force}
    for name, share in NOISE.items():
        run[name] = run[name] + share * np.std(run[name]) * random.standard_normal(len(force))
    return run


def test_a_true_model_errs_by_noise_alone():
    run = recorded(1)
    found = bristle.compare(run, Model("fluid_viscous", (), VALUES))
    assert found.total.rms < 1.1 * NOISE["force"] * np.std(run["force"])
