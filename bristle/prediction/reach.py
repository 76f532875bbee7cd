"""How far the data of a study's damper reach: in words, and as the range that the damper knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..core.arrays import Array
from ..core.text import percent, plain, plural
from ..data.channels import channel_unit, label_name, label_text
from ..data.checks.motion import ACROSS, with_motion_across
from ..data.measurement import Measurement
from ..data.run_labels import labels_of
from ..model.model import Model
from ..physics.building import GROUND
from ..study.history import history_steps
from ..study.rig import building_of
from ..study.runs import Runs
from ..study.study import Study

Ranges = dict[str, tuple[float, float]]
"""Least and largest value in the training runs, by channel, in its unit."""

_APART = 8
"""Samples between which a displacement's difference counts as its speed: over fewer it is noise."""


def ranges_of(study: Study, model: Model, runs: Runs) -> Ranges:
    """Return between what displacement, velocity and command of the damper lie in training.

    The damper of a building that is no device of it moves as the base does.
    """
    seen: dict[str, list[Array]] = {}
    for run in (with_stroke(study, model, one) for one in runs.train):
        there: dict[str, Array] = {run.drive: run[run.drive]} if run.drive else {}
        for channel in ("displacement", "velocity"):
            measured = [one for one in (channel, f"base_{channel}") if run.has(one)]
            if measured:
                there[channel] = run[measured[0]]
        if "displacement" in there and "velocity" not in there:
            x = there["displacement"]
            there["velocity"] = (x[_APART:] - x[:-_APART]) / (_APART * run.step)
        for channel, values in there.items():
            seen.setdefault(channel, []).append(values)
    every = {name: np.concatenate(seen[name]) for name in sorted(seen)}
    return {name: (float(np.nanmin(one)), float(np.nanmax(one))) for name, one in every.items()}


def told_range(ranges: Mapping[str, tuple[float, float]], drive: str) -> dict[str, float]:
    """Return the range that a damper is told, see `component.damper.RANGE`.

    Parameters
    ----------
    ranges : of the channels
    drive : channel of the command, "" where there is none
    """
    found = {}
    for channel, name in (("displacement", "displacement"), (drive, "command")):
        if channel in ranges:
            found[f"range.{name}_low"], found[f"range.{name}_high"] = ranges[channel]
    speed = max(map(abs, ranges.get("velocity", (0.0,))))
    return {**found, "range.speed": speed} if speed > 0.0 else found


def reach_in_words(study: Study, runs: Runs, ranges: Ranges) -> str:
    """Return what the model was fitted to, over which range, and how far off it is elsewhere."""
    told = []
    for channel, ends in ranges.items():
        low, high = (plain(end, 4) for end in ends)
        told.append(f"{channel} {low} to {high} {channel_unit(channel)}")
    for label in labels_of([run.labels for run in runs.train]):
        texts = [label_text(label.name, one) for one in label.levels]
        levels = f"{texts[0]} to {texts[-1]}" if label.is_number else ", ".join(texts)
        told.append(f"{label_name(label.name)} {levels}")
    share = history_steps(study.steps())[-1].share
    off = "" if share is None else f" Held-out error: {percent(share)} of the force (RMS)."
    counted = plural(len(runs.train), "run")
    return f"Fitted to {counted} (data {study.data[:14]}): {'; '.join(told)}.{off}"


def with_stroke(study: Study, model: Model, measurement: Measurement) -> Measurement:
    """Return a run with the displacement across the damper, where it is a building's device."""
    building = building_of(study, model)
    if building is None or not building.studied:
        return measurement
    levels = building.levels()
    lower, upper = (
        "" if i == GROUND else levels[i] for i in building.device(building.studied).levels
    )
    seen = with_motion_across(measurement, lower, upper)
    channels = {n: v for n, v in seen.channels.items() if not n.endswith("_displacement")}
    stroke = seen.channels.get(f"{ACROSS}_displacement")
    return replace(
        seen, channels=channels if stroke is None else {**channels, "displacement": stroke}
    )
