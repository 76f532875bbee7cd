"""study.toml: what was measured, which column is what, which run is for what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..data.channels import PLAIN, ChannelSpec, channel_unit, is_channel
from ..data.files import Toml, write_whole
from ..errors import RecordError, UnitError
from ..findings import unknown, written
from ..units import same_dimension

RIGS = ("bench", "structure")
TEST = "test"
"""The role of runs that no choice sees: neither a fit nor a verdict reads them."""

ROLES = ("train", "holdout", TEST)
CUT_OFF = 18.0
"""Low-pass of measured and predicted force [Hz], as in Shirazi et al. (2012), section III-C."""
_KEYS = ("schema", "title", "notes", "rig", "cut_off", "runs", "channels")
_CHANNEL_KEYS = ("column", "unit", "sign", "noise", "step")


@dataclass(frozen=True)
class RunFile:
    """One `[[runs]]`: the file, relative to the study, and its role, one of `ROLES`."""

    file: str
    role: str = "train"


@dataclass(frozen=True)
class Settings:
    """The content of study.toml.

    `cut_off` [Hz] of the low-pass on measured and predicted force, 0 for none.
    """

    title: str
    rig: str
    runs: tuple[RunFile, ...]
    channels: dict[str, ChannelSpec]
    notes: str = ""
    cut_off: float = CUT_OFF
    comments: dict[str, str] = field(default_factory=dict)

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
    toml = Toml(path)
    data = toml.data
    toml.schema()
    toml.known((), data, _KEYS)
    rig = toml.text((), data, "rig", "bench")
    if rig not in RIGS:
        toml.error(("rig",), f'rig = "{rig}"; "bench" or "structure" is right.')
    cut_off = toml.number((), data, "cut_off")
    if cut_off is not None and cut_off < 0.0:
        toml.error(("cut_off",), f"cut_off = {cut_off} Hz; 0 for none, or a positive number.")
    runs = _runs(toml, path.parent)
    channels = {
        name: _channel(toml, name, table)
        for name, table in toml.table((), data, "channels").items()
        if _is_right(toml, name, table)
    }
    title, notes = toml.text((), data, "title", path.parent.name), toml.text((), data, "notes")
    toml.check()
    return Settings(title, rig, runs, channels, notes, CUT_OFF if cut_off is None else cut_off)


def write_settings(path: Path, settings: Settings) -> None:
    """Write study.toml; the `comments` of channels stand above their tables."""
    import tomlkit

    document = tomlkit.document()
    document.add("schema", tomlkit.item(1))
    document.add("title", tomlkit.item(settings.title))
    document.add("notes", tomlkit.item(settings.notes))
    document["notes"].comment("free text of the lab, shown in the report")
    document.add("rig", tomlkit.item(settings.rig))
    document.add("cut_off", tomlkit.item(settings.cut_off))
    document["cut_off"].comment("Hz, low-pass on measured and predicted force; 0 for none")
    runs = tomlkit.aot()
    for run in settings.runs:
        table = tomlkit.table()
        table.update({"file": run.file, "role": run.role})
        runs.append(table)
    document.add("runs", runs)
    channels = tomlkit.table(is_super_table=True)
    for name, spec in settings.channels.items():
        table = tomlkit.table()
        for line in settings.comments.get(name, "").splitlines():
            table.add(tomlkit.comment(line))
        table.update(_as_toml(spec))
        channels.add(name, table)
    document.add("channels", channels)
    write_whole(path, tomlkit.dumps(document))


def _as_toml(spec: ChannelSpec) -> dict[str, Any]:
    if spec.step is not None:
        return {"step": spec.step}
    found: dict[str, Any] = {"column": spec.column, "unit": spec.unit, "sign": spec.sign}
    if spec.noise is not None:
        found["noise"] = spec.noise
    return found


def _runs(toml: Toml, folder: Path) -> tuple[RunFile, ...]:
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
        toml.known(keys, table, ("file", "role"))
        file, role = toml.text(keys, table, "file"), toml.text(keys, table, "role", "train")
        if role not in ROLES:
            toml.error((*keys, "role"), f'role = "{role}"; "train", "holdout" or "test" is right.')
        if not file:
            toml.error(keys, 'a run has no file; file = "data/run_1.csv" is right.')
        elif not (folder / file).is_file():
            toml.error((*keys, "file"), f"there is no file {folder / file}.")
        if any(file == run.file for run in out):
            toml.error((*keys, "file"), f"{file} is listed twice: one of the two must go.")
        out.append(RunFile(file, role))
    return tuple(out)


def _is_right(toml: Toml, name: str, table: Any) -> bool:
    keys = ("channels", name)
    if not is_channel(name):
        toml.error(keys, unknown("channel", name, PLAIN))
        return False
    if not isinstance(table, dict):
        toml.error(keys, f'is {written(table)}; a table with column = "..." is right.')
        return False
    return True


def _channel(toml: Toml, name: str, table: Mapping[str, Any]) -> ChannelSpec:
    keys = ("channels", name)
    toml.known(keys, table, _CHANNEL_KEYS)
    column, unit = toml.text(keys, table, "column"), toml.text(keys, table, "unit")
    step = toml.number(keys, table, "step")
    if step is not None and name != "time":
        toml.error((*keys, "step"), "step belongs to [channels.time] alone.")
    if not column and step is None:
        toml.error(keys, 'column is missing: the title of the column, as in column = "F_kN".')
    if unit:
        try:
            if not same_dimension(unit, channel_unit(name)):
                right = channel_unit(name)
                toml.error((*keys, "unit"), f'unit = "{unit}": {name} is in {right} or the like.')
        except (UnitError, RecordError) as error:
            toml.error((*keys, "unit"), str(error))
    sign = table.get("sign", 1)
    if sign not in (1, -1) or isinstance(sign, bool):
        toml.error((*keys, "sign"), f"sign = {written(sign)}; 1 or -1 is right.")
        sign = 1
    noise = toml.number(keys, table, "noise")
    if noise is not None and noise < 0.0:
        toml.error((*keys, "noise"), f"noise = {noise}; a standard deviation is not negative.")
    return ChannelSpec(column, unit, int(sign), noise, step)
