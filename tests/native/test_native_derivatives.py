"""Derivatives of inputs: an input moves over a step; a component takes it as it takes inputs."""

from __future__ import annotations

import math
from ctypes import c_void_p
from typing import Any

import pytest
from both_forms import Both, both, native, needs_zig

from bristle.component import HELD
from bristle.fmu.description import Variable
from bristle.fmu.library import ERROR, Handle

pytestmark = needs_zig

H = 0.002
"""Length of a step [s]."""
LIGHT = "ClippedOptimal"


def target(v: Variable, k: int, i: int) -> float:
    """Return what an input has at the end of step k."""
    size = {"m": 0.01, "m/s": 0.2, "m/s2": 3.0, "N": 8.0, "V": 5.0}.get(v.unit or "", 1.0)
    return float(v.start or 0.0) + size * math.sin(0.11 * k + 0.9 * i)


def largest_difference(pair: Both, steps: int = 80, values: bool = True) -> float:
    """Return how far outputs differ, as a share of their peak, from a Python form driven by hand.

    The Python form gets the middle of the step where it holds an input, else its end; and the end
    before its outputs are read. The native one gets value and derivative before the step, or the
    derivative alone, from where the step before has brought it.
    """
    inputs = [v for v in pair.native.about.of("input") if not v.optional]
    rows: list[tuple[list[float], list[float]]] = []
    for k in range(1, steps):
        for i, v in enumerate(inputs):
            before, now = target(v, k - 1, i), target(v, k, i)
            middle = 0.5 * (before + now)
            pair.slave.set_real([v.reference], [middle if v.over_step == HELD else now])
            if values or k == 1:
                assert pair.one.set("Real", [v.reference], [before]) == 0
            assert pair.one.input_derivative(v.reference, (now - before) / H) == 0
        assert pair.step((k - 1) * H, H) == (True, 0)
        for i, v in enumerate(inputs):
            pair.slave.set_real([v.reference], [target(v, k, i)])
        rows.append(pair.shown())
        ends = pair.one.get("Real", [v.reference for v in inputs])[1]
        assert ends == pytest.approx([target(v, k, i) for i, v in enumerate(inputs)], abs=1e-13)
    worst = 0.0
    for k in range(len(pair.reals)):
        mine, other = ([row[side][k] for row in rows] for side in (0, 1))
        peak = max(map(abs, mine)) or 1.0
        worst = max(worst, max(abs(a - b) for a, b in zip(mine, other, strict=True)) / peak)
    return worst


def follows(component: str, values: bool, **parameters: Any) -> None:
    pair = both(component, **parameters)
    pair.begin()
    assert largest_difference(pair, values=values) <= 1e-12
    pair.end()


@pytest.mark.parametrize("values", [True, False], ids=["with values", "derivatives alone"])
def test_a_sampled_input_is_taken_at_the_end_of_the_step(values: bool) -> None:
    follows(LIGHT, values)


@pytest.mark.slow  # heavy components are compiled
@pytest.mark.parametrize("values", [True, False], ids=["with values", "derivatives alone"])
@pytest.mark.parametrize("component", ["LuGreDamper", "Structure", "Sensors"])
def test_held_inputs_have_the_middle_of_the_step_and_others_its_end(
    component: str, values: bool
) -> None:
    follows(component, values)


def started(component: str = LIGHT) -> tuple[Handle, list[Variable]]:
    """Return a native instance in step mode, and its inputs."""
    one = native(component).instance()
    assert [one.setup(0.0, None), one.enter(), one.leave()] == [0, 0, 0]
    native(component).messages.clear()
    return one, native(component).about.of("input")


def values_of(one: Handle, inputs: list[Variable]) -> list[Any]:
    return one.get("Real", [v.reference for v in inputs])[1]


