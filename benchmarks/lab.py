"""What a laboratory does wrong: planted in measurements of the generator, named or not.

    python -m benchmarks lab --each 20

makes what is missing of `--each` cases per fault, with the generator of the blind benchmark, and
prints how many are named with channel, run and value; without a number it prints what is there.
Each case is checked as it is, too: what is said of those is a false alarm. The last six
faults need a model, which is fitted; the last two are told by a verdict.

hum       a sinusoid at 50 or 60 Hz, off by up to 0.04 %, of 3 to 10 % of the channel's RMS
line      the same at a frequency between 25 and 200 Hz that is none of the mains
folded    the same at 360 or 720 Hz, beyond half the rate of 500 samples per second: aliased
coarse    a channel that was measured at 1/2 to 1/5 of the rate, straight lines in between
average   a mean of 3 to 30 samples, noise included
gain      one run's channel, noise included, times 0.7, 0.85, 1.15 or 1.4
sign      one run's channel turned
zero      15 or 40 % of the channel's RMS added to one run's force or velocity
clock     the clock of the force's logger 100 to 1000 ppm fast or slow
apart     one run's force 4 to 20 ms late or early: two loggers that did not start together
slew      a command that reaches the coil no faster than 5 to 40 V/s, recorded before that
range     one that reaches it up to 50 to 80 % of the largest command only
cell      a load cell or its amplifier with a low-pass of second order, corner at 8 to 30 Hz
warm      runs between 15 and 35 degC, measured; the force falls by 0.5 to 1.5 % per kelvin
"""

from __future__ import annotations

import json
import re
import traceback
from dataclasses import replace
from typing import Any

import numpy as np

from bristle.core.arrays import Array
from bristle.core.finding import Finding
from bristle.core.text import plain
from bristle.data.checks.differing_runs import check_differing_runs
from bristle.data.checks.recording import check_recording
from bristle.data.measurement import Measurement
from bristle.diagnosis.load_cell import low_pass_text
from bristle.diagnosis.site import diagnose_damper
from tests.independent.generate import Case
from tests.independent.rigs import Rig
from tests.independent.specimen import Specimen

from ._answers import Answer, asked
from ._blind import cases, score
from ._blind.plan import Task, make_plan
from ._blind.subject import measurements, prepared
from ._rows import Row

SEED = 23
FAULTS = (
    "hum", "line", "folded", "coarse", "average", "gain", "sign", "zero", "clock", "apart", "slew",
    "range", "cell", "warm",
)  # fmt: skip
BY_MODEL = ("clock", "apart")
"""Faults that show only beside a model, which is fitted."""

OF_COMMAND = ("slew", "range")
"""Faults of the command, which show beside a model too; what the damper does with it is made anew.
"""

BY_VERDICT = ("cell", "warm")
"""Faults that the verdict tells: the delay with its filter, the measured temperature's effect."""

