"""Forces along a motion, compiled: of a damper on a bench, of a building's effects."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from math import ceil, inf
from pathlib import Path
from threading import Lock
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Array
from ..core.progress import tell
from ..data.corrections import JUMP
from ..physics import damper, structure
from ..physics.damper import (
    change_parameters,
    changes_of,
    jump,
    pack_into,
    parameter_places,
    room,
    setup_of,
    state_places,
    step,
)
from ..physics.damper_source import LIBRARY, evaluate, functions_of, step_law
from ..physics.effect import effects_of
from ..physics.generate import Functions, Slots
from ..physics.laws import LAWS, laws_of
from ..physics.series import IMPLICIT_STEP
from ..physics.structure import advance_effects, contact_force, effect_forces
from ..physics.tuples import Inputs, Setup

# Compiles what fits and diagnoses need in processes of their own, while the data are read.
#
# numba compiles under one lock, so threads would not help. What a process keeps on disk is read
# here once it is there.

_CODE = "import sys; from bristle.identification.histories import keep; keep(*sys.argv[1:])"


class Ahead:
    """A process that compiles a function, and says when it is kept on disk.

    Parameters
    ----------
    name, digest : of the function; where the process finds another digest, as beside a user's own
        effect, it ends without compiling
    """

    def __init__(self, name: str, digest: str) -> None:
        self._what = "effects" if name == force_history.__name__ else "laws"
        self._done = False
        self._lock = Lock()
        folder = str(Path(__file__).resolve().parents[2])
        paths = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
        # A session of its own: what is compiled serves the next command too, after a Ctrl-C here.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CODE, name, digest], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, "PYTHONPATH": paths}, start_new_session=True,
        )  # fmt: skip

    @property
    def at_work(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Wait until the function is kept, or the process has ended without it."""
        with self._lock:
            if self._done:
                return
            tell(f"compiling the {self._what}, once")
            assert self._process.stdout is not None
            self._process.stdout.readline()  # empty where it has ended: whoever asks compiles then
            self._process.stdout.close()
            self._process.wait()
            self._done = True


def begun(name: str, digest: str) -> Ahead | None:
    """Return a process that compiles a function, or None where none can be begun."""
    try:
        return Ahead(name, digest)
    except OSError:
        return None


_INLINE = (
    "damper.step", "series.advance_series", "series.balanced_speed", "series.by_secants",
    "series.speed_excess",
)  # fmt: skip
"""Callees of `force_history` that cost more to call than to hold in it."""

_INLINE_LAW = ("generate.step_law", "falling.falling")
"""Those of `law_history`."""

_ONE_AT_A_TIME = Lock()
_ahead: dict[str, Ahead] = {}
_SIGNALS = ("x", "v", "a", "V")
_NO_TRACKS: Mapping[str, Array] = MappingProxyType({})


def before_jump(V: Any, k: int) -> float:
    """Return the voltage [V] just before sample k, to which it goes from sample k - 1.

    A step of a voltage falls on a sample, so what jumps there was held before; what is smooth is
    linear between samples. A jump stands out against the changes before and after it, as in
    `data.corrections.jumps`.
    """
    change = JUMP * max(
        abs(V[k - 1] - V[k - 2]) if k > 1 else 0.0,
        abs(V[k + 1] - V[k]) if k + 1 < len(V) else 0.0,
    )
    return V[k - 1] if abs(V[k] - V[k - 1]) > change else V[k]  # type: ignore[no-any-return]


class Tracks(NamedTuple):
    """Parameters that follow a channel: their `slots` (k,) in `p`, and `values` (k, n) in SI."""

    slots: Any
    values: Any


