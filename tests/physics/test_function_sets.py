"""A class of a user's own has functions of its own: those of the library stay as they are."""

from __future__ import annotations

from collections.abc import Iterator
from types import FunctionType

import numpy as np
import pytest

from bristle.core.jit import compiled, digest
from bristle.engine import time_loop
from bristle.engine.coupled import linked
from bristle.identification import histories
from bristle.identification.histories import DamperForces, force_history
from bristle.physics import damper
from bristle.physics.effect import EFFECTS, Effect
from bristle.physics.generate import Link
from bristle.physics.law import LAWS
from bristle.physics.parameter import Parameter

T = 0.002 * np.arange(150)
MOTION = 0.01 * np.sin(9.0 * T), 0.09 * np.cos(9.0 * T), -0.81 * np.sin(9.0 * T), 4.0 + 0.0 * T


def leak() -> type[Effect]:
    class Leak(Effect):
        """Leak: a dashpot that weakens with travel. Leaves out the leaked fluid's own friction."""

        name = "leak"
        needs = ("x", "v")
        source = "made for this test, 2026"
        expect = "a force in phase with velocity at any voltage"
        parameters = {"c": Parameter(20.0, "N.s/m", (0.0, 1e4), "damping")}  # noqa: RUF012

        @staticmethod
        def force(q, z, p):  # type: ignore[no-untyped-def]
            return p.c * q.v / (1.0 + abs(q.x) / 0.01)

    return Leak


@pytest.fixture
def own() -> Iterator[type[Effect]]:
    found = leak()
    yield found
    EFFECTS.pop(found.name, None)


def test_the_library_and_its_machine_code_stay_as_they_are(own: type[Effect]) -> None:
    before = digest(force_history)
    functions = damper.functions_of("lugre", ["leak", "stribeck"])
    assert functions.slots.laws == (LAWS["lugre"],)
    assert functions.slots.effects == (own, EFFECTS["stribeck"])
    assert own not in damper.LIBRARY.slots.effects
    assert damper.functions_of("lugre", ["stribeck"]) is damper.LIBRARY
    assert digest(force_history) == before != digest(functions.link(force_history))
    assert damper.LIBRARY.link(force_history) is force_history


def test_one_set_of_everything_serves_a_diagnosis(
    own: type[Effect], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(histories, "begun", lambda *_: None)
    histories.compile_ahead()
    functions = [damper.functions_of(law, ["leak"]) for law in ("bingham", "lugre")]
    functions.append(damper.functions_of("lugre", ["leak", "gas_spring"]))
    assert len(set(functions)) == 1
    assert damper.functions_of("lugre", ["gas_spring"]) is damper.LIBRARY


def test_what_is_linked_calls_its_set_and_leaves_the_rest(own: type[Effect]) -> None:
    functions = damper.functions_of("bingham", ["leak"])
    step = functions.link(damper.step)
    assert functions.link(damper.step) is step
    assert step.__globals__["evaluate"] is functions.made["evaluate"]
    assert step.__globals__["without_time"] is damper.step.__globals__["without_time"]
    assert damper.step.__globals__["evaluate"] is damper.evaluate
    assert Link({"nothing": 1})(damper.step) is damper.step


def test_controllers_invert_laws_of_the_library_beside_any_damper(own: type[Effect]) -> None:
    loop = linked(damper.functions_of("bingham", ["leak"]))(time_loop.integrate)
    assert isinstance(loop, FunctionType)
    assert loop is not time_loop.integrate
    assert loop.__globals__["sample"].__globals__["take_command"] is time_loop.take_command


def test_of_equal_classes_what_is_compiled_is_one(own: type[Effect]) -> None:
    again = leak()  # as a file that is read anew defines it
    assert again is not own
    link = damper.functions_of("bingham", ["leak"]).link
    assert compiled(link(damper.step)) is compiled(
        damper.SETS.of(LAWS["bingham"], own).link(damper.step)
    )


@pytest.mark.slow  # 4 s to compile: by default an own law is (test_user_laws.py)
def test_compiled_and_in_python_it_gives_the_same(
    own: type[Effect], monkeypatch: pytest.MonkeyPatch
) -> None:
    fast = DamperForces("bingham", ["leak"]).force(*MOTION, 0.002, {})
    monkeypatch.setenv("BRISTLE_JIT", "off")
    plain = DamperForces("bingham", ["leak"])
    assert compiled(damper.step) is damper.step
    assert plain.force(*MOTION, 0.002, {}) == pytest.approx(fast, rel=1e-12)
