"""A damper on a bench: the motion is prescribed, the force is measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .damper import Damper
from .excitation import Motion, Programme, bench_motion, programme
from .hidden import Scales
from .solve import integrate

Array = NDArray[np.float64]
Signals = dict[str, Array]
SECONDS = 10.0
PLAN = (
    ("train_1", "multisine", "steps"),
    ("train_2", "chirp", "sine"),
    ("train_3", "sine", "steps"),
    ("holdout_1", "multisine", "sine"),
    ("holdout_2", "sine", "steps"),
)
"""Runs: name, motion, voltage."""
HELD = ("high", "low", "high", "low", "high")
"""Voltages of the same runs where it is held in each."""


def perform(damper: Damper, motion: Motion, volts: Programme, scales: Scales) -> Signals:
    """Return what ideal instruments show of one run.

    Parameters
    ----------
    damper : Damper
        The damper, with what is hidden in it.
    motion : Motion
        What the bench prescribes.
    volts : Programme
        The commanded voltage.
    scales : Scales
        Sizes of motion and force, for the integrator.

    Returns
    -------
    dict
        `time` s, `displacement` m, `velocity` m/s, `voltage` V and `force` N, each (n,).
    """
    t = motion.time

    def rates(now: float, states: list[float]) -> list[float]:
        return damper.respond(motion.at(now), volts.value(now), states)[1]

    start = [0.0] * len(damper.states)
    states = np.empty((t.size, 0))
    if start:
        sizes = damper.scales(scales.stroke, scales.speed)
        states = integrate(rates, start, sizes, t, volts.jumps)
    moved = [motion.at(now) for now in t.tolist()]
    command = [volts.value(now) for now in t.tolist()]
    force = [
        damper.respond(one, volt, row)[0]
        for one, volt, row in zip(moved, command, states.tolist(), strict=True)
    ]
    return {
        "time": t,
        "displacement": np.array([one[0] for one in moved]),
        "velocity": np.array([one[1] for one in moved]),
        "voltage": np.array(command),
        "force": np.array(force),
    }


def plan(
    scales: Scales, rng: np.random.Generator, held: bool = False
) -> list[tuple[str, Motion, Programme]]:
    """Return the runs of an example: names, motions and voltages, `held` in each or not."""
    runs = [
        (name, motion, HELD[k] if held else volts) for k, (name, motion, volts) in enumerate(PLAN)
    ]
    return [
        (
            name,
            bench_motion(kind, SECONDS, scales.stroke, scales.speed * rng.uniform(0.8, 1.0), rng),
            programme(volts, SECONDS, rng),
        )
        for name, kind, volts in runs
    ]


def share(runs: list[Signals], bare: list[Signals]) -> float:
    """Return by how much of its RMS the force differs from that of the damper without secrets."""
    force = np.concatenate([run["force"] for run in runs])
    other = np.concatenate([run["force"] for run in bare])
    return float(np.sqrt(np.mean((force - other) ** 2) / np.mean(force**2)))