CLEAN = "clean"
GOAL = 0.9
NEAR = {
    "line": 1e-3,
    "gain": 0.05,
    "sign": 0.0,
    "bias": 0.1,
    "clock": 0.2,
    "delay": 0.2,
    "slew": 0.1,
    "range": 0.05,
    "cell": 0.15,
    "warm": 0.15,
}
"""Share by which a told value may be off."""


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return one row per fault that has answers, and one of the clean cases."""
    out = []
    for fault in (*FAULTS, CLEAN):
        own = [answer for key, answer in done.items() if json.loads(key)[0] == fault]
        if not own:
            continue
        right = score.Count(sum(one["right"] for one in own), len(own))
        if fault == CLEAN:
            alarms = right.of - right.good
            name = "lab: false alarms"
            out.append(Row(name, f"{alarms} of {right.of}", "0", float(alarms > 0) * 2.0))
            continue
        text = f"{right.good} of {right.of} named with channel, run and value"
        out.append(Row(f"lab: {fault}", text, f">= {GOAL:.0%}", GOAL / max(right.share, 1e-3)))
    return out


def _answered(fault: str, number: int) -> Answer:
    """Return whether what is planted is named and nothing else; an error is wrong."""
    try:
        rng = np.random.default_rng([SEED, number, len(fault)])
        if fault in OF_COMMAND:
            return _limits(fault, number, rng)
        if fault in BY_VERDICT:
            return _by_verdict(fault, number, rng)
        runs = _runs(number)
        if fault == CLEAN:
            found = _found(runs)
            told = _told_by_model(runs, number)
            words = [*(one.text for one in found), *(one.text for one in told)]
            return {"right": not words, "said": words}
        if fault in BY_MODEL:
            return _clocks(fault, number, runs, rng)
        changed, place, wanted = _planted(fault, runs, rng)
        found = _found(changed)
        named = [one for one in found if _names(one, changed[place].name, wanted)]
        right = len(named) == 1 and len(found) == 1
        said = [[one.run, one.channel, one.text] for one in found]
        return {"right": right, "planted": [changed[place].name, *wanted], "said": said}
    except Exception:  # whatever it is, it is the method's failure on this case
        return {"right": False, "said": [], "error": traceback.format_exc()}


def _clocks(fault: str, number: int, runs: list[Measurement], rng: np.random.Generator) -> Answer:
    """Return whether a model tells the clock of the force's logger, or that it started apart."""
    size = float(rng.choice([-1.0, 1.0]))
    if fault == "clock":
        place, size = None, size * 10.0 ** float(rng.uniform(-4.0, -3.0))
    else:
        place, size = int(rng.integers(len(runs))), size * float(rng.uniform(0.004, 0.02))
    changed = [
        _late(run, size, fault, rng) if place in (None, k) else run for k, run in enumerate(runs)
    ]
    told = _told_by_model(changed, number)
    kind, name = ("clock", "") if place is None else ("delay", runs[place].name)
    near = [abs(one.value - size) <= NEAR[kind] * abs(size) for one in told]
    right = len(told) == 1 and (told[0].kind, told[0].run) == (kind, name) and near[0]
    said = [[one.run, one.channel, one.text] for one in told]
    return {"right": right, "planted": [name, "force", kind, size], "said": said}


def _limits(fault: str, number: int, rng: np.random.Generator) -> Answer:
    """Return whether a model tells that the command was limited between its record and the coil."""
    case = cases.make(_task(number))
    most = max(float(np.max(np.abs(run.volts))) for run in case.plan)
    size = float(
        rng.uniform(0.5, 0.8) * most if fault == "range" else 10.0 ** rng.uniform(0.7, 1.6)
    )
    runs = []
    for k, (run, shown) in enumerate(zip(case.plan, case.runs, strict=True)):
        felt = replace(run, volts=_felt(run.volts, run.step, fault, size))
        made = case.perform(felt, 100 * number + k, shown["name"])
        runs.append({**made, "voltage": made["voltage"] + run.command() - felt.command()})
    told = _told_by_model(measurements(runs, case.channels), number)
    near = [abs(one.value - size) <= NEAR[fault] * size for one in told]
    right = len(told) == 1 and (told[0].channel, told[0].kind) == ("voltage", fault) and near[0]
    said = [[one.run, one.channel, one.text] for one in told]
    return {"right": right, "planted": ["", "voltage", fault, size], "said": said}


def _by_verdict(fault: str, number: int, rng: np.random.Generator) -> Answer:
    """Return whether the verdict tells what a load cell filters, or that the rig warms up."""
    case = cases.make(_task(number))
    if fault == "cell":
        wanted = float(rng.uniform(8.0, 30.0))
        specimen = Specimen(case.specimen.rig, low_pass(wanted))
        runs = _performed(case, [specimen] * len(case.plan), number)
    else:
        wanted = float(rng.uniform(0.005, 0.015))
        warm = rng.permutation(np.linspace(15.0, 35.0, len(case.plan)))
        specimens = [_warmed(case.specimen.rig, wanted * (T - 25.0)) for T in warm]
        runs = [
            replace(run, labels={"temperature": float(T)})
            for run, T in zip(_performed(case, specimens, number), warm, strict=True)
        ]
    train, held = ([run for run in runs if run.name.startswith(r)] for r in ("train", "holdout"))
    found, _ = diagnose_damper(prepared(train, held, _task(number).law))
    said = [found.kind, *found.effects, low_pass_text(found)]
    told = 0.0
    if fault == "cell" and (corner := re.search(r"corner near ([\d.]+) Hz", said[-1])):
        told = float(corner[1])
    if fault == "warm" and found.effects == ("measured_temperature",) and found.after:
        told = found.after.model.value("measured_temperature.c_yield")
    right = abs(told - wanted) <= NEAR[fault] * wanted
    return {"right": right, "planted": ["", "force", fault, wanted], "told": told, "said": said}


