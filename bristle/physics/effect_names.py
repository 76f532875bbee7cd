"""The names of effects: NAME, and NAME@SITE at another site than its first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .effect import Effect

AT = "@"
"""Stands between an effect's name and a site that is not its first."""


class Registry(dict[str, "type[Effect]"]):
    """The effects by name; NAME@SITE gives an effect as it is at another one of its sites.

    Iteration goes over the plain names.
    """

    def __missing__(self, key: str) -> type[Effect]:
        name, _, site = key.partition(AT)
        if name != key and name in self and site in self[name].sites[1:]:
            return self[name].at(site)
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        if super().__contains__(key):
            return True
        name, at, site = str(key).partition(AT)
        return bool(at) and super().__contains__(name) and site in self[name].sites[1:]

    def get(self, key: str, default: Any = None) -> Any:
        """Return the effect of a name, or of NAME@SITE; the default where there is none."""
        try:
            return self[key]
        except KeyError:
            return default


EFFECTS: Registry = Registry()


def plain_name(key: str) -> str:
    """Return the effect's name of NAME, NAME@SITE, or of either with a parameter behind it."""
    name, dot, parameter = key.partition(".")
    return name.partition(AT)[0] + dot + parameter


def exclude(one: str, other: str) -> bool:
    """Return whether two effects, by a model's names, cannot be together at one site."""
    first, second = EFFECTS[one], EFFECTS[other]
    if (AT in one or AT in other) and first.site != second.site:
        return False
    return second.name in first.excludes or first.name in second.excludes
