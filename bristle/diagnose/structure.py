"""What is missing in a model of a building with its damper, and at which of its sites.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..identify.fit import Fit, identify
from ..identify.response import responses
from ..identify.structure import StructureProblem, problems_of
from ..physics.building import Building
from ..physics.effect import EFFECTS, effects_of
from ..records.measurement import Measurement
from .candidates import Trial, judge, refine, try_all, try_members
from .decision import Decision, decide
from .load_cell import load_cell
from .sensors import SensorFault, sensor_faults
from .sites import Finding, coordinate_of, look_at, try_effect

LOOKALIKE = {
    "gas_spring": ("duffing",),
    "duffing": ("gas_spring",),
    "fluid_inertia": ("base_mass",),
    "base_friction": ("f_c",),
}
"""What else does the same where the damper's force is reconstructed from equilibrium."""

WHY = {
    "duffing": "a spring of the damper and one of the isolation layer add up to one force",
    "gas_spring": "a spring of the damper and one of the isolation layer add up to one force",
    "base_mass": "a mass that moves with the piston and one of the base add up to one force",
    "f_c": "friction under the base and the damper's own yield force add up to one force",
}


_NOTHING = Finding("", "none", (), 1.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True)
class DamperVerdict:
    """What the damper's law lacks: the decision, and the trials that it rests on."""

    decision: Decision
    before: Trial
    trials: tuple[Trial, ...]


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
            "sensors": [
                {"channel": f.channel, "fault": f.fault, "value": f.value} for f in self.sensors
            ],
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


Say = Callable[[str], None]


def diagnose_structure(
    train: list[Measurement],
    holdout: list[Measurement],
    building: Building,
    *,
    law: str = "lugre",
    say: Say | None = None,
) -> StructureDiagnosis:
    """Return what is missing in the model of a building and its damper.

    Parameters
    ----------
    train, holdout : measurements with the channels of a building
    building : its masses are taken as known; stiffnesses and damping are fitted anew
    law : the damper's law
    say : is told what is being done

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    say = say or (lambda text: None)
    say("smoothing the motion of each level")
    found = responses([*train, *holdout], building)
    ours, theirs = found[: len(train)], found[len(train) :]
    problems = problems_of(ours, theirs, building, law)
    findings = {}
    for site, (own, other) in problems.items():
        if site != "damper":
            say(f"{site}: effects of the structure")
            findings[site] = look_at(site, own, other)
    if "damper" in problems and findings.get("layer", _NOTHING).kind != "none":
        say("layer: the load cell")
        late = load_cell(findings["layer"], ours, theirs, building, law)
        if late is not None:
            findings["layer"], (ours, theirs) = late
            problems = problems_of(ours, theirs, building, law)
    softer = any(f.kind != "none" for s, f in findings.items() if s.startswith("storey"))
    if softer and "damper" in problems and problems["damper"][0].reconstructed:
        problems = problems_of(ours, theirs, building, law, linear_storeys=False)
    base, verdict = None, None
    if "damper" in problems:
        say("damper: its law, then effects")
        base = identify(problems["damper"][0], law)
        verdict = damper_verdict(base, *problems["damper"])
    sensors = tuple(sensor_faults([_as_bench(one, building) for one in train]))
    return combine(findings, base, verdict, problems, sensors)


def damper_verdict(base: Fit, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    """Return what the damper lacks; with a reconstructed force the layer's effects take part."""
    model = refine(base.model, train)
    before = judge(model, train, held_out)
    return _decided(before, train, held_out)


def _decided(before: Trial, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    # A force that no load cell shows cannot be late.
    instruments = () if train.reconstructed else ("delay",)

    def grow(first: Trial) -> list[Trial]:
        trials = try_all(first.model, train, held_out, instruments=instruments)
        if train.reconstructed:
            taken = first.model.effects
            trials += [
                try_effect(effect.name, first.model, train, held_out)
                for effect in effects_of("structure")
                if "force" in effect.hooks() and effect.name not in taken
            ]
        return sorted(trials, key=lambda trial: trial.z)

    def reduce(pair: Trial) -> list[Trial]:
        return try_members(pair, before.model, train, held_out)

    trials = grow(before)
    decision = decide(before, trials, grow, reduce=reduce)
    return DamperVerdict(decision, before, tuple(trials))


def combine(
    findings: dict[str, Finding],
    damper: Fit | None,
    verdict: DamperVerdict | None,
    problems: dict[str, tuple[StructureProblem, StructureProblem]],
    sensors: tuple[SensorFault, ...] = (),
) -> StructureDiagnosis:
    """Return one diagnosis from what the sites show."""
    reconstructed = "damper" in problems and problems["damper"][0].reconstructed
    parts = [(f.site, f.kind, f.effects, f.z_before, f.z_after) for f in findings.values()]
    if verdict is not None:
        made = verdict.decision
        parts.append(("damper", made.kind, made.effects, verdict.before.z, made.best.z))
    named: list[str] = []
    rivals: list[str] = []
    alike: list[str] = []
    sites: dict[str, str] = {}
    for site, kind, effects, _, _ in parts:
        twins = lookalikes(effects) if reconstructed and site == "damper" else []
        alike += twins
        sure = kind == "effect" and not twins
        (named if sure else rivals).extend([*effects, *twins] if kind != "unknown" else [])
        sites.update({effect: sites.get(effect, _site_of(effect, site)) for effect in effects})
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
    untestable = ("base_friction",) if reconstructed and "base_friction" not in effects else ()
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


def lookalikes(effects: tuple[str, ...]) -> list[str]:
    """Return what else would do the same to a reconstructed force as these effects."""
    twins = [twin for effect in effects for twin in LOOKALIKE.get(effect, ())]
    return [twin for twin in dict.fromkeys(twins) if twin not in effects]


def words(
    kind: str, effects: tuple[str, ...], sites: Mapping[str, str], alike: list[str], coordinate: str
) -> str:
    """Return the verdict as sentences."""
    told = []
    if kind == "none":
        told.append("No effect is missing at any site that these runs test.")
    elif kind == "effect":
        told.append(f"Missing: {', '.join(f'{e} ({sites[e]})' for e in effects)}.")
    elif kind == "class":
        told.append(f"Missing is one of {', '.join(effects)}; these runs cannot say which.")
    else:
        told.append(f"Something is missing that no effect explains, along {coordinate}.")
        told += [f"Besides, {e} is missing ({sites[e]})." for e in effects if e in sites]
    for twin in alike:
        reason = WHY.get(twin, "both add up to one force")
        told.append(f"Without a measured force {reason}: a load cell at the damper would tell.")
    return " ".join(told)


def _as_bench(measurement: Measurement, building: Building) -> Measurement:
    """Return a measurement whose base channels are named as those of a bench."""
    first = building.levels()[0]
    names = {f"{first}_displacement": "displacement", f"{first}_velocity": "velocity"}
    keep = {k: v for k, v in measurement.channels.items() if k in names or k == "force"}
    channels = {names.get(k, k): v for k, v in keep.items()}
    noise = {names.get(k, k): v for k, v in measurement.noise.items() if k in keep}
    return replace(measurement, channels=channels, noise=noise)
