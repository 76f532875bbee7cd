"""Machine code is made in another process where it is not kept yet, and nothing waits in vain."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from bristle.core import jit
from bristle.identification import histories
from bristle.identification.histories import Ahead, begun
from bristle.physics.tuples import Inputs


def test_a_process_that_knows_other_functions_ends_without_compiling() -> None:
    found = Ahead("law_history", "that of a user's own law")
    found.wait()
    assert not found.at_work
    found.wait()  # whoever asks again compiles it


def test_where_no_process_can_be_begun_nothing_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(Path("there") / "is" / "none"))
    assert begun("law_history", "0") is None


def test_what_is_kept_is_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "kept", lambda _: True)
    monkeypatch.setattr(histories, "begun", lambda *_: pytest.fail("it begins a process"))
    histories.compile_ahead()


def test_strided_motions_take_the_same_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    law = histories.DamperForces("bingham", [])
    x, v, a, V = np.random.default_rng(3).normal(size=(50, 4)).T
    plain = law.force(x.copy(), v.copy(), a.copy(), V.copy(), 0.01, {})
    assert np.array_equal(law.force(x, v, a, V, 0.01, {}), plain)
    seen: list[Inputs] = []
    monkeypatch.setattr(law, "_history", lambda setup, motion, *_: seen.append(motion))
    law.force(x, v, a, V, 0.01, {})
    assert all(np.asarray(one).flags.c_contiguous for one in seen[0][:4])


@pytest.mark.slow  # two processes compile: the second reads
def test_another_process_keeps_what_fits_need(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path))
    monkeypatch.setattr(histories, "_ahead", {})
    histories.compile_ahead("lugre")
    histories._ahead["law_history"].wait()
    assert jit.kept(histories.law_history)
    assert not jit.kept(histories.force_history)
