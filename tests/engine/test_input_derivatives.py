"""Midpoint coupling by derivatives: what is called where an FMU takes them, and what it gives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_master_native import DESCRIPTION, compiled, pytestmark, scenario
from test_master_schedule import GROUND, LOOP, STRUCTURE, calls
from test_midpoint import STANDING, told

from bristle.component import HELD, LINEAR
from bristle.engine.run import IncompleteRunError, run
from bristle.engine.schedule import Node, make_schedule

__all__ = ["pytestmark"]  # this module is skipped where that one is

CLAIM = DESCRIPTION.replace("<CoSimulation", '<CoSimulation canInterpolateInputs="true"')
K = np.arange(11)


def able(node: Node, **over_step: str) -> Node:
    """Return a node that takes derivatives; `over_step` as bristle's FMUs say it, or nothing."""
    inputs = {name: {"over_step": word} for name, word in over_step.items()}
    return replace(told(node, **inputs), interpolates=frozenset(node.inputs))


OURS = [
    GROUND, able(STRUCTURE, a_g=LINEAR, force=HELD), STANDING,
    able(LOOP[3], x=HELD, v=HELD, V=HELD),
]  # fmt: skip


def of(found: list[tuple[object, ...]], component: int) -> list[tuple[object, ...]]:
    return [one for one in found if one[1] == component and one[0] != "keep"]


def test_derivatives_alone_move_the_inputs_of_a_damper_of_ours() -> None:
    found = of(calls(make_schedule(OURS, "midpoint")), 3)
    assert found == [
        ("set if changed", 3, "V"),
        ("ramp", 3, "x v"),
        ("step", 3),
        ("get", 3, "force energy"),
        ("get", 3, "fault"),
    ]


def test_where_a_value_is_set_in_every_step_the_middle_is_given_with_it() -> None:
    found = of(calls(make_schedule(OURS, "midpoint")), 1)
    assert found[0] == ("set", 1, "a_g:newest force:ahead")
    assert not [one for one in found if one[0] == "ramp"]


def test_a_damper_that_steps_first_is_told_ahead_by_its_derivatives() -> None:
    # Components in another order: voltage, damper, ground, structure.
    damper = replace(OURS[3], sources={"x": (3, "x"), "v": (3, "v"), "V": (0, "V")})
    structure = replace(OURS[1], sources={"a_g": (2, "a_g"), "force": (1, "force")})
    nodes = [STANDING, damper, GROUND, structure]
    found = of(calls(make_schedule(nodes, "midpoint")), 1)
    assert found[:4] == [
        ("set if changed", 1, "V"), ("ramp", 1, "x v"), ("step", 1),
        ("get", 1, "force energy"),
    ]  # fmt: skip
    assert ("set", 1, "v x") in found[4:]  # the row's own, before what follows them is read


def test_the_values_that_a_rollback_repeats_are_the_middle() -> None:
    found = calls(make_schedule(OURS, "midpoint-iterated"))
    assert not [one for one in found if one[0] == "ramp"]


def test_without_midpoint_nothing_is_said_of_derivatives() -> None:
    for algorithm in ("gauss-seidel", "jacobi"):
        assert not [one for one in calls(make_schedule(OURS, algorithm)) if one[0] == "ramp"]


def test_a_foreign_fmu_gets_value_and_derivative_and_no_value_behind_the_step() -> None:
    nodes = [*LOOP[:2], STANDING, able(LOOP[3])]
    for algorithm, last in (("midpoint", 1), ("midpoint-iterated", 2)):
        found = of(calls(make_schedule(nodes, algorithm)), 3)
        ramps = [i for i, one in enumerate(found) if one[0] == "ramp"]
        assert len(ramps) == last
        for i in ramps:
            assert "x:past v:past" in str(found[i - 1])
            assert found[i : i + 2] == [("ramp", 3, "x v"), ("step", 3)]
            assert found[i + 2][0] == "get"


def test_an_fmu_that_interpolates_follows_its_input_over_the_step(tmp_path: Path) -> None:
    plain = compiled(tmp_path, DESCRIPTION)
    second = compiled(tmp_path / "second", CLAIM, "-DINTERPOLATES")
    file = scenario(plain, tmp_path, second=second, algorithm="midpoint")
    frame = run(file)  # one.y = k, so u = t / 0.1 over the steps: a line
    assert frame["two.y"].to_numpy() == pytest.approx(K**3 / 3)
    assert frame["two.twice"].to_numpy() == pytest.approx(2 * K)
    held = scenario(
        plain, tmp_path, second=second, algorithm="midpoint", more='over_step = { u = "held" }'
    )
    assert run(held)["two.y"].to_numpy() == pytest.approx(K**3 / 3 - K / 12)  # of the middles
    for algorithm, mean in (("gauss-seidel", K * (K + 1) * (2 * K + 1) / 6),):
        file = scenario(plain, tmp_path, second=second, algorithm=algorithm)
        assert run(file)["two.y"].to_numpy() == pytest.approx(mean)


def test_a_unit_that_is_converted_scales_the_derivative_alone(tmp_path: Path) -> None:
    plain = compiled(tmp_path, DESCRIPTION)
    second = compiled(tmp_path / "second", CLAIM, "-DINTERPOLATES")
    file = scenario(plain, tmp_path, second=second, algorithm="midpoint")
    wire = '"two.u" = { from = "one.y", factor = 2.0, offset = 1.0 }'
    file.write_text(file.read_text().replace('"two.u" = "one.y"', wire))
    wanted = ((2 * K + 1.0) ** 3 - 1.0) / 6  # the integral of (2 k + 1)^2
    assert run(file)["two.y"].to_numpy() == pytest.approx(wanted)


def test_a_claim_that_is_not_kept_is_told_with_what_to_do(tmp_path: Path) -> None:
    plain = compiled(tmp_path, DESCRIPTION)
    second = compiled(tmp_path / "second", CLAIM)
    file = scenario(plain, tmp_path, second=second, algorithm="midpoint")
    with pytest.raises(IncompleteRunError, match="derivatives of its inputs answered Error") as why:
        run(file)
    assert 'over_step = { u = "held" } in [components.two]' in str(why.value)
