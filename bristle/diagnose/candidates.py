"""Each effect tried inside the model: refitted on the training runs, judged on the held-out ones."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from os import cpu_count

import numpy as np
from numpy.typing import NDArray

from ..identify.fit import FIXED, Fit, Model, Problem, Run, fit, huber, parameter
from ..physics.effect import EFFECTS, effects_of

Array = NDArray[np.float64]

# Where a search begins, as factors on an effect's defaults scaled to the rig.
SEARCH = {
    "stribeck": {"v_s": (0.3, 1.0, 3.0)},
    "flattening": {"v_f": (0.3, 1.0, 4.0)},
    "saturation": {"V_s": (0.4, 1.0)},
    "coil_lag": {"tau": (0.5, 2.0)},
    "temperature": {"E_0": (0.5, 4.0), "tau": (0.2,)},
    "presliding": {"x_s": (0.3, 2.0)},
    "mount_compliance": {"k": (0.3, 2.0)},
    "backlash": {"gap": (0.5, 2.0)},
}


@dataclass(frozen=True)
class Trial:
    """A model tried: its fit on the training runs and its errors on the held-out ones.

    `z` is the robust RMS of residual over expected noise, per held-out run; `loss` (n,) the robust
    loss per sample over all held-out runs, `residual` (n,) the normalised residuals.
    """

    effects: tuple[str, ...]
    fit: Fit
    z: float
    z_train: float
    rms: float
    loss: Array
    residual: Array


REFERENCE = {
    "N": 4.0, "N/m": 800.0, "N/m2": 1.6e5, "N/m3": 3.2e7, "m": 5e-3, "m/s": 0.07, "N.s/m": 57.0,
    "N.s2/m2": 816.0, "kg": 2.7, "J": 0.02, "V": 5.0,
}  # fmt: skip
"""Typical sizes on the rig of 10 N for which the effects' defaults are written."""


def starts(effect: str, base: Model, problem: Problem) -> list[Model]:
    """Return the models from which the search for an effect's parameters begins."""
    values = {}
    for name, declared in EFFECTS[effect].parameters.items():
        reference = REFERENCE.get(declared.unit)
        start = declared.value * (problem.size(declared.unit) / reference if reference else 1.0)
        low, high = declared.bounds
        values[name] = min(max(start, low), high)
    factors = SEARCH.get(effect, {})
    out = []
    for combination in product(*factors.values()):
        own = dict(values)
        for name, factor in zip(factors, combination, strict=True):
            own[name] *= factor
        named = {f"{effect}.{name}": value for name, value in own.items()}
        out.append(replace(base, effects=(*base.effects, effect), values={**base.values, **named}))
    return out


def judge(effects: tuple[str, ...], found: Fit, train: Problem, held_out: Problem) -> Trial:
    """Return how a fitted model does on runs that it has not seen."""
    residuals, raw = [], []
    for run, (bias, sigma, _) in zip(held_out.runs, held_out.expectation(found.model), strict=True):
        error = run.force - held_out.predict(found.model, run) - bias
        raw.append(error[run.skip :])
        residuals.append((error / sigma)[run.skip :])
    z = np.concatenate(residuals)
    return Trial(
        effects, found, robust(z), np.sqrt(2.0 * found.cost), float(np.sqrt(np.mean(np.concatenate(raw) ** 2))),
        huber(z), z,
    )  # fmt: skip


def robust(z: Array) -> float:
    """Return the robust RMS, the median of |z| over 0.6745; tails beyond 3 count in full."""
    tail = np.sqrt(np.mean(np.minimum(np.abs(z), 6.0) ** 2))
    return float(
        max(np.median(np.abs(z)) / 0.6745, 0.5 * tail + 0.5 * np.median(np.abs(z)) / 0.6745)
    )


def try_effect(effect: str, base: Fit, train: Problem, held_out: Problem) -> Trial:
    """Refit the model with one more effect from several starts and judge the best."""
    expected = train.expectation(base.model)
    begun = [
        fit(train, model, expectation=expected, max_evaluations=5, with_std=False)
        for model in starts(effect, base.model, train)
    ]
    best = min(begun, key=lambda one: one.cost)
    best = fit(train, best.model, expectation=expected, max_evaluations=20, with_std=False)
    best = fit(train, best.model, expectation=train.expectation(best.model), max_evaluations=8)
    return judge((*base.model.effects, effect), best, train, held_out)


def try_all(base: Fit, train: Problem, held_out: Problem) -> list[Trial]:
    """Try every effect that can join the law, on all cores; best first."""
    names = [
        e.name for e in effects_of("damper", base.model.law) if e.name not in base.model.effects
    ]
    slow = [n for n in names if "rate" in EFFECTS[n].hooks()]
    order = slow + [n for n in names if n not in slow]
    with ThreadPoolExecutor(cpu_count()) as pool:
        trials = list(pool.map(lambda name: try_effect(name, base, train, held_out), order))
    return sorted(trials, key=lambda trial: trial.loss.mean())
