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

from ..identify.fit import Fit, Model, identify
from ..identify.placed import at_site, on_time
from ..identify.response import responses
from ..identify.structure import StructureProblem, problems_of
from ..physics.building import Building
from ..physics.effect import EFFECTS, effects_of
from ..records.measurement import Measurement
from .candidates import SECONDS, Trial, judge, try_all, try_members
from .decision import GAIN, SHARE, Decision, decide, excess
from .experiments import Experiment
from .load_cell import load_cell
from .search import refine
from .sensors import SensorFault, mended, sensor_faults
from .sites import CLEAN, NEARLY, Finding, better, coordinate_of, look_at, shortened, try_effect

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

NAMES = {"base_mass": "a mass of the base that the file does not know", "f_c": "f_c of the damper"}
"""Rivals that are no effects, as words name them."""

INSTRUMENT = ("lag", "high-pass")
"""Faults of a velocity that are an instrument's own, which the library knows as an effect."""

BLURRED = (*INSTRUMENT, "delay", "derived")
"""Faults for which a building's velocity is left out: displacement and accelerometer say the same
without them, and what is left of a delay would be held against the law at each reversal."""

QUIET = 1.0 + 0.5 * GAIN
"""z of the damper's law up to which no effect can lower it by `GAIN`: noise is all there is."""

SEARCHED = 12.0
"""Seconds of each run, from its begin, on which the damper's effects are searched: the strongest
shaking is over. The best are then fitted to all that was recorded; held-out runs stay whole."""

CONTENDERS, NEAR = 3, 1.03
"""How many trials at most are fitted to all that was recorded, and up to which z as a multiple of
the best one's: rivals are told apart on equal terms."""

BLIND = 1.25
"""z that a true Bingham law may read where the base's velocity had to be left out: its jumps come
when the velocity changes sign, which then is told by displacement and accelerometer alone."""

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
            if finding.effects == ("delay",):
                out["delay.time"] = float(finding.coordinate.split()[0])
        soft = [f.site for f in self.findings.values() if "storey_softening" in f.effects]
        storeys = [site for site in self.findings if site.startswith("storey")]
        if len(soft) == 1 < len(storeys):  # else it is in every storey, which is 0
            out["storey_softening.which"] = float(soft[0].removeprefix("storey"))
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


Say = Callable[[str], None]


def diagnose_structure(
    train: list[Measurement],
    holdout: list[Measurement],
    building: Building,
    *,
    law: str = "lugre",
    present: Model | None = None,
    say: Say | None = None,
) -> StructureDiagnosis:
    """Return what is missing in the model of a building and its damper.

    Parameters
    ----------
    train, holdout : measurements with the channels of a building
    building : its masses are taken as known; stiffnesses and damping are fitted anew
    law : the damper's law
    present : the model as it is: effects of all sites with their values; its law counts
    say : is told what is being done

    Raises
    ------
    RecordError
        If a channel is missing, or the building has other levels than were measured.
    """
    say = say or (lambda text: None)
    present = present or Model(law)
    law = present.law
    say("looking for sensor faults")
    sensors = tuple(sensor_faults([_as_bench(one, building) for one in (*train, *holdout)]))
    train, holdout = (_mended(runs, sensors, building) for runs in (train, holdout))
    say("smoothing the motion of each level")
    found, present = on_time(responses([*train, *holdout], building), present)
    ours, theirs = found[: len(train)], found[len(train) :]
    straight = "storey_softening" not in present.effects
    problems = problems_of(ours, theirs, building, law, linear_storeys=straight)
    findings = {}
    for site, (own, other) in problems.items():
        if site != "damper":
            say(f"{site}: effects of the structure")
            findings[site] = look_at(site, own, other, at_site(present, site, problems))
    if "damper" in problems and findings.get("layer", _NOTHING).kind != "none":
        say("layer: the load cell")
        late = load_cell(findings["layer"], ours, theirs, building, law)
        if late is not None:
            findings["layer"], (ours, theirs) = late
            shown = problems["damper"]
            problems = problems_of(ours, theirs, building, law)
            if _rounded(findings["layer"]):
                problems["damper"], present = shown, _late(present, findings["layer"])
    softer = any(f.kind != "none" for s, f in findings.items() if s.startswith("storey"))
    if softer and "damper" in problems and problems["damper"][0].reconstructed:
        problems = problems_of(ours, theirs, building, law, linear_storeys=False)
    base, verdict = None, None
    if "damper" in problems:
        say("damper: its law, then effects")
        base = fit_damper(problems["damper"][0], at_site(present, "damper", problems))
        verdict = damper_verdict(base, *problems["damper"])
        if _blurred(sensors):
            verdict = _forgiven(verdict, BLIND, "Without its velocity the base's reversals blur.")
        if _rounded(findings.get("layer", _NOTHING)):
            most = _left_by_filter(law, *problems["damper"])
            verdict = _forgiven(verdict, most, "The load cell's filter has another form than ours.")
    return combine(findings, base, verdict, problems, sensors)


