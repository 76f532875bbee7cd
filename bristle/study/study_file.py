"""study.toml: what was measured, which column is what, which run is for what."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.config import Document, Key, Spec, toml_content
from ..core.files import write_whole
from ..core.text import listed, unknown, written
from ..core.toml_lines import KeyPath
from ..data.building_file import read_building
from ..data.channels import (
    DRIVE,
    PLAIN,
    TEMPERATURE,
    UNITS,
    ChannelSpec,
    Label,
    at_device,
    channel_unit,
    device_channel,
    is_channel,
)
from ..data.corrections import FAULTS, LIMITS, Correction, after, wrong_value
from ..data.extra_channels import refused_name
from ..data.pieces import holds_several, wrong_split
from ..errors import PhysicsError, RecordError, StudyError, UnitError
from ..units import same_dimension

# The tables [channels.NAME] and [extra.NAME] of study.toml: where each channel is in the files.


def _sign(value: object) -> int:
    if value not in (1, -1) or isinstance(value, bool):
        raise StudyError(f"= {written(value)}: expected 1 or -1.")
    return int(value)


CHANNELS = Spec(
    each=Spec({
        "column": Key(str, ""), "unit": Key(str, ""), "sign": Key(_sign, 1),
        "noise": Key(float, None, least=0.0, about="its standard deviation"),
        "step": Key(float, None, "s"),
        "zero": Key(float, 0.0, about="what the column reads where the channel is 0"),
    })
)  # fmt: skip
"""`[channels.NAME]` of study.toml."""
EXTRA = Spec(
    each=Spec({
        "column": Key(str, about='the title of the column, as in column = "p [bar]"'),
        "unit": Key(str, about='that of the column, or "1" for a plain number'),
        "sign": Key(_sign, 1),
    })
)  # fmt: skip
"""`[extra.NAME]` of study.toml; its unit may be any, known or not."""


def channel_as_toml(spec: ChannelSpec) -> dict[str, Any]:
    """Return the table of a channel as study.toml holds it."""
    if spec.step is not None:
        return {"step": spec.step}
    found: dict[str, Any] = {"column": spec.column, "unit": spec.unit, "sign": spec.sign}
    if spec.noise is not None:
        found["noise"] = spec.noise
    if spec.zero:
        found["zero"] = spec.zero
    return found


def spec_text(spec: ChannelSpec | None) -> str:
    """Return where a channel is, in a few words."""
    if spec is None:
        return "not read"
    if spec.step is not None:
        return f"a step of {spec.step:g} s"
    unit = f" in {spec.unit}" if spec.unit else ""
    return f'"{spec.column}"{unit}{", sign turned" if spec.sign < 0 else ""}'


def read_channels(
    document: Document, channels: dict[str, Any], devices: bool
) -> dict[str, ChannelSpec]:
    """Return where the channels are, as their tables say; what no spec says of them is checked.

    Parameters
    ----------
    document, channels : takes what is wrong; the tables by name
    devices : whether they may be of a device of a building; whether there is one of that name is
        asked where the building is known
    """
    out = {}
    for name, table in channels.items():
        keys = ("channels", name)
        if not (is_channel(name) or (devices and device_channel(name))):
            besides = f"Any other channel goes into [extra.{name}]."
            document.error(keys, f"{unknown('channel', name, PLAIN)} {besides}")
            continue
        if table["step"] is not None and name != "time":
            document.error((*keys, "step"), "step belongs to [channels.time] alone.")
        if not table["column"] and table["step"] is None:
            right = 'expected the title of the column, as in column = "F_kN"'
            document.error(keys, f"[channels.{name}] column is missing: {right}.")
        try:
            unit, right = table["unit"], channel_unit(name)
            if unit and not same_dimension(unit, right):
                words = f'unit = "{unit}": expected {right} or the like, which {name} is in.'
                document.error((*keys, "unit"), words)
        except (UnitError, RecordError) as error:
            document.error((*keys, "unit"), str(error))
        out[name] = ChannelSpec(**table)
    return out


def read_extra(document: Document, channels: dict[str, Any]) -> dict[str, ChannelSpec]:
    """Return where extra channels are, as their tables say; takes what `read_channels` takes."""
    for name in channels:
        if wrong := refused_name(name):
            document.error(("extra", name), f'an extra channel cannot be called "{name}": {wrong}.')
    return {name: ChannelSpec(**table) for name, table in channels.items()}


# `[[runs]]` of study.toml: a file, what it is for, and what is known of the whole run.

TEST = "test"
"""The role of runs that no choice sees: neither a fit nor a verdict reads them."""

ROLES = ("train", "holdout", TEST)
"""The roles of runs that are read."""

EXCLUDE = "exclude"
"""The role of runs that are left out: nothing reads them."""


Place = tuple[str, int]
"""A run's file and its number there, from 1; 0 in a file that holds one."""


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
    def place(self) -> Place:
        """Where it is."""
        return self.file, self.piece

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


