"""The tables [channels.NAME] and [extra.NAME] of study.toml: where each channel is in the files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..data.channels import PLAIN, ChannelSpec, channel_unit, device_channel, is_channel
from ..data.extra import refused_name
from ..data.files import Toml
from ..errors import RecordError, UnitError
from ..findings import unknown, written
from ..units import same_dimension

_CHANNEL_KEYS = ("column", "unit", "sign", "noise", "step")
_EXTRA_KEYS = ("column", "unit", "sign")


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


def is_right_channel(toml: Toml, name: str, table: Any, of_devices: bool = False) -> bool:
    """Return whether there is a channel of a name and it has a table; else note what is wrong.

    Parameters
    ----------
    toml, name, table : the file, the channel, and what stands there
    of_devices : whether it may be of a device of a building; whether there is one of that name is
        asked where the building is known
    """
    keys = ("channels", name)
    if not (is_channel(name) or (of_devices and device_channel(name))):
        besides = f"Any other channel goes into [extra.{name}]."
        toml.error(keys, f"{unknown('channel', name, PLAIN)} {besides}")
        return False
    if not isinstance(table, dict):
        toml.error(keys, f'is {written(table)}; a table with column = "..." is right.')
        return False
    return True


def read_extra(toml: Toml, name: str, table: Any) -> ChannelSpec:
    """Return where an extra channel is; its unit may be any, known or not."""
    keys = ("extra", name)
    if wrong := refused_name(name):
        toml.error(keys, f'an extra channel cannot be called "{name}": {wrong}.')
    if not isinstance(table, dict):
        toml.error(keys, f'is {written(table)}; a table with column = "..." is right.')
        return ChannelSpec()
    toml.known(keys, table, _EXTRA_KEYS)
    column, unit = toml.text(keys, table, "column"), toml.text(keys, table, "unit")
    if not column:
        toml.error(keys, 'column is missing: the title of the column, as in column = "p [bar]".')
    if not unit:
        toml.error(keys, 'unit is missing: that of the column, or "1" for a plain number.')
    return ChannelSpec(column, unit, _sign(toml, keys, table))


def _sign(toml: Toml, keys: tuple[str, ...], table: Mapping[str, Any]) -> int:
    """Return the sign that a channel's values are multiplied with."""
    sign = table.get("sign", 1)
    if sign not in (1, -1) or isinstance(sign, bool):
        toml.error((*keys, "sign"), f"sign = {written(sign)}; 1 or -1 is right.")
        return 1
    return int(sign)


def read_channel(toml: Toml, name: str, table: Mapping[str, Any]) -> ChannelSpec:
    """Return where a channel is, as its table says; what is wrong with it is noted."""
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
    sign = _sign(toml, keys, table)
    noise = toml.number(keys, table, "noise")
    if noise is not None and noise < 0.0:
        toml.error((*keys, "noise"), f"noise = {noise}; a standard deviation is not negative.")
    return ChannelSpec(column, unit, sign, noise, step)
