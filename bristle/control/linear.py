"""Linear controllers in discrete time: one, or a table of them looked up by speed.

        u_k = C x_k,   x_k+1 = A x_k + B y_k + W w_k

`y` is the measured floor acceleration, `w` a second input: for anti-windup, w = rate (sat(u) - u)
with the rate in 1/s; for LQG, the damper's force. Matrices of a table lie one after another in flat
sequences, `row` says which one: `A` (rows n n), `B`, `W`, `C` (rows n).
"""

from __future__ import annotations

from ..physics.linear import Row


def table_row(v: float, v_top: float, rows: int) -> int:
    """Return the row nearest to the speed |v| [m/s] of a table even over 0 .. v_top [m/s]."""
    share = abs(v) / v_top
    if share >= 1.0:
        return rows - 1
    return int(share * (rows - 1) + 0.5)


def command(n: int, C: Row, row: int, x: Row) -> float:
    """Return u = C x, in the unit of the design's command.

    Parameters
    ----------
    n : number of states
    C : (rows n,) flat
    row : which row of the table counts
    x : (n,) state
    """
    at = row * n
    total = 0.0
    for j in range(n):
        total += C[at + j] * x[j]
    return total


def advance(
    n: int, A: Row, B: Row, W: Row, row: int, x: Row, inputs: tuple[float, float], spare: Row
) -> None:
    """Move the state on by one sample, in place.

    Parameters
    ----------
    n : number of states
    A, B, W : (rows n n,), (rows n,), (rows n,) flat
    row : which row of the table counts
    x : (n,) state, moved on in place
    inputs : floor acceleration y [m/s2]; the second input w
    spare : (n,) or more, room to work
    """
    y, w = inputs
    at = row * n
    for i in range(n):
        total = B[at + i] * y + W[at + i] * w
        for j in range(n):
            total += A[(at + i) * n + j] * x[j]
        spare[i] = total
    for i in range(n):
        x[i] = spare[i]
