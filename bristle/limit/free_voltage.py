"""A scenario whose damper gets a voltage history from a file, in place of what commanded it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import not_usable
from ..scenario.scenario import Component, Connection, Scenario, load_scenario
from ..scenario.text import scenario_text
from .case import Case

Array = NDArray[np.float64]

VOLTAGE_FILE, SCENARIO_FILE = "voltage.csv", "limit.toml"
_NAME = "limit_voltage"


def refuse_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written to, before the work for it is done.

    Raises
    ------
    RunError
        With exit code 2.
    """
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise not_usable(f"{there}: is a file; a limit goes into a folder.")
    if not os.access(there, os.W_OK):
        raise not_usable(f"{there}: cannot be written to; name another folder.")


def write_scenario(case: Case, time: Array, voltage: Array, folder: Path) -> Scenario:
    """Write a voltage history and a scenario that plays it into a folder; return the scenario.

    What commanded the damper goes where nothing else reads it.

    Parameters
    ----------
    case : Case
    time, voltage : (n,) s and V; linear between
    folder : Path

    Raises
    ------
    RunError
        If the folder cannot be written, exit code 2.
    """
    rows = [f"time [s],{case.command} [{case.command_unit}]"]
    rows += [f"{t:.9g},{V:.9g}" for t, V in zip(time.tolist(), voltage.tolist(), strict=True)]
    path = folder / SCENARIO_FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / VOLTAGE_FILE).write_text("\n".join(rows) + "\n", encoding="utf-8")
        text = scenario_text(with_voltage(case, folder / VOLTAGE_FILE))
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise not_usable(f"{folder}: cannot be written: {error.strerror or error}.") from error
    return load_scenario(path)


def with_voltage(case: Case, file: Path) -> Scenario:
    """Return the scenario with a source that plays a file as the damper's command.

    Its source has not been checked: write it, and load it again.
    """
    scenario, port = case.scenario, (case.damper, case.command)
    names = {component.name for component in scenario.components}
    name = _NAME
    while name in names:
        name += "_"
    before = {c.source for c in scenario.connections if (c.target, c.input) == port}
    read = {c.source for c in scenario.connections if (c.target, c.input) != port}
    gone = before - read
    kept = [c for c in scenario.components if c.name not in gone]
    at = next(k for k, c in enumerate(kept) if c.name == case.damper)
    damper = replace(
        kept[at], parameters={k: v for k, v in kept[at].parameters.items() if k != case.command}
    )
    values: dict[str, bool | int | float | str] = {"kind": "csv", "file": str(file.absolute())}
    source = Component(name, "SignalSource", None, None, values, None, damper.description)
    wires = [
        c for c in scenario.connections
        if (c.target, c.input) != port and c.target not in gone and c.source not in gone
    ]  # fmt: skip
    return replace(
        scenario,
        title=f"{scenario.title}, the voltage of the limit",
        components=(*kept[:at], source, damper, *kept[at + 1 :]),
        connections=(*wires, Connection(*port, name, "value")),
    )
