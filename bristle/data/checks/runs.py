"""Looks at all runs together: what they excite, how they differ, what they cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.finding import Finding
from ...core.text import plain, quantity
from ...physics.drive import DRIVES
from ..channels import label_name, label_text
from ..measurement import Measurement
from ..noise import is_switched
from ..relation import top_of
from ..run_labels import MOVED, LabelOfRuns
from ..tone import label_doubts, tone_of
from .motion import velocity_of_run

_LEVELS = 12  # at most; a voltage with more moves continuously

BEYOND = 1.15
"""How far a held-out run may reach beyond those for training, as a ratio."""

_ANOTHER = "Record another run for training that reaches as far."

Check = tuple[str, Any, str, float]
"""What is held against the runs for training: its name, its value, its unit and a factor."""


@dataclass(frozen=True)
class Excitation:
    """What a run excites.

    `stroke` peak to peak [m], `speed` the 99th percentile [m/s], `band` the frequencies between
    which 90 % of the velocity's power lies [Hz], `cycles` of the motion; `drive` the
    channel that commands the damper, or ""; `levels` pairs of its level and seconds there, empty
    where it moves continuously; `range` its lowest and highest; `resisting` the mean force
    along the path [N].
    """

    run: str
    duration: float
    stroke: float
    speed: float
    band: tuple[float, float]
    cycles: float
    drive: str
    levels: tuple[tuple[float, float], ...]
    range: tuple[float, float]
    resisting: float | None

    @property
    def constant(self) -> bool:
        """Whether the command keeps to one level."""
        return len(self.levels) == 1


def excitation_of(run: Measurement, level: str = "") -> Excitation:
    """Return what a run excites, seen from its damper (`level` "base" on a structure)."""
    velocity = velocity_of_run(run, level)
    displacement = run.channels.get(f"{level}_displacement" if level else "displacement")
    drive = run.drive
    levels = drive_levels(run[drive], run.step, run.noise[drive]) if drive else ()
    lowest, highest = (float(run[drive].min()), float(run[drive].max())) if drive else (0.0, 0.0)
    if velocity is None:
        return Excitation(
            run.name, run.duration, 0.0, 0.0, (0.0, 0.0), 0.0, drive, levels, (lowest, highest),
            None,
        )  # fmt: skip
    if displacement is None:
        displacement = np.cumsum(velocity - velocity.mean()) * run.step
    resisting = None
    path = float(np.sum(np.abs(velocity)))
    if "force" in run.channels and path > 0.0:
        resisting = float(np.sum(run["force"] * velocity)) / path
    return Excitation(
        run.name, run.duration, float(np.ptp(displacement)),
        float(np.quantile(np.abs(velocity), 0.99)), power_band(velocity, run.step),
        cycles(velocity), drive, levels, (lowest, highest), resisting,
    )  # fmt: skip


def drive_levels(values: Array, step: float, noise: float) -> tuple[tuple[float, float], ...]:
    """Return the levels that a voltage keeps to with the seconds at each, none if it keeps to none.

    Values closer together than eight times the noise or 2 % of the range are one level.
    """
    span = float(np.ptp(values))
    width = max(8.0 * noise, 0.02 * float(np.abs(values).max()))
    if span <= width:
        return ((float(np.mean(values)), len(values) * step),)
    ordered = np.sort(values)
    parts = np.split(ordered, np.flatnonzero(np.diff(ordered) > 0.5 * width) + 1)
    big = [part for part in parts if len(part) >= 0.01 * len(values)]
    covered = sum(map(len, big)) / len(values)
    narrow = all(np.ptp(part) <= width for part in big)
    some_levels = covered >= 0.95 and narrow and len(big) <= _LEVELS
    if not (some_levels or is_switched(values)):
        return ()
    return tuple((float(np.mean(part)), len(part) * step) for part in big)


def power_band(velocity: Array, step: float) -> tuple[float, float]:
    """Return the frequencies [Hz] between which 90 % of the velocity's power lies."""
    return top_of(velocity, step, 0.05), top_of(velocity, step, 0.95)


