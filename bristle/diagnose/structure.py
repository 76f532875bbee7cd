"""What is missing in a model of a building with its damper, and at which of its sites.

Equilibrium parts the question. Each storey's shear is known from the accelerations above it,
whatever happens below; what the isolation layer carries is known where the damper's force was
measured; and the damper's force is then held against the damper's law. Without a measured force the
layer and the damper are one unknown, and effects that act alike are named together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..identify.fit import Fit, fit, identify
from ..identify.model import Model, Problem
from ..identify.response import Response, responses
from ..identify.structure import (
    LinearLayer,
    LinearStorey,
    StructureProblem,
    fit_line,
    layer_run,
    problems_of,
    thinned,
)
from ..physics.building import Building
from ..physics.effect import EFFECTS, effects_of
from ..records.measurement import Measurement
from .candidates import Trial, judge, refine, starts, try_all
from .decision import Decision, decide
from .evidence import paired
from .sensors import SensorFault, sensor_faults

Array = NDArray[np.float64]

GAIN = 0.03
"""Smallest share by which an effect must lower z on held-out runs to be missing at a site."""

CLEAN = 1.15
"""z above which something is missing at a site, whether an effect explains it or not."""

SHARE = 0.7
"""Share of a site's excess that an effect must explain where its form leaves more than `CLEAN`."""

NEARLY = 0.005
"""Rivals whose z lies that close together are not told apart."""

OWN = 0.5
"""Where its form leaves more than `CLEAN`, what an effect's excess must be below, as a share of
the next one's: two forms that are both wrong cannot decide otherwise."""

SURE = 40.0
"""Gain of the log-likelihood that no chance brings: what happens in a few samples only, such as a
stop that is met once, is seen in no resampling of blocks."""

STOP = 0.4
"""Share of the largest travel within which a stop would be met so often that it is a spring."""

QUICK = 8
"""Sweeps of the first, short search from each start, on every fifth sample."""

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


