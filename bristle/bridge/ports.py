"""Which channel of a measurement feeds which input of an FMU, and which output it judges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..data.channels import meaning
from ..errors import FmuError, UnitError
from ..findings import unknown
from ..fmu.description import Description, Variable
from ..units import same_dimension

PASSED_ON = ("fault",)


@dataclass(frozen=True)
class Port:
    """A port of the FMU and the signal of the measurement that belongs to it, with the reason."""

    name: str
    unit: str
    signal: str
    reason: str


@dataclass(frozen=True)
class PortMap:
    """What was mapped: inputs and outputs; `left` says of each other port why it was not."""

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    left: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return the mapping in words, a line per port."""
        out = [
            f"  {one.name} [{one.unit}] is fed from {one.signal}: {one.reason}"
            for one in self.inputs
        ]
        out += [
            f"  {one.name} [{one.unit}] is compared with {one.signal}: {one.reason}"
            for one in self.outputs
        ]
        return out + [f"  {text}" for text in self.left]


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
        Ports to signals, as given; they overrule names and units.
    values : mapping
        What is set by hand; such inputs are fed from nothing.

    Raises
    ------
    FmuError
        If a given port or signal does not exist, units differ, or no output can be judged.
    """
    inputs = {v.name: v for v in description.of("input") if v.kind == "Real"}
    outputs = {
        v.name: v for v in description.of("output") if v.kind == "Real" and v.name not in PASSED_ON
    }
    _check_given(description, {**inputs, **outputs}, signals, maps, values)
    into, left = [], []
    for name, variable in inputs.items():
        if name in values:
            left.append(f"{name} is set to {values[name]}")
            continue
        port = _match(variable, inputs, signals, maps, by_unit=not variable.optional)
        if port:
            into.append(port)
        else:
            left.append(_left(variable, signals))
    fed = {one.signal for one in into}
    out = []
    for name, variable in outputs.items():
        rest = {s: u for s, u in signals.items() if s not in fed or s == maps.get(name)}
        port = _match(variable, outputs, rest, maps, by_unit=True)
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
    maps: Mapping[str, str],
    *,
    by_unit: bool,
) -> Port | None:
    """Return the signal of a port: as given, by name, by what its name means, by unit alone."""
    name = variable.name
    if name in maps:
        return _port(variable, maps[name], "as given", signals)
    lower = {signal.lower(): signal for signal in signals}
    for candidate, reason in ((name, "its name"), (channel_of(variable), "what its name says")):
        signal = lower.get(candidate.lower())
        if signal and _fits(variable.unit, signals[signal]):
            return _port(variable, signal, reason, signals)
    if not by_unit or variable.unit in (None, "1"):
        return None
    same = [one for one in signals if _fits(variable.unit, signals[one])]
    rivals = [
        v for v in ports.values() if v.name not in maps and _fits(variable.unit, v.unit or "")
    ]
    if len(same) == 1 and len(rivals) == 1:
        return _port(variable, same[0], "its unit alone, check it", signals)
    return None


def channel_of(variable: Variable) -> str:
    """Return the channel that a port's name means, "" where it means none."""
    meant = meaning(variable.name.rpartition(".")[2], variable.unit)
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


def _port(variable: Variable, signal: str, reason: str, signals: Mapping[str, str]) -> Port:
    if not variable.unit:
        reason += f"; the FMU gives no unit, taken as {signals[signal]}"
    return Port(variable.name, variable.unit or signals[signal], signal, reason)


def _fits(unit: str | None, other: str) -> bool:
    """Return whether two units measure the same; one that is not given fits all."""
    if not unit or not other:
        return not unit
    try:
        return same_dimension(unit, other)
    except UnitError:
        return False


def _left(variable: Variable, signals: Mapping[str, str]) -> str:
    unit = f" [{variable.unit}]" if variable.unit else ""
    stays = (
        f"{variable.name}{unit} is fed from nothing and stays at its start value {variable.start}"
    )
    if variable.optional:
        return f"{stays} (it is optional)"
    same = (
        [name for name in signals if _fits(variable.unit, signals[name])] if variable.unit else []
    )
    there = (
        f"measured in that unit: {', '.join(same)}" if same else "nothing of that unit was measured"
    )
    name = variable.name
    return f"{stays}; {there}. --map {name}=CHANNEL feeds it, --set {name}=VALUE sets it"


def _check_given(
    description: Description,
    ports: Mapping[str, Variable],
    signals: Mapping[str, str],
    maps: Mapping[str, str],
    values: Mapping[str, object],
) -> None:
    wrong = []
    for name, signal in maps.items():
        if name not in ports:
            wrong.append(f"--map {name}={signal}: {unknown('Real input or output', name, ports)}")
        elif signal not in signals:
            wrong.append(f"--map {name}={signal}: {unknown('channel', signal, signals)}")
        elif not _fits(ports[name].unit, signals[signal]):
            wrong.append(
                f"--map {name}={signal}: {name} is in {ports[name].unit}, {signal} in "
                f"{signals[signal]}."
            )
    settable = [
        v.name for v in description.variables.values() if v.causality in ("input", "parameter")
    ]
    wrong += [
        f"--set {name}: {unknown('parameter or input', name, settable)}"
        for name in values
        if name not in settable
    ]
    wrong += [f"{name} is both set and mapped; one of the two." for name in maps if name in values]
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
        has = ", ".join(f"{v.name} [{v.unit or '?'}]" for v in outputs.values()) or "none"
        raise FmuError(
            f"{description.name}: no output matches a measured channel. It has: {has}; "
            f"measured: {there}. --map OUTPUT=CHANNEL says which belong together."
        )
    if description.of("input") and not into:
        has = ", ".join(f"{v.name} [{v.unit or '?'}]" for v in description.of("input"))
        raise FmuError(
            f"{description.name}: no input matches a measured channel. It has: {has}; "
            f"measured: {there}. --map INPUT=CHANNEL says which belong together."
        )
