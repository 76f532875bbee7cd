"""How a law's quantity depends on the command, the voltage V [V] of the coil.

A form is a declaration: `command = {"yield_force": Linear("f_c", "f_v")}` in a law says that its
hooks find p.yield_force = f_c + f_v V at the voltage that the damper feels. One line of arithmetic
is generated from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import ClassVar

from .linear import Row
from .parameter import climb

Place = Callable[[str], str]
"""Name of a parameter to the source of its value; of a table to the source of its tuple."""


@dataclass(frozen=True)
class Form:
    """Base of all forms; the fields of a form name parameters of the law.

    Attributes
    ----------
    affine : bool
        Whether the quantity is linear in the voltage: such a law can be inverted.
    """

    affine: ClassVar[bool] = True

    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters, or of the table, that make the quantity."""
        return tuple(str(getattr(self, field.name)) for field in fields(self))

    def driven(self) -> tuple[str, ...]:
        """Return the parameters that act through the voltage alone."""
        return self.names()[1:]

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of the quantity at `V`; `knots` is that of the table's knots."""
        raise NotImplementedError


@dataclass(frozen=True)
class Constant(Form):
    """The same at every voltage."""

    level: str

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of level."""
        return at(self.level)


@dataclass(frozen=True)
class Linear(Form):
    """level + slope V."""

    level: str
    slope: str

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of level + slope V."""
        return f"{at(self.level)} + {at(self.slope)} * {V}"


@dataclass(frozen=True)
class Quadratic(Form):
    """level + slope V + bend V^2."""

    level: str
    slope: str
    bend: str
    affine: ClassVar[bool] = False

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of level + slope V + bend V^2."""
        return f"{at(self.level)} + {V} * ({at(self.slope)} + {V} * {at(self.bend)})"


def rising(level: float, slope: float, bend: float, V: float) -> float:
    """Return level + slope V + bend V^2 up to where that is largest, and the same beyond.

    Parameters
    ----------
    level, slope, bend : in the quantity's unit, per volt, per volt squared; the slope not negative
    V : voltage [V]
    """
    if bend < 0.0:
        V = min(V, -0.5 * slope / bend)
    return level + V * (slope + V * bend)


@dataclass(frozen=True)
class Rising(Form):
    """level + slope V + bend V^2 that never falls: where it would it keeps its largest value.

    With a slope of zero or more; a curve that bends down stands for a magnet that saturates.
    """

    level: str
    slope: str
    bend: str
    affine: ClassVar[bool] = False

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of the rising parabola at V."""
        return f"rising({at(self.level)}, {at(self.slope)}, {at(self.bend)}, {V})"


@dataclass(frozen=True)
class Monotone(Form):
    """A table over the voltage that never falls: its first value, then what it gains to each knot.

    The table's knots are voltages [V], its bounds begin at 0. See `parameter.climb`.
    """

    table: str
    affine: ClassVar[bool] = False

    def source(self, at: Place, knots: str, V: str = "V") -> str:
        """Return the source of the climbing line at V."""
        return f"climb({V}, {knots}, {at(self.table)})"


MOST_KNOTS = 6
"""Knots that a table may have that takes the place of a linear dependence."""

LINEAR, QUADRATIC = 0, 1
"""Codes of how the command enters where a user may choose it; of a table its number of knots."""


def entered(form: int, p: Row, place: int, quantity: int, V: float) -> float:
    """Return a quantity at V [V] that a user chose to give by a table over the command.

    Parameters
    ----------
    form : number of the table's knots
    p : flat parameters, from `place` on: the knots [V] of a table, then the numbers of each
        quantity, `MOST_KNOTS` of room for each
    quantity : which one it is among those of the law
    """
    own = place + MOST_KNOTS * (quantity + 1)
    return climb(V, p[place : place + form], p[own : own + form])


def chosen_source(linear: str, place: int, quantity: int, V: str) -> str:
    """Return the source of a quantity whose dependence on the command may be chosen.

    The parabola stands in the source itself: a call of `entered` takes as long as a whole step of
    a simple law.

    Parameters
    ----------
    linear : source of the law's own dependence
    place, quantity : as of `entered`
    V : source of the voltage [V]
    """
    own = place + MOST_KNOTS * (quantity + 1)
    bent = f"rising(p[{own}], p[{own + 1}], p[{own + 2}], {V})"
    table = f"entered(form, p, {place}, {quantity}, {V})"
    return f"({linear} if form == {LINEAR} else {bent} if form == {QUADRATIC} else {table})"
