"""Components as pure functions: they keep what they are given, and the rules are written once."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from bristle.component import damper
from bristle.fmu import catalogue

STEP = 0.0005
SETTINGS: dict[str, dict[str, Any]] = {
    "LuGreDamper": {"gas_spring.on": True, "moving_mass": 2.0},
    "Structure": {"storey_softening.on": True, "base_friction.on": True},
}


def set_up(name: str, given: dict[str, Any]) -> Any:
    """Return a component whose constants, state and room to work are ready."""
    slave = catalogue.instantiate(name)
    for key, value in given.items():
        slave._set_any([slave._index[key]], [value], type(slave[key]))
    slave.configure()
    if name == "Structure":
        slave.constants = slave.constants_of(STEP)
    return slave


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


def test_the_energy_of_a_step_ends_at_the_motion_shown_and_at_the_voltage_of_the_step() -> None:
    """Motion and voltage of the middle were given for the step, those of its end are given now."""
    c, state, shown, work = bingham()
    dt = 0.01

    def force(v: float, V: float) -> float:
        return 1.3 + 0.83 * V + (100.0 + 20.0 * V) * v

    begin, middle, end = ([0.0, v, V, 0.0, 0.0] for v, V in ((0.1, 2.0), (0.15, 3.0), (0.2, 4.0)))
    damper.start(0.0, begin, c, state, shown, work)
    new = list(state)
    damper.step((0.0, dt, 0), begin, middle, c, state, new, shown, work)
    damper.output(dt, end, c, new, shown, work)
    assert shown[damper.FORCE] == pytest.approx(force(0.2, 4.0))
    work_done = 0.5 * dt * (0.1 * force(0.1, 3.0) + 0.2 * force(0.2, 3.0))
    assert shown[damper.DISSIPATED_ENERGY] == pytest.approx(work_done, rel=1e-12)
    later = list(new)  # the next step begins where this one ended, not at its middle
    damper.step((dt, dt, 0), middle, end, c, new, later, shown, work)
    work_done += dt * 0.2 * force(0.2, 4.0)
    assert shown[damper.DISSIPATED_ENERGY] == pytest.approx(work_done, rel=1e-12)


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
