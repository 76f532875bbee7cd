"""`[[runs]]` of study.toml: a file, what it is for, and what is known of the whole run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..data.channels import DRIVE, PLAIN, ChannelSpec, device_channel, is_channel
from ..data.command_limits import LIMITS
from ..data.corrections import FAULTS, Correction, wrong_value
from ..data.files import Toml
from ..data.labels import UNITS, Label
from ..findings import unknown, written
from ..lines import KeyPath

TEST = "test"
"""The role of runs that no choice sees: neither a fit nor a verdict reads them."""

ROLES = ("train", "holdout", TEST)
"""The roles of runs that are read."""

EXCLUDE = "exclude"
"""The role of runs that are left out: nothing reads them."""

_RUN_KEYS = ("file", "piece", "role", *DRIVE, *UNITS, "labels", "correct")
_CORRECTION_KEYS = Correction._fields


@dataclass(frozen=True)
class RunFile:
    """One `[[runs]]`: the file, relative to the study, and its role, of `ROLES` or `EXCLUDE`.

    `levels` of a command that the file does not hold, by channel, in its unit; `labels` what else
    is known of the whole run; `piece` its number in a file of several runs, from 1, else 0;
    `corrections` what is set right in its channels as it is read.
    """

    file: str
    role: str = "train"
    levels: Mapping[str, float] = field(default_factory=dict)
    labels: Mapping[str, Label] = field(default_factory=dict)
    piece: int = 0
    corrections: tuple[Correction, ...] = ()

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"{self.file}, run {self.piece}" if self.piece else self.file


def read_runs(toml: Toml, folder: Path, split: bool) -> tuple[RunFile, ...]:
    """Return the runs of a study.toml, noting what is wrong with them.

    Parameters
    ----------
    toml : the file
    folder : where the files of runs are
    split : whether a file holds several runs
    """
    listed = toml.data.get("runs", [])
    if not isinstance(listed, list) or not listed:
        toml.error(("runs",), 'there are no runs; add [[runs]] with file = "data/run_1.csv".')
        return ()
    out: list[RunFile] = []
    for index, table in enumerate(listed):
        keys = ("runs", index)
        if not isinstance(table, dict):
            toml.error(keys, f"a run is {written(table)}; a table is right.")
            continue
        toml.known(keys, table, _RUN_KEYS)
        file, role = toml.text(keys, table, "file"), toml.text(keys, table, "role", "train")
        if role not in (*ROLES, EXCLUDE):
            right = ", ".join(f'"{one}"' for one in ROLES)
            toml.error((*keys, "role"), f'role = "{role}"; {right} or "{EXCLUDE}" is right.')
        if not file:
            toml.error(keys, 'a run has no file; file = "data/run_1.csv" is right.')
        elif not (folder / file).is_file():
            toml.error((*keys, "file"), f"there is no file {folder / file}.")
        made = RunFile(
            file, role, _levels(toml, keys, table), _labels(toml, keys, table),
            _piece(toml, keys, table, split), _corrections(toml, keys, table),
        )  # fmt: skip
        if any(made.name == run.name for run in out):
            toml.error((*keys, "file"), f"{made.name} is listed twice: one of the two must go.")
        out.append(made)
    return tuple(out)


def _levels(toml: Toml, keys: KeyPath, table: Mapping[str, Any]) -> dict[str, float]:
    """Return the levels of the command that a run's table gives."""
    found = {name: toml.number(keys, table, name) for name in DRIVE if name in table}
    return {name: level for name, level in found.items() if level is not None}


def _labels(toml: Toml, keys: KeyPath, table: Mapping[str, Any]) -> dict[str, Label]:
    """Return the labels that a run's table gives, those of its table `labels` included."""
    found: dict[str, Label] = {}
    for name in UNITS:
        value = toml.number(keys, table, name)
        if value is not None:
            found[name] = value
    for name, value in toml.table(keys, table, "labels").items():
        here = (*keys, "labels", name)
        if name in (*DRIVE, *UNITS):
            toml.error(here, f"{name} stands beside file and role, not in labels.")
        elif isinstance(value, bool) or not isinstance(value, int | float | str):
            toml.error(here, f"{name} = {written(value)}; a number or a word is right.")
        else:
            found[name] = value if isinstance(value, str) else float(value)
    return found


