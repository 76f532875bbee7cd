"""The macro step as a flat Python function: bare ctypes calls on memory laid out beforehand.

A call through ctypes costs about as much in Python as inside a small FMU. So every argument that
never changes is converted once, values stay where the FMUs put them (an input is set straight
from the place where its source was read to), and the row is kept by copying that memory once.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .instance import Instance
from .results import Array
from .schedule import (
    AHEAD,
    ALONG,
    END,
    FAULT,
    MIDDLE,
    NEWEST,
    PAST,
    DoStep,
    Keep,
    Node,
    Operation,
    Port,
    Ramp,
    ReadOutputs,
    Restore,
    Save,
    Schedule,
    Shift,
    Write,
    kind_of,
)

_SIZE = {"Real": 8, "Integer": 4, "Boolean": 4, FAULT: 4}
_FUNCTION = {"Real": "Real", "Integer": "Integer", "Boolean": "Boolean", FAULT: "Integer"}
_VALUE = {
    NEWEST: "m[{now}]",
    MIDDLE: "0.5 * (m[{now}] + past{past})",
    AHEAD: "1.5 * m[{now}] - 0.5 * past{past}",
    END: "2.0 * m[{now}] - past{past}",
    PAST: "past{past}",
    ALONG: "(1.0 - share) * past{past} + share * m[{now}]",  # at the step's end to the last digit
}
"""What an input is given, of doubles in memory m; those of a step before are in local names."""
_SLOPE = "(m[{now}] - past{past}) / step"
"""What its derivative is given."""
_DTYPE = {"Real": "<f8", "Integer": "<i4", "Boolean": "<i4", FAULT: "<i4"}


class Memory:
    """Where every output of every component lies, and room for inputs to be gathered.

    The first `row_size` bytes are the row: Reals, then Integers and Booleans, then all `fault`.
    `past` says where Reals of a step before are kept.
    """

    def __init__(self, nodes: Sequence[Node], schedule: Schedule) -> None:
        self.nodes = nodes
        self.offsets: dict[Port, int] = {}
        size = 0
        for kind in _SIZE:
            for c, name in schedule.layout:
                if kind_of(nodes[c].outputs[name]) == kind:
                    self.offsets[c, name] = size
                    size += _SIZE[kind]
            if kind == "Boolean":
                self.faults = size
        self.row_size = size
        kept = [port for port in self.offsets if port in _kept(schedule)]
        start = -(-size // 8) * 8
        self.past = {port: start + 8 * i for i, port in enumerate(kept)}
        self._gathered = start + 8 * len(kept)
        total = self._gathered + 8 * sum(len(one.names) for one in _setting(schedule))
        self._buffer = bytearray(total)
        self._address = ctypes.addressof((ctypes.c_char * total).from_buffer(self._buffer))
        view = memoryview(self._buffer)
        self.row = view[:size]
        self.views: dict[str, memoryview[Any]] = {"Real": view[: total // 8 * 8].cast("d")}
        self.views["Integer"] = self.views["Boolean"] = view[: total // 4 * 4].cast("i")

    def place(
        self, operation: ReadOutputs | Write | Ramp
    ) -> tuple[tuple[str, ...], int, list[str]]:
        """Return the order of the names in a call, its offset, and the lines that gather before.

        In these lines m is the view of the kind of values, whole that of whole numbers.
        """
        node, size = self.nodes[operation.component], _SIZE[operation.kind]
        if isinstance(operation, ReadOutputs):
            ports = [(operation.component, name) for name in operation.names]
        else:
            ports = [node.sources[name] for name in operation.names]
        places = sorted(
            (self.offsets[port], name) for port, name in zip(ports, operation.names, strict=True)
        )
        names = tuple(name for _, name in places)
        offsets = [offset for offset, _ in places]
        changed = {} if isinstance(operation, ReadOutputs) else node.transformed
        whole = {
            name
            for port, name in zip(ports, operation.names, strict=True)
            if operation.kind == "Real" and self._kind(port) != "Real"
        }
        plain = isinstance(operation, ReadOutputs) or (
            isinstance(operation, Write) and not (operation.values or operation.if_changed)
        )
        plain = plain and not (changed.keys() | whole) & set(names)
        if plain and all(offset == offsets[0] + i * size for i, offset in enumerate(offsets)):
            return names, offsets[0], []
        if isinstance(operation, ReadOutputs):
            raise AssertionError(f"outputs of one call are not neighbours: {names}")
        forms = _forms(operation)
        start = self._gathered
        self._gathered += 8 * len(names)
        lines = []
        for i, (name, offset) in enumerate(zip(names, offsets, strict=True)):
            past = self.past.get(node.sources[name], 0)
            value = forms[name].format(now=offset // size, past=past // size)
            if name in whole:
                value = f"whole[{offset // _SIZE['Integer']}]"
            if name in changed:
                factor, shift = changed[name]
                value = f"{factor!r} * ({value})"
                value += "" if isinstance(operation, Ramp) else f" + {shift!r}"
            lines.append(f"m[{start // size + i}] = {value}")
        return names, start, lines

    def kept(self, operation: Keep | Shift) -> list[tuple[int, int]]:
        """Return where outputs lie and where they are kept, as numbers of doubles."""
        ports = [(operation.component, name) for name in operation.names]
        return [(self.offsets[port] // 8, self.past[port] // 8) for port in ports]

    def address(self, offset: int) -> int:
        """Return the address of an offset."""
        return self._address + offset

    def value(self, port: Port) -> float | int:
        """Return what was last read of an output."""
        kind = self._kind(port)
        view = self.views[_FUNCTION[kind]]
        value: float | int = view[self.offsets[port] // _SIZE[kind]]
        return value

    def _kind(self, port: Port) -> str:
        return kind_of(self.nodes[port[0]].outputs[port[1]])

    def put(self, values: Mapping[Port, Any]) -> None:
        """Store outputs that were read by other means, as after the initialisation."""
        for port, value in values.items():
            kind = self._kind(port)
            self.views[_FUNCTION[kind]][self.offsets[port] // _SIZE[kind]] = value
        for port, offset in self.past.items():
            self.views["Real"][offset // 8] = self.value(port)

    def columns(self, rows: Sequence[bytes]) -> dict[Port, Array]:
        """Return kept rows as one array per output, all of them views of one block."""
        block = np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(len(rows), self.row_size)
        found = {}
        for (c, name), offset in self.offsets.items():
            kind = kind_of(self.nodes[c].outputs[name])
            found[c, name] = block[:, offset : offset + _SIZE[kind]].view(_DTYPE[kind])[:, 0]
        return found


def compile_loop(
    schedule: Schedule,
    memory: Memory,
    instances: Sequence[Instance],
    step: float,
    rows: list[bytes],
    fail: Callable[[Operation | None, int], None],
) -> Callable[[Sequence[float]], None]:
    """Return a function that makes one macro step from each of the times [s] it is given.

    Parameters
    ----------
    schedule : Schedule
        The operations of a macro step, in order.
    memory : Memory
        Where outputs lie and inputs are gathered.
    instances : sequence of Instance
        One per component, by the index that operations give it.
    step : float
        Length of the macro step [s].
    rows : list of bytes
        A row of outputs is appended per step.
    fail : callable
        Called with the operation and its status when a call answers anything but OK, and with
        (None, 0) when a `fault` is not 0; it raises unless the run may go on.
    """
    names: dict[str, Any] = {"fail": fail, "keep": rows.append, "take": memory.row.tobytes}
    names |= {"real": ctypes.c_double.from_param, "step": step, "reals": memory.views["Real"]}
    names["whole"] = memory.views["Integer"]
    body: list[str] = []
    for place, operation in enumerate(schedule.operations):
        number = str(place)
        names[f"o{number}"] = operation
        instance = instances[operation.component]
        if isinstance(operation, DoStep):
            body += _step(number, operation, instance, step, memory, names)
        elif isinstance(operation, Save | Restore):
            body += _state(number, operation, instance, names)
        elif isinstance(operation, Keep | Shift):
            body += _keep(operation, memory)
        else:
            body += _transfer(number, operation, instance, memory, names)
    body += ["row = take()", "keep(row)"]
    if memory.faults < memory.row_size:
        names["healthy"] = bytes(memory.row_size - memory.faults)
        body += ["if not row.endswith(healthy): fail(None, 0)"]
    head = f"def loop({', '.join(('times', *(f'{name}={name}' for name in names)))}):"
    kept = [offset // 8 for offset in memory.past.values()]  # in memory between two calls
    taken, put = (
        [f" past{k} = reals[{k}]" for k in kept],
        [f" reals[{k}] = past{k}" for k in kept],
    )
    steps = [" for t in times:", "  now = real(t)", *("  " + line for line in body)]
    source = [head, *taken, *steps, *put]
    exec(compile("\n".join(source), "<macro step>", "exec"), names)
    made: Callable[[Sequence[float]], None] = names["loop"]
    return made


def _step(
    number: str,
    operation: DoStep,
    instance: Instance,
    step: float,
    memory: Memory,
    names: dict[str, Any],
) -> list[str]:
    substeps = memory.nodes[operation.component].substeps
    names[f"f{number}"] = instance.calls.function("DoStep")
    names[f"c{number}"] = ctypes.c_void_p.from_param(instance.component)
    names[f"h{number}"] = ctypes.c_double.from_param(step / substeps)
    names["past"] = ctypes.c_int.from_param(1)  # the state before this step is not needed again
    call = f"f{number}(c{number}, now, h{number}, past)"
    if substeps == 1:
        return [f"if s := {call}: fail(o{number}, s)"]
    begins = [(i * step / substeps, (i + 1) / substeps) for i in range(substeps)]
    names[f"d{number}"] = begins
    call = call.replace("now", "real(t + d)")
    inside = [f"if s := {call}: fail(o{number}, s)"]
    for i, one in enumerate(operation.along):
        names[f"o{number}_{i}"] = one
        inside[:0] = _transfer(f"{number}_{i}", one, instance, memory, names)
    return [f"for d, share in d{number}:", *(f" {line}" for line in inside)]


def _forms(operation: Write | Ramp) -> dict[str, str]:
    """Return what each input is given, by its name."""
    if isinstance(operation, Ramp):
        return dict.fromkeys(operation.names, _SLOPE)
    values = operation.values or [NEWEST] * len(operation.names)
    return {name: _VALUE[value] for name, value in zip(operation.names, values, strict=True)}


def _transfer(
    number: str,
    operation: ReadOutputs | Write | Ramp,
    instance: Instance,
    memory: Memory,
    names: dict[str, Any],
) -> list[str]:
    order, offset, lines = memory.place(operation)
    variables = [instance.description.variables[name] for name in order]
    references = (ctypes.c_uint * len(order))(*(variable.reference for variable in variables))
    names[f"r{number}"] = references  # kept: its address is used below
    kind = _FUNCTION[operation.kind]
    verb = "Get" if isinstance(operation, ReadOutputs) else "Set"
    address = memory.address(offset)
    if isinstance(operation, Ramp):
        orders = (ctypes.c_int * len(order))(*[1] * len(order))
        names[f"orders{number}"] = orders  # kept as well
        names[f"f{number}"] = instance.calls.function("SetRealInputDerivatives")
        names[f"q{number}"] = ctypes.c_void_p.from_param(ctypes.addressof(orders))
    else:
        names[f"f{number}"] = instance.calls.transfer(verb, kind, variables, address)
    names[f"c{number}"] = ctypes.c_void_p.from_param(instance.component)
    names[f"v{number}"] = ctypes.c_void_p.from_param(ctypes.addressof(references))
    names[f"n{number}"] = ctypes.c_size_t.from_param(len(order))
    names[f"p{number}"] = ctypes.c_void_p.from_param(address)
    if lines:
        names[f"m{number}"] = memory.views[kind]
        lines = [line.replace("m[", f"m{number}[") for line in lines]
    condition = ""
    if isinstance(operation, Write) and operation.if_changed:
        for i in range(len(order)):
            names[f"m{number}"][offset // 8 + i] = math.nan  # as yet it has none of them
        pairs = (line.split(" = ") for line in lines)
        condition = " or ".join(f"{place} != {value}" for place, value in pairs)
    given = f"q{number}, p{number}" if isinstance(operation, Ramp) else f"p{number}"
    call = f"f{number}(c{number}, v{number}, n{number}, {given})"
    whole = [*lines, f"if s := {call}: fail(o{number}, s)"]
    return [f"if {condition}:", *(f" {line}" for line in whole)] if condition else whole


def _state(
    number: str, operation: Save | Restore, instance: Instance, names: dict[str, Any]
) -> list[str]:
    """Return the lines that get a component's state, or set it and free it: a get may allocate."""
    component = ctypes.c_void_p.from_param(instance.component)
    state = names.setdefault(f"state{operation.component}", ctypes.c_void_p())
    calls = {"GetFMUstate": ctypes.byref(state)}
    if isinstance(operation, Restore):
        calls = {"SetFMUstate": state, "FreeFMUstate": ctypes.byref(state)}
    lines = []
    for i, (function, given) in enumerate(calls.items()):
        names[f"f{number}_{i}"], names[f"c{number}"] = (
            instance.calls.function(function),
            component,
        )
        names[f"p{number}_{i}"] = given
        lines.append(f"if s := f{number}_{i}(c{number}, p{number}_{i}): fail(o{number}, s)")
    return lines


def _keep(operation: Keep | Shift, memory: Memory) -> list[str]:
    assign = operation.change if isinstance(operation, Shift) else "="
    return [f"past{past} {assign} reals[{now}]" for now, past in memory.kept(operation)]


def _setting(schedule: Schedule) -> list[Write | Ramp]:
    """Return the operations that set inputs, for which values may be gathered."""
    inside = [one for o in schedule.operations if isinstance(o, DoStep) for one in o.along]
    return [*inside, *(o for o in schedule.operations if isinstance(o, Write | Ramp))]


def _kept(schedule: Schedule) -> set[Port]:
    """Return the outputs of which a step before is kept."""
    return {
        (operation.component, name)
        for operation in schedule.operations
        if isinstance(operation, Keep)
        for name in operation.names
    }