def force_history(
    setup: Setup, motion: Inputs, tracks: Tracks, z: Any, z1: Any, work: Any, out: Any
) -> None:
    """Fill `out` (n,) with the force at each sample of a motion that is linear between them.

    So is the voltage, but where it jumps: see `before_jump`. A parameter that follows a channel has
    its newest value over each step.

    Parameters
    ----------
    setup : the damper, its parameters in SI
    motion : x, v, a, V as (n,) [m, m/s, m/s2, V] and the step dt [s]
    tracks : parameters that change over the run, set in `setup.p`
    z : (states,) at the start, moved on in place
    z1 : room for as many states
    work : room for `damper.room` floats
    out : (n,) N, filled
    """
    size = len(z)
    x, v, a, V, dt = motion.x, motion.v, motion.a, motion.V, motion.dt
    energy = 0.0
    for i in range(len(tracks.slots)):
        setup.p[tracks.slots[i]] = tracks.values[i, 0]
    now = Inputs(x[0], v[0], a[0], V[0], dt, 0.0, 0.0, False)
    out[0] = evaluate(setup, now, z, work[0:size], work[size : 2 * size])[0]
    for k in range(1, len(x)):
        for i in range(len(tracks.slots)):
            setup.p[tracks.slots[i]] = tracks.values[i, k]
        V1 = before_jump(V, k)
        begin = Inputs(x[k - 1], v[k - 1], a[k - 1], V[k - 1], dt, energy, 0.0, False)
        now = Inputs(x[k], v[k], a[k], V1, dt, energy, 0.0, False)
        out[k] = step(setup, begin, now, z, z1, work)[0]
        if V[k] != V1:
            now = Inputs(x[k], v[k], a[k], V[k], dt, energy, 0.0, False)
            out[k] = jump(setup, now, z1, work)
        energy += 0.5 * dt * (out[k - 1] * v[k - 1] + out[k] * v[k])
        for i in range(size):
            z[i] = z1[i]


def law_history(
    setup: Setup, motion: Inputs, tracks: Tracks, z: Any, z1: Any, work: Any, out: Any
) -> None:
    """Do what `force_history` does where no effect is on, without the code of any effect.

    A law knows the voltage of its own moment only, so a jump needs no care, but where its command
    lags: before a jump it follows what was held.

    Parameters
    ----------
    setup, motion, z, z1, out : as in `force_history`
    tracks, work : not needed here
    """
    law, p, h = setup.law, setup.p, 0.0
    x, v, a, V, dt = motion.x, motion.v, motion.a, motion.V, motion.dt
    before = Inputs(x[0], v[0], a[0], V[0], 0.0, 0.0, 0.0, False)
    for k in range(len(x)):  # the first sample too: a second call would be compiled once more
        V1 = before_jump(V, k) if setup.lags and k > 0 else V[k]
        now = Inputs(x[k], v[k], a[k], V1, h, 0.0, 0.0, False)
        out[k] = step_law(law, p, before, now, z, z1)[0]
        before = Inputs(x[k], v[k], a[k], V[k], h, 0.0, 0.0, False)
        if k > 0:
            for i in range(setup.n_own):
                z[i] = z1[i]
        h = dt


def compiled_history(functions: Functions, effects: bool = True) -> Callable[..., None]:
    """Return the compiled `force_history`, or `law_history` where there are no effects.

    The first call on a machine takes seconds, that without effects one or two.
    """
    from ..core.jit import compiled

    one, inline = (force_history, _INLINE) if effects else (law_history, _INLINE_LAW)
    with _ONE_AT_A_TIME:  # threads that try effects ask for it at once
        if one.__name__ in _ahead and functions.link(one) is one:
            _ahead[one.__name__].wait()
        found: Callable[..., None] = compiled(functions.link(one), inline)
        return found


def compile_ahead(law: str = "", effects: Collection[str] = ()) -> None:
    """Begin to compile what predicts forces in other processes, where no machine code is kept yet.

    Parameters
    ----------
    law, effects : what will be asked for; without a law it is every law with many an effect, for
        which all of a user's own are then one set
    """
    from ..core.jit import digest, kept

    if not law:
        damper.SETS.of(*laws_of("damper"), *effects_of("damper"))
        structure.SETS.of(*effects_of("structure"))
    elif functions_of(law, effects).link(force_history) is not force_history:
        return
    for one in (force_history, law_history) if effects or not law else (law_history,):
        before = _ahead.get(one.__name__)
        if (before is None or not before.at_work) and not kept(one):
            process = begun(one.__name__, digest(one))
            if process is not None:
                _ahead[one.__name__] = process


def keep(name: str, wanted: str) -> None:
    """Compile a function by its name and print that it is kept, unless its digest is another here.

    Parameters
    ----------
    name : law_history or force_history
    wanted : the digest that it must have
    """
    from ..core.jit import digest

    if digest({one.__name__: one for one in (law_history, force_history)}[name]) != wanted:
        return
    still = np.zeros(2)
    effects = [] if name == law_history.__name__ else [LIBRARY.slots.effects[0].name]
    DamperForces(next(iter(LAWS)), effects).force(still, still, still, still, 1e-3, {})
    print(name, flush=True)


BESIDES = 1000
"""Steps that take about as long as what stands around a simulation."""

