"""What a Python shell shows of a result: its words, not its arrays."""

from __future__ import annotations

from collections.abc import Iterable


def shown(of: object, about: str, lines: Iterable[str] = ()) -> str:
    """Return the text of `repr`: the class with what it is about, and a line each below.

    Parameters
    ----------
    of : object
        The result.
    about : str
        Behind the name of its class; "" for nothing.
    lines : iterable of str
        What it says.

    Examples
    --------
    >>> shown(1.5, "a number", ["It is small."])
    '<float: a number>\\n  It is small.'
    """
    head = type(of).__name__ + (f": {about}" if about else "")
    return "\n".join([f"<{head}>", *(f"  {line}" for line in lines)])
