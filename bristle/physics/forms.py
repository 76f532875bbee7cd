"""A law whose quantities depend on the command in a form that its user chose.

A law declares linear dependences. The same law with parabolas or tables in their place is a class
of its own, `NAME[quadratic]` or `NAME[table 0 1.5 3]` with the table's knots in volts. It follows
from the law alone, so that the name suffices to make it: in a model's file, a child process, an
FMU. Its hooks are the law's; generated code tells the forms apart by the law's code (see `tuples`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from math import isfinite, sqrt
from types import new_class
from typing import Any

from ..errors import PhysicsError
from .command import MOST_KNOTS, QUADRATIC, Form, Linear, Monotone, Rising
from .parameter import Parameter, Table, entries

Law = Any
"""A class of a law, as `law` defines it with what stands here."""

LINEAR_FORM, QUADRATIC_FORM, TABLE_FORM = FORMS = ("linear", "quadratic", "table")
"""The words for the forms."""

CURVED = "command curve"
"""What a law of a chosen form contains already: no effect bends the command once more."""

_NAME = re.compile(r"(\w+)\[(\w+)((?: [-+.\w]+)*)\]")
_BEND_START = 1e-3  # of the rig's typical size, where fits look for a bend that is a shape


def split_form(name: str) -> tuple[str, str, tuple[float, ...]]:
    """Return a law's plain name, its chosen form ("" where it is the law's own) and the knots [V].

    Raises
    ------
    PhysicsError
        If a form, or a knot, is none.
    """
    found = _NAME.fullmatch(name)
    if found is None:
        return name, "", ()
    plain, form, knots = found[1], found[2], found[3].split()
    try:
        numbers = tuple(float(knot) for knot in knots)
    except ValueError:
        raise PhysicsError(f"law {name!r}: its knots must be numbers [V].") from None
    _check(name, form, numbers)
    return plain, form, numbers


def joined_form(plain: str, form: str, knots: tuple[float, ...] = ()) -> str:
    """Return the name of a law, or of its variant, with a form; the plain one of "linear" or "".

    Raises
    ------
    PhysicsError
        If there is no such form, or its knots are not right.
    """
    if form in ("", LINEAR_FORM):
        return plain
    _check(plain, form, knots)
    return f"{plain}[{' '.join([form, *(f'{knot:.6g}' for knot in knots)])}]"


def shown_law(name: str) -> str:
    """Return a law's name for a reader, without the knots of its form: "lugre[table]"."""
    plain, form, _ = split_form(name)
    return f"{plain}[{form}]" if form else plain


def _check(where: str, form: str, knots: tuple[float, ...]) -> None:
    """Refuse a form that there is not, and knots that are not right."""
    if form not in (QUADRATIC_FORM, TABLE_FORM):
        raise PhysicsError(f"law {where!r}: there is no form {form!r}; there are {FORMS}.")
    least = 2 if form == TABLE_FORM else 0
    most = MOST_KNOTS if form == TABLE_FORM else 0
    ascend = all(a < b for a, b in zip(knots, knots[1:])) and all(map(isfinite, knots))
    if not least <= len(knots) <= most or not ascend:
        right = f"{least} to {most} knots [V], ascending," if most else "no knots"
        raise PhysicsError(f"law {where!r}: a {form} has the knots {knots}; {right} is right.")


def choosable(law: Law) -> dict[str, Linear]:
    """Return the quantities of a law whose form may be chosen, with the linear one that they have.

    Those that rise with the command, and whose numbers neither a variant nor the law itself fixes.
    """
    held = {name for one in law.variants.values() for name in (*one.values, *one.idle)}
    held |= set(law.fixed())
    return {
        quantity: form
        for quantity, form in law.command.items()
        if isinstance(form, Linear) and not held & set(form.names())
        if law.parameters[form.slope].bounds[0] >= 0.0
    }


@cache
def with_form(law: Law, form: str, knots: tuple[float, ...]) -> Law:
    """Return the class of a law with another form.

    Raises
    ------
    PhysicsError
        If no quantity of the law has a form that may be chosen.
    """
    quantities = choosable(law)
    if not quantities:
        raise PhysicsError(
            f"the law {law.name} has no quantity that is linear in the command and rises with it: "
            f"the form {form} has nothing to replace."
        )
    chosen = _Chosen(law, quantities, form, knots)
    own: dict[str, Any] = {
        "name": joined_form(law.name, form, knots), "base": law, "form": form, "knots": knots,
        "form_code": QUADRATIC if form == QUADRATIC_FORM else len(knots),
        "parameters": chosen.parameters(), "tables": chosen.tables, "shapes": chosen.shapes(),
        "command": {**law.command, **chosen.command},
        "contains": (*law.contains, CURVED), "__doc__": law.__doc__, "__module__": law.__module__,
    }  # fmt: skip
    return new_class(law.__name__, (law,), {"register": False}, lambda names: names.update(own))


