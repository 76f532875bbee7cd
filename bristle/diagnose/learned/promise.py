"""What a curve promises before it is fitted inside a model, and which promises differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .curve import Curve
from .rule import LEARN


@dataclass(frozen=True)
class Promise:
    """A curve with what it promises: `loss` the mean squared residual where it was not fitted."""

    curve: Curve
    loss: float


def distinct(found: Sequence[Promise], count: int, near: float = LEARN.near) -> list[Promise]:
    """Return the best promises of different parts and signals, those near the best one alone.

    A curve that contains a better one of the same part is left out.

    Parameters
    ----------
    found : the best first
    count : how many at most
    near : times the loss of the best one
    """
    first: dict[tuple[str, str, str], Promise] = {}
    for one in found:
        special = (one.curve.part, one.curve.signal.contains, "")
        if one.loss <= near * found[0].loss and special not in first:
            first.setdefault(one.curve.kind, one)
    return list(first.values())[:count]
