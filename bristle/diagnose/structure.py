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

from ..identify.fit import Fit, Model, Problem, fit, identify
from ..identify.response import Response, responses
from ..identify.structure import (
    LinearLayer,
    LinearStorey,
    StructureProblem,
    fit_line,
    problems_of,
)
from ..physics.building import Building
from ..physics.effect import EFFECTS, effects_of
from ..records.measurement import Measurement
from .candidates import Trial, judge, starts, try_all
from .evidence import organised, paired, z_of
from .sensors import SensorFault, sensor_faults
from .verdict import CLEAN, GAIN, Verdict, decide

Array = NDArray[np.float64]

SHARE = 0.7
"""Share of a site's excess that an effect must explain where its form leaves more than `CLEAN`."""

NEARLY = 0.02
"""Rivals whose z lies that close together are not told apart."""

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
    fit: Fit | None = None
    trials: tuple[Trial, ...] = ()


@dataclass(frozen=True)
class StructureDiagnosis:
    """The verdict on a building's rig and what it rests on.

    `findings` by site; `damper` the damper's law as fitted, and `damper_verdict` what it lacks.
    `reconstructed` says whether the damper's force was reconstructed.
    """

    verdict: Verdict
    findings: dict[str, Finding]
    damper: Fit | None
    damper_verdict: Verdict | None
    reconstructed: bool
    sensors: tuple[SensorFault, ...] = ()
    problems: dict[str, tuple[StructureProblem, StructureProblem]] = field(default_factory=dict)


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
    late = None
    if "layer" in findings and findings["layer"].kind != "none" and "damper" in problems:
        say("layer: the load cell")
        late = load_cell(findings["layer"], ours, theirs, building, law)
    if late is not None:
        findings["layer"], (ours, theirs) = late[0], late[1]
        problems = {**problems_of(ours, theirs, building, law), "layer": problems["layer"]}
    softer = any(f.kind != "none" for s, f in findings.items() if s.startswith("storey"))
    if softer and "damper" in problems and problems["damper"][0].reconstructed:
        problems = problems_of(ours, theirs, building, law, linear_storeys=False)
    sensors = tuple(sensor_faults([_as_bench(one, building) for one in train]))
    if "damper" not in problems:
        return StructureDiagnosis(
            combine(findings, None, False), findings, None, None, False, sensors, problems
        )
    own, other = problems["damper"]
    say("damper: its law, then effects")
    base = identify(own, law)
    verdict = damper_verdict(base, own, other)
    return StructureDiagnosis(
        combine(findings, verdict, own.reconstructed), findings, base, verdict, own.reconstructed,
        sensors, problems,
    )  # fmt: skip


def damper_verdict(base: Fit, train: StructureProblem, held_out: StructureProblem) -> Verdict:
    """Return the damper's verdict; with a reconstructed force the layer's effects take part."""
    before = judge(base.model.effects, base, train, held_out)
    trials = try_all(base, train, held_out)
    if train.reconstructed:
        for effect in effects_of("structure"):
            if "force" in effect.hooks():
                trials.append(try_effect(effect.name, base, train, held_out))
        trials.sort(key=lambda trial: float(trial.loss.mean()))
    return decide(base, before, trials, train, held_out)


def look_at(site: str, train: StructureProblem, held_out: StructureProblem) -> Finding:
    """Return what a layer's or storey's problem shows."""
    linear = LinearLayer if site == "layer" else LinearStorey
    hook = "force" if site == "layer" else "spring"
    base = fit_line(train, linear.name)
    before = judge((), base, train, held_out)
    trials = [
        try_effect(effect.name, base, train, held_out)
        for effect in effects_of("structure")
        if hook in effect.hooks() or (site == "storey1" and hook == "force" and train.storey == 1)
    ]
    trials.sort(key=lambda trial: float(trial.loss.mean()))
    return judge_site(site, base, before, trials, train, held_out)


