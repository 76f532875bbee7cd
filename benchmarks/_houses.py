"""Buildings whose isolation layer or storey has something that no effect of the library is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from bristle.core.arrays import Array
from bristle.data.channels import ChannelSpec, channel_unit
from bristle.data.measurement import Measurement, measurements_of_frame
from bristle.examples import rigs
from bristle.examples.hidden import Scales
from bristle.examples.rigs import CENTRE, ROUGH, Damper, Signals
from bristle.physics.building import Building, from_data

Force = Callable[[Array, Array], Array]

LAW, NOISE = "lugre", 0.01
SHARES = (0.15, 0.4)
"""RMS of what is hidden, by that of the force of its site."""

SLOW = 1e-3
"""Speed [m/s] within which a friction turns round."""


@dataclass(frozen=True)
class Oddity:
    """Something that a layer or a storey may have.

    `level` is 0 for the isolation layer, else the storey; `force(x, v, far, fast)` (n,) of the
    motion there, far and fast being its RMS, in any unit; `right` the signals and closed
    forms that name it.
    """

    name: str
    level: int
    force: Callable[[Array, Array, float, float], Array]
    right: dict[str, set[str]]

    @property
    def site(self) -> str:
        """The site, as a verdict names it."""
        return f"storey{self.level}" if self.level else "layer"


def _brace(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.maximum(x - 0.8 * far, 0.0) + np.minimum(x + 0.8 * far, 0.0))


def _bumper(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.maximum(x - 0.6 * far, 0.0))


def _wall(x: Array, _v: Array, far: float, _fast: float) -> Array:
    return (x / far) ** 3


def _rub(x: Array, v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.tanh(v / SLOW) * np.exp(-((x / far) ** 2)))


def _rub_outwards(x: Array, v: Array, far: float, _fast: float) -> Array:
    return np.asarray(np.tanh(v / SLOW) * (0.3 + (x / far) ** 2))


def _orifice(_x: Array, v: Array, _far: float, fast: float) -> Array:
    return v * np.abs(v) / fast**2


def _damping(x: Array, v: Array, far: float, fast: float) -> Array:
    return (x / far) ** 2 * v / fast


ODDITIES = (
    Oddity("loose brace", 1, _brace, {"displacement": {"dead band"}}),
    Oddity("rub at mid-stroke", 0, _rub, {"displacement": {"bell"}}),
    Oddity("stiff wall", 2, _wall, {"displacement": {"cubic", "power"}}),
    Oddity("bumper on one side", 0, _bumper, {"displacement": {"contact above"}}),
    Oddity("rub that grows outwards", 1, _rub_outwards, {"displacement": {"parabola", "power"}}),
    Oddity(
        "oil damper with an orifice", 2, _orifice,
        {"velocity": {"quadratic drag", "power"}, "speed": {"parabola", "power"}},
    ),
    Oddity("damping that grows outwards", 0, _damping, {"displacement": {"parabola"}}),
)  # fmt: skip
"""What buildings may hide, one after the other."""


@dataclass(frozen=True)
class OddTower(rigs.Tower):
    """A tower with a further force [N] at one of its levels."""

    level: int = 0
    odd: Force | None = None

    def loads(
        self, q: list[float], volts: float, inner: list[float], rubbed: float
    ) -> tuple[list[float], float, list[float]]:
        """Return what `Tower.loads` does, with that force."""
        pushes, force, rates = super().loads(q, volts, inner, rubbed)
        if self.odd is not None:
            k, x, v = self.level, q[:3], q[3:]
            drift = x[k] - (x[k - 1] if k else 0.0)
            rate = v[k] - (v[k - 1] if k else 0.0)
            more = float(self.odd(np.array(drift), np.array(rate)))
            pushes[k] -= more / self.frame.masses[k]
            if k:
                pushes[k - 1] += more / self.frame.masses[k - 1]
        return pushes, force, rates


@dataclass(frozen=True)
class House:
    """A building's runs, and what is hidden: None for nothing."""

    building: Building
    train: list[Measurement]
    holdout: list[Measurement]
    hidden: Oddity | None


def house(number: int, hidden: Oddity | None, share: float) -> House:
    """Return a building of a seed, what it hides having a share of its site's force.

    Parameters
    ----------
    number : the seed
    hidden : what is hidden, None for nothing
    share : RMS of its force by that of the line at its site
    """
    draw, noise = (np.random.default_rng(one) for one in np.random.SeedSequence(number).spawn(2))
    table = CENTRE[LAW]
    values = {name: v * (1.0 + draw.uniform(-0.12, 0.12)) for name, v in table.items()}
    masses = np.array([1.97, 1.23, 1.23]) * (1.0 + draw.uniform(-0.12, 0.12, 3))
    stiffnesses = np.array([1057.0, 1366.0, 1366.0]) * (1.0 + draw.uniform(-0.12, 0.12, 3))
    frame = rigs.frame(masses, stiffnesses)
    scales = Scales(10.0, 0.18, 0.02, table["w_n"], drift=5e-3)
    rig = OddTower(frame, Damper(LAW, values), {}, scales)
    plan = rigs.tower_plan(rig, draw)
    if hidden is not None:
        rig = _hiding(rig, hidden, rig.perform(plan[0][1], plan[0][2], ROUGH), share)
    shown = {name: rig.perform(ground, volts) for name, ground, volts in plan}
    runs = {name: _measured(name, run, noise) for name, run in shown.items()}
    told = {
        "schema": 1, "name": "house", "base": "isolated", "masses": masses.tolist(),
        "stiffnesses": stiffnesses.tolist(), "damping_ratio": rigs.RATIO,
    }  # fmt: skip
    train = [run for name, run in runs.items() if name.startswith("train")]
    holdout = [run for name, run in runs.items() if name.startswith("holdout")]
    return House(from_data(told), train, holdout, hidden)


def _hiding(rig: OddTower, hidden: Oddity, shown: Signals, share: float) -> OddTower:
    """Return a tower that hides something, of a size that follows from a run without it."""
    level, below = rigs.LEVELS[hidden.level], rigs.LEVELS[hidden.level - 1]
    x, v = shown[f"{level}_displacement"], shown[f"{level}_velocity"]
    if hidden.level:
        x, v = x - shown[f"{below}_displacement"], v - shown[f"{below}_velocity"]
    wide, fast = float(np.std(x)), float(np.std(v))
    line = rig.frame.stiffnesses[hidden.level] * wide
    size = share * line / float(np.std(hidden.force(x, v, wide, fast)))

    def odd(x: Array, v: Array) -> Array:
        return size * hidden.force(x, v, wide, fast)

    return replace(rig, level=hidden.level, odd=odd)


def _measured(name: str, run: Signals, noise: np.random.Generator) -> Measurement:
    """Return a run as instruments with white noise show it."""
    spread = {channel: NOISE * float(np.std(y)) for channel, y in run.items()} | {"time": 0.0}
    noisy = {c: y + spread[c] * noise.standard_normal(len(y)) for c, y in run.items()}
    units = {c: "s" if c == "time" else channel_unit(c) for c in run}
    specs = {c: ChannelSpec(column=c, unit=unit) for c, unit in units.items()}
    return measurements_of_frame(pd.DataFrame(noisy), name, specs)[0]
