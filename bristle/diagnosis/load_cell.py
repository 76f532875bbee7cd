"""A load cell that is late or wrongly scaled, told from missing physics by equilibrium."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
from scipy.optimize import minimize_scalar

from ..core.text import plain
from ..identification.building_motion import Response
from ..identification.building_sites import StructureProblem, line_problem
from ..identification.rig import corrected, late_effects
from ..identification.rig_fit import fit_line
from ..physics.building import Building
from ..physics.effect import EFFECTS, instrument_of
from ..physics.laws import law_of_part
from .effect_limits import detectable
from .rule import SITE
from .site_diagnosis import SiteDiagnosis
from .trials import judge

FORCE_GAIN = "force_gain"
"""What a finding names for a load cell of a wrong scale, which is no effect."""


def load_cell(
    layer: SiteDiagnosis,
    train: list[Response],
    holdout: list[Response],
    building: Building,
    level: int = 0,
) -> tuple[SiteDiagnosis, tuple[list[Response], list[Response]]] | None:
    """Return the finding that the load cell is late or wrongly scaled, with the forces set right.

    Equilibrium knows when and how large the force is.

    Parameters
    ----------
    layer : the finding at the isolation layer, or at a storey that the damper acts across, with
        the trials of its effects
    train, holdout : responses to fit to, and those that decide
    building : whose masses, damping and stiffnesses equilibrium takes
    level : the one above that layer or storey

    Returns
    -------
    tuple or None
        The finding, then the training and held-out responses with the force corrected. None where
        no delay and no gain explains the layer better than its own effects do.
    """
    both = [_search_cell(what, train, holdout, building, level) for what in ("delay", "gain")]
    finding, (delay, gain) = min(both, key=lambda found: found[0].z_after)
    z_1 = finding.z_after
    own = min((trial.z for trial in layer.trials), default=np.inf)
    share = SITE.explained(layer.z_before, z_1)
    if z_1 >= own or 1.0 - z_1 / layer.z_before < SITE.gain:
        return None
    if z_1 > SITE.clean and share < SITE.share:
        return None
    if not delay and abs(gain - 1.0) <= SITE.mass_doubt:
        return None  # masses that are not known better would do the same
    name = instrument_of("force", "delay") if delay else FORCE_GAIN
    right = [[corrected(r, delay, gain) for r in part] for part in (train, holdout)]
    faulty = replace(
        finding, site="force", kind="effect", effects=(name,), z_before=layer.z_before, share=share,
        coordinate=f"{delay:.3g} s" if delay else f"{gain:.4g}", noise_known=layer.noise_known,
    )  # fmt: skip
    return faulty, (right[0], right[1])


def _search_cell(
    what: str, train: list[Response], holdout: list[Response], building: Building, level: int
) -> tuple[SiteDiagnosis, tuple[float, float]]:
    """Return the finding of the best delay or gain, and that delay [s] and gain."""

    def cell(value: float) -> tuple[float, float]:
        return (value, 1.0) if what == "delay" else (0.0, value)

    def problem(value: float, part: list[Response]) -> StructureProblem:
        return line_problem([corrected(r, *cell(value)) for r in part], building, level)

    law = law_of_part("layer" if building.isolated and not level else "storey1").name

    def cost(value: float) -> float:
        return fit_line(problem(value, train), law).cost

    grid = np.array([0.6, 0.8, 0.9, 1.1, 1.25, 1.6])
    if what == "delay":
        grid = train[0].dt * np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
    costs = [cost(value) for value in grid]
    k = int(np.argmin(costs))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    value = float(
        minimize_scalar(cost, bounds=(low, high), method="bounded", options={"maxiter": 14}).x
    )
    own, other = problem(value, train), problem(value, holdout)
    base = fit_line(own, law)
    after = judge(base.model, own, other)
    least = detectable(other, other.expectation(base.model), SITE)
    found = SiteDiagnosis("force", "none", (), 0.0, after.z, 0.0, least, "", base.model)
    return found, cell(value)


# What a late load cell does to the force: a low-pass with its corner, or a delay.

MOSTLY = 0.6
"""Share of the lateness that a filter takes from which on the load cell is said to low-pass."""


def low_pass_text(found: SiteDiagnosis) -> str:
    """Return what filter makes the force late, "" where the force is not late or only delayed.

    The filter is of second order; its corner is where half the power is left.

    Parameters
    ----------
    found : the damper's finding
    """
    if found.kind != "effect" or found.after is None:
        return ""
    for name in late_effects([one for one in found.effects if one in EFFECTS]):
        time, share, *more = (
            found.after.model.value(f"{name}.{one}") for one in EFFECTS[name].late
        )
        d = more[0] if more else 1.0  # else two equal lags
        if share >= MOSTLY and time > 0.0:
            natural = d / (pi * share * time)
            corner = natural * sqrt(1.0 - 2.0 * d * d + sqrt((1.0 - 2.0 * d * d) ** 2 + 1.0))
            return (
                f"{plain(100.0 * share, 2)} % of the {plain(1e3 * time)} ms by which the force is "
                f"late are a low-pass of second order (damping ratio {plain(d, 2)}), with its "
                f"corner near {plain(corner, 2)} Hz: a filter of the load cell or its amplifier."
            )
    return ""
