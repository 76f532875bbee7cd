"""A whole scenario as one component: its ports, its inputs, what is refused. Compiles nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bristle.cli import main
from bristle.engine.coupled import RecordLayout, symmetric_eigenvalues
from bristle.errors import BuildError, ScenarioError, StudyError
from bristle.export import composite_functions
from bristle.export.composite import Assembly, plan_of
from bristle.fmu.build import ensure
from bristle.native.entrance import component_of, entrance_of, prepare
from bristle.system.scenario import load_scenario, stock_scenarios

PASSIVE = "el_centro_lugre_passive"
SWITCHED = "el_centro_0p6g_lpv_sensors"


@pytest.mark.parametrize("scenario", stock_scenarios(), ids=lambda path: path.stem)
def test_outputs_are_those_of_a_run_and_parameters_those_of_the_parts(scenario: Path) -> None:
    slave = component_of(plan_of(scenario))
    named = {v.name for v in slave.vars.values() if v.causality.name == "output"}
    system = RecordLayout(load_scenario(scenario))
    assert named == {*system.outputs, "fault"}
    parameters = {
        f"{part.name}.{name}"
        for part in load_scenario(scenario).components.values()
        for name, variable in part.description.variables.items()
        if variable.causality == "parameter"
        if f"{name.split('.')[0]}.on" not in part.description.variables
        or name.split(".")[0] in part.effects_on()
    }
    assert set(slave.parameter_names()) == parameters


def test_what_the_scenario_sets_are_start_values() -> None:
    slave = component_of(plan_of(PASSIVE, {"damper.sigma_a": 700.0}))
    assert slave["ground.peak"] == 5.886
    assert slave["ground.record"] == "el_centro_1940_ns"
    assert slave["damper.sigma_a"] == 700.0
    assert not any(name.endswith(".on") for name in slave.parameter_names())
    sprung = component_of(plan_of(PASSIVE, {"damper.gas_spring.on": True}))
    assert sprung["damper.gas_spring.on"] is True
    assert [n for n in sprung.parameter_names() if n.endswith(".on")] == ["damper.gas_spring.on"]
    two = component_of(plan_of("dampers_at_two_levels"))
    assert two["damper.voltage"] == 2.0  # an input that the scenario holds constant


def test_inputs_are_what_is_open_and_what_is_named() -> None:
    given = Assembly(PASSIVE)
    assert [one.name for one in given.inputs] == ["structure.extra_force", "damper.acceleration"]
    named = Assembly(PASSIVE, None, ["structure.ground_acceleration", "voltage.level"])
    assert {(one.name, one.optional, named.over_step(one)) for one in named.inputs} == {
        ("structure.ground_acceleration", False, "linear"),
        ("structure.extra_force", True, "linear"),
        ("damper.acceleration", True, "linear"),
        ("voltage.level", True, "held"),
    }
    slave = component_of(plan_of(PASSIVE, None, ["voltage.level"]))
    assert slave["voltage.level"] == 4.0
    assert "voltage.level" not in slave.parameter_names()
    driven = Assembly(PASSIVE, None, ["damper.voltage"]).inputs
    assert [one.name for one in driven if not one.optional] == ["damper.voltage"]


def velocity_after_a_step(begin: float, end: float, monkeypatch: pytest.MonkeyPatch) -> float:
    """Return the base's velocity behind one step of a ground acceleration, in plain Python."""
    slave = component_of(plan_of(PASSIVE, None, ["structure.ground_acceleration"]))
    call = entrance_of(slave.flat_functions())
    whole = composite_functions.opened

    def opened(state: Any, baked: Any) -> Any:  # records with attributes, as compiled code has them
        run = whole(state, baked)
        kinds = ("sources", "dampers", "structures", "sampled")
        return run._replace(**{kind: getattr(run, kind).view(np.recarray) for kind in kinds})

    monkeypatch.setattr(composite_functions, "opened", opened)
    values, given = np.array(slave.flat_values()), np.array(slave.inputs_set())
    baked, dt = np.array(slave.bake()), 0.002
    played = [one.samples() for one in slave.assembly.parts.values() if one.played()]
    times, samples = (
        np.array([x for one in played for x in (len(one[k]), *one[k])]) for k in (0, 1)
    )
    none, counts = np.zeros(0), np.zeros(4)
    given_rows = values, given, baked, times, samples
    call(0, 0.0, 0.0, *given_rows, none, none, none, none, none, none, counts)
    store, state, outputs, work = (np.zeros(int(count)) for count in counts)
    now = np.array([slave._values[index] for index in slave._inputs])
    before = now.copy()
    rows = *given_rows, store, state, state, before, now, outputs, work
    assert [call(order, 0.0, 0.0, *rows) for order in (1, 2)] == [0, 0]
    before[0], now[0] = begin, end
    assert [call(order, 0.0, dt, *rows) for order in (5, 3)] == [0, 0]
    names = [slave.vars[index].name for index in slave._outputs]
    return float(outputs[names.index("structure.base_velocity")])


def test_an_input_goes_from_its_value_by_its_derivative(monkeypatch: pytest.MonkeyPatch) -> None:
    # What stands at the start is not what the last step ended with where a host sets both.
    from_zero, from_five = (velocity_after_a_step(begin, 6.0, monkeypatch) for begin in (0.0, 5.0))
    assert from_five / from_zero == pytest.approx(5.5 / 3.0, rel=0.05)