def cycles(velocity: Array) -> float:
    """Return how often a motion goes forth and back; turns below 2 % of its speed do not count."""
    least = 0.02 * float(np.abs(velocity).max())
    signs = np.sign(velocity[np.abs(velocity) > least])
    return 0.5 * float(np.count_nonzero(np.diff(signs)))


def check_runs(
    train: list[Measurement], holdout: list[Measurement], level: str = ""
) -> tuple[list[Finding], list[Excitation]]:
    """Return what is found in all runs together, and what each of them excites."""
    excitations = [excitation_of(run, level) for run in (*train, *holdout)]
    parts = bool({run.source for run in train} & {run.source for run in holdout})
    findings = [
        *_too_short(excitations),
        *_drive(excitations),
        *_beyond(excitations[: len(train)], excitations[len(train) :], parts),
        *_two_rigs(excitations),
        *_steps([*train, *holdout]),
    ]
    return findings, excitations


def _too_short(runs: list[Excitation]) -> Iterator[Finding]:
    total = sum(run.cycles for run in runs)
    if total < 3.0 and any(run.speed > 0.0 for run in runs):
        seconds = sum(run.duration for run in runs)
        text = (
            f"all runs together hold {plain(total, 2)} cycles of motion in {plain(seconds)} s: "
            f"too few for "
            "a model to be fitted and tested."
        )
        do = "Record ten cycles or more at several speeds."
        yield Finding("short", "error", text, do)
        return
    for run in runs:
        if run.speed > 0.0 and run.cycles < 2.0:
            text = f"holds {plain(run.cycles, 2)} cycles of motion in {plain(run.duration)} s."
            yield Finding(
                "short", "warning", text, "Record longer runs.", run.run, value=-run.cycles
            )


def _drive(runs: list[Excitation]) -> Iterator[Finding]:
    driven = [run for run in runs if run.drive]
    if not driven:
        return
    name = driven[0].drive
    unit = DRIVES[name].unit
    constant = [run for run in driven if run.constant]
    if len(constant) < len(driven):
        yield from _moving_drive([run for run in driven if not run.constant], name, unit)
        return
    seen = sorted({round(run.levels[0][0], 6) for run in constant})
    distinct = _distinct(seen)
    levels = ", ".join(f"{plain(one, 4)}" for one in distinct)
    if len(distinct) == 1:
        text = f"{name} is {levels} {unit} in all runs: "
        text += (
            "coil lag, remanence and saturation cannot be tested, nor what it adds to the force."
        )
    else:
        text = f"{name} is constant within each run ({levels} {unit}): coil lag and remanence "
        text += "cannot be tested" + (", nor can saturation." if len(distinct) < 3 else ".")
    yield Finding(
        "drive", "warning", text, f"Switch the {name} between three levels or more in a run."
    )


def _moving_drive(runs: list[Excitation], name: str, unit: str) -> Iterator[Finding]:
    low, high = min(run.range[0] for run in runs), max(run.range[1] for run in runs)
    text = f"{name} moves between {plain(low, 4)} and {plain(high, 4)} {unit} within runs."
    yield Finding("drive", "note", text)
    levels = _distinct(sorted(level for run in runs for level, _ in run.levels))
    if all(run.levels for run in runs) and len(levels) == 2:
        text = (
            f"{name} has two levels, {plain(levels[0], 4)} and {plain(levels[1], 4)} {unit}: "
            f"saturation cannot "
            "be distinguished from a force that is linear in it."
        )
        do = "Use three levels or more."
        yield Finding("drive levels", "warning", text, do)


def _distinct(levels: list[float]) -> list[float]:
    """Return sorted levels without those within 3 % of the largest of the one before."""
    return [group[0] for group in _grouped(levels, 0.03)]


