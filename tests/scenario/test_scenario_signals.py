"""Test signals in a scenario: what a check says of their parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.physics.signals import KINDS, PARAMETERS, TAKEN
from bristle.scenario.scenario import check_scenario

SCENARIO = """
schema = 1
[run]
stop = 2.0
step = 0.001
[components.rod]
fmu = "PrescribedMotion"
parameters = {{ {keys} }}
"""


def warnings(folder: Path, keys: str) -> list[str]:
    """Return the warnings on a rod with these parameters, each told at their line."""
    (folder / "motion.csv").write_text("time [s],displacement [m]\n0,0\n1,0.008\n")
    file = folder / "my.toml"
    file.write_text(SCENARIO.format(keys=keys))
    found = [one for one in check_scenario(file) if one.level != "note"]
    assert {one.level for one in found} <= {"warning"}
    assert {one.line for one in found} <= {8}
    return [one.text for one in found]


@pytest.mark.parametrize(
    ("keys", "name", "kind", "taken"),
    [
        ('kind = "csv", file = "motion.csv", start = 0.3', "start", "csv", "file"),
        ('kind = "csv", file = "motion.csv", amplitude = 2.0', "amplitude", "csv", "file"),
        ("level = 0.01, offset = 0.002", "offset", "constant", "level"),
        (
            'kind = "sine", amplitude = 0.01, level = 0.01', "level", "sine",
            "amplitude, frequency, phase, offset, start",
        ),
        (
            'kind = "half_sine", frequency = 2.0', "frequency", "half_sine",
            "amplitude, offset, start, duration",
        ),
    ],
)  # fmt: skip
def test_a_parameter_that_its_kind_does_not_take_is_told(
    tmp_path: Path, keys: str, name: str, kind: str, taken: str
) -> None:
    text = f'rod.{name} does nothing while rod.kind is "{kind}", which takes {taken}.'
    assert warnings(tmp_path, keys) == [text]


def test_parameters_that_a_kind_takes_leave_no_word(tmp_path: Path) -> None:
    values = {name: f"{name} = {parameter.value}" for name, parameter in PARAMETERS.items()}
    values |= {"steps": 'steps = "0:0 1:2"', "file": 'file = "motion.csv"'}
    assert set(TAKEN) == set(KINDS)
    for kind, taken in TAKEN.items():
        keys = ", ".join([f'kind = "{kind}"', *(values[name] for name in taken)])
        assert warnings(tmp_path, keys) == []
