"""Numbers of laws and effects: parameters and tables, their checks, and how a table is read."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

from ..errors import PhysicsError

CHOICES = ("exponent", "mass", "which")
"""Parameters that choose a form or regularise: no fit moves them."""


class Parameter(NamedTuple):
    """A number of a law or effect.

    Attributes
    ----------
    value : float
        Default value.
    unit : str
        SI unit, "1" without one.
    bounds : tuple of float
        Least and largest value that is physical.
    text : str
        What it is, in a few words.

    Examples
    --------
    >>> import bristle
    >>> bristle.Parameter(300.0, "N/m", (0.0, 1e5), "stiffness of the spring").unit
    'N/m'
    """

    value: float
    unit: str
    bounds: tuple[float, float]
    text: str


class Table(NamedTuple):
    """A row of numbers of a law or effect, one per knot; the knots are fixed, the values fitted.

    `knots` ascend, in SI; `values` are the defaults, `unit` and `bounds` theirs. Each value is a
    parameter of its own, named `curve[1]`, `curve[2]` ...; a hook reads all as the tuple `p.curve`.
    """

    knots: tuple[float, ...]
    values: tuple[float, ...]
    unit: str
    bounds: tuple[float, float]
    text: str


def interpolate(x: float, knots: tuple[float, ...], values: tuple[float, ...]) -> float:
    """Return the value at x of the broken line through (knots, values).

    Beyond the first and the last knot it keeps the value there.
    """
    if x <= knots[0]:
        return values[0]
    for k in range(1, len(knots)):
        if x < knots[k]:
            share = (x - knots[k - 1]) / (knots[k] - knots[k - 1])
            return values[k - 1] + share * (values[k] - values[k - 1])
    return values[len(knots) - 1]


def bilinear(
    x: float, y: float, knots: tuple[float, ...], levels: tuple[float, ...],
    rows: tuple[tuple[float, ...], ...],
) -> float:  # fmt: skip
    """Return the value at (x, y) of a surface: linear in x and in y, constant beyond its ends.

    Parameters
    ----------
    x, y : the two signals, in SI
    knots, levels : where the surface is given along x and along y, ascending
    rows : its values at the knots, a row for each level
    """
    k = 1
    while k < len(knots) - 1 and x >= knots[k]:
        k += 1
    n = 1
    while n < len(levels) - 1 and y >= levels[n]:
        n += 1
    share = min(max((x - knots[k - 1]) / (knots[k] - knots[k - 1]), 0.0), 1.0)
    high = min(max((y - levels[n - 1]) / (levels[n] - levels[n - 1]), 0.0), 1.0)
    below = rows[n - 1][k - 1] + share * (rows[n - 1][k] - rows[n - 1][k - 1])
    above = rows[n][k - 1] + share * (rows[n][k] - rows[n][k - 1])
    return below + high * (above - below)


def climb(x: float, knots: tuple[float, ...], rises: tuple[float, ...]) -> float:
    """Return the value at x of the broken line that begins at rises[0] and then gains each rise.

    It climbs by rises[k] between the knots k - 1 and k: where no rise is negative it never falls.
    """
    total = rises[0]
    for k in range(1, len(knots)):
        share = (x - knots[k - 1]) / (knots[k] - knots[k - 1])
        total += rises[k] * min(max(share, 0.0), 1.0)
    return total


def entries(name: str, table: Table) -> dict[str, Parameter]:
    """Return the parameters that a table stands for: `name[1]`, `name[2]` ..."""
    return {
        f"{name}[{k}]": Parameter(value, table.unit, table.bounds, f"{table.text}, at {knot:g}")
        for k, (knot, value) in enumerate(zip(table.knots, table.values), 1)
    }


def all_parameters(
    parameters: Mapping[str, Parameter], tables: Mapping[str, Table]
) -> dict[str, Parameter]:
    """Return a class's parameters and, after them, the values of its tables."""
    found = dict(parameters)
    for name, table in tables.items():
        found.update(entries(name, table))
    return found


def check_numbers(
    where: str, parameters: Mapping[str, Parameter], tables: Mapping[str, Table]
) -> None:
    """Refuse numbers that could not work.

    Raises
    ------
    PhysicsError
        If a default lies outside its bounds, or a table's knots do not ascend or match its values.
    """
    for name, table in tables.items():
        knots = tuple(table.knots)
        if not name.isidentifier():
            raise PhysicsError(f"{where}: a table cannot be named {name!r}; a word is right.")
        if len(knots) < 2 or any(b <= a for a, b in zip(knots, knots[1:])):
            raise PhysicsError(
                f"{where}: the knots of {name}, {knots}, must be two or more, ascending."
            )
        if len(table.values) != len(knots):
            raise PhysicsError(
                f"{where}: {name} has {len(knots)} knots and {len(table.values)} values."
            )
    for name, parameter in parameters.items():
        low, high = parameter.bounds
        if not low <= parameter.value <= high:
            raise PhysicsError(f"{where}: {name} = {parameter.value} lies outside {(low, high)}.")