def test_outputs_follow_the_inputs_that_reach_them_through_other_parts() -> None:
    named = ["structure.ground_acceleration", "damper.voltage", "ground.factor"]
    of = Assembly(PASSIVE, None, named)
    assert of.followed("ground", "ground_acceleration") == ["ground.factor"]
    assert of.followed("structure", "base_displacement") == []
    assert "damper.voltage" in of.followed("damper", "force")
    through = of.followed("structure", "base_acceleration_absolute")
    assert {"structure.ground_acceleration", "damper.voltage"} <= set(through)
    sampled = Assembly(SWITCHED, None, ["structure.ground_acceleration"])
    assert sampled.followed("controller", "voltage") == []
    first = sampled.followed("controller", "voltage", initial=True)
    assert first == ["damper.acceleration"]  # it measures the damper's force


def test_the_description_tells_the_scenarios_experiment_and_dependencies() -> None:
    from xml.etree import ElementTree

    root = ElementTree.fromstring(prepare(plan_of(PASSIVE)).description)
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    assert experiment.attrib == {"startTime": "0.0", "stopTime": "35.0", "stepSize": "0.002"}
    assert root.attrib["variableNamingConvention"] == "structured"
    assert root.attrib["description"] == "El Centro, LuGre damper at 4 V"
    third = ElementTree.fromstring(prepare(plan_of(PASSIVE), fmi=3).description)
    assert third.attrib["fmiVersion"] == "3.0"


def test_a_part_whose_name_has_a_hyphen_makes_flat_names(tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    file.write_text(
        'schema = 1\ntitle = "two"\n[run]\nstop = 0.1\nstep = 0.01\n'
        '[components.the-level]\nfmu = "ConstantVoltage"\nparameters = { level = 3.0 }\n'
    )
    found = prepare(plan_of(file)).description
    assert 'variableNamingConvention="flat"' in found
    assert 'name="the-level.voltage"' in found


def test_files_that_sources_play_come_along_under_names_of_their_own(tmp_path: Path) -> None:
    rows = "".join(f"{0.01 * k:.2f},{k % 3}\n" for k in range(20))
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a quake.csv").write_text("time [s],acceleration [m/s2]\n" + rows)
    file = tmp_path / "two.toml"
    file.write_text(
        'schema = 1\ntitle = "two"\n[run]\nstop = 0.1\nstep = 0.01\n'
        + "".join(
            f'[components.{one}]\nfmu = "GroundMotion"\n'
            f'parameters = {{ record = "{one}/a quake.csv" }}\n'
            for one in ("one", "two")
        )
    )
    what = plan_of(file)
    assert set(what.files) == {"a_quake.csv", "a_quake_2.csv"}
    slave = component_of(what)
    assert (slave["one.record"], slave["two.record"]) == ("a_quake", "a_quake_2")
    assert slave.bundled() == ["a_quake", "a_quake_2"]


# -- what is refused

REFUSED = {
    "damper.nosuch": 'no component has an input or a parameter "damper.nosuch"',
    "nobody.level": "no component has an input or a parameter",
    "damper.force": "no component has an input or a parameter",
    "damper.sigma_a": "damper.sigma_a cannot be an input: it is fixed",
    "ground.record": "ground.record cannot be an input: it is fixed",
    "damper.holding_force": "the coupled step finds it itself",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_can_be_no_input_is_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order = ["export", PASSIVE, "--native", "--as-one", "--out", str(tmp_path / "x")]
    assert main([*order, "--input", name]) == ScenarioError.exit_code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert REFUSED[name] in said
    assert not (tmp_path / "x").exists()


def test_a_scenario_with_a_foreign_fmu_is_refused_in_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "foreign.toml"
    file.write_text(
        'schema = 1\ntitle = "foreign"\n[run]\nstop = 0.1\nstep = 0.01\n'
        f'[components.level]\nfmu = "{ensure("ConstantVoltage")}"\n'
    )
    assert main(["export", str(file), "--native", "--as-one"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "[components.level]" in said
    assert "cannot be compiled" in said


@pytest.mark.parametrize(
    ("more", "error", "words"),
    [
        (["--as-one"], ScenarioError, "--as-one goes with --native"),
        (["--native", "--input", "ground.factor"], StudyError, "--native --as-one"),
        (["--web", "page", "--as-one"], ScenarioError, "--web is for a page"),
        (["--native", "--as-one", "--platform", "os2"], BuildError, 'no platform is named "os2"'),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    more: list[str], error: Any, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", PASSIVE, *more]) == error.exit_code == 2
    assert words in capsys.readouterr().err


# -- what dampers that stick share


def test_eigenvalues_are_those_of_numpy() -> None:
    draw = np.random.default_rng(3)
    for n in range(1, 9):
        a = draw.normal(size=(n, n))
        matrix, values = (a + a.T).ravel().tolist(), [0.0] * n
        right = np.linalg.eigvalsh(a + a.T)
        symmetric_eigenvalues(n, matrix, values)
        assert np.allclose(sorted(values), right, rtol=0.0, atol=1e-13 * np.abs(right).max())
    values = [0.0, 0.0]
    symmetric_eigenvalues(2, [1.0, 1.0, 1.0, 1.0], values)  # forces against each other
    assert sorted(values) == pytest.approx([0.0, 2.0], abs=1e-15)
