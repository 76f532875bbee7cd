"""Draws of a model, and of effects that runs do not exclude, up to their 95 % limits.

The size of such an effect is drawn: half-normal, so that its 95 % point is the limit, and to either
side where the effect has a sign. A fit of runs with it would have moved the model's own parameters,
which move along with the draw.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from statistics import NormalDist
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..core.arrays import Array
from ..core.text import command
from ..errors import StudyError
from ..physics.effect import EFFECTS, exclude
from ..physics.forms import joined_form
from .model import Model

POINT = 1.96
"""Standard deviations of a normal size at its limit: 95 % are smaller, whatever their sign."""
WORTH = 0.1
"""Share of the variance of bands from which an effect is worth a test."""

T = TypeVar("T")


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

    def joined(self, model: Model, part: float) -> Model:
        """Return a model with the effect at a size over its limit, its own parameters moved.

        Parameters
        ----------
        model : whose parameters may be draws
        part : the size over the limit
        """
        out = model.with_effect(self.name)
        new = {f"{self.name}.{name}": value for name, value in self.own(part).items()}
        for name, by in self.moved.items():
            if name in model.values and name not in model.fixed:
                low, high = model.bounds(name)
                new[name] = min(max(model.value(name) + by * part, low), high)
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


class LeftOpen(NamedTuple):
    """What a verdict leaves open of effects.

    `effects` with a limit of their own; names of those whose limit is that of the sampling
    (`unresolved`), and of those that have none (`unlimited`).
    """

    effects: list[OpenEffect]
    unresolved: list[str]
    unlimited: list[str]

    def notes(self, folder: Path) -> list[str]:
        """Return what is said of the effects that no band has.

        Parameters
        ----------
        folder : of the study
        """
        said = []
        if self.unresolved:
            several = len(self.unresolved) > 1
            said.append(
                f"the limit{'s' * several} of {', '.join(self.unresolved)} "
                f"{'are' if several else 'is'} only the smallest size that the sampling of the "
                f"runs resolves: {'they widen' if several else 'it widens'} no band"
            )
        if self.unlimited:
            said.append(
                f"the runs cannot show {', '.join(self.unlimited)}: no band has them. To make them "
                f"visible:  {command('plan', folder, '--see', *self.unlimited)}"
            )
        return said


def open_effects(verdict: Mapping[str, Any], model: Model) -> LeftOpen:
    """Return the effects that a verdict's runs do not exclude.

    Parameters
    ----------
    verdict : the content of verdict.json
    model : which they may join
    """
    found: dict[str, OpenEffect] = {}
    unlimited, unresolved = [], []
    for finding in verdict.get("findings") or []:
        for one in finding.get("limits") or []:
            name = str(one["effect"])
            if name not in EFFECTS or any(
                name == other or exclude(name, other) for other in model.effects
            ):
                continue
            if one.get("why"):
                # What a parameter of a known effect absorbs is in the band of that parameter.
                if str(one["why"]).partition(".")[0] not in model.effects:
                    unlimited.append(name)
                continue
            if one.get("coarse"):
                unresolved.append(name)
                continue
            label = name if name not in found else f"{name} ({finding['site']})"
            found[label] = OpenEffect(
                name, label, one["parameter"], float(one["limit95"]), one["side"] == "above",
                _others(finding["site"], name, one["others"]), one["moved"],
            )  # fmt: skip
    coarse = [name for name in dict.fromkeys(unresolved) if name not in found]
    none = [name for name in dict.fromkeys(unlimited) if name not in (*found, *coarse)]
    return LeftOpen([*found.values()], coarse, none)


def left_open(
    verdict: Mapping[str, Any] | None, model: Model, folder: Path
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
    found = open_effects(verdict, model)
    if not (found.effects or found.unresolved):
        if verdict["kind"] == "insufficient":
            raise StudyError(
                f"{folder}: the data do not allow a verdict, so that there are no limits for "
                "--with-limits. The verdict says why."
            )
        raise StudyError(f"{folder}: the verdict has no limits of effects. First:  {again}")
    return found.effects, found.notes(folder)


def simulated_whole(
    tried: Mapping[str, Sequence[T | str]],
) -> tuple[dict[str, list[T]], dict[str, str]]:
    """Return the draws of effects of which each could be simulated, and why not those of others.

    The draws that are left of an effect are not its sizes: they tell nothing of its reach.

    Parameters
    ----------
    tried : by effect, what each draw gave, or the reason why it could not be simulated
    """
    whole: dict[str, list[T]] = {}
    lost: dict[str, str] = {}
    for name, draws in tried.items():
        reasons = [one for one in draws if isinstance(one, str)]
        if reasons:
            lost[name] = reasons[0]
        elif draws:
            whole[name] = [one for one in draws if not isinstance(one, str)]
    return whole, lost


def in_short(error: Exception | str) -> str:
    """Return the first sentence of an error, without its full stop, to stand in a note."""
    return str(error).partition("\n")[0].strip().rstrip(".")


def widest(parts: Sequence[Mapping[str, float]], causes: Collection[str]) -> tuple[str, float]:
    """Return the effect that widens bands most, with its share of the variance over all of them.

    "" where no effect is worth a test.

    Parameters
    ----------
    parts : of each band, which share of its variance is from what
    causes : those that are no effects
    """
    total: dict[str, float] = {}
    for one in parts:
        for name, part in one.items():
            if name not in causes:
                total[name] = total.get(name, 0.0) + part / len(parts)
    most = max(total, key=lambda name: total[name], default="")
    return (most, total[most]) if most and total[most] >= WORTH else ("", 0.0)


def _others(site: str, name: str, told: Mapping[str, float]) -> dict[str, float]:
    """Return the other parameters of an effect; one that has a storey is in that of its site."""
    at = {"which": float(site.removeprefix("storey"))} if site.startswith("storey") else {}
    return {**told, **{key: value for key, value in at.items() if key in EFFECTS[name].parameters}}


# Draws of a model's identified parameters from the joint covariance of their errors.


@dataclass(frozen=True, eq=False)
class JointErrors:
    """The errors of a model's identified parameters, which go together, in SI.

    `names` of the parameters (p,), their values `centre` (p,) and bounds `low`, `high` (p,);
    `root` (p, p) makes their errors of independent standard normal numbers.
    """

    names: tuple[str, ...]
    centre: Array
    root: Array
    low: Array
    high: Array

    def values(self, normal: Array) -> dict[str, float]:
        """Return the parameters for standard normal numbers (p,), within their bounds."""
        drawn = np.clip(self.centre + self.root @ normal, self.low, self.high)
        return dict(zip(self.names, drawn.tolist(), strict=True))


def joint_errors(model: Model) -> JointErrors:
    """Return the errors of a model's identified parameters, by their joint covariance."""
    names, covariance = model.covariance()
    low, high = np.array([model.bounds(name) for name in names]).reshape(-1, 2).T
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    # Parameters differ by many orders of magnitude: the root is taken of their correlation.
    power, shapes = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * shapes * np.sqrt(np.maximum(power, 0.0))
    return JointErrors(names, np.array([model.value(name) for name in names]), root, low, high)


def drawn_models(model: Model, count: int, generator: np.random.Generator) -> list[Model]:
    """Return the model with values drawn from the joint covariance of their errors.

    Parameters
    ----------
    model : whose identified parameters have a covariance
    count : how many draws
    generator : draws
    """
    errors = joint_errors(model)
    normal = generator.standard_normal((count, len(errors.names)))
    return [model.with_values(errors.values(row)) for row in normal]


def has_covariance(model: Model) -> bool:
    """Return whether a model says how the errors of its identified parameters go together."""
    names = model.uncertain()
    return len(names) == 1 or (len(names) > 1 and model.correlation is not None)
