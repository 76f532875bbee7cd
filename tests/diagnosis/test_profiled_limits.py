"""A limit by the profile of the likelihood is that of a fit at every size."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bristle.diagnosis.effect_limits import EffectLimit, limit_of, profiled
from bristle.diagnosis.effect_size import Sized, SizeSearch
from bristle.identification.problem import Problem, Run
from bristle.identification.start_grid import refine
from bristle.model.model import Model

TRUE = Model("bingham", values={"f_c": 5.0, "c_0": 20.0, "v_n": 100.0}, fixed=("f_v", "c_v", "v_n"))


@pytest.fixture(scope="module")
def known() -> SizeSearch:
    return known_with(TRUE, 0.0)


def known_with(other: Model, share: float) -> SizeSearch:
    """Return what limits are found with, for runs that have a share of what `other` has more."""
    rng = np.random.default_rng(3)
    runs = []
    for k, f in enumerate((1.0, 2.3)):
        t = np.arange(1500) * 0.004
        x = 0.01 * np.sin(2.0 * np.pi * f * t) * (0.4 + 0.6 * np.sin(0.9 * t) ** 2)
        v = np.gradient(x, t)
        one = Run(
            f"run_{k}", 0.004, x, v, np.gradient(v, t), np.zeros_like(t), np.zeros_like(t), 0.2,
            np.zeros((2, len(t), 4)),
        )  # fmt: skip
        problem = Problem([one])
        force, more = problem.predict(TRUE, one), problem.predict(other, one)
        force = force + share * (more - force) + 0.2 * rng.standard_normal(len(t))
        runs.append(replace(one, force=force))
    problem = Problem(runs)
    model = refine(TRUE, problem)
    return SizeSearch(problem, model, problem.expectation(model), 1500)


def test_where_all_is_linear_the_profile_agrees(known: SizeSearch) -> None:
    limit = limit_of(Sized("gas_spring", known))
    (found,) = profiled(known, [limit])
    assert found.profiled
    assert not limit.profiled
    assert found.largest == pytest.approx(limit.largest, rel=0.15)


@pytest.mark.parametrize(
    ("effect", "amount", "share"),
    [
        ("gas_spring", {"k": 0.4}, -1.0),
        ("gas_spring", {"k": 0.4}, 2.0),
        ("asymmetry", {"ratio": 0.002}, -2.0),
        ("asymmetry", {"ratio": 0.002}, 2.0),
    ],
)
def test_the_profile_agrees_on_either_side_of_none(
    effect: str, amount: dict[str, float], share: float
) -> None:
    values = {f"{effect}.{name}": value for name, value in amount.items()}
    other = replace(TRUE, effects=(effect,), values={**TRUE.values, **values})
    there = known_with(other, share)
    limit = limit_of(Sized(effect, there))
    (found,) = profiled(there, [limit])
    assert found.largest == pytest.approx(limit.largest, rel=0.1)


def test_a_limit_that_is_wrong_is_moved_to_where_it_belongs(known: SizeSearch) -> None:
    limit = limit_of(Sized("gas_spring", known))
    assert limit.largest is not None
    assert limit.share is not None
    wrong = EffectLimit(
        "gas_spring", "k", "N/m", largest=3.0 * limit.largest, share=3.0 * limit.share
    )
    (found,) = profiled(known, [wrong])
    assert found.largest == pytest.approx(limit.largest, rel=0.15)
    assert found.share == pytest.approx(limit.share, rel=0.15)
    assert dict(found.moved) == pytest.approx(dict(limit.moved), rel=0.2)


def test_what_is_named_is_no_less_than_a_limit_that_was_moved(known: SizeSearch) -> None:
    limit = limit_of(Sized("gas_spring", known))
    assert limit.largest is not None
    less = replace(limit, named=0.1 * limit.largest, named_share=1e-9)
    (found,) = profiled(known, [less])
    assert (found.named, found.named_share) == (found.largest, found.share)


def test_what_has_no_size_stays_as_it_is(known: SizeSearch) -> None:
    hidden = EffectLimit("coil_lag", why="the command is constant")
    coarse = EffectLimit("backlash", "gap", "m", largest=1e-6, coarse=True)
    assert profiled(known, [hidden, coarse]) == (hidden, coarse)


def test_the_command_asks_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from bristle.cli import main
    from bristle.study import steps as learning

    asked: dict[str, object] = {}

    def stop(*_given: object, **options: object) -> None:
        asked.update(options)
        raise KeyboardInterrupt

    monkeypatch.setattr(learning, "diagnose_study", stop)
    monkeypatch.setattr("bristle.study.study.Study", lambda folder: folder)
    assert main(["diagnose", str(tmp_path), "--limits"]) == 130
    assert asked["profile"] is True
