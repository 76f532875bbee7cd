"""The rules of native FMUs of FMI 3.0: order of calls, faults, values, messages, states."""

from __future__ import annotations

import ctypes
import math
from typing import Any

import pytest
from both_forms import native, needs_zig
from fmi3_form import ERROR, LIGHT, WARNING, Three
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3ScheduledExecution

pytestmark = needs_zig


def test_a_wrong_token_and_what_it_does_not_offer_give_no_instance() -> None:
    with pytest.raises(Exception, match="Failed to instantiate"):
        Three(LIGHT, token="{00000000-0000-0000-0000-000000000000}")
    with pytest.raises(Exception, match="Failed to instantiate"):
        Three(LIGHT, eventModeUsed=True)
    for kind in (FMU3Model, FMU3ScheduledExecution):
        with pytest.raises(Exception, match="Failed to instantiate"):
            Three(LIGHT, kind)


def test_calls_out_of_order_answer_error() -> None:
    one = Three(LIGHT)
    assert one.step(0.0, 0.002) == ERROR
    assert one.get("fault") == [3]
    assert one.said[-1] == (
        ERROR, "logStatusError",
        "one: fault 3, a step outside step mode: doStep belongs between initialisation and "
        "terminate.",
    )  # fmt: skip
    assert one.status("Reset") == 0
    assert one.status("ExitInitializationMode") == ERROR
    assert one.status("Reset") == 0
    one.begin()
    assert one.status("EnterInitializationMode", False, 0.0, 5.0, False, 0.0) == ERROR
    assert one.get("time") == [0.0]
    assert one.step(0.0, 0.002) == ERROR  # a fault lasts
    assert one.status("Reset") == 0
    one.begin(2.0)
    assert one.get("time", "fault") == [2.0, 0]
    assert one.step(2.0, 0.002) == 0
    assert one.status("Terminate") == 0
    assert one.step(2.002, 0.002) == ERROR
    one.end()


def test_faults_hold_the_outputs_until_a_reset() -> None:
    one = Three(LIGHT)
    for length in (0.0, -0.001, math.nan, math.inf):
        one.begin()
        assert one.step(0.0, 0.002) == 0
        assert one.step(0.002, length) == ERROR
        assert one.last.value == 0.002
        assert one.get("fault") == [2]
        assert one.status("Reset") == 0
    one.begin()
    for k in range(20):
        one.set("base_velocity", 0.1 * math.sin(k))
        one.set("damper_force", 5.0)
        assert one.step(0.002 * k, 0.002) == 0
    before = one.shown()[:-1]
    assert any(before)
    one.set("base_velocity", math.nan)
    assert one.step(0.04, 0.002) == ERROR
    assert one.shown() == [*before, 1]
    said = "one: fault 1, an input is not finite: base_velocity = nan."
    assert one.said[-1] == (ERROR, "logStatusError", said)
    assert one.status("Reset") == 0
    one.set("v_max", -1.0)
    one.begin()
    assert one.shown() == [0.0, 0.0, 0.0, 5]
    assert one.step(0.0, 0.002) == ERROR
    one.end()


def test_what_cannot_be_set_or_read_is_answered() -> None:
    one = Three(LIGHT)
    one.begin()
    assert one.set("v_max", 3.0) == WARNING
    assert one.set("voltage", 3.0) == WARNING
    assert one.get("v_max") == [8.0]
    texts = [text for _, _, text in one.said]
    assert texts == [
        "one: v_max keeps 8.0: it is fixed after initialisation.",
        "one: voltage cannot be set.",
    ]
    reference, room = (ctypes.c_uint32 * 1)(999), (ctypes.c_double * 2)()
    assert one.status("GetFloat64", reference, 1, room, 1) == ERROR
    # An integer is read as the number that it is.
    assert one.status("GetFloat64", (ctypes.c_uint32 * 1)(12), 1, room, 1) == WARNING
    assert one.status("GetFloat64", (ctypes.c_uint32 * 1)(4), 1, room, 2) == ERROR
    assert one.status("GetFloat32", reference, 0, (ctypes.c_float * 1)(), 0) == 0
    assert one.status("GetFloat32", reference, 1, (ctypes.c_float * 1)(), 1) == ERROR
    assert one.said[-1][2] == "one: this FMU offers no variables of type Float32."
    time = (ctypes.c_uint32 * 1)(one.about.variables["time"].reference)
    assert one.status("SetFloat64", time, 1, room, 1) == ERROR
    for name in ("EnterEventMode", "EnterStepMode", "EnterConfigurationMode"):
        assert one.status(name) == ERROR
    assert one.step(0.0, 0.002) == 0  # none of these is a fault
    one.end()


def test_messages_are_no_formats_and_can_be_chosen() -> None:
    one = Three("PrescribedMotion")
    one.set("kind", "%s")
    one.begin()
    assert "kind '%s' is none of" in one.said[-1][2]
    one.said.clear()
    categories = (ctypes.c_char_p * 1)(b"logStatusWarning")
    assert one.status("SetDebugLogging", False, 1, categories) == 0
    assert one.status("SetDebugLogging", False, 1, (ctypes.c_char_p * 1)(b"none")) == WARNING
    assert one.set("kind", "chirp") == WARNING
    assert one.said == []
    one.end()


def test_states_come_back_and_those_of_others_are_refused() -> None:
    one = Three(LIGHT)
    one.set("f_min", 0.1)
    one.begin()

    def walk(instance: Three, first: int) -> list[list[Any]]:
        rows = []
        for k in range(first, first + 20):
            instance.set("base_velocity", 0.1 * math.sin(0.3 * k))
            instance.set("damper_force", 8.0 * math.cos(0.2 * k))
            assert instance.step(0.002 * k, 0.002) == 0
            rows.append(instance.shown())
        return rows

    walk(one, 0)
    state = one.slave.getFMUState()
    data = one.slave.serializeFMUState(state)
    wanted = walk(one, 20)
    assert len({tuple(row) for row in wanted}) > 2
    one.slave.setFMUState(state)
    assert one.get("time") == [pytest.approx(0.04)]
    assert walk(one, 20) == wanted
    one.slave.freeFMUState(state)
    other = Three(LIGHT)  # fresh: parameters and mode come with the state
    back = other.slave.deserializeFMUState(data)
    other.slave.setFMUState(back)
    assert walk(other, 20) == wanted
    other.slave.freeFMUState(back)
    two = native(LIGHT).instance()
    kept = ctypes.c_void_p()
    assert two.save(kept) == 0
    for bytes_, why in (
        (data[:-1], "it is damaged."),
        (b"x" * len(data), "it is not one of this FMU."),
        (two.serialise(kept)[1], "it is one of another FMU."),
    ):
        with pytest.raises(FMICallException):
            other.slave.deserializeFMUState(bytes_)
        assert other.said[-1][2] == f"one: the state cannot be set: {why}"
    two.forget(kept)
    two.free()
    one.end()
    other.end()