ALONE, HEAVY = 0.4, 3.0
"""What a step of a law without effects costs, and by how much one costs more of a law with several
states, which finds them by trials: a step of a plain law with an effect costs 1."""


class Effort:
    """What a search has spent: `steps` of dampers' forces, which are as many on every machine.

    `most` is what it may spend.
    """

    def __init__(self, most: float = inf) -> None:
        self.steps, self.most = 0.0, most
        self._lock = Lock()

    def add(self, steps: float) -> None:
        """Count more steps; from any thread."""
        with self._lock:
            self.steps += steps

    @property
    def spent(self) -> bool:
        """Whether no more is to be begun."""
        return self.steps > self.most


_effort: ContextVar[Effort | None] = ContextVar("effort", default=None)


def left() -> float:
    """Return how many steps may still be spent in this context."""
    return inf if (effort := _effort.get()) is None else effort.most - effort.steps


@contextmanager
def counted(most: float = inf, least: float = -inf) -> Iterator[Effort]:
    """Count the steps of all dampers' forces in this context, and in threads begun in it.

    Within another count no more may be spent than what that has left, and always `least`.
    """
    effort, outer = Effort(max(least, min(most, left()))), _effort.get()
    token = _effort.set(effort)
    try:
        yield effort
    finally:
        _effort.reset(token)
        if outer is not None:
            outer.add(effort.steps)


class DamperForces:
    """Predicts the damper's force for one law and one set of effects.

    Parameters
    ----------
    law : str
        A damper's law, such as "bingham".
    effects : list of str
        The effects that are on.
    """

    def __init__(self, law: str, effects: list[str]) -> None:
        self.law = law
        self.effects = list(effects)
        functions = functions_of(law, self.effects)
        slots = functions.slots
        self._setup = setup_of(law, {}, self.effects, np.array, _slots)
        self._history = compiled_history(functions, self._setup.active)
        # An effect that changes a parameter does so to the values of each run.
        self._plain = np.array(pack_into(law, {}, slots))
        self._changes = np.array(changes_of(law, slots))
        self._change = functions.link(change_parameters)
        # Laid down once: fits ask for thousands of forces, and to find each place takes its time.
        self._places = parameter_places(law, slots)
        self._state_places = state_places(law, slots)
        self._begins = [
            (slot, signal)
            for state, signal in _starts(law, slots).items()
            if (slot := self._state_places.get(f"{state}_0")) is not None
        ]
        self._states, self._work = slots.z_size, room(slots.z_size)
        self._joint = any(one.joint for one in slots.effects if one.name in effects)
        self._dear = HEAVY if len(LAWS[law].states) > 1 else 1.0 if effects else ALONE

    def force(
        self, x: Array, v: Array, a: Array, V: Array, dt: float, values: dict[str, float],
        tracks: Mapping[str, Array] = _NO_TRACKS,
    ) -> Array:  # fmt: skip
        """Return the force (n,) [N] for a motion and a voltage.

        Parameters
        ----------
        x, v, a : (n,) m, m/s, m/s2
        V : (n,) V
        dt : sampling step [s]
        values : parameters by name in SI; missing ones take their defaults. The start values of
            states end in `_0`; those that start with a signal take its first value
        tracks : (n,) in SI by name, of parameters of effects that change over the run
        """
        if (effort := _effort.get()) is not None:
            substeps = ceil(dt / IMPLICIT_STEP) if self._joint else 1
            effort.add(self._dear * len(x) * substeps + BESIDES)
        p, z = self._plain.copy(), np.zeros(self._states)
        first = {"x": x[0], "v": v[0], "a": a[0], "V": V[0]}
        for slot, signal in self._begins:
            z[slot] = first[signal]
        for name, value in values.items():
            for slot in self._places.get(name, ()):
                p[slot] = value
            if name in self._state_places:
                z[self._state_places[name]] = value
        self._change(p, self._setup.on, self._changes)
        setup = self._setup._replace(p=p)
        out = np.empty(len(x))
        # Each layout in memory would be compiled by itself.
        x, v, a, V = (np.ascontiguousarray(channel) for channel in (x, v, a, V))
        motion = Inputs(x, v, a, V, dt, 0.0, 0.0, False)
        slots = [self._places[name][0] for name in tracks]
        changing = Tracks(
            np.array(slots, dtype=np.int64),
            np.array(list(tracks.values()), dtype=float).reshape(len(slots), len(x)),
        )
        work = np.zeros(self._work)
        self._history(setup, motion, changing, z, np.zeros_like(z), work, out)
        return out