def try_effect(effect: str, base: Fit, train: Problem, held_out: Problem) -> Trial:
    """Refit a model with one more effect of the structure from several starts; judge the best."""
    expected = train.expectation(base.model)
    begun = [
        fit(train, model, expectation=expected, max_evaluations=6, with_std=False)
        for model in structure_starts(effect, base.model, train)
    ]
    best = min(begun, key=lambda one: one.cost)
    best = fit(train, best.model, expectation=expected, max_evaluations=30)
    return judge((*base.model.effects, effect), best, train, held_out)


def structure_starts(effect: str, base: Model, train: Problem) -> list[Model]:
    """Return the models from which the search for an effect of the structure begins.

    Lengths are shares of the largest motion, for a stop beyond it has no force at all.
    """
    reach = max(float(np.max(np.abs(run.x))) for run in train.runs)
    force = train.size("N")
    stiffness = train.size("N/m")
    grid: dict[str, dict[str, tuple[float, ...]]] = {
        "base_friction": {"limit": (0.02 * force, 0.2 * force)},
        "duffing": {"k_3": (0.3 * stiffness / reach**2, -0.1 * stiffness / reach**2)},
        "end_stop": {
            "clearance": (0.55 * reach, 0.75 * reach, 0.9 * reach),
            "k": (0.5 * stiffness, 5.0 * stiffness),
            "c": (1e-3 * train.size("N.s/m"),),
        },
        "storey_softening": {"d_half": (0.7 * reach, 2.5 * reach), "which": (0.0,)},
    }
    if effect not in grid:  # a user's own
        return starts(effect, base, train)
    own = {name: p.value for name, p in EFFECTS[effect].parameters.items()}
    out = []
    for values in product(*grid[effect].values()):
        chosen = {**own, **dict(zip(grid[effect], values, strict=True))}
        named = {f"{effect}.{name}": value for name, value in chosen.items()}
        out.append(replace(base, effects=(*base.effects, effect), values={**base.values, **named}))
    return out


def judge_site(
    site: str, base: Fit, before: Trial, trials: list[Trial], train: StructureProblem,
    held_out: StructureProblem,
) -> Finding:  # fmt: skip
    """Return the finding that a site's trials lead to; held-out runs decide."""
    z_0 = z_of(before.loss)
    seen = detectable(held_out)
    tried = tuple(trials)
    best = trials[0] if trials else None
    z_1 = z_of(best.loss) if best else z_0
    share = (z_0**2 - z_1**2) / max(z_0**2 - 1.0, 1e-9)
    helps = best is not None and paired(before.loss, best.loss).low > 0.0
    if not helps or best is None or 1.0 - z_1 / z_0 < GAIN:
        if z_0 <= CLEAN:
            return Finding(site, "none", (), z_0, z_0, 0.0, seen, fit=base, trials=tried)
        where = coordinate_of(before.residual, held_out)
        return Finding(site, "unknown", (), z_0, z_0, 0.0, seen, where, base, tried)
    if z_1 > CLEAN and share < SHARE:
        where = coordinate_of(best.residual, held_out)
        return Finding(site, "unknown", (), z_0, z_1, share, seen, where, best.fit, tried)
    rivals = [best.effects[-1]]
    for other in trials[1:]:
        close = z_of(other.loss) / z_1 - 1.0 < NEARLY
        if close or paired(other.loss, best.loss).low <= 0.0:
            rivals.append(other.effects[-1])
    kind = "effect" if len(rivals) == 1 else "class"
    return Finding(site, kind, tuple(rivals[:3]), z_0, z_1, share, seen, "", best.fit, tried)


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
        share, chance = organised(residual, values)
        shares[name] = share - chance
    best = max(shares, key=lambda name: shares[name])
    return best if shares[best] > 0.0 else "time"


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
    loss, delay, gain, finding = best
    own = min((float(t.loss.mean()) for t in layer.trials), default=np.inf)
    z_1 = z_of(np.array([loss]))
    share = (layer.z_before**2 - z_1**2) / max(layer.z_before**2 - 1.0, 1e-9)
    if loss >= own or 1.0 - z_1 / layer.z_before < GAIN or (z_1 > CLEAN and share < SHARE):
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
    """Return loss on held-out runs, delay [s], gain and finding of the best delay or gain."""
    from scipy.optimize import minimize_scalar

    def problem(value: float, part: list[Response]) -> StructureProblem:
        delay, gain = (value, 1.0) if what == "delay" else (0.0, value)
        from ..identify.structure import layer_run

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
    after = judge((), base, own, other)
    finding = Finding(
        "force", "none", (), 0.0, z_of(after.loss), 0.0, detectable(other), fit=base
    )
    delay, gain = (value, 1.0) if what == "delay" else (0.0, value)
    return float(after.loss.mean()), delay, gain, finding


