"""Draws of a model's identified parameters from the joint covariance of their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..units import convert
from .study_model import StudyModel

Array = NDArray[np.float64]


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


def joint_errors(model: StudyModel) -> JointErrors:
    """Return the errors of a model's identified parameters, by their joint covariance."""
    names, covariance = model.covariance()
    flat, best = model.flat(), model.values()
    own = [(flat[name], model.declared(name).unit) for name in names]
    low, high = (
        np.array([convert(getattr(value, end), value.unit, unit) for value, unit in own])
        for end in ("low", "high")
    )
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    # Parameters differ by many orders of magnitude: the root is taken of their correlation.
    power, shapes = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * shapes * np.sqrt(np.maximum(power, 0.0))
    return JointErrors(names, np.array([best[name] for name in names]), root, low, high)


def drawn_models(model: StudyModel, count: int, generator: np.random.Generator) -> list[StudyModel]:
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


def has_covariance(model: StudyModel) -> bool:
    """Return whether a model says how the errors of its identified parameters go together."""
    names = model.uncertain()
    return len(names) == 1 or (len(names) > 1 and model.correlation is not None)