def low_pass(corner: float) -> dict[str, Any]:
    """Return the generator's filter of the force: Butterworth's of second order.

    Parameters
    ----------
    corner : frequency at which half the power is left [Hz]
    """
    w = 2.0 * np.pi * corner
    box = np.zeros((6, 4))
    box[:2, :2] = [[0.0, w], [-w, -np.sqrt(2.0) * w]]
    box[4, 1], box[5, 0] = w, 1.0
    return {"force_filter": box, "ff_d": 0.0}


def _warmed(rig: Rig, fall: float) -> Specimen:
    """Return a rig whose whole force is exp(-fall) of what it was."""
    forces = ("f_c", "f_v", "c_0", "c_v", "sigma_a", "sigma_0", "sigma_1", "sigma_2", "sigma_b")
    values = {k: v * np.exp(-fall) if k in forces else v for k, v in rig.values.items()}
    return Specimen(replace(rig, values=values), {})


def _performed(case: Case, specimens: list[Specimen], number: int) -> list[Measurement]:
    """Return the runs of a case's plan, each on a specimen of its own."""
    made = [
        replace(case, specimen=one).perform(run, 100 * number + k, shown["name"])
        for k, (one, run, shown) in enumerate(zip(specimens, case.plan, case.runs, strict=True))
    ]
    return measurements(made, case.channels)


def _felt(volts: Array, step: float, fault: str, size: float) -> Array:
    """Return a command (n, m) V at m equal points of each sample interval as it reaches the coil.

    Both ends of an interval are among its points.
    """
    if fault == "range":
        return np.clip(volts, -size, size)
    out = np.empty_like(volts)
    most, y = size * step / (volts.shape[1] - 1), float(volts[0, 0])
    for k, row in enumerate(volts.tolist()):
        out[k, 0] = y
        for j, target in enumerate(row[1:], 1):
            y += min(max(target - y, -most), most)
            out[k, j] = y
    return out


def _late(run: Measurement, size: float, fault: str, rng: np.random.Generator) -> Measurement:
    """Return a run whose force is late by `size` [s], or increasingly, by `size` s each second.

    The motion is moved, which is smooth: between two samples it is taken as linear, and the noise
    that this takes off is added. The force's jumps stay what they were.
    """
    at = np.arange(len(run.time), dtype=float)
    when = at * (1.0 + size) if fault == "clock" else at + size / run.step
    share = np.mod(when, 1.0)
    lost = np.sqrt(1.0 - share**2 - (1.0 - share) ** 2)
    moved = {"voltage": run["voltage"][np.clip(np.round(when), 0, at[-1]).astype(int)]}
    for name in ("displacement", "velocity"):
        noise = run.noise[name] * lost * rng.standard_normal(len(at))
        moved[name] = np.interp(when, at, run[name]) + noise
    return replace(run, channels={**run.channels, **moved})


def _told_by_model(runs: list[Measurement], number: int) -> list[Finding]:
    """Return the faults that a diagnosis of the runs begins with."""
    law = _task(number).law
    train, held = ([run for run in runs if run.name.startswith(r)] for r in ("train", "holdout"))
    return list(prepared(train, held, law).faults)


def _task(number: int) -> Task:
    return make_plan(SEED, 4 * (number + 1), "none")[number]