@dataclass(frozen=True)
class Finding:
    """What one site shows: "layer", "storey1", ... or "force" for the load cell.

    `kind` is "none", "effect", "class" or "unknown"; `z_before`, `z_after` on held-out runs;
    `share` what the best effect explains of the excess, `detectable` the smallest share of the
    site's force that would have been seen.
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
    def grown(first: Trial) -> list[Trial]:
        trials = try_all(first.model, train, held_out)
        if train.reconstructed:
            taken = first.model.effects
            trials += [
                try_effect(effect.name, first.model, train, held_out)
                for effect in effects_of("structure")
                if "force" in effect.hooks() and effect.name not in taken
            ]
        return sorted(trials, key=lambda trial: trial.z)

    trials = grown(before)
    return DamperVerdict(decide(before, trials, grown), before, tuple(trials))


def look_at(site: str, train: StructureProblem, held_out: StructureProblem) -> Finding:
    """Return what a layer's or storey's problem shows."""
    linear = LinearLayer if site == "layer" else LinearStorey
    hook = "force" if site == "layer" else "spring"
    base = fit_line(train, linear.name)
    before = judge(base.model, train, held_out)
    names = [e.name for e in effects_of("structure") if hook in e.hooks()]
    if before.z <= 1.0 + 0.5 * GAIN and before.train <= CLEAN:
        names = []  # a line leaves nothing that a further effect could explain
    trials = [try_effect(name, base.model, train, held_out) for name in names]
    trials.sort(key=lambda trial: trial.z)
    return judge_site(site, base, before, trials, held_out)


def try_effect(
    effect: str, base: Model, train: StructureProblem, held_out: StructureProblem
) -> Trial:
    """Refit a model with one more effect of the structure from several starts; judge the best."""
    few = thinned(train)
    light = few.expectation(base)
    begun = [
        fit(few, model, expectation=light, max_evaluations=QUICK, with_std=False)
        for model in structure_starts(effect, base, train)
    ]
    best = min(begun, key=lambda one: one.cost).model
    expected = train.expectation(base)
    best = fit(train, best, expectation=expected, max_evaluations=25, with_std=False).model
    return judge(best, train, held_out)


def structure_starts(effect: str, base: Model, train: Problem) -> list[Model]:
    """Return the models from which the search for an effect of the structure begins.

    Lengths are shares of the largest motion, for a stop beyond it has no force at all.
    """
    reach = max(float(np.max(np.abs(run.x))) for run in train.runs)
    speed = max(float(np.max(np.abs(run.v))) for run in train.runs)
    force, stiffness = train.size("N"), train.size("N/m")
    damping = train.size("N.s/m")
    grid: dict[str, dict[str, tuple[float, ...]]] = {
        "base_friction": {
            "limit": (0.1 * force,), "x_s": (0.0, 0.05 * reach), "v_r": (0.1 * speed,),
        },
        "duffing": {
            "k_3": (0.3 * stiffness / reach**2, -0.1 * stiffness / reach**2), "shape": (3.0, 5.0),
        },
        "end_stop": {
            "clearance": (0.55 * reach, 0.75 * reach, 0.9 * reach),
            "k": (1.0 * stiffness,), "c": (1e-3 * damping,),
        },
        "storey_softening": {"d_half": (0.7 * reach, 2.5 * reach), "which": (0.0,)},
    }  # fmt: skip
    if effect not in grid:  # a user's own
        return starts(effect, base, train)
    own = {name: p.value for name, p in EFFECTS[effect].parameters.items()}
    out = []
    for values in product(*grid[effect].values()):
        chosen = {**own, **dict(zip(grid[effect], values, strict=True))}
        named = {f"{effect}.{name}": value for name, value in chosen.items()}
        out.append(replace(base, effects=(*base.effects, effect), values={**base.values, **named}))
    if effect == "end_stop":
        limits = {**base.limits, "end_stop.clearance": (STOP * reach, reach)}
        out = [replace(model, limits=limits) for model in out]
    return out


def judge_site(
    site: str, base: Fit, before: Trial, trials: list[Trial], held_out: StructureProblem
) -> Finding:
    """Return the finding that a site's trials lead to; held-out runs decide."""
    seen, tried = detectable(held_out), tuple(trials)
    best = trials[0] if trials else None
    if best is None or not better(before, best) or 1.0 - best.z / before.z < GAIN:
        kind = "none" if before.z <= CLEAN else "unknown"
        where = coordinate_of(before.residual, held_out) if kind == "unknown" else ""
        return Finding(site, kind, (), before.z, before.z, 0.0, seen, where, before.model, tried)
    share = 1.0 - excess(best) / excess(before)
    found = Finding(site, "unknown", (), before.z, best.z, share, seen, "", best.model, tried)
    if best.z > CLEAN and share < SHARE:
        return replace(found, coordinate=coordinate_of(best.residual, held_out))
    rivals = [best.effects[-1]]
    for other in trials[1:]:
        if best.z > CLEAN:
            rival = excess(best) > OWN * excess(other)
        else:
            rival = other.z / best.z - 1.0 < NEARLY or not better(other, best)
        rivals += [other.effects[-1]] if rival else []
    kind = "effect" if len(rivals) == 1 else "class"
    return replace(found, kind=kind, effects=tuple(rivals[:3]))


def excess(trial: Trial) -> float:
    """Return z^2 - 1, never below a hundredth: noise is not known better."""
    return max(trial.z**2 - 1.0, 0.01)


def better(first: Trial, second: Trial) -> bool:
    """Return whether the second trial errs less than the first on held-out runs, beyond chance.

    A site's noise is white, so where the second model is adequate its gain in likelihood counts.
    """
    if paired(first.losses, second.losses).low > 0.0:
        return True
    gain = float(np.sum(first.losses - second.losses))
    return second.z <= CLEAN and gain > SURE


def detectable(held_out: StructureProblem) -> float:
    """Return the smallest share of a site's force that lowers z by `GAIN` when it is explained."""
    noise = float(np.mean([run.noise for run in held_out.runs]))
    excess = np.sqrt(1.0 / (1.0 - GAIN) ** 2 - 1.0)
    return float(excess * noise / max(held_out.size("N"), 1e-300))


