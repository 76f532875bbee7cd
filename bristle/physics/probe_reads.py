"""Which signals a hook reads, by whatever way: a function that it calls, another name, an index."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from .effect import OFFERED, Effect, Q
from .user_text import FlawError

_STATES = ("rate", "advance")


def refuse_reads(effect: type[Effect], hook: str, q: Q, z: Any, p: Any) -> None:
    """Refuse a hook that reads a signal which `needs` does not name, or which is 0 there.

    Parameters
    ----------
    effect, hook : the class and one of its hooks
    q, z, p : what the hook is called with; it is known to take them

    Raises
    ------
    FlawError
        Naming the signal.
    """
    function = getattr(effect, hook)
    line = function.__code__.co_firstlineno + 1
    found = _reads(function, q, z, p)
    for site in effect.sites:
        offered = _offered(effect, hook, site)
        for name in (one for one in Q._fields if one in found):
            if name not in offered:
                raise FlawError(
                    f"{hook} reads q.{name}, which is 0 there; it may read {', '.join(offered)}.",
                    line,
                )
            if name not in effect.needs:
                raise FlawError(f'{hook} reads q.{name}: add "{name}" to needs.', line)


def _offered(effect: type[Effect], hook: str, site: str) -> tuple[str, ...]:
    """Return the signals that a hook gets at a site; all others are 0."""
    zero: tuple[str, ...] = ()
    if site == "structure":
        zero = _zero_in_structure(hook, effect.hooks())
    elif site == "damper" and hook not in (*_STATES, "reaction"):
        # The law's force is known to what is computed after it alone.
        zero = () if effect.contact and hook == "force" else ("force",)
    return tuple(name for name in OFFERED[site] if name not in zero)


def _zero_in_structure(hook: str, hooks: Collection[str]) -> tuple[str, ...]:
    """Return the signals that are 0 where a structure calls a hook.

    `force` is called for the isolation layer, which has x and v, and `spring` for each storey,
    which has a drift; states move on beside either, and know its force.
    """
    moves_on = hook in _STATES
    if moves_on and "force" in hooks and "spring" in hooks:
        return ()
    of_storey = hook == "spring" or (moves_on and "spring" in hooks)
    zero = ("x", "v") if of_storey else ("drift", "drift_rate", "storey")
    return zero if moves_on else (*zero, "force")


def _reads(function: Any, q: Q, z: Any, p: Any) -> set[str]:
    """Return the signals that a hook reads of q."""
    found: set[str] = set()

    class Watched(Q):
        """Signals that tell which of them are read."""

        def __getattribute__(self, name: str) -> Any:
            if name in Q._fields:
                found.add(name)
            return super().__getattribute__(name)

        def __getitem__(self, key: Any) -> Any:
            read = Q._fields[key]
            found.update(read if isinstance(read, tuple) else (read,))
            return super().__getitem__(key)

    function(Watched(*q), z, p)
    return found
