"""Which channel of a measurement feeds which input of an FMU, and which output it judges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..core.text import unknown
from ..data.channels import PLAIN, meaning
from ..data.extra_channels import as_word
from ..data.titles import title, unit_or_none
from ..errors import FmuError, UnitError
from ..fmu.description import Description, Variable
from ..units import Measure, conversion, in_base_units, same_dimension, spelling

PASSED_ON = ("fault",)

_NO_UNITS = ("in", "g", "h", "1")
"""Endings of names that are words more often than units: `x_in`, `a_g`."""


@dataclass(frozen=True)
class Port:
    """A port of the FMU and the signal of the measurement that belongs to it, with the reason.

    `unit` is the port's, by the FMU, its name or the user; `sign` -1 where the signal is turned.
    `unit_given`, `sign_given` tell whether the user said so: then nothing is in doubt.
    """

    name: str
    unit: str
    signal: str
    reason: str
    sign: int = 1
    unit_given: bool = False
    sign_given: bool = False


@dataclass(frozen=True)
class PortMap:
    """What was mapped: inputs and outputs; `left` says of each other port why it was not."""

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    left: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return the mapping in words, a line per port."""
        out = [
            f"  {one.name} [{one.unit}] is fed from {_turned(one)}: {one.reason}"
            for one in self.inputs
        ]
        out += [
            f"  {one.name} [{one.unit}] is compared with {_turned(one)}: {one.reason}"
            for one in self.outputs
        ]
        return out + [f"  {text}" for text in self.left]


def _turned(port: Port) -> str:
    return f"{port.signal}, reversed" if port.sign < 0 else port.signal


def map_ports(
    description: Description,
    signals: Mapping[str, str],
    maps: Mapping[str, str],
    values: Mapping[str, object],
) -> PortMap:
    """Return which signal belongs to which port.

    Parameters
    ----------
    description : Description
        The FMU's.
    signals : mapping
        Names of what was measured, or follows from it, to SI units.
    maps : mapping
        Ports to signals, as given, "-CHANNEL@UNIT"; they overrule names and units.
    values : mapping
        What is set by hand; such inputs are fed from nothing.

    Raises
    ------
    FmuError
        If a given port or signal does not exist, units differ or are in doubt, or no output can be
        judged.
    """
    inputs = {v.name: v for v in description.of("input") if v.kind == "Real"}
    outputs = {
        v.name: v for v in description.of("output") if v.kind == "Real" and v.name not in PASSED_ON
    }
    given = {name: _given(name, text) for name, text in maps.items()}
    _check_given(description, {**inputs, **outputs}, signals, given, values)
    into, left = [], []
    for name, variable in inputs.items():
        if name in values:
            left.append(f"{name} is set to {values[name]}")
            continue
        port = _match(variable, inputs, signals, given, by_unit=not variable.optional)
        if port:
            into.append(port)
        else:
            left.append(_left(variable, signals))
    fed = {one.signal for one in into}
    out = []
    for name, variable in outputs.items():
        own = given[name].signal if name in given else ""
        rest = {s: u for s, u in signals.items() if s not in fed or s == own}
        port = _match(variable, outputs, rest, given, by_unit=True)
        if port:
            out.append(port)
    other = [v for v in description.of("input") if v.kind != "Real" and v.name not in values]
    left += [f"{v.name} is {v.kind} and stays at its start value {v.start}" for v in other]
    _refuse_nothing(description, outputs, signals, into, out)
    return PortMap(tuple(into), tuple(out), tuple(left))


def _match(
    variable: Variable,
    ports: Mapping[str, Variable],
    signals: Mapping[str, str],
    given: Mapping[str, GivenPort],
    *,
    by_unit: bool,
) -> Port | None:
    """Return the signal of a port: as given, by name, by what its name means, by unit alone."""
    name, unit = variable.name, unit_of(variable)
    if name in given:
        return _as_given(variable, given[name], signals)
    words = {as_word(signal): signal for signal in signals}
    for candidate, reason in ((name, "its name"), (channel_of(variable), "what its name says")):
        signal = words.get(as_word(candidate))
        if signal and _fits(unit, signals[signal]):
            return _port(variable, signal, reason)
    if not by_unit or unit in (None, "1"):
        return None
    same = [one for one in signals if _fits(unit, signals[one])]
    rivals = [v for v in ports.values() if v.name not in given and _fits(unit, unit_of(v) or "")]
    if len(same) == 1 and len(rivals) == 1:
        return _port(variable, same[0], "its unit alone, check it")
    return None


class GivenPort(NamedTuple):
    """What `--map PORT=-CHANNEL@UNIT` says; `unit` "" and `sign` 0 where it does not."""

    signal: str
    unit: str = ""
    sign: int = 0


def _given(name: str, text: str) -> GivenPort:
    signal, _, unit = text.strip().partition("@")
    sign = {"-": -1, "+": 1}.get(signal[:1], 0)
    if unit and unit_or_none(unit) is None:
        raise FmuError(f'--map {name}={text}: "{unit}" is no unit that is known.')
    return GivenPort(signal[abs(sign) :].strip(), unit, sign)


def _as_given(variable: Variable, given: GivenPort, signals: Mapping[str, str]) -> Port:
    reason, unit = "as given", given.unit or unit_of(variable) or ""
    if not unit:
        unit = signals[given.signal]
        reason += f"; the FMU gives no unit, taken as {unit}"
    return Port(
        variable.name, unit, given.signal, reason, given.sign or 1, bool(given.unit),
        bool(given.sign),
    )  # fmt: skip


