"""Calls a hook of a user's, and says what is wrong with what it gives."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from math import isfinite
from typing import Any

from .user_text import FlawError

ROUNDING = 1e-12
"""Change of a hook, by its size, that is none."""

JUMP = 1e-3
"""A change within nothing, by the whole range of a hook, that counts as a jump."""


def call(
    function: Callable[..., Any],
    given: tuple[Any, Any, Any],
    count: int | None,
    place: Callable[[], str],
    finite: bool = True,
) -> tuple[float, ...]:
    """Return what a hook gives, as a tuple.

    Parameters
    ----------
    function : the hook
    given : its q, z, p
    count : how many numbers its tuple must hold; None: it returns a number
    place : says where it was called, in words
    finite : whether the numbers must be finite

    Raises
    ------
    FlawError
        If that is not right.
    """
    hook, line = function.__name__, function.__code__.co_firstlineno + 1
    try:
        found = function(*given)
    except Exception as error:  # a hook of the user's own may raise whatever it likes
        frames = traceback.extract_tb(error.__traceback__)
        inner = [f.lineno for f in frames if f.filename == function.__code__.co_filename]
        raise FlawError(
            f"{hook} raises {type(error).__name__}: {error}, at {place()}.",
            (inner[-1] or 0) if inner else line,
        ) from None
    if count is not None:
        if not isinstance(found, tuple) or len(found) != count:
            what = "x, v" if hook == "motion" else f"a tuple of {count}: the states"
            raise FlawError(f"{hook} returns {found!r}; {what} is right.", line)
    else:
        found = (found,)
    for value in found:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FlawError(f"{hook} returns {value!r}; a number is right.", line)
        if finite and not isfinite(value):
            raise FlawError(f"{hook} returns {value!r} at {place()}.", line)
    return tuple(float(value) for value in found)


def refuse_jump(
    function: Callable[..., Any],
    given: Callable[[float], tuple[float, ...]],
    between: tuple[float, float],
    what: str,
    count: int = 40,
) -> bool:
    """Refuse a hook that jumps between two values; return whether it changes at all.

    Parameters
    ----------
    function : the hook
    given : what it gives, over one of its signals or parameters
    between : low and high of that one
    what : its name, as in "q.v"
    count : at how many values it is looked at first

    Raises
    ------
    FlawError
        If it jumps.
    """
    low, high = between
    points = [low + (high - low) * (k + 0.37) / count for k in range(-1, count + 1)]
    points = [min(max(point, low), high) for point in points]
    rows = [given(point) for point in points]
    moved = False
    for column in range(len(rows[0])):
        values = [row[column] for row in rows]
        size = max(values) - min(values)
        if size <= ROUNDING * max(map(abs, values)):
            continue
        moved = True
        steps = [abs(b - a) for a, b in zip(values, values[1:])]
        k = steps.index(max(steps))
        a, b = points[k], points[k + 1]
        left, right = values[k], values[k + 1]
        for _ in range(50):
            middle = 0.5 * (a + b)
            between_them = given(middle)[column]
            if abs(between_them - left) >= abs(right - between_them):
                b, right = middle, between_them
            else:
                a, left = middle, between_them
        if abs(right - left) > JUMP * size:
            raise FlawError(
                f"{function.__name__} jumps by {abs(right - left):.3g} with {what}: it is not "
                "differentiable, and no fit could follow it. A smooth step such as tanh(v/v_s) is "
                "right.",
                function.__code__.co_firstlineno + 1,
            )
    return moved
