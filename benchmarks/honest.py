"""Whether what is printed is what the data and the model say: one section per kind.

`left_out`: 50 smooth records without a fault, of 200 Hz to 5 kHz, as loggers filter them or not,
with and without white noise: how many samples no error counts, and how many of them because a run
settles at its start. These records begin in motion: what an elastic part holds there is told by the
force.

`fit`: each law on each measured set, by bristle's fit and by plain least squares.

`buildings`: verdicts on buildings whose file and instruments are off; `intervals`: those of a fit
to benches that hide nothing. Both as far as cases were made: `python -m benchmarks honest buildings
--help` and `... intervals --help` make more.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

import bristle
from bristle.core.arrays import Array
from bristle.data.left_out import SETTLING
from bristle.identification.error import ForceError, error_of, pooled, reasons_of
from bristle.identification.prepare import prepare

from . import _honest_buildings, _honest_fit, _honest_intervals
from ._motions import DATA as MOTIONS
from ._rows import Row

DATA = MOTIONS.parent
"""Measured sets, where they lie beside the checkout."""

RATES = (200.0, 500.0, 1000.0, 2000.0, 5000.0)
"""Samples per second [Hz] of the records."""

NOISES = (0.0, 0.001, 0.005, 0.01, 0.02)
"""White noise, as a share of each channel's standard deviation."""

SECONDS = 8.0
"""Length [s] of each."""

SHARE = 0.005
"""Of the samples may be left out."""


MADE = {"buildings": _honest_buildings, "intervals": _honest_intervals}
"""Sections whose cases are made by a command of their own."""


class Record(NamedTuple):
    """A smooth record: `rate` [Hz], share of `noise`, whether a logger `filtered` it, a `seed`."""

    rate: float
    noise: float
    filtered: bool
    seed: int


def run() -> list[Row]:
    """Return the figures of all sections."""
    made = [row for section in MADE.values() for row in section.run()]
    return [*left_out(), *_honest_fit.rows(DATA), *made]


def main(given: Sequence[str]) -> int:
    """Make cases of a section that has options of its own."""
    if given[0] not in MADE:
        raise SystemExit(f"honest: expected {' or '.join(MADE)}; found {given[0]}.")
    return MADE[given[0]].main(list(given[1:]))


def left_out() -> list[Row]:
    """Return the share of samples that no error counts: of all records, and of the worst."""
    kinds = product(RATES, NOISES, (False, True))
    records = [Record(*kind, seed) for seed, kind in enumerate(kinds)]
    found = {one: counted(one) for one in records}
    worst = max(found, key=lambda one: found[one].share_left_out)
    whole = pooled(found.values())
    told = ", ".join(f"{n / whole.total:.2%} {why}" for why, n in whole.left_out.items())
    settling = whole.left_out.get(SETTLING, 0)
    others = (whole.total - whole.samples - settling) / whole.total
    name = f"samples left out of {len(found)} smooth records"
    return [
        Row(
            f"{name} of {SECONDS:g} s",
            f"{whole.share_left_out:.2%}; worst {found[worst].share_left_out:.2%}",
            f"<= {SHARE:.1%}", whole.share_left_out / SHARE,
            f"{told or 'none'}; {SECONDS * settling / whole.total:.2f} s of each; worst: {worst}",
        ),
        Row(f"{name}, but for settling", f"{others:.2%}", f"<= {SHARE:.1%}", others / SHARE),
    ]  # fmt: skip


def counted(record: Record) -> ForceError:
    """Return how many samples of a record no error counts, and why."""
    with tempfile.TemporaryDirectory(prefix="bristle_honest_") as name:
        folder = Path(name)
        both = (record, record._replace(seed=record.seed + 1000))
        files = [write(one, folder / f"run_{one.seed}.csv") for one in both]
        study = bristle.Study.create(folder / "rig", files)
        runs = [prepare(one) for one in study.read()]
    return pooled(error_of(run.force, run.force, reasons_of(run)) for run in runs)


def write(record: Record, path: Path) -> Path:
    """Write a record of a damper whose force is smooth, by turns linear and of a Bouc-Wen kind."""
    random = np.random.default_rng(record.seed)
    fine = max(1, round(10_000.0 / record.rate))
    t = np.arange(round(SECONDS * record.rate) * fine) / (record.rate * fine)
    tones = [(f, random.normal(), random.uniform(0.0, 6.3)) for f in (0.7, 1.9, 4.3, 9.1, 17.3)]
    x = sum(a / f * np.sin(2.0 * np.pi * f * t + p) for f, a, p in tones)
    v = sum(2.0 * np.pi * a * np.cos(2.0 * np.pi * f * t + p) for f, a, p in tones)
    force = 0.8 * v + 2.0 * x
    if record.seed % 2:
        force = force + 6.0 * _hysteresis(v, 1.0 / (record.rate * fine))
    columns = {"x [mm]": x, "F [N]": force}
    for name, y in columns.items():
        shown = y[::fine] if not record.filtered else _as_logged(y, record, fine)
        columns[name] = shown + record.noise * np.std(shown) * random.standard_normal(len(shown))
    rows = np.column_stack([t[::fine], *columns.values()])
    np.savetxt(path, rows, "%.7g", ",", header="time [s],x [mm],F [N]", comments="")
    return path


def _hysteresis(v: Array, dt: float) -> Array:
    """Return z of z' = (v - |v| z) / 0.4 (n,), which never jumps."""
    z, out = 0.0, np.empty(len(v))
    for k, speed in enumerate(v.tolist()):
        z += dt * (speed - abs(speed) * z) / 0.4
        out[k] = z
    return out


def _as_logged(y: Array, record: Record, fine: int) -> Array:
    """Return a signal behind a logger's Butterworth of fourth order, at its rate."""
    from scipy.signal import butter, sosfilt

    corner = (0.1, 0.2, 0.4)[record.seed // 2 % 3] * record.rate
    sos = butter(4, max(corner, 40.0), fs=record.rate * fine, output="sos")
    return np.asarray(sosfilt(sos, y)[::fine], dtype=float)
