"""How the error goes with speed, with the level of the command, and with what is known of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import joined, plain, quantity, short_z
from ..data.channels import Label, Labels, label_name, label_text, varying
from ..identification.search import z_scale
from ..physics.drive import DRIVES, VOLTAGE, Drive
from .misfit import CLOSE
from .predictions import RunPrediction

STEADY = 1e-3
"""Share of its largest value by which a command varies in a run that keeps to one level."""

APART = 1.5
"""By what factor z with one value of a label exceeds that with the others to be worth a word."""

FEW = 6
"""Values or ranges of a label that a sentence names; of more it says how many there are."""

_DIGITS = 4  # of a level, to which runs have the same


@dataclass(frozen=True)
class LabelError:
    """The error of the runs that share the value of a label: `z` of them all, and how many.

    `unit` is that of a command's level, else "": labels know their own. `run` is the name of the
    run where it is one alone.
    """

    name: str
    value: Label
    z: float
    runs: int
    unit: str = ""
    run: str = ""

    @property
    def text(self) -> str:
        """The value as people write it."""
        return label_text(self.name, self.value, self.unit)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {"label": self.name, "value": self.value, "z": self.z, "runs": self.runs}


def known_of(predictions: Sequence[RunPrediction]) -> list[Labels]:
    """Return what is known of each run: its labels, and the level of a command that is steady."""
    drive = predictions[0].drive
    return with_levels(
        drive, [one.coordinates.get(drive) for one in predictions], [p.labels for p in predictions]
    )


def with_levels(
    drive: str, commands: Sequence[Array | None], labels: Sequence[Labels]
) -> list[Labels]:
    """Return the labels of runs, with the level of the command where it is steady.

    Parameters
    ----------
    drive : the channel that commands the damper
    commands : (n,) of each run in its unit, None where there is none
    labels : of each run
    """
    top = max((float(np.max(np.abs(y))) for y in commands if y is not None), default=0.0)
    out: list[Labels] = []
    for own, level in zip(labels, commands, strict=True):
        if level is None or float(np.ptp(level)) > STEADY * top:
            out.append(dict(own))
        else:
            out.append({**own, drive: float(f"{float(np.mean(level)):.{_DIGITS}g}")})
    return out


def label_errors(predictions: Sequence[RunPrediction]) -> tuple[LabelError, ...]:
    """Return the error for each value of each label that differs between runs."""
    known = known_of(predictions)
    found = []
    for name in varying(known):
        values = {one[name] for one in known}
        for value in sorted(values, key=_order):
            own = [p for p, one in zip(predictions, known, strict=True) if one[name] == value]
            z = z_scale(np.concatenate([one.normalised for one in own]))
            unit = DRIVES[name].unit if name in DRIVES else ""
            alone = own[0].name if len(own) == 1 else ""
            found.append(LabelError(name, value, z, len(own), unit, alone))
    return tuple(found)


def label_sentence(errors: Sequence[LabelError]) -> str:
    """Return on which runs a model errs, by the label that tells it best; "" where none does."""
    names = dict.fromkeys(one.name for one in errors)
    parted = [_parted([one for one in errors if one.name == name]) for name in names]
    gap, far, rest = max(parted, key=lambda one: one[0], default=(0.0, [], []))
    if not gap:
        return ""
    own = [*far, *rest]
    if len(far) == 1 and far[0].run:
        return _of_one_run(far[0], rest[0].z)
    where = _values(far, own)
    label = "" if far[0].unit else f"{label_name(far[0].name)} "
    others = f"z = {short_z(rest[0].z)} at most at {_values(rest, own)}"
    if rest[0].z <= CLOSE:
        return f"Only the runs at {label}{where} are wrong: z = {short_z(own[0].z)}, and {others}."
    most = f"The error is largest in the runs at {label}{where}"
    return f"{most}: z = {short_z(own[0].z)}, and {others}."


def _of_one_run(far: LabelError, others: float) -> str:
    """Return that one run errs: it may differ in more than the label, which is not blamed.

    Parameters
    ----------
    far : the error of that run
    others : the largest z of a value with the others
    """
    label = "" if far.unit else f"{label_name(far.name)} "
    wrong = f"is wrong: z = {short_z(far.z)}" if others <= CLOSE else ""
    begin = (
        f"Only {far.run} {wrong}"
        if wrong
        else f"The error is largest in {far.run}: z = {short_z(far.z)}"
    )
    return (
        f"{begin}, and z = {short_z(others)} at most in the other runs. It is the only run at "
        f"{label}{far.text}, which need not be the cause."
    )


def _values(some: Sequence[LabelError], whole: Sequence[LabelError]) -> str:
    """Return values of a label in order: "0 V and 2 V", "28.2 °C to 29.4 °C and 31 °C".

    Those in a row are a range where most runs have a value of their own, as of a temperature.

    Parameters
    ----------
    some : the values to name
    whole : all values of the label, which part ranges
    """
    order = sorted(some, key=lambda one: _order(one.value))
    numbers = not any(isinstance(one.value, str) for one in whole)
    if not numbers or 2 * len(whole) <= sum(one.runs for one in whole):
        return joined([one.text for one in order])
    texts: list[str] = []
    among = sorted(whole, key=lambda one: _order(one.value))
    for named, group in groupby(among, lambda one: one in some):
        row = [one.text for one in group] if named else []
        texts += [f"{row[0]} to {row[-1]}"] if len(row) > 2 else row
    # No span over all of them: it would hold values that are not meant.
    if len(texts) <= FEW:
        return joined(texts)
    return f"{len(some)} of {len(whole)} values, among them {joined(texts[:FEW])}"


def _order(value: Label) -> tuple[bool, Label]:
    return isinstance(value, str), value


def _parted(errors: Sequence[LabelError]) -> tuple[float, list[LabelError], list[LabelError]]:
    """Return how far the values of a label part the runs, 0 where they do not, and the two parts.

    Parameters
    ----------
    errors : for the values of one label

    Returns
    -------
    by how many times; the values where the model errs; the others, of either the largest z first
    """
    own = sorted(errors, key=lambda one: -one.z)
    far = [one for one in own if one.z > CLOSE and one.z * APART > own[0].z]
    rest = [one for one in own if one not in far]
    if not far or not rest or own[0].z < APART * rest[0].z:
        return 0.0, far, rest
    return min(one.z for one in far) / rest[0].z, far, rest


# In which regimes of speed and command a model is right within its noise.

_MIN_SAMPLES = 200  # of a regime that says something


@dataclass(frozen=True)
class Regime:
    """A part of the samples by speed, command or both: `text` as in "at low speed and 0 V"."""

    text: str
    speed: str
    command: str
    z: float
    samples: int

    @property
    def right(self) -> bool:
        """Whether the model is right within its noise there."""
        return self.z <= CLOSE

    def as_dict(self) -> dict[str, Any]:
        """Return the regime as JSON has it."""
        return {
            "words": self.text, "speed": self.speed, "voltage": self.command, "z": self.z,
            "samples": self.samples, "right": self.right,
        }  # fmt: skip


def regimes(
    normalised: Sequence[Array], coordinates: Sequence[Mapping[str, Array]],
    drive: Drive = VOLTAGE,
) -> list[Regime]:  # fmt: skip
    """Return the regimes with their z: classes of speed, of the command, and of both together."""
    r = np.concatenate(list(normalised))

    def joined(name: str) -> Array | None:
        if not all(name in one for one in coordinates):
            return None
        return np.concatenate([one[name] for one in coordinates])

    speeds = speed_classes(joined("speed"))
    levels = level_classes(joined(drive.name), drive)
    cells = [*((s, None) for s in speeds), *((None, V) for V in levels)]
    cells += [(s, V) for s in speeds for V in levels]
    out = []
    for s, V in cells:
        speed, command = (kind[0] if kind else "" for kind in (s, V))
        chosen = np.logical_and.reduce([kind[1] for kind in (s, V) if kind])
        if chosen.sum() >= _MIN_SAMPLES:
            text = " and ".join(filter(None, (speed, command)))
            out.append(Regime(text, speed, command, z_scale(r[chosen]), int(chosen.sum())))
    return out


def speed_classes(speed: Array | None) -> list[tuple[str, Flags]]:
    """Return low, middle and high speed, cut at a quarter and 60 % of its high values."""
    if speed is None or not np.ptp(speed) > 0.0:
        return []
    top = float(np.quantile(speed, 0.98))
    low, high = 0.25 * top, 0.6 * top
    below, above = (quantity(speed, "m/s", 2, top) for speed in (low, high))
    return [
        (f"at low speed (below {below})", speed < low),
        ("at middle speed", (speed >= low) & (speed < high)),
        (f"at high speed (above {above})", speed >= high),
    ]


def level_classes(V: Array | None, drive: Drive = VOLTAGE) -> list[tuple[str, Flags]]:
    """Return a command (n,) off, low and high; nothing where it does not vary."""
    if V is None or not np.ptp(V) > 1e-3 * max(float(np.max(np.abs(V))), 1e-12):
        return []
    top = float(np.quantile(V, 0.98))
    off, middle = 0.05 * top, 0.5 * top
    return [
        (f"at 0 {drive.unit}", off >= V),
        (f"at low {drive.name} (below {plain(middle, 2)} {drive.unit})", (off < V) & (middle > V)),
        (f"at high {drive.name} (above {plain(middle, 2)} {drive.unit})", middle <= V),
    ]
