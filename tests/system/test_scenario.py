"""Scenario files: what is read, how overrides change it, which file a name means."""

import math
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest
from valid import VALID

from bristle.core import files
from bristle.errors import ScenarioError
from bristle.system.model import Connection
from bristle.system.overrides import parse_override, parse_overrides
from bristle.system.scenario import check_scenario, load_scenario, resolve_scenario


@pytest.fixture
def write(tmp_path):
    """Write a scenario file and return it."""

    def to_file(text, name="my.toml", **options):
        file = tmp_path / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode(**options))
        return file

    return to_file


def load(file, overrides=None):
    return load_scenario(file, overrides)


def test_a_scenario_is_read_as_it_is_written(write):
    scenario = load(write(VALID))
    assert scenario.title == "El Centro, LuGre damper at 4 V"
    assert (scenario.stop, scenario.step, scenario.algorithm) == (35.0, 0.002, "gauss-seidel")
    assert scenario.steps == 17500
    assert list(scenario.components) == ["ground", "structure", "voltage", "damper"]
    damper = scenario.components["damper"]
    assert damper.values == {"gas_spring.on": True, "gas_spring.k": 80.0}
    assert (damper.kind, damper.path, damper.building, damper.step) == (
        "LuGreDamper",
        None,
        None,
        None,
    )
    assert damper.description.variables["force"].unit == "N"
    assert scenario.wires[1] == Connection("structure", "damper_force", "damper", "force")
    assert len(scenario.wires) == 5
    with pytest.raises(FrozenInstanceError):
        scenario.stop = 1.0


def test_a_valid_scenario_leaves_nothing_to_say_and_writes_nothing(write, tmp_path):
    file = write(VALID)
    assert check_scenario(file) == []
    assert list(tmp_path.iterdir()) == [file]


def test_title_and_algorithm_have_defaults(write):
    text = VALID.replace('title = "El Centro, LuGre damper at 4 V"\n', "")
    scenario = load(write(text.replace('algorithm = "gauss-seidel"\n', ""), "kobe.toml"))
    assert (scenario.title, scenario.algorithm) == ("kobe", "gauss-seidel")


@pytest.mark.parametrize(
    "text",
    [
        VALID.replace("\n", "\r\n"),
        "\ufeff" + VALID,
        VALID.replace(
            '"gas_spring.on" = true, "gas_spring.k"', "gas_spring.on = true, gas_spring.k"
        ),
        VALID.replace(
            'parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }',
            "parameters.gas_spring = { on = true, k = 80.0 }",
        ),
        VALID.replace(
            'parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }',
            "[components.damper.parameters]\n'gas_spring.on' = true\n\"gas_spring.k\" = 8e1",
        ),
        VALID.replace('"structure.damper_force"', "structure.damper_force"),
        VALID.replace("stop = 35.0", "stop = 35").replace("80.0", "80"),
    ],
    ids=["CRLF", "BOM", "dotted", "dotted table", "table", "dotted connection", "whole numbers"],
)
def test_other_spellings_of_toml_mean_the_same(write, text):
    plain, other = load(write(VALID)), load(write(text, "other.toml"))
    assert other.components == plain.components
    assert set(other.wires) == set(plain.wires)
    assert (other.stop, other.step) == (plain.stop, plain.step)
    assert isinstance(other.components["damper"].values["gas_spring.k"], float)


def test_names_may_be_in_any_script(write):
    text = VALID.replace("[components.damper]", '[components."dämpfer"]')
    scenario = load(write(text.replace('"damper.', '"dämpfer.')))
    assert scenario.components["dämpfer"].kind == "LuGreDamper"


def test_an_input_may_be_held_at_a_value(write):
    text = VALID.replace('"damper.voltage" = "voltage.voltage"\n', "").replace(
        '"gas_spring.on" = true', "voltage = 2.5"
    )
    text = text.replace(', "gas_spring.k" = 80.0', "")
    assert load(write(text)).components["damper"].values == {"voltage": 2.5}


def test_a_component_may_step_at_a_whole_fraction(write):
    text = VALID.replace('fmu = "LuGreDamper"', 'fmu = "LuGreDamper"\nstep = 0.0005')
    assert load(write(text)).components["damper"].step == 0.0005


def test_decimals_of_a_step_need_not_be_exact(write):
    # 10 s in thirds of a millisecond: 30000 steps within the tolerance, not to the last bit.
    text = VALID.replace("35.0", "10.0").replace("0.002", "0.000333333333333")
    assert load(write(text)).steps == 30000


# Overrides


def test_overrides_take_the_place_of_values(write):
    scenario = load(
        write(VALID),
        {
            "run.step": 0.001,
            "run.algorithm": "jacobi",
            "title": "mine",
            "voltage.level": 2,
            "damper.gas_spring.k": 60.0,
            "damper.sigma_1": np.float64(4.0),
            "ground.step": 0.0005,
        },
    )
    assert (scenario.step, scenario.algorithm, scenario.title) == (0.001, "jacobi", "mine")
    assert scenario.components["voltage"].values == {"level": 2.0}
    assert scenario.components["ground"].step == 0.0005
    assert scenario.components["damper"].values == {
        "gas_spring.on": True,
        "gas_spring.k": 60.0,
        "sigma_1": 4.0,
    }