def _starts(law: str, slots: Slots) -> dict[str, str]:
    """Return the signal that each state begins with, of those that a motion has, by the state."""
    begun = {
        f"{effect.name}.{state}": signal
        for effect in slots.effects
        for state, signal in effect.starts.items()
        if signal in _SIGNALS
    }
    return {**begun, **LAWS[law].starts}


def _slots(numbers: list[Any]) -> NDArray[Any]:
    """Return switches or slots as arrays of one kind, whatever their number."""
    return np.array(numbers, dtype=np.bool_ if isinstance(numbers[0], bool) else np.int64)


# The forces of a building's effects along a motion, compiled.


class Chain(NamedTuple):
    """The levels up to the one that moves, as effects of a building see them.

    `n` their number; `stiffnesses` (n,) below each [N/m]; `isolated` whether the first is the base
    on its isolation layer; `dt` the sampling step [s]; `level` (2 n,), `forces` (n,) and `states`
    room to work.
    """

    n: int
    stiffnesses: Array
    isolated: bool
    dt: float
    level: Array
    forces: Array
    states: Array


def forces_along(chain: Any, x: Any, v: Any, z: Any, p: Any, on: Any, out: Any) -> None:
    """Fill `out` (m,) with what effects add to the force of the highest level [N].

    The levels below rest. A contact slides wherever the motion is not zero: whoever asks leaves out
    the samples at rest.

    Parameters
    ----------
    chain : the levels up to the one that moves
    x, v : (m,) motion relative to the level below [m, m/s]
    z : states of all effects, moved on in place
    p, on : flat parameters of all effects [SI], and (effects,) whether each is on
    out : (m,) N, filled
    """
    n, stiffnesses, isolated, dt = chain.n, chain.stiffnesses, chain.isolated, chain.dt
    level, forces, z1 = chain.level, chain.forces, chain.states
    for k in range(len(x)):
        if k > 0:
            level[n - 1] = 0.5 * (x[k - 1] + x[k])
            level[2 * n - 1] = 0.5 * (v[k - 1] + v[k])
            stick_force = 1e300 if level[2 * n - 1] > 0.0 else -1e300
            advance_effects(
                n, isolated, stiffnesses, level, dt, 0.0, stick_force, 0.0, z, p, on, z1
            )
            for i in range(len(z)):
                z[i] = z1[i]
        level[n - 1] = x[k]
        level[2 * n - 1] = v[k]
        stick_force = 1e300 if v[k] > 0.0 else -1e300
        effect_forces(n, isolated, stiffnesses, level, dt, 0.0, stick_force, z, p, on, forces)
        out[k] = forces[n - 1]
        if n == 1:
            out[k] += contact_force(n, isolated, stiffnesses, level, dt, 0.0, stick_force, z, p, on)


class StructureForces:
    """Evaluates effects of the structure along a motion.

    Parameters
    ----------
    effects : list of str
        The effects that are on; those of other sites are left out.
    storey : int
        0 for the isolation layer, else the number of the storey whose drift the motion is.
    """

    def __init__(self, effects: list[str], storey: int) -> None:
        from ..core.jit import compiled

        functions = structure.functions_of(effects)
        self._slots = functions.slots
        self.on = np.array([e.name in effects for e in self._slots.effects], dtype=np.bool_)
        self.active = bool(self.on.any())
        self._storey = storey
        self._forces = compiled(functions.link(forces_along))  # seconds, once on a machine

    def force(
        self, x: Array, v: Array, dt: float, stiffness: float, values: dict[str, float]
    ) -> Array:
        """Return the effects' force (m,) [N] along a motion.

        Parameters
        ----------
        x, v : (m,) motion relative to the level below [m, m/s]
        dt : sampling step [s]
        stiffness : of the linear spring there [N/m]
        values : parameters in SI by name, effect.parameter; missing ones take their defaults
        """
        out = np.zeros(len(x))
        if not self.active:
            return out
        p = np.array(structure.pack(values, self._slots) or [0.0])
        n = max(1, self._storey)
        z = np.array(structure.start_states(n, values, self._slots) or [0.0])
        chain = Chain(
            n, np.full(n, stiffness), self._storey == 0, dt, np.zeros(2 * n), np.zeros(n),
            np.zeros_like(z),
        )  # fmt: skip
        path = np.ascontiguousarray(x), np.ascontiguousarray(v)
        self._forces(chain, *path, z, p, self.on, out)
        return out
