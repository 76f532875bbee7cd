"""Any FMU held against a measurement: its inputs fed from channels, its outputs judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..comparison.comparison import compare_predictions
from ..comparison.predictions import RunPrediction, coordinates_of, rms
from ..comparison.result import Comparison
from ..core.arrays import Array
from ..core.text import joined, percent, plain, unknown
from ..data.channels import (
    DRIVE,
    MOTION,
    PLAIN,
    ChannelSpec,
    channel_unit,
    in_unit,
    is_channel,
    meaning,
)
from ..data.decimate import between
from ..data.extra_channels import as_word
from ..data.guess import guess_channels, may_be_time, specs
from ..data.left_out import MISSING, SETTLING
from ..data.measurement import in_si, time_of
from ..data.noise import estimate_noise
from ..data.read import read_table
from ..data.sampling import evenly
from ..data.table import Table
from ..data.titles import title, unit_or_none
from ..errors import FmuError, RecordError, UnitError
from ..fmu.description import Description, Value, Variable, read_description
from ..identification.error import error_of
from ..identification.run_start import SETTLING as SETTLED
from ..identification.smoothing import posterior_draws, smooth, smooth_drive
from ..units import Measure, conversion, in_base_units, same_dimension, spelling
from .stepping import SteppingJob, step_through

PASSED_ON = ("fault",)

_NO_UNITS = ("in", "g", "h", "1")
"""Endings of names that are words more often than units: `x_in`, `a_g`."""


@dataclass(frozen=True)
class Port:
    """A port of the FMU and the signal of the measurement that belongs to it, with the reason.

    `unit` is the port's, by the FMU, its name or the user; `sign` -1 where the signal is turned.
    """

    name: str
    unit: str
    signal: str
    reason: str
    sign: int = 1


@dataclass(frozen=True)
class PortMap:
    """What was mapped: inputs and outputs; `left` says of each other port why it was not."""

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    left: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return the mapping in words: ports named as their channel together, others alone."""
        out = []
        for ports, verb in ((self.inputs, "fed from"), (self.outputs, "compared with")):
            same = [one.name for one in ports if (one.name, one.sign) == (one.signal, 1)]
            if same:
                named = f"{joined(same)} {'is' if len(same) == 1 else 'are'}"
                out.append(f"  {named} {verb} the channel{'s' * (len(same) > 1)} of that name")
            out += [
                f"  {one.name} [{one.unit}] is {verb} {_turned(one)}: {one.reason}"
                for one in ports if one.name not in same
            ]  # fmt: skip
        return out + [f"  {text}" for text in self.left]


def _turned(port: Port) -> str:
    return f"{port.signal}, reversed" if port.sign < 0 else port.signal


def map_ports(
    description: Description,
    signals: Mapping[str, str],
    maps: Mapping[str, str],
    values: Mapping[str, object],
) -> PortMap:
    """Return which signal belongs to which port.

    Parameters
    ----------
    description : Description
        The FMU's.
    signals : mapping
        Names of what was measured, or follows from it, to SI units.
    maps : mapping
        Ports to signals, as given, "-CHANNEL@UNIT"; they overrule names and units.
    values : mapping
        What is set by hand; such inputs are fed from nothing.

    Raises
    ------
    FmuError
        If a given port or signal does not exist, units differ or are in doubt, or no output can be
        judged.
    """
    inputs = {v.name: v for v in description.of("input") if v.kind == "Real"}
    outputs = {
        v.name: v for v in description.of("output") if v.kind == "Real" and v.name not in PASSED_ON
    }
    given = {name: _given(name, text) for name, text in maps.items()}
    _check_given(description, {**inputs, **outputs}, signals, given, values)
    into, left = [], []
    for name, variable in inputs.items():
        if name in values:
            left.append(f"{name} is set to {values[name]}")
            continue
        port = _match(variable, inputs, signals, given, by_unit=not variable.optional)
        if port:
            into.append(port)
        else:
            left.append(_left(variable, signals))
    fed = {one.signal for one in into}
    out = []
    for name, variable in outputs.items():
        own = given[name].signal if name in given else ""
        rest = {s: u for s, u in signals.items() if s not in fed or s == own}
        port = _match(variable, outputs, rest, given, by_unit=True)
        if port:
            out.append(port)
    other = [v for v in description.of("input") if v.kind != "Real" and v.name not in values]
    left += [f"{v.name} is {v.kind} and stays at its start value {v.start}" for v in other]
    _refuse_nothing(description, outputs, signals, into, out)
    return PortMap(tuple(into), tuple(out), tuple(left))


