"""The files of the FMI cross-check beside an FMU: input, reference rows, options, a README."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

STEP, STEPS = 0.002, 500
TOLERANCE = 1e-9

README = """# {name}

An FMU of bristle for co-simulation, FMI 2.0. It needs no license and no tool, but a Python
interpreter (3.9 or newer) in the host's process: a host that is not Python loads a shared libpython
first. Its binaries are for 64-bit Linux and Windows.

`{name}_ref.csv` has the outputs at t = 0 and after each step of {step} s. {inputs}

Open an issue in the project's repository for questions.
"""
INPUTS = "In the step from\nt the inputs have their values of `{name}_in.csv` at t."


def moves(inputs: Mapping[str, tuple[float, float]]) -> list[dict[str, float]]:
    """Return the inputs at each time, of centre and amplitude of each, one cycle in a second."""
    return [
        {
            name: centre + amplitude * math.sin(2 * math.pi * k * STEP + 0.7 * i)
            for i, (name, (centre, amplitude)) in enumerate(inputs.items())
        }
        for k in range(STEPS + 1)
    ]


def write(
    place: Path,
    name: str,
    inputs: Sequence[Mapping[str, float]],
    outputs: Sequence[str],
    rows: Sequence[Sequence[float]],
) -> None:
    """Write the files beside an FMU of this name.

    Parameters
    ----------
    place : Path
        The FMU's folder.
    name : str
    inputs : sequence of mapping
        The inputs at each time.
    outputs : sequence of str
        Names of the columns of `rows`.
    rows : sequence of sequence of float
        The outputs at each time.
    """
    times = [k * STEP for k in range(STEPS + 1)]
    table = [[time, *row] for time, row in zip(times, rows, strict=True)]
    _write(place / f"{name}_ref.csv", outputs, table)
    if inputs[0]:
        table = [[time, *row.values()] for time, row in zip(times, inputs, strict=True)]
        _write(place / f"{name}_in.csv", list(inputs[0]), table)
    options = {"StartTime": 0.0, "StopTime": STEPS * STEP, "StepSize": STEP, "RelTol": TOLERANCE}
    text = "".join(f"{key}, {value!r}\n" for key, value in options.items())
    (place / f"{name}_ref.opt").write_text(text, encoding="utf-8")
    said = INPUTS.format(name=name) if inputs[0] else "It has no inputs."
    readme = README.format(name=name, step=STEP, inputs=said)
    (place / "README.md").write_text(readme, encoding="utf-8")


def _write(file: Path, names: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        head = ",".join(f'"{name}"' for name in ("time", *names))
        stream.write(head + "\n")
        csv.writer(stream, lineterminator="\n").writerows([[repr(x) for x in row] for row in rows])
