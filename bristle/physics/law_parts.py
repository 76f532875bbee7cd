"""Which parameters of a damper's law make which of its parts."""

from __future__ import annotations

_YIELD = {"bingham": ("f_c", "f_v"), "lugre": ("sigma_a", "sigma_0")}


def yield_parameters(law: str) -> tuple[str, ...]:
    """Return the parameters of a law that make its yield force; none of a law that does not."""
    return _YIELD.get(law, ())
