"""Every law on every published bench, fitted as `identify` fits, over plain least squares.

The reference is scipy's `least_squares` from eight starts, within the same bounds, on the same
samples and the same smoothed motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from bristle.core.arrays import Array
from bristle.identification.fit import Search
from bristle.identification.problem import Problem, steady, without
from bristle.identification.rig import DAMPER, ROLES, Site, bench_rig
from bristle.identification.rig_fit import fit_site
from bristle.identification.starts import start_models
from bristle.model.model import Model
from bristle.physics.laws import base_and_variant, law_names

from ._measured import BENCHES
from ._rows import Row

STARTS = 8
TRAINING, HELD_OUT = 1.02, 1.05
"""Goals: times the error of least squares."""
MOST = 100
"""Evaluations of scipy's search, Jacobians not counted."""
FAR = 1e9  # N, in place of a force that is not a number


@dataclass(frozen=True)
class Beside:
    """Errors over the RMS of the force, of the fit and of least squares: training, held out."""

    data: str
    law: str
    fitted: tuple[float, float]
    least: tuple[float, float]

    @property
    def ratios(self) -> tuple[float, float]:
        """The fit's errors over those of least squares."""
        return self.fitted[0] / self.least[0], self.fitted[1] / self.least[1]


def beside(data: Path, sets: str = "", laws: tuple[str, ...] = ()) -> Iterator[Beside]:
    """Yield every law on every set that is there and whose name holds `sets`."""
    for name, (_, runs) in BENCHES.items():
        if sets not in name or not (data / name).is_dir():
            continue
        train, held_out = bench_rig(*runs(data / name)).sites(Model("bingham"))[DAMPER].pair
        for law in laws or law_names():
            yield _beside(name, law, train, held_out)


def _beside(data: str, law: str, train: Problem, held_out: Problem) -> Beside:
    base, variant = base_and_variant(law)
    model = Model(base.name, (), dict(variant.values))
    site = bench_site(train, held_out)
    fitted = fit_site(model, site, {DAMPER: site}, 4, {}).model
    least = least_squares_fit(train, model)
    return Beside(
        data, law, (share(train, fitted), share(held_out, fitted)),
        (share(train, least), share(held_out, least)),
    )  # fmt: skip


def bench_site(train: Problem, held_out: Problem) -> Site:
    """Return runs of a bench as a site."""
    return Site(DAMPER, lambda role: (train, held_out)[ROLES.index(role)])


def errors_of(problem: Problem, model: Model) -> Array:
    """Return measured less predicted force [N] of the samples that are judged (n,)."""
    parts = [
        (run.force - problem.predict(model, run))[run.skip :][run.judged] for run in problem.runs
    ]
    return np.nan_to_num(np.concatenate(parts), nan=FAR, posinf=FAR, neginf=-FAR)


def share(problem: Problem, model: Model) -> float:
    """Return the RMS error over the RMS of the force, over the samples that are judged."""
    force = np.concatenate([run.force[run.skip :][run.judged] for run in problem.runs])
    return float(np.linalg.norm(errors_of(problem, model)) / np.linalg.norm(force))


def least_squares_fit(problem: Problem, model: Model) -> Model:
    """Return a model by plain least squares, the best of several starts."""
    if steady(problem):
        model = without(model, tuple(n for n in model.law_class.driven() if n not in model.fixed))
    none = [(np.zeros(1), np.ones(1), np.zeros((1, 1))) for _ in problem.runs]
    ends = []
    for start in start_models(problem, model, STARTS):
        scaled = Search(problem, start, none, start.free(), logarithms=False)
        found = least_squares(
            lambda theta, s=scaled: errors_of(problem, s.at(theta)), scaled.start,
            bounds=(scaled.low - 1e-12, scaled.high + 1e-12), x_scale="jac", max_nfev=MOST,
        )  # fmt: skip
        ends.append((found.cost, scaled.at(found.x)))
    return min(ends, key=lambda end: end[0])[1]


def rows(data: Path) -> list[Row]:
    """Return the figures: the largest ratio of each set, on training and on held-out runs."""
    out: list[Row] = []
    found = [*beside(data)]
    for name in BENCHES:
        own = [one for one in found if one.data == name]
        if not own:
            out.append(Row(f"fit / least squares, {name}", f"not run: there is no {name}"))
            continue
        for k, (role, goal) in enumerate((("training", TRAINING), ("held out", HELD_OUT))):
            worst = max(own, key=lambda one: one.ratios[k])
            out.append(
                Row(
                    f"fit / least squares, {name}, {role}, the worst of {len(own)} laws",
                    f"{worst.ratios[k]:.3f} ({worst.law})", f"<= {goal}", worst.ratios[k] / goal,
                    "; ".join(f"{one.law} {one.ratios[k]:.3f}" for one in own),
                )
            )  # fmt: skip
    return out