def coordinate_of(residual: Array, problem: Problem) -> str:
    """Return the coordinate along which a residual is organised the most, "time" if along none."""
    runs = problem.runs
    shown = {
        "displacement": [run.x for run in runs],
        "velocity": [run.v for run in runs],
        "acceleration": [run.a for run in runs],
        "time": [np.arange(len(run.x)) * run.dt for run in runs],
    }
    shares = {}
    for name, parts in shown.items():
        values = np.concatenate([p[r.skip :] for p, r in zip(parts, runs, strict=True)])
        shares[name] = _organised(residual, values)
    return max(shares, key=lambda name: shares[name])


def _organised(residual: Array, coordinate: Array, bins: int = 24) -> float:
    """Return the share of a residual's power that its means in bins of equal count hold."""
    label = np.empty(len(residual), dtype=np.int64)
    label[np.argsort(coordinate, kind="stable")] = np.arange(len(residual)) * bins // len(residual)
    cut = np.clip(residual, -8.0, 8.0)
    sums = np.bincount(label, weights=cut, minlength=bins)
    counts = np.maximum(np.bincount(label, minlength=bins), 1)
    return float(np.sum(sums**2 / counts) / max(float(np.sum(cut**2)), 1e-300))


def load_cell(
    layer: Finding, train: list[Response], holdout: list[Response], building: Building, law: str
) -> tuple[Finding, tuple[list[Response], list[Response]]] | None:
    """Return the finding that the load cell is late or wrongly scaled, with the forces set right.

    Equilibrium knows when and how large the force is. None where no delay and no gain explains
    the layer better than its own effects do.
    """
    best: tuple[float, float, float, Finding] | None = None
    for what in ("delay", "gain"):
        found = _search_cell(what, train, holdout, building, law)
        if best is None or found[0] < best[0]:
            best = found
    assert best is not None
    z_1, delay, gain, finding = best
    own = min((trial.z for trial in layer.trials), default=np.inf)
    share = 1.0 - max(z_1**2 - 1.0, 0.01) / max(layer.z_before**2 - 1.0, 0.01)
    if z_1 >= own or 1.0 - z_1 / layer.z_before < GAIN or (z_1 > CLEAN and share < SHARE):
        return None
    name = "delay" if delay else "force_gain"
    right = tuple([_corrected(r, delay, gain) for r in part] for part in (train, holdout))
    told = replace(
        finding, site="force", kind="effect", effects=(name,), z_before=layer.z_before, share=share,
        coordinate=f"{delay:.3g} s" if delay else f"{gain:.4g}",
    )  # fmt: skip
    return told, right  # type: ignore[return-value]


def _search_cell(
    what: str, train: list[Response], holdout: list[Response], building: Building, law: str
) -> tuple[float, float, float, Finding]:
    """Return z on held-out runs, delay [s], gain and finding of the best delay or gain."""

    def problem(value: float, part: list[Response]) -> StructureProblem:
        delay, gain = (value, 1.0) if what == "delay" else (0.0, value)
        return StructureProblem([layer_run(_corrected(r, delay, gain), building) for r in part])

    def cost(value: float) -> float:
        return fit_line(problem(value, train), LinearLayer.name).cost

    if what == "delay":
        dt = train[0].dt
        grid = dt * np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
    else:
        grid = np.array([0.6, 0.8, 0.9, 1.1, 1.25, 1.6])
    costs = [cost(value) for value in grid]
    k = int(np.argmin(costs))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    value = float(
        minimize_scalar(cost, bounds=(low, high), method="bounded", options={"maxiter": 14}).x
    )
    own, other = problem(value, train), problem(value, holdout)
    base = fit_line(own, LinearLayer.name)
    after = judge(base.model, own, other)
    finding = Finding("force", "none", (), 0.0, after.z, 0.0, detectable(other), "", base.model)
    delay, gain = (value, 1.0) if what == "delay" else (0.0, value)
    return after.z, delay, gain, finding


def _corrected(response: Response, delay: float, gain: float) -> Response:
    """Return a response whose force is what a cell of that delay [s] and gain has measured."""
    assert response.force is not None
    time = np.arange(len(response.force)) * response.dt
    force = np.interp(time + delay, time, response.force) if delay else response.force
    return replace(response, force=force / gain, noise_force=response.noise_force / gain)


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
        sites.update({effect: sites.get(effect, site) for effect in effects})
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
