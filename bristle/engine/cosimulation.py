"""The engine that steps FMUs together and keeps every output of every step.

Row k holds all outputs at t_k = k step, t = 0 included. What is set and read when, is decided
in `schedule`; how it is called, in `macro_step`; this module initialises, watches and explains.
"""

from __future__ import annotations

import ctypes
import logging
import math
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Self

import numpy as np

from ..core.interrupt import Interrupt, deferred
from ..core.progress import Progress
from ..engine import Interrupted, OnRows, StoppedError
from ..errors import RunError, not_usable
from ..fmu.build import ensure
from ..fmu.description import Description, Value, read_description
from ..fmu.library import FATAL, WARNING, answer_of
from ..system.model import Component, System
from ..system.toml import signal_file
from .instance import Instance, Message, Unpacked
from .results import Array, RunTable, count_steps, make_columns, times
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
    find_loop,
    kind_of,
    make_nodes,
    make_schedule,
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


SETTLE = 100
"""Rounds in which the values at t = 0 must settle where outputs and inputs follow each other."""

VERBS = {
    DoStep: "doStep",
    ReadOutputs: "reading its outputs",
    Ramp: "setting the derivatives of its inputs",
    Save: "getting its state",
    Restore: "setting its state",
}

FAULTS = {
    1: "an input is not finite",
    2: "the step is not a positive finite number",
    3: "it was asked to step outside step mode",
    4: "a state or output is not finite or out of bounds",
    5: "a parameter or record is wrong",
}


FORMS = ("python", "native")
"""The forms of built-in components' FMUs: in Python, or native, which a compiler makes."""
FLUSH = 1.0
"""Seconds between two times that new rows are handed out."""
BLOCK = 0.1
"""Seconds of steps between two looks at Ctrl-C, progress and clock."""


def warner() -> Callable[[Message, float], None]:
    """Return what shows each thing that FMUs say in a run once, unless all is well."""
    told: set[str] = set()

    def warn(message: Message, at: float) -> None:
        if message.status != "OK" and message.shown not in told:
            told.add(message.shown)
            logging.getLogger("bristle").warning(message.shown)

    return warn


def ignore(message: Message, at: float) -> None:
    """Leave what an FMU says: a run for its numbers alone."""


@dataclass(frozen=True)
class Cosimulation:
    """The engine that steps FMUs: built-in components as Python or as native ones.

    `listen` gets what FMUs say, and the time [s]; by default warnings are shown, each once a run.
    `progress` shows a bar, on a terminal only;
    `on_hang` ends the process where a component hangs after Ctrl-C: it gets the time [s] up to
    which rows were handed out, None where there are none.
    """

    fmus: str = "python"
    listen: Callable[[Message, float], None] | None = None
    progress: bool = False
    on_hang: Callable[[float | None], None] | None = None
    name: ClassVar[str] = "fmu"

    def __post_init__(self) -> None:
        if self.fmus not in FORMS:
            raise not_usable(f'fmus "{self.fmus}" is not known; there are: {", ".join(FORMS)}.')

    def refuses(self, system: System) -> str:
        """Return "": it steps whatever has an FMU."""
        return ""

    def run(self, system: System, on_rows: OnRows | None = None) -> RunTable:
        """Return every output at every step; see `Engine`."""
        paths, descriptions = self._fmus(system)
        with tempfile.TemporaryDirectory(prefix="bristle_signals_") as folder:
            parameters = _parameters(system, Path(folder))
            with Master(system, paths, descriptions, parameters, self.listen or warner()) as master:
                return self._stepped(system, master, on_rows or (lambda table: None))

    def _fmus(self, system: System) -> tuple[dict[str, Path], dict[str, Description]]:
        """Return each component's FMU file, built where needed, and what it says of itself."""
        make: Callable[..., Path] = ensure
        if self.fmus == "native":
            with deferred():  # an import of llvmlite that Ctrl-C breaks off is never made good
                from ..native.build import ensure as make
        paths, descriptions = {}, {}
        for name, component in system.components.items():
            path = component.path or make(component.made_of(), **component.made_with())
            # A missing binary is explained when the FMU is loaded, with the way out.
            paths[name], descriptions[name] = path, read_description(path, any_platform=True)
        return paths, descriptions

    def _stepped(self, system: System, master: Master, on_rows: OnRows) -> RunTable:
        given = 0
        stopped: RunError | None = None

        def give() -> None:
            nonlocal given
            if given < master.rows:
                table = master.table(given)
                given = master.rows
                on_rows(table)

        def hang() -> None:
            assert self.on_hang is not None
            give()
            master.forget()
            self.on_hang(master.time if master.rows else None)

        with Interrupt(hang if self.on_hang else None) as interrupt:
            try:
                try:
                    master.start()
                finally:
                    give()
                with Progress(system.title, master.steps, self.progress) as bar:
                    count, due = 1, time.perf_counter() + FLUSH
                    try:
                        while master.rows <= master.steps and not interrupt.asked:
                            before = time.perf_counter()
                            master.advance(count)
                            now = time.perf_counter()
                            most = int(count * BLOCK / max(now - before, 1e-9))
                            count = max(1, min(8 * count, most))
                            bar.show(master.rows - 1)
                            if now >= due:
                                give()
                                due = now + FLUSH
                    finally:
                        give()
            except RunError as error:
                if not master.rows or error.exit_code != 1:
                    raise
                stopped = error
        table = master.table()
        if stopped:
            raise StoppedError(str(stopped), table) from stopped
        if interrupt.asked:  # a caller that makes many runs is to stop as well
            raise Interrupted(table, whole=master.rows > master.steps)
        return table


