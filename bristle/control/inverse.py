"""The voltage at which a damper gives a commanded force.

Both laws are affine in the voltage at given motion, f = f_0 + slope V, so that V = (u - f_0)/slope.
Reconstructed from the prose of Shirazi et al. (2012), IEEE TCST 20(5), eq. (7).
"""

from __future__ import annotations

from ..physics.bingham import Bingham
from ..physics.damper import BINGHAM_VALUES, LUGRE_VALUES
from ..physics.linear import Row
from ..physics.lugre import LuGre
from .switching import limited, sign

STILL = 1e-3
"""Speed [m/s] below which the inverse asks for no voltage."""

LEAST_SLOPE = 0.5
"""Least force per volt [N/V] that is divided by; with 0.05 the voltage chatters."""

_LuGreValues = LUGRE_VALUES
_BinghamValues = BINGHAM_VALUES
_lugre_bristle = LuGre.bristle
_lugre_viscous = LuGre.viscous
_bingham_yielding = Bingham.yielding
_bingham_viscous = Bingham.viscous
estimated_deflection = LuGre.advance
"""The inverse's own bristle deflection [m] after a sample: (z, v, sample_period, a_0)."""


def lugre_force(z: float, v: float, V: float, p: Row) -> float:
    """Return the LuGre force [N] at deflection z [m], velocity v [m/s] and voltage V [V].

    `p` (8,) are the law's parameters in the order of `LuGre.parameters`.
    """
    values = _LuGreValues(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7])
    return _lugre_bristle(z, v, V, values) + _lugre_viscous(v, V, values)


def bingham_force(v: float, V: float, p: Row) -> float:
    """Return the Bingham force [N] at velocity v [m/s] and voltage V [V], sgn(0) = 1.

    `p` (6,) are the law's parameters in the order of `Bingham.parameters`.
    """
    values = _BinghamValues(p[0], p[1], p[2], p[3], p[4], p[5])
    return sign(v) * _bingham_yielding(V, values) + _bingham_viscous(v, V, values)


def affine_voltage(
    command: float, v: float, f_0: float, slope: float, still: float, least: float, v_max: float
) -> float:
    """Return the voltage [V] of a force f_0 [N] + slope [N/V] V that comes nearest to a command.

    Zero below the speed `still` [m/s]; a slope smaller than `least` [N/V] is taken as `least`, with
    its sign (plus at zero).
    """
    if abs(v) < still:
        return 0.0
    if abs(slope) < least:
        slope = least * sign(slope)
    return limited((command - f_0) / slope, 0.0, v_max)


def lugre_voltage(
    command: float, v: float, z: float, p: Row, still: float, least: float, v_max: float
) -> float:
    """Return the voltage [V] at which a LuGre damper gives the commanded force.

    Parameters
    ----------
    command : float
        Force [N], positive against +x.
    v, z : float
        Velocity [m/s]; bristle deflection [m], the controller's own estimate: after each sample it
        moves on by `estimated_deflection`.
    p : sequence of float
        (8,) parameters of the law.
    still, least, v_max : float
        See `affine_voltage`; `STILL`, `LEAST_SLOPE` and 8 V are usual.
    """
    f_0 = lugre_force(z, v, 0.0, p)
    slope = lugre_force(z, v, 1.0, p) - f_0
    return affine_voltage(command, v, f_0, slope, still, least, v_max)


def bingham_voltage(
    command: float, v: float, p: Row, still: float, least: float, v_max: float
) -> float:
    """Return the voltage [V] at which a Bingham damper gives the commanded force.

    As `lugre_voltage`, with `p` (6,) and no state.
    """
    f_0 = bingham_force(v, 0.0, p)
    slope = bingham_force(v, 1.0, p) - f_0
    return affine_voltage(command, v, f_0, slope, still, least, v_max)
