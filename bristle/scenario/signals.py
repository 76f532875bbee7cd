"""Checks of built-in test signals: their samples, and parameters that do nothing."""

from __future__ import annotations

from pathlib import Path

from ..errors import PhysicsError
from ..findings import Findings
from ..physics.record import read_two_column
from ..physics.signals import KINDS, PARAMETERS, TAKEN, read_steps
from .parts import Part, existing_file


def check_signal(part: Part, folder: Path, findings: Findings) -> None:
    """Check the samples of a signal, and that its kind takes all parameters that are set.

    Parameters
    ----------
    part : Part
        Any component; one without a `kind` of signal is passed over.
    folder : Path
        The scenario's; relative names of files begin there.
    findings : Findings
        Takes what is found.
    """
    kind = part.value("kind")
    if part.file is not None or not isinstance(kind, str) or kind not in KINDS:
        return
    if kind == "csv" and "file" in part.variables:
        _check_csv(part, folder, findings)
    if kind == "steps" and "steps" in part.variables:
        _check_steps(part, findings)
    taken = TAKEN[kind]
    for name in (*PARAMETERS, "steps", "file"):
        if name in part.parameters and name not in taken:
            findings.warning(
                part.places[name],
                f'{part.name}.{name} does nothing while {part.name}.kind is "{kind}", which takes '
                f"{', '.join(taken)}.",
            )


def _check_csv(part: Part, folder: Path, findings: Findings) -> None:
    path = part.places.get("file") or part.places.get("kind", part.path)
    value, where = part.value("file"), f"{part.name}.file"
    if not value:
        findings.error(path, f'{where} is missing: kind = "csv" reads a file.')
        return
    file = existing_file(str(value), folder, path, where, findings)
    if file:
        try:
            read_two_column(file, header=None)
        except PhysicsError as error:
            findings.error(path, f"{where}: {error}")


def _check_steps(part: Part, findings: Findings) -> None:
    try:
        read_steps(str(part.value("steps") or ""))
    except PhysicsError as error:
        path = part.places.get("steps") or part.places.get("kind", part.path)
        findings.error(path, f"{part.name}.{error}")