def _match(
    variable: Variable,
    ports: Mapping[str, Variable],
    signals: Mapping[str, str],
    given: Mapping[str, GivenPort],
    *,
    by_unit: bool,
) -> Port | None:
    """Return the signal of a port: as given, by name, by what its name means, by unit alone."""
    name, unit = variable.name, unit_of(variable)
    if name in given:
        return _as_given(variable, given[name], signals)
    words = {as_word(signal): signal for signal in signals}
    for candidate, reason in ((name, "its name"), (channel_of(variable), "what its name says")):
        signal = words.get(as_word(candidate))
        if signal and _fits(unit, signals[signal]):
            return _port(variable, signal, reason)
    if not by_unit or unit in (None, "1"):
        return None
    same = [one for one in signals if _fits(unit, signals[one])]
    rivals = [v for v in ports.values() if v.name not in given and _fits(unit, unit_of(v) or "")]
    if len(same) == 1 and len(rivals) == 1:
        return _port(variable, same[0], "its unit alone, check it")
    return None


class GivenPort(NamedTuple):
    """What `--map PORT=-CHANNEL@UNIT` says; `unit` "" and `sign` 0 where it does not."""

    signal: str
    unit: str = ""
    sign: int = 0


def _given(name: str, text: str) -> GivenPort:
    signal, _, unit = text.strip().partition("@")
    sign = {"-": -1, "+": 1}.get(signal[:1], 0)
    if unit and unit_or_none(unit) is None:
        raise FmuError(f'--map {name}={text}: "{unit}" is no unit that is known.')
    return GivenPort(signal[abs(sign) :].strip(), unit, sign)


def _as_given(variable: Variable, given: GivenPort, signals: Mapping[str, str]) -> Port:
    reason, unit = "as given", given.unit or unit_of(variable) or ""
    if not unit:
        unit = signals[given.signal]
        reason += f"; the FMU gives no unit, taken as {unit}"
    return Port(
        variable.name,
        unit,
        given.signal,
        reason,
        given.sign or 1,
    )


def unit_of(variable: Variable) -> str | None:
    """Return the unit of a port: the FMU's, else that in its name, as in a title: `v_mm_s`, `F_kN`.

    An ending counts where it is a unit of what the name means; `x_in` and the like go in.
    """
    return told_unit(variable) or _named_unit(variable)


def told_unit(variable: Variable) -> str | None:
    """Return the unit that the FMU gives a port, as its BaseUnit defines it, None without one.

    Where there is no name for that, it is the definition, which no signal fits.
    """
    if variable.defined is None:
        return variable.unit
    return spelling(variable.defined) or in_base_units(variable.defined)


def _named_unit(variable: Variable) -> str | None:
    called = title(0, variable.name.rpartition(".")[2])
    if called.unit is None or called.unit.name in _NO_UNITS:
        return None
    meant = meaning(called.name, called.unit.name)
    if meant is None or meant.quantity not in PLAIN:
        return None
    fits = same_dimension(called.unit.name, PLAIN[meant.quantity])
    return called.unit.name if fits else None


def channel_of(variable: Variable) -> str:
    """Return the channel that a port's name means, "" where it means none."""
    own = variable.name.rpartition(".")[2]
    own = title(0, own).name if _named_unit(variable) else own
    unit = unit_of(variable)
    meant = meaning(own, unit if unit and Measure(unit).unit else None)
    if meant is None or meant.rank == 0:
        return ""
    if meant.quantity == "drift":
        return f"drift{meant.number or 1}"
    if meant.place == "ground":
        return f"ground_{meant.quantity}"
    if meant.place:
        end = "_absolute" if meant.quantity == "acceleration" else ""
        return f"{meant.place}_{meant.quantity}{end}"
    return meant.quantity