def test_a_derivative_lasts_until_another_one_and_a_reset_clears_it() -> None:
    one, inputs = started()
    first = inputs[0]
    one.set("Real", [first.reference], [1.0])
    assert one.input_derivative(first.reference, 5.0) == 0
    assert values_of(one, [first]) == [1.0]  # until a step is made
    for k in range(3):
        assert one.step(k * H, H) == 0
    assert values_of(one, [first]) == pytest.approx([1.0 + 3 * 5.0 * H])
    one.set("Real", [first.reference], [-2.0])  # a value alone leaves the derivative
    assert one.step(3 * H, H) == 0
    assert values_of(one, [first]) == pytest.approx([-2.0 + 5.0 * H])
    assert one.input_derivative(first.reference, 0.0) == 0
    assert one.step(4 * H, H) == 0
    assert values_of(one, [first]) == pytest.approx([-2.0 + 5.0 * H])
    assert one.input_derivative(first.reference, 5.0) == 0
    assert [one.reset(), one.setup(0.0, None), one.enter(), one.leave()] == [0, 0, 0, 0]
    assert one.step(0.0, H) == 0
    assert values_of(one, [first]) == [float(first.start or 0.0)]
    one.free()


def test_derivatives_are_part_of_the_state() -> None:
    one, inputs = started()
    for i, v in enumerate(inputs):
        one.set("Real", [v.reference], [0.1 * i])
        assert one.input_derivative(v.reference, 3.0 - i) == 0
    state, runs = c_void_p(), []
    assert one.save(state) == 0
    data = one.serialise(state)[1]
    for attempt in range(3):
        if attempt == 1:
            for v in inputs:
                one.input_derivative(v.reference, 0.0)
            assert one.restore(state) == 0
        if attempt == 2:  # in another instance, from bytes
            one.forget(state)
            one.free()
            one, _ = started()
            assert one.deserialise(data, state) == 0
            assert one.restore(state) == 0
        for k in range(4):
            assert one.step(k * H, H) == 0
        outputs = [v for v in native(LIGHT).about.of("output") if v.kind == "Real"]
        runs.append((values_of(one, inputs), values_of(one, outputs)))
    assert runs[0] == runs[1] == runs[2]
    assert runs[0][0] == pytest.approx([0.1 * i + (3.0 - i) * 4 * H for i in range(len(inputs))])
    one.forget(state)
    one.free()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_derivative_that_is_not_finite_is_a_fault_of_the_input(value: float) -> None:
    one, inputs = started()
    said = native(LIGHT).messages
    assert one.input_derivative(inputs[0].reference, value) == 0
    before = values_of(one, inputs)
    assert one.step(0.0, H) == ERROR
    assert values_of(one, inputs) == before
    fault = native(LIGHT).about.variables["fault"].reference
    assert one.get("Integer", [fault]) == (0, [1])
    about = f"the derivative of {inputs[0].name} = {value!r}."
    assert [text for *_, text in said] == [f"one: fault 1, an input is not finite: {about}"]
    one.free()


def test_an_input_that_a_step_would_bring_out_of_bounds_is_a_fault_too() -> None:
    one, inputs = started()
    one.set("Real", [inputs[0].reference], [1e308])
    assert one.input_derivative(inputs[0].reference, 1e308 / H) == 0
    assert one.step(0.0, H) == ERROR
    assert f"{inputs[0].name} = inf." in native(LIGHT).messages[-1][3]
    one.free()


def test_other_orders_and_other_variables_are_refused_with_a_message() -> None:
    one, inputs = started()
    about, said = native(LIGHT).about, native(LIGHT).messages
    name = inputs[0].name
    for order in (0, 2, -1):
        assert one.input_derivative(inputs[0].reference, 1.0, order) == ERROR
        assert said[-1][3] == f"one: the derivative of {name} cannot be set: order 1 is right."
    output = next(v for v in about.of("output") if v.kind == "Real")
    assert one.input_derivative(output.reference, 1.0) == ERROR
    assert said[-1][3] == f"one: the derivative of {output.name} cannot be set: it is no input."
    assert one.input_derivative(about.variables["fault"].reference, 1.0) == ERROR
    assert said[-1][3] == "one: fault is not of type float."
    assert one.input_derivative(100_000, 1.0) == ERROR
    assert {status for _, status, *_ in said[:4]} == {ERROR}
    before = values_of(one, inputs)
    assert one.step(0.0, H) == 0  # nothing of it has been taken
    assert values_of(one, inputs) == before
    one.free()


def test_the_description_says_so_in_fmi_2_where_there_are_inputs() -> None:
    assert native(LIGHT).about.capabilities["canInterpolateInputs"] == "true"
    assert native("ConstantVoltage").about.capabilities["canInterpolateInputs"] == "false"
