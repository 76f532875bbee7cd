"""Design files: what they may say, and one clear message for everything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from bristle.errors import DesignError, PhysicsError
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from bristle.synthesis import Task, Weight, damper_from_model, read_task

HEAD = 'schema = 1\nkind = "lpv"\n'


def write(folder: Path, text: str, name: str = "design.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_the_shortest_files_are_the_reference_designs(tmp_path: Path) -> None:
    for kind in ("hinf", "lpv", "lqg"):
        path = write(tmp_path, f'schema = 1\nkind = "{kind}"\n')
        assert read_task(path) == Task(kind)
        assert read_task(path).digest() == Task(kind).digest()


def test_a_whole_file(tmp_path: Path) -> None:
    write(
        tmp_path,
        "schema = 1\nmasses = [2.0, 1.0]\nstiffnesses = [900.0, 1000.0]\ndamping_ratio = 0.02\n",
        "b.toml",
    )
    path = write(
        tmp_path,
        HEAD
        + """
        title = "mine"
        building = "b.toml"
        sample_period = 0.004
        tau = 3
        order = 5
        [weights]
        acceleration = { gain = 2, corner = 10.0 }
        command = { numerator = [1.0, 15.0], denominator = [1.0, 50.0] }
        noise = 0.05
        [damper]
        law = "lugre"
        parameters = { sigma_a = 700.0, "gas_spring.k" = 50.0 }
        effects = ["gas_spring"]
        v_max = 6.0
        known_to = 0.5
        [scheduling]
        grid = [0, 0.1, 0.4]
        varies = "Y"
        rate = 2.0
        rows = 101
        """,
    )
    task = read_task(path)
    assert (task.title, task.tau, task.order, task.sample_period) == ("mine", 3.0, 5, 0.004)
    assert task.building.size == 2
    assert task.weights.acceleration == Weight.low_pass(2.0, 10.0)
    assert task.weights.command == Weight((1.0, 15.0), (1.0, 50.0))
    assert task.damper.values == {"sigma_a": 700.0, "gas_spring.k": 50.0}
    assert task.damper.effects == ("gas_spring",)
    assert task.scheduling.grid == (0.0, 0.1, 0.4)
    assert (task.scheduling.varies, task.scheduling.rows) == ("Y", 101)
    assert task.data()["scheduling"]["grid"] == [0.0, 0.1, 0.4]


def test_a_model_file_brings_its_units_and_effects(tmp_path: Path) -> None:
    model = """
        schema = 1
        law = "lugre"
        [parameters.sigma_a]
        value = 0.65
        unit = "kN/m"
        std = 0.01
        [effects.gas_spring]
        parameters = { k = { value = 81.2, unit = "N/m", free = true } }
        """
    write(tmp_path, model, "model.toml")
    path = write(tmp_path, HEAD + '[damper]\nmodel = "model.toml"\nv_max = 5.0\n')
    damper = read_task(path).damper
    assert damper.values["sigma_a"] == pytest.approx(650.0)
    assert damper.values["gas_spring.k"] == pytest.approx(81.2)
    own = {f"gas_spring.{name}" for name in EFFECTS["gas_spring"].parameters}
    assert set(damper.values) == {*LAWS["lugre"].parameters, *own}
    assert (damper.law, damper.effects, damper.v_max) == ("lugre", ("gas_spring",), 5.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "tau = nan", "tau is nan, not a finite number"),
        (HEAD + "sample_period = 0.0", "must be positive"),
        (HEAD + "sample_period = 1.0", "too long for the first mode"),
        (HEAD + "weights = 3", "weights is 3: expected a table"),
        (HEAD + "[weights]\nnoise = 0", r"\[weights\].*singular"),
        (HEAD + "[weights]\ncommand = { gain = 1, corner = 3 }", r"\[weights\].*singular"),
        (
            HEAD + "[weights]\ncommand = { gain = 1 }",
            r"\[weights\] command is a table: expected a weight",
        ),
        (
            HEAD + "[weights]\ncommand = { numerator = [1, 0, 0], denominator = [1, 1] }",
            r"\[weights\].*improper",
        ),
        (
            HEAD + "[weights]\ncommand = { numerator = 1, denominator = [1] }",
            "numerator is 1: expected",
        ),
        (HEAD + "[scheduling]\ngrid = [0.1]", r"\[scheduling\].*no range"),
        (HEAD + "[scheduling]\ngrid = [0.0, 0.2, 0.1]", r"\[scheduling\].*must rise"),
        (HEAD + "[scheduling]\ngrid = 3", "grid is 3: expected a list"),
        (HEAD + "[damper]\nknown_to = 0.1", "beyond the 0.1 m/s"),
        (HEAD + "[damper]\nv_max = 0.0", r"\[damper\].*v_max"),
        (HEAD + '[damper]\nlaw = "ling"', r"\[damper\].*law"),
        (HEAD + "[damper]\nparameters = { f_x = 1.0 }", r"\[damper\].*f_x"),
        (HEAD + '[damper]\nmodel = "m.toml"\nlaw = "lugre"', "either model or law"),
        (HEAD + '[damper]\nmodel = "missing.toml"', r"missing\.toml: there is no such file"),
        (HEAD + "[damper]\nparameters = 3", "expected a table"),
        ('schema = 1\nkind = "lqg"\n[lqg]\nforce = 0.0', r"\[lqg\].*singular"),
        ('schema = 1\nkind = "lqg"\norder = 4', "order is of hinf and lpv designs"),
        ('schema = 1\nkind = "lqg"\ntau = 3.0', "tau is of hinf and lpv designs"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(DesignError, match=message) as caught:
        read_task(path)
    assert str(tmp_path) in str(caught.value)
    assert str(caught.value).count(str(path)) <= 1
    assert caught.value.exit_code == 2


def test_a_missing_design_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"none\.toml: there is no such file"):
        read_task(tmp_path / "none.toml")


def test_a_wrong_building_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, HEAD + 'building = "b.toml"')
    with pytest.raises(PhysicsError, match=r"b\.toml"):
        read_task(path)


def test_a_mistake_of_a_model_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, 'schema = 1\nlaw = "bingham"\n[parameters.f_z]\nvalue = 1', "model.toml")
    with pytest.raises(DesignError, match=r":3: .*f_z"):
        damper_from_model(path)
