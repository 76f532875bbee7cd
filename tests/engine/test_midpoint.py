"""Midpoint coupling: the order of calls, its second order, and where it stays at end values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_master_schedule import GROUND, LOOP, STRUCTURE, VOLTAGE, calls, node
from toys import Maker

from bristle import run
from bristle.component import LINEAR, SAMPLED
from bristle.engine.schedule import Node, held_inputs, make_schedule
from bristle.errors import ScenarioError
from bristle.fmu.description import Variable
from bristle.system.scenario import check_scenario, resolve_scenario

H = 0.1
T = np.arange(11) / 10


def told(one: Node, **changes: dict[str, object]) -> Node:
    """Return a node whose variables differ: `x={"over_step": "linear"}`."""

    def changed(variables: dict[str, Variable]) -> dict[str, Variable]:
        return {n: replace(v, **changes.get(n, {})) for n, v in variables.items()}

    return replace(one, inputs=changed(dict(one.inputs)), outputs=changed(dict(one.outputs)))


LINEAR_GROUND = told(STRUCTURE, a_g={"over_step": LINEAR})
STANDING = told(VOLTAGE, V={"variability": "discrete"})


def test_structure_and_damper_hold_the_middle_and_show_the_end() -> None:
    nodes = [GROUND, LINEAR_GROUND, STANDING, LOOP[3]]
    assert calls(make_schedule(nodes, "midpoint")) == [
        ("step", 0),
        ("get", 0, "a_g"),
        ("get", 0, "fault"),
        ("set", 1, "a_g:newest force:ahead"),
        ("keep", 1, "x v"),
        ("step", 1),
        ("get", 1, "x v hold"),
        ("get", 1, "fault"),
        ("step", 2),
        ("get", 2, "V"),
        ("get", 2, "fault"),
        ("set", 3, "x:middle v:middle V:newest"),
        ("keep", 3, "force"),
        ("step", 3),
        ("set", 3, "x v"),
        ("get", 3, "force energy"),
        ("get", 3, "fault"),
        ("set", 1, "force"),
        ("get", 1, "a"),
    ]


def test_a_damper_before_the_structure_tells_motion_ahead_and_gives_the_middle_force() -> None:
    damper = node(
        "damper", {"x": (2, "x"), "v": (2, "v")}, {"force": ("x", "v"), "energy": (), "fault": ()}
    )
    structure = node(
        "structure",
        {"a_g": (0, "a_g"), "force": (1, "force")},
        {"x": (), "v": (), "a": ("force",), "fault": ()},
    )
    nodes = [GROUND, damper, told(structure, a_g={"over_step": LINEAR})]
    found = calls(make_schedule(nodes, "midpoint"))
    assert ("set", 1, "x:ahead v:ahead") in found
    assert found.index(("set", 1, "x:end v:end")) < found.index(("get", 1, "force"))
    assert ("set", 2, "a_g:newest force:middle") in found
    # Behind all steps: the motion of the row to the damper, its force to the accelerations.
    assert found[-4:] == [
        ("set", 1, "v x"),
        ("get", 1, "force"),
        ("set", 2, "force"),
        ("get", 2, "a"),
    ]


def test_a_jump_of_a_discrete_signal_is_no_slope() -> None:
    # The controller comes last: its voltage changes the force that was read for it.
    controller = node("controller", {"f": (2, "force")}, {"V": ()})
    damper = node("damper", {"x": (1, "x"), "V": (3, "V")}, {"force": ("x", "V"), "fault": ()})
    structure = node("structure", {"force": (2, "force")}, {"x": (), "fault": ()})
    nodes = [GROUND, structure, damper, told(controller, V={"variability": "discrete"})]
    nodes[3] = told(nodes[3], f={"over_step": SAMPLED})
    found = calls(make_schedule(nodes, "midpoint"))
    assert ("set", 3, "f") in found  # sampled: at the end
    assert found[-4:] == [
        ("set", 2, "V"), ("shift", 2, "force"), ("get", 2, "force"), ("shift", 2, "force"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("port", "what"),
    [
        ("x", {"over_step": SAMPLED}),
        ("x", {"over_step": LINEAR}),
        ("x", {"variability": "discrete"}),
        ("x", {"kind": "Integer"}),
        ("force", {"dependencies": None}),
        ("force", {"jumps_without": "hold"}),
    ],
)
def test_what_stays_at_end_values(port: str, what: dict[str, object]) -> None:
    whole = {(1, "force"), (3, "x"), (3, "v"), (3, "V"), (1, "a_g")}
    assert held_inputs(LOOP) == whole
    left = held_inputs([*LOOP[:3], told(LOOP[3], **{port: what})])
    gone = {(3, "x")}
    if port == "force":
        gone = {(3, "x"), (3, "v"), (3, "V")} | (
            {(1, "force")} if "jumps_without" in what else set()
        )
    assert left == whole - gone


def test_an_output_that_jumps_only_without_an_input_goes_on_with_it() -> None:
    damper = node("damper", {"x": (1, "x"), "hold": (1, "hold")}, {"force": ("x", "hold")})
    loop = [GROUND, STRUCTURE, VOLTAGE, told(damper, force={"jumps_without": "hold"})]
    assert {(1, "force"), (3, "x"), (3, "hold")} <= held_inputs(loop)


def test_a_stepped_source_is_taken_at_the_middle(scenario_of: Maker) -> None:
    file = scenario_of(
        {"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"}, algorithm="midpoint"
    )
    frame = run(file)
    assert frame["sum.x"].to_numpy() == pytest.approx(0.5 * T**2)  # exact for a ramp
    assert frame["sum.y"].to_numpy() == pytest.approx(0.5 * T**2 + T)  # y = x + u of the row
    assert frame.attrs["made"]["algorithm"] == "midpoint"


def test_a_source_that_steps_later_is_told_ahead(scenario_of: Maker) -> None:
    file = scenario_of(
        {"sum": "Integrator", "ramp": "Ramp"}, {"sum.u": "ramp.value"}, algorithm="midpoint"
    )
    frame = run(file)
    late = 0.5 * H**2  # of the first step, before which nothing is known
    assert frame["sum.x"].to_numpy()[1:] == pytest.approx(0.5 * T[1:] ** 2 - late)
    assert frame["sum.y"].to_numpy() == pytest.approx(frame["sum.x"].to_numpy() + T)


def test_inputs_of_an_fmu_that_declares_no_dependencies_stay_newest(scenario_of: Maker) -> None:
    wires = {"gain.u": "ramp.value"}
    for algorithm in ("gauss-seidel", "midpoint"):
        frame = run(scenario_of({"ramp": "Ramp", "gain": "Untold"}, wires, algorithm=algorithm))
        assert frame["gain.y"].to_numpy() == pytest.approx(2 * T)


@pytest.mark.parametrize("order", [("one", "two"), ("two", "one")])
def test_a_loop_of_two_integrators_is_of_second_order(
    scenario_of: Maker, order: tuple[str, str]
) -> None:
    # x1' = x2 + 1, x2' = -x1: a gain of 0 makes y = x, which follows u by its declaration alone.
    def error(algorithm: str, step: float) -> float:
        file = scenario_of(
            dict.fromkeys(order, "Integrator") | {"minus": "Gain"},
            {"one.u": "two.y", "two.u": "minus.y", "minus.u": "one.y"},
            parameters={
                "one": {"gain": 0.0},
                "two": {"gain": 0.0},
                "minus": {"gain": -1.0, "offset": 1.0},
            },
            step=step,
            algorithm=algorithm,
        )
        frame = run(file)
        exact = 1.0 - np.cos(frame.index.to_numpy())
        return float(np.abs(frame["one.x"] - exact).max())

    assert error("gauss-seidel", 0.05) / error("gauss-seidel", 0.025) < 2.3
    assert error("midpoint", 0.05) / error("midpoint", 0.025) > 3.3
    assert error("midpoint", 0.05) < 0.2 * error("gauss-seidel", 0.05)


def untold(scenario_of: Maker, line: str) -> Path:
    """Return a scenario in which an FMU without dependencies is told how it takes its input."""
    file = scenario_of(
        {"ramp": "Ramp", "last": "Delay"}, {"last.u": "ramp.value"}, algorithm="midpoint"
    )
    text = file.read_text().replace("[components.last]\n", f"[components.last]\n{line}\n")
    file.write_text(text)
    return file


@pytest.mark.parametrize(
    ("line", "lag"),
    [("", 0.5), ('over_step = { u = "sampled" }', 0.0), ('over_step = { u = "held" }', 0.5)],
)
def test_a_scenario_says_how_a_foreign_fmu_takes_an_input(
    scenario_of: Maker, line: str, lag: float
) -> None:
    frame = run(untold(scenario_of, line))  # it shows the input of its last step
    assert frame["last.y_last"].to_numpy()[1:] == pytest.approx(T[1:] - lag * H)
    if line:
        assert "over_step = { u = " in frame.attrs["made"]["scenario"]


def test_an_output_that_a_scenario_calls_sampled_is_passed_on_as_it_stands(
    scenario_of: Maker,
) -> None:
    file = untold(scenario_of, "")
    override = {"ramp.over_step.value": "sampled"}
    assert run(file, override)["last.y_last"].to_numpy()[1:] == pytest.approx(T[1:])


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('over_step = { w = "held" }', 'there is no port "w"'),
        ('over_step = { u = "late" }', "There are: held, linear, sampled"),
        ("over_step = { u = 1 }", 'expected "held" or "linear" or "sampled"'),
        ('over_step = { y_last = "held" }', '"sampled" is right'),
        ('over_step = "held"', "a table"),
    ],
)
def test_a_wrong_word_is_told(scenario_of: Maker, line: str, words: str) -> None:
    findings = check_scenario(untold(scenario_of, line))
    assert any(words in found.text and found.line for found in findings), findings


def test_built_in_components_say_it_themselves() -> None:
    with pytest.raises(ScenarioError, match="say it themselves"):
        run("half_sine_pulse", {"damper.over_step.velocity": "held", "run.stop": 0.1})


def test_the_components_of_a_loop_go_back_once_and_step_again() -> None:
    # Behind the loop: what reads it alone. Before it: ground and voltage, the latter late in file.
    watch = node("watch", {"x": (1, "x")}, {"y": ()})
    nodes = [GROUND, LINEAR_GROUND, told(STANDING), LOOP[3], watch]
    found = calls(make_schedule(nodes, "midpoint-iterated"))
    assert [one[:2] for one in found if one[0] in ("save", "step", "restore")] == [
        ("save", 1), ("save", 3), ("step", 0), ("step", 1), ("step", 2), ("step", 3),
        ("restore", 1), ("restore", 3), ("step", 1), ("step", 3), ("step", 4),
    ]  # fmt: skip
    again = found[found.index(("restore", 3)) :]
    assert ("set", 1, "a_g:newest force:middle") in again  # its end is known now
    assert ("set", 4, "x:middle") in again
    assert ("keep", 1, "x v") not in again


def test_without_a_loop_nothing_goes_back(scenario_of: Maker) -> None:
    wires = {"sum.u": "ramp.value"}
    components = {"ramp": "Ramp", "sum": "Integrator"}
    frame = run(scenario_of(components, wires, algorithm="midpoint-iterated"))
    assert frame["sum.x"].to_numpy() == pytest.approx(0.5 * T**2)


def test_a_loop_that_cannot_go_back_is_refused(scenario_of: Maker) -> None:
    components = {"one": "Integrator", "two": "Gain", "free": "Ramp"}
    file = scenario_of(
        components, {"one.u": "two.y", "two.u": "one.x"}, algorithm="midpoint-iterated"
    )
    with pytest.raises(ScenarioError, match="canGetAndSetFMUstate") as error:
        run(file)
    assert "[components.one]" in str(error.value)
    assert "free" not in str(error.value)


PULSE = {"run.stop": 1.0, "run.algorithm": "midpoint"}
FELT = ["structure.base_acceleration_absolute", "structure.base_displacement", "damper.force"]


def errors(scenario: str, **overrides: object) -> dict[str, float]:
    """Return the worst error along the run against the coupled engine, as a share of the peak."""
    given = {**PULSE, **{key.replace("__", "."): value for key, value in overrides.items()}}
    found, exact = run(scenario, given), run(scenario, given, engine="compiled")
    assert exact.attrs["made"]["algorithm"] == "coupled"
    names = [*FELT, "damper.dissipated_energy"]
    return {n: float((found[n] - exact[n]).abs().max() / exact[n].abs().max()) for n in names}


def test_the_pulse_keeps_its_goals_and_its_order() -> None:
    coarse, fine = errors("half_sine_pulse"), errors("half_sine_pulse", run__step=0.0005)
    assert coarse["structure.base_acceleration_absolute"] <= 0.005
    assert fine["structure.base_acceleration_absolute"] <= 0.0004
    for name, error in coarse.items():
        assert 10.0 < error / fine[name] < 22.0, name  # 16 is second order


@pytest.mark.slow  # 2 s: a run at two steps; a loop of toys is by default
def test_the_energy_under_a_voltage_that_goes_on_changing_is_of_second_order(
    tmp_path: Path,
) -> None:
    text = resolve_scenario("half_sine_pulse").read_text(encoding="utf-8")
    sine = 'kind = "sine", amplitude = 3.0, offset = 4.0, frequency = 3.0'
    for old, new in {
        'fmu = "ConstantVoltage"': 'fmu = "SignalSource"',
        "level = 4.0": sine,
        '"voltage.voltage"': '"voltage.value"',
    }.items():
        assert old in text
        text = text.replace(old, new)
    file = tmp_path / "changing.toml"
    file.write_text(text, encoding="utf-8")
    coarse, fine = errors(str(file)), errors(str(file), run__step=0.0005)
    assert coarse["damper.dissipated_energy"] < 0.001
    for name, error in coarse.items():
        assert 10.0 < error / fine[name] < 22.0, name  # 16 is second order


def test_one_rollback_is_better_still_and_repeats_nothing_of_the_first_pass() -> None:
    plain = errors("half_sine_pulse")
    iterated = errors("half_sine_pulse", run__algorithm="midpoint-iterated")
    assert all(iterated[name] < 0.5 * plain[name] for name in plain)


@pytest.mark.slow  # runs at several steps
def test_a_switching_controller_is_no_worse_than_with_gauss_seidel() -> None:
    short = {"run__step": 0.0005, "run__stop": 6.0}
    found = errors("el_centro_0p6g_clipped", **short)
    plain = errors("el_centro_0p6g_clipped", **short, run__algorithm="gauss-seidel")
    assert all(found[name] <= 1.1 * plain[name] for name in plain)


@pytest.mark.slow  # 2 s: runs at two algorithms
def test_an_end_stop_is_no_worse_than_with_gauss_seidel() -> None:
    stop = {"damper__end_stop.on": True, "damper__end_stop.clearance": 0.004}
    found = errors("half_sine_pulse", **stop)
    plain = errors("half_sine_pulse", **stop, run__algorithm="gauss-seidel")
    assert all(found[name] <= 1.1 * plain[name] for name in plain)


@pytest.mark.slow  # runs at several steps
def test_dry_friction_is_never_worse_than_with_gauss_seidel() -> None:
    sliding = {"damper__fmu": "BinghamDamper"}
    assert errors("half_sine_pulse", **sliding) == errors(
        "half_sine_pulse", **sliding, run__algorithm="gauss-seidel"
    )
    held = errors("bingham_half_sine_sticking")
    plain = errors("bingham_half_sine_sticking", run__algorithm="gauss-seidel")
    assert all(held[name] <= 1.1 * plain[name] for name in plain)
    assert held["structure.base_displacement"] < 0.3 * plain["structure.base_displacement"]
