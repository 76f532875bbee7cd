"""study.toml: what was measured, which column is what, which run is for what."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from ..core.config import Document, Key, Spec, toml_content
from ..data.building_file import read_building
from ..data.channels import DRIVE, ChannelSpec, at_device
from ..data.files import write_whole
from ..data.labels import TEMPERATURE
from ..data.pieces import wrong_split
from ..errors import PhysicsError, StudyError
from ..findings import listed, written
from .channel_file import CHANNELS, EXTRA, channel_as_toml, read_channels, read_extra
from .run_file import (
    EXCLUDE,
    RUNS,
    TEST,
    RunFile,
    check_levels,
    read_runs,
    run_as_toml,
)

RIGS = ("bench", "structure")
CUT_OFF = 18.0
"""Low-pass of measured and predicted force [Hz], as in Shirazi et al. (2012), section III-C."""
ALL = "all"
"""The word for all laws."""


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

        Titles, labels, the order of runs, and runs for tests or left out do not count. Steps of
        older studies hold it: it stays as it is, and `data_digest` adds what it lacks.
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
    every = read_runs(document, found.pop("runs"), path.parent, bool(found["split"]))
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
    document.add("schema", tomlkit.item(1))
    document.add("title", tomlkit.item(settings.title))
    document.add("notes", tomlkit.item(settings.notes))
    document["notes"].comment("free text of the lab, shown in the report")
    document.add("rig", tomlkit.item(settings.rig))
    if settings.device:
        document.add("device", tomlkit.item(settings.device))
        document["device"].comment("of the building's: whose law and effects are identified")
    if settings.law:
        document.add("law", tomlkit.item(settings.law))
        document["law"].comment("sought with its effects; without this line the model's is kept")
    document.add("cut_off", tomlkit.item(settings.cut_off))
    document["cut_off"].comment("Hz, low-pass of the low-passed errors; 0 for none")
    if settings.rate:
        document.add("rate", tomlkit.item(settings.rate))
        document["rate"].comment("Hz, faster runs are decimated to it; 0 for none")
    if settings.mask:
        mask = tomlkit.item(True)  # read from the document it would be a bool, without comments
        document.add("mask", mask.comment("isolated spikes count as not measured"))
    if settings.split:
        document.add("split", tomlkit.item(settings.split))
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
