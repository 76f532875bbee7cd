"""Any FMU held against a measurement: its inputs fed from channels, its outputs judged."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FmuError
from ..fmu.description import Description, Value, read_description
from ..identify.prepare import smooth_steps
from ..identify.smooth import posterior_draws, smooth
from ..records.channels import DRIVE, MOTION, PLAIN, channel_unit, is_channel
from ..records.guess import guess_channels, specs
from ..records.measurement import ChannelSpec, Measurement, measurements_of
from ..records.noise import estimate_noise
from ..records.sampling import evenly
from ..records.table import Table, read_table
from ..units import conversion
from .comparison import Comparison, compare_held
from .coordinates import coordinates_of
from .held import Held, between
from .ports import PortMap, map_ports
from .scale import rms
from .stepping import Job, step_through

Array = NDArray[np.float64]

DRAWS = 6
SILENT = 1e-3
"""Share of an output's RMS that stands in for its noise where the measurement has none."""
_KINEMATIC = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class Signals:
    """One piece of a measurement as an FMU is fed: values (n,) in SI, smoothed where they can be.

    `errors` name to (d, n): draws of what is left uncertain; `raw` the channels as measured, with
    their noise; `rates` name to that of the signal whose derivative is known.
    """

    name: str
    dt: float
    values: dict[str, Array]
    units: dict[str, str]
    errors: dict[str, Array]
    raw: dict[str, Array]
    noise: dict[str, float]
    rates: dict[str, str] = field(default_factory=dict)
    derived: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FmuComparison:
    """An FMU held against a measurement: one `Comparison` per output that was measured."""

    fmu: str
    data: str
    ports: PortMap
    outputs: tuple[Comparison, ...]
    notes: tuple[str, ...]

    def mapping_lines(self) -> list[str]:
        """Return in words what was fed from what, and what is to know."""
        return [f"{self.fmu} against {self.data}:", *self.ports.lines(), *self.notes]

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON has it."""
        from dataclasses import asdict

        return {
            "fmu": self.fmu, "data": self.data,
            "inputs": [asdict(one) for one in self.ports.inputs],
            "outputs": [asdict(one) for one in self.ports.outputs],
            "left": list(self.ports.left), "notes": list(self.notes),
            "comparisons": [one.as_dict() for one in self.outputs],
        }  # fmt: skip


def compare_fmu(
    fmu: Path | str,
    data: Path | str,
    *,
    values: Mapping[str, str] | None = None,
    maps: Mapping[str, str] | None = None,
    channels: Mapping[str, ChannelSpec] | None = None,
    timeout: float = 300.0,
) -> FmuComparison:
    """Hold an FMU, anybody's, against a measurement.

    It is stepped in a process of its own at the measurement's step; inputs of t_k+1 are set before
    the step from t_k. Displacement and velocity are joined into one smoothed motion first, for the
    noise of inputs would be taken for errors of the FMU; what stays uncertain is carried through.

    Parameters
    ----------
    fmu, data : path
        An FMI 2.0 co-simulation FMU; a measurement file, or results of a run.
    values : mapping
        Parameters and inputs by name, in the FMU's units, as text.
    maps : mapping
        Inputs and outputs to channels; else by name, by what the name says, by unit.
    channels : mapping
        Where channels are in the file, in place of the guess.
    timeout : float
        s, for all of the run.

    Raises
    ------
    FmuError, RecordError, RunError
    """
    path = Path(fmu)
    description = read_description(path)
    table = read_table(data)
    structural = any(
        v.name.startswith(("ground_", "base_", "floor")) for v in description.variables.values()
    )
    pieces, notes = signals_of(table, channels or {}, "structure" if structural else "bench")
    given = _typed(description, values or {})
    ports = map_ports(description, pieces[0].units, maps or {}, given)
    job, passes = _job(path, pieces, ports, given)
    found = step_through(job, passes, timeout)
    held = _held(pieces, ports, found, notes)
    outputs = tuple(compare_held(runs, seen=None) for runs in held.values())
    notes += _turned(outputs)
    if pieces[0].derived:
        notes.append(f"{', '.join(pieces[0].derived)}: from the other channels of the motion")
    return FmuComparison(str(fmu), str(data), ports, outputs, tuple(dict.fromkeys(notes)))


def signals_of(
    table: Table, channels: Mapping[str, ChannelSpec], rig: str, seed: int = 0
) -> tuple[list[Signals], list[str]]:
    """Return the pieces of a table as an FMU is fed, and what was guessed and done.

    Columns that are no known channel are there under their own names, if they have a unit.
    """
    guesses = guess_channels(table, rig)
    chosen = {**specs(table, guesses), **channels}
    notes = [f"guessed: {one}" for one in guesses if one.channel not in channels and one.doubt]
    taken = {table.find(one.column).text for one in chosen.values() if one.column}
    measured = measurements_of(table, chosen)
    others = _other_columns(table, taken, chosen)
    if not others:
        return [_signals(one, {}, {}, seed) for one in measured], notes
    time = table.values[table.find(chosen["time"].column).text] if chosen["time"].column else None
    if time is None or len(measured) > 1:
        notes.append(f"not used, for the file has gaps or no times: {', '.join(others)}")
        return [_signals(one, {}, {}, seed) for one in measured], notes
    factor = conversion(chosen["time"].unit or "s", "s")[0]
    values = {name: table.values[text] for name, (text, _) in others.items()}
    even = evenly(time * factor, values, table.lines, table.source, table.place)
    if len(even.pieces) != 1 or len(even.pieces[0][0]) != len(measured[0].time):
        notes.append(f"not used, for values are missing: {', '.join(others)}")
        return [_signals(measured[0], {}, {}, seed)], notes
    extra = even.pieces[0][1]
    return [_signals(measured[0], extra, {n: unit for n, (_, unit) in others.items()}, seed)], notes


def _other_columns(
    table: Table, taken: set[str], chosen: Mapping[str, ChannelSpec]
) -> dict[str, tuple[str, str]]:
    """Return columns that are no channel: name to (title, unit)."""
    found = {}
    for column in table.columns:
        known = column.text in taken or column.text in table.words
        if not known and column.unit is not None and column.name not in chosen:
            found[column.name] = column.text, column.unit.name
    return found


def _signals(
    one: Measurement, extra: dict[str, Array], units: dict[str, str], seed: int
) -> Signals:
    n, dt = len(one.time), one.step
    generator = np.random.default_rng(seed)
    raw = {**one.channels, **extra}
    unit = {**{name: channel_unit(name) for name in one.channels}, **units}
    noise = dict(one.noise) | {name: estimate_noise(y).std for name, y in extra.items()}
    values, errors, derived = dict(raw), {}, []
    rates: dict[str, str] = {}
    for prefix in ("", "base_"):
        x, v = raw.get(f"{prefix}displacement"), raw.get(f"{prefix}velocity")
        if x is None and v is None:
            continue
        sizes = (noise.get(f"{prefix}displacement", 0.0), noise.get(f"{prefix}velocity", 0.0))
        motion = smooth(x, v, dt, sizes)
        drawn = posterior_draws(
            n, dt, sizes, motion.jerk, (x is not None, v is not None), DRAWS, seed
        )
        names = [f"{prefix}{kind}" for kind in _KINEMATIC]
        for i, (name, y) in enumerate(zip(names, (motion.x, motion.v, motion.a), strict=True)):
            if prefix and kind_of(name) == "acceleration":
                continue  # of a structure it is the absolute one that is meant
            if name not in raw:
                derived.append(name)
            values[name], errors[name] = y, drawn[:, :, i]
            unit[name] = PLAIN[kind_of(name)]
        rates |= dict(itertools.pairwise(names))
    for name in DRIVE:
        if name in raw:
            values[name], left = smooth_steps(raw[name], noise[name])
            errors[name] = np.repeat(generator.standard_normal((DRAWS, 1)) * left, n, axis=1)
    for name in values:
        if name not in errors:
            errors[name] = generator.standard_normal((DRAWS, n)) * noise.get(name, 0.0)
    kept = {a: b for a, b in rates.items() if a in values and b in values}
    return Signals(one.name, dt, values, unit, errors, raw, noise, kept, tuple(derived))


def kind_of(name: str) -> str:
    """Return "velocity" of "base_velocity"."""
    return name.removeprefix("base_")


def _job(
    path: Path, pieces: list[Signals], ports: PortMap, given: dict[str, Value]
) -> tuple[Job, list[dict[str, Array]]]:
    """Return the passes per piece: as measured, at half the step, one per draw."""
    passes: list[dict[str, Array]] = []
    steps: list[float] = []

    def add(step: float, inputs: dict[str, Array]) -> None:
        turned = {}
        for port in ports.inputs:
            factor, offset = conversion(piece.units[port.signal], port.unit)
            turned[port.name] = factor * inputs[port.signal] + offset
        passes.append(turned or {"": next(iter(inputs.values()))})
        steps.append(step)

    for piece in pieces:
        add(piece.dt, piece.values)
        finer = {
            name: between(y, piece.values.get(piece.rates.get(name, "")), piece.dt)
            for name, y in piece.values.items()
        }
        add(0.5 * piece.dt, finer)
        for d in range(DRAWS):
            add(piece.dt, {name: y + piece.errors[name][d] for name, y in piece.values.items()})
    names = tuple(port.name for port in ports.inputs)
    outputs = tuple(port.name for port in ports.outputs)
    return Job(str(path.resolve()), dict(given), names, outputs, tuple(steps)), passes


def _held(
    pieces: list[Signals], ports: PortMap, found: list[dict[str, Array]], notes: list[str]
) -> dict[str, list[Held]]:
    """Return per output the pieces held against it."""
    per = 2 + DRAWS
    held: dict[str, list[Held]] = {port.name: [] for port in ports.outputs}
    for k, piece in enumerate(pieces):
        mine = found[per * k : per * (k + 1)]
        for port in ports.outputs:
            si = piece.units[port.signal]
            factor, offset = conversion(port.unit, si)
            rows = [factor * one[port.name] + offset for one in mine]
            held[port.name].append(_one(piece, port.name, port.signal, si, rows, ports, notes))
    return held


def _one(
    piece: Signals, name: str, signal: str, unit: str, rows: list[Array], ports: PortMap,
    notes: list[str],
) -> Held:  # fmt: skip
    predicted, finer, draws = rows[0], rows[1][::2], np.array(rows[2:])
    measured = piece.raw[signal] if signal in piece.raw else piece.values[signal]
    noise = piece.noise.get(signal, 0.0)
    floor = SILENT * rms(measured - measured.mean())
    if noise < floor:
        noise = floor
        notes.append(
            f"{signal} has no noise to speak of: errors are in units of {SILENT:.1%} of its RMS"
        )
    spread = draws - predicted
    bias = spread.mean(axis=0)
    sigma = np.sqrt(noise**2 + spread.var(axis=0, ddof=1))
    return Held(
        piece.name, piece.dt, measured, predicted + bias, sigma, noise, spread - bias,
        _coordinates(piece, signal, ports), finer - predicted, name, unit,
    )  # fmt: skip


def _coordinates(piece: Signals, signal: str, ports: PortMap) -> dict[str, Array]:
    """Return the coordinates of a piece: of its motion, and every input besides."""
    get = piece.values.get
    prefix = "" if "velocity" in piece.values else "base_"
    force = piece.raw.get("force") if signal != "force" else piece.raw[signal]
    found = coordinates_of(
        piece.dt, get(f"{prefix}displacement"), get(f"{prefix}velocity"),
        get(f"{prefix}acceleration"),
        get("voltage", get("current")), force if force is not None else piece.raw.get(signal),
    )  # fmt: skip
    for port in ports.inputs:
        if not is_channel(port.signal) or port.signal not in (*MOTION, *DRIVE):
            found.setdefault(port.signal, piece.values[port.signal])
    return found


def _typed(description: Description, values: Mapping[str, str]) -> dict[str, Value]:
    """Return values of `--set` as the FMU has them."""
    out: dict[str, Value] = {}
    for name, text in values.items():
        variable = description.variables.get(name)
        kind = variable.kind if variable else "String"
        try:
            if kind == "Real":
                out[name] = float(text)
                if not np.isfinite(out[name]):
                    raise ValueError
            elif kind in ("Integer", "Enumeration"):
                out[name] = int(text)
            elif kind == "Boolean":
                out[name] = {"true": True, "false": False, "1": True, "0": False}[text.lower()]
            else:
                out[name] = text
        except (ValueError, KeyError):
            raise FmuError(
                f"--set {name}={text}: {name} is {kind} in {description.name}."
            ) from None
    return out


def _turned(outputs: tuple[Comparison, ...]) -> list[str]:
    """Say which outputs go against what was measured."""
    notes = []
    for one in outputs:
        y = np.concatenate([held.measured for held in one.held])
        p = np.concatenate([held.predicted for held in one.held])
        if np.std(y) > 0.0 and np.std(p) > 0.0 and float(np.corrcoef(y, p)[0, 1]) < -0.5:
            notes.append(
                f"{one.quantity} goes against what was measured: signs may differ; --channel "
                f"{one.quantity}=-COLUMN@UNIT turns the measured one"
            )
    return notes


__all__ = ["FmuComparison", "compare_fmu", "signals_of"]
