"""What one site of a rig shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..comparison.patterns import ResidualPattern
from ..core.finding import Finding
from ..core.text import short_z
from ..identification.rig import DAMPER
from ..model.model import Model
from .decision import Decision
from .effect_limits import EffectLimit
from .experiments import Experiment
from .law_trials import OtherLaw
from .trials import Trial


@dataclass(frozen=True)
class SiteDiagnosis:
    """What one site shows: "damper", "layer", "storey1", ... or "force" for the load cell.

    `kind` and `effects` as in verdict.json; `z_before`, `z_after` on held-out runs; `share` what
    the effects explain of the excess, `detectable` the smallest share of the site's force that
    would have been seen, NaN where nobody asked; `coordinate` that of an unknown residual, of the
    model with the effects `beside` where what they mimic hid it. `model` is what the finding names;
    `before` the trial of the site's model as it was, `after` that of
    `model`, `trials` those of single effects, best first; `reasons` sentences.

    `std` is by parameter [SI], of what the data identify; `patterns` those of the residual;
    `untestable` the effects that the site's runs do not show; `experiment` the run that would
    distinguish alternatives, where the rig's motion can be chosen; `sensors` are faults that only
    the model with the named effects shows; `together` is the best pair of effects that was tried;
    `other_law` the law that would leave less than the model's, where that was asked; `limits` how
    large each further effect may be beside `model`; `noise_known` whether z says something: else
    verdict.json has no z.
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
    sensors: tuple[Finding, ...] = ()
    together: Trial | None = None
    other_law: OtherLaw | None = None
    limits: tuple[EffectLimit, ...] = ()
    beside: tuple[str, ...] = ()
    noise_known: bool = True

    @property
    def briefly(self) -> str:
        """The verdict in a few words, which are known before its limits and intervals."""
        names = (" or " if self.kind == "ambiguous" else " and ").join(self.effects)
        left = f", error / noise (z) {short_z(self.z_after)}" if self.noise_known else ""
        return f"{self.kind}{': ' if names else ''}{names}{left}; limits and intervals follow"

    def gain(self, trial: Trial) -> float:
        """Return by what share a trial lowers the held-out z; the RMS error if z is not known."""
        if self.noise_known or self.before is None:
            return 1.0 - trial.z / self.z_before
        return 1.0 - trial.rms / self.before.rms

    def as_dict(self) -> dict[str, Any]:
        """Return what verdict.json holds of the site."""
        model = self.model.values if self.model is not None else {}
        out: dict[str, Any] = {
            "site": self.site, "kind": self.kind, "effects": list(self.effects),
            "z_holdout_before": round(self.z_before, 4), "z_holdout_after": round(self.z_after, 4),
            "explained": round(self.share, 4), "untestable": list(self.untestable),
            "values": {n: {"value": model[n], "std": self.std[n]} for n in self.std if n in model},
            "reasons": list(self.reasons),
        }  # fmt: skip
        if self.before is not None and self.after is not None:
            for when, trial in (("before", self.before), ("after", self.after)):
                out[f"z_train_{when}"] = round(trial.train, 4)
                if trial.error is not None:
                    out[f"error_holdout_{when}"] = trial.error.as_dict()
        if np.isfinite(self.detectable):
            out["detectable"] = round(self.detectable, 5)
        if self.kind == "unknown" and self.coordinate:
            out["coordinate"] = self.coordinate
            out["coordinate_beside"] = list(self.beside)
        if self.patterns:
            out["organised"] = [
                {"coordinate": one.coordinate, "share": round(one.share, 4), "p": one.p}
                for one in self.patterns[:5]
            ]
        if self.other_law is not None:
            out["other_law"] = self.other_law.as_dict()
        if self.limits:
            out["limits"] = [one.as_dict() for one in self.limits]
        if self.experiment is not None:
            out["separate_by"] = self.experiment.sentence()
        return out if self.noise_known else without_z(out)


def without_z(value: Any) -> Any:
    """Return what json holds with each z as None: nobody knows the noise."""
    if isinstance(value, dict):
        return {
            name: None if name.startswith("z_") or name == "interval95" else without_z(one)
            for name, one in value.items()
        }
    return [without_z(one) for one in value] if isinstance(value, list) else value


def of_decision(
    decision: Decision, before: Trial, trials: tuple[Trial, ...] = (), site: str = DAMPER
) -> SiteDiagnosis:
    """Return the finding that a decision is.

    Parameters
    ----------
    decision : what the trials of a site lead to
    before : the trial of the site's model as it was
    trials : those of single effects, best first
    site : "damper", "layer", "storey1" ...
    """
    best = decision.best
    return SiteDiagnosis(
        site, decision.kind, decision.effects, before.z, best.z, decision.explained,
        float("nan"), model=best.model, trials=trials, before=before, after=best,
        reasons=decision.reasons,
    )  # fmt: skip
