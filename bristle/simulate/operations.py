"""What a macro step is made of: components with their sources, and the operations on them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ..component import HELD, LINEAR, SAMPLED
from ..fmu.description import Value, Variable

Port = tuple[int, str]
"""A component's number in the order of the file, and the name of one of its variables."""

FAULT = "fault"

NEWEST, MIDDLE, AHEAD, END, PAST = "newest", "middle", "ahead", "end", "past"
ALONG = "along"
"""Which value an input is given, of its source's newest u and the kept one p of a step before:
u; (u + p)/2; (3 u - p)/2, the middle of a step that the source has still to make; 2 u - p, its end;
p; and along the step, at the end of each substep, (1 - s) p + s u with the share s that has passed.
"""


@dataclass(frozen=True)
class Node:
    """A component as the schedule sees it: outputs, and the source of each connected input.

    `transformed` has (factor, offset) of the inputs that get factor output + offset.
    `interpolates` names the inputs whose derivative it takes, to follow it over the next step.
    """

    name: str
    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    sources: Mapping[str, Port]
    substeps: int = 1
    transformed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    interpolates: frozenset[str] = frozenset()

    def followed(self, output: str) -> tuple[str, ...]:
        """Return the connected inputs that an output follows without a step."""
        if kind_of(self.outputs[output]) == FAULT:  # changes where a step ends
            return ()
        named = self.outputs[output].dependencies
        if named is None:
            return tuple(self.sources)
        return tuple(name for name in named if name in self.sources)

    def holds(self, name: str) -> bool:
        """Return whether an input is one that the component holds over its step, as far as known.

        Where an FMU does not say how it takes an input, it is taken to hold it if it says at least
        which inputs its outputs follow.
        """
        variable = self.inputs[name]
        if not is_continuous(variable):
            return False
        told = all(v.dependencies is not None for v in self.outputs.values())
        return variable.over_step == HELD or (variable.over_step is None and told)

    def moves(self, name: str) -> bool:
        """Return whether an input is to move on substep by substep towards its newest value.

        Such a component takes it as linear from its own last step: with the newest value from the
        first substep on it would have all of the change there, ahead of time.
        """
        variable = self.inputs[name]
        taken = variable.over_step in (LINEAR, SAMPLED)
        return self.substeps > 1 and taken and variable.kind == "Real"

    def taken(self, name: str, value: Value) -> Value:
        """Return what an input gets where its source gives a value."""
        factor, offset = self.transformed.get(name, (1.0, 0.0))
        if self.inputs[name].kind != "Real":
            return value
        return factor * float(value) + offset

    def jumps(self, output: str) -> bool:
        """Return whether an output may jump: it is discrete, or tells so of itself."""
        variable = self.outputs[output]
        unfed = variable.jumps_without not in (None, *self.sources)
        return unfed or not is_continuous(variable)


@dataclass(frozen=True)
class Step:
    """Let a component step.

    `along` sets inputs before each of its substeps, where it has several.
    """

    component: int
    along: tuple[Write, ...] = ()


@dataclass(frozen=True)
class Read:
    """Read outputs of one component and kind in one call; they are neighbours in memory."""

    component: int
    kind: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Write:
    """Set inputs of one component and kind in one call, each from the output that feeds it.

    `values` says which value each gets, one of those above; empty: all the newest. `if_changed`
    leaves the call out where each has its value already.
    """

    component: int
    kind: str
    names: tuple[str, ...]
    values: tuple[str, ...] = ()
    if_changed: bool = False


@dataclass(frozen=True)
class Ramp:
    """Set derivatives of inputs over the step: the last change of what feeds each of them.

    An input goes on by it from the value that it has as the step begins.
    """

    component: int
    names: tuple[str, ...]
    kind: str = "Real"


@dataclass(frozen=True)
class Keep:
    """Keep outputs of one component as those of a step before: they are about to be read anew."""

    component: int
    names: tuple[str, ...]


@dataclass(frozen=True)
class Shift:
    """Move kept outputs along with a jump: the newest goes off before it, and on again after it."""

    component: int
    names: tuple[str, ...]
    change: str  # "-=" or "+="


@dataclass(frozen=True)
class Save:
    """Keep the whole state of a component."""

    component: int


@dataclass(frozen=True)
class Restore:
    """Take a component back to the state that was kept, and forget that."""

    component: int


Operation = Step | Read | Write | Ramp | Keep | Shift | Save | Restore


@dataclass(frozen=True)
class Schedule:
    """The operations of one macro step, and the order of each component's outputs in memory."""

    operations: tuple[Operation, ...]
    layout: tuple[Port, ...]


def is_continuous(variable: Variable) -> bool:
    """Return whether a value may be taken to lie between two others, or to go on from them."""
    return variable.kind == "Real" and variable.variability in ("continuous", None)


def kind_of(variable: Variable) -> str:
    """Return the kind of call that a variable needs: "Real", "Integer", "Boolean" or "fault".

    `fault` has calls of its own, so that the fault codes of all components are neighbours.
    """
    if (variable.name, variable.causality, variable.kind) == (FAULT, "output", "Integer"):
        return FAULT
    return "Integer" if variable.kind == "Enumeration" else variable.kind


def reads(component: int, node: Node, names: Iterable[str]) -> list[Operation]:
    """Return the calls that read these outputs of a component."""
    return [Read(component, *group) for group in _by_kind(node.outputs, names)]


def writes(component: int, node: Node, values: Mapping[str, str]) -> list[Write]:
    """Return the calls that set these inputs of a component, each to one of the values above."""
    found: list[Write] = []
    for kind, names in _by_kind(node.inputs, values):
        given = tuple(values[name] for name in names)
        found.append(Write(component, kind, names, given if set(given) != {NEWEST} else ()))
    return found


def _by_kind(
    variables: Mapping[str, Variable], names: Iterable[str]
) -> list[tuple[str, tuple[str, ...]]]:
    groups: dict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[kind_of(variables[name])].append(name)
    return [(kind, tuple(group)) for kind, group in groups.items()]
