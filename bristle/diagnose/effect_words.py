"""What the values of a named effect mean, in sentences for the verdict."""

from __future__ import annotations

from ..physics.effect import EFFECTS
from .finding import Finding


def effect_words(found: Finding) -> list[str]:
    """Return what the values of a site's effects mean, of those that say it.

    Parameters
    ----------
    found : the site's finding
    """
    if found.kind != "effect" or found.after is None:
        return []
    model = found.after.model
    out = []
    for name in (one for one in found.effects if one in EFFECTS and one in model.effects):
        effect = EFFECTS[name]
        if hasattr(effect, "in_words"):
            values = {own: model.value(f"{name}.{own}") for own in effect.parameters}
            out.append(str(effect.in_words(effect.values_of(values))))
    return out
