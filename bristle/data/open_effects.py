"""Effects that runs do not exclude, up to their 95 % limits, as verdict.json tells them.

The size of such an effect is drawn: half-normal, so that its 95 % point is the limit, and to either
side where the effect has a sign. A fit of runs with it would have moved the model's own parameters,
which move along with the draw.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import StudyError
from ..findings import command
from ..physics.effect import EFFECTS, exclude
from ..physics.forms import joined_form
from ..units import convert
from .study_model import StudyModel

Array = NDArray[np.float64]

POINT = 1.96
"""Standard deviations of a normal size at its limit: 95 % are smaller, whatever their sign."""


@dataclass(frozen=True)
class OpenEffect:
    """An effect that a verdict's runs do not exclude.

    `name` as a model has it, `label` with the site where several have it; `limit` of its
    `parameter` [SI], a lower one where the effect vanishes as that grows (`falls`); `others` its
    other parameters [SI]; `moved` by how much the model's own parameters [SI] move with an effect
    of that size.
    """

    name: str
    label: str
    parameter: str
    limit: float
    falls: bool
    others: Mapping[str, float]
    moved: Mapping[str, float]

    @property
    def signed(self) -> bool:
        """Whether the effect may have either sign."""
        return not self.falls and EFFECTS[self.name].parameters[self.parameter].bounds[0] < 0.0

    def parts(self, count: int) -> list[float]:
        """Return sizes over the limit, each for an equal share of what may be.

        Their mean square is that of all sizes, however few they are.

        Parameters
        ----------
        count : how many
        """
        found = [self.part((k + 0.5) / count) for k in range(count)]
        power = sum(one**2 for one in found) / count
        return [one / (POINT * sqrt(power)) for one in found]

    def part(self, share: float) -> float:
        """Return the size over the limit below which a share of the sizes are, 0 < share < 1."""
        return NormalDist().inv_cdf(share if self.signed else 0.5 * (1.0 + share)) / POINT

    def own(self, part: float) -> dict[str, float]:
        """Return the effect's parameters [SI] at a size over its limit, within their bounds.

        Parameters
        ----------
        part : the size over the limit; 0 is none of the effect
        """
        declared = EFFECTS[self.name].parameters
        found = {}
        for name, parameter in declared.items():
            low, high = parameter.bounds
            value = self.others.get(name, 0.0 if low <= 0.0 <= high else parameter.value)
            if name == self.parameter:
                value = self._amount(part, high)
            found[name] = min(max(value, low), high)
        return found

    def _amount(self, part: float, most: float) -> float:
        if not self.falls:
            return self.limit * part
        return self.limit / abs(part) if part else most

    def joined(self, model: StudyModel, part: float) -> StudyModel:
        """Return a model with the effect at a size over its limit, its own parameters moved.

        Parameters
        ----------
        model : whose parameters may be draws
        part : the size over the limit
        """
        flat, values = model.flat(), model.values()
        out = model.with_effect(self.name)
        new = {f"{self.name}.{name}": value for name, value in self.own(part).items()}
        for name, by in self.moved.items():
            if name in flat and flat[name].free:
                unit, own = model.declared(name).unit, flat[name]
                low, high = (convert(end, own.unit, unit) for end in (own.low, own.high))
                new[name] = min(max(values[name] + by * part, low), high)
        return out.with_values(new, origin="assumed")


def reach(changes: Array) -> tuple[float, float]:
    """Return how far an effect takes a figure down, and up, at 95 %.

    Parameters
    ----------
    changes : (n,) of the figure, by draws of the effect's size
    """
    ends = [changes[sign * changes > 0.0] for sign in (-1.0, 1.0)]
    below, above = (POINT * float(np.sqrt(np.mean(end**2))) if end.size else 0.0 for end in ends)
    return below, above


def open_effects(
    verdict: Mapping[str, Any], model: StudyModel
) -> tuple[list[OpenEffect], list[str]]:
    """Return the effects that a verdict's runs do not exclude, and those without a limit.

    Parameters
    ----------
    verdict : the content of verdict.json
    model : which they may join
    """
    found: dict[str, OpenEffect] = {}
    unlimited = []
    for finding in verdict.get("findings") or []:
        for one in finding.get("limits") or []:
            name = str(one["effect"])
            if name not in EFFECTS or any(_clash(name, other) for other in model.effects):
                continue
            if one.get("why"):
                # What a parameter of a known effect takes up is in the band of that parameter.
                if str(one["why"]).partition(".")[0] not in model.effects:
                    unlimited.append(name)
                continue
            label = name if name not in found else f"{name} ({finding['site']})"
            found[label] = OpenEffect(
                name, label, one["parameter"], float(one["limit95"]), one["side"] == "above",
                _others(finding["site"], name, one["others"]), one["moved"],
            )  # fmt: skip
    return list(found.values()), [name for name in dict.fromkeys(unlimited) if name not in found]


def left_open(
    verdict: Mapping[str, Any] | None, model: StudyModel, folder: Path
) -> tuple[list[OpenEffect], list[str]]:
    """Return the effects that a study's verdict does not exclude, and notes on the others.

    Parameters
    ----------
    verdict : the content of its verdict.json, None where there is none
    model : its present model
    folder : the study's, for messages

    Raises
    ------
    StudyError
        If there is no verdict, it has no limits, or it is on another model than the present one.
    """
    again = command("diagnose", folder)
    if verdict is None:
        raise StudyError(
            f"{folder}: there is no verdict, whose limits --with-limits draws from:  {again}"
        )
    lacking = [name for name in verdict["effects"] if name not in model.effects]
    if verdict["kind"] in ("effect", "ambiguous") and lacking:
        raise StudyError(
            f"{folder}: the verdict names {', '.join(lacking)}, and its limits hold beside it. "
            f"First:  {command('add', folder, lacking[0])}  and  {again}"
        )
    if verdict.get("laws") and joined_form(verdict["law"], verdict["command"]) != model.law:
        raise StudyError(
            f"{folder}: the verdict's law is {verdict['law']}, and the model's {model.law}. "
            f"Identify the one that is right, then:  {again}"
        )
    sized = [one for found in verdict["findings"] for one in found.get("limits") or []]
    if any("moved" not in one for one in sized if not one.get("why")):
        raise StudyError(
            f"{folder}: an older version of bristle made the verdict, and it does not tell how its "
            f"effects move the model's parameters. First:  {again}"
        )
    effects, unlimited = open_effects(verdict, model)
    if not effects:
        raise StudyError(f"{folder}: the verdict has no limits of effects. First:  {again}")
    if not unlimited:
        return effects, []
    return effects, [
        f"the runs cannot show {', '.join(unlimited)}: no band has them. To make them visible:  "
        f"{command('plan', folder, '--see', *unlimited)}"
    ]


def _clash(name: str, other: str) -> bool:
    return name == other or exclude(name, other)


def _others(site: str, name: str, told: Mapping[str, float]) -> dict[str, float]:
    """Return the other parameters of an effect; one that has a storey is in that of its site."""
    at = {"which": float(site.removeprefix("storey"))} if site.startswith("storey") else {}
    return {**told, **{key: value for key, value in at.items() if key in EFFECTS[name].parameters}}
