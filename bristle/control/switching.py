"""From a command to a voltage within limits: the clipped-optimal switch, the signed voltage."""

from __future__ import annotations


def sign(value: float) -> float:
    """Return 1 or -1; 1 at zero."""
    return 1.0 if value >= 0.0 else -1.0


def limited(value: float, low: float, high: float) -> float:
    """Return the value within [low, high]."""
    if value < low:
        return low
    return high if value > high else value


def clipped_voltage(command: float, force: float, f_min: float, v_max: float) -> float:
    """Return the clipped-optimal voltage [V], which is 0 or `v_max`.

        V = v_max H((u - f) f) H(|u| - f_min),   H(0) = 0

    After Dyke, Spencer, Sain & Carlson (1996), Smart Mater. Struct. 5(5), 565-575, with the
    threshold of Yoshioka, Ramallo & Spencer (2002), J. Eng. Mech. 128(5), 540-551.

    Parameters
    ----------
    command, force : float
        Commanded and actual force [N], positive against +x.
    f_min : float
        Commands of this size or less are not answered [N].
    v_max : float
        Largest voltage [V].
    """
    if abs(command) > f_min and (command - force) * force > 0.0:
        return v_max
    return 0.0


def signed_voltage(command: float, v: float, v_max: float) -> float:
    """Return the voltage [V] of the signed command w = sgn(v) V [V] at damper velocity v [m/s].

    A damper's force follows the sign of its velocity; the signed voltage takes that sign into the
    command, so that a controller sees a gain of one sign.
    """
    return limited(sign(v) * command, 0.0, v_max)


def applied_signed(voltage: float, v: float) -> float:
    """Return the signed voltage [V] that a voltage is at damper velocity v [m/s]."""
    return sign(v) * voltage