RIGS = ("bench", "structure")
CUT_OFF = 18.0
"""Low-pass of measured and predicted force [Hz], as in Shirazi et al. (2012), section III-C."""
ALL = "all"
"""The word for all laws, or all forms of the command."""


@dataclass(frozen=True)
class Settings:
    """The content of study.toml.

    `cut_off` [Hz] of the low-pass on measured and predicted force, 0 for none; `rate` [Hz] to which
    runs that are sampled faster are decimated, 0 for none; `mask` whether isolated spikes count as
    not measured; `split` how files hold several runs, "" where they hold one (`data.pieces`);
    `law` "all" where the law is sought together with its effects, "" where the model's is kept;
    `excluded` the runs that are left out, which are none of `runs`; `extra` the channels besides
    those that bristle knows; `device` the one of the building's that the study is about, "" for the
    damper on the first level. As read, the channels of that device are `force` and `voltage`.
    """

    title: str
    rig: str
    runs: tuple[RunFile, ...]
    channels: dict[str, ChannelSpec]
    notes: str = ""
    cut_off: float = CUT_OFF
    comments: dict[str, str] = field(default_factory=dict)
    rate: float = 0.0
    mask: bool = False
    split: str = ""
    law: str = ""
    excluded: tuple[RunFile, ...] = ()
    extra: dict[str, ChannelSpec] = field(default_factory=dict)
    device: str = ""

    @property
    def drive(self) -> str:
        """The channel that commands the damper, "" where none was measured."""
        there = {at_device(name, self.device) for name in self.channels}
        there |= {name for run in self.runs for name in run.levels}
        return next((name for name in DRIVE if name in there), "")

    @property
    def beside(self) -> tuple[str, ...]:
        """The channels that no fit needs, and on which an error may depend."""
        warm = (TEMPERATURE,) if TEMPERATURE in self.channels else ()
        return (*self.extra, *warm)

    @property
    def excluded_text(self) -> str:
        """The sentence that tells which runs are left out, "" where none is."""
        names = listed(run.name for run in self.excluded)
        return f'Left out by role = "{EXCLUDE}" in study.toml: {names}.' if names else ""

    @property
    def data(self) -> str:
        """A digest of the runs that a fit and its judge see, corrected, and of how they are read.

        Titles, labels, the order of runs, and runs for tests or left out do not count;
        `data_digest` adds what it lacks.
        """
        runs = sorted(
            [run.name, run.role, sorted(run.levels.items()), [[*one] for one in run.corrections]]
            for run in self.runs
            if run.role != TEST
        )
        channels = {name: channel_as_toml(spec) for name, spec in self.channels.items()}
        seen = [runs, channels, self.device, self.cut_off, self.rate, self.mask, self.split]
        return sha256(json.dumps(seen, sort_keys=True).encode()).hexdigest()[:16]

    @property
    def has_building(self) -> bool:
        """Whether a building was measured with its damper; else a damper on a test bench."""
        return self.rig == "structure"


