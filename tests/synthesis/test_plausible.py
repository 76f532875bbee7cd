"""What looks unmeant in a design task is told, with a range that follows from the plant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bristle.cli import main
from bristle.component.controller_file import KINDS
from bristle.errors import DesignError
from bristle.physics.building import frequencies, paper_building
from bristle.synthesis import (
    DesignDamper,
    LqgWeights,
    Scheduling,
    Task,
    Weight,
    Weights,
    implausible,
)

FASTEST = frequencies(paper_building())[-1]
MILLION = 1e6


@pytest.mark.parametrize("kind", KINDS)
def test_the_reference_designs_are_plausible(kind: str) -> None:
    assert implausible(Task(kind)) == []


def test_a_sample_period_beyond_the_fastest_mode_is_told_and_a_nanosecond_refused() -> None:
    assert implausible(Task("hinf", sample_period=1.01e-3 / FASTEST)) == []
    (text,) = implausible(Task("hinf", sample_period=0.99e-3 / FASTEST))
    assert "fastest mode, 9 Hz; 0.00011 s or more is plausible" in text
    with pytest.raises(DesignError, match=r"too short.*0\.00011 to 0\.048 s is plausible"):
        Task("hinf", sample_period=1e-9)


@pytest.mark.parametrize(("top", "told"), [(0.3, 0), (0.99, 0), (1.01, 1), (0.019, 1), (19.0, 1)])
def test_a_grid_is_held_against_the_dampers_speed(top: float, told: int) -> None:
    grid = Scheduling(grid=(0.0, 0.5 * top, top), eps=0.002)
    found = implausible(Task("lpv", scheduling=grid))
    assert len(found) == told
    assert all("0.02 to 1 m/s is plausible" in text for text in found)


def test_a_grid_beyond_any_damper_is_refused() -> None:
    with pytest.raises(DesignError, match="up to 1 m/s is plausible"):
        Task("lpv", scheduling=Scheduling(grid=(0.0, 1e6)))
    Task("hinf", scheduling=Scheduling(grid=(0.0, 1e6)))  # which has no grid


def test_smoothing_beyond_the_grid_is_told() -> None:
    (text,) = implausible(Task("lpv", scheduling=Scheduling(eps=0.5)))
    assert "less than 0.01 m/s" in text


def larger(weight: Weight, factor: float) -> Weight:
    return Weight(tuple(factor * c for c in weight.numerator), weight.denominator)


@pytest.mark.parametrize("kind", ["hinf", "lpv"])
@pytest.mark.parametrize("factor", [MILLION, 1.0 / MILLION])
def test_weights_out_by_a_million_are_told(kind: str, factor: float) -> None:
    usual = Weights()
    for name in ("acceleration", "command"):
        weights = replace(usual, **{name: larger(getattr(usual, name), factor)})
        found = implausible(Task(kind, weights=weights))
        assert any(f"weight on the {name}" in text for text in found), name
        assert all("is plausible" in text for text in found)
    (text,) = implausible(Task(kind, weights=replace(usual, noise=factor * usual.noise)))
    assert "noise" in text


def test_weights_out_by_ten_are_not() -> None:
    usual = Weights()
    for factor in (0.1, 10.0):
        for name in ("acceleration", "command"):
            weights = replace(usual, **{name: larger(getattr(usual, name), factor)})
            assert implausible(Task("hinf", weights=weights)) == []


@pytest.mark.parametrize("factor", [MILLION**2, 1.0 / MILLION**2])
@pytest.mark.parametrize("name", ["force", "noise"])
def test_lqg_weights_that_cannot_be_meant_are_told(name: str, factor: float) -> None:
    weights = replace(LqgWeights(), **{name: factor * getattr(LqgWeights(), name)})
    (text,) = implausible(Task("lqg", lqg=weights))
    assert name in text


def test_ranges_follow_the_plant_and_not_its_unit_of_force() -> None:
    """A plant of a thousand times the mass with a weight per kilonewton is as plausible."""
    usual, building = Weights(), paper_building()
    heavy = building._replace(
        M=_times(building.M, 1e6), C=_times(building.C, 1e6), K=_times(building.K, 1e6)
    )
    weights = replace(usual, command=larger(usual.command, 1e-6))
    assert implausible(Task("hinf", building=heavy, weights=weights)) == []
    assert len(implausible(Task("hinf", building=heavy))) == 1


def _times(matrix: object, factor: float) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(factor * x for x in row) for row in matrix)  # type: ignore[attr-defined]


def test_a_slower_damper_has_a_shorter_grid() -> None:
    slow = DesignDamper(values={"v_n": 0.002})
    (text,) = implausible(Task("lpv", damper=slow))
    assert "0.002 to 0.1 m/s" in text


def test_the_command_warns_before_it_designs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    weight = "command = { gain = 2e6, zero = 15.0, pole = 50.0 }"
    Path("heavy.toml").write_text(f'schema = 1\nkind = "hinf"\n[weights]\n{weight}\n')
    main(["design", "hinf", "heavy.toml"])
    err = capsys.readouterr().err
    assert "warning: heavy.toml: weights: the weight on the command" in err
    Path("fast.toml").write_text('schema = 1\nkind = "hinf"\nsample_period = 1e-9\n')
    assert main(["design", "hinf", "fast.toml"]) == 2
    assert "is plausible" in capsys.readouterr().err
