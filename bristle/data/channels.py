"""The channels of a measurement, their names and units; labels of whole runs."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple, TypeAlias

import numpy as np

from ..core.arrays import Array
from ..core.text import plain
from ..core.text import quantity as quantity_text
from ..errors import RecordError, UnitError
from ..physics.drive import DRIVES
from ..units import canonical, parse

# What is known of a run as a whole: its temperature, frequency, amplitude, the batch of oil.
#
# A label is a number or a word. Those with a name that is known have a unit.

Label: TypeAlias = float | str
Labels: TypeAlias = Mapping[str, Label]

UNITS = {"temperature": "degC", "frequency": "Hz", "amplitude": "m"}
"""Labels that have a unit, in which study.toml gives them."""


TEMPERATURE = "temperature"
"""The label that is a channel's mean where a run has one of that name."""


def mean_temperature(values: Array) -> tuple[float | None, str]:
    """Return the mean of a temperature (n,) [degC] over a run, None without any, and a note of it.

    A slow logger leaves fields empty: they do not count. Tenths of a kelvin are what a sensor
    knows.
    """
    known = values[np.isfinite(values)]
    if not known.size:
        return None, "temperature: no value in the whole run"
    mean, low, high = (round(float(one), 1) for one in (known.mean(), known.min(), known.max()))
    return mean, f"temperature: {mean:g} °C, the mean of the run, from {low:g} to {high:g} °C"


def label_text(name: str, value: Label, unit: str = "") -> str:
    """Return a label's value as people write it: "40 °C", "10 mm", "batch B".

    Parameters
    ----------
    name : of the label
    value : its value
    unit : its unit, where it is none of `UNITS`: that of a command's level
    """
    if isinstance(value, str):
        return value
    unit = unit or label_unit(name)
    if unit == "degC":
        return f"{plain(value, 4)} °C"
    return quantity_text(value, unit or "1", 4)


def label_unit(name: str) -> str:
    """Return the unit of a label: its own, or that in which its name ends, as in pressure_psi."""
    own = UNITS.get(name, "")
    if own or "_" not in name:
        return own
    try:
        return canonical(name.rpartition("_")[2])
    except UnitError:
        return ""


def label_name(name: str) -> str:
    """Return a label as it stands in a sentence, without its unit: "pressure" of pressure_psi."""
    plain_name = name if name in UNITS or not label_unit(name) else name.rpartition("_")[0]
    return plain_name.replace("_", " ")


def varying(labels: Sequence[Labels]) -> list[str]:
    """Return the labels that every one has, and that are not the same for all."""
    if not labels:
        return []
    shared = [name for name in labels[0] if all(name in one for one in labels)]
    return [name for name in shared if len({one[name] for one in labels}) > 1]


PLAIN = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s2",
    "force": "N",
    **{drive.name: drive.unit for drive in DRIVES.values()},
    "ground_acceleration": "m/s2",
    "holding_force": "N",
    TEMPERATURE: "degC",
}
"""Channels with their SI units; those of the levels of a structure come on top."""

DRIVE = tuple(DRIVES)
"""Channels that command a damper, each with its unit in `physics.drive`."""

OF_DEVICE = ("force", *DRIVE)
"""What is measured at a device of a building, each after its name: brace_force, brace_voltage."""

_DEVICE = re.compile(rf"([a-z][a-z0-9_]*)_({'|'.join(OF_DEVICE)})")
_LEVEL = re.compile(r"(base|floor[1-9]\d?)_(displacement|velocity|acceleration_absolute)")
_DRIFT = re.compile(r"drift[1-9]\d?")

MOTION = ("displacement", "velocity", "acceleration")


def is_channel(name: str) -> bool:
    """Return whether there is a channel of this name."""
    return name in PLAIN or bool(_LEVEL.fullmatch(name) or _DRIFT.fullmatch(name))


def device_channel(name: str) -> tuple[str, str] | None:
    """Return the device and the quantity of a channel such as brace_force; None for others.

    Whether a building has a device of that name is known where there is a building.
    """
    match = None if is_channel(name) else _DEVICE.fullmatch(name)
    return (match[1], match[2]) if match else None


def at_device(name: str, device: str) -> str:
    """Return what a channel of a device is called where the device is the one that is identified.

    Parameters
    ----------
    name : of the channel
    device : the one that is identified; its brace_force is `force`, all others stay as they are
    """
    found = device_channel(name)
    return found[1] if found and found[0] == device else name


