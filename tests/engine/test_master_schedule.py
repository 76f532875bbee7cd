"""The schedule: the order of calls, and no call that is not needed."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from bristle.engine.schedule import (
    DoStep,
    Keep,
    Node,
    Ramp,
    ReadOutputs,
    Restore,
    Save,
    Schedule,
    Shift,
    Write,
    find_loop,
    make_schedule,
)
from bristle.fmu.description import Variable


def node(
    name: str,
    inputs: Mapping[str, tuple[int, str] | None],
    outputs: Mapping[str, tuple[str, ...] | None],
) -> Node:
    """Return a node from inputs with their sources and outputs with what they follow."""
    return Node(
        name,
        {i: Variable(i, "Real", "input", None, n) for n, i in enumerate(inputs)},
        {
            o: Variable(
                o, "Integer" if o == "fault" else "Real", "output", None, n, dependencies=follows
            )
            for n, (o, follows) in enumerate(outputs.items())
        },
        {i: source for i, source in inputs.items() if source},
    )


GROUND = node("ground", {}, {"a_g": (), "fault": ()})
STRUCTURE = node(
    "structure",
    {"a_g": (0, "a_g"), "force": (3, "force"), "extra": None},
    {"x": (), "v": (), "a": ("force", "extra"), "hold": ("a_g", "extra"), "fault": ()},
)
VOLTAGE = node("voltage", {}, {"V": (), "fault": ()})
DAMPER = node(
    "damper",
    {"x": (1, "x"), "v": (1, "v"), "V": (2, "V"), "hold": None},
    {"force": ("x", "v", "V", "hold"), "energy": (), "fault": ()},
)
LOOP = [GROUND, STRUCTURE, VOLTAGE, DAMPER]


def calls(schedule: Schedule) -> list[tuple[object, ...]]:
    """Return the operations in short: (kind, component, names)."""
    verbs = {ReadOutputs: "get", Write: "set", Ramp: "ramp", Keep: "keep", Shift: "shift"}
    alone = {DoStep: "step", Save: "save", Restore: "restore"}
    found: list[tuple[object, ...]] = []
    for o in schedule.operations:
        if isinstance(o, DoStep | Save | Restore):
            found.append((alone[type(o)], o.component))
        elif isinstance(o, Write) and o.values:
            each = (f"{n}:{v}" for n, v in zip(o.names, o.values, strict=True))
            found.append(("set", o.component, " ".join(each)))
        else:
            changed = " if changed" if isinstance(o, Write) and o.if_changed else ""
            found.append((verbs[type(o)] + changed, o.component, " ".join(o.names)))
    return found


def test_gauss_seidel_of_structure_and_damper() -> None:
    assert calls(make_schedule(LOOP, "gauss-seidel")) == [
        ("step", 0),
        ("get", 0, "a_g"),
        ("get", 0, "fault"),
        ("set", 1, "a_g"),  # the force of t_k is there since the end of the last step
        ("step", 1),
        ("get", 1, "x v hold"),  # hold follows a_g, which is already that of the new time
        ("get", 1, "fault"),
        ("step", 2),
        ("get", 2, "V"),
        ("get", 2, "fault"),
        ("set", 3, "x v V"),
        ("step", 3),
        ("get", 3, "force energy"),
        ("get", 3, "fault"),
        ("set", 1, "force"),
        ("get", 1, "a"),  # follows the force, new only now
    ]


def test_jacobi_of_structure_and_damper() -> None:
    assert calls(make_schedule(LOOP, "jacobi")) == [
        *(("step", c) for c in range(4)),
        ("get", 0, "a_g"),
        ("get", 0, "fault"),
        ("get", 1, "x v"),  # what follows an input and feeds nobody is read once, at the end
        ("get", 1, "fault"),
        ("get", 2, "V"),
        ("get", 2, "fault"),
        ("get", 3, "force energy"),
        ("get", 3, "fault"),
        ("set", 1, "a_g force"),
        ("set", 3, "x v V"),
        ("get", 1, "a hold"),
        ("get", 3, "force"),
    ]


def test_bingham_gets_the_holding_force_of_the_new_time() -> None:
    damper = node("damper", {**DAMPER.sources, "hold": (1, "hold")}, {"force": None, "fault": ()})
    found = calls(make_schedule([GROUND, STRUCTURE, VOLTAGE, damper], "gauss-seidel"))
    assert found.index(("get", 1, "x v hold")) < found.index(("set", 3, "x v V hold"))
    assert find_loop([GROUND, STRUCTURE, VOLTAGE, damper]) == []


def test_acceleration_fed_back_is_cut_where_the_order_closes_the_loop() -> None:
    damper = node(
        "damper",
        {**DAMPER.sources, "a": (1, "a")},
        {"force": ("x", "v", "V", "a"), "fault": ()},
    )
    nodes = [GROUND, STRUCTURE, VOLTAGE, damper]
    found = calls(make_schedule(nodes, "gauss-seidel"))
    # The damper takes the acceleration of the new state under the old force; the row shows the
    # acceleration under the new force, and the force that acted is not computed again.
    assert found.count(("step", 3)) == 1
    assert ("set", 3, "x v V a") in found
    assert found[-2:] == [("set", 1, "force"), ("get", 1, "a")]
    loop = find_loop(nodes)
    assert {port for _, port in loop} == {"a", "force"}
    assert loop[0] == loop[-1]


def test_inputs_that_nothing_follows_are_set_once_per_step() -> None:
    nodes = [node("late", {"u": (1, "y")}, {"x": ()}), node("source", {}, {"y": ()})]
    assert calls(make_schedule(nodes, "gauss-seidel")) == [
        ("set", 0, "u"),
        ("step", 0),
        ("get", 0, "x"),
        ("step", 1),
        ("get", 1, "y"),
    ]


def test_chain_against_the_order_is_refreshed_link_by_link() -> None:
    nodes = [
        node("c", {"u": (1, "y")}, {"y": ("u",)}),
        node("b", {"u": (2, "y")}, {"y": ("u",)}),
        node("a", {}, {"y": ()}),
    ]
    found = calls(make_schedule(nodes, "gauss-seidel"))
    assert found[-4:] == [("set", 1, "u"), ("get", 1, "y"), ("set", 0, "u"), ("get", 0, "y")]
    assert found[:2] == [("step", 0), ("step", 1)]  # everything was set at the last step's end


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_every_output_is_read_and_has_a_place(algorithm: str) -> None:
    schedule = make_schedule(LOOP, algorithm)
    read = {
        (o.component, n) for o in schedule.operations if isinstance(o, ReadOutputs) for n in o.names
    }
    written = {
        (o.component, n) for o in schedule.operations if isinstance(o, Write) for n in o.names
    }
    assert read == set(schedule.layout)
    assert len(schedule.layout) == len(read)
    assert written == {(c, name) for c, n in enumerate(LOOP) for name in n.sources}
