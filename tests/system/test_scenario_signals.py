"""Test signals in a scenario: what a check says of their parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.physics.signals import KINDS, PARAMETERS, TAKEN
from bristle.system.scenario import check_scenario

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


CHIRP = 'kind = "chirp", amplitude = 0.005, frequency = 1.0, frequency_end = 3.0'


def test_a_rod_that_jumps_where_a_chirp_ends_is_told(tmp_path: Path) -> None:
    (text,) = warnings(tmp_path, f"{CHIRP}, duration = 0.6")
    assert text == (
        "rod: the displacement jumps by -0.00476 m with velocity 0 where the chirp ends, at "
        "t = 0.6 s; duration = 0.5 ends it at its offset."
    )
    assert warnings(tmp_path, f"{CHIRP}, duration = 0.5") == []
    assert warnings(tmp_path, f"{CHIRP}, duration = 2.1") == []  # behind the end of the run


def test_the_duration_that_is_proposed_is_right(tmp_path: Path) -> None:
    for phase in (0.3, -2.0, 7.0):
        keys = f"{CHIRP}, duration = 0.1, phase = {phase}"
        (text,) = warnings(tmp_path, keys)
        better = text.partition("duration = ")[2].split()[0]
        assert float(better) > 0.0
        assert warnings(tmp_path, keys.replace("0.1", better)) == []


def test_a_rod_that_jumps_where_a_sine_begins_is_told(tmp_path: Path) -> None:
    sine = 'kind = "sine", amplitude = 0.004, start = 0.5'
    assert warnings(tmp_path, f"{sine}, phase = 1.5707963267948966") == [
        "rod: the displacement jumps by 0.004 m with velocity 0 where the sine begins, at "
        "t = 0.5 s; phase = 0 or start = 0 is right."
    ]
    assert warnings(tmp_path, sine) == []
    assert warnings(tmp_path, f"{sine}, phase = 1.5".replace("0.5", "0.0")) == []


def test_a_rod_stands_where_its_samples_end_and_a_signal_may_jump(tmp_path: Path) -> None:
    assert warnings(tmp_path, 'kind = "csv", file = "motion.csv"') == []
    file = tmp_path / "my.toml"
    text = SCENARIO.format(keys=f"{CHIRP}, duration = 0.6")
    file.write_text(text.replace("PrescribedMotion", "SignalSource"))
    assert [one for one in check_scenario(file) if one.level == "warning"] == []