def read_settings(path: Path) -> Settings:
    """Return the settings in a study.toml.

    Raises
    ------
    StudyError
        With every mistake of the file and its line.
    """
    document = Document(path, StudyError)
    found = document.read(_SPEC)
    rig, device = found.pop("rig"), found.pop("device")
    if device and rig == RIGS[0]:
        words = 'device goes with rig = "structure": it is one of a building\'s.'
        document.error(("device",), words)
    every = read_runs(document, found.pop("runs"), path.parent, holds_several(str(found["split"])))
    runs = tuple(run for run in every if run.role != EXCLUDE)
    excluded = tuple(run for run in every if run.role == EXCLUDE)
    if every and not runs:
        words = f'every run has role = "{EXCLUDE}": some for training are needed.'
        document.error(("runs",), words)
    channels = read_channels(document, found.pop("channels"), devices=rig != RIGS[0])
    if rig != RIGS[0] and not device:
        device = only_device(path.parent)
    channels = _at_device(document, channels, device)
    extra = read_extra(document, found.pop("extra"))
    check_levels(document, runs, channels)
    document.check()
    found["title"] = path.parent.name if found["title"] is None else found["title"]
    del found["schema"]
    return Settings(
        rig=rig, runs=runs, channels=channels, excluded=excluded, extra=extra, device=device,
        **found,
    )  # fmt: skip


def _law(value: object) -> str:
    if value not in ("", ALL):
        right = f'"{ALL}", which seeks the law; without this line that of model.toml is kept'
        raise StudyError(f"= {written(value)}: expected {right}.")
    return str(value)


def _split(value: object) -> str:
    if value != "" and (wrong := wrong_split(str(value))):
        raise StudyError(f"= {written(value)}: {wrong}")
    return str(value)


_SPEC = Spec({
    "title": Key(str, None), "notes": Key(str, ""), "rig": Key(str, RIGS[0], choices=RIGS),
    "device": Key(str, ""),
    "law": Key(_law, ""),
    "cut_off": Key(float, CUT_OFF, "Hz", least=0.0, about="0 for none"),
    "rate": Key(float, 0.0, "Hz", least=0.0, about="0 for none"),
    "mask": Key(bool, False), "split": Key(_split, ""),
    "runs": RUNS, "channels": CHANNELS, "extra": EXTRA,
})  # fmt: skip


@contextmanager
def draft_of(path: Path, text: str) -> Iterator[Path]:
    """Write another text of a study.toml as a draft, which takes its place if nothing is raised."""
    draft = path.with_name(".study.toml")
    try:
        write_whole(draft, text)
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def read_draft(draft: Path, path: Path) -> Settings:
    """Return the settings in a draft of a study.toml; what is wrong is told of the file itself.

    Parameters
    ----------
    draft : in the folder of the study
    path : of study.toml
    """
    try:
        return read_settings(draft)
    except StudyError as error:
        raise StudyError(str(error).replace(str(draft), str(path))) from None


def only_device(folder: Path) -> str:
    """Return the device of a study's building where it has one alone, else "".

    Parameters
    ----------
    folder : the study's; what is wrong with its model or building is told where they are asked for
    """
    try:
        building = toml_content(folder / "model.toml").get("building")
        devices = read_building(folder / str(building)).devices
    except PhysicsError:
        return ""
    return devices[0].name if len(devices) == 1 else ""


def _at_device(
    document: Document, channels: Mapping[str, ChannelSpec], device: str
) -> dict[str, ChannelSpec]:
    """Return the channels with those of the study's device by the names of the one damper."""
    out: dict[str, ChannelSpec] = {}
    for name, spec in channels.items():
        other = at_device(name, device)
        if other in out or (other != name and other in channels):
            document.error(
                ("channels", name),
                f"{name} and {other} are both of the device {device!r}, which the study is about: "
                "one of the two must go.",
            )
        out[other] = spec
    return out


def write_settings(path: Path, settings: Settings) -> None:
    """Write study.toml; the `comments` of channels stand above their tables."""
    import tomlkit

    document = tomlkit.document()
    for key, value, comment in (
        ("schema", 1, ""), ("title", settings.title, ""),
        ("notes", settings.notes, "free text of the lab, shown in the report"),
        ("rig", settings.rig, ""),
        ("device", settings.device, "of the building's: whose law and effects are identified"),
        ("law", settings.law, "sought with its effects; without this line the model's is kept"),
        ("cut_off", settings.cut_off, "Hz, low-pass of the low-passed errors; 0 for none"),
        ("rate", settings.rate, "Hz, faster runs are decimated to it; 0 for none"),
        ("mask", settings.mask, "isolated spikes count as not measured"),
        ("split", settings.split, ""),
    ):  # fmt: skip
        if value or key in ("title", "notes", "cut_off"):
            item: Any = tomlkit.item(value)
            document.add(key, item.comment(comment) if comment else item)
    runs = tomlkit.aot()
    for run in (*settings.runs, *settings.excluded):
        runs.append(run_as_toml(run))
    document.add("runs", runs)
    for key, specs in (("channels", settings.channels), ("extra", settings.extra)):
        channels = tomlkit.table(is_super_table=True)
        for name, spec in specs.items():
            table = tomlkit.table()
            for line in settings.comments.get(name, "").splitlines():
                table.add(tomlkit.comment(line))
            table.update(channel_as_toml(spec))
            channels.add(name, table)
        if specs:
            document.add(key, channels)
    write_whole(path, tomlkit.dumps(document))


