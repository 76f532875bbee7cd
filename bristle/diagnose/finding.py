"""What one site of a rig shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..compare.patterns import ResidualPattern
from ..identify.model import Model
from ..identify.rig import DAMPER
from .candidates import Trial
from .decision import Decision
from .experiments import Experiment
from .faults import SensorFault


@dataclass(frozen=True)
class Finding:
    """What one site shows: "damper", "layer", "storey1", ... or "force" for the load cell.

    `kind` and `effects` as in verdict.json; `z_before`, `z_after` on held-out runs; `share` what
    the effects explain of the excess, `detectable` the smallest share of the site's force that
    would have been seen, NaN where nobody asked; `coordinate` that of an unknown residual. `model`
    is what the finding names; `before` the trial of the site's model as it was, `after` that of
    `model`, `trials` those of single effects, best first; `reasons` sentences.

    Of a bench's damper there is more: `std` by parameter [SI] of what the data identify,
    `patterns` of the residual that is left, `untestable` effects, the `experiment` that would tell
    the members of a class apart; `sensors` are faults that only the model with the named effects
    shows.
    """

    site: str
    kind: str
    effects: tuple[str, ...]
    z_before: float
    z_after: float
    share: float
    detectable: float
    coordinate: str = ""
    model: Model | None = None
    trials: tuple[Trial, ...] = ()
    before: Trial | None = None
    after: Trial | None = None
    reasons: tuple[str, ...] = ()
    std: Mapping[str, float] = field(default_factory=dict)
    patterns: tuple[ResidualPattern, ...] = ()
    untestable: tuple[str, ...] = ()
    experiment: Experiment | None = None
    sensors: tuple[SensorFault, ...] = ()


def of_decision(decision: Decision, before: Trial, trials: tuple[Trial, ...] = ()) -> Finding:
    """Return the finding at the damper that a decision is."""
    best = decision.best
    return Finding(
        DAMPER, decision.kind, decision.effects, before.z, best.z, decision.explained,
        float("nan"), "", best.model, trials, before, best, decision.reasons,
    )  # fmt: skip