@pytest.mark.parametrize("key", ["parameters = { gas_spring.k = 80.0 }", "parameters = {}", ""])
def test_an_override_replaces_any_spelling_and_adds_what_is_not_there(write, key):
    text = VALID.replace('parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }', key)
    overrides = {"damper.gas_spring.on": True, "damper.gas_spring.k": 70.0}
    scenario = load(write(text), overrides)
    assert scenario.components["damper"].values == {"gas_spring.k": 70.0, "gas_spring.on": True}


def test_an_override_can_exchange_the_damper(write):
    scenario = load(write(VALID), {"damper.fmu": "BinghamDamper", "damper.f_c": 2.0})
    assert scenario.components["damper"].kind == "BinghamDamper"
    assert scenario.components["damper"].values["f_c"] == 2.0


def test_a_law_and_an_fmu_take_the_place_of_each_other(write):
    named = load(write(VALID), {"damper.law": "lugre"})
    assert named.components["damper"].law.name == "lugre"
    text = VALID.replace('fmu = "LuGreDamper"', 'law = "lugre"')
    again = load(write(text), {"damper.fmu": "LuGreDamper"})
    assert (again.components["damper"].kind, again.components["damper"].law) == (
        "LuGreDamper",
        None,
    )
    with pytest.raises(ScenarioError, match="one of them must go"):
        load(write(VALID), {"damper.law": "lugre", "damper.fmu": "LuGreDamper"})


def test_a_scenario_knows_what_was_laid_over_its_file(write):
    assert load(write(VALID)).overrides == {}
    assert load(write(VALID), {"damper.gas_spring.k": np.int64(70)}).overrides == {
        "damper.gas_spring.k": 70
    }


def test_overrides_go_beside_those_of_a_loaded_scenario():
    loaded = load_scenario("half_sine_pulse", {"run.stop": 1.0})
    assert load_scenario(loaded, {}) is loaded
    both = load_scenario(loaded, {"voltage.level": 2.0})
    assert both.stop == 1.0
    assert both.components["voltage"].values["level"] == 2.0


def test_an_override_can_rewire(write):
    text = VALID.replace(
        "[components.damper]", '[components.other]\nfmu = "ConstantVoltage"\n\n[components.damper]'
    )
    scenario = load(write(text), {"connections.damper.voltage": "other.voltage"})
    assert Connection("damper", "voltage", "other", "voltage") in scenario.wires
    assert len(scenario.wires) == 5


def test_a_file_named_by_an_override_is_looked_for_in_the_current_folder(
    write, tmp_path, monkeypatch
):
    here = tmp_path / "here"
    here.mkdir()
    (here / "mine.csv").write_text("time [s],acceleration [m/s2]\n0,0\n1,1\n")
    monkeypatch.chdir(here)
    scenario = load(write(VALID), {"ground.record": "mine.csv"})
    assert scenario.components["ground"].values["record"] == str(here / "mine.csv")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"dampr.f_c": 1.0}, ['there is no component "dampr"', 'Did you mean "damper"?']),
        ({"damper.sigma_3": 1.0}, ['there is no parameter "sigma_3"', 'Did you mean "sigma_']),
        ({"damper.sigma_1": "five"}, ['damper.sigma_1 is the text "five"', "in N.s/m"]),
        ({"damper.sigma_1": -1.0}, ["lies below 0 N.s/m"]),
        ({"damper.sigma_1": np.float64("nan")}, ["nan, not a finite number"]),
        ({"damper.sigma_1": None}, ["None, not a number"]),
        ({"damper.sigma_1": np.zeros(2)}, ["not a number"]),
        ({"run.step": 0.003}, ["stop = 34.998 or 35.001"]),
        ({"run.stepp": 0.003}, ['there is no key "stepp"', 'Did you mean "step"?']),
        ({"run": 0.003}, ['a dotted name is right, as in "run.step"']),
        ({"damper.voltage": 3.0}, ["is connected here and set in the parameters"]),
        ({"connections.damper.voltage": "voltage.level"}, ["is a parameter; an output belongs"]),
        ({"title": 3}, ["title is 3: expected a text in quotes"]),
        ({"damper.fmu": "LuGre"}, ['Did you mean "LuGreDamper"?']),
    ],
)
def test_a_wrong_override_is_named(write, overrides, words):
    with pytest.raises(ScenarioError) as raised:
        load(write(VALID), overrides)
    for word in words:
        assert word in str(raised.value)
    if "damper.voltage" not in overrides:  # there the connection is what the message is about
        assert f'override "{next(iter(overrides))}"' in str(raised.value) or "stop =" in words[0]


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("damper.f_c=2", "damper.f_c", 2),
        ("damper.f_c = 2.5", "damper.f_c", 2.5),
        ("a.b=1e-3", "a.b", 1e-3),
        ("a.b=1_000", "a.b", 1000),
        ("a.b=.005", "a.b", 0.005),
        ("a.b=-5.", "a.b", -5.0),
        ("a.b=.", "a.b", "."),
        ("a.b=1.2.3", "a.b", "1.2.3"),
        ("a.b=true", "a.b", True),
        ("a.b=True", "a.b", "True"),
        ("a.b=lugre", "a.b", "lugre"),
        ('a.b="2"', "a.b", "2"),
        ('a.b="x # y"', "a.b", "x # y"),
        ("a.b=x # y", "a.b", "x # y"),
        ("a.b=1 # y", "a.b", "1 # y"),
        ("a.b=", "a.b", ""),
        ("a.b=c=d", "a.b", "c=d"),
        ("a.b=1\nc=2", "a.b", "1\nc=2"),
        ("a.b=[1, 2]", "a.b", "[1, 2]"),
        ("a.b=2020-01-01", "a.b", "2020-01-01"),
        ("a.b=../my.csv", "a.b", "../my.csv"),
        ("a.b=" + "9" * 5000, "a.b", "9" * 5000),
    ],
)
def test_an_override_is_read_as_toml_or_else_as_text(text, name, value):
    parsed = parse_override(text)
    assert parsed == (name, value)
    assert type(parsed[1]) is type(value)


