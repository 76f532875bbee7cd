"""Values that are got as those of another type: both forms of an FMU answer, and warn."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from both_forms import Both, Native, both, folder, needs_zig
from fmi3_form import Three

from bristle.fmu.build import BuildPlan, plan
from bristle.fmu.library import ERROR, WARNING
from bristle.native.build import build
from bristle.native.entrance import component_of
from bristle.native.zig import here

pytestmark = needs_zig

CASES: list[tuple[str, str, Any]] = [
    ("fault", "Real", 0.0),
    ("fault", "Boolean", False),
    ("gas_spring.on", "Real", 1.0),
    ("gas_spring.on", "Integer", 1),
    ("voltage", "Integer", -2),  # rounded toward 0, as int() does
    ("voltage", "Boolean", True),
    ("voltage", "String", "-2.75"),
    ("gas_spring.on", "String", "True"),
]
NAMES = {"Real": "float", "Integer": "int", "Boolean": "bool", "String": "str"}
OF_FMI3 = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}


@cache
def damper() -> tuple[BuildPlan, Native]:
    """Return a damper with one effect of all: its C is compiled in a fifth of the time."""
    what = plan("BinghamDamper", offers=["gas_spring"])
    return what, Native(build(what, folder() / "one_effect", [here()]))


def pair_of_dampers(**values: Any) -> Both:
    what, form = damper()
    return Both(form, component_of(what), **values)


def test_a_damper_gives_the_same_numbers() -> None:
    pair = pair_of_dampers(**{"gas_spring.on": True})
    pair.begin()
    assert pair.largest_difference() <= 1e-12
    mine, other = pair.said()
    assert mine == other
    pair.end()


@pytest.mark.parametrize(("name", "kind", "value"), CASES)
def test_both_forms_answer_and_warn(name: str, kind: str, value: Any) -> None:
    pair = pair_of_dampers(**{"gas_spring.on": True})
    pair.set("voltage", -2.75)
    pair.begin()
    pair.said()
    index = pair.slave._index[name]
    mine = getattr(pair.slave, f"get_{kind.lower()}")([index])
    assert pair.one.get(kind, [index]) == (WARNING, mine)
    assert mine == [value]
    warning = f"one: {name} is not of type {NAMES[kind]}: its value is converted."
    for said in pair.said():
        assert [text for text in said if "of type" in text] == [warning]
    pair.one.free()


@pytest.mark.parametrize(("name", "kind", "value"), CASES)
def test_so_does_an_fmu_of_fmi_3(name: str, kind: str, value: Any) -> None:
    one = Three("BinghamDamper", offers=("gas_spring",))
    one.set("gas_spring.on", True)
    one.set("voltage", -2.75)
    index = one.about.variables[name].reference
    assert getattr(one.slave, f"get{OF_FMI3[kind]}")([index]) == [value]
    warning = f"one: {name} is not of type {NAMES[kind]}: its value is converted."
    assert [text for *_, text in one.said if "of type" in text] == [warning]


def test_a_number_that_fits_no_integer_is_none() -> None:
    pair = pair_of_dampers()
    pair.set("voltage", 1e12)
    index = pair.slave._index["voltage"]
    pair.said()
    assert pair.one.get("Integer", [index])[0] == ERROR
    assert any("voltage is not of type int." in text for text in pair.said()[1])
    pair.one.free()


@pytest.mark.parametrize("kind", ["Real", "Integer", "Boolean"])
def test_a_string_is_no_number_and_both_answer_0(kind: str) -> None:
    pair = both("GroundMotion")
    pair.said()
    index = pair.slave._index["record"]
    assert getattr(pair.slave, f"get_{kind.lower()}")([index]) == [0]
    assert pair.one.get(kind, [index]) == (WARNING, [0])
    for said in pair.said():
        assert said == [f"one: record is not of type {NAMES[kind]}: its value is converted."]
    pair.one.free()
