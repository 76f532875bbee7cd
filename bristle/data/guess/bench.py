"""The channels of a damper on a bench: by names first, then by what the data say."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np

from ..channels import DRIVE
from ..columns import Column
from ..noise import is_switched
from ..relation import derivative_relation, power_factor
from ..table import Array
from .candidates import Candidate, Search, joined, usable, velocity_of

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
    rivals = [one.column.text for one in fitting if one.rank == best.rank and one is not best]
    if rivals:
        best = replace(best, doubt=joined(f"so could be {_listed(rivals)}", best.doubt))
    return best


def _listed(texts: list[str]) -> str:
    """Return titles in quotation marks, the first few of many."""
    shown = ", ".join(map(_quoted, texts[:_SHOWN]))
    return shown if len(texts) <= _SHOWN else f"{shown} and {len(texts) - _SHOWN} more"


def _quoted(text: str) -> str:
    return f'"{text}"'


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
    others = ", ".join(
        f'"{one.column.text}" {abs(share[one.column.text]):.2f}' for one in rest[:_SHOWN]
    ) + (f" and {len(rest) - _SHOWN} more" if len(rest) > _SHOWN else "")
    own = abs(share[best.column.text])
    reason = f"{best.reason}; its share of dissipated power is {own:.2f}"
    alike = [one.column.text for one in rest if one.rank == best.rank
             and abs(abs(share[one.column.text]) - own) < _ALIKE]  # fmt: skip
    doubt = ""
    if alike:
        doubt = f"so could be {_listed(alike)}; --channel force=COLUMN says which"
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