def _rounded(layer: Finding) -> bool:
    """Return whether a load cell is late in a way that moving its record ahead does not undo.

    A filter rounds the force besides. That cannot be taken back, but it can be put on the model.
    """
    return layer.effects == ("delay",) and layer.z_after > CLEAN


def _late(present: Model, layer: Finding) -> Model:
    """Return the model whose damper's force is shown as late as equilibrium says."""
    time = float(layer.coordinate.split()[0])
    effects = (*present.effects, "delay")
    return replace(present, effects=effects, values={**present.values, "delay.time": time})


def fit_damper(problem: StructureProblem, present: Model) -> Fit:
    """Return the damper's law fitted anew, with the effects that the model has already."""
    effects = present.effects
    known = {n: v for n, v in present.values.items() if n.partition(".")[0] in effects}
    kept = {n: v for n, v in present.values.items() if n in present.held}
    return identify(
        problem, present.law, effects, values={**known, **kept}, held=present.held,
        limits=present.limits,
    )  # fmt: skip


def damper_verdict(base: Fit, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    """Return what the damper lacks; with a reconstructed force the layer's effects take part."""
    model = refine(base.model, train)
    before = judge(model, train, held_out)
    return _decided(before, train, held_out)


def _decided(before: Trial, train: StructureProblem, held_out: StructureProblem) -> DamperVerdict:
    # A force that no load cell shows cannot be late.
    instruments = () if train.reconstructed else ("delay",)

    brief = shortened(train, SEARCHED)

    def grow(first: Trial) -> list[Trial]:
        most = None if first is before else SECONDS
        trials = try_all(first.model, brief, held_out, instruments, most)
        if train.reconstructed:
            taken = first.model.effects
            trials += [
                try_effect(effect.name, first.model, train, held_out)
                for effect in effects_of("structure")
                if "force" in effect.hooks() and effect.name not in taken
            ]
        trials.sort(key=lambda trial: trial.z)
        if brief is not train:
            best = trials[0].z
            for k, one in enumerate(trials[:CONTENDERS]):
                if one.refined and one.z <= NEAR * best:
                    trials[k] = judge(refine(one.model, train), train, held_out)
        return sorted(trials, key=lambda trial: trial.z)

    def reduce(pair: Trial) -> list[Trial]:
        return try_members(pair, before.model, train, held_out)

    if max(before.z, before.train) <= QUIET:
        return DamperVerdict(decide(before, [], grow), before, ())
    trials = grow(before)
    decision = decide(before, trials, grow, reduce=reduce)
    if decision.kind in ("none", "unknown"):
        decision = _seldom(before, trials) or decision
    return DamperVerdict(decision, before, tuple(trials))


def _forgiven(verdict: DamperVerdict, most: float, reason: str) -> DamperVerdict:
    """Return a verdict that does not call unknown what an instrument already known explains.

    `most` is the z that it accounts for; what an effect of the library lowers is not forgiven.
    """
    made, before = verdict.decision, verdict.before
    gains = any(1.0 - trial.z / before.z >= GAIN for trial in verdict.trials)
    if made.kind != "unknown" or gains or max(before.z, before.train) > most:
        return verdict
    words = f"{reason} z = {before.z:.2f} is no more than that."
    return replace(verdict, decision=replace(made, kind="none", reasons=(words,)))


def _left_by_filter(law: str, train: StructureProblem, held_out: StructureProblem) -> float:
    """Return the z that a late and rounded force may leave once our delay is in the model.

    As for any effect of another form: it must explain `SHARE` of the excess that is there without.
    """
    bare = judge(fit_damper(train, Model(law)).model, train, held_out)
    return float(np.sqrt(1.0 + (1.0 - SHARE) * excess(bare)))


def _blurred(faults: tuple[SensorFault, ...]) -> bool:
    return any(f.channel == "velocity" and f.fault in BLURRED for f in faults)


def _seldom(before: Trial, trials: list[Trial]) -> Decision | None:
    """Return the decision for an effect of the layer that acts in a few samples only, if any.

    A stop that is met once or twice is seen in no resampling of blocks; its likelihood tells, where
    the model with it is adequate.
    """
    best = trials[0]
    name = best.effects[-1]
    if EFFECTS[name].site != "structure" or best.z > CLEAN:
        return None
    if 1.0 - best.z / before.z < GAIN or not better(before, best):
        return None
    rivals = [
        other.effects[-1]
        for other in trials[1:]
        if other.z / best.z - 1.0 < NEARLY or not better(other, best)
    ]
    explained = 1.0 - excess(best) / excess(before)
    reason = f"With {name} the error on runs not seen falls from {before.z:.2f} to {best.z:.2f}."
    kind = "class" if rivals else "effect"
    return Decision(kind, (name, *rivals)[:3], best, explained, (reason,))


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
    alike: list[str] = []
    sites: dict[str, str] = {}
    for site, kind, effects, _, _ in parts:
        twins = lookalikes(effects) if reconstructed and site == "damper" else []
        alike += twins
        sure = kind == "effect" and not twins
        # What is no effect, such as a mass of the base, is a rival that words alone can name.
        known = [one for one in (*effects, *twins) if one in EFFECTS]
        (named if sure else rivals).extend(known if kind != "unknown" else [])
        sites.update({effect: sites.get(effect, _site_of(effect, site)) for effect in effects})
    if any(fault.fault in INSTRUMENT for fault in sensors):
        named.append("velocity_sensor")
        sites["velocity_sensor"] = "sensor"
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


def _is_gain(finding: Finding) -> bool:
    return "force_gain" in finding.effects


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
    kind: str, effects: tuple[str, ...], sites: Mapping[str, str], alike: list[str], coordinate: str
) -> str:
    """Return the verdict as sentences."""
    told = []
    if kind == "none":
        told.append("No effect is missing at any site that these runs test.")
    elif kind == "effect":
        told.append(f"Missing: {', '.join(f'{e} ({sites[e]})' for e in effects)}.")
    elif kind == "class":
        others = [NAMES[twin] for twin in alike if twin in NAMES]
        told.append(
            f"Missing is one of {', '.join([*effects, *others])}; these runs cannot say which."
        )
    else:
        told.append(f"Something is missing that no effect explains, along {coordinate}.")
        told += [f"Besides, {e} is missing ({sites[e]})." for e in effects if e in sites]
    for twin in alike:
        reason = WHY.get(twin, "both add up to one force")
        told.append(f"Without a measured force {reason}: a load cell at the damper would tell.")
    return " ".join(told)


def _mended(
    runs: list[Measurement], faults: tuple[SensorFault, ...], building: Building
) -> list[Measurement]:
    """Return measurements without the faults of the damper's channels.

    Of velocities that are late or rounded the displacement says the same.
    """
    first = building.levels()[0]
    names = {"displacement": f"{first}_displacement", "velocity": f"{first}_velocity"}
    theirs = [replace(f, channel=names.get(f.channel, f.channel)) for f in faults]
    late = names["velocity"]
    out = mended(runs, [f for f in theirs if not (f.channel == late and f.fault in BLURRED)])
    if not _blurred(faults):
        return out
    return [
        replace(one, channels={n: v for n, v in one.channels.items() if n != late}) for one in out
    ]


def _as_bench(measurement: Measurement, building: Building) -> Measurement:
    """Return a measurement whose base channels are named as those of a bench."""
    first = building.levels()[0]
    names = {f"{first}_displacement": "displacement", f"{first}_velocity": "velocity"}
    keep = {k: v for k, v in measurement.channels.items() if k in names or k == "force"}
    channels = {names.get(k, k): v for k, v in keep.items()}
    noise = {names.get(k, k): v for k, v in measurement.noise.items() if k in keep}
    return replace(measurement, channels=channels, noise=noise)
