"""H-infinity and LQG designs: published numbers, independent checks, refusals."""

from __future__ import annotations

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest
from scipy import linalg

from bristle.component.controller_file import parse_controller
from bristle.errors import DesignError
from bristle.physics.building import Building, from_data, paper_building
from bristle.synthesis import (
    DesignDamper,
    DesignResult,
    LqgWeights,
    Task,
    Weight,
    Weights,
    analysis,
    design,
    lmi,
)
from bristle.synthesis.analysis import hinf_norm, responses
from bristle.synthesis.damper import Bank, sampled
from bristle.synthesis.plant import Plant, balancing, generalized, structure

STILL = np.zeros(1)


@pytest.fixture(scope="module")
def balanced() -> Plant:
    plant = generalized(paper_building(), Weights())
    return plant.transformed(balancing(plant))


@pytest.mark.parametrize(("tau", "gamma"), [(1.0, 4.90232), (1.2, 5.0139), (1.5, 5.2899)])
def test_gamma_of_the_inequalities(balanced: Plant, tau: float, gamma: float) -> None:
    solution = lmi.solve([balanced], STILL, tau)
    assert solution.gamma == pytest.approx(gamma, rel=1e-3)


@pytest.mark.parametrize(
    ("tau", "gamma", "norm"), [(1.5, 5.2899, 5.2533), (2.0, 6.0124, 5.7210), (3.0, 7.9817, 6.3619)]
)
def test_gamma_and_norm(tau: float, gamma: float, norm: float, hinf: DesignResult) -> None:
    facts = hinf.facts if tau == 2.0 else design(Task("hinf", tau=tau)).facts
    assert facts["gamma"] == pytest.approx(gamma, rel=1e-3)
    assert facts["norm"] == pytest.approx(norm, rel=1e-3)
    assert facts["least_gamma"] == pytest.approx(4.90007, rel=1e-5)
    assert facts["open_loop_norm"] == pytest.approx(62.5639, rel=1e-5)


def test_controller_of_the_reference_design(hinf: DesignResult) -> None:
    K = hinf.bank.at(0)
    published = {0.0: 3.096, 13.195: -0.329 - 1.593j, 34.43: 0.009 + 0.227j}
    for omega, value in published.items():
        response = K.C @ np.linalg.solve(1j * omega * np.eye(len(K.A)) - K.A, K.B)
        assert response[0, 0] == pytest.approx(value, abs=0.005)
    poles = sorted((p for p in hinf.bank.poles[0] if p.imag > 0.0), key=abs)
    published_poles = [-11.47 + 0.98j, -28.97 + 19.12j, -5.08 + 59.93j, -25.68 + 74.39j]
    for pole, other in zip(poles, published_poles, strict=True):
        assert abs(pole - other) < 0.02 * abs(other)


def test_the_closed_loop_norm_is_that_of_its_frequency_response(hinf: DesignResult) -> None:
    omega = np.geomspace(0.1, 1e3, 20_000)
    found = responses(hinf, omega)
    assert found["closed_loop"].max() == pytest.approx(hinf.facts["norm"], rel=1e-4)
    assert found["open_loop"].max() == pytest.approx(62.56, rel=5e-3)
    assert np.all(found["acceleration_closed"] < found["acceleration_bound"])
    assert np.all(found["command"] < found["command_bound"])
    assert found["acceleration_closed"].max() < 0.2 * found["acceleration_open"].max()


def test_discretisation_is_exact(hinf: DesignResult) -> None:
    K, W, c = hinf.bank.at(0), hinf.bank.W[0], hinf.controller
    n, h = c.n, c.sample_period
    rng = np.random.default_rng(3)
    x0, y, w = rng.normal(size=n), 0.7, -1.3
    # Variation of constants by quadrature, not by the block exponential of the design.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    x1 = linalg.expm(K.A * h) @ x0
    for node, weight in zip(nodes, weights, strict=True):
        rest = 0.5 * h * (1.0 - node)
        x1 = x1 + 0.5 * h * weight * linalg.expm(K.A * rest) @ (K.B[:, 0] * y + W[:, 0] * w)
    A = np.array(c.A).reshape(n, n)
    assert A @ x0 + np.array(c.B) * y + np.array(c.W) * w == pytest.approx(x1, rel=1e-9, abs=1e-12)
    assert np.array(c.C) == pytest.approx(K.C[0], rel=1e-11)


def test_anti_windup_moves_the_command_by_what_it_is_fed(hinf: DesignResult) -> None:
    assert (hinf.bank.C @ hinf.bank.W)[0, 0, 0] == pytest.approx(1.0, rel=1e-9)


