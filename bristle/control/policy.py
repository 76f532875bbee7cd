"""A trained policy: from what is measured to a share of the largest voltage.

A Kalman filter estimates the building and a model of the ground that shakes it. The output's recent
level says how strong the shaking is. Both enter a network with one hidden layer:

    share = (1 + tanh(o/2)) / 2,   o = b + s phi + w tanh(b_h + S phi)

phi are the inputs of `policy_inputs`: D of them for n estimated states. The weights lie one after
another in one flat sequence: S (hidden D), b_h (hidden), w (hidden), s (D), b.
"""

from __future__ import annotations

from math import tanh

from ..physics.linear import Row
from .switching import sign

MEASURED = 4
"""Floor acceleration [m/s2], displacement [m], velocity [m/s] and force [N] of the damper."""
BESIDES = 3
"""Inputs of the network besides the estimated states."""
KEEP, LEAST_LEVEL, FORCE, ACCELERATION, SPEED, LARGEST = range(6)
"""Places of the scales: share of the level that a sample keeps, its least value [m/s2], typical
force [N], acceleration [m/s2] and speed [m/s], and the largest voltage [V] of the training."""
SCALES = 6


def hidden_units(n: int, count: int) -> int:
    """Return how many hidden units a network of `count` weights has, of n estimated states."""
    inputs = n + BESIDES
    return (count - inputs - 1) // (inputs + 2)


def weight_count(n: int, hidden: int) -> int:
    """Return how many weights a network has."""
    inputs = n + BESIDES
    return hidden * (inputs + 2) + inputs + 1


def estimate(n: int, A: Row, B: Row, measured: Row, state: Row, spare: Row) -> None:
    """Bring the estimate from one sample to the next, in place: x <- A x + B m.

    Parameters
    ----------
    n : number of estimated states
    A, B : (n n,), (n 4,) flat
    measured : (4,) as `MEASURED` says
    state : (n,) or more; the first n are the estimate
    spare : (n,) or more, room to work
    """
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += A[i * n + j] * state[j]
        for j in range(MEASURED):
            total += B[i * MEASURED + j] * measured[j]
        spare[i] = total
    for i in range(n):
        state[i] = spare[i]


def recent_level(level: float, y: float, keep: float) -> float:
    """Return the largest recent size of the output [m/s2]; a sample keeps a share of the last."""
    return max(level * keep, abs(y))


def policy_inputs(
    n: int, state: Row, level: float, measured: Row, scales: Row, inputs: Row
) -> None:  # fmt: skip
    """Fill in what the network sees.

    The voltage is the same where all signs turn, so signs are told against the velocity's.

    Parameters
    ----------
    n : number of estimated states
    state : (n,) or more, the estimate first
    level : `recent_level` [m/s2]
    measured : (4,) as `MEASURED` says
    scales : (6,)
    inputs : (n + 3,) estimate over level, force, level and speed over their scales; filled
    """
    v, f = measured[2], measured[3]
    side = sign(v)
    for i in range(n):
        inputs[i] = side * state[i] / level
    inputs[n] = side * f / scales[FORCE]
    inputs[n + 1] = level / (level + scales[ACCELERATION])
    inputs[n + 2] = abs(v) / (abs(v) + scales[SPEED])


def voltage_share(count: int, hidden: int, inputs: Row, weights: Row, units: Row) -> float:
    """Return the network's output, within 0 and 1.

    Parameters
    ----------
    count, hidden : numbers of inputs and of hidden units
    inputs : (count,)
    weights : flat, as the module says
    units : (hidden,) the hidden units, filled
    """
    biases = hidden * count
    outer = biases + hidden
    direct = outer + hidden
    total = weights[direct + count]
    for j in range(count):
        total += weights[direct + j] * inputs[j]
    for i in range(hidden):
        inner = weights[biases + i]
        for j in range(count):
            inner += weights[i * count + j] * inputs[j]
        units[i] = tanh(inner)
        total += weights[outer + i] * units[i]
    return 0.5 * (1.0 + tanh(0.5 * total))
