"""Whether class data are of the kind that they must be, asked before anything uses them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any

from ..errors import PhysicsError
from .parameter import Parameter, Table

LARGEST = 10**308
"""The largest whole number of a law or effect: beyond it there is no float."""

_Right = Callable[[Any], bool]


def told(word: str, cls: Any) -> str:
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


def _texts(value: Any) -> bool:
    return isinstance(value, tuple) and all(map(_text, value))


def _numbers(value: Any) -> bool:
    return isinstance(value, tuple) and all(map(_number, value))


def _by_name(right: _Right) -> _Right:
    def check(value: Any) -> bool:
        if not isinstance(value, Mapping):
            return False
        return all(_text(name) and right(one) for name, one in value.items())

    return check


def _bounded(value: Any) -> bool:
    low_high = isinstance(value, tuple) and len(value) == 2
    return low_high and all(map(_real, value))


def _parameter(value: Any) -> bool:
    return (
        isinstance(value, Parameter)
        and _real(value.value)  # what is not finite lies outside its bounds, and is told so
        and _text(value.unit)
        and _bounded(value.bounds)
        and _text(value.text)
    )


def _table(value: Any) -> bool:
    return (
        isinstance(value, Table)
        and _numbers(value.knots)
        and _numbers(value.values)
        and _text(value.unit)
        and _bounded(value.bounds)
        and _text(value.text)
    )


def _grids(value: Any) -> bool:
    grid = _by_name(lambda one: True)  # what is in it `effect_check` asks
    return isinstance(value, tuple) and all(map(grid, value))


TEXT: tuple[str, _Right] = ("a text in quotes", _text)
SWITCH: tuple[str, _Right] = ("True or False", _switch)
TEXTS: tuple[str, _Right] = ('a tuple of texts such as ("x", "v")', _texts)
TEXT_BY_NAME: tuple[str, _Right] = ('a dictionary such as {"name": "text"}', _by_name(_text))
PARAMETERS: tuple[str, _Right] = (
    'a dictionary such as {"k": Parameter(80.0, "N/m", (0.0, 1e6), "stiffness")}',
    _by_name(_parameter),
)
TABLES: tuple[str, _Right] = (
    'a dictionary such as {"curve": Table((0.0, 1.0), (1.0, 2.0), "N", (0.0, 9.0), "text")}',
    _by_name(_table),
)
ANY_BY_NAME: tuple[str, _Right] = ("a dictionary by name", _by_name(lambda one: True))
GRIDS: tuple[str, _Right] = ("a tuple of dictionaries", _grids)


def by_name(what: str, right: _Right) -> tuple[str, _Right]:
    """Return the kind of a dictionary of what is `right`, in words `what`."""
    return what, _by_name(right)


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
