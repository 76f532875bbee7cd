"""The verdict on a building's rig: what its sites show, put together and said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..identify.assigned import late_effects
from ..identify.fit import Fit
from ..identify.structure import StructureProblem
from ..physics.effect import EFFECTS, effects_of
from .candidates import Trial
from .experiments import Experiment
from .faults import SensorFault, instruments_of
from .load_cell import FORCE_GAIN
from .sites import Finding, coordinate_of
from .structure_damper import DamperVerdict


@dataclass(frozen=True)
class StructureDiagnosis:
    """The verdict on a building's rig and what it rests on.

    `kind`, `effects`, ... as in verdict.json; `sites` says at which site each effect was found.
    `findings` by site; `damper` the damper's law as fitted and `damper_verdict` what it lacks;
    `reconstructed` whether the damper's force was reconstructed.
    """

    kind: str
    effects: tuple[str, ...]
    words: str
    z_before: float
    z_after: float
    coordinate: str
    detectable: float
    untestable: tuple[str, ...]
    sites: dict[str, str]
    findings: dict[str, Finding]
    damper: Fit | None
    damper_verdict: DamperVerdict | None
    reconstructed: bool
    sensors: tuple[SensorFault, ...] = ()
    problems: dict[str, tuple[StructureProblem, StructureProblem]] = field(default_factory=dict)
    experiment: Experiment | None = None

    @property
    def worst(self) -> str:
        """The site whose model errs the most on held-out runs, "" where there is none."""
        tried = self._tried()
        return max(tried, key=lambda one: one[2])[0] if tried else ""

    @property
    def before(self) -> Trial | None:
        """The trial of the model as it was, at the worst site."""
        site = self.worst
        if site == "damper" and self.damper_verdict is not None:
            return self.damper_verdict.before
        return next((f.before for f in self.findings.values() if f.site == site), None)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The trials of single effects at the worst site, best first."""
        return next((trials for site, trials, _ in self._tried() if site == self.worst), ())

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name [SI], of the law and of the effects named."""
        out: dict[str, float] = {}
        if self.damper_verdict is not None:
            out.update(self.damper_verdict.decision.best.model.values)
        for finding in self.findings.values():
            model = finding.model.values if finding.model is not None else {}
            own = {n: v for n, v in model.items() if n.partition(".")[0] in finding.effects}
            out.update(own)
            out.update(late_values(finding))
        storeys = [site for site in self.findings if site.startswith("storey")]
        for name in dict.fromkeys(e for f in self.findings.values() for e in f.effects):
            at = [f.site for f in self.findings.values() if name in f.effects]
            # One that is in every storey has the number 0, its default.
            if _in_a_storey(name) and len(at) == 1 < len(storeys):
                out[f"{name}.which"] = float(at[0].removeprefix("storey"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        ranking = []
        for site, trials, before in self._tried():
            ranking += [
                {
                    "effect": t.effects[-1], "site": site, "z_holdout": round(t.z, 4),
                    "gain": round(1.0 - t.z / before, 4),
                }
                for t in trials
            ]  # fmt: skip
        out: dict[str, Any] = {
            "schema": 1, "kind": self.kind, "effects": list(self.effects),
            "ranking": sorted(ranking, key=lambda row: -row["gain"]),
            "z_holdout_before": round(self.z_before, 4), "z_holdout_after": round(self.z_after, 4),
            "untestable": list(self.untestable), "sites": self.sites,
            "sensors": [fault.as_dict() for fault in self.sensors],
            "force": "reconstructed" if self.reconstructed else "measured", "words": self.words,
        }  # fmt: skip
        if np.isfinite(self.detectable):
            out["detectable"] = round(self.detectable, 5)
        if self.coordinate:
            out["coordinate"] = self.coordinate
        return out

    def _tried(self) -> list[tuple[str, tuple[Trial, ...], float]]:
        sites = [(f.site, f.trials, f.z_before) for f in self.findings.values()]
        own = self.damper_verdict
        return sites if own is None else [*sites, ("damper", own.trials, own.before.z)]


def combine(
    findings: dict[str, Finding],
    damper: Fit | None,
    verdict: DamperVerdict | None,
    problems: dict[str, tuple[StructureProblem, StructureProblem]],
    sensors: tuple[SensorFault, ...] = (),
) -> StructureDiagnosis:
    """Return one diagnosis from what the sites show."""
    reconstructed = "damper" in problems and problems["damper"][0].reconstructed
    sensors = (*sensors, *_of_load_cell(findings))
    parts = [
        (f.site, *(("none", ()) if _is_gain(f) else (f.kind, f.effects)), f.z_before, f.z_after)
        for f in findings.values()
    ]
    if verdict is not None:
        made = verdict.decision
        parts.append(("damper", made.kind, made.effects, verdict.before.z, made.best.z))
    named: list[str] = []
    rivals: list[str] = []
    alike: dict[str, str] = {}
    sites: dict[str, str] = {}
    for site, kind, effects, _, _ in parts:
        twins = lookalikes(effects) if reconstructed and site == "damper" else {}
        alike |= twins
        sure = kind == "effect" and not twins
        # What is no effect, such as a mass of the base, is a rival that words alone can name.
        known = [one for one in (*effects, *twins) if one in EFFECTS]
        (named if sure else rivals).extend(known if kind != "unknown" else [])
        sites.update({effect: sites.get(effect, _site_of(effect, site)) for effect in effects})
    for name in instruments_of(sensors):
        named.append(name)
        sites[name] = "sensor"
    effects = tuple(dict.fromkeys([*named, *rivals]))
    unknown = [part for part in parts if part[1] == "unknown"]
    kind = "unknown" if unknown else "class" if rivals else "effect" if named else "none"
    coordinate = ""
    if unknown:
        site = unknown[0][0]
        coordinate = findings[site].coordinate if site in findings else ""
        if site == "damper" and verdict is not None:
            coordinate = coordinate_of(verdict.before.residual, problems["damper"][1])
    worst = max(parts, key=lambda part: part[3], default=("", "none", (), np.nan, np.nan))
    untestable = _absorbed(effects) if reconstructed else ()
    return StructureDiagnosis(
        kind, effects[:3] if kind == "class" else effects,
        words(kind, effects, sites, alike, coordinate), float(worst[3]), float(worst[4]),
        coordinate,
        max((f.detectable for f in findings.values()), default=float("nan")), untestable, sites,
        findings, damper, verdict, reconstructed, sensors, problems,
    )  # fmt: skip


def _site_of(effect: str, site: str) -> str:
    """Return where an effect is that was found at a site: in the layer if it is the structure's."""
    known = EFFECTS.get(effect)
    return "layer" if site == "damper" and known and known.site == "structure" else site


