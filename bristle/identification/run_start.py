"""How a run begins: from which sample on it is judged, and which load its damper then holds.

A run that begins in motion, or at rest under load, was cut out of a longer one. What its elastic
parts hold is not known from the motion. The measured force tells it: the states of the model that
carry a force begin where they give this one, as far as the damper remembers its start.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import copysign
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.text import quantity
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS

SETTLING = 25
"""Samples at the start of a run that are not judged: at rest noise turns the sign of a speed."""

MOVING = 15
"""The same of a run that begins in motion: what is in series with the damper finds its load."""

RESTS = 2e-3
"""Share of the stroke that a damper at rest moves by at most: noise."""

STANDS = 0.2
"""Time [s] for which it does: a motion that begins gently is faster."""

LOADED = 0.2
"""Share of its RMS that the force has at the start of a rest under load."""

STILL = 0.03
"""Share of their RMS that speed and force have at most where a run sets out from rest: noise."""

MOST = 5
"""What part of a run this may cost at most: one in so many samples."""

FORGOTTEN = 0.5
"""Path, as a share of the stroke, after which the damper forgets how such a run began."""

COARSE = 0.05
"""Step [s] in which the path is followed: noise would lengthen it sample by sample."""

CARRIED = 0.01
"""Share of the load by which the model's force misses it where the search for its state ends."""

HELD = 0.2
"""Share of the load by which the model's force may miss it: a rest holds more than a slip does."""

TURNS = 4
"""Steps of the search for the state; the force of a bristle at rest is linear in it."""

TURNS_IN_MOTION = 3
"""Steps of the search for the states of a damper that begins in motion."""

LEAST = 1e-6
"""Share of the force's answer to all states below which nothing is told of a mixture of them."""

NUDGE = 1e-3
"""The first step of that search, over the stroke for a state in m, else as it is."""


class RunStart(NamedTuple):
    """How a run begins.

    `first` is the first sample that is judged; `rest` the number of samples before it in which the
    damper rests under load, 0 where it does not; `opening` that in which a damper that begins in
    motion remembers what was before, 0 where it begins otherwise.
    """

    first: int
    rest: int = 0
    opening: int = 0


