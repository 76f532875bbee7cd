"""Parameters of effects that are known of each run, such as its temperature."""

from __future__ import annotations

from collections.abc import Iterable

from ..data.labels import Labels
from ..physics.effect import EFFECTS, Effect


def told_by(effect: type[Effect], parameter: str) -> str:
    """Return the label of runs that a parameter of an effect is, or the mean of; else ""."""
    return effect.labels.get(parameter) or effect.label_means.get(parameter, "")


def values_of_labels(effects: Iterable[str], labels: Labels) -> dict[str, float]:
    """Return the values of effects that are labels of a run, by the names of a model."""
    known = {
        f"{name}.{own}": labels[label]
        for name in effects
        for own, label in EFFECTS[name].labels.items()
        if label in labels
    }
    return {name: value for name, value in known.items() if not isinstance(value, str)}