def _beyond(train: list[Excitation], holdout: list[Excitation], parts: bool) -> Iterator[Finding]:
    """Report held-out runs that leave the range of those for training.

    `parts`: whether runs for training and held out are parts of one file, which has one role.
    """
    if not train or not holdout:
        return
    checks: list[Check] = [
        ("speed", lambda run: run.speed, "m/s", 1.0),
        ("stroke", lambda run: run.stroke, "mm", 1e3),
    ]
    for drive in dict.fromkeys(run.drive for run in train if run.drive):
        checks.append((drive, lambda run: run.range[1], DRIVES[drive].unit, 1.0))
    for name, value, unit, factor in checks:
        known = max(map(value, train))
        for run in holdout:
            if known > 0.0 and value(run) > BEYOND * known:
                text = (
                    f"{name} reaches {plain(factor * value(run))} {unit}, and "
                    f"{plain(factor * known)} in "
                    "the runs for training: the model is tested outside the range of the fit."
                )
                do = _exchange(run, train, holdout, checks) if not parts else _ANOTHER
                yield Finding("beyond", "warning", text, do, run.run, name, value(run) / known)


def _exchange(
    run: Excitation, train: list[Excitation], holdout: list[Excitation], checks: list[Check]
) -> str:
    """Return which two runs are to exchange their roles so that training reaches as far as `run`.

    For it the run for training goes that the others for training reach furthest beyond; what is
    held out then must stay within what is not.
    """

    def left(goes: Excitation) -> float:
        """Return how far the held-out runs would leave the others, as a ratio."""
        kept = [one for one in train if one is not goes] + [run]
        judged = [one for one in holdout if one is not run] + [goes]
        reach = [max(map(value, kept)) for _, value, _, _ in checks]
        ratios = [
            float(value(one) / known)
            for (_, value, _, _), known in zip(checks, reach, strict=True)
            for one in judged
            if known > 0.0
        ]
        return max(ratios)

    goes = min(train, key=left)
    text = f"Exchange the roles (bristle study roles): {run.run} to train, {goes.run} to holdout"
    if left(goes) <= BEYOND:
        return text + "."
    return text + "; other runs reach further than those for training still, so measure more."


def _two_rigs(runs: list[Excitation]) -> Iterator[Finding]:
    """Report runs that resist far more or less than others at a similar voltage."""
    known = [run for run in runs if run.resisting is not None and run.resisting > 0.0]
    top = max((abs(run.range[1]) for run in known), default=0.0)
    for run in known:
        alike = [
            other
            for other in known
            if abs(_mean_level(other) - _mean_level(run)) <= 0.1 * top
            and 0.3 < other.speed / max(run.speed, 1e-12) < 3.0
        ]
        if len(alike) < 3:  # this run counts
            continue
        usual = float(np.median([one.resisting or 0.0 for one in alike]))
        own = float(run.resisting or 0.0)
        ratio = own / usual
        # One damper resists as the square of its speed at the most, and less within its slip.
        reach = [
            getattr(run, name) / max(float(np.median([getattr(one, name) for one in alike])), 1e-12)
            for name in ("speed", "stroke")
        ]
        if not 0.4 * min(1.0, *reach) ** 2 < ratio < 2.5 * max(1.0, *reach) ** 2:
            text = (
                f"force resists with {quantity(own, 'N', 4, usual)} on average, and with "
                f"{quantity(usual, 'N', 4)} in the middle one of {len(alike)} runs of like "
                f"{known[0].drive or 'command'} and speed."
            )
            do = "Is it of another damper, or in another unit? Then use a separate study."
            yield Finding("two rigs", "warning", text, do, run.run, "force", abs(np.log(ratio)))


def _mean_level(run: Excitation) -> float:
    if not run.levels:
        return 0.5 * (run.range[0] + run.range[1])
    seconds = sum(time for _, time in run.levels)
    return sum(level * time for level, time in run.levels) / seconds


def _steps(runs: list[Measurement]) -> Iterator[Finding]:
    rates = sorted({float(f"{run.sampling.rate:.4g}") for run in runs})
    if len(rates) > 1:
        yield Finding(
            "rates", "note", f"runs are sampled at {', '.join(f'{one:g}' for one in rates)} Hz."
        )


