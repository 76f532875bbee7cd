"""The tables [channels.NAME] and [extra.NAME] of study.toml: where each channel is in the files."""

from __future__ import annotations

from typing import Any

from ..core.config import Document, Key, Spec
from ..data.channels import PLAIN, ChannelSpec, channel_unit, device_channel, is_channel
from ..data.extra import refused_name
from ..errors import RecordError, StudyError, UnitError
from ..findings import unknown, written
from ..units import same_dimension


def _sign(value: object) -> int:
    if value not in (1, -1) or isinstance(value, bool):
        raise StudyError(f"= {written(value)}: expected 1 or -1.")
    return int(value)


CHANNELS = Spec(
    each=Spec({
        "column": Key(str, ""), "unit": Key(str, ""), "sign": Key(_sign, 1),
        "noise": Key(float, None, least=0.0, about="its standard deviation"),
        "step": Key(float, None, "s"),
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
