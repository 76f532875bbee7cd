"""The verdict on a rig: what its sites show, put together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..compare.patterns import ResidualPattern
from ..identify.assigned import late_effects
from ..identify.rig import DAMPER
from ..physics.effect import EFFECTS, Effect, effects_of, plain_name
from . import verdict_text
from .candidates import Trial
from .experiments import Experiment
from .faults import SensorFault, instruments_of
from .finding import Finding
from .load_cell import FORCE_GAIN

_ELSEWHERE = "{name} of the isolation layer and one of the damper add up to one force"


@dataclass(frozen=True)
class Diagnosis:
    """The verdict on a rig's model, and what it rests on.

    `kind`, `effects`, ... as in verdict.json; `findings` what each site shows, the damper's last;
    `sites` the site of each effect, empty on a bench, which has one; `force` "measured" or
    "reconstructed" in a building, "" on a bench; `noise` that of each channel, as far as it was
    asked for, in SI.
    """

    kind: str
    effects: tuple[str, ...]
    words: str
    findings: Mapping[str, Finding] = field(default_factory=dict)
    sensors: tuple[SensorFault, ...] = ()
    untestable: tuple[str, ...] = ()
    coordinate: str = ""
    sites: Mapping[str, str] = field(default_factory=dict)
    force: str = ""
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def worst(self) -> Finding | None:
        """What the site shows whose model errs the most on held-out runs, None without a site."""
        return max(self.findings.values(), key=lambda found: found.z_before, default=None)

    @property
    def before(self) -> Trial | None:
        """The trial of the model as it was, refitted, at the worst site."""
        return self.worst.before if self.worst is not None else None

    @property
    def after(self) -> Trial | None:
        """The trial of the model that the verdict names, at the worst site."""
        return self.worst.after if self.worst is not None else None

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials of single effects at the worst site, best first."""
        return self.worst.trials if self.worst is not None else ()

    @property
    def z_before(self) -> float:
        """z of the model as it was on held-out runs, at the worst site."""
        return self.worst.z_before if self.worst is not None else float("nan")

    @property
    def z_after(self) -> float:
        """z of the model that the verdict names, there."""
        return self.worst.z_after if self.worst is not None else float("nan")

    @property
    def reconstructed(self) -> bool:
        """Whether the damper's force was reconstructed from equilibrium."""
        return self.force == "reconstructed"

    @property
    def detectable(self) -> float:
        """The largest of the sites' smallest shares of the force that would have been seen."""
        known = [f.detectable for f in self.findings.values() if np.isfinite(f.detectable)]
        return max(known, default=float("nan"))

    @property
    def patterns(self) -> tuple[ResidualPattern, ...]:
        """Along which coordinates the damper's residual is organised; empty in a building."""
        return self._damper.patterns if self._damper else ()

    @property
    def experiment(self) -> Experiment | None:
        """The run that would tell the members of a class apart, where one was sought."""
        return self._damper.experiment if self._damper else None

    @property
    def std(self) -> Mapping[str, float]:
        """Standard deviations by parameter [SI] of what the data identify, as far as asked for."""
        return self._damper.std if self._damper else {}

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name [SI], of the law and of the effects named."""
        out: dict[str, float] = {}
        if self._damper is not None and self._damper.model is not None:
            out.update(self._damper.model.values)
        lines = [found for site, found in self.findings.items() if site != DAMPER]
        for finding in lines:
            model = finding.model.values if finding.model is not None else {}
            out.update({n: v for n, v in model.items() if n.partition(".")[0] in finding.effects})
            out.update(late_values(finding))
        storeys = [site for site in self.findings if site.startswith("storey")]
        for name in dict.fromkeys(effect for finding in lines for effect in finding.effects):
            at = [finding.site for finding in lines if name in finding.effects]
            # One that is in every storey has the number 0, its default.
            if _in_a_storey(name) and len(at) == 1 < len(storeys):
                out[f"{name}.which"] = float(at[0].removeprefix("storey"))
        return out

    @property
    def _damper(self) -> Finding | None:
        return self.findings.get(DAMPER)

    def as_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        out: dict[str, Any] = {
            "schema": 1, "kind": self.kind, "effects": list(self.effects),
            "ranking": self._ranking(), "untestable": list(self.untestable),
            "sensors": [fault.as_dict() for fault in self.sensors], "words": self.words,
        }  # fmt: skip
        out |= self._of_building() if self.force else self._of_bench()
        if np.isfinite(self.detectable):
            out["detectable"] = round(self.detectable, 5)
        if self.coordinate:
            out["coordinate"] = self.coordinate
        return out

    def _ranking(self) -> list[dict[str, Any]]:
        """Return one row per trial of all sites, the largest gain first."""
        rows = []
        for found in self.findings.values():
            for trial in found.trials:
                row = {
                    "effect": trial.effects[-1],
                    "z_holdout": round(trial.z, 4),
                    "gain": round(1.0 - trial.z / found.z_before, 4),
                }
                more = {"site": found.site} if self.force else {"refined": trial.refined}
                rows.append(row | more)
        return sorted(rows, key=lambda row: -row["gain"])

    def _of_building(self) -> dict[str, Any]:
        return {
            "z_holdout_before": round(self.z_before, 4), "z_holdout_after": round(self.z_after, 4),
            "sites": dict(self.sites), "force": self.force,
        }  # fmt: skip

    def _of_bench(self) -> dict[str, Any]:
        out: dict[str, Any] = {"noise_floor": {n: float(v) for n, v in self.noise.items()}}
        found = self._damper
        if found is None or found.before is None or found.after is None:
            return out
        for when, trial in (("before", found.before), ("after", found.after)):
            out[f"z_holdout_{when}"] = round(trial.z, 4)
            out[f"z_train_{when}"] = round(trial.train, 4)
            out[f"rms_holdout_{when}"] = trial.rms
        out["explained"] = round(found.share, 4)
        if found.patterns:
            out["organised"] = [
                {"coordinate": one.coordinate, "share": round(one.share, 4), "p": one.p}
                for one in found.patterns[:5]
            ]
        if found.experiment is not None:
            out["separate_by"] = found.experiment.words()
        return out


def of_sites(
    findings: Mapping[str, Finding],
    force: str = "measured",
    sensors: tuple[SensorFault, ...] = (),
) -> Diagnosis:
    """Return one verdict from what the sites of a building show.

    Parameters
    ----------
    findings : by site, the damper's last
    force : whether the damper's force was "measured" or "reconstructed"
    sensors : the faults that channels show of each other
    """
    reconstructed = force == "reconstructed"
    sensors = (*sensors, *_of_load_cell(findings))
    parts = [replace(f, kind="none", effects=()) if _is_gain(f) else f for f in findings.values()]
    named: list[str] = []
    rivals: list[str] = []
    alike: dict[str, str] = {}
    sites: dict[str, str] = {}
    for part in parts:
        twins = lookalikes(part.effects) if reconstructed and part.site == DAMPER else {}
        alike |= twins
        sure = part.kind == "effect" and not twins
        # What is no effect, such as a mass of the base, is a rival that words alone can name.
        known = [one for one in (*part.effects, *twins) if one in EFFECTS]
        (named if sure else rivals).extend(known if part.kind != "unknown" else [])
        sites.update({e: sites.get(e, _site_of(e, part.site)) for e in part.effects})
    for name in instruments_of(sensors):
        named.append(name)
        sites[name] = "sensor"
    effects = tuple(dict.fromkeys([*named, *rivals]))
    unknown = next((part for part in parts if part.kind == "unknown"), None)
    kind = "unknown" if unknown else "class" if rivals else "effect" if named else "none"
    coordinate = unknown.coordinate if unknown else ""
    return Diagnosis(
        kind, effects[:3] if kind == "class" else effects,
        verdict_text.of_sites(kind, effects, sites, alike, coordinate), findings, sensors,
        _absorbed(effects) if reconstructed else (), coordinate, sites, force,
    )  # fmt: skip


def _site_of(effect: str, site: str) -> str:
    """Return where an effect is that was found at a site: in the layer if it is the structure's."""
    known = EFFECTS.get(effect)
    return "layer" if site == "damper" and known and known.site == "structure" else site


