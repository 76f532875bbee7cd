"""What the exchange of values between FMUs costs: errors by algorithm and step, and time.

The pulse is held against a solution of its own (`_exact`), at the rows of the run: peaks, and the
worst error anywhere along the run. What a run states of its own error is held against the coupled
engine, on the stock scenarios.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

import bristle
from bristle.engine.cosimulation import Master, ignore
from bristle.errors import BuildError
from bristle.fmu.build import ensure
from bristle.native.build import ensure as ensure_native
from bristle.physics.building import paper_building
from bristle.physics.laws import LAWS
from bristle.system.scenario import load_scenario

from ._published import DRIFT, MODEL, Case, half_sine, peak_errors, symbol
from ._rows import Row, least_times
from .master import find_fmus

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


ALGORITHMS = ("jacobi", "gauss-seidel", "midpoint", "midpoint-iterated")
STEPS = (0.004, 0.002, 0.001, 0.0005)
ACCELERATION = "structure.base_acceleration_absolute"
ALONG = {("midpoint", 0.002): 0.005, ("midpoint", 0.0005): 0.0004}
"""Largest error along the run that is wanted, as a share of the peak, by algorithm and step [s]."""

GOALS = {
    ("gauss-seidel", 0.0005): 0.006,
    ("gauss-seidel", 0.002): 0.02,
    ("midpoint", 0.002): 0.0015,
    ("jacobi", 0.0005): None,
    ("jacobi", 0.002): None,
}
"""Largest error of a peak that is wanted, as a share, by algorithm and step [s]."""

VOLTAGES = (0.0, 4.0, 8.0)
SCENARIO = "half_sine_pulse"
STICKING = "bingham_half_sine_sticking"
STUCK = 8.0, 10.0
"""Between these times [s] the damper holds the base."""

SLICE, SLICES = 1000, 25
"""Steps of a slice, and slices of each algorithm: they take turns, the fastest counts."""


def run() -> list[Row]:
    """Return errors and costs by algorithm and step, and the velocity of a stuck base."""
    rows = [along(algorithm) for algorithm in ALGORITHMS]
    rows += [goal for wanted in ALONG for goal in along_goal(*wanted)]
    rows += [row for wanted in GOALS for row in pulse(*wanted)]
    return [*rows, stuck_base(), *costs()]


def along(algorithm: str) -> Row:
    """Return the worst error of the base acceleration along the pulse at 4 V, step by step."""
    errors = " / ".join(f"{100 * _error_along(algorithm, step):.3g}" for step in STEPS)
    steps = " / ".join(f"{1e3 * step:g}" for step in STEPS)
    what = "half-sine pulse, 4 V, worst error of the base acceleration along the run"
    return Row(f"{what}, {algorithm}, {steps} ms", f"{errors} %")


def along_goal(algorithm: str, step: float) -> Iterator[Row]:
    """Yield the same for one step that has a goal."""
    error, goal = _error_along(algorithm, step), ALONG[algorithm, step]
    name = f"half-sine pulse, 4 V, worst error along the run, {algorithm}, {1e3 * step:g} ms"
    yield Row(name, f"{error:.3%}", f"<= {goal:.2%}", error / goal)


def _error_along(algorithm: str, step: float) -> float:
    frame = bristle.run(SCENARIO, {"run.algorithm": algorithm, "run.step": step})
    exact = half_sine_exact(4.0, frame.index.to_numpy())[ACCELERATION]
    return float(np.abs(frame[ACCELERATION] - exact).max() / np.abs(exact).max())


def pulse(algorithm: str, step: float) -> Iterator[Row]:
    """Yield the largest error of all peaks; then what is reported beside it, case by case."""
    overrides = {"run.algorithm": algorithm, "run.step": step}
    before = time.perf_counter()
    frames = [
        (case, bristle.run(SCENARIO, {**overrides, **case.overrides})) for case in half_sine()
    ]
    seconds = time.perf_counter() - before
    errors = {
        (case.name, column): error
        for case, frame in frames
        for column, error in _peak_errors(algorithm, case, frame).items()
    }
    worst = max(errors, key=lambda key: errors[key])
    goal = GOALS[algorithm, step]
    what = f"half-sine pulse, FMUs, {algorithm}, {1e3 * step:g} ms"
    yield Row(
        f"{what}: {len(errors)} peaks",
        f"largest error {errors[worst]:.3%}: {symbol(worst[1])} at {worst[0]}",
        f"<= {goal:.2%}" if goal else "",
        errors[worst] / goal if goal else None,
        f"{len(frames)} runs of {len(frames[0][1]) - 1:,} steps took {seconds:.2f} s",
    )
    for case, frame in frames:
        yield Row(f"{what}, {case.name}", _reported(case, frame))


def _peak_errors(algorithm: str, case: Case, frame: pd.DataFrame) -> dict[str, float]:
    """Return the errors of peaks; midpoint's are smaller than the rows' own spacing tells.

    So for midpoint the peaks of the solution are taken at the same rows; without a damper nothing
    is exchanged both ways.
    """
    if algorithm != "midpoint":
        return peak_errors(case, frame)
    voltage = case.overrides.get("voltage.level")
    if voltage not in VOLTAGES:
        return {}
    exact = half_sine_exact(voltage, frame.index.to_numpy())
    return {
        name: abs(float(frame[name].abs().max() / np.abs(values).max()) - 1.0)
        for name, values in exact.items()
    }


def _reported(case: Case, frame: pd.DataFrame) -> str:
    """Return the error of each peak, how late the peaks are, and the displacement at the end."""
    each = ", ".join(f"{symbol(c)} {error:.3%}" for c, error in peak_errors(case, frame).items())
    late = ", ".join(
        f"{symbol(column)} {1e3 * (frame[column].abs().idxmax() - at):+.1f} ms"
        for column, at in case.times.items()
    )
    end = f"x_b(10 s) {1e3 * frame[DRIFT].iloc[-1]:.4g} mm, table {1e3 * case.end:.4g} mm"
    return f"peaks {each}; they come late by {late}; {end}"


def stuck_base() -> Row:
    """Return the RMS velocity of a base that a Bingham damper at 8 V holds."""
    frame = bristle.run(STICKING, {"voltage.level": 8.0, "run.step": 0.002})
    velocity = frame.loc[slice(*STUCK), "structure.base_velocity"]
    rms = 1e3 * float(np.sqrt(np.mean(velocity**2)))
    return Row(
        "RMS base velocity while stuck: Bingham, 8 V, half-sine, 8 to 10 s, 2 ms",
        f"{rms:.3g} mm/s",
        "<= 0.05 mm/s",
        rms / 0.05,
    )


def costs() -> Iterator[Row]:
    """Yield what a step costs with midpoint against Gauss-Seidel, the same scenario and step.

    Native FMUs take derivatives of their inputs, those in Python take none.
    """
    for name in ("el_centro_lugre_passive", SCENARIO):
        yield from _costs(name, "FMUs in Python", ensure)
        try:
            yield from _costs(name, "native FMUs", ensure_native)
        except BuildError as error:
            yield Row(f"time per step, {name}, native FMUs", f"not measured: {error}")


def _costs(name: str, form: str, build: Callable[..., Path]) -> Iterator[Row]:
    """Yield the same for one scenario and one form of its FMUs."""
    goals = {"midpoint": 1.1, "midpoint-iterated": None}
    with ExitStack() as stack:
        jobs = {
            algorithm: _started(stack, name, algorithm, build)
            for algorithm in ("gauss-seidel", *goals)
        }
        least = least_times(jobs, SLICE, SLICES)
    for algorithm, goal in goals.items():
        ratio = least[algorithm] / least["gauss-seidel"]
        each = f"{1e6 * least[algorithm] / SLICE:.1f}"
        yield Row(
            f"{algorithm} / gauss-seidel, time per step, {name}, {form}",
            f"{ratio:.3f} x: {each} us",
            f"<= {goal:g} x" if goal else "",
            ratio / goal if goal else None,
        )


def _started(
    stack: ExitStack, name: str, algorithm: str, build: Callable[..., Path]
) -> Callable[[int], None]:
    """Return what makes steps of a scenario in its master, which the stack closes."""
    step, steps = 0.0005, (SLICES + 1) * SLICE
    given = {"run.algorithm": algorithm, "run.step": step, "run.stop": step * steps}
    scenario = load_scenario(name, given)
    fmus = find_fmus(scenario, build)
    master = stack.enter_context(Master(scenario, *fmus, ignore))
    master.start()
    return master.advance
