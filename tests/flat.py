"""A component's functions compiled on arrays, driven beside the same ones in plain Python."""

from __future__ import annotations

from math import sin
from typing import Any

import numpy as np

from bristle.core.jit import compiled
from bristle.fmu import catalogue
from bristle.fmu.component import ComponentSlave, SourceSlave
from bristle.fmu.controller import SampledSlave

STEPS = (5e-4, 5e-4, 2e-3, 2e-3, 7e-4, 0.011)
"""Lengths of the steps of a run [s], again and again."""

ENTRY = """
def entry(call, time, dt, values, given, baked, times, samples, store, state, new_state,
          before, now, outputs, work):
    if call == 0:
        return sizes(values, baked, work)
    if call == 1:
        return setup(values, given, baked, store, state)
    if call == 6:
        {scale_samples}
    {bind}
    if call == 2:
        {discretise}
        return 0
    c = constants({constants})
    {follow}
    if call == 3:
        return start(time, now, c, state, outputs, work)
    if call == 4:
        return step((time, dt, 0), before, now, c, state, new_state, outputs, work)
    return output(time, now, c, state, outputs, work)
"""
"""All functions of a component behind one, which is compiled once and takes arrays alone."""

_ENTRIES: dict[tuple[int, bool], tuple[Any, Any]] = {}


def entry(functions: Any, machine: bool) -> Any:
    """Return all functions of a component as one, compiled to machine code or as they are."""
    known = (id(functions), machine)
    if known not in _ENTRIES:
        calls = {
            "bind": "bind(given, store)",
            "follow": "follow(now, c)",
            "discretise": "discretise(dt, store, work)",
            "scale_samples": "return scale_samples(times, samples, store)",
        }
        text = ENTRY.format(
            constants="store, times, samples" if takes_samples(functions) else "store",
            **{name: call if hasattr(functions, name) else "pass" for name, call in calls.items()},
        )
        names = ("sizes", "setup", "constants", "start", "step", "output", *calls)
        namespace = {name: getattr(functions, name, None) for name in names}
        namespace["__name__"] = f"entry_{len(_ENTRIES)}"
        exec(text, namespace)
        # Not kept: machine code whose module is made here could not be read by another process.
        _ENTRIES[known] = (
            functions,
            compiled(namespace["entry"], ("linear.row",), keep=False)
            if machine
            else namespace["entry"],
        )
    return _ENTRIES[known][1]


def takes_samples(functions: Any) -> bool:
    """Return whether a component plays samples that lie beside its constants."""
    return bool(functions.constants.__code__.co_argcount > 1)


def bits(values: Any) -> bytes:
    return np.array(values, dtype=float).tobytes()


class Arrays:
    """A component's compiled functions on arrays, driven as a host drives a component."""

    def __init__(self, slave: ComponentSlave, machine: bool = True) -> None:
        functions = slave.flat_functions()
        self.call = entry(functions, machine)
        self.values, self.baked = np.array(slave.flat_values()), np.array(slave.bake())
        self.given = np.zeros(len(slave._inputs))
        played = slave.samples() if isinstance(slave, SourceSlave) else ([], [])
        self.samples = [np.array(row) for row in played]
        counts = np.zeros(4)
        self.store = self.state = self.new = self.before = self.outputs = np.zeros(0)
        self.work = counts
        self._run(0, 0.0, 0.0, np.zeros(0))
        sizes = [int(count) for count in counts]
        self.store, self.state, self.outputs, self.work = (np.zeros(size) for size in sizes)
        self.code = self._run(1, 0.0, 0.0, np.zeros(0))
        if takes_samples(functions) and self.code == 0:
            self.code = self._run(6, 0.0, 0.0, np.zeros(0))
        self.new = self.state if isinstance(slave, SampledSlave) else self.state.copy()
        self.dt = 0.0

    def _run(self, which: int, time: float, dt: float, now: Any) -> int:
        code: int = self.call(
            which, time, dt, self.values, self.given, self.baked, *self.samples, self.store,
            self.state, self.new, self.before, now, self.outputs, self.work,
        )  # fmt: skip
        return code

    def start(self, now: list[float]) -> int:
        self.before = np.array(now)
        return self._run(3, 0.0, 0.0, self.before)

    def show(self, time: float, now: list[float]) -> int:
        return self._run(5, time, 0.0, np.array(now))

    def step(self, time: float, dt: float, now: list[float]) -> int:
        if dt != self.dt:
            self._run(2, time, dt, np.array(now))
            self.dt = dt
        code = self._run(4, time, dt, np.array(now))
        self.state, self.new = self.new, self.state
        self.before = np.array(now)
        return code


def made(name: str, parameters: dict[str, Any], **more: Any) -> Any:
    """Return a component in plain Python whose parameters are set."""
    slave: Any = catalogue.instantiate(name, **more)
    for key, value in parameters.items():
        kind = type(slave[key])
        slave._set_any([slave._index[key]], [kind(value)], kind)
    return slave


def check_run(
    name: str, parameters: dict[str, Any], late: str = "", machine: bool = True, **more: Any
) -> None:
    """Drive a component in both forms; the outputs have the same bits, and so has the state.

    `late` names an input that a host sets only after a while. Without `machine` the functions on
    arrays run as Python.
    """
    slave = made(name, parameters, **more)
    ports = [slave.vars[index].name for index in slave._inputs]
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()

    def give(k: int) -> list[float]:
        for j, index in enumerate(slave._inputs):
            if ports[j] != late or k > 60:
                start = slave._bounds.get(ports[j], (0.0,))[0] or 0.0
                slave.set_real([index], [start + 0.1 * (j + 1) * sin(0.03 * (j + 1) * k + j)])
        return [slave._values[index] for index in slave._inputs]

    values = give(0)
    slave.exit_initialization_mode()
    arrays = Arrays(slave, machine)
    arrays.given[:] = slave.inputs_set()
    assert (slave.fault, arrays.code) == (0, 0)
    arrays.start(values)
    count, time = len(slave._outputs), 0.0
    assert bits(arrays.outputs[:count]) == bits(slave.get_real(slave._outputs))
    for k in range(120):
        values, dt = give(k + 1), STEPS[k // 4 % len(STEPS)]
        arrays.given[:] = slave.inputs_set()
        shown = slave.get_real(slave._outputs)
        arrays.show(time, values)
        assert bits(arrays.outputs[:count]) == bits(shown), k
        assert slave.do_step(time, dt)
        arrays.step(time, dt, values)
        time += dt
        assert bits(arrays.outputs[:count]) == bits(slave.get_real(slave._outputs)), k
    if slave.state:
        assert bits(arrays.state) == bits(slave.state)
