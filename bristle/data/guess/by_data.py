"""Which column is which channel, by what the data say."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np

from ...core.arrays import Array
from ...core.text import listed
from ...units import parse
from ..channels import DRIVE
from ..noise import is_switched
from ..relation import Relation, derivative_relation, power_factor, tells_sign
from ..titles import Column
from .by_name import Candidate, Search, joined, usable, velocity_of

_SHOWN = 3  # columns of many that are told
_ALIKE = 0.05  # shares of dissipated power that differ by less are of like forces


def bench_guesses(search: Search, candidates: list[Candidate]) -> dict[str, Candidate]:
    """Return the best candidate of each channel of a damper on a bench."""
    chosen: dict[str, Candidate] = {}
    for channel in ("displacement", "velocity", "acceleration", *DRIVE):
        fitting = [c for c in candidates if c.quantity == channel and c.place in ("", "base")]
        if not fitting:  # a run on a structure, seen from its damper
            fitting = [c for c in candidates if c.quantity == f"base_{channel}"]
        if fitting:
            chosen[channel] = _best(fitting)
    forces = [c for c in candidates if c.quantity == "force" and c.place in ("", "base")]
    if forces:
        chosen["force"] = _best_force(search, forces, chosen)
    if not ({"displacement", "velocity"} & set(chosen)) or "force" not in chosen:
        _from_data(search, chosen)
    return chosen


def _best(fitting: list[Candidate]) -> Candidate:
    best = max(fitting, key=lambda one: one.rank)
    rivals = [f'"{c.column.text}"' for c in fitting if c.rank == best.rank and c is not best]
    if rivals:
        best = replace(best, doubt=joined(f"so could be {listed(rivals, _SHOWN)}", best.doubt))
    return best


def _best_force(search: Search, forces: list[Candidate], chosen: dict[str, Candidate]) -> Candidate:
    """Return the force that takes most power out of the motion, unless names say otherwise."""
    best = max(forces, key=lambda one: one.rank)
    if len(forces) == 1:
        return best
    velocity = velocity_of(search, chosen)
    if velocity is None:
        return _best(forces)
    share = {
        one.column.text: power_factor(search.column(one.column.text), velocity)[0] for one in forces
    }
    equal = [one for one in forces if one.rank == best.rank]
    by_power = max(equal, key=lambda one: abs(share[one.column.text]))
    if abs(share[by_power.column.text]) >= abs(share[best.column.text]) + _ALIKE:
        best = by_power
    by_power = max(forces, key=lambda one: abs(share[one.column.text]))
    rest = [one for one in forces if one is not best]
    others = listed(
        [f'"{one.column.text}" {abs(share[one.column.text]):.2f}' for one in rest], _SHOWN
    )
    own = abs(share[best.column.text])
    reason = f"{best.reason}; its share of dissipated power is {own:.2f}"
    alike = [f'"{one.column.text}"' for one in rest if one.rank == best.rank
             and abs(abs(share[one.column.text]) - own) < _ALIKE]  # fmt: skip
    doubt = ""
    if alike:
        doubt = f"so could be {listed(alike, _SHOWN)}; --channel force=COLUMN says which"
    if by_power is not best and abs(share[by_power.column.text]) > 0.1:
        doubt = f'"{by_power.column.text}" dissipates more'
    return replace(best, reason=f"{reason} ({others})", doubt=doubt)


def _from_data(search: Search, chosen: dict[str, Candidate]) -> None:
    """Find by the data alone what names do not tell: a motion and its derivative, then the rest."""
    if search.step <= 0.0:
        return
    taken = {one.column.text for one in chosen.values()}
    free = [
        column
        for column in search.table.columns
        if column.text not in taken
        and column.text not in search.table.not_numeric
        and column.unit is None
        and usable(search.table.values[column.text]).all()
        and not _rises(search.column(column.text))
    ][:12]
    moving = [c for c in free if not is_switched(search.column(c.text))]
    if not {"displacement", "velocity"} & set(chosen):
        pairs = [
            (abs(found.correlation), x, v)
            for x, v in permutations(moving, 2)
            if (
                found := derivative_relation(
                    search.column(x.text), search.column(v.text), search.step
                )
            )
        ]
        best = max(pairs, key=lambda pair: pair[0], default=None)
        if best is not None and best[0] > 0.98:
            reason = f"correlation {best[0]:.4f}"
            x, v = best[1], best[2]
            chosen["displacement"] = Candidate(
                x, "displacement", "", 1, f'"{v.text}" is its derivative ({reason})'
            )
            chosen["velocity"] = Candidate(
                v, "velocity", "", 1, f'it is the derivative of "{x.text}" ({reason})'
            )
            free = [c for c in free if c.text not in (x.text, v.text)]
    _rest_from_data(search, chosen, free)


def _rest_from_data(search: Search, chosen: dict[str, Candidate], free: list[Column]) -> None:
    if not set(DRIVE) & set(chosen):
        switched = [c for c in free if is_switched(search.column(c.text))]
        positive = [c for c in switched if search.column(c.text).min() >= 0.0]
        if len(positive) == 1:
            reason = "the only free column that is switched and never negative"
            chosen["voltage"] = Candidate(positive[0], "voltage", "", 1, reason)
            free = [c for c in free if c is not positive[0]]
    velocity = velocity_of(search, chosen)
    if "force" not in chosen and velocity is not None:
        shares = {c.text: abs(power_factor(search.column(c.text), velocity)[0]) for c in free}
        best = max(free, key=lambda c: shares[c.text], default=None)
        if best is not None and shares[best.text] > 0.3:
            reason = (
                f"of the free columns it dissipates most, {shares[best.text]:.2f} of what it could"
            )
            chosen["force"] = Candidate(best, "force", "", 1, reason)


def _rises(values: Array) -> bool:
    spacing = np.diff(values)
    return bool(((spacing >= 0.0).all() or (spacing <= 0.0).all()) and np.ptp(values) > 0.0)


# Units and signs from the data: derivatives, and the power that a force takes out of a motion.

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
        ratio = gain * parse(v.unit).factor / parse(x.unit).factor
        if not 0.8 < ratio < 1.25:
            text = (
                f'it is {ratio:.4g} times the derivative of "{x.column.text}": is '
                f"{v.unit} or {x.unit} wrong?"
            )
            return x, replace(v, doubt=joined(v.doubt, text))
        gain_text = f'{found.gain * ratio / gain:.3g} times the derivative of "{x.column.text}"'
        return x, replace(v, reason=f"{v.reason}; it is {gain_text}")
    if x.unit:
        unit = _nearest(parse(x.unit).factor / gain, upper)
        text = f'unit from the derivative of "{x.column.text}" (gain {found.gain:.4g})'
        return x, replace(v, unit=unit, reason=f"{v.reason}; {text}") if unit else v
    if v.unit:
        unit = _nearest(parse(v.unit).factor * gain, lower)
        text = f'unit from "{v.column.text}", its derivative (gain {found.gain:.4g})'
        return (replace(x, unit=unit, reason=f"{x.reason}; {text}") if unit else x), v
    return x, v


def _nearest(factor: float, quantity: str) -> str:
    """Return the unit of a quantity whose factor to SI is within 10 %, "" if there is none."""
    for unit in _SCALES[quantity]:
        if 0.9 < factor / parse(unit).factor < 1.1:
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
    drives = {one: search.column(out[one].column.text) for one in DRIVE if one in out}
    for drive, values in drives.items():
        doubt = drive_doubt(values)
        if not np.ptp(values) and any(np.ptp(other) for other in drives.values()):
            doubt = f"it never changes, as a supply: `study channels FOLDER --without {drive}`"
        out[drive] = replace(out[drive], doubt=joined(out[drive].doubt, doubt))
    return out


def velocity_sign(search: Search, x: str, v: str) -> tuple[int, str]:
    """Return the sign that makes a column the derivative of another, and the reason."""
    if search.step <= 0.0:
        return 1, ""
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