def fields_of(
    parameters: Mapping[str, Parameter], tables: Mapping[str, Table]
) -> dict[str, tuple[str, ...]]:
    """Return what a hook's `p` holds: field to the parameters in it, several for a table."""
    listed = {name: tuple(entries(name, table)) for name, table in tables.items()}
    inside = {entry for names in listed.values() for entry in names}
    return {**{name: (name,) for name in parameters if name not in inside}, **listed}


def named(kind: str, fields: Sequence[str]) -> Any:
    """Return a named tuple class; what is used inside hooks is one."""
    return namedtuple(kind, tuple(fields))


LARGEST = 10**308
"""The largest whole number of a law or effect: beyond it there is no float."""

_Right = Callable[[Any], bool]


def first_line(cls: type) -> str:
    """Return the first line of a class's docstring, which users read."""
    return (cls.__doc__ or "").strip().splitlines()[0]


def refuse_twin(word: str, cls: Any, known: Any) -> None:
    """Refuse a second law or effect of a name, unless its own file defines it anew.

    Parameters
    ----------
    word : "effect" or "law"
    cls : the class, with `name`
    known : that which is registered under the name, None where there is none
    """
    if known is not None and known.__module__ != cls.__module__:
        raise PhysicsError(
            f"{word} {cls.name!r} ({cls.__module__}.{cls.__qualname__}): the name is taken by "
            f"{known.__module__}.{known.__qualname__}. Another name is right."
        )


def class_text(word: str, cls: Any) -> str:
    """Return how a message names a class: by its name, and where that is not in a file of a user's.

    Parameters
    ----------
    word : "effect" or "law"
    cls : the class, with `name`
    """
    own = cls.__module__.startswith("bristle_own_")  # user.PACKAGE: the file is told already
    where = "" if own else f" ({cls.__module__}.{cls.__qualname__})"
    return f"{word} {cls.name!r}{where}"


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _switch(value: Any) -> bool:
    return isinstance(value, bool)


def _real(value: Any) -> bool:
    if isinstance(value, int) and abs(value) > LARGEST:
        return False  # no float: whatever computes with it would raise
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _number(value: Any) -> bool:
    return _real(value) and isfinite(value)


def _any(value: Any) -> bool:
    return True


def tuple_of(right: _Right) -> _Right:
    """Return what says whether a value is a tuple of what is `right`."""
    return lambda value: isinstance(value, tuple) and all(map(right, value))


def by_name(right: _Right) -> _Right:
    """Return what says whether a value is a dictionary, by name, of what is `right`."""

    def check(value: Any) -> bool:
        if not isinstance(value, Mapping):
            return False
        return all(_text(name) and right(one) for name, one in value.items())

    return check


def _declared(value: Any) -> bool:
    """Return whether unit, bounds and text of a parameter or table are of their kinds."""
    bounded = tuple_of(_real)(value.bounds) and len(value.bounds) == 2
    return bounded and _text(value.unit) and _text(value.text)


def _parameter(value: Any) -> bool:
    # What is not finite lies outside its bounds, and is told so.
    return isinstance(value, Parameter) and _real(value.value) and _declared(value)


def _table(value: Any) -> bool:
    numbers = tuple_of(_number)
    return (
        isinstance(value, Table)
        and numbers(value.knots)
        and numbers(value.values)
        and _declared(value)
    )


TEXT: tuple[str, _Right] = ("a text in quotes", _text)
SWITCH: tuple[str, _Right] = ("True or False", _switch)
TEXTS: tuple[str, _Right] = ('a tuple of texts such as ("x", "v")', tuple_of(_text))
TEXT_BY_NAME: tuple[str, _Right] = ('a dictionary such as {"name": "text"}', by_name(_text))
PARAMETERS: tuple[str, _Right] = (
    'a dictionary such as {"k": Parameter(80.0, "N/m", (0.0, 1e6), "stiffness")}',
    by_name(_parameter),
)
TABLES: tuple[str, _Right] = (
    'a dictionary such as {"curve": Table((0.0, 1.0), (1.0, 2.0), "N", (0.0, 9.0), "text")}',
    by_name(_table),
)
ANY_BY_NAME: tuple[str, _Right] = ("a dictionary by name", by_name(_any))
GRIDS: tuple[str, _Right] = ("a tuple of dictionaries", tuple_of(by_name(_any)))
"""What is in the grids `effect.check_search` asks."""


def check_fields(cls: type, where: str, kinds: Mapping[str, tuple[str, _Right]]) -> None:
    """Refuse class data of another kind.

    Parameters
    ----------
    cls : the class of a law or an effect
    where : what the message begins with
    kinds : field to what is right in words, and whether a value is

    Raises
    ------
    PhysicsError
        Naming the first field that is not right.
    """
    for field, (words, right) in kinds.items():
        value = getattr(cls, field, None)
        try:
            good = right(value)
        except Exception:  # a class of the user's own may raise whatever it likes
            good = False
        if not good:
            raise PhysicsError(f"{where}: {field} = {_shown(value)}; {words} is right.")


def _shown(value: Any) -> str:
    """Return the beginning of what a value looks like, for a message."""
    try:
        text = repr(value)
    except Exception:  # a whole number of thousands of digits; a class of the user's own
        return f"a {type(value).__name__} that cannot be written"
    return text if len(text) <= 60 else text[:57] + "..."