def test_infinity_and_not_a_number_are_numbers_and_refused_later():
    assert parse_override("a.b=inf") == ("a.b", math.inf)
    assert math.isnan(parse_override("a.b=nan")[1])


@pytest.mark.parametrize("text", ["damper.f_c", "=2", " = 2", ""])
def test_an_override_without_name_or_value_is_refused(text):
    with pytest.raises(ScenarioError, match="NAME=VALUE is right"):
        parse_override(text)


def test_an_override_given_twice_is_refused():
    assert parse_overrides(["a.b=1", "a.c=2"]) == {"a.b": 1, "a.c": 2}
    with pytest.raises(ScenarioError, match=r'"a\.b" is given twice'):
        parse_overrides(["a.b=1", "a.b=2"])


def test_what_takes_a_list_is_given_one():
    texts = ["a.command_knots=[0, 2.5]", "a.effects=['x.py']", "a.b=[1]", "b.effects=x.py"]
    assert list(parse_overrides(texts).values()) == [[0, 2.5], ["x.py"], "[1]", "x.py"]


# Files


def test_a_stock_scenario_is_found_by_name(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "scenarios_folder", lambda: tmp_path)
    monkeypatch.chdir(tmp_path.parent)
    stock = tmp_path / "half_sine.toml"
    stock.write_text(VALID)
    assert resolve_scenario("half_sine") == stock
    assert resolve_scenario("half_sine.toml") == stock
    assert resolve_scenario(str(stock)) == stock
    with pytest.raises(ScenarioError, match='Did you mean "half_sine"') as raised:
        resolve_scenario("half_sin")
    assert "bristle list scenarios" in str(raised.value)
    with pytest.raises(ScenarioError, match="there is no scenario file"):
        resolve_scenario("folder/half_sine")


def test_a_file_here_goes_before_a_stock_scenario(tmp_path, monkeypatch):
    stock, here = tmp_path / "stock", tmp_path / "here"
    for folder in (stock, here):
        folder.mkdir()
        (folder / "a.toml").write_text(VALID)
    monkeypatch.setattr(files, "scenarios_folder", lambda: stock)
    monkeypatch.chdir(here)
    assert resolve_scenario("a.toml") == here / "a.toml"
    assert resolve_scenario("a") == stock / "a.toml"
    (here / "a").mkdir()  # such as a folder of its results
    assert resolve_scenario("a") == stock / "a.toml"


def test_a_misspelt_path_names_the_nearest_beside_it(tmp_path):
    (tmp_path / "kobe.toml").write_text(VALID)
    with pytest.raises(ScenarioError, match="Did you mean") as raised:
        resolve_scenario(tmp_path / "kobbe.toml")
    assert str(tmp_path / "kobe.toml") in str(raised.value)


@pytest.mark.parametrize("name", ["", "a\0b", "a/b\0/c", "x" * 5000, "y" * 5000 + "/z.toml"])
def test_a_name_that_no_file_can_have_is_refused(name):
    with pytest.raises(ScenarioError, match="scenario file"):
        resolve_scenario(name)


@pytest.mark.parametrize("name", ["x" * 5000 + ".csv", "a\0b.csv"])
def test_an_override_that_no_file_can_have_for_a_name_is_a_mistake(write, name):
    with pytest.raises(ScenarioError, match="override"):
        load(write(VALID), {"ground.record": name})


def test_files_are_handed_on_as_absolute_paths(write, tmp_path):
    (tmp_path / "signal.csv").write_text("time [s],value\n0,0\n1,1\n")
    constant = 'fmu = "ConstantVoltage"\nparameters = { level = 4.0 }'
    signal = 'fmu = "SignalSource"\nparameters = { kind = "csv", file = "signal.csv" }'
    text = VALID.replace(constant, signal)
    scenario = load(write(text.replace("voltage.voltage", "voltage.value")))
    values = scenario.components["voltage"].taken_values()
    assert values == {"kind": "csv", "file": str(tmp_path / "signal.csv")}
    assert Path(values["file"]).is_absolute()
