"""Units and signs from the data: derivatives, and the power that a force takes out of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...units import parse as parse_unit
from ..channels import DRIVE
from ..relation import Relation, derivative_relation, power_factor, tells_sign
from ..table import Array
from .candidates import Candidate, Search, joined, velocity_of

_SCALES = {
    "displacement": ("m", "mm", "cm", "um", "in"),
    "velocity": ("m/s", "mm/s", "cm/s", "in/s"),
    "acceleration": ("m/s2", "g", "mm/s2", "cm/s2"),
}


def fit_units(search: Search, chosen: dict[str, Candidate]) -> dict[str, Candidate]:
    """Tell units that are missing from derivatives, and say where stated ones do not fit."""
    out = dict(chosen)
    for lower, upper in (
        ("displacement", "velocity"),
        ("velocity", "acceleration"),
        ("base_displacement", "base_velocity"),
    ):
        if lower not in out or upper not in out or search.step <= 0.0:
            continue
        x, v = out[lower], out[upper]
        found = derivative_relation(
            search.column(x.column.text), search.column(v.column.text), search.step
        )
        if found is None or abs(found.correlation) < 0.9:
            doubt = "nothing moves" if found is None else f"correlation {found.correlation:.2f}"
            text = f'it is not the derivative of "{x.column.text}" ({doubt})'
            out[upper] = replace(v, doubt=joined(v.doubt, text))
            continue
        out[lower], out[upper] = _units_from(x, v, found, lower, upper)
    return out


def _units_from(
    x: Candidate, v: Candidate, found: Relation, lower: str, upper: str
) -> tuple[Candidate, Candidate]:
    lower, upper = (one.rpartition("_")[2] for one in (lower, upper))
    gain = abs(found.gain)
    if x.unit and v.unit:
        ratio = gain * parse_unit(v.unit).factor / parse_unit(x.unit).factor
        if not 0.8 < ratio < 1.25:
            text = (
                f'it is {ratio:.4g} times the derivative of "{x.column.text}": is '
                f"{v.unit} or {x.unit} wrong?"
            )
            return x, replace(v, doubt=joined(v.doubt, text))
        gain_text = f'{found.gain * ratio / gain:.3g} times the derivative of "{x.column.text}"'
        return x, replace(v, reason=f"{v.reason}; it is {gain_text}")
    if x.unit:
        unit = _nearest(parse_unit(x.unit).factor / gain, upper)
        text = f'unit from the derivative of "{x.column.text}" (gain {found.gain:.4g})'
        return x, replace(v, unit=unit, reason=f"{v.reason}; {text}") if unit else v
    if v.unit:
        unit = _nearest(parse_unit(v.unit).factor * gain, lower)
        text = f'unit from "{v.column.text}", its derivative (gain {found.gain:.4g})'
        return (replace(x, unit=unit, reason=f"{x.reason}; {text}") if unit else x), v
    return x, v


def _nearest(factor: float, quantity: str) -> str:
    """Return the unit of a quantity whose factor to SI is within 10 %, "" if there is none."""
    for unit in _SCALES[quantity]:
        if 0.9 < factor / parse_unit(unit).factor < 1.1:
            return unit
    return ""


def fit_signs(
    search: Search, chosen: dict[str, Candidate], rig: str, at_base: bool = True
) -> dict[str, Candidate]:
    """Return the channels with their signs: displacement as it is, the others to fit it.

    Parameters
    ----------
    search, chosen : the table, and what its columns seem to be
    rig : "bench" or "structure"
    at_base : whether the force resists the motion of the base, and not that across a storey
    """
    before = "base_" if rig == "structure" else ""
    x, v, f = before + "displacement", before + "velocity", "force"
    out = dict(chosen)
    if x in out and v in out:
        sign, text = velocity_sign(search, out[x].column.text, out[v].column.text)
        out[v] = replace(out[v], sign=sign, reason=joined(out[v].reason, text))
    moving = {name.removeprefix("base_"): out[name] for name in (x, v) if name in out}
    velocity = velocity_of(search, moving)
    if f in out and velocity is not None and at_base:
        along = velocity * (out[v].sign if v in out else 1)
        sign, text, doubt = force_sign(search.column(out[f].column.text), along)
        reason, doubt = joined(out[f].reason, text), joined(out[f].doubt, doubt)
        out[f] = replace(out[f], sign=sign, reason=reason, doubt=doubt)
    for drive in DRIVE:
        if drive in out:
            doubt = drive_doubt(search.column(out[drive].column.text))
            out[drive] = replace(out[drive], doubt=joined(out[drive].doubt, doubt))
    return out


def velocity_sign(search: Search, x: str, v: str) -> tuple[int, str]:
    """Return the sign that makes a column the derivative of another, and the reason."""
    found = derivative_relation(search.column(x), search.column(v), search.step)
    if found is None or abs(found.correlation) < 0.9 or found.gain > 0.0:
        return 1, ""
    return -1, f'turned, because the derivative of "{x}" has the opposite sign'


def force_sign(force: Array, velocity: Array) -> tuple[int, str, str]:
    """Return the sign that makes a force resist the motion, the reason, and a doubt."""
    share, agree = power_factor(force, velocity)
    if not tells_sign(share, agree, len(force)):
        return 1, "", f"it neither resists nor drives the motion (share of power {share:+.2f})"
    if share < 0.0:
        return (
            -1,
            f"turned, because as recorded it would drive the motion (share of power {share:+.2f})",
            "",
        )
    return 1, f"it resists the motion (share of power {share:+.2f})", ""


def drive_doubt(values: Array) -> str:
    """Return what speaks against a voltage or current, "" if nothing does."""
    low, high = float(values.min()), float(values.max())
    if low < -0.05 * max(high, 0.0) and low < -1e-3 * float(np.abs(values).max()):
        return f"it is negative, down to {low:.4g}"
    return ""