def no_device(channel: str, devices: Sequence[str]) -> str:
    """Return why a channel of a device is none, "" where it is one or is of no device.

    Parameters
    ----------
    channel : its name
    devices : names of the devices that the building has
    """
    found = device_channel(channel)
    if found is None or found[0] in devices:
        return ""
    if not devices:
        return f'there is no channel "{channel}", for no building has devices here'
    return f'{channel}: there is no device "{found[0]}"; there are {", ".join(devices)}'


def is_smooth(channel: str) -> bool:
    """Return whether a channel never jumps: a displacement, velocity or drift, not a force."""
    return channel.endswith(("displacement", "velocity")) or channel.startswith("drift")


def channel_unit(channel: str) -> str:
    """Return the SI unit of a channel.

    Raises
    ------
    RecordError
        If there is no such channel, with the nearest that is.
    """
    if channel in PLAIN:
        return PLAIN[channel]
    level = _LEVEL.fullmatch(channel)
    if level:
        return PLAIN[level[2].removesuffix("_absolute")]
    if _DRIFT.fullmatch(channel):
        return "m"
    if found := device_channel(channel):
        return PLAIN[found[1]]
    names = [*PLAIN, *(f"base_{one}" for one in (*MOTION[:2], "acceleration_absolute"))]
    names += ["floor1_displacement", "floor1_velocity", "floor1_acceleration_absolute", "drift1"]
    close = get_close_matches(channel, names, n=1, cutoff=0.5)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    raise RecordError(f'there is no channel "{channel}".{hint} There are: {", ".join(names)}, ...')


def in_unit(channel: str, column: str) -> str:
    """Return the option that tells the unit of a column; it names none, which may be wrong."""
    right = channel_unit(channel)
    return f'--channel "{channel}={column}@UNIT", where UNIT is what it is in, such as {right}'


class Meaning(NamedTuple):
    """What a column's name says: a quantity such as "force" and the words it is told by.

    `place` is "" for the damper, "ground", "base", or "floor2"; `number` a bare number in the name;
    `rank` tells how well the name fits, 0 for a quantity that a damper's model does not use.
    """

    quantity: str
    place: str
    number: int | None
    rank: int


_QUANTITIES = {
    "time": "time t zeit tempo temps tiempo timestamp elapsed zeitstempel clock micros millis tijd "
    "czas tid zaman время 时间 時間",
    "displacement": "displacement disp displ displac x position pos stroke weg hub lvdt travel "
    "deslocamento posicao curso auslenkung deflection extension crosshead d y s piston desloc "
    "deplacement course spostamento corsa desplazamiento verplaatsing przemieszczenie posun "
    "forskjutning forskydning wegaufnehmer kolbenweg ход 位移 変位 перемещение",
    "velocity": "velocity vel v speed geschwindigkeit velocidade vitesse velo rate vp xdot xd dx "
    "velocita velocidad snelheid predkosc hastighet скорость 速度",
    "acceleration": "acceleration acc accel a beschleunigung aceleracao acel xddot xdd ddx accn "
    "accelerazione aceleracion versnelling przyspieszenie ускорение 加速度",
    "force": "force f load kraft forca fd last fuerza loadcell effort kraftaufnehmer fdamper "
    "kraftmessdose forza carga kracht siła sila kuvvet сила усилие 力 荷重",
    "voltage": "voltage volt volts u spannung tensao coilvoltage vcoil uc tension voltaje tensione "
    "spanning napiecie напряжение 电压 電圧",
    "current": "current i strom corrente courant amp amps ampere amperage icoil corriente "
    "stroom prad ток 电流 電流",
    "duty": "duty pwm dutycycle tastgrad",
    "field": "field flux magnetic fluxdensity feld flussdichte bfield",
    "drift": "drift interstory interstorey",
}
_BY_WORD = {word: kind for kind, words in _QUANTITIES.items() for word in words.split()}
_SINGLE = {"v": ("velocity", "voltage"), "u": ("voltage", "displacement")}
_PLACES = {
    "ground": "ground table shaketable gr g boden input soil tisch excitation",
    "base": "base isolator isolation isol slab layer bearing basis",
    "floor": "floor storey story level fl roof stockwerk etage andar",
    "damper": "damper mr fluid friction rod dampfer amortecedor coil measured meas",
    "other": "normal axial spring preload holding extra command cmd set setpoint soll ref "
    "reference desired demand target vertical lateral temperature torque",
    "sensed": "temperature temp temperatur temperatura thermocouple thermoelement termopar tc "
    "pt100 pressure druck pression presion pressao torque drehmoment strain dehnung humidity "
    "feuchte accelerometer gauge dms",  # commands nothing, whatever unit its signal has
    "commanding": "coil damper mr mrf cmd command set setpoint soll ref reference desired demand "
    "target drive",
}
_GROUND, _BASE, _FLOOR, _DAMPER, _OTHER, _SENSED, _COMMANDING = (
    frozenset(ws.split()) for ws in _PLACES.values()
)
_KNOWN = frozenset().union(_BY_WORD, _GROUND, _BASE, _FLOOR, _DAMPER, _OTHER)


