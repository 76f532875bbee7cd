"""Checks of built-in test signals: their samples, parameters that do nothing, rods that jump."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sin
from pathlib import Path

from ..core.config import Document
from ..errors import PhysicsError
from ..physics.record import read_two_column
from ..physics.signals import KINDS, PARAMETERS, TAKEN, read_steps
from .parts import Part, Run, existing_file

_SMALL_JUMP = 1e-3
"""Share of the amplitude [1] below which a jump of the displacement is not worth a word."""


def check_signal(part: Part, folder: Path, document: Document) -> None:
    """Check the samples of a signal, and that its kind takes all parameters that are set.

    Parameters
    ----------
    part : Part
        Any component; one without a `kind` of signal is passed over.
    folder : Path
        The scenario's; relative names of files begin there.
    document : Document
        Takes what is found.
    """
    kind = part.value("kind")
    if part.file is not None or not isinstance(kind, str) or kind not in KINDS:
        return
    if kind == "csv" and "file" in part.variables:
        _check_csv(part, folder, document)
    if kind == "steps" and "steps" in part.variables:
        _check_steps(part, document)
    taken = TAKEN[kind]
    for name in (*PARAMETERS, "steps", "file"):
        if name in part.parameters and name not in taken:
            document.warning(
                part.places[name],
                f'{part.name}.{name} does nothing while {part.name}.kind is "{kind}", which takes '
                f"{', '.join(taken)}.",
            )


def _check_csv(part: Part, folder: Path, document: Document) -> None:
    path = part.places.get("file") or part.places.get("kind", part.path)
    value, where = part.value("file"), f"{part.name}.file"
    if not value:
        document.error(path, f'{where} is missing: kind = "csv" reads a file.')
        return
    file = existing_file(str(value), folder, path, where, document)
    if file:
        try:
            read_two_column(file, header=None)
        except PhysicsError as error:
            document.error(path, f"{where}: {error}")


def _check_steps(part: Part, document: Document) -> None:
    try:
        read_steps(str(part.value("steps") or ""))
    except PhysicsError as error:
        path = part.places.get("steps") or part.places.get("kind", part.path)
        document.error(path, f"{part.name}.{error}")


def check_rod(part: Part, run: Run, document: Document) -> None:
    """Warn of a prescribed motion that jumps: its velocity shows nothing of it.

    Parameters
    ----------
    part : Part
        Any component; one that is no built-in motion of a rod is passed over.
    run : Run
        Its stop says what is reached.
    document : Document
        Takes what is found.
    """
    if part.file is not None or not {"displacement", "kind"} <= part.variables.keys():
        return
    for name, text in _jumps(part, run.stop or 0.0):
        document.warning(part.places.get(name) or part.places.get("kind", part.path), text)


def _jumps(part: Part, stop: float) -> Iterator[tuple[str, str]]:
    """Yield the parameter and the text of each jump before the stop [s]."""
    kind, numbers = part.value("kind"), {name: part.real(name) or 0.0 for name in PARAMETERS}
    if kind not in ("sine", "chirp"):
        return
    amplitude, phase, start = (numbers[name] for name in ("amplitude", "phase", "start"))
    if 0.0 < start < stop and abs(sin(phase)) > _SMALL_JUMP and amplitude:
        yield (
            "phase",
            f"{part.name}: the displacement jumps by {amplitude * sin(phase):.3g} m with velocity "
            f"0 where the {kind} begins, at t = {start:.9g} s; phase = 0 or start = 0 is right.",
        )
    duration, mean = numbers["duration"], 0.5 * (numbers["frequency"] + numbers["frequency_end"])
    end, cycles = start + duration, mean * duration + phase / (2.0 * pi)
    jump = -amplitude * sin(2.0 * pi * cycles)
    if kind == "chirp" and 0.0 < end < stop and abs(jump) > _SMALL_JUMP * abs(amplitude):
        text = f"{part.name}: the displacement jumps by {jump:.3g} m with velocity 0 where the "
        yield "duration", f"{text}chirp ends, at t = {end:.9g} s{_better(duration, mean, phase)}."


def _better(duration: float, mean: float, phase: float) -> str:
    """Return the duration [s] nearest to this one at which a chirp ends at its offset."""
    if mean <= 0.0:
        return ""
    before = phase / pi  # half cycles
    halves = max(round(2.0 * mean * duration + before), int(before // 1) + 1)
    return f"; duration = {(halves - before) / (2.0 * mean):.9g} ends it at its offset"
