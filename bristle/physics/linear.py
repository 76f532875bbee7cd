"""Small dense algebra and packed rows on flat sequences, in the standard library alone.

FMUs must not import numpy (it can abort native hosts at exit), and n is small here: at most
twice the number of floors.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import PhysicsError

Flat = list[float]

Row = Any
"""A flat sequence of numbers: a list inside FMUs, an array under numba."""


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


def multiply(a: Row, b: Row, n: int, m: int, columns: int, product: Row) -> None:
    """Fill in the product of two matrices.

    Parameters
    ----------
    a, b : (n, m) and (m, columns) flat, kept
    n, m, columns : sizes
    product : (n, columns) flat, filled; another sequence than a and b
    """
    for i in range(n):
        first = i * columns
        for j in range(first, first + columns):
            product[j] = 0.0
        for k in range(m):
            factor = a[i * m + k]
            if factor != 0.0:
                at = first
                for j in range(k * columns, (k + 1) * columns):
                    product[at] += factor * b[j]
                    at += 1


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


def invert(a: Row, n: int, inverse_of_a: Row, work: Row) -> None:
    """Fill in the inverse of a (n, n) that is not singular.

    Parameters
    ----------
    a : (n, n) flat, kept
    n : size
    inverse_of_a : (n, n) flat, filled
    work : (n n + n,) or more, room to work
    """
    size = n * n
    rest, column = work[0:size], work[size : size + n]
    for j in range(n):
        copy(a, 0, rest, 0, size)
        for i in range(n):
            column[i] = 1.0 if i == j else 0.0
        solve_in_place(rest, column, n)
        for i in range(n):
            inverse_of_a[i * n + j] = column[i]


def inverse(a: Sequence[float], n: int) -> Flat:
    """Return the inverse of a (n, n).

    Raises
    ------
    PhysicsError
        If `a` is singular.
    """
    result = [0.0] * (n * n)
    try:
        invert(a, n, result, [0.0] * (n * n + n))
    except ZeroDivisionError:
        raise PhysicsError(f"a matrix of {n} x {n} is singular.") from None
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


LAST_TERM = 12
"""Terms of the Taylor series of phi_2 that are summed: they leave less than 1e-17 at norm 0.25."""


def phi_functions(a: Row, n: int, phi_0: Row, phi_1: Row, phi_2: Row, work: Row) -> None:
    """Fill in phi_0 = e^A, phi_1 = int_0^1 e^((1-s)A) ds and phi_2 = int_0^1 e^((1-s)A) s ds.

    With A = h a they give the exact step of x' = a x + b u for u linear in time:
    x_1 = phi_0 x_0 + h phi_1 b u_0 + h phi_2 b (u_1 - u_0). Taylor series at 2^-s A, then doubling
    (Higham 2008, Functions of Matrices, section 10.7).

    Parameters
    ----------
    a : (n, n) flat, kept
    n : size
    phi_0, phi_1, phi_2 : (n, n) flat, filled
    work : (2 n n,) or more, room to work
    """
    size = n * n
    small, product = work[0:size], work[size : 2 * size]
    norm, halvings, scale = row_sum_norm(a, n), 0, 1.0
    while norm > 0.25:
        norm *= 0.5
        scale *= 0.5
        halvings += 1
    for i in range(size):
        small[i] = a[i] * scale
        phi_2[i] = 0.0
    # phi_2 = sum A^k / (k+2)!, by Horner.
    factorial = 1.0
    for k in range(2, LAST_TERM + 3):
        factorial *= k
    for k in range(LAST_TERM, -1, -1):
        multiply(small, phi_2, n, n, n, product)
        copy(product, 0, phi_2, 0, size)
        add_to_diagonal(phi_2, n, 1.0 / factorial)
        factorial /= k + 2.0
    multiply(small, phi_2, n, n, n, phi_1)
    add_to_diagonal(phi_1, n, 1.0)
    multiply(small, phi_1, n, n, n, phi_0)
    add_to_diagonal(phi_0, n, 1.0)
    for _ in range(halvings):
        multiply(phi_1, phi_1, n, n, n, product)
        for i in range(size):
            phi_2[i] = 0.25 * product[i] + 0.5 * phi_2[i]
        multiply(phi_0, phi_1, n, n, n, product)
        for i in range(size):
            phi_1[i] = 0.5 * (phi_1[i] + product[i])
        multiply(phi_0, phi_0, n, n, n, product)
        copy(product, 0, phi_0, 0, size)


def row_sum_norm(a: Row, n: int) -> float:
    """Return the largest sum of absolute values in a row of a (n, n)."""
    largest = 0.0
    for i in range(n):
        total = 0.0
        for j in range(i * n, (i + 1) * n):
            total += abs(a[j])
        largest = max(largest, total)
    return largest


def add_to_diagonal(a: Row, n: int, value: float) -> None:
    """Add a number to each diagonal entry of a (n, n), in place."""
    for i in range(0, n * n, n + 1):
        a[i] += value


# Rows packed one behind the other in a flat sequence, each behind its length.
#
# What is fixed when a component is built, and what its parameters imply, lie so: in lists inside
# FMUs, in arrays in compiled code, with sizes that nobody has to know beforehand.


def packed(*rows: Iterable[float]) -> list[float]:
    """Return rows of numbers as one flat list; `row` finds them again."""
    flat: list[float] = []
    for one in rows:
        numbers = [float(value) for value in one]
        flat.append(float(len(numbers)))
        flat.extend(numbers)
    return flat


def place(flat: Row, k: int) -> int:
    """Return where row k begins: the index of its first number."""
    at = 0
    for _ in range(k):
        at += int(flat[at]) + 1
    return at + 1


def row(flat: Row, k: int) -> Row:
    """Return row k; in compiled code it is a view."""
    begin = place(flat, k)
    return flat[begin : begin + int(flat[begin - 1])]


def open_row(flat: Row, k: int, count: int) -> int:
    """Make room for row k, the rows before it being there; return the index of its first number.

    Parameters
    ----------
    flat : the packed rows, long enough
    k : number of the row
    count : how many numbers it has
    """
    begin = place(flat, k)
    flat[begin - 1] = float(count)
    return begin


def dot(a: Row, b: Row) -> float:
    """Return the product of two rows of one length, in the product of their units.

    In plain Python, so that `jit` compiles it into what asks for it.
    """
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total