# What is known of whole runs, held against the motion that was measured.


def check_labels(runs: Sequence[Measurement]) -> Iterator[Finding]:
    """Yield the runs on a bench whose frequency or amplitude is another one than their label's."""
    tones = [tone_of(run) if {"frequency", "amplitude"} & {*run.labels} else None for run in runs]
    for run, text in zip(runs, label_doubts([run.labels for run in runs], tones), strict=True):
        if text:
            yield Finding(
                "label", "warning",
                f"{text}: what was told of the run by its name or a table is doubtful, the level "
                "of a command as well.",
                "Correct labels and levels in its [[runs]] of study.toml.", run.name,
            )  # fmt: skip


def check_label_levels(
    train: Sequence[Measurement], holdout: Sequence[Measurement]
) -> Iterator[Finding]:
    """Yield the labels from which nothing can be told: their runs do not differ, or all do.

    Parameters
    ----------
    train, holdout : the runs that models are fitted to, and the others
    """
    runs = [*train, *holdout]
    for name in dict.fromkeys(name for run in runs for name in run.labels if name not in MOVED):
        bare = [run.name for run in runs if name not in run.labels]
        label = LabelOfRuns(name, tuple(run.labels[name] for run in runs if name in run.labels))
        called, first = label_name(name), label_text(name, label.values[0])
        if bare:
            text = f"{called} is known of {len(label.values)} of {len(runs)} runs, not of {bare[0]}"
            do = "Say it of all runs in their [[runs]] of study.toml."
        elif len(label.levels) == 1:
            text = f"{called} is {first} in all {len(runs)} runs"
            do = "Measure runs at other values to see what it does."
        elif label.counts:
            text = f"{called} has another value in each of {len(runs)} runs, as their number has"
            do = "Give runs that have something in common the same value."
        elif len({run.labels[name] for run in train}) == 1:
            apart = next(run for run in holdout if run.labels[name] != train[0].labels[name])
            other = label_text(name, apart.labels[name])
            text = (
                f"{called} is {first} in all training runs, and {other} in {apart.name}, which is "
                "held out"
            )
            do = 'Train on runs that differ in it: role = "train" in their [[runs]] of study.toml.'
        else:
            continue
        yield Finding(f"label {name}", "note", f"{text}: nothing can be told from it.", do)


# The levels that the command of runs keeps to, and whether they tell more than a straight line.

LEAST_LEVELS = 3
"""Levels of the command that tell more than a straight line."""

_APART = 0.02  # of the largest level: closer ones are one


def drives_of(runs: Sequence[Measurement]) -> list[tuple[Measurement, str]]:
    """Return the runs that have a command, each with the name of its channel."""
    return [(run, run.drive) for run in runs if run.drive]


def command_levels(runs: Sequence[Measurement]) -> list[float] | None:
    """Return the levels [V, or A] that the command keeps to, None where it moves continuously.

    Empty where no run has a command.
    """
    drives = drives_of(runs)
    found = [drive_levels(run[name], run.step, run.noise[name]) for run, name in drives]
    if not found:
        return []
    if not all(found):
        return None
    groups = _grouped(sorted(level for one in found for level, _ in one), _APART)
    return [float(np.mean(group)) for group in groups]


def tells_a_bend(runs: Sequence[Measurement]) -> bool:
    """Return whether the command of runs has so many levels that a parabola has a meaning."""
    levels = command_levels(runs)
    return levels is None or len(levels) >= LEAST_LEVELS


def _grouped(levels: Sequence[float], apart: float) -> list[list[float]]:
    """Return sorted levels in groups, each within a share of the largest from its first one."""
    groups: list[list[float]] = []
    for level in levels:
        if groups and level - groups[-1][0] <= apart * max(map(abs, levels)):
            groups[-1].append(level)
        else:
            groups.append([level])
    return groups