def lookalikes(effects: tuple[str, ...]) -> dict[str, str]:
    """Return what else would do the same to a reconstructed force as these effects, and why."""
    twins: dict[str, str] = {}
    for name in effects:
        for twin, why in (EFFECTS[name].lookalikes if name in EFFECTS else {}).items():
            if twin not in effects:
                twins.setdefault(twin, why)
    return twins


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
            said = (
                f"The load cell shows {gain:.4g} times the force that equilibrium asks for "
                f"(z {finding.z_before:.3g} before, {finding.z_after:.3g} with that set right)."
            )
            out.append(SensorFault("force", "gain", gain, float("nan"), said))
    return out


def words(
    kind: str,
    effects: tuple[str, ...],
    sites: Mapping[str, str],
    alike: Mapping[str, str],
    coordinate: str,
) -> str:
    """Return the verdict as sentences."""
    told = []
    if kind == "none":
        told.append("No effect is missing at any site that these runs test.")
    elif kind == "effect":
        told.append(f"Missing: {', '.join(f'{e} ({sites[e]})' for e in effects)}.")
    elif kind == "class":
        others = [twin for twin in alike if twin not in EFFECTS]
        told.append(
            f"Missing is one of {', '.join([*effects, *others])}; these runs cannot say which."
        )
    else:
        told.append(f"Something is missing that no effect explains, along {coordinate}.")
        told += [f"Besides, {e} is missing ({sites[e]})." for e in effects if e in sites]
    for reason in alike.values():
        told.append(f"Without a measured force {reason}: a load cell at the damper would tell.")
    return " ".join(told)
