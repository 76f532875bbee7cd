"""Dates and times of day, as recorders of several countries write them, as seconds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np

from ...core.arrays import Array

_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
_DATES = (
    "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y", "%Y/%m/%d", "%d-%m-%Y",
    "%m-%d-%Y",
)  # fmt: skip
_FORMS = (*(f"{date} {clock}" for date in _DATES for clock in _CLOCKS), *_CLOCKS)
_DAY = 86400.0


def seconds_of(texts: Sequence[str]) -> Array | None:
    """Return instants as seconds since the first (n,), None where they are none.

    ISO 8601, `12.03.2024 10:00:00.000` and its like, or a time of day alone, which may pass
    midnight; seconds with a point or a comma. Of `03/12/2024` either number may be the month, which
    matters where a date changes: what gives the shorter record counts, else the day comes first.
    """
    plain = [text.strip().strip('"').strip() for text in texts]
    if not plain or not plain[0]:
        return None
    found = _by_iso(plain)
    if found is None:
        plain = [_with_point(text) for text in plain]
        able = (one for form in _FORMS if (one := _by_form(plain, form)) is not None)
        day, last = (text.partition(" ")[0] for text in (plain[0], plain[-1]))
        found = (
            next(able, None) if day == last or ":" in day else min(able, key=_span, default=None)
        )
    if found is None:
        return None
    instants, clock = found
    try:
        seconds = np.array([(one - instants[0]).total_seconds() for one in instants])
    except TypeError:  # some have a time zone, some none: nothing tells how far apart they are
        return None
    if clock:
        seconds += _DAY * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -0.5 * _DAY)
    return seconds


def _span(found: tuple[list[datetime], bool]) -> timedelta:
    """Return how long instants with a date last."""
    return max(found[0]) - min(found[0])


def _by_iso(texts: Sequence[str]) -> tuple[list[datetime], bool] | None:
    try:
        return [datetime.fromisoformat(text) for text in texts], False
    except ValueError:
        return None


def _by_form(texts: Sequence[str], form: str) -> tuple[list[datetime], bool] | None:
    try:
        _read(texts[0], form)  # most forms fail here
        return [_read(text, form) for text in texts], form in _CLOCKS
    except ValueError:
        return None


def _read(text: str, form: str) -> datetime:
    """Return an instant; whole seconds may be written without their fraction."""
    try:
        return datetime.strptime(text, form)
    except ValueError:
        if ".%f" not in form:
            raise
        return datetime.strptime(text, form.replace(".%f", ""))


def _with_point(text: str) -> str:
    """Return a text with at most six digits of seconds, after a point."""
    day, colon, rest = text.rpartition(":")
    seconds, mark, more = rest.replace(",", ".").partition(".")
    digits = more[: len(more) - len(more.lstrip("0123456789"))]
    return f"{day}{colon}{seconds}{mark}{digits[:6]}{more[len(digits) :]}" if colon else text
