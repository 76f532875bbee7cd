"""Any FMU held against a measurement: its inputs fed from channels, its outputs judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compare.comparison import Comparison, compare_predictions
from ..compare.coordinates import coordinates_of
from ..compare.prediction import RunPrediction
from ..compare.scale import rms
from ..data.channels import DRIVE, MOTION, ChannelSpec, is_channel
from ..data.finer import between
from ..data.left_out import MISSING, SETTLING
from ..data.read import read_table
from ..errors import FmuError
from ..fmu.description import Description, Value, read_description
from ..identify.begin import SETTLING as SETTLED
from ..identify.error import error_of
from ..units import conversion
from .doubts import doubts
from .ports import PortMap, map_ports
from .signals import DRAWS, Signals, signals_of
from .stepping import Job, step_through

Array = NDArray[np.float64]

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
        The first also where the unit or the sign of a port is in doubt.
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
    notes += doubts(outputs, ports, description.name)
    if pieces[0].derived:
        notes.append(f"{', '.join(pieces[0].derived)}: from the other channels of the motion")
    return FmuComparison(str(fmu), str(data), ports, outputs, tuple(dict.fromkeys(notes)))


def _job(
    path: Path, pieces: list[Signals], ports: PortMap, given: dict[str, Value]
) -> tuple[Job, list[dict[str, Array]]]:
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
    return Job(str(path.resolve()), dict(given), names, outputs, tuple(steps)), passes


def _predictions(
    pieces: list[Signals], ports: PortMap, found: list[dict[str, Array]], notes: list[str]
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
    piece: Signals, name: str, signal: str, unit: str, rows: list[Array], ports: PortMap,
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
            f"{signal} has almost no noise: errors are in units of {SILENT:.1%} of its RMS"
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


def _coordinates(piece: Signals, signal: str, ports: PortMap) -> dict[str, Array]:
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


__all__ = ["FmuComparison", "compare_fmu", "signals_of"]