def _port(variable: Variable, signal: str, reason: str) -> Port:
    """Return a port that was found, refused where its unit is in doubt."""
    name, unit, named = variable.name, unit_of(variable), _named_unit(variable)
    told = told_unit(variable)
    if not unit:
        raise FmuError(
            f"{name}: its unit is in doubt: neither the FMU nor its name gives one. "
            f"--map {name}={signal}@UNIT says it."
        )
    if told and named and not _same_unit(told, named):
        raise FmuError(
            f"{name}: its unit is in doubt: the FMU says {told}, and its name {named}. "
            f"--map {name}={signal}@{told} or @{named} says which."
        )
    if not told:
        reason += f"; in {unit} by its name"
    return Port(name, unit, signal, reason)


def _same_unit(first: str, second: str) -> bool:
    try:
        return conversion(first, second) == (1.0, 0.0)
    except UnitError:
        return False


def _fits(unit: str | None, other: str) -> bool:
    """Return whether two units measure the same; one that is not given fits all."""
    if not unit or not other:
        return not unit
    try:
        return same_dimension(unit, other)
    except UnitError:
        return False


def _left(variable: Variable, signals: Mapping[str, str]) -> str:
    told = told_unit(variable)
    unit = f" [{told}]" if told else ""
    stays = f"{variable.name}{unit} is fed from nothing: it stays at {variable.start}"
    if variable.optional:
        return f"{stays} (optional)"
    same = [name for name in signals if _fits(told, signals[name])] if told else []
    there = (
        f"measured in that unit: {', '.join(same)}" if same else "nothing of that unit was measured"
    )
    name = variable.name
    return f"{stays}; {there}. --map {name}=CHANNEL feeds it, --set {name}=VALUE sets it"


def _check_given(
    description: Description,
    ports: Mapping[str, Variable],
    signals: Mapping[str, str],
    given: Mapping[str, GivenPort],
    values: Mapping[str, object],
) -> None:
    wrong = []
    for name, (signal, unit, _) in given.items():
        if name not in ports:
            wrong.append(f"--map {name}={signal}: {unknown('Real input or output', name, ports)}")
            continue
        unit = unit or unit_of(ports[name]) or ""
        if signal not in signals:
            wrong.append(f"--map {name}={signal}: {unknown('channel', signal, signals)}")
        elif not _fits(unit, signals[signal]):
            wrong.append(
                f"--map {name}={signal}: {name} is in {unit}, {signal} in {signals[signal]}."
            )
    settable = [
        v.name for v in description.variables.values() if v.causality in ("input", "parameter")
    ]
    wrong += [
        f"--set {name}: {unknown('parameter or input', name, settable)}"
        for name in values
        if name not in settable
    ]
    wrong += [f"{name} is both set and mapped; one of the two." for name in given if name in values]
    if wrong:
        raise FmuError(f"{description.name}: " + "\n  ".join(wrong))


def _refuse_nothing(
    description: Description,
    outputs: Mapping[str, Variable],
    signals: Mapping[str, str],
    into: list[Port],
    out: list[Port],
) -> None:
    there = ", ".join(f"{name} [{unit}]" for name, unit in signals.items())
    inputs = description.of("input")
    for kind, ports, found in (("output", [*outputs.values()], out), ("input", inputs, into)):
        if not found and (ports or kind == "output"):
            has = ", ".join(f"{v.name} [{told_unit(v) or '?'}]" for v in ports) or "none"
            raise FmuError(
                f"{description.name}: no {kind} matches a measured channel. It has: {has}; "
                f"measured: {there}. --map {kind.upper()}=CHANNEL says which belong together."
            )


# Whether an FMU's output has the unit and the sign that it is taken to have, from the numbers.

AGAINST = -0.5
"""Correlation with the measured output below which a sign is in doubt."""

ALIKE = 0.8
"""Correlation from which the sizes of two outputs say something of their units."""

LEAST = 30.0
"""Ratio of sizes below which a model may as well be wrong."""