def _corrected(response: Response, delay: float, gain: float) -> Response:
    """Return a response whose force is what a cell of that delay [s] and gain has measured."""
    assert response.force is not None
    time = np.arange(len(response.force)) * response.dt
    force = np.interp(time + delay, time, response.force) if delay else response.force
    return replace(response, force=force / gain, noise_force=response.noise_force / gain)


def combine(
    findings: Mapping[str, Finding], damper: Verdict | None, reconstructed: bool
) -> Verdict:
    """Return one verdict from what the sites show."""
    named: list[str] = []
    rivals: list[str] = []
    unknown = [f for f in findings.values() if f.kind == "unknown"]
    for finding in findings.values():
        if finding.kind == "effect":
            named += [e for e in finding.effects if e not in named]
        elif finding.kind == "class":
            rivals += [e for e in finding.effects if e not in rivals]
    worst = max(findings.values(), key=lambda f: f.z_before, default=None)
    z_before = worst.z_before if worst else float("nan")
    z_after = worst.z_after if worst else float("nan")
    coordinate = unknown[0].coordinate if unknown else ""
    ranking: list[dict[str, Any]] = []
    trial = None
    alike: list[str] = []
    if damper is not None:
        ranking = list(damper.ranking)
        if damper.kind == "unknown":
            coordinate = coordinate or damper.coordinate
        elif damper.kind in ("effect", "class"):
            own, alike = lookalikes(damper) if reconstructed else (list(damper.effects), [])
            if damper.kind == "effect" and not alike:
                named += [e for e in own if e not in named]
            else:
                rivals += [e for e in [*own, *alike] if e not in rivals]
        trial = damper.trial
        if not (named or rivals or unknown) or z_before < damper.z_before:
            z_before, z_after = damper.z_before, damper.z_after
    kind = "none"
    if unknown or (damper is not None and damper.kind == "unknown"):
        kind = "unknown"
    elif rivals:
        kind = "class"
    elif named:
        kind = "effect"
    effects = tuple([*named, *rivals])
    evidence = {
        "sites": {
            site: {"kind": f.kind, "effects": f.effects, "z": (f.z_before, f.z_after)}
            for site, f in findings.items()
        },
        "reconstructed": reconstructed,
    }
    untestable = damper.untestable if damper is not None else ()
    if reconstructed:
        untestable = (*untestable, *(e for e in ("base_friction",) if e not in effects))
    return Verdict(
        kind, effects[:3] if kind == "class" else effects, ranking, z_before, z_after, coordinate,
        max((f.detectable for f in findings.values()), default=float("nan")), untestable,
        words(kind, effects, findings, alike, coordinate), trial, evidence,
    )  # fmt: skip


def lookalikes(verdict: Verdict) -> tuple[list[str], list[str]]:
    """Return the effects of a verdict and what else would do the same to a reconstructed force."""
    own = list(verdict.effects)
    alike = [twin for e in own for twin in LOOKALIKE.get(e, ()) if twin not in own]
    return own, list(dict.fromkeys(alike))


def words(
    kind: str, effects: tuple[str, ...], findings: Mapping[str, Finding], alike: list[str],
    coordinate: str,
) -> str:  # fmt: skip
    """Return the verdict as sentences."""
    where = {e: f.site for f in findings.values() for e in f.effects}
    told = []
    if kind == "none":
        told.append("No effect is missing at any site that these runs test.")
    elif kind == "effect":
        sites = ", ".join(f"{e} ({where.get(e, 'damper')})" for e in effects)
        told.append(f"Missing: {sites}.")
    elif kind == "class":
        told.append(f"Missing is one of {', '.join(effects)}; these runs cannot say which.")
    else:
        told.append(f"Something is missing that no effect explains, along {coordinate}.")
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