def _parameters(system: System, folder: Path) -> dict[str, dict[str, Value]]:
    """Return the values that each FMU is given; a signal is a file in a folder."""
    found = {name: one.taken_values() for name, one in system.components.items()}
    for name, one in system.components.items():
        if one.signal is not None:
            found[name][one.plays] = str(signal_file(one.signal, folder / f"{name}.csv"))
    return found


class Master:
    """The FMUs of a system, stepped together.

    Parameters
    ----------
    system : System
    paths : mapping of str to Path
        The FMU file of each component.
    descriptions : mapping of str to Description
        What each FMU says of itself.
    parameters : mapping of str to mapping
        Values set before initialisation, per component; also of inputs that nothing feeds.
    listen : callable
        Gets every message of every FMU, and the time [s].

    Raises
    ------
    FmuError
        An FMU cannot be unpacked, loaded or instantiated.
    RunError
        From any method: a component fails; the text names it, the time and its inputs. The rows
        before are kept, see `table`.

    Examples
    --------
    >>> with Master(system, paths, descriptions, parameters, print) as master:  # doctest: +SKIP
    ...     master.start()
    ...     master.advance(master.steps)
    ...     table = master.table()
    """

    def __init__(
        self,
        system: System,
        paths: Mapping[str, Path],
        descriptions: Mapping[str, Description],
        parameters: Mapping[str, Mapping[str, Value]],
        listen: Callable[[Message, float], None],
    ) -> None:
        self.step = system.step
        self.steps = count_steps(system.stop, system.step)
        self._stop = system.stop
        self._parameters = parameters
        self.nodes = make_nodes(system, descriptions)
        self.columns = make_columns(system, descriptions)
        self.made: dict[str, Any] = {
            "fmus": {name: f"{one.name} {one.guid}" for name, one in descriptions.items()}
        }
        schedule = make_schedule(self.nodes, system.algorithm)
        self._memory = Memory(self.nodes, schedule)
        self._rows: list[bytes] = []
        self._blocks: list[dict[Port, Array]] = []
        self._collected = 0
        self._instances: list[Instance] = []
        self._unpacked = Unpacked()
        try:
            self._instantiate(system.components.values(), paths, descriptions, listen)
            self._loop = compile_loop(
                schedule, self._memory, self._instances, self.step, self._rows, self._check
            )
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    @property
    def rows(self) -> int:
        """The number of rows so far; row 0 is t = 0."""
        return self._collected + len(self._rows)

    @property
    def time(self) -> float:
        """The time of the newest row, 0 before there is one."""
        return float(times(max(self.rows - 1, 0), max(self.rows, 1), self.step)[0])

    def start(self) -> None:
        """Initialise all FMUs and keep row 0, the outputs at t = 0.

        Outputs are passed on in rounds until nothing changes, in initialisation mode and after
        it, so that chains of outputs that follow inputs are all at t = 0.

        Raises
        ------
        RunError
            Also if an algebraic loop does not settle; the text names the loop.
        """
        for node, instance in zip(self.nodes, self._instances, strict=True):
            instance.initialise(self._parameters.get(node.name, {}), self._stop)
        self._settle()
        for instance in self._instances:
            instance.finish_initialisation()
        self._memory.put(self._settle())
        self._rows.append(self._memory.row.tobytes())
        if any(self._memory.row[self._memory.faults :]):
            self._explain_fault("at t = 0 s")

    def advance(self, count: int) -> None:
        """Make `count` macro steps, or those that are left."""
        first = self.rows - 1
        last = min(first + count, self.steps)
        self._loop(times(first, last, self.step).tolist())

    def table(self, first: int = 0) -> RunTable:
        """Return the rows from `first` on."""
        if self._rows:
            self._blocks.append(self._memory.columns(self._rows))
            self._collected += len(self._rows)
            self._rows.clear()
        blocks, skipped = [], 0
        for block in self._blocks:
            length = len(next(iter(block.values())))
            if skipped + length > first:
                blocks.append((block, max(first - skipped, 0)))
            skipped += length
        values = {}
        for column, port in zip(self.columns, self._ports(), strict=True):
            parts = [block[port][start:] for block, start in blocks]
            values[column.name] = np.concatenate(parts).astype(column.dtype)
        return RunTable(
            times(first, self._collected, self.step), self.columns, values, dict(self.made)
        )

    def close(self) -> None:
        """Free the FMUs and remove what was unpacked."""
        while self._instances:
            self._instances.pop().close()
        self.forget()

    def forget(self) -> None:
        """Remove what was unpacked without a call of the FMUs, one of which may hang."""
        self._unpacked.close()

    def _instantiate(
        self,
        components: Iterable[Component],
        paths: Mapping[str, Path],
        descriptions: Mapping[str, Description],
        listen: Callable[[Message, float], None],
    ) -> None:
        def heard(message: Message) -> None:
            listen(message, self.time)

        copies: dict[Path, int] = {}
        for component in components:
            path, description = paths[component.name], descriptions[component.name]
            copy = copies.get(path, 0)
            if description.capabilities.get("canBeInstantiatedOnlyOncePerProcess") == "true":
                copies[path] = copy + 1  # a library of its own for each
            folder = self._unpacked.folder(path, copy)
            self._instances.append(Instance(component.name, description, folder, heard))

    def _settle(self) -> dict[Port, Value]:
        """Pass outputs on until no input changes any more; return all outputs."""
        given: dict[Port, Value] = {}
        for turn in range(SETTLE):
            outputs = {
                (c, name): value
                for c, instance in enumerate(self._instances)
                for name, value in instance.get(self.nodes[c].outputs).items()
            }
            wanted = {
                (c, name): node.taken(name, outputs[source])
                for c, node in enumerate(self.nodes)
                for name, source in node.sources.items()
            }
            # Without a loop all is settled exactly after one round per component.
            near = 1e-12 if turn > len(self.nodes) else 0.0
            changed = [p for p in wanted if p not in given or not _equal(wanted[p], given[p], near)]
            if not changed:
                return outputs
            for c, instance in enumerate(self._instances):
                instance.set({name: wanted[d, name] for d, name in changed if d == c})
            given = wanted
        loop = find_loop(self.nodes)
        if loop:
            path = " -> ".join(f"{self.nodes[c].name}.{name}" for c, name in loop)
            raise RunError(
                f"t = 0 s: the values of an algebraic loop do not settle: {path}.\n"
                "  Leave out one of its connections, or add a component with memory."
            )
        return outputs  # an FMU whose outputs change at every look, as a noisy sensor's may

    def _check(self, operation: Operation | None, status: int) -> None:
        if operation is None:
            self._explain_fault(f"at t = {self.time:.9g} s")
        if status != WARNING:
            self._explain(operation, status)

    def _explain(self, operation: Operation, status: int) -> NoReturn:
        instance = self._instances[operation.component]
        instance.poisoned |= status == FATAL
        verb = VERBS.get(type(operation), "setting inputs")
        when = f"in the step from t = {self.time:.9g} s"
        text = f"{instance.name} {when}: {verb} answered {answer_of(status)}"
        said = instance.said()  # before the fault is read: each call forgets what was said before
        node = self.nodes[operation.component]
        if not instance.poisoned and any(kind_of(v) == "fault" for v in node.outputs.values()):
            text += self._code(instance.get(["fault"])["fault"])
        text += self._inputs(operation.component) + said
        if isinstance(operation, Ramp):
            held = ", ".join(f'{name} = "held"' for name in operation.names)
            text += (
                "\n  Its description says canInterpolateInputs. Without derivatives it is stepped "
                f"by over_step = {{ {held} }} in [components.{instance.name}]."
            )
        raise RunError(text)

    def _explain_fault(self, when: str) -> NoReturn:
        for c, node in enumerate(self.nodes):
            for name, variable in node.outputs.items():
                if kind_of(variable) == "fault" and (code := self._memory.value((c, name))):
                    text = f"{node.name} {when}{self._code(code)}{self._inputs(c)}"
                    raise RunError(text + self._instances[c].said())
        raise AssertionError("no component reports a fault")

    @staticmethod
    def _code(code: Value) -> str:
        return f": fault {code}, {FAULTS.get(int(code), 'unknown code')}" if code else ""

    def _inputs(self, component: int) -> str:
        """Return the inputs of a component with their values, those not finite first."""
        node = self.nodes[component]
        values = {
            name: node.taken(name, self._memory.value(source))
            for name, source in node.sources.items()
        }
        names = sorted(values, key=lambda name: math.isfinite(float(values[name])))
        parts = [f"{name} = {values[name]:.9g}{_unit(node, name)}" for name in names]
        return ".\n  Inputs: " + ", ".join(parts) if parts else "."

    def _ports(self) -> list[Port]:
        return [(c, name) for c, node in enumerate(self.nodes) for name in node.outputs]


def _equal(one: Value, other: Value, near: float) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        both_nan = math.isnan(one) and math.isnan(other)
        return both_nan or math.isclose(one, other, rel_tol=near, abs_tol=near * 1e-3)
    return one == other


def _unit(node: Node, name: str) -> str:
    unit = node.inputs[name].unit
    return f" {unit}" if unit and unit != "1" else ""
