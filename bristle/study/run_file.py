"""`[[runs]]` of study.toml: a file, what it is for, and what is known of the whole run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.config import Document, Key, Spec
from ..core.toml_lines import KeyPath
from ..data.channels import DRIVE, PLAIN, ChannelSpec, device_channel, is_channel
from ..data.command_limits import LIMITS
from ..data.corrections import FAULTS, Correction, wrong_value
from ..data.labels import UNITS, Label
from ..errors import StudyError
from ..findings import unknown, written

TEST = "test"
"""The role of runs that no choice sees: neither a fit nor a verdict reads them."""

ROLES = ("train", "holdout", TEST)
"""The roles of runs that are read."""

EXCLUDE = "exclude"
"""The role of runs that are left out: nothing reads them."""


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


def read_runs(
    document: Document, runs: Sequence[Mapping[str, Any]], folder: Path, split: bool
) -> tuple[RunFile, ...]:
    """Return the runs of a study.toml; what no spec says of them is checked.

    Parameters
    ----------
    document, runs : takes what is wrong; the tables
    folder : where the files of runs are
    split : whether a file holds several runs
    """
    if not runs:
        words = 'there are no runs: expected [[runs]] with file = "data/run_1.csv".'
        document.error(("runs",), words)
    out: list[RunFile] = []
    for index, table in enumerate(runs):
        keys, file, piece = ("runs", index), table["file"], table["piece"]
        if file and not (folder / file).is_file():
            document.error((*keys, "file"), f"there is no file {folder / file}.")
        if split != bool(piece):
            right = "piece = 1 is its first run" if split else 'split = "restart" must stand above'
            document.error(keys, f"split and piece go together: {right}.")
        labels = {name: table[name] for name in UNITS if table[name] is not None}
        made = RunFile(
            file or "", table["role"],
            {name: table[name] for name in DRIVE if table[name] is not None},
            {**labels, **_labels(document, keys, table)}, piece,
            _corrections(document, keys, table),
        )  # fmt: skip
        if any(made.name == run.name for run in out):
            words = f"{made.name} is listed twice: one of the two must go."
            document.error((*keys, "file"), words)
        out.append(made)
    return tuple(out)


def _label(value: object) -> Label:
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise StudyError(f"= {written(value)}: expected a number or a word.")
    return float(value)


RUNS = Spec({
    "file": Key(str, about='as in file = "data/run_1.csv"'),
    "piece": Key(int, 0, least=1, about="1 is a file's first run"),
    "role": Key(str, "train", choices=(*ROLES, EXCLUDE)),
    **{name: Key(float, None, PLAIN[name]) for name in DRIVE},
    **{name: Key(float, None, unit) for name, unit in UNITS.items()},
    "labels": Spec(each=Key(_label, "")),
    "correct": Spec({
        "channel": Key(str), "fault": Key(str, choices=FAULTS), "value": Key(float, None),
    }, many=True, about='[{ channel = "force", fault = "gain", value = 1.25 }]'),
}, many=True)  # fmt: skip
"""`[[runs]]` of study.toml."""


def _labels(document: Document, keys: KeyPath, table: Mapping[str, Any]) -> dict[str, Label]:
    """Return the labels in a run's table `labels`."""
    for name in (name for name in table["labels"] if name in (*DRIVE, *UNITS)):
        words = f"{name} stands beside file and role, not in labels."
        document.error((*keys, "labels", name), words)
    return dict(table["labels"])


def _corrections(
    document: Document, keys: KeyPath, table: Mapping[str, Any]
) -> tuple[Correction, ...]:
    """Return what a run's table sets right in its channels."""
    out = []
    for index, one in enumerate(table["correct"]):
        here, (channel, fault, value) = (*keys, "correct", index), one.values()
        if channel is None or fault is None:
            continue  # which is said already
        if not (is_channel(channel) or device_channel(channel)):
            document.error(here, unknown("channel", channel, PLAIN))
        elif value is None:
            document.error(here, f"{fault} has no value: expected {FAULTS[fault]}.")
        elif fault in LIMITS and channel not in DRIVE:
            words = f"{fault} is of a command ({', '.join(DRIVE)}), not of {channel}."
            document.error(here, words)
        elif wrong := wrong_value(fault, value):
            document.error(here, f"{fault} = {written(value)}: {wrong}")
        else:
            out.append(Correction(channel, fault, value))
    return tuple(out)


def check_levels(
    document: Document, runs: tuple[RunFile, ...], channels: Mapping[str, ChannelSpec]
) -> None:
    """Note levels that a channel gives as well, and that some runs lack."""
    for name in dict.fromkeys(name for run in runs for name in run.levels):
        if name in channels:
            document.error(
                ("channels", name),
                f"{name} is a channel and a level of runs: one of the two must go.",
            )
        lacking = [run.name for run in runs if name not in run.levels]
        if lacking:
            document.error(("runs",), f"{', '.join(lacking)}: no {name}, which other runs have.")


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
