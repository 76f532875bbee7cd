"""Components as pure functions: compiled as in plain Python, pure, and the rules written once."""

from __future__ import annotations

from math import inf, sin
from typing import Any

import numpy as np
import pytest

from bristle.component import damper
from bristle.fmu import catalogue
from bristle.jit import compiled

STEP = 0.0005
SETTINGS: dict[str, dict[str, Any]] = {
    "LuGreDamper": {"gas_spring.on": True, "moving_mass": 2.0},
    "BinghamDamper": {"coil_lag.on": True, "moving_mass": 2.0},
    "Structure": {"storey_softening.on": True, "base_friction.on": True},
    "SignalSource": {"kind": "chirp"},
    "PrescribedMotion": {"kind": "sine"},
    "Skyhook": {"kind": "inverse", "velocity": "filtered"},
    "HinfInverse": {"anti_windup": 50.0, "inverse": "bingham"},
    "Sensors": {
        "floor_acceleration.noise_density": 0.01, "base_velocity.delay": 0.0051,
        "base_displacement.cut_off": 20.0, "damper_force.quantisation": 0.01,
    },
}  # fmt: skip
CASES = [(name, {}) for name in catalogue.component_names()] + list(SETTINGS.items())


def set_up(name: str, given: dict[str, Any]) -> Any:
    """Return a component whose constants, state and room to work are ready."""
    slave = catalogue.instantiate(name)
    for key, value in given.items():
        slave._set_any([slave._index[key]], [value], type(slave[key]))
    slave.configure()
    if name == "Structure":
        slave.constants = slave.constants_of(STEP)
    return slave


def all_to(value: Any, to: Any) -> Any:
    """Return constants with every sequence in them made by `to`; a record stays one."""
    if hasattr(value, "_fields"):
        return type(value)(*(all_to(inner, to) for inner in value))
    return to(value) if isinstance(value, (list, tuple)) else value


def driven(slave: Any, start: Any, step: Any, output: Any, to: Any) -> np.ndarray:
    """Return the outputs of a run of 200 steps, each stepped and then shown again."""
    c = all_to(slave.constants, to)
    state, new, work = to(slave.state), to(slave.state), to([0.0, *slave._work])
    shown = to(slave._given)
    sampled = slave._new_state is slave.state

    def inputs(k: int) -> Any:
        return to([0.1 * (j + 1) * sin(0.03 * (j + 1) * k + j) for j in range(len(slave._inputs))])

    rows, before = [], inputs(0)
    start(0.0, before, c, state, shown, work)
    for k in range(200):
        now = inputs(k + 1)
        assert (
            step((k * STEP, STEP, 0), before, now, c, state, state if sampled else new, shown, work)
            >= 0
        )
        if not sampled:
            state, new = new, state
        rows.append(list(shown))
        before = inputs(k + 2)
        output((k + 1) * STEP, before, c, state, shown, work)
        rows.append(list(shown))
        before = now
    return np.array(rows)


def array(values: Any) -> np.ndarray:
    """Return an array, never an empty one; flags and whole numbers stay such.

    What is empty counts as numbers, as it is where it is filled: one compilation serves both.
    """
    return np.array(values) if len(values) else np.zeros(1)


@pytest.mark.parametrize(("name", "given"), CASES, ids=[f"{n}-{len(g)}" for n, g in CASES])
def test_compiled_functions_compute_what_plain_python_does(
    name: str, given: dict[str, Any]
) -> None:
    functions = catalogue.instantiate(name).functions
    hooks = functions.start, functions.step, functions.output
    plain = driven(set_up(name, given), *hooks, to=list)
    fast = driven(set_up(name, given), *(compiled(hook) for hook in hooks), to=array)
    scale = np.abs(plain).max(axis=0)
    assert np.isfinite(plain).all()
    assert (np.abs(fast - plain).max(axis=0) <= 1e-12 * scale).all()


def test_a_step_may_be_made_again_from_the_same_state() -> None:
    for name in ("LuGreDamper", "Structure"):
        slave = set_up(name, SETTINGS[name])
        f, c, state = slave.functions, slave.constants, slave.state
        before, now = [0.0] * len(slave._inputs), [0.01] * len(slave._inputs)
        f.start(0.0, before, c, state, slave._given, slave._work)
        kept, shown = list(state), []
        for sweep in range(2):
            f.step(
                (0.0, STEP, sweep),
                before,
                now,
                c,
                state,
                slave._new_state,
                slave._given,
                slave._work,
            )
            shown.append([*slave._given, *slave._new_state])
        assert state == kept
        assert shown[0] == shown[1]


# -- the damper's rules


def bingham(**given: float) -> tuple[damper.Constants, list[float], list[float], list[float]]:
    slave = set_up("BinghamDamper", {"exponent": 0.0, **given})
    return slave.constants, slave.state, slave._given, slave._work


def test_energy_after_a_jump_of_the_voltage_begins_at_the_new_force() -> None:
    """Motion held: work is power times time at the new voltage, with nothing of the old one."""
    c, state, shown, work = bingham()
    v, dt = 0.1, 0.01
    calm, full = [0.0, v, 0.0, 0.0, 0.0], [0.0, v, 4.0, 0.0, 0.0]
    damper.start(0.0, calm, c, state, shown, work)
    new = list(state)
    damper.step((0.0, dt, 0), calm, full, c, state, new, shown, work)
    force = 1.3 + 0.83 * 4.0 + (100.0 + 20.0 * 4.0) * v
    assert shown[damper.FORCE] == pytest.approx(force)
    assert shown[damper.DISSIPATED_ENERGY] == pytest.approx(force * v * dt, rel=1e-12)


def test_the_voltage_saturates_and_says_so() -> None:
    c, state, shown, work = bingham(v_max=5.0)
    assert damper.start(0.0, [0.0, 0.1, 5.0, 0.0, 0.0], c, state, shown, work) == 0
    force = shown[damper.FORCE]
    code = damper.output(0.0, [0.0, 0.1, 50.0, 0.0, 0.0], c, state, shown, work)
    assert (code, shown[damper.FORCE]) == (damper.SATURATED, force)
    code = damper.output(0.0, [0.0, 0.1, -1.0, 0.0, 0.0], c, state, shown, work)
    assert code == damper.SATURATED
    assert shown[damper.FORCE] == pytest.approx(1.3 + 100.0 * 0.1)


def test_the_stick_force_brings_a_mass_to_rest_within_a_step() -> None:
    holding, v, mass, dt = -2.0, 0.03, 5.0, 0.002
    stick = damper.stick_force(holding, v, mass, dt)
    assert v - dt * (stick - holding) / mass == pytest.approx(0.0, abs=1e-15)
    assert damper.stick_force(holding, 0.0, mass, inf) == holding
