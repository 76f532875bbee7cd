"""The timing rules, on components whose outputs can be worked out by hand.

h = 0.1 s. Ramp: value = t. Integrator: x += h u (u held), y = x + gain u follows u at once.
Gain: y = gain u + offset follows u at once. Delay: y_last = the u of its last step.
"""

from __future__ import annotations

import numpy as np
import pytest
from toys import Maker

from bristle import run
from bristle.errors import ScenarioError

H = 0.1
T = np.arange(11) / 10


def test_rows_are_times_and_row_zero_is_the_start(scenario_of: Maker) -> None:
    frame = run(scenario_of({"ramp": "Ramp"}))
    assert frame.index.name == "time"
    assert frame.index.to_list() == [k / 10 for k in range(11)]  # 0.3, not 0.30000000000000004
    assert frame["ramp.value"].to_list() == pytest.approx(T)
    assert frame.attrs["complete"] is True


def test_gauss_seidel_gives_later_components_the_newest_value(scenario_of: Maker) -> None:
    file = scenario_of({"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"})
    frame = run(file)
    # Step k takes t_(k+1), which the ramp has shown before the integrator steps.
    assert frame["sum.x"].to_numpy() == pytest.approx(H * np.cumsum(T) - 0)
    assert frame["sum.y"].to_numpy() == pytest.approx(frame["sum.x"].to_numpy() + T)


def test_gauss_seidel_gives_earlier_components_the_last_value(scenario_of: Maker) -> None:
    file = scenario_of({"sum": "Integrator", "ramp": "Ramp"}, {"sum.u": "ramp.value"})
    frame = run(file)
    past = np.concatenate([[0.0], H * np.cumsum(T)[:-1]])
    assert frame["sum.x"].to_numpy() == pytest.approx(past)
    # y follows u: in row k it has the ramp of t_k, which stepped after it, beside x of t_k.
    assert frame["sum.y"].to_numpy() == pytest.approx(past + T)


@pytest.mark.parametrize("order", [("ramp", "sum"), ("sum", "ramp")])
def test_jacobi_does_not_depend_on_the_order(scenario_of: Maker, order: tuple[str, str]) -> None:
    kinds = {"ramp": "Ramp", "sum": "Integrator"}
    file = scenario_of(
        {name: kinds[name] for name in order}, {"sum.u": "ramp.value"}, algorithm="jacobi"
    )
    frame = run(file)
    past = np.concatenate([[0.0], H * np.cumsum(T)[:-1]])
    assert frame["sum.x"].to_numpy() == pytest.approx(past)
    assert frame["sum.y"].to_numpy() == pytest.approx(past + T)


def test_jacobi_records_refreshed_outputs_and_does_not_pass_them_on(scenario_of: Maker) -> None:
    file = scenario_of(
        {"ramp": "Ramp", "gain": "Gain", "last": "Delay"},
        {"gain.u": "ramp.value", "last.u": "gain.y"},
        algorithm="jacobi",
    )
    frame = run(file)
    assert frame["gain.y"].to_numpy() == pytest.approx(2 * T)  # as recorded: inputs of t_k
    # Passed on is what was read before the inputs were set: the gain of t_(k-1), one step late;
    # the step after that shows it. At t = 0 all values have settled.
    assert frame["last.y_last"].to_numpy()[2:] == pytest.approx(2 * T[:-2])


def test_gauss_seidel_passes_a_chain_on_within_one_row(scenario_of: Maker) -> None:
    # Against the order of the file, so that every link is set after the last component's step.
    file = scenario_of(
        {"third": "Gain", "second": "Gain", "first": "Gain", "ramp": "Ramp"},
        {"third.u": "second.y", "second.u": "first.y", "first.u": "ramp.value"},
    )
    frame = run(file)
    for name, factor in (("first", 2), ("second", 4), ("third", 8)):
        assert frame[f"{name}.y"].to_numpy() == pytest.approx(factor * T)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_start_values_run_through_chains(scenario_of: Maker, algorithm: str) -> None:
    file = scenario_of(
        {"b": "Gain", "a": "Gain", "s": "Integrator"},
        {"b.u": "a.y", "s.u": "b.y"},
        parameters={"a": {"u": 1.0, "offset": 0.5}},
        algorithm=algorithm,
    )
    first = run(file).iloc[0]
    assert (first["a.y"], first["b.y"], first["s.y"]) == (2.5, 5.0, 5.0)


