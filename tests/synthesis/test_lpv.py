"""LPV designs: the table of gammas, reconstruction, the table over speed, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg

from bristle.component.controller_file import Controller
from bristle.errors import DesignError
from bristle.synthesis import DesignDamper, DesignResult, Scheduling, Task, design, lmi
from bristle.synthesis.analysis import least_gamma, responses
from bristle.synthesis.damper import reconstruct
from bristle.synthesis.kinds import gammas, plants_at, units_for
from bristle.synthesis.plant import balancing

FINE = (0.0, 0.0025, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.15, 0.3)

# varies, rate [m/s2], published gamma
TAU_1 = [("none", 1.0, 8.0619), ("X", 1.0, 8.0619), ("Y", 1.0, 6.6281), ("Y", 10.0, 7.5188)]
TAU_2 = [("none", 1.0, 8.6910), ("X", 1.0, 8.3745), ("Y", 1.0, 7.8475)]


@pytest.mark.slow  # 4 to 8 s each, a design a row: the reference design has its gamma by default
@pytest.mark.parametrize(("tau", "published"), [(1.0, TAU_1), (2.0, TAU_2)], ids=["1", "2"])
def test_table_of_gammas(tau: float, published: list[tuple[str, float, float]]) -> None:
    rows = gammas(Task("lpv", tau=tau), [(varies, rate) for varies, rate, _ in published])
    for row, (varies, rate, gamma) in zip(rows, published, strict=True):
        assert (row["varies"], row["rate"]) == (varies, rate)
        assert row["gamma"] == pytest.approx(gamma, rel=1e-3 if varies == "none" else 1e-2)


@pytest.mark.slow  # a dozen designs
def test_more_freedom_never_costs_gamma() -> None:
    found = gammas(Task("lpv"), [("both", 1.0), ("Y", 1.0), ("Y", 10.0), ("none", 1.0)])
    values = [row["gamma"] for row in found]
    assert values == sorted(values)
    assert values[0] < 0.9 * values[-1]


def test_a_finer_grid() -> None:
    task = Task("lpv", scheduling=Scheduling(FINE, balance_at=0.08))
    assert gammas(task, [("none", 1.0)])[0]["gamma"] == pytest.approx(8.695, rel=1e-3)


def test_reference_design(lpv: DesignResult) -> None:
    facts = lpv.facts
    assert facts["gamma"] == pytest.approx(8.6910, rel=1e-3)
    # Matrices of a solver are not unique; published norms are one solver's.
    published = [6.499, 4.723, 4.284, 4.524, 6.087, 7.318, 8.055]
    assert facts["norms"] == pytest.approx(published, rel=0.01)
    assert facts["fastest_pole"] == pytest.approx(246.0, rel=0.03)
    assert facts["largest_real_part"] == pytest.approx(-2.76, rel=0.03)
    assert max(facts["row_norms"]) < facts["gamma"]
    assert facts["sampled_loop_modulus"] < 1.0


def test_the_bound_is_proved_at_the_grid_and_not_all_between(lpv: DesignResult) -> None:
    solution = lpv.solution
    assert solution is not None
    grid = np.array(lpv.task.scheduling.grid)
    plants = plants_at(lpv.task, grid)
    middle = plants[lpv.task.scheduling.middle]
    units = units_for(middle, least_gamma(middle, 1e-3))
    states = balancing(units.normalised(middle), lpv.task.order)
    scaled = [units.normalised(plant).transformed(states) for plant in plants]
    worst, entry = lmi.eigenvalues(solution, scaled, grid, solution.gamma)
    assert np.all(worst <= lmi.ROUNDING * entry)
    assert lpv.facts["largest_eigenvalue"] > 0.1
    assert lpv.facts["largest_eigenvalue_at"] < 0.01
    assert 0.5 < lpv.facts["share_proved"] < 1.0


def test_closed_loop_dissipates_at_the_grid(lpv: DesignResult) -> None:
    """The matrices X, Y of the solution make a Lyapunov function of the reconstructed loop."""
    solution = lpv.solution
    assert solution is not None
    grid = np.array(lpv.task.scheduling.grid)
    plants = plants_at(lpv.task, grid)
    middle = plants[lpv.task.scheduling.middle]
    units = units_for(middle, least_gamma(middle, 1e-3))
    states = balancing(units.normalised(middle), lpv.task.order)
    scaled = [units.normalised(plant).transformed(states) for plant in plants]
    bank = reconstruct(solution, scaled, grid, units)
    X, Y = solution.X0, solution.Y0
    n = len(X)
    # P = [[X, N], [N^T, .]] with N M^T = I - X Y and M = Y: P [Y; M^T] = [I; 0].
    N = np.linalg.inv(Y) - X
    corner = -N.T @ Y @ np.linalg.inv(Y.T)
    P = np.block([[X, N], [N.T, corner]])
    assert np.linalg.eigvalsh(P)[0] > 0.0
    for k, plant in enumerate(scaled):
        K = bank.at(k)._replace(
            B=bank.B[k] * units.measurement, C=bank.C[k] * units.command
        )  # in the units of the solution
        A, B, C, _ = plant.closed_loop(K)
        bound = np.block(
            [
                [A.T @ P + P @ A, P @ B, C.T],
                [B.T @ P, -solution.gamma * np.eye(2), np.zeros((2, 2))],
                [C, np.zeros((2, 2)), -solution.gamma * np.eye(2)],
            ]
        )
        values = np.linalg.eigvalsh(bound)
        assert values[-1] <= 1e-7 * -values[0]
        assert len(A) == 2 * n


@pytest.mark.parametrize("varies", ["X", pytest.param("Y", marks=pytest.mark.slow)])  # a design
def test_a_varying_pair_gives_a_controller_without_the_rate(varies: str, lpv: DesignResult) -> None:
    result = design(Task("lpv", scheduling=Scheduling(varies=varies, rows=61)))
    facts = result.facts
    assert facts["gamma"] < lpv.facts["gamma"]
    assert max(facts["norms"]) <= facts["gamma"] * 1.001
    assert max(facts["row_norms"]) <= facts["gamma"] * 1.001
    assert facts["largest_real_part"] < 0.0


def row_matrices(c: Controller, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    n = c.n
    A = np.array(c.A[row * n * n : (row + 1) * n * n]).reshape(n, n)
    B, W, C = (np.array(flat[row * n : (row + 1) * n]) for flat in (c.B, c.W, c.C))
    return A, B, W, C


@pytest.mark.parametrize("row", [0, 7, 160, 600])
def test_each_row_is_its_controller_sampled_exactly(lpv: DesignResult, row: int) -> None:
    c, K = lpv.controller, lpv.bank.at(row)
    assert lpv.speeds[row] == pytest.approx(row * 0.0005)
    A, B, W, C = row_matrices(c, row)
    exact = linalg.expm(K.A * c.sample_period)
    held = np.linalg.solve(K.A, exact - np.eye(c.n))
    assert pytest.approx(exact, rel=1e-8, abs=1e-10) == A
    assert pytest.approx((held @ K.B)[:, 0], rel=1e-7, abs=1e-9) == B
    assert pytest.approx((held @ lpv.bank.W[row])[:, 0], rel=1e-7, abs=1e-9) == W
    assert pytest.approx(K.C[0], rel=1e-10) == C


def test_rows_change_little_from_one_to_the_next(lpv: DesignResult) -> None:
    A = np.array(lpv.controller.A).reshape(601, 8, 8)
    steps = np.abs(np.diff(A, axis=0)).max(axis=(1, 2))
    assert steps.max() < 0.02


def test_responses_at_a_row(lpv: DesignResult) -> None:
    omega = np.geomspace(1.0, 300.0, 4000)
    found = responses(lpv, omega, row=600)
    assert found["closed_loop"].max() == pytest.approx(lpv.facts["norms"][-1], rel=1e-3)
    assert found["open_loop"].max() == pytest.approx(22.187, rel=1e-2)


def test_both_varying_is_refused_as_a_controller() -> None:
    with pytest.raises(DesignError, match="rate of the speed"):
        design(Task("lpv", scheduling=Scheduling(varies="both")))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"grid": (0.0,)}, "no range"),
        ({"grid": ()}, "no range"),
        ({"grid": (0.0, 0.2, 0.1)}, "must rise"),
        ({"grid": (0.0, 0.1, 0.1)}, "must rise"),
        ({"grid": (0.0, float("nan"))}, "must rise"),
        ({"grid": (0.01, 0.1)}, "begin at 0"),
        ({"grid": (-0.1, 0.1)}, "begin at 0"),
        ({"varies": "Z"}, "varies"),
        ({"rate": 0.0}, "rate"),
        ({"eps": 0.0}, "eps"),
        ({"rows": 1}, "rows"),
        ({"balance_at": 0.1}, "balance_at"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        Scheduling(**wrong)  # type: ignore[arg-type]


def test_a_grid_beyond_the_dampers_data_is_refused() -> None:
    with pytest.raises(DesignError, match=r"beyond the 0\.2 m/s"):
        Task("lpv", damper=DesignDamper(known_to=0.2))
    Task("hinf", damper=DesignDamper(known_to=0.2))  # which has no grid


def test_a_damper_without_authority_is_refused() -> None:
    damper = DesignDamper(values={"f_v": 0.0, "c_v": 0.0})
    with pytest.raises(DesignError, match="voltage has no effect on the force"):
        design(Task("lpv", damper=damper))


def test_the_default_balance_is_the_published_one() -> None:
    scheduling = Scheduling()
    assert scheduling.grid[scheduling.middle] == 0.08
    assert replace(scheduling, balance_at=0.02).middle == 2