# The text of a study.toml with one thing changed, and all else as its user wrote it.


def with_mask(text: str) -> str:
    """Return the text of a study.toml with `mask = true`, all else as it was."""
    import tomlkit

    document = tomlkit.parse(text)
    if "mask" in document:
        document["mask"] = True
        return tomlkit.dumps(document)
    # Above the first key or below the schema: further down a line may be part of a longer text.
    lines = text.split("\n")
    keys = (k for k, line in enumerate(lines) if line.strip() and line.lstrip()[0] != "#")
    first = next(keys, len(lines))
    first += "".join(lines[first : first + 1]).startswith("schema")
    line = "mask = true # isolated spikes count as not measured"
    return "\n".join([*lines[:first], line, *lines[first:]])


def _place_of(table: Mapping[str, Any]) -> Place:
    return table["file"], table.get("piece", 0)


def with_roles(text: str, roles: Mapping[Place, str]) -> str:
    """Return the text of a study.toml with other roles of runs, all else as it was.

    Parameters
    ----------
    text : of the file
    roles : by the place of the run
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    for table in document["runs"]:
        role = roles.get(_place_of(table))
        if role is not None:
            before = table.get("role", "train")
            table["role"] = role
            if EXCLUDE == role != before:
                table["role"].comment(f"was {before}")
    return tomlkit.dumps(document)


def with_runs(text: str, runs: Sequence[RunFile]) -> str:
    """Return the text of a study.toml with more runs after its own, all else as it was."""
    import tomlkit

    document: Any = tomlkit.parse(text)
    for run in runs:
        table = run_as_toml(run)
        table.add(tomlkit.nl())
        document["runs"].append(table)
    return tomlkit.dumps(document)


def with_corrections(text: str, found: Mapping[Place, Sequence[Correction]]) -> str:
    """Return the text of a study.toml with more corrections of runs, all else as it was.

    Parameters
    ----------
    text : of the file
    found : corrections by the place of the run
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    for table in document["runs"]:
        corrections = found.get(_place_of(table))
        if corrections is None:
            continue
        known = [Correction(**one) for one in table.unwrap().get("correct", [])]
        table["correct"] = corrections_as_toml([*known, *after(known, corrections)])
    return tomlkit.dumps(document)


def with_channels(
    text: str,
    channels: Mapping[str, ChannelSpec | None],
    extra: Mapping[str, ChannelSpec | None],
    corrections: Mapping[Place, Sequence[Correction]],
    device: str = "",
) -> str:
    """Return the text of a study.toml with channels read in another way, all else as it was.

    Comments in the tables of these channels told why they were read as they were: they go.

    Parameters
    ----------
    text : of the file
    channels, extra : where a channel is from now on, None for those that are no longer read
    corrections : those that are left, by the places of the runs that lose some
    device : the one that the study is about: its brace_force is called force
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    own = {at_device(name, device): name for name in document["channels"]}
    for key, specs in (("channels", channels), ("extra", extra)):
        for name, spec in specs.items():
            place = own.get(name, name) if key == "channels" else name
            if spec is None:
                document[key].remove(place)
                continue
            if key not in document:
                document.add(key, tomlkit.table(is_super_table=True))
            table = tomlkit.table()
            if key == "channels":
                table.add(tomlkit.comment("given"))
            table.update(channel_as_toml(spec))
            table.add(tomlkit.nl())
            document[key][place] = table
    for table in document["runs"]:
        left = corrections.get(_place_of(table))
        if left:
            table["correct"] = corrections_as_toml(left)
        elif left is not None:
            table.remove("correct")
    return tomlkit.dumps(document).rstrip("\n") + "\n"