def start_of(x: Array, v: Array, force: Array, dt: float) -> RunStart:
    """Return how a run begins.

    A force of zero at a speed of zero tells that no elastic part holds anything: the run sets out
    from rest, however soon it moves.

    Parameters
    ----------
    x, v, force : (n,) displacement [m], velocity [m/s], force [N]
    dt : sampling step [s]
    """
    if _none_at_first(v) and _none_at_first(force):
        return RunStart(SETTLING)
    span = float(np.ptp(x))
    rms = float(np.sqrt(np.mean(force**2)))
    stands = max(SETTLING, round(STANDS / dt))
    rests = float(np.ptp(x[:stands])) <= RESTS * span
    loaded = abs(float(np.mean(force[:SETTLING]))) > LOADED * rms
    if rests and not loaded:
        return RunStart(SETTLING)
    every = max(1, round(COARSE / dt))
    passed = np.cumsum(np.abs(np.diff(x[::every]))) > FORGOTTEN * span
    first = every * (1 + int(np.argmax(passed))) if passed.any() else len(x)
    first = min(max(SETTLING, first), max(SETTLING, len(x) // MOST))
    return RunStart(first, min(stands, first)) if rests else RunStart(MOVING, opening=first)


def _none_at_first(y: Array) -> bool:
    """Return whether a signal (n,) begins at zero, as far as noise tells."""
    return bool(abs(y[0]) <= STILL * np.sqrt(np.mean(y**2)))


def carrying_state(law: str, effects: Sequence[str]) -> tuple[str, str]:
    """Return the state that carries the force of a damper at rest, and its unit; "" where none is.

    That of bristles, where the law has some; else that of an effect in the place of the sign of the
    motion.
    """
    own = LAWS[law]
    for name, unit in own.states.items():
        if own.has("bristle") and name not in own.starts and f"{name}_0" not in own.parameters:
            return name, unit
    for effect in effects:
        if "yield_force" in EFFECTS[effect].hooks():
            for name, unit in EFFECTS[effect].states.items():
                return f"{effect}.{name}", unit
    return "", ""


def remembering_states(law: str, effects: Sequence[str]) -> list[tuple[str, str]]:
    """Return the states that carry a force from before a run, and their units.

    Those of the law that begin with no signal of the run, and those of effects in the place of the
    sign of the motion.
    """
    own = [(name, unit) for name, unit in LAWS[law].states.items() if name not in LAWS[law].starts]
    signs = [name for name in effects if "yield_force" in EFFECTS[name].hooks()]
    return own + [
        (f"{name}.{k}", unit) for name in signs for k, unit in EFFECTS[name].states.items()
    ]


@np.errstate(over="ignore", invalid="ignore")  # a force that overflows leads no closer
def start_in_motion(
    states: Sequence[tuple[str, str]],
    force: Array,
    stroke: float,
    opening: Callable[[Mapping[str, float]], Array],
) -> dict[str, float]:
    """Return the start values of states at which a model's force comes closest to the measured one.

    Least squares over the samples that remember the start, in a few steps of Broyden's: forces of
    elastic parts are nearly linear in what they hold at first. None bends by more than the stroke,
    or one that never slips gives each run a force of its own. Nothing where that leads no closer.

    Parameters
    ----------
    states : as `remembering_states` returns them
    force : measured (n,) [N], NaN where it says nothing
    stroke : of the run, peak to peak [m]
    opening : the model's force (n,) [N], for start values by name
    """
    names = [f"{name}_0" for name, _ in states]
    sizes = np.array([stroke if unit == "m" else 1.0 for _, unit in states])
    most = np.where([unit == "m" for _, unit in states], 1.0, np.inf)
    known = np.isfinite(force)

    def missed(at: Array) -> Array:
        return (force - opening(dict(zip(names, (at * sizes).tolist(), strict=True))))[known]

    at, left = np.zeros(len(names)), missed(np.zeros(len(names)))
    first = float(left @ left)
    slopes = np.column_stack([(left - missed(one)) / NUDGE for one in NUDGE * np.eye(len(names))])
    for _ in range(TURNS_IN_MOTION):
        square = slopes.T @ slopes
        if not (np.isfinite(square).all() and square.any()):
            return {}
        square += LEAST * np.trace(square) * np.eye(len(names))
        step = np.clip(at + np.linalg.solve(square, slopes.T @ left), -most, most) - at
        at = at + step
        after = missed(at)
        slopes += np.outer(left - after - slopes @ step, step) / max(float(step @ step), 1e-300)
        left = after
    found = dict(zip(names, (at * sizes).tolist(), strict=True))
    return found if float(left @ left) < first else {}


def start_under_load(
    state: tuple[str, str],
    load: float,
    stroke: float,
    resting: Callable[[Mapping[str, float]], Array],
) -> dict[str, float]:
    """Return the start value of a state at which a damper at rest carries its load, or nearly so.

    Nothing where no value of the state does: what the model holds at rest then is another part. Nor
    where the force only passes the load as it fades, as a bristle's does behind a dashpot.

    Parameters
    ----------
    state : as `carrying_state` returns it
    load : measured [N]
    stroke : of the run, peak to peak [m]
    resting : the model's force (n,) [N] over the rest, for start values by name
    """  # fmt: skip
    name, unit = state
    if not name:
        return {}

    def settled(value: float) -> float:
        force = resting({f"{name}_0": value})
        return float(np.mean(force[len(force) // 2 :]))  # a series element has settled by then

    now, most = 0.0, stroke if unit == "m" else 1.0
    force, step = settled(now), copysign(NUDGE * most, load)
    while settled(step) == force and abs(step) < most:  # play carries nothing before it is crossed
        step *= TURNS
    best, missed = 0.0, HELD * abs(load)
    for _ in range(TURNS):
        following = settled(now + step)
        slope = (following - force) / step
        now, force = now + step, following
        if abs(load - force) < missed:
            best, missed = now, abs(load - force)
        if not np.isfinite(slope) or slope == 0.0:
            break
        step = (load - force) / slope
        if abs(load - force) <= CARRIED * abs(load):
            best = now + step
            break
    found = {f"{name}_0": best}
    stays = best and np.max(np.abs(resting(found) - load)) <= abs(load)
    return found if stays else {}


def under_load_text(loads: Mapping[str, float]) -> str:
    """Return the sentence that tells which runs begin at rest under load; "" where none does.

    Parameters
    ----------
    loads : force at the start [N], by the name of the run
    """
    if not loads:
        return ""
    begun = ", ".join(f"{name} ({quantity(load, 'N')})" for name, load in loads.items())
    one = len(loads) == 1
    return f"{begun} begin{'s' * one} at rest under load: the model begins there with that force."
