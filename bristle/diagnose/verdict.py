"""From trials to a verdict: none, an effect, a class of rivals, or something unknown."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import Fit, Problem, Run
from .candidates import Trial, judge, try_all, try_effect
from .evidence import organised, paired, z_of

Array = NDArray[np.float64]

GAIN = 0.03
"""Smallest share by which an effect must lower z on held-out runs to be missing."""

CLEAN = 1.15
"""z after adding above which something else is missing."""

SHARE = 0.9
"""Share of the excess that an effect must explain where it leaves more than `CLEAN`."""

SERIES = ("presliding", "mount_compliance", "backlash")
"""Effects that many data cannot tell apart and that count as one family."""


@dataclass(frozen=True)
class Verdict:
    """What is missing; the fields of verdict.json."""

    kind: str
    effects: tuple[str, ...]
    ranking: list[dict[str, Any]]
    z_before: float
    z_after: float
    coordinate: str = ""
    detectable: float = float("nan")
    untestable: tuple[str, ...] = ()
    words: str = ""
    trial: Trial | None = None
    evidence: dict[str, Any] = field(default_factory=dict)


def coordinates(runs: list[Run]) -> dict[str, Array]:
    """Return the coordinates along which a residual may be organised, over all runs (n,)."""
    parts: dict[str, list[Array]] = {}
    for run in runs:
        s = slice(run.skip, None)
        rate = np.gradient(run.V, run.dt)
        power = np.cumsum(np.abs(run.force * run.v)) * run.dt
        rest = _since_rest(run)
        for name, values in {
            "displacement": run.x, "velocity": run.v, "speed": np.abs(run.v), "acceleration": run.a,
            "voltage": run.V, "voltage_rate": rate, "time": np.arange(len(run.x)) * run.dt,
            "dissipated_energy": power, "time_since_reversal": rest,
        }.items():  # fmt: skip
            parts.setdefault(name, []).append(values[s])
    return {name: np.concatenate(values) for name, values in parts.items()}


def _since_rest(run: Run) -> Array:
    """Return the time since the velocity last changed sign [s]."""
    out = np.zeros(len(run.v))
    for k in range(1, len(run.v)):
        out[k] = 0.0 if run.v[k] * run.v[k - 1] <= 0.0 else out[k - 1] + run.dt
    return out


def unexplained(residual: Array, runs: list[Run]) -> list[tuple[str, float, float]]:
    """Return the coordinates that organise a residual beyond chance: name, share, chance; most first.

    A residual that turns with the direction of motion is seen as the residual times that direction.
    """
    v = np.concatenate([run.v[run.skip :] for run in runs])
    found = []
    for name, values in coordinates(runs).items():
        for turned in (False, True):
            share, chance = organised(residual * np.sign(v) if turned else residual, values)
            if share > chance:
                found.append((name, share, chance))
    best: dict[str, tuple[str, float, float]] = {}
    for row in found:
        if row[0] not in best or row[1] > best[row[0]][1]:
            best[row[0]] = row
    return sorted(best.values(), key=lambda row: -row[1])


def diagnose(base: Fit, train: Problem, held_out: Problem) -> Verdict:
    """Return what is missing in a fitted model.

    Every effect is tried inside the model; decisions rest on held-out runs. See the constants of
    this module for what is asked of an effect.
    """
    before = judge(base.model.effects, base, train, held_out)
    trials = try_all(base, train, held_out)
    return decide(base, before, trials, train, held_out)


def decide(
    base: Fit, before: Trial, trials: list[Trial], train: Problem, held_out: Problem
) -> Verdict:
    """Return the verdict that trials of all single effects lead to."""
    z_0 = z_of(before.loss)
    ranking = [
        {"effect": t.effects[-1], "z_holdout": z_of(t.loss), "gain": 1.0 - z_of(t.loss) / z_0}
        for t in trials
    ]
    best = trials[0]
    z_1 = z_of(best.loss)
    gain = paired(before.loss, best.loss)
    rest = unexplained(before.residual, held_out.runs)
    if not (gain.low > 0.0 and 1.0 - z_1 / z_0 >= GAIN):
        if z_0 <= CLEAN and not (rest and rest[0][1] > 0.25):
            return Verdict("none", (), ranking, z_0, z_0, evidence={"rest": rest[:3]})
        where = rest[0][0] if rest else "time"
        return Verdict(
            "unknown", (), ranking, z_0, z_0, coordinate=where, evidence={"rest": rest[:3]}
        )
    explained = (z_0**2 - z_1**2) / max(z_0**2 - 1.0, 1e-9)
    if z_1 > CLEAN and explained < SHARE:
        pair = best_pair(base, trials, train, held_out)
        if pair is not None:
            z_2 = z_of(pair.loss)
            if z_2 <= CLEAN and paired(best.loss, pair.loss).low > 0.0:
                new = pair.effects[len(base.model.effects) :]
                return Verdict("effect", tuple(new), ranking, z_0, z_2, trial=pair)
        left = unexplained(before.residual, held_out.runs)
        return Verdict(
            "unknown", (), ranking, z_0, z_1, coordinate=left[0][0] if left else "time",
            evidence={"rest": left[:4], "explained": explained},
        )  # fmt: skip
    rivals = [best]
    for trial in trials[1:]:
        if trial.effects[-1] in SERIES and best.effects[-1] in SERIES:
            continue
        difference = paired(trial.loss, best.loss)
        if difference.low <= 0.0 or z_of(trial.loss) / z_1 - 1.0 < 0.005:
            rivals.append(trial)
    names = tuple(t.effects[-1] for t in rivals)
    if len(names) == 1:
        return Verdict(
            "effect", names, ranking, z_0, z_1, trial=best, evidence={"explained": explained}
        )
    return Verdict(
        "class", names[:3], ranking, z_0, z_1, trial=best, evidence={"rivals": len(names)}
    )


def best_pair(
    base: Fit, trials: list[Trial], train: Problem, held_out: Problem, width: int = 4
) -> Trial | None:
    """Return the best model with two more effects, grown from the best single ones."""
    first = trials[0]
    seconds = [t.effects[-1] for t in trials[1 : 1 + 2 * width]]
    grown = [try_effect(name, first.fit, train, held_out) for name in seconds[:width]]
    return min(grown, key=lambda t: t.loss.mean()) if grown else None