def _piece(toml: Toml, keys: KeyPath, table: Mapping[str, Any], split: bool) -> int:
    """Return the number of a run in its file, 0 where files hold one run each."""
    piece = table.get("piece", 0)
    if isinstance(piece, bool) or not isinstance(piece, int) or piece < bool("piece" in table):
        toml.error((*keys, "piece"), f"piece = {written(piece)}; 1 is a file's first run.")
    elif split != bool(piece):
        right = "piece = 1 is its first run" if split else 'split = "restart" must stand above'
        toml.error(keys, f"split and piece go together: {right}.")
    return piece if isinstance(piece, int) else 0


def _corrections(toml: Toml, keys: KeyPath, table: Mapping[str, Any]) -> tuple[Correction, ...]:
    """Return what a run's table sets right in its channels."""
    listed = table.get("correct", [])
    right = '[{ channel = "force", fault = "gain", value = 1.25 }]'
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        toml.error((*keys, "correct"), f"correct = {written(listed)}; {right} is right.")
        return ()
    out = []
    for index, one in enumerate(listed):
        here = (*keys, "correct", index)
        toml.known(here, one, _CORRECTION_KEYS)
        channel, fault = toml.text(here, one, "channel"), toml.text(here, one, "fault")
        value = toml.number(here, one, "value")
        if not (is_channel(channel) or device_channel(channel)):
            toml.error(here, unknown("channel", channel, PLAIN))
        elif fault not in FAULTS:
            toml.error(here, unknown("fault", fault, FAULTS))
        elif value is None:
            toml.error(here, f"{fault} has no value: {FAULTS[fault]}.")
        elif fault in LIMITS and channel not in DRIVE:
            toml.error(here, f"{fault} is of a command ({', '.join(DRIVE)}), not of {channel}.")
        elif wrong := wrong_value(fault, value):
            toml.error(here, f"{fault} = {written(value)}: {wrong}")
        else:
            out.append(Correction(channel, fault, value))
    return tuple(out)


def check_levels(
    toml: Toml, runs: tuple[RunFile, ...], channels: Mapping[str, ChannelSpec]
) -> None:
    """Note levels that a channel gives as well, and that some runs lack."""
    for name in dict.fromkeys(name for run in runs for name in run.levels):
        if name in channels:
            toml.error(
                ("channels", name),
                f"{name} is a channel and a level of runs: one of the two must go.",
            )
        lacking = [run.name for run in runs if name not in run.levels]
        if lacking:
            toml.error(("runs",), f"{', '.join(lacking)}: no {name}, which other runs have.")


def run_as_toml(run: RunFile) -> Any:
    """Return a run as a table of study.toml."""
    import tomlkit

    table = tomlkit.table()
    table.add("file", run.file)
    if run.piece:
        table.add("piece", run.piece)
    table.add("role", run.role)
    for name, level in run.levels.items():
        table.add(name, level)
        table[name].comment(PLAIN[name])
    for name in UNITS:
        if name in run.labels:
            table.add(name, run.labels[name])
            table[name].comment(UNITS[name])
    other = {name: value for name, value in run.labels.items() if name not in UNITS}
    if other:
        inline = tomlkit.inline_table()
        inline.update(other)
        table.add("labels", inline)
    if run.corrections:
        table.add("correct", corrections_as_toml(run.corrections))
    return table


def corrections_as_toml(corrections: Sequence[Correction]) -> Any:
    """Return corrections as a run's table holds them, one a line."""
    import tomlkit

    array = tomlkit.array()
    for one in corrections:
        inline = tomlkit.inline_table()
        inline.update(one._asdict())
        array.append(inline)
    return array.multiline(True)
