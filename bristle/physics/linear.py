"""Small dense linear algebra on flat row-major sequences, in the standard library alone.

FMUs must not import numpy (it can abort native hosts at exit), and n is small here: at most
twice the number of floors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import PhysicsError

Flat = list[float]

Row = Any
"""A flat sequence of numbers: a list inside FMUs, an array under numba."""


def identity(n: int) -> Flat:
    """Return the (n, n) identity."""
    return [1.0 if i == j else 0.0 for i in range(n) for j in range(n)]


def copy(source: Row, first: int, target: Row, at: int, count: int) -> None:
    """Copy some values from one sequence into another.

    Parameters
    ----------
    source, first : where from, and the index of the first value there
    target, at : where to, and the index of the first value there
    count : number of values
    """
    for i in range(count):
        target[at + i] = source[first + i]


def multiply(a: Sequence[float], b: Sequence[float], n: int, m: int, columns: int) -> Flat:
    """Return the product of two matrices, (n, columns) flat.

    Parameters
    ----------
    a, b : (n, m) and (m, columns) flat
    n, m, columns : sizes
    """
    rows = [b[k * columns : (k + 1) * columns] for k in range(m)]
    product: Flat = []
    for i in range(n):
        total = [0.0] * columns
        for k in range(m):
            factor = a[i * m + k]
            if factor != 0.0:
                total = [t + factor * value for t, value in zip(total, rows[k])]
        product.extend(total)
    return product


def solve_in_place(a: Row, b: Row, n: int) -> None:
    """Solve a x = b for a (n, n), b (n,): b becomes x, a is destroyed. Partial pivoting."""
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i * n + k]) > abs(a[pivot * n + k]):
                pivot = i
        if pivot != k:
            for j in range(n):
                a[k * n + j], a[pivot * n + j] = a[pivot * n + j], a[k * n + j]
            b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, n):
            factor = a[i * n + k] / a[k * n + k]
            for j in range(k + 1, n):
                a[i * n + j] -= factor * a[k * n + j]
            b[i] -= factor * b[k]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i * n + j] * b[j]
        b[i] = total / a[i * n + i]


def inverse(a: Sequence[float], n: int) -> Flat:
    """Return the inverse of a (n, n).

    Raises
    ------
    PhysicsError
        If `a` is singular.
    """
    result = [0.0] * (n * n)
    for j in range(n):
        column = [1.0 if i == j else 0.0 for i in range(n)]
        try:
            solve_in_place(list(a), column, n)
        except ZeroDivisionError:
            raise PhysicsError(f"a matrix of {n} x {n} is singular.") from None
        for i in range(n):
            result[i * n + j] = column[i]
    return result


def cholesky(a: Sequence[float], n: int) -> Flat | None:
    """Return the lower factor L of a = L L^T, or None if a (n, n) is not positive definite."""
    low = [0.0] * (n * n)
    for i in range(n):
        for j in range(i + 1):
            total = a[i * n + j] - sum(low[i * n + k] * low[j * n + k] for k in range(j))
            if i == j:
                if not total > 0.0:
                    return None
                low[i * n + i] = total**0.5
            else:
                low[i * n + j] = total / low[j * n + j]
    return low


def phi_functions(a: Sequence[float], n: int) -> tuple[Flat, Flat, Flat]:
    """Return phi_0 = e^A, phi_1 = int_0^1 e^((1-s)A) ds and phi_2 = int_0^1 e^((1-s)A) s ds.

    With A = h a they give the exact step of x' = a x + b u for u linear in time:
    x_1 = phi_0 x_0 + h phi_1 b u_0 + h phi_2 b (u_1 - u_0). Taylor series at 2^-s A, then doubling
    (Higham 2008, Functions of Matrices, section 10.7).
    """
    norm = max(sum(abs(a[i * n + j]) for j in range(n)) for i in range(n))
    halvings = 0
    while norm > 0.25:
        norm *= 0.5
        halvings += 1
    small = [value * 0.5**halvings for value in a]
    # phi_2 = sum A^k / (k+2)!, by Horner; 12 terms leave less than 1e-17 at norm 0.25.
    phi_2 = [0.0] * (n * n)
    factorial = [1.0]
    for k in range(1, 16):
        factorial.append(factorial[-1] * k)
    unit = identity(n)
    for k in range(12, -1, -1):
        phi_2 = multiply(small, phi_2, n, n, n)
        phi_2 = [value + one / factorial[k + 2] for value, one in zip(phi_2, unit)]
    phi_1 = [one + value for one, value in zip(unit, multiply(small, phi_2, n, n, n))]
    phi_0 = [one + value for one, value in zip(unit, multiply(small, phi_1, n, n, n))]
    for _ in range(halvings):
        square = multiply(phi_1, phi_1, n, n, n)
        phi_2 = [0.25 * value + 0.5 * two for value, two in zip(square, phi_2)]
        phi_1 = [0.5 * (one + value) for one, value in zip(phi_1, multiply(phi_0, phi_1, n, n, n))]
        phi_0 = multiply(phi_0, phi_0, n, n, n)
    return phi_0, phi_1, phi_2