def _runs(number: int) -> list[Measurement]:
    """Return the runs of a case that hides nothing."""
    case = cases.load(_task(number))
    return measurements(case.runs, case.channels)


def _found(runs: list[Measurement]) -> list[Finding]:
    recorded = [finding for run in runs for finding in check_recording(run)]
    return [*recorded, *check_differing_runs(runs)]


def _names(found: Finding, run: str, wanted: tuple[str, str, float]) -> bool:
    """Return whether a finding names the run, the channel and the value."""
    channel, fault, value = wanted
    if (found.run, found.channel) != (run, channel):
        return False
    if fault == "average":
        return f"average of {value:.0f} samples" in found.text
    if fault == "coarse":
        return f"interpolated: {plain(value, 3)} samples per second" in found.text
    if fault == "folded" and "aliased" not in found.text:
        return False
    fault = "line" if fault == "folded" else fault
    told = [one for one in found.fixes if one.fault == fault]
    return any(abs(one.value - value) <= NEAR[fault] * abs(value) for one in told)


def _planted(
    fault: str, runs: list[Measurement], rng: np.random.Generator
) -> tuple[list[Measurement], int, tuple[str, str, float]]:
    """Return the runs with one fault in one of them, its place, and what should be named."""
    able = ("velocity", "force") if fault == "zero" else ("displacement", "velocity", "force")
    place, channel = int(rng.integers(len(runs))), str(rng.choice(able))
    one = runs[place]
    y = one[channel]
    rms = float(np.sqrt(np.mean(np.concatenate([each[channel] for each in runs]) ** 2)))
    noise, wanted = one.noise[channel], (channel, fault, 0.0)
    if fault in ("hum", "line"):
        hum = rng.choice([50.0, 60.0]) * (1.0 + rng.uniform(-4e-4, 4e-4))
        frequency = float(hum if fault == "hum" else _between(rng))
        turns = 2.0 * np.pi * frequency * one.time + rng.uniform(0.0, 2.0 * np.pi)
        y = y + rng.uniform(0.03, 0.1) * float(np.std(y)) * np.sin(turns)
        wanted = (channel, "line", frequency)
    elif fault == "folded":
        rate = 1.0 / one.step
        order = int(rng.choice([6, 12]))
        frequency = 60.0 * order * float(1.0 + rng.uniform(-4e-4, 4e-4))
        turns = 2.0 * np.pi * frequency * one.time + rng.uniform(0.0, 2.0 * np.pi)
        y = y + rng.uniform(0.03, 0.1) * float(np.std(y)) * np.sin(turns)
        wanted = (channel, fault, abs(frequency - rate * round(frequency / rate)))
    elif fault == "coarse":
        every = int(rng.integers(2, 6))
        y = np.interp(one.time, one.time[::every], y[::every])
        wanted = (channel, fault, 1.0 / (one.step * every))
    elif fault == "average":
        length = int(rng.integers(3, 31))
        y = np.convolve(np.pad(y, (length - 1, 0), mode="edge"), np.ones(length) / length, "valid")
        wanted = (channel, "average", float(length))
    elif fault in ("gain", "sign"):
        value = float(rng.choice([0.7, 0.85, 1.15, 1.4])) if fault == "gain" else -1.0
        y, noise, wanted = value * y, abs(value) * noise, (channel, fault, value)
    else:
        value = float(rng.choice([-0.4, -0.15, 0.15, 0.4])) * rms
        y, wanted = y + value, (channel, "bias", value)
    changed = replace(
        one, channels={**one.channels, channel: y}, noise={**one.noise, channel: noise}
    )
    return [*runs[:place], changed, *runs[place + 1 :]], place, wanted


def _between(rng: np.random.Generator) -> float:
    """Return a frequency [Hz] of no mains."""
    while True:
        found = float(rng.uniform(25.0, 200.0))
        if all(abs(found - k * mains) > 1.0 for mains in (50.0, 60.0) for k in range(1, 5)):
            return found


run, main = asked("lab", __doc__, ("each",), _answered, rows, of={"each": (CLEAN, *FAULTS)})
