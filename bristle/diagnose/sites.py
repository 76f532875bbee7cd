"""What one site of a building lacks: its isolation layer, a storey, or the load cell.

There the model is a line and equilibrium gives the force, with white noise of known size. So the
effects of the structure are few and distinct, and each is judged by held-out runs alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Fit, fit
from ..identify.line import fit_line
from ..identify.model import Model, Problem, Run
from ..identify.start_grid import starts
from ..identify.structure import (
    StructureProblem,
    StructureRun,
    thinned,
)
from ..physics.effect import EFFECTS, effects_of
from ..physics.laws import law_of_part
from .candidates import Trial, judge
from .evidence import paired

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
    before: Trial | None = None


def look_at(
    site: str, train: StructureProblem, held_out: StructureProblem, present: Model | None = None
) -> Finding:
    """Return what a layer's or storey's problem shows.

    `present` holds the effects that the model has at this site already, with their values.
    """
    linear = law_of_part(site)
    hook = "force" if site == "layer" else "spring"
    base = fit_line(train, linear.name)
    taken: set[str] = set()
    if present is not None and present.effects:
        values = {**base.model.values, **present.values}
        base = fit(train, replace(present, law=linear.name, values=values), with_std=False)
        taken = set(present.effects).union(*(EFFECTS[name].excludes for name in present.effects))
    before = judge(base.model, train, held_out)
    able = [e for e in effects_of("structure") if hook in e.hooks() and e.name not in taken]
    names = [e.name for e in able]
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


def shortened(problem: StructureProblem, seconds: float) -> StructureProblem:
    """Return the problem with the first so many seconds of each run, itself if none is longer."""
    if all(len(_whole(run).x) * run.dt <= seconds for run in problem.runs):
        return problem
    return problem.of([_begin_of(run, round(seconds / run.dt)) for run in problem.runs])


def _whole(run: Run) -> Run:
    assert isinstance(run, StructureRun)
    assert run.whole is not None
    return run.whole


def _begin_of(run: Run, samples: int) -> StructureRun:
    """Return the first samples of a run, from rest: what a law remembers begins there."""
    assert isinstance(run, StructureRun)
    keep = run.keep[run.keep < samples]
    first, own = slice(samples), slice(len(keep))
    old = _whole(run)
    whole = replace(
        old, x=old.x[first], v=old.v[first], a=old.a[first], V=old.V[first],
        force=old.force[first], draws=old.draws[:, first],
    )  # fmt: skip
    return replace(
        run, x=run.x[own], v=run.v[own], a=run.a[own], V=run.V[own], force=run.force[own],
        draws=run.draws[:, own], whole=whole, keep=keep,
    )  # fmt: skip


def structure_starts(effect: str, base: Model, train: Problem) -> list[Model]:
    """Return the models from which the search for an effect of the structure begins.

    Lengths are shares of the largest motion, for a stop beyond it has no force at all.
    """
    reach = max(float(np.max(np.abs(run.x))) for run in train.runs)
    speed = max(float(np.max(np.abs(run.v))) for run in train.runs)
    force, stiffness = train.size("N"), train.size("N/m")
    damping = train.size("N.s/m")
    grid: dict[str, tuple[dict[str, tuple[float, ...]], ...]] = {
        "base_friction": (
            {"limit": (0.1 * force,), "x_s": (0.0, 0.05 * reach), "v_r": (0.1 * speed,)},
        ),
        "duffing": (
            {"k_3": (0.3 * stiffness / reach**2, -0.1 * stiffness / reach**2), "shape": (3.0, 5.0)},
        ),
        "end_stop": (
            {
                "clearance": (0.55 * reach, 0.75 * reach, 0.9 * reach),
                "k": (1.0 * stiffness,), "c": (1e-3 * damping,),
            },
        ),
        "storey_softening": (
            {"d_half": (0.7 * reach, 2.5 * reach)},
            {"d_half": (5.0 * reach,), "yields": (0.3,), "d_y": (0.15 * reach, 0.4 * reach)},
        ),
    }  # fmt: skip
    if effect not in grid:  # a user's own
        return starts(effect, base, train)
    own = {name: p.value for name, p in EFFECTS[effect].parameters.items()}
    out = []
    for net in grid[effect]:
        for values in product(*net.values()):
            chosen = {**own, **dict(zip(net, values, strict=True))}
            named = {f"{effect}.{name}": value for name, value in chosen.items()}
            values_now = {**base.values, **named}
            out.append(replace(base, effects=(*base.effects, effect), values=values_now))
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
        return Finding(
            site, kind, (), before.z, before.z, 0.0, seen, where, before.model, tried, before
        )
    share = 1.0 - excess(best) / excess(before)
    found = Finding(
        site, "unknown", (), before.z, best.z, share, seen, "", best.model, tried, before
    )
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
    shown: dict[str, list[Array]] = {
        "displacement": [run.x for run in runs],
        "velocity": [run.v for run in runs],
        "acceleration": [run.a for run in runs],
        "time": [run.dt * np.arange(len(run.x), dtype=np.float64) for run in runs],
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