def test_outputs_without_dependencies_are_read_after_the_inputs(scenario_of: Maker) -> None:
    file = scenario_of({"gain": "Untold", "ramp": "Ramp"}, {"gain.u": "ramp.value"})
    assert run(file)["gain.y"].to_numpy() == pytest.approx(2 * T)


def test_outputs_without_dependencies_make_no_algebraic_loop(scenario_of: Maker) -> None:
    # Two of them in a ring do not settle (gain 2 each) and must not be called a loop.
    file = scenario_of(
        {"a": "Untold", "b": "Untold"},
        {"a.u": "b.y", "b.u": "a.y"},
        parameters={"a": {"offset": 1.0, "gain": 0.5}, "b": {"gain": 0.5}},
    )
    frame = run(file)
    assert frame["a.y"].to_numpy() == pytest.approx(np.full(11, 1 / (1 - 0.25)))


def test_algebraic_loop_that_settles_starts_at_its_fixed_point(scenario_of: Maker) -> None:
    file = scenario_of(
        {"a": "Gain", "b": "Gain"},
        {"a.u": "b.y", "b.u": "a.y"},
        parameters={"a": {"offset": 1.0, "gain": 0.5}, "b": {"gain": 0.5}},
    )
    first = run(file).iloc[0]
    assert first["a.y"] == pytest.approx(4 / 3, rel=1e-11)
    assert first["b.y"] == pytest.approx(2 / 3, rel=1e-11)


def test_component_with_a_step_of_its_own_steps_inside_with_inputs_held(
    scenario_of: Maker,
) -> None:
    wires = {"sum.u": "ramp.value"}
    components = {"ramp": "Ramp", "sum": "Integrator"}
    coarse = run(scenario_of(components, wires))
    fine = run(scenario_of(components, wires, steps={"sum": 0.025}))
    # The input is held over the macro step: four quarters are one whole.
    assert fine["sum.x"].to_numpy() == pytest.approx(coarse["sum.x"].to_numpy())
    free = run(scenario_of({"ramp": "Ramp"}, steps={"ramp": 0.025}))
    assert free["ramp.value"].to_numpy() == pytest.approx(T)


def test_integers_and_booleans_are_passed_and_kept_as_such(scenario_of: Maker) -> None:
    file = scenario_of(
        {"a": "Logic", "b": "Logic"},
        {
            "a.number": "b.count",
            "a.flag": "b.flipped",
            "b.number": "a.count",
            "b.flag": "a.flipped",
        },
        stop=0.3,
    )
    frame = run(file)
    assert frame["a.count"].dtype == np.int64
    assert frame["a.flipped"].dtype == np.bool_
    assert frame["a.count"].to_list() == [0, 1, 3, 5]
    assert frame["b.count"].to_list() == [0, 2, 4, 6]
    assert frame["a.flipped"].to_list() == [False, True, True, True]
    assert frame["b.flipped"].to_list() == [False, False, False, False]


def test_two_instances_of_one_fmu_are_independent(scenario_of: Maker) -> None:
    file = scenario_of(
        {"ramp": "Ramp", "one": "Integrator", "two": "Integrator"},
        {"one.u": "ramp.value", "two.u": "one.x"},
        parameters={"one": {"gain": 3.0}},
    )
    frame = run(file)
    one = H * np.cumsum(T)
    assert frame["one.y"].to_numpy() == pytest.approx(one + 3 * T)
    assert frame["two.x"].to_numpy() == pytest.approx(H * np.cumsum(one))


def test_runs_do_not_disturb_each_other(scenario_of: Maker) -> None:
    import sys

    path, modules = list(sys.path), set(sys.modules)
    file = scenario_of({"ramp": "Ramp", "sum": "Integrator"}, {"sum.u": "ramp.value"})
    first, second = run(file), run(file)
    assert first.equals(second)
    assert sys.path == path
    assert not [name for name in set(sys.modules) - modules if name.endswith("_toy")]


def test_texts_are_parameters_and_no_columns(scenario_of: Maker) -> None:
    file = scenario_of({"one": "Texts"}, parameters={"one": {"heard": "µ and ü"}})
    frame = run(file)
    assert list(frame) == ["one.number"]
    assert frame["one.number"].iloc[-1] == 7


def test_texts_are_not_passed_on(scenario_of: Maker) -> None:
    file = scenario_of(
        {"one": "Texts", "two": "Texts"}, {"one.heard": "two.said", "two.heard": "one.said"}
    )
    with pytest.raises(ScenarioError, match=r'"one\.heard" is String .* texts are set'):
        run(file)