class LawsByName(dict[str, Law]):
    """Laws by name; one with a chosen form is made when it is asked for."""

    def __missing__(self, name: str) -> Law:
        plain, form, knots = split_form(name)
        if not form or plain not in self:
            raise KeyError(name)
        return with_form(self[plain], form, knots)


class _Chosen:
    """What takes the place of a law's linear dependences."""

    def __init__(
        self, law: Law, quantities: Mapping[str, Linear], form: str, knots: tuple[float, ...]
    ) -> None:
        self.law, self.quantities, self.knots = law, quantities, knots
        self.command: dict[str, Form] = {}
        self.tables: dict[str, Table] = dict(law.tables)
        self.instead: dict[str, dict[str, Parameter]] = {}
        """By the name of a parameter: those that stand where it stood, itself if it stays."""
        for quantity, linear in quantities.items():
            (self._bend if form == QUADRATIC_FORM else self._tabulate)(quantity, linear)

    def _bend(self, quantity: str, linear: Linear) -> None:
        level, slope = (self.law.parameters[name] for name in linear.names())
        bend, high = f"{quantity}_bend", slope.bounds[1]
        unit, text = _per_volt_squared(level.unit), f"{_words(quantity)} per volt squared"
        self.command[quantity] = Rising(linear.level, linear.slope, bend)
        here = self.instead.setdefault(linear.slope, {linear.slope: slope})
        here[bend] = Parameter(0.0, unit, (-high, high), text)

    def _tabulate(self, quantity: str, linear: Linear) -> None:
        level, slope = (self.law.parameters[name] for name in linear.names())
        first = level.value + slope.value * self.knots[0]
        low, high = level.bounds
        gains = [slope.value * (b - a) for a, b in zip(self.knots, self.knots[1:])]
        values = tuple(min(max(value, 0.0), high) for value in (first, *gains))
        table = Table(self.knots, values, level.unit, (0.0, high), _words(quantity))
        self.command[quantity], self.tables[quantity] = Monotone(quantity), table
        names = entries(quantity, table)
        begin, *others = names
        at = f"{_words(quantity)} at {self.knots[0]:g} V and below"
        here = self.instead.setdefault(linear.level, {})
        here[begin] = Parameter(min(max(first, low), high), level.unit, (low, high), at)
        here = self.instead.setdefault(linear.slope, {})
        for name, a, b in zip(others, self.knots, self.knots[1:]):
            text = f"what the {_words(quantity)} gains from {a:g} to {b:g} V"
            here[name] = names[name]._replace(text=text)

    def parameters(self) -> dict[str, Parameter]:
        """Return the parameters of the law, the chosen ones in place of what they replace."""
        found: dict[str, Parameter] = {}
        kept = {
            name
            for quantity, form in self.law.command.items()
            if quantity not in self.quantities
            for name in form.names()
        }
        for name, parameter in self.law.parameters.items():
            if name in kept:
                found[name] = parameter
            found.update(self.instead.get(name, {name: parameter}))
        return found

    def shapes(self) -> dict[str, Any]:
        """Return the law's shapes in the names of the chosen parameters."""
        found: dict[str, Any] = {}
        for name, shape in self.law.shapes.items():
            names = tuple(n for one in shape.shapes for n in self.instead.get(one, (one,)))
            new = tuple(self.instead.get(name, (name,)))
            for one in new:
                found[one] = self._shape(name, one, len(new), shape._replace(shapes=names))
        return found

    def _shape(self, name: str, new: str, count: int, shape: Any) -> Any:
        """Return where fits look for one of the parameters that stand in place of a shape."""
        if new == name or count == 1:
            return shape
        middle = sqrt(shape.low * shape.high) / count if self.knots else _BEND_START
        return shape._replace(low=middle, high=middle, nodes=1)


def _words(quantity: str) -> str:
    return quantity.replace("_", " ")


def _per_volt_squared(unit: str) -> str:
    """Return a unit divided by V2: "N/V2" of "N", "N.s/(m.V2)" of "N.s/m"."""
    above, _, below = unit.partition("/")
    return f"{above}/({below.strip('()')}.V2)" if below else f"{above}/V2"
