"""Linear algebra on flat lists, against numpy and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from bristle.errors import PhysicsError
from bristle.physics.linear import (
    cholesky,
    inverse,
    multiply,
    phi_functions,
    solve_in_place,
)

SIZES = [1, 2, 6, 13, 42]


def phis(a: list[float], n: int) -> tuple[list[float], list[float], list[float]]:
    """Return phi_0, phi_1 and phi_2 of a matrix."""
    found = [0.0] * (n * n), [0.0] * (n * n), [0.0] * (n * n)
    phi_functions(a, n, *found, [0.0] * (2 * n * n))
    return found


def random_matrix(n: int, seed: int, scale: float = 1.0) -> np.ndarray:
    return scale * np.random.default_rng(seed).standard_normal((n, n))


@pytest.mark.parametrize("n", SIZES)
def test_product_of_rectangular_matrices(n: int) -> None:
    generator = np.random.default_rng(n)
    a, b = generator.standard_normal((n, n + 1)), generator.standard_normal((n + 1, 3))
    product = [1.0] * (3 * n)
    multiply(a.ravel().tolist(), b.ravel().tolist(), n, n + 1, 3, product)
    np.testing.assert_allclose(np.reshape(product, (n, 3)), a @ b, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_inverse_and_solution(n: int) -> None:
    a = random_matrix(n, n) + n * np.eye(n)
    flat = a.ravel().tolist()
    found = np.reshape(inverse(flat, n), (n, n))
    np.testing.assert_allclose(found @ a, np.eye(n), atol=1e-12)
    assert flat == a.ravel().tolist()  # the argument is kept
    b = list(range(1, n + 1))
    x = [float(value) for value in b]
    solve_in_place(a.ravel().tolist(), x, n)
    np.testing.assert_allclose(a @ x, b, rtol=1e-12)


def test_a_zero_pivot_is_exchanged() -> None:
    x = [3.0, 5.0]
    solve_in_place([0.0, 2.0, 4.0, 0.0], x, 2)
    assert x == [1.25, 1.5]


def test_a_singular_matrix_has_no_inverse() -> None:
    with pytest.raises(PhysicsError, match="2 x 2 is singular"):
        inverse([1.0, 2.0, 2.0, 4.0], 2)


@pytest.mark.parametrize("n", SIZES)
def test_cholesky_factor(n: int) -> None:
    half = random_matrix(n, n)
    a = half @ half.T + np.eye(n)
    low = cholesky(a.ravel().tolist(), n)
    assert low is not None
    np.testing.assert_allclose(np.reshape(low, (n, n)), np.linalg.cholesky(a), rtol=1e-10)


@pytest.mark.parametrize("a", [[1.0, 2.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0], [1.0, 0, 0, -1.0]])
def test_what_is_not_positive_definite_has_no_cholesky_factor(a: list[float]) -> None:
    assert cholesky(a, 2) is None


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("scale", [1e-6, 0.1, 3.0])
def test_phi_functions_are_blocks_of_an_augmented_exponential(n: int, scale: float) -> None:
    a = random_matrix(n, n, scale)
    # exp [[A, I, 0], [0, 0, I], [0, 0, 0]] holds e^A, phi_1 and phi_2 in its first row of blocks
    # (Van Loan 1978, IEEE Trans. Automatic Control 23(3), 395-404).
    zero, unit = np.zeros((n, n)), np.eye(n)
    whole = expm(np.block([[a, unit, zero], [zero, zero, unit], [zero, zero, zero]]))
    for k, phi in enumerate(phis(a.ravel().tolist(), n)):
        expected = whole[:n, k * n : (k + 1) * n]
        error = np.abs(np.reshape(phi, (n, n)) - expected).max()
        assert error <= 1e-13 * max(1.0, np.abs(expected).max()) * n, k


def test_phi_functions_of_zero() -> None:
    unit = [1.0, 0.0, 0.0, 1.0]
    assert phis([0.0] * 4, 2) == (unit, unit, [0.5, 0.0, 0.0, 0.5])


def test_phi_functions_of_a_number() -> None:
    a = -2.0
    phi_0, phi_1, phi_2 = phis([a], 1)
    assert phi_0[0] == pytest.approx(np.exp(a), rel=1e-14)
    assert phi_1[0] == pytest.approx(np.expm1(a) / a, rel=1e-14)
    assert phi_2[0] == pytest.approx((np.expm1(a) - a) / a**2, rel=1e-14)
