"""Springs before and behind a dashpot are told apart.

A search does not end where one that came out as nothing at its start stays nothing, nor where the
other one's force is taken for what the first held before a run.
"""

import numpy as np
import pandas as pd
import pytest

from bristle.data.measurement import measurements_of_frame
from bristle.identification.fit import fit_from_starts
from bristle.identification.histories import DamperForces
from bristle.identification.prepare import prepare
from bristle.identification.problem import Problem, robust_z
from bristle.model.model import Model

LAW, DT = "modified_bouc_wen", 0.002
VALUES = {
    "f_c": 1.58, "f_v": 0.60, "c_0": 25.7, "c_v": 1.72, "c_1": 1926.0, "c_1v": 24.0, "k_0": 35.5,
    "k_1": 52.7, "f_0": 0.42, "rho": 372.0, "sigma": 0.79, "eta": 69.0,
}  # fmt: skip

STIFF_BEHIND = {"k_0": 131.0, "k_1": 33.0, "c_1": 628.0, "c_1v": 51.0, "rho": 350.0, "f_0": 0.0}


def recorded(seed, values):
    """Return a run at six levels of the command, with noise."""
    random = np.random.default_rng(seed)
    t, f = np.arange(3000) * DT, np.exp(random.uniform(np.log(0.3), np.log(6.0), 4))
    w, size = 2.0 * np.pi * f, random.uniform(0.3, 1.0, 4) / f
    size *= 0.12 / np.sqrt(np.sum((size * w) ** 2) / 2.0)
    angle = w[:, None] * t + random.uniform(0.0, 6.28, 4)[:, None]
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w * w) @ np.sin(angle)
    V = np.repeat(random.choice([0.0, 1.0, 2.0, 3.0, 4.0], 6), 500)
    force = DamperForces(LAW, []).force(x, v, a, V, DT, values)
    channels = {
        "displacement [m]": (x, 0.001),
        "velocity [m/s]": (v, 0.005),
        "force [N]": (force, 0.005),
    }
    run = {"time [s]": t, "voltage [V]": V}
    for name, (y, share) in channels.items():
        run[name] = y + share * np.std(y) * random.standard_normal(len(t))
    return prepare(measurements_of_frame(pd.DataFrame(run), f"run {seed}")[0])


@pytest.mark.parametrize("values", [VALUES, VALUES | STIFF_BEHIND], ids=["weak", "stiff"])
def test_a_spring_behind_a_dashpot_is_found_beside_another(values):
    first, second, held_out = (recorded(seed, values) for seed in (13, 14, 15))
    found = fit_from_starts(Problem([first, second]), Model(LAW)).model
    assert robust_z(Problem([held_out]), found) < 1.1
    assert found.value("k_0") == pytest.approx(values["k_0"], abs=6.0)