def test_a_bank_with_a_silent_controller_is_sampled() -> None:
    silent = Bank(-np.ones((1, 1, 1)), np.ones((1, 1, 1)), np.zeros((1, 1, 1)), np.zeros((1, 1, 1)))
    assert sampled(silent, 0.1).A[0, 0, 0] == pytest.approx(np.exp(-0.1))


def test_a_design_comes_back_from_its_file(hinf: DesignResult) -> None:
    assert parse_controller(hinf.controller.text()) == hinf.controller
    hinf.controller.check_building(paper_building())
    assert hinf.controller.design["tau"] == 2.0


@pytest.mark.parametrize(("tau", "message"), [(1.0, "unstable|too fast"), (1.2, "unstable")])
def test_an_unusable_controller_is_refused(tau: float, message: str) -> None:
    with pytest.raises(DesignError, match=message):
        design(Task("hinf", tau=tau))


def test_a_controller_too_fast_for_its_samples_is_refused() -> None:
    with pytest.raises(DesignError, match="too fast"):
        design(Task("hinf", sample_period=0.02))


@pytest.mark.parametrize("h", [0.0, -0.002, float("nan"), float("inf"), 0.05, 1.0])
def test_a_sample_period_that_cannot_work_is_refused(h: float) -> None:
    with pytest.raises(DesignError, match="sample_period"):
        Task("hinf", sample_period=h)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"kind": "pid"}, "kind"),
        ({"kind": "hinf", "tau": 0.5}, "tau"),
        ({"kind": "hinf", "order": 0}, "order"),
        ({"kind": "hinf", "order": 9}, "order"),
    ],
)
def test_a_task_that_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        Task(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"law": "maxwell"}, "law"),
        ({"v_max": 0.0}, "v_max"),
        ({"v_max": float("nan")}, "v_max"),
        ({"values": {"f_d": 1.0}}, "f_d.*Did you mean"),
        ({"values": {"f_c": -1.0}}, "outside"),
        ({"effects": ("gas_sprig",)}, "gas_spring"),
        ({"known_to": 0.0}, "known_to"),
    ],
)
def test_a_damper_that_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        DesignDamper(**wrong)  # type: ignore[arg-type]


def scaled_building(factor: float) -> Building:
    paper = paper_building()
    M, C, K = ([[factor * v for v in row] for row in matrix] for matrix in paper[1:4])
    return from_data({"schema": 1, "M": M, "C": C, "K": K})


def test_the_unit_of_force_does_not_matter() -> None:
    weights = Weights(command=Weight.lead(2e-6, 15.0, 50.0))
    facts = design(Task("hinf", building=scaled_building(1e6), weights=weights)).facts
    assert facts["gamma"] == pytest.approx(6.0124, rel=1e-3)
    assert facts["norm"] == pytest.approx(5.7210, rel=1e-3)


def test_a_direct_path_from_force_to_floor_is_taken_out() -> None:
    paper = paper_building()
    M = [list(row) for row in paper.M]
    M[0][2] = M[2][0] = 0.3
    C, K = [list(row) for row in paper.C], [list(row) for row in paper.K]
    building = from_data({"schema": 1, "M": M, "C": C, "K": K})
    facts = design(Task("hinf", building=building)).facts
    assert facts["norm"] < facts["gamma"] < 0.2 * facts["open_loop_norm"]


def test_fewer_states_still_damp_a_taller_building() -> None:
    data = {
        "schema": 1,
        "masses": [1.0] * 6,
        "stiffnesses": [2000.0] * 6,
        "damping_ratio": 0.01,
        "base": "fixed",
    }
    weights = Weights(Weight.low_pass(1.5, 10.0))
    task = Task("hinf", building=from_data(data), weights=weights, tau=1.5, order=8)
    result = design(task)
    assert result.controller.n == 8
    loop = result.plants[0].closed_loop(result.bank.at(0))
    assert len(loop.A) == 14 + 8
    assert hinf_norm(loop) == pytest.approx(result.facts["norm"], rel=1e-5)
    assert result.facts["norm"] < 0.7 * result.facts["open_loop_norm"]


def test_solver_failure_says_so(balanced: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: object, **_: object) -> None:
        raise cp.error.SolverError("it broke down")

    monkeypatch.setattr(cp.Problem, "solve", fail)
    with pytest.raises(DesignError, match="CLARABEL failed: it broke down"):
        lmi.solve([balanced], STILL, 2.0)


def test_no_solution_says_so(balanced: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cp.Problem, "solve", lambda self, **_: None)
    monkeypatch.setattr(cp.Problem, "status", "infeasible")
    with pytest.raises(DesignError, match="infeasible"):
        lmi.solve([balanced], STILL, 2.0)


