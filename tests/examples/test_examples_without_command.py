"""Examples of devices that nothing commands: their equations, what they hide, their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.errors import StudyError
from bristle.examples import rigs
from bristle.examples.devices import DEVICES
from bristle.examples.hidden import HIDDEN, able
from bristle.examples.make import Choice, make_bench, make_building
from bristle.examples.rigs import Damper, in_library_names
from bristle.identification.histories import DamperForces
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from bristle.study.study import Study

STILL = rigs.Programme(lambda _t: 0.0)


def motion(law: str) -> rigs.Motion:
    scales = rigs.scales_of("bench", law)
    rng = np.random.default_rng(2)
    return rigs.bench_motion("multisine", 2.0, scales.stroke, scales.speed, rng)


@pytest.mark.parametrize("law", DEVICES)
def test_its_equations_are_those_of_the_law_of_its_name(law: str) -> None:
    moved = motion(law)
    run = rigs.perform(Damper(law, DEVICES[law]), moved, STILL, rigs.scales_of("bench", law))
    x, v, a = np.array([moved.at(t) for t in moved.time.tolist()]).T
    values = in_library_names(law, DEVICES[law])
    force = DamperForces(law, []).force(x, v, a, np.zeros(len(x)), 0.002, values)
    late = slice(250, None)
    error = np.sqrt(np.mean((force - run["force"])[late] ** 2))
    assert error < 0.004 * np.std(run["force"])
    assert set(values) <= set(LAWS[law].parameters)


@pytest.mark.parametrize("law", DEVICES)
def test_what_it_can_hide_changes_its_force_and_is_an_effect_that_joins(law: str) -> None:
    scales, moved = rigs.scales_of("bench", law), motion(law)
    bare = rigs.perform(Damper(law, DEVICES[law]), moved, STILL, scales)
    names = [*able("bench", law), *able("bench", law, outside=True)]
    assert able("bench", law)
    for name in names:
        secret = HIDDEN[name].draw(np.random.default_rng(3), scales)
        hidden = rigs.perform(Damper(law, DEVICES[law], secret), moved, STILL, scales)
        assert np.isfinite(hidden["force"]).all()
        assert rigs.share([hidden], [bare]) > (0.0 if name == "temperature" else 0.05), name
        assert HIDDEN[name].outside or EFFECTS[name].joins(LAWS[law])


@pytest.mark.slow  # an example is made with a law that nothing commands
def test_its_files_and_words_have_no_voltage(tmp_path: Path) -> None:
    folder = tmp_path / "rig"
    make_bench(folder, Choice(law="fluid_viscous", noise=0.01))
    assert Study(folder).drive == ""
    assert Study(folder).model().law == "fluid_viscous"
    for path in (*folder.glob("data/*.csv"), folder / "README.md"):
        assert "volt" not in path.read_text(encoding="utf-8").lower()


def test_what_a_device_cannot_hide_is_refused(tmp_path: Path) -> None:
    choice = Choice(law="isolator", effects=("coil_lag",))
    with pytest.raises(StudyError, match="effect to hide in a bench with the law isolator"):
        make_bench(tmp_path / "rig", choice)
    with pytest.raises(StudyError, match="lugre is right"):
        make_building(tmp_path / "tower", Choice(law="isolator"))


def test_a_law_that_no_example_has_is_told_those_that_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["example", "bench", str(tmp_path / "rig"), "--law", "rubber"]) == 2
    assert "shock_absorber" in capsys.readouterr().err