def lookalikes(effects: tuple[str, ...]) -> dict[str, str]:
    """Return what else would do the same to a reconstructed force as these effects, and why."""
    twins: dict[str, str] = {}
    for name in (name for name in effects if name in EFFECTS):
        effect, why = EFFECTS[name], _ELSEWHERE.format(name=plain_name(name))
        own = {effect.key(site): why for site in effect.sites[1:] if not _has_twin(effect, site)}
        for twin, why in {**effect.lookalikes, **own}.items():
            if twin not in effects:
                twins.setdefault(twin, why)
    return twins


def _has_twin(effect: type[Effect], site: str) -> bool:
    """Return whether an effect's lookalikes, or a part of the law, are what it would be there."""
    others = [EFFECTS[twin] for twin in effect.lookalikes if twin in EFFECTS]
    return bool(effect.absorbed_by) or any(site in other.sites for other in others)


def _absorbed(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the effects that the damper's law takes up whole, without a load cell."""
    able = [effect.name for effect in effects_of("structure") if effect.absorbed_by]
    return tuple(name for name in able if name not in effects)


def _in_a_storey(name: str) -> bool:
    return name in EFFECTS and "which" in EFFECTS[name].parameters


def late_values(finding: Finding) -> dict[str, float]:
    """Return the parameter and the time [s] of a finding that the load cell is late, if it is."""
    if len(finding.effects) != 1 or not late_effects([n for n in finding.effects if n in EFFECTS]):
        return {}
    (name,) = finding.effects
    return {f"{name}.{EFFECTS[name].late[0]}": float(finding.coordinate.split()[0])}


def _is_gain(finding: Finding) -> bool:
    return FORCE_GAIN in finding.effects


def _of_load_cell(findings: Mapping[str, Finding]) -> list[SensorFault]:
    """Return the faults of the load cell that equilibrium shows and that are no effects."""
    out = []
    for finding in findings.values():
        if _is_gain(finding):
            gain = float(finding.coordinate)
            text = (
                f"The load cell shows {gain:.4g} times the force that equilibrium asks for "
                f"(z {finding.z_before:.3g} before, {finding.z_after:.3g} with that set right)."
            )
            out.append(SensorFault("force", "gain", gain, float("nan"), text))
    return out
