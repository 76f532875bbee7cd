"""Along what the rest is organised that no effect explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from ..comparison.patterns import Finder, ResidualPattern
from ..comparison.predictions import coordinates_of_run, late_speed
from ..core.arrays import Array
from ..identification.building_sites import StructureRun
from ..identification.problem import Problem, Run
from .decision import missing
from .prepared import Prepared
from .rule import BENCH, DecisionRule
from .trials import Trial

FLIPS = 499
"""Random patterns of signs that say what chance would organise."""


def patterns_of(trial: Trial, held_out: Problem) -> list[ResidualPattern]:
    """Return along which coordinates a trial's residual is organised, the most telling first.

    Samples that were not measured are left out: their residual is 0.
    """
    normalised, raw, coordinates = [], [], []
    for run, own in zip(held_out.runs, held_out.by_run(trial.residual), strict=True):
        kept = run.judged
        normalised.append(own[kept])
        raw.append(normalised[-1] * run.noise)
        along = coordinates_of_run(run)
        along["rest"] = late_speed_of(run)
        coordinates.append({name: values[run.skip :][kept] for name, values in along.items()})
    finder = Finder(normalised, raw, coordinates, FLIPS)
    return finder.ranked(finder.normalised)


def late_speed_of(run: Run) -> Array:
    """Return the mean speed (n,) of late [m/s]; it goes on where samples are left out."""
    whole, keep = run.remembered
    return late_speed(whole.v, run.dt)[keep]


def remaining_residual(
    prepared: Prepared, trials: Sequence[Trial], rest: list[ResidualPattern]
) -> tuple[str, list[ResidualPattern], tuple[str, ...]]:
    """Return the coordinate that organises what no effect explains, all patterns, and beside what.

    What an effect can mimic may hide what no effect can: where `rest` is not clear, what the
    nearest effect leaves is looked at.

    Parameters
    ----------
    prepared : the site's runs and its model
    trials : those of single effects, any order
    rest : patterns of the residual of the model, the most telling first

    Returns
    -------
    tuple
        Name of the coordinate ("" where there is no pattern), the patterns it was chosen from, and
        the nearest effect where they are of the model with it.
    """
    before, held_out, rule = prepared.before, prepared.held_out, prepared.rule
    nearest = min(trials, key=lambda trial: trial.z, default=before)
    if _clear(rest, rule) or not missing(before, nearest, rule):
        return most_telling(rest, before, held_out, rule), rest, ()
    rest = patterns_of(nearest, held_out)
    return most_telling(rest, nearest, held_out, rule), rest, nearest.beyond(before)


def _clear(patterns: Sequence[ResidualPattern], rule: DecisionRule) -> bool:
    return bool(patterns) and patterns[0].p <= rule.chance and patterns[0].share > rule.clear


def most_telling(
    rest: Sequence[ResidualPattern], trial: Trial, held_out: Problem, rule: DecisionRule = BENCH
) -> str:
    """Return the coordinate of a residual: "frequency" where it rings and nothing else tells.

    A residual that rings with the time since a reversal belongs to a resonance that reversals
    strike. Significance chooses among patterns that tell about as much: one along which the data
    fall into few blocks may carry most of the residual all the same.

    Parameters
    ----------
    rest : patterns of the residual, the most telling first
    trial : whose residual it is
    held_out : runs that decide
    rule : the numbers that decide

    Returns
    -------
    str
        Name of the coordinate; "" without a pattern.
    """
    telling = [pattern for pattern in rest if pattern.p <= rule.chance] or list(rest)
    if not telling:
        return ""
    first = telling[0] if telling[0].share > rule.pattern_share * rest[0].share else rest[0]
    struck = first.coordinate == "time_since_reversal"
    if (struck or not _clear(telling, rule)) and ringing(trial, held_out) > rule.resonance_share:
        return "frequency"
    return first.coordinate


def ringing(trial: Trial, held_out: Problem) -> float:
    """Return the largest share of a residual's power within a third of an octave, above the motion.

    The motion ends where nine tenths of the velocity's power lie below. Runs of which samples are
    left out have no spectrum: 0.
    """
    whole = [run.keep for run in held_out.runs if isinstance(run, StructureRun)]
    if any(np.any(np.diff(keep) != 1) for keep in whole):
        return 0.0
    f, power, motion = _spectra(trial, held_out)
    largest, motion = 0.0, np.cumsum(motion)
    ends = f[int(np.searchsorted(motion, 0.9 * motion[-1]))]
    total = float(power.sum())
    for centre in f[f > 1.5 * ends]:
        inside = (f >= centre / 2 ** (1 / 6)) & (f <= centre * 2 ** (1 / 6))
        largest = max(largest, float(power[inside].sum()) / total)
    return largest


def _spectra(trial: Trial, held_out: Problem) -> tuple[Array, Array, Array]:
    """Return frequencies (m,) [Hz] and the mean spectra (m,) there: of residual, and of velocity.

    Windows of all runs last equally long, so that their frequencies are the same whatever the rate;
    a run has nothing above half of its own.
    """
    runs = held_out.runs
    seconds = min(run.dt * min(1024, len(run.force) - run.skip) for run in runs)
    rate = 1.0 / min(run.dt for run in runs)
    f = np.asarray(np.fft.rfftfreq(round(seconds * rate), 1.0 / rate), float)
    powers: list[Array] = []
    motions: list[Array] = []
    for run, left in zip(runs, held_out.by_run(trial.residual), strict=True):
        residual = np.clip(left, -50.0, 50.0)
        for values, found in ((residual, powers), (run.v[run.skip :], motions)):
            own, power = welch(values, 1.0 / run.dt, nperseg=round(seconds / run.dt))
            found.append(np.interp(f, own, power, right=0.0))
    power, motion = (np.asarray(np.mean(one, axis=0), float) for one in (powers, motions))
    return f, power, motion
