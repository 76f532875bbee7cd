"""A scenario that names its damper's law: a user's own, a form of the command, mistakes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import bristle
from bristle import trust
from bristle.cli import main
from bristle.errors import PhysicsError, ScenarioError, TrustError
from bristle.physics.damper import DamperModel
from bristle.physics.laws import LAWS
from bristle.system.library import damper_of
from bristle.system.scenario import load_scenario
from bristle.system.toml import scenario_text
from bristle.user_code.load import unload_effects

OWN = '''
"""A law of my own."""

from bristle.physics.law import Law, Linear, Parameter


class Rounded(Law):
    """A yield force that builds up with speed, and a viscous part."""

    name = "rounded"
    parts = ("yield", "viscous")
    source = "a test"
    parameters = {
        "f_c": Parameter(1.5, "N", (0.0, 1e4), "yield force"),
        "f_v": Parameter(0.8, "N/V", (0.0, 1e4), "yield force per volt"),
        "c": Parameter(20.0, "N.s/m", (0.0, 1e5), "damping"),
    }
    command = {"yield_force": Linear("f_c", "f_v")}

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * q.v / (abs(q.v) + 0.02)

    @staticmethod
    def viscous(q, z, p):
        return p.c * q.v
'''
HOUSE = """schema = 1
title = "a law of my own"
[run]
stop = 2.0
step = 0.002
[components.ground]
fmu = "GroundMotion"
parameters = {{ record = "el_centro_1940_ns" }}
[components.structure]
fmu = "Structure"
[components.damper]
{damper}
[connections]
"structure.ground_acceleration" = "ground.ground_acceleration"
"structure.damper_force" = "damper.force"
"damper.displacement" = "structure.base_displacement"
"damper.velocity" = "structure.base_velocity"
"""
LAW = 'law = "laws/rounded.py"\nparameters = { c = 25.0, voltage = 3.0 }'
FORM = 'command = "table"\ncommand_knots = [0.0, 2.0, 5.0]'
TABLE = (
    f'fmu = "BinghamDamper"\n{FORM}\n'
    'parameters = { "yield_force[2]" = 0.5, "yield_force[3]" = 2.0, voltage = 3.5 }'
)
BENT = 'law = "lugre"\ncommand = "quadratic"\nparameters = { voltage = 3.0 }'


@pytest.fixture(autouse=True)
def library() -> Iterator[None]:
    yield
    unload_effects()


@pytest.fixture
def house(tmp_path: Path) -> Path:
    (tmp_path / "laws").mkdir()
    (tmp_path / "laws" / "rounded.py").write_text(OWN, encoding="utf-8")
    return tmp_path


def written(folder: Path, damper: str) -> Path:
    file = folder / "house.toml"
    file.write_text(HOUSE.format(damper=damper), encoding="utf-8")
    return file


def agree(file: Path, most: float) -> None:
    """Compare the engines; a force that is held over a step is what they differ by."""
    fmu, compiled = bristle.run(file, engine="fmu"), bristle.run(file, engine="compiled")
    for column in ("damper.force", "structure.base_displacement"):
        error = np.std(fmu[column] - compiled[column]) / np.std(compiled[column])
        assert error < most, column


@pytest.mark.slow  # an own law is compiled with the engine
def test_both_engines_run_a_law_of_ones_own(house: Path) -> None:
    with trust.granted():
        agree(written(house, LAW), 0.03)
        agree(written(house, f"{LAW}\n{FORM}"), 0.03)


def test_the_fmu_of_a_law_of_ones_own_gives_its_force(house: Path) -> None:
    with trust.granted():
        frame = bristle.run(written(house, f"{LAW}\n{FORM}"), engine="fmu")
    x, v = (frame[f"structure.base_{name}"].to_numpy() for name in ("displacement", "velocity"))
    damper = DamperModel("rounded[table 0 2 5]", {"c": 25.0})
    own = [damper.force(a, b, 0.0, 3.0, 2e-3, 0.0, 0.0, False) for a, b in zip(x, v, strict=True)]
    assert frame["damper.force"].to_numpy()[1:].tolist() == own[1:]


def test_both_engines_take_a_form_of_the_command(tmp_path: Path) -> None:
    gains = '"stiffness[2]" = 100.0, "stiffness[3]" = 900.0'
    damper = f'law = "lugre"\n{FORM}\nparameters = {{ {gains}, voltage = 3.5 }}'
    agree(written(tmp_path, damper), 0.05)


def test_a_scenario_is_written_with_its_law(house: Path) -> None:
    with trust.granted():
        for damper in (f"{LAW}\n{FORM}", TABLE, BENT):
            scenario = load_scenario(written(house, damper))
            again = house / "again.toml"
            again.write_text(scenario_text(scenario), encoding="utf-8")
            read = load_scenario(again).components["damper"]
            own = scenario.components["damper"]
            assert read == own
    assert own.law is not None
    assert own.law.name == "lugre[quadratic]"
    assert "yield_force_bend" not in own.description.variables
    assert own.description.variables["stiffness_bend"].unit == "N/(m.V2)"


def test_without_consent_nothing_of_a_law_runs(
    house: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BRISTLE_STATE", str(house / "state"))
    monkeypatch.delenv("BRISTLE_TRUST", raising=False)
    file = written(house, LAW)
    with pytest.raises(TrustError, match=r"rounded\.py"):
        load_scenario(file)
    assert "rounded" not in LAWS
    assert main(["check", str(file)]) == 2
    assert "consent" in capsys.readouterr().err
    assert main(["check", str(file), "--trust"]) == 0
    assert main(["check", str(file)]) == 0  # consent is remembered


def test_a_law_that_gives_nan_is_refused_with_its_line(house: Path) -> None:
    file = house / "laws" / "rounded.py"
    bad = OWN.replace("return p.c * q.v", "return p.c * q.v * (1e308 * 10.0 - 1e308 * 10.0)")
    file.write_text(bad, encoding="utf-8")
    with trust.granted(), pytest.raises(ScenarioError, match=r"rounded\.py, line \d+: viscous"):
        load_scenario(written(house, LAW))


@pytest.mark.parametrize(
    ("damper", "text"),
    [
        ('law = "laws/roundde.py"', 'there is no file.*Did you mean "laws/rounded.py"'),
        ('law = "binghan"', "binghan.*bingham"),
        ('law = "bingham_standard"', "bingham_standard"),
        ("law = 3", "law is 3"),
        ('law = "bingham"\nfmu = "BinghamDamper"', "one of them must go"),
        ('law = "bingham"\ncommand = "cubic"', "no command .cubic"),
        ('law = "bingham"\ncommand = 3', "command is 3"),
        ('law = "bingham"\ncommand = "table"', "command_knots"),
        ('law = "bingham"\ncommand_knots = [0.0, 1.0]', "command_knots"),
        (f'law = "bingham"\n{FORM.replace("2.0", "7.0")}', "ascending"),
        ('fmu = "Structure"\ncommand = "quadratic"', "only a built-in damper"),
        ('command = "quadratic"', "only a built-in damper"),
        (f"{TABLE.replace('yield_force[3]', 'yield_force[4]')}", r"yield_force\[4\]"),
    ],
)
def test_a_wrong_law_is_a_mistake_of_the_scenario(house: Path, damper: str, text: str) -> None:
    with pytest.raises(ScenarioError, match=text):
        load_scenario(written(house, damper))


def test_a_law_is_chosen_by_an_override(house: Path) -> None:
    file = written(house, 'fmu = "BinghamDamper"\nparameters = { voltage = 3.0 }')
    bent = load_scenario(file, {"damper.command": "quadratic", "damper.yield_force_bend": -0.05})
    component = bent.components["damper"]
    assert component.law is not None
    assert component.law.name == "bingham[quadratic]"
    assert component.values["yield_force_bend"] == -0.05


def test_a_law_that_nobody_knows_is_said() -> None:
    with pytest.raises(PhysicsError, match="There are: bingham"):
        damper_of("nobody")
