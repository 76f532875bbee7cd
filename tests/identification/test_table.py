"""The table of laws: the filter, the order of the laws, the standard ones."""

from __future__ import annotations

import numpy as np
import pytest

from bristle.errors import RecordError
from bristle.identification import error_table
from bristle.identification.error_table import error_table as error_table_error_table
from bristle.identification.error_table import low_pass
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run, suited
from bristle.physics.laws import law_names

DT, N = 0.004, 3000
T = np.arange(N) * DT


def problem(law, values, seed=0, noise=0.01):
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.5, 5.0, 8)
    angle = w[:, None] * T + random.uniform(0.0, 6.0, 8)[:, None]
    size = 0.02 / w
    x, v, a = size @ np.sin(angle), (size * w) @ np.cos(angle), -(size * w**2) @ np.sin(angle)
    V = 2.5 * (1.0 + np.sin(4.0 * np.pi * T))
    force = DamperForces(law, []).force(x, v, a, V, DT, values)
    sigma = noise * float(np.std(force))
    force = force + sigma * random.standard_normal(N)
    return Problem([Run("run", DT, x, v, a, V, force, sigma, np.zeros((0, N, 4)))])


def test_the_filter_has_no_phase_and_halves_the_power_twice_at_its_cut_off():
    slow, fast = (np.sin(2.0 * np.pi * f * T) for f in (5.0, 60.0))
    inner = slice(N // 4, -N // 4)
    assert low_pass(slow, DT)[inner] == pytest.approx(slow[inner], abs=1e-4)
    assert np.max(np.abs(low_pass(fast, DT)[inner])) < 1e-3
    at = low_pass(np.sin(2.0 * np.pi * 18.0 * T), DT)[inner]
    assert np.max(np.abs(at)) == pytest.approx(0.5, rel=0.01)  # 1/sqrt(2), forth and back
    assert np.array_equal(low_pass(fast, DT, 0.0), fast)
    with pytest.raises(RecordError, match="cut-off"):
        low_pass(fast, DT, -1.0)


@pytest.mark.parametrize("law", ["bingham", "lugre"])
def test_searches_on_a_part_of_the_samples_end_where_those_on_all_do(law, monkeypatch):
    train, held = problem(law, {}, 1), problem(law, {}, 2)
    laws = (law, f"{law}_standard", "dahl")
    asked = {"cutoff": 5.0, "laws": laws, "starts": 2}
    whole = error_table_error_table(train, held, **asked)
    monkeypatch.setattr(error_table, "ENOUGH", 500)  # of 3000, every sixth is kept
    assert len(error_table._thinned(train, 5.0).runs[0].force) == N // 6
    for one, other in zip(error_table_error_table(train, held, **asked), whole, strict=True):
        assert one.train == pytest.approx(other.train, rel=1e-3)
        assert one.holdout == pytest.approx(other.holdout, rel=5e-3)
        assert one.starts == other.starts


def test_few_samples_and_a_force_without_a_filter_are_kept_whole():
    made = problem("bingham", {}, 1)
    assert error_table._thinned(made, 18.0) is made
    assert error_table._thinned(made, 0.0) is made


def test_the_law_that_made_the_data_has_the_least_error():
    train, held = problem("lugre", {}, 1), problem("lugre", {}, 2)
    rows = {row.law: row for row in error_table_error_table(train, held, starts=2)}
    assert tuple(rows) == suited(train, law_names())
    assert set(law_names()) - set(rows) == {
        "fluid_viscous", "friction_damper", "isolator", "shock_absorber",
    }  # fmt: skip
    assert min(rows.values(), key=lambda row: row.holdout).law == "lugre"
    assert rows["lugre"].share < 0.01
    assert rows["lugre"].model.values["a_0"] == pytest.approx(500.0, rel=0.02)
    for law in ("bingham", "lugre"):
        assert rows[f"{law}_standard"].holdout > rows[law].holdout
        assert rows[f"{law}_standard"].model.values["exponent"] == 0.0


def test_a_standard_law_gains_nothing_from_the_exponential():
    values = {"exponent": 0.0}
    rows = {
        row.law: row
        for row in error_table_error_table(
            problem("bingham", values, 3), None, laws=("bingham", "bingham_standard")
        )
    }
    assert rows["bingham"].train == pytest.approx(rows["bingham_standard"].train, rel=0.05)
    assert rows["bingham_standard"].model.values["c_0"] == pytest.approx(100.0, rel=0.02)
    assert np.isnan(rows["bingham"].holdout)
    assert rows["bingham"].as_dict()["holdout"] is None