def unit_of(variable: Variable) -> str | None:
    """Return the unit of a port: the FMU's, else that in its name, as in a title: `v_mm_s`, `F_kN`.

    An ending counts where it is a unit of what the name means; `x_in` and the like go in.
    """
    return told_unit(variable) or _named_unit(variable)


def told_unit(variable: Variable) -> str | None:
    """Return the unit that the FMU gives a port, as its BaseUnit defines it, None without one.

    Where there is no name for that, it is the definition, which no signal fits.
    """
    if variable.defined is None:
        return variable.unit
    return spelling(variable.defined) or in_base_units(variable.defined)


def _named_unit(variable: Variable) -> str | None:
    called = title(0, variable.name.rpartition(".")[2])
    if called.unit is None or called.unit.name in _NO_UNITS:
        return None
    meant = meaning(called.name, called.unit.name)
    if meant is None or meant.quantity not in PLAIN:
        return None
    fits = same_dimension(called.unit.name, PLAIN[meant.quantity])
    return called.unit.name if fits else None


def channel_of(variable: Variable) -> str:
    """Return the channel that a port's name means, "" where it means none."""
    own = variable.name.rpartition(".")[2]
    own = title(0, own).name if _named_unit(variable) else own
    unit = unit_of(variable)
    meant = meaning(own, unit if unit and Measure(unit).unit else None)
    if meant is None or meant.rank == 0:
        return ""
    if meant.quantity == "drift":
        return f"drift{meant.number or 1}"
    if meant.place == "ground":
        return f"ground_{meant.quantity}"
    if meant.place:
        end = "_absolute" if meant.quantity == "acceleration" else ""
        return f"{meant.place}_{meant.quantity}{end}"
    return meant.quantity


def _port(variable: Variable, signal: str, reason: str) -> Port:
    """Return a port that was found, refused where its unit is in doubt."""
    name, unit, named = variable.name, unit_of(variable), _named_unit(variable)
    told = told_unit(variable)
    if not unit:
        raise FmuError(
            f"{name}: its unit is in doubt: neither the FMU nor its name gives one. "
            f"--map {name}={signal}@UNIT says it."
        )
    if told and named and not _same_unit(told, named):
        raise FmuError(
            f"{name}: its unit is in doubt: the FMU says {told}, and its name {named}. "
            f"--map {name}={signal}@{told} or @{named} says which."
        )
    if not told:
        reason += f"; in {unit} by its name"
    return Port(name, unit, signal, reason)


def _same_unit(first: str, second: str) -> bool:
    try:
        return conversion(first, second) == (1.0, 0.0)
    except UnitError:
        return False


def _fits(unit: str | None, other: str) -> bool:
    """Return whether two units measure the same; one that is not given fits all."""
    if not unit or not other:
        return not unit
    try:
        return same_dimension(unit, other)
    except UnitError:
        return False


def _left(variable: Variable, signals: Mapping[str, str]) -> str:
    told = told_unit(variable)
    unit = f" [{told}]" if told else ""
    stays = (
        f"{variable.name}{unit} is fed from nothing and stays at its start value {variable.start}"
    )
    if variable.optional:
        return f"{stays} (it is optional)"
    same = [name for name in signals if _fits(told, signals[name])] if told else []
    there = (
        f"measured in that unit: {', '.join(same)}" if same else "nothing of that unit was measured"
    )
    name = variable.name
    return f"{stays}; {there}. --map {name}=CHANNEL feeds it, --set {name}=VALUE sets it"


def _check_given(
    description: Description,
    ports: Mapping[str, Variable],
    signals: Mapping[str, str],
    given: Mapping[str, GivenPort],
    values: Mapping[str, object],
) -> None:
    wrong = []
    for name, (signal, unit, _) in given.items():
        if name not in ports:
            wrong.append(f"--map {name}={signal}: {unknown('Real input or output', name, ports)}")
            continue
        unit = unit or unit_of(ports[name]) or ""
        if signal not in signals:
            wrong.append(f"--map {name}={signal}: {unknown('channel', signal, signals)}")
        elif not _fits(unit, signals[signal]):
            wrong.append(
                f"--map {name}={signal}: {name} is in {unit}, {signal} in {signals[signal]}."
            )
    settable = [
        v.name for v in description.variables.values() if v.causality in ("input", "parameter")
    ]
    wrong += [
        f"--set {name}: {unknown('parameter or input', name, settable)}"
        for name in values
        if name not in settable
    ]
    wrong += [f"{name} is both set and mapped; one of the two." for name in given if name in values]
    if wrong:
        raise FmuError(f"{description.name}: " + "\n  ".join(wrong))


def _refuse_nothing(
    description: Description,
    outputs: Mapping[str, Variable],
    signals: Mapping[str, str],
    into: list[Port],
    out: list[Port],
) -> None:
    there = ", ".join(f"{name} [{unit}]" for name, unit in signals.items())
    if not out:
        has = ", ".join(f"{v.name} [{told_unit(v) or '?'}]" for v in outputs.values()) or "none"
        raise FmuError(
            f"{description.name}: no output matches a measured channel. It has: {has}; "
            f"measured: {there}. --map OUTPUT=CHANNEL says which belong together."
        )
    if description.of("input") and not into:
        has = ", ".join(f"{v.name} [{told_unit(v) or '?'}]" for v in description.of("input"))
        raise FmuError(
            f"{description.name}: no input matches a measured channel. It has: {has}; "
            f"measured: {there}. --map INPUT=CHANNEL says which belong together."
        )
