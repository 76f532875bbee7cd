"""Parameters of effects that are known of each run: its temperature, a pressure at each sample."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..data.extra import Extra
from ..data.labels import Labels
from ..errors import RecordError
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


def tracks_of(
    effects: Iterable[str], extra: Mapping[str, Extra], run: str
) -> dict[str, NDArray[np.float64]]:
    """Return the values (n,) over a run of parameters that follow its channels, by name.

    Parameters
    ----------
    effects : of a model
    extra : the run's channels besides those that bristle knows
    run : its name, for messages

    Raises
    ------
    RecordError
        If the run lacks a channel, or has it in another unit.
    """
    out = {}
    for parameter, channel in following(effects).items():
        name, _, own = parameter.partition(".")
        if channel not in extra:
            raise RecordError(
                f"{run}: the effect {name} follows the channel {channel}, which this run does not "
                "hold: [extra] in study.toml names the column. Leave the run out, or the effect."
            )
        unit = EFFECTS[name].parameters[own].unit
        if extra[channel].known_unit != unit:
            raise RecordError(
                f"{run}: {channel} is in {extra[channel].unit}, and the effect {name} follows it "
                f"in {unit}: the unit in [extra.{channel}] of study.toml has changed."
            )
        out[parameter] = extra[channel].values
    return out


def at_means(measured: Sequence[Mapping[str, Extra]], count: int) -> dict[str, Extra]:
    """Return the extra channels that all runs have, at their mean, for a run that was not measured.

    Parameters
    ----------
    measured : those of each measured run
    count : samples of the other run
    """
    out = {}
    for name, one in measured[0].items():
        if all(name in run for run in measured):
            mean = float(np.mean([np.mean(run[name].values) for run in measured]))
            out[name] = Extra(np.full(count, mean), one.unit)
    return out


def following(effects: Iterable[str]) -> dict[str, str]:
    """Return the parameters of a model's effects that follow a channel, with the channel's name."""
    return {
        f"{name}.{own}": channel
        for name in effects
        for own, channel in EFFECTS[name].channels.items()
    }