def meaning(name: str, unit: str | None) -> Meaning | None:
    """Return what a column's name says, or None if it says nothing that is known.

    Parameters
    ----------
    name : str
        The name without its unit: "ground_acc", "DamperForce", "acc1_abs", "damper.force".
    unit : str or None
        Its unit where there is one; it settles "v" and "u" and overrules no clear word.
    """
    words = _words(name)
    quantity = _quantity(words, unit)
    if quantity is None:
        return None
    number = next((int(word) for word in words if word.isdigit()), None)
    place = ""
    if _GROUND & set(words[:-1] if len(words) > 1 else ()):
        place = "ground"
    elif _BASE & set(words):
        place = "base"
    elif _FLOOR & set(words) and number is not None:
        place = f"floor{number}"
    rank = 2 + bool(_DAMPER & set(words)) + (name.lower() in PLAIN)
    return Meaning(quantity, place, number, 0 if _OTHER & set(words) else rank)


def of_a_sensor(name: str) -> bool:
    """Return whether a column is called by what is measured and commands nothing, as a pressure."""
    return bool(_SENSED & set(_words(name)))


def of_a_drive(name: str) -> bool:
    """Return whether a column is called by what commands a damper, in no words of a quantity."""
    return bool(_COMMANDING & set(_words(name)))


def quantity_of_unit(unit: str | None) -> str | None:
    """Return the quantity that a unit alone tells, None if it tells none."""
    if not unit:
        return None
    dimension = parse(unit).dimension
    if parse(unit).name == PLAIN["duty"]:
        return "duty"  # any other number without a unit is no duty cycle
    for quantity in ("time", *MOTION, "force", "voltage", "current", "field"):
        if parse(PLAIN[quantity]).dimension == dimension:
            return quantity
    return None


def _quantity(words: list[str], unit: str | None) -> str | None:
    by_unit = quantity_of_unit(unit)
    found = [_BY_WORD[word] for word in words if word in _BY_WORD]
    for word in words:
        if word in _SINGLE and (by_unit in _SINGLE[word] or not unit):
            found.insert(0, by_unit or _SINGLE[word][0])
    if "drift" in found or by_unit in found:
        return "drift" if "drift" in found else by_unit
    longest = sorted((word for word in words if word in _BY_WORD), key=len)
    return _BY_WORD[longest[-1]] if longest else None


def _words(name: str) -> list[str]:
    """Return the words of a name in lower case: "acc1_abs" gives acc, 1, abs."""
    plain = unicodedata.normalize("NFKD", name)
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", plain)
    words = [word.lower() for word in re.split(r"[\W_]+", parted) if word]
    out: list[str] = []
    for word in words:
        parts = [word]
        if word not in _KNOWN:  # "dampingforce", "coilvoltage", "damperforce"
            for known in sorted(_KNOWN, key=len, reverse=True):
                if len(known) > 3 and word.endswith(known):
                    parts = [word.removesuffix(known), known]
                    break
        out += [part for part in parts if part]
    return out


@dataclass(frozen=True)
class ChannelSpec:
    """Where a channel is in a file, as in `[channels.force]` of study.toml.

    `column` is its title in the file, or its name without the unit; `unit` that of the file, "" to
    take it from the title; `sign` 1 or -1; `noise` the standard deviation in that unit, None to
    estimate it; `zero` what the column reads, in that unit, where the channel is 0. For the time of
    a file without one, `step` [s] is the sampling step.
    """

    column: str = ""
    unit: str = ""
    sign: int = 1
    noise: float | None = None
    step: float | None = None
    zero: float = 0.0