def test_a_wrong_solution_is_refused_with_numbers(
    balanced: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    solution = lmi.solve([balanced], STILL, 2.0)
    too_good = replace(solution, solver_gamma=0.9 * solution.gamma, status="optimal_inaccurate")
    with pytest.raises(DesignError, match=r"optimal_inaccurate, gamma 5\.4.*does not hold"):
        lmi._certified(too_good, [balanced])
    with pytest.raises(DesignError, match="least eigenvalue"):
        lmi._certified(replace(solution, X0=-solution.X0), [balanced])
    with pytest.raises(DesignError, match="above the bound"):
        analysis.check_bound(np.array([5.0, 6.1]), 6.0, np.array([0.0, 0.1]))


def test_a_solution_that_does_not_hold_is_sought_again_with_a_margin(
    balanced: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def doubt(solution: lmi.Solution, plants: list[Plant]) -> lmi.Solution:
        tried.append(solution)
        if len(tried) == 1:
            raise lmi._DoesNotHoldError("not this one")
        return certified(solution, plants)

    certified = lmi._certified
    monkeypatch.setattr(lmi, "_certified", doubt)
    assert lmi.solve([balanced], STILL, 2.0) is not tried[0]
    assert len(tried) == 2
    monkeypatch.setattr(lmi, "STRICT", (1e-7,))
    tried.clear()
    with pytest.raises(DesignError, match="not this one") as caught:
        lmi.solve([balanced], STILL, 2.0)
    assert type(caught.value) is DesignError


def test_an_unstable_loop_is_refused(hinf: DesignResult) -> None:
    turned = hinf.bank._replace(C=-20.0 * hinf.bank.C)
    with pytest.raises(DesignError, match="closed loop is unstable"):
        analysis.closed_loop_norms(hinf.plants, turned, STILL)
    with pytest.raises(DesignError, match=r"sampled at 0\.002 s"):
        analysis.check_sampled_loop(hinf.plants, sampled(turned, 0.002), STILL, 0.002)


def test_lqg_is_the_optimal_regulator(lqg: DesignResult) -> None:
    s, w = structure(paper_building()), LqgWeights()
    push, y = s.B[:, :1], s.C[:1]
    drift = s.C[1:2]
    Q = w.acceleration * y.T @ y + w.drift * drift.T @ drift
    P = linalg.solve_continuous_are(s.A, push, Q, [[w.force]])
    assert -lqg.bank.C[0] == pytest.approx(push.T @ P / w.force, rel=1e-6, abs=1e-9)
    S = linalg.solve_continuous_are(
        s.A.T, y.T, s.B[:, 1:] @ s.B[:, 1:].T * w.ground**2, [[w.noise**2]]
    )
    gain = S @ y.T / w.noise**2
    assert lqg.bank.B[0] == pytest.approx(gain, rel=1e-6, abs=1e-9)
    assert lqg.bank.A[0] == pytest.approx(s.A - gain @ y, rel=1e-6, abs=1e-6)
    assert lqg.bank.W[0] == pytest.approx(push)


def test_lqg_estimates_the_state_from_acceleration_and_force(lqg: DesignResult) -> None:
    s, c = structure(paper_building()), lqg.controller
    h, n = c.sample_period, c.n
    exact = linalg.expm(np.block([[s.A, s.B[:, :1]], [np.zeros((1, 7))]]) * h)
    A, B, W = np.array(c.A).reshape(n, n), np.array(c.B), np.array(c.W)
    x, estimate = np.array([0.005, 0.006, 0.007, 0.0, 0.0, 0.0]), np.zeros(6)
    for k in range(1000):
        force = np.sin(0.02 * k)
        estimate = A @ estimate + B * (s.C[0] @ x) + W * force
        x = exact[:6, :6] @ x + exact[:6, 6] * force
    command = np.array(c.C) @ x
    assert np.array(c.C) @ estimate == pytest.approx(command, abs=0.05 * abs(command))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"force": 0.0}, "singular"),
        ({"noise": 0.0}, "singular"),
        ({"acceleration": -1.0}, "not negative"),
        ({"acceleration": 0.0, "drift": 0.0}, "nothing would be damped"),
        ({"ground": float("inf")}, "finite"),
    ],
)
def test_lqg_weights_that_cannot_be_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        LqgWeights(**wrong)


def test_lqg_has_no_weighted_loop_to_show(lqg: DesignResult) -> None:
    with pytest.raises(DesignError, match="LQG"):
        responses(lqg, np.ones(1))
