"""The half-sine pulse solved tightly: structure and modified LuGre damper written out once more."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from bristle.physics.building import paper_building
from bristle.physics.laws import LAWS

from ._published import MODEL

TOLERANCE = 1e-10


def half_sine_exact(voltage: float, times: Any) -> dict[str, Any]:
    """Return columns as a run has them, solved to 1e-10 and started anew where the pulse ends.

    Parameters
    ----------
    voltage : of the coil [V]
    times : (rows,) ascending from 0 [s]
    """
    pulse = MODEL["half_sine"]
    end, size = pulse["duration"], pulse["amplitude"]
    building = paper_building()
    M, C, K = (np.array(getattr(building, name)) for name in "MCK")
    inverse, n = np.linalg.inv(M), len(M)
    p = {name: parameter.value for name, parameter in LAWS["lugre"].parameters.items()}
    stiffness = p["sigma_a"] + p["sigma_0"] * voltage
    viscosity = p["sigma_2"] + p["sigma_b"] * voltage

    def ground(t: Any) -> Any:
        return np.where(np.asarray(t) < end, size * np.sin(np.pi * np.asarray(t) / end), 0.0)

    def damper(v: Any, z: Any) -> tuple[Any, Any]:
        rate = v - p["a_0"] * np.abs(v) * z
        falling = np.exp(-((np.abs(v) / p["v_n"]) ** p["exponent"]))
        return stiffness * z + p["sigma_1"] * rate + viscosity * v * falling, rate

    def motion(t: float, y: Any, within: float) -> Any:
        x, v, z = y[:n], y[n : 2 * n], y[2 * n]
        force, rate = damper(v[0], z)
        load = -C @ v - K @ x
        load[0] -= force
        return np.concatenate([v, inverse @ load - within * ground(t), [rate]])

    parts, y = [], np.zeros(2 * n + 1)
    for first, last, within in ((0.0, end, 1.0), (end, times[-1] + 1e-9, 0.0)):
        inside = (times >= first) & (times < last)
        found = solve_ivp(
            motion, (first, last), y, "DOP853", [*times[inside], last], args=(within,),
            rtol=TOLERANCE, atol=1e-14,
        )  # fmt: skip
        parts.append(found.y[:, :-1])
        y = found.y[:, -1]
    state = np.concatenate(parts, axis=1)
    x, v = state[:n], state[n : 2 * n]
    force, _ = damper(v[0], state[2 * n])
    load = -C @ v - K @ x
    load[0] -= force
    absolute = inverse @ load
    return {
        "structure.base_displacement": x[0],
        "structure.drift2": x[2] - x[1],
        "structure.base_acceleration_absolute": absolute[0],
        "structure.floor2_acceleration_absolute": absolute[2],
        "structure.base_velocity": v[0],
        "damper.force": force,
    }
