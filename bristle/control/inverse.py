"""The voltage at which a damper gives a commanded force.

A law whose quantities are constant or linear in the voltage is affine in it at given motion,
f = f_0 + slope V, so that V = (u - f_0)/slope. Reconstructed from the prose of Shirazi et al.
(2012), IEEE TCST 20(5), eq. (7).

`law` is the code of a law of the library (`physics.law.law_code`), `p` are its parameters in their
order, `z` its states as the controller estimates them: after each sample they move on by
`estimate_states`.
"""

from __future__ import annotations

from math import inf

from ..physics.damper_source import advance_law, law_force
from ..physics.inputs import Inputs
from ..physics.linear import Row
from ..physics.tuples import NO_EFFECT, record
from .switching import limited, sign

STILL = 1e-3
"""Speed [m/s] below which the inverse asks for no voltage."""

LEAST_SLOPE = 0.5
"""Least force per volt [N/V] that is divided by; with 0.05 the voltage chatters."""


def force_of_law(law: int, p: Row, v: float, V: float, z: Row, x: float = 0.0) -> float:
    """Return a law's force [N]; sgn(0) = 1.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    v, V : velocity [m/s], voltage [V]
    z : (k,) states of the law
    x : displacement [m], which only laws with a spring or a hysteresis over it ask for
    """
    now = record(Inputs, (x, v, 0.0, V, 0.0, 0.0, inf, v == 0.0))
    return law_force(law, p, now, z)[0]  # type: ignore[no-any-return]


def voltage_of_law(
    law: int, p: Row, command: float, v: float, z: Row, limits: tuple[float, float, float],
    x: float = 0.0,
) -> float:  # fmt: skip
    """Return the voltage [V] at which a damper of some law gives the commanded force.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    command : force [N], positive against +x
    v, z : velocity [m/s]; (k,) states of the law
    limits : still [m/s], least [N/V] and v_max [V] of `affine_voltage`; `STILL`, `LEAST_SLOPE` and
        8 V are usual
    x : displacement [m]
    """
    f_0 = force_of_law(law, p, v, 0.0, z, x)
    slope = force_of_law(law, p, v, 1.0, z, x) - f_0
    still, least, v_max = limits
    return affine_voltage(command, v, f_0, slope, still, least, v_max)


def estimate_states(law: int, p: Row, v: float, V: float, dt: float, z: Row) -> None:
    """Move a law's estimated states on by a sample.

    Parameters
    ----------
    law, p : code of the law; (m,) its parameters
    v, V : velocity [m/s] and voltage [V], held over the sample
    dt : length of the sample [s]
    z : (k,) states of the law, moved on in place
    """
    now = record(Inputs, (0.0, v, 0.0, V, dt, 0.0, 0.0, False))
    advance_law(law, p, now, NO_EFFECT, z, z)


def affine_voltage(
    command: float, v: float, f_0: float, slope: float, still: float, least: float, v_max: float
) -> float:
    """Return the voltage [V] of a force f_0 + slope V that comes nearest to a command.

    Parameters
    ----------
    command : force [N]
    v : velocity [m/s]
    f_0, slope : force at 0 V [N] and its slope over voltage [N/V]
    still : speed [m/s] below which the voltage is zero
    least : smallest slope [N/V]; a smaller one is taken as this, with its sign (plus at zero)
    v_max : largest voltage [V]; the smallest is 0
    """
    if abs(v) < still:
        return 0.0
    if abs(slope) < least:
        slope = least * sign(slope)
    return limited((command - f_0) / slope, 0.0, v_max)
