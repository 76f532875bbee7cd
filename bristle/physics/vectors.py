"""Sums over rows, in plain Python so that `jit` compiles them into what asks for them."""

from __future__ import annotations

from typing import Any


def dot(a: Any, b: Any) -> float:
    """Return the product of two rows of one length, in the product of their units."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total
