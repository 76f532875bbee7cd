"""Which form of the command the runs carry, and a model brought into another form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..data.checks.levels import LEAST_LEVELS, command_levels, drives_of
from ..data.measurement import Measurement
from ..data.model import StudyModel, new_model
from ..errors import PhysicsError, StudyError
from ..findings import unknown
from ..physics.command import MOST_KNOTS
from ..physics.drive import DRIVES
from ..physics.effect import EFFECTS
from ..physics.forms import FORMS, LINEAR_FORM, TABLE_FORM, joined_form, split_form
from ..physics.laws import base_and_variant
from ..units import convert

ALL = "all"
"""The word for all forms."""

_MOVING_KNOTS = 5  # of a table where the command moves continuously
_TAIL = 0.005  # share of the samples beyond either end of such a table
_DIGITS = 4  # of a knot


@dataclass(frozen=True)
class FormError:
    """The error of a model in one form of the command, identified like the model itself.

    `errors` are those of `Identified.after`; `numbers` says how many parameters were fitted.
    """

    form: str
    model: StudyModel
    errors: dict[str, float]
    numbers: int

    @property
    def judged(self) -> float:
        """Share of the force that is left on held-out runs; of training runs where none is."""
        return self.errors.get("error_share_holdout", self.errors["error_share_train"])

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        _, _, knots = split_form(self.model.law)
        return {
            "command": self.form, "knots": list(knots), "fitted": self.numbers,
            "errors": finite(self.errors), "values": self.model.values(),
        }  # fmt: skip


def finite(errors: Mapping[str, float]) -> dict[str, float | None]:
    """Return errors as json can hold them: z is None where the noise is not known."""
    return {name: value if value == value else None for name, value in errors.items()}


def form_of(model: StudyModel) -> str:
    """Return the form of the command that a model has: "linear" where none was chosen."""
    return split_form(model.law)[1] or LINEAR_FORM


def forms_asked(command: str | Sequence[str]) -> tuple[str, ...]:
    """Return the forms that were asked for: one, several with commas between them, or all.

    Raises
    ------
    StudyError
        If one is not known.
    """
    if not isinstance(command, str) and not isinstance(command, Sequence):
        raise StudyError(f"command is {command!r}; one of {', '.join(FORMS)}, or all, is right.")
    words = command.replace(",", " ").split() if isinstance(command, str) else list(command)
    for word in words:
        if word not in (*FORMS, ALL):
            raise StudyError(unknown("form of the command", str(word), (*FORMS, ALL)))
    if not words:
        raise StudyError(f"no form of the command is named; there are: {', '.join(FORMS)}, all.")
    return FORMS if ALL in words else tuple(dict.fromkeys(words))


def knots_of(runs: Sequence[Measurement]) -> tuple[float, ...]:
    """Return the knots [V, or A of a current] of a table that these runs carry.

    They are the levels that the command keeps to; where there are more than a table holds, or the
    command moves continuously, they are spread over its range.

    Raises
    ------
    StudyError
        If the command keeps to fewer than `LEAST_LEVELS`.
    """
    drives = drives_of(runs)
    if not drives:
        raise StudyError(
            "no command was measured: what depends on it cannot be told. "
            f"--command {LINEAR_FORM} is right."
        )
    levels = command_levels(runs)
    if levels is None:
        values = np.concatenate([run[name] for run, name in drives])
        low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL))
        return _rounded(np.linspace(max(float(low), 0.0), float(high), _MOVING_KNOTS))
    if len(levels) < LEAST_LEVELS:
        unit = DRIVES[drives[0][1]].unit
        at = " and ".join(f"{level:.3g} {unit}" for level in levels)
        raise StudyError(
            f"the training runs hold the command at {at} alone: that tells a straight line at "
            f"most. Runs at {LEAST_LEVELS} levels or more, or --command {LINEAR_FORM}, would be "
            "right."
        )
    if len(levels) > MOST_KNOTS:
        picked = np.round(np.linspace(0, len(levels) - 1, MOST_KNOTS)).astype(int)
        levels = [levels[k] for k in picked]
    return _rounded(levels)


def _rounded(levels: Any) -> tuple[float, ...]:
    largest = max(abs(float(level)) for level in levels)
    places = _DIGITS - 1 - int(np.floor(np.log10(largest))) if largest > 0.0 else _DIGITS
    return tuple(round(float(level), places) + 0.0 for level in levels)


def in_form(model: StudyModel, form: str, runs: Sequence[Measurement]) -> StudyModel:
    """Return a model with another form of the command, as near to what it was as can be.

    Parameters
    ----------
    model : a damper's law with effects
    form : one of `physics.forms.FORMS`
    runs : the training runs, whose levels are a table's knots

    Raises
    ------
    StudyError
        If the runs do not carry the form, nothing in the law can have it, or an effect bends the
        command already.
    """
    plain, present, _ = split_form(model.law)
    if form == LINEAR_FORM and not present:
        return model
    knots = knots_of(runs) if form != LINEAR_FORM else ()
    try:
        name = joined_form(plain, form, knots if form == TABLE_FORM else ())
        law, _ = base_and_variant(name)
    except PhysicsError as error:
        raise StudyError(str(error)) from None
    unfit = [n for n in model.effects if law.site in EFFECTS[n].sites and not EFFECTS[n].joins(law)]
    if unfit:
        raise StudyError(
            f"{', '.join(unfit)} bends the command already, and a {form} would do so once more: "
            "undo that step first."
        )
    other = replace(new_model(name, (), model.building, model.drive), effects=dict(model.effects))
    return _carried(model, other)


def _carried(model: StudyModel, other: StudyModel) -> StudyModel:
    """Return the other model with what both have, and quantities as they are in the first."""
    kept = {n: v for n, v in model.parameters.items() if n in other.parameters}
    other = replace(other, parameters={**other.parameters, **kept})
    before, after = (base_and_variant(one.law)[0] for one in (model, other))
    values, top = model.values(), max(before.knots or after.knots or (1.0,))
    new: dict[str, float] = {}
    for quantity, form in after.command.items():

        def at(V: float, quantity: str = quantity) -> float:
            return float(getattr(before.at(values, V), quantity))

        names = [name for one in form.names() for name in after.listed(one)]
        points = after.knots if quantity in after.tables else ()
        found = _numbers(at, points, top)
        new.update({n: v for n, v in zip(names, found, strict=False) if n not in kept})
    bounded = {n: float(np.clip(v, *_bounds(other, n))) for n, v in new.items()}
    return other.with_values(bounded, origin="assumed")


def _numbers(at: Any, knots: Sequence[float], top: float) -> Iterator[float]:
    """Yield a quantity's numbers: first value and gains of a table; else level, slope, no bend."""
    if knots:
        yield at(knots[0])
        yield from (at(b) - at(a) for a, b in pairwise(knots))
    else:
        yield from (at(0.0), (at(top) - at(0.0)) / top, 0.0)


def _bounds(model: StudyModel, name: str) -> tuple[float, float]:
    own, unit = model.flat()[name], model.declared(name).unit
    return convert(own.low, own.unit, unit), convert(own.high, own.unit, unit)
