"""A component with a shorter step of its own: what its inputs are at each of its substeps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_master_schedule import LOOP, STRUCTURE
from test_midpoint import told
from toys import Maker

from bristle import run
from bristle.component import HELD, LINEAR, SAMPLED
from bristle.engine.schedule import ALONG, DoStep, Node, Write, make_schedule

SEQUENTIAL = ("gauss-seidel", "midpoint", "midpoint-iterated")
H, PARTS = 0.1, 4
T = np.arange(11) / 10
AHEAD = H * H * (PARTS + 1) / (2 * PARTS)
"""What the toy adds to h u_k in a step: it holds the ramp's value at the end of each substep."""

FREE = """
schema = 1
[run]
stop = 1.0
step = {step}
algorithm = "{algorithm}"
[components.ground]
fmu = "SignalSource"
parameters = {{ kind = "sine", amplitude = 2.0, frequency = 1.5 }}
[components.structure]
fmu = "Structure"
{own}
parameters = {{ damper_force = 0.0 }}
[connections]
"structure.ground_acceleration" = "ground.value"
"""
SENSORS = """
schema = 1
[run]
stop = 1.0
step = {step}
algorithm = "{algorithm}"
[components.source]
fmu = "SignalSource"
parameters = {{ kind = "sine", amplitude = 1.0, frequency = 2.0 }}
[components.sensors]
fmu = "Sensors"
{own}
parameters = {{ sample_period = 0.0025, base_displacement = 0.0, base_velocity = 0.0, damper_force = 0.0, "floor_acceleration.delay" = 0.005 }}
[connections]
"sensors.floor_acceleration" = "source.value"
"""  # noqa: E501 (one table of TOML)


def integrated(scenario_of: Maker, over_step: str, algorithm: str) -> np.ndarray:
    """Return the integral of a ramp by a toy with four substeps that takes it in this way."""
    file = scenario_of(
        {"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"},
        steps={"sum": H / PARTS}, algorithm=algorithm,
    )  # fmt: skip
    text, own = file.read_text(), f"step = {H / PARTS}\n"
    assert own in text
    file.write_text(text.replace(own, f'{own}over_step = {{ u = "{over_step}" }}\n'))
    values: np.ndarray = run(file)["sum.x"].to_numpy()
    return values


@pytest.mark.parametrize("over_step", [LINEAR, SAMPLED])
@pytest.mark.parametrize("algorithm", SEQUENTIAL)
def test_an_input_moves_on_substep_by_substep(
    scenario_of: Maker, over_step: str, algorithm: str
) -> None:
    each = H * T[:-1] + AHEAD
    assert np.diff(integrated(scenario_of, over_step, algorithm)) == pytest.approx(each)


def test_what_is_held_stays_and_so_does_what_has_no_newer_value(scenario_of: Maker) -> None:
    assert np.diff(integrated(scenario_of, HELD, "gauss-seidel")) == pytest.approx(H * T[1:])
    # Jacobi sets inputs when all have stepped: the end of the step is not known.
    assert np.diff(integrated(scenario_of, LINEAR, "jacobi")) == pytest.approx(H * T[:-1])


@pytest.mark.parametrize(
    # Runs at ever finer steps: sensors beside a building.
    "text",
    [FREE, pytest.param(SENSORS, marks=pytest.mark.slow)],
    ids=["structure", "sensors"],
)
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "midpoint"])
def test_substeps_of_our_components_are_as_good_as_one_step(
    text: str, algorithm: str, tmp_path: Path
) -> None:
    file = tmp_path / "scenario.toml"
    rows = []
    for own in ("", "step = 0.005"):
        file.write_text(text.format(step=0.02, algorithm=algorithm, own=own))
        rows.append(run(file).to_numpy())
    assert rows[1] == pytest.approx(rows[0], rel=1e-9, abs=1e-9 * np.abs(rows[0]).max())


def test_a_unit_that_is_converted_moves_on_as_well(scenario_of: Maker) -> None:
    file = scenario_of(
        {"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"}, steps={"sum": H / PARTS}
    )
    wire = '"sum.u" = { from = "ramp.value", factor = 2.0, offset = 1.0 }'
    own = f"step = {H / PARTS}\n"
    text = file.read_text().replace('"sum.u" = "ramp.value"', wire)
    file.write_text(text.replace(own, f'{own}over_step = {{ u = "linear" }}\n'))
    each = 2.0 * (H * T[:-1] + AHEAD) + H
    assert np.diff(run(file)["sum.x"].to_numpy()) == pytest.approx(each)


def test_only_inputs_of_components_with_substeps_are_set_inside_of_them() -> None:
    structure = told(STRUCTURE, a_g={"over_step": LINEAR}, force={"over_step": HELD})

    def inside(node: Node) -> list[tuple[Write, ...]]:
        schedule = make_schedule([LOOP[0], node, *LOOP[2:]], "gauss-seidel")
        return [o.along for o in schedule.operations if isinstance(o, DoStep) and o.along]

    assert inside(structure) == []
    wanted = Write(1, "Real", ("a_g",), (ALONG,))
    assert inside(replace(structure, substeps=5)) == [(wanted,)]