def doubts(outputs: tuple[Comparison, ...], ports: PortMap) -> list[str]:
    """Return the warnings of outputs that are turned, or many times larger or smaller."""
    named = {port.name: port for port in ports.outputs}
    notes: list[str] = []
    for one in outputs:
        port = named[one.quantity]
        y = np.concatenate([run.measured for run in one.predictions])
        p = np.concatenate([run.predicted for run in one.predictions])
        if not (np.std(y) > 0.0 and np.std(p) > 0.0):
            continue
        correlation, ratio = float(np.corrcoef(y, p)[0, 1]), float(np.std(y) / np.std(p))
        if correlation < AGAINST:
            notes.append(
                f"Warning: {port.name} has the opposite sign of {port.signal} (correlation "
                f"{correlation:.2f}); --map {port.name}=-{port.signal} reverses it."
            )
        if abs(correlation) > ALIKE and not 1.0 / LEAST < ratio < LEAST:
            notes.append(
                f"Warning: {port.signal} is {plain(ratio, 3)} times {port.name}, taken in "
                f"{port.unit}; --map {port.name}={port.signal}@UNIT gives it another unit."
            )
    return notes


# One measurement as an FMU is fed: channels and other columns, motion smoothed, errors drawn.


DRAWS = 6
"""Draws of the inputs' error."""
_KINEMATIC = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True, eq=False)
class FedSignals:
    """One piece of a measurement as an FMU is fed: values (n,) in SI, smoothed where they can be.

    `errors` name to (d, n): draws of what is left uncertain; `raw` the channels as measured, with
    their noise, which is not known of those `untold`; `rates` name to that of the signal whose
    derivative is known; `measured` (n,) where nothing was filled in.
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
    untold: tuple[str, ...] = ()
    measured: NDArray[np.bool_] = field(default_factory=lambda: np.ones(0, dtype=np.bool_))


def signals_of(
    table: Table, channels: Mapping[str, ChannelSpec], rig: str
) -> tuple[list[FedSignals], list[str]]:
    """Return the pieces of a table as an FMU is fed, and what was guessed and done.

    Columns that are no known channel are there under their own names, if they have a unit.

    Parameters
    ----------
    table : the measurement, not converted yet
    channels : channels that are known, by name; the others are guessed
    rig : {"bench", "structure"}, which decides the channels that are looked for

    Raises
    ------
    RecordError
        If there is no time, no column with a unit, or a given channel cannot be read.
    """
    guesses = guess_channels(table, rig)
    notes = [f"guessed: {one}" for one in guesses if one.channel not in channels and one.doubt]
    chosen = {**specs(table, guesses), **channels}
    if (clock := chosen.pop("time", None)) is None:
        able = may_be_time(table, [text for text in table.values if text not in table.not_numeric])
        way = f" {in_unit('time', able[0])}." if len(able) == 1 else ""
        raise RecordError(f"{table.source}: no column is the time.{way}")
    if clock.step is None:
        clock = replace(clock, unit=clock.unit or table.find(clock.column).stated or "s")
    time, columns = time_of(table, clock), {}
    for name, spec in chosen.items():
        column = table.find(spec.column)
        if not (spec.unit or column.stated) or column.text in table.not_numeric:
            if name in channels:
                raise RecordError(f'{table.source}: "{column.text}" has no numbers or no unit.')
            continue
        columns[name] = in_si(table, name, spec), channel_unit(name)
    taken = {table.find(spec.column).text for spec in chosen.values()}
    for column in table.columns:
        if column.text in taken or column.text in table.not_numeric or column.name in columns:
            continue
        if column.unit is not None and column.unit.name != "s":
            columns[column.name] = table.values[column.text], column.unit.name
        elif column.unit is None:
            notes.append(f'not used: "{column.text}", which has no unit')
    if not columns:
        raise RecordError(f"{table.source}: no column besides the time has a unit that is known.")
    values = {name: y for name, (y, _) in columns.items()}
    even = evenly(time, values, table.lines, table.source, table.place)
    units = {name: unit for name, (_, unit) in columns.items()}
    stem = Path(table.source).stem
    names = [stem]
    if len(even.pieces) > 1:
        names = [f"{stem} ({k})" for k in range(1, len(even.pieces) + 1)]
    found = [
        replace(_signals(name, even.sampling.step, piece, units, channels, k), measured=measured)
        for k, (name, (_, piece, measured)) in enumerate(zip(names, even.pieces, strict=True), 1)
    ]
    return found, notes + even.notes


def _signals(
    name: str, dt: float, raw: dict[str, Array], unit: dict[str, str],
    channels: Mapping[str, ChannelSpec], seed: int,
) -> FedSignals:  # fmt: skip
    """Return one piece: its motion smoothed, its drive without noise, draws of what is left."""
    n, unit = len(next(iter(raw.values()))), dict(unit)
    generator = np.random.default_rng(seed)
    given = {k: s.noise for k, s in channels.items() if s.noise is not None}
    facts = {k: estimate_noise(y) for k, y in raw.items() if k not in given}
    noise = {**given, **{k: one.std for k, one in facts.items()}}
    untold = tuple(k for k, one in facts.items() if not one.known)
    values, errors, derived = dict(raw), {}, []
    rates: dict[str, str] = {}
    for prefix in ("", "base_"):
        x, v = raw.get(f"{prefix}displacement"), raw.get(f"{prefix}velocity")
        if x is None and v is None:
            continue
        sizes = (noise.get(f"{prefix}displacement", 0.0), noise.get(f"{prefix}velocity", 0.0))
        motion = smooth(x, v, dt, sizes)
        have = (x is not None, v is not None)
        drawn = posterior_draws(n, dt, sizes, motion.jerk, have, DRAWS, seed, motion)
        motions = (motion.x, motion.v, motion.a)[: 2 if prefix else 3]
        for i, (kind, y) in enumerate(zip(_KINEMATIC, motions, strict=False)):
            one = f"{prefix}{kind}"
            if one not in raw:
                derived.append(one)
            values[one], errors[one], unit[one] = y, drawn[:, :, i], PLAIN[kind]
        rates |= {f"{prefix}{a}": f"{prefix}{b}" for a, b in pairwise(_KINEMATIC)}
    for one in DRIVE:
        if one in raw:
            values[one], errors[one] = smooth_drive(raw[one], noise[one], dt, DRAWS, seed + 1)
    for one in values:
        if one not in errors:
            errors[one] = generator.standard_normal((DRAWS, n)) * noise.get(one, 0.0)
    kept = {a: b for a, b in rates.items() if a in values and b in values}
    return FedSignals(name, dt, values, unit, errors, raw, noise, kept, tuple(derived), untold)


HALVINGS = 2
"""How often the measurement's step is halved for the prediction."""
SILENT = 1e-3
"""Share of an output's RMS that stands in for its noise where the measurement has none."""


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

    It is stepped in a process of its own at a quarter of the measurement's step, inputs between
    samples interpolated; inputs of t_k+1 are set before the step from t_k. The numerical error is
    what the last halving of the step has changed. Displacement and velocity are joined into one
    smoothed motion first, for the noise of inputs would be taken for errors of the FMU; what stays
    uncertain is carried through.

    Parameters
    ----------
    fmu, data : path
        An FMI 2.0 co-simulation FMU; a measurement file, or results of a run.
    values : mapping
        Parameters and inputs by name, in the FMU's units, as text.
    maps : mapping
        Inputs and outputs to channels, with sign and unit where they are needed, "-force@kN"; else
        by name, by what the name says, by unit.
    channels : mapping
        Where channels are in the file, in place of the guess.
    timeout : float
        s, for all of the run.

    Raises
    ------
    FmuError, RecordError, RunError
        The first also where the unit of a port is in doubt.
    """
    path = Path(fmu)
    description = read_description(path, versions=("2.0",))
    table = read_table(data)
    structural = any(
        v.causality in ("input", "output") and v.name.startswith(("ground_", "base_", "floor"))
        for v in description.variables.values()
    )
    pieces, notes = signals_of(table, channels or {}, "structure" if structural else "bench")
    given = _typed(description, values or {})
    ports = map_ports(description, pieces[0].units, maps or {}, given)
    job, passes = _job(path, pieces, ports, given)
    found = step_through(job, passes, timeout)
    predictions = _predictions(pieces, ports, found, notes)
    outputs = tuple(compare_predictions(runs, seen=None) for runs in predictions.values())
    notes += doubts(outputs, ports)
    if pieces[0].derived:
        notes.append(f"{', '.join(pieces[0].derived)}: from the other channels of the motion")
    return FmuComparison(str(fmu), str(data), ports, outputs, tuple(dict.fromkeys(notes)))


def _job(
    path: Path, pieces: list[FedSignals], ports: PortMap, given: dict[str, Value]
) -> tuple[SteppingJob, list[dict[str, Array]]]:
    """Return the passes per piece: at the finest step, at twice that, as measured, and the draws.

    Held inputs cost accuracy in proportion to the step: at that of the measurement it would be
    taken for an error of the FMU.
    """
    passes: list[dict[str, Array]] = []
    steps: list[float] = []

    def add(step: float, inputs: dict[str, Array]) -> None:
        turned = {}
        for port in ports.inputs:
            factor, offset = conversion(piece.units[port.signal], port.unit)
            turned[port.name] = port.sign * (factor * inputs[port.signal] + offset)
        passes.append(turned or {"": next(iter(inputs.values()))})
        steps.append(step)

    for piece in pieces:
        finer = [piece.values]
        for level in range(HALVINGS):
            last, dt = finer[-1], piece.dt / 2**level
            finer.append(
                {
                    name: between(y, last.get(piece.rates.get(name, "")), dt)
                    for name, y in last.items()
                }
            )
        for level in (HALVINGS, HALVINGS - 1, 0):
            add(piece.dt / 2**level, finer[level])
        for d in range(DRAWS):
            add(piece.dt, {name: y + piece.errors[name][d] for name, y in piece.values.items()})
    names = tuple(port.name for port in ports.inputs)
    outputs = tuple(port.name for port in ports.outputs)
    return SteppingJob(str(path.resolve()), dict(given), names, outputs, tuple(steps)), passes


def _predictions(
    pieces: list[FedSignals], ports: PortMap, found: list[dict[str, Array]], notes: list[str]
) -> dict[str, list[RunPrediction]]:
    """Return per output the pieces held against it."""
    per = 3 + DRAWS
    out: dict[str, list[RunPrediction]] = {port.name: [] for port in ports.outputs}
    for k, piece in enumerate(pieces):
        mine = found[per * k : per * (k + 1)]
        for port in ports.outputs:
            si = piece.units[port.signal]
            factor, offset = conversion(port.unit, si)
            rows = [port.sign * (factor * one[port.name] + offset) for one in mine]
            out[port.name].append(_one(piece, port.name, port.signal, si, rows, ports, notes))
    return out


def _one(
    piece: FedSignals, name: str, signal: str, unit: str, rows: list[Array], ports: PortMap,
    notes: list[str],
) -> RunPrediction:  # fmt: skip
    predicted, coarser = rows[0][:: 2**HALVINGS], rows[1][:: 2 ** (HALVINGS - 1)]
    middle, draws = rows[2], np.array(rows[3:])
    measured = piece.raw[signal] if signal in piece.raw else piece.values[signal]
    noise = piece.noise.get(signal, 0.0)
    floor = SILENT * rms(measured - measured.mean())
    if noise < floor:
        noise = floor
        notes.append(
            f"{signal} has almost no noise: errors are in units of {percent(SILENT)} of its RMS"
        )
    spread = draws - middle
    bias = spread.mean(axis=0)
    sigma = np.sqrt(noise**2 + spread.var(axis=0, ddof=1))
    early = np.arange(len(measured)) < SETTLED
    return RunPrediction(
        piece.name, piece.dt, measured, predicted + bias, sigma, noise, spread - bias,
        _coordinates(piece, signal, ports), predicted - coarser, name, unit, skip=SETTLED,
        known=None if piece.measured.all() else piece.measured,
        held=error_of(measured, predicted, {MISSING: ~piece.measured, SETTLING: early}),
        noise_known=signal not in piece.untold,
    )  # fmt: skip


def _coordinates(piece: FedSignals, signal: str, ports: PortMap) -> dict[str, Array]:
    """Return the coordinates of a piece: of its motion, and every input besides."""
    get = piece.values.get
    prefix = "" if "velocity" in piece.values else "base_"
    force = piece.raw.get("force") if signal != "force" else piece.raw[signal]
    drive = next((one for one in DRIVE if one in piece.values), DRIVE[0])
    found = coordinates_of(
        piece.dt, get(f"{prefix}displacement"), get(f"{prefix}velocity"),
        get(f"{prefix}acceleration"),
        get(drive), force if force is not None else piece.raw.get(signal), drive,
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
                # The FMU runs in a folder of its own, where a relative path would lead to nothing.
                file = Path(text)
                out[name] = str(file.resolve()) if file.suffix and file.is_file() else text
        except (ValueError, KeyError):
            raise FmuError(
                f"--set {name}={text}: {name} is {kind} in {description.name}."
            ) from None
    return out
