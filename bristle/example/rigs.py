"""The rigs of examples, drawn from a seed: a damper, and a frame around it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import StudyError
from . import tower
from .damper import Damper, in_library_names
from .hidden import Scales, Values

Array = NDArray[np.float64]

CENTRE = {
    "bingham": {"Y_0": 1.3, "Y_1": 0.83, "D_0": 100.0, "D_1": 20.0, "w_n": 0.02},
    "lugre": {"Y_0": 1.3, "Y_1": 0.83, "D_0": 100.0, "D_1": 20.0, "w_n": 0.02, "l": 2e-3,
              "c": 5.0},
}  # fmt: skip
"""Dampers of about 10 N: forces N, N/V; drags N s/m, N s/(m V); speed m/s; length m; N s/m."""
FORCE, SPEED, STROKE = 10.0, 0.18, 0.02
DRIFT = 5e-3
"""Storeys drift by about 3 mm where the base moves by half the stroke."""
MASSES, STIFFNESSES = (1.97, 1.23, 1.23), (1057.0, 1366.0, 1366.0)
SPREAD = 0.12
"""Numbers of a rig lie up to this share off the table."""
LAYER = {"spring_5", "rub", "crack_drift", "stop_gap", "stop_k", "brace_gap", "brace_k"}
"""What is hidden in the building, not in its damper."""


def streams(seed: int) -> list[np.random.Generator]:
    """Return what draws the rig and its runs, what is hidden, and the noise."""
    return [np.random.default_rng(one) for one in np.random.SeedSequence(seed).spawn(3)]


def scales_of(rig: str, law: str) -> Scales:
    """Return what the numbers of a rig ("bench", "building") are measured in."""
    drift = DRIFT if rig == "building" else 0.0
    return Scales(FORCE, SPEED, STROKE, CENTRE[law]["w_n"], drift)


def draw_damper(law: str, rng: np.random.Generator) -> Values:
    """Return the values of a damper's law."""
    table = CENTRE[law]
    spread = _spread(tuple(table.values()), rng)
    return dict(zip(table, spread.tolist(), strict=True))


def draw_frame(rng: np.random.Generator) -> tower.Frame:
    """Return the frame of a building; its damper is drawn before."""
    return tower.frame(_spread(MASSES, rng), _spread(STIFFNESSES, rng))


def tower_of(frame: tower.Frame, law: str, values: Values, secret: Values) -> tower.Tower:
    """Return a building with its damper, and what is hidden in either.

    Parameters
    ----------
    frame : of the building
    law, values : of its damper
    secret : what is hidden, of both
    """
    layer = {name: value for name, value in secret.items() if name in LAYER}
    inner = {name: value for name, value in secret.items() if name not in LAYER}
    return tower.Tower(frame, Damper(law, values, inner), layer, scales_of("building", law))


def rig_of(answer: Mapping[str, Any]) -> Damper | tower.Tower:
    """Return the true rig of an example, from what its sealed answer holds.

    Parameters
    ----------
    answer : mapping
        Of `sealed.unseal`.

    Raises
    ------
    StudyError
        If another version of bristle, which drew other rigs, has made the example.
    """
    law, draw = answer["law"], streams(int(answer["seed"]))[0]
    values = draw_damper(law, draw)
    told = in_library_names(law, values)
    if not all(np.isclose(told[name], value) for name, value in answer["base"].items()):
        raise StudyError(
            "the example was made by a version of bristle that drew other rigs: this one cannot "
            f"build it again. Make it anew with --seed {answer['seed']}."
        )
    secret = {name: float(value) for name, (value, _) in answer["values"].items()}
    if answer["rig"] == "bench":
        return Damper(law, values, secret)
    return tower_of(draw_frame(draw), law, values, secret)


def _spread(centre: tuple[float, ...], rng: np.random.Generator) -> Array:
    return np.array(centre) * (1.0 + rng.uniform(-SPREAD, SPREAD, len(centre)))
