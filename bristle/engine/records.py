"""What the time loop knows of each component: one record of numbers per source, damper, structure,
sampled component.

Records rather than objects, because compiled code reads their fields at no cost. Matrices lie flat
and row by row in fields that have room for the largest building, so one compiled loop fits all.

`inputs` are the slots of a component's inputs in the signals, `first` that of its first output; its
other outputs, the hidden ones too, follow. `before` and `now` are the inputs at begin and end of a
substep, `state` and `new_state` the states there.
"""

from __future__ import annotations

from math import ceil
from typing import Any

import numpy as np

from ..component import damper as damper_component
from ..component import structure as structure_component
from ..component.damper import Constants
from ..component.source import Constants as SourceConstants
from ..component.structure import DEVICE_FORCES
from ..component.structure import Constants as StructureConstants
from ..fmu import controller
from ..physics import damper, structure
from ..physics.building import MAX_FLOORS, MOST_DEVICES
from ..physics.generate import Slots
from ..physics.linear import Row
from ..physics.signals import PARAMETERS

LEVELS = MAX_FLOORS + 1
"""Most levels of a building, an isolated base included."""

_INT = np.int64
_FLOAT = np.float64
_FLAG = np.bool_
_SWITCH = np.int8  # compiled code knows no arrays of flags inside records


def _inputs(count: int) -> list[tuple[str, type, tuple[int]]]:
    return [("inputs", _INT, (count,)), ("before", _FLOAT, (count,)), ("now", _FLOAT, (count,))]


def source_record() -> np.dtype[np.void]:
    """Return the record of a source; `begin`, `end` bound its samples among those of all."""
    return np.dtype(
        [
            *((name, _INT) for name in ("kind", "begin", "end", "first")),
            *((name, _FLOAT) for name in ("scale", "delay")),
            ("rated", _FLAG),
            ("p", _FLOAT, (len(PARAMETERS),)),
        ],
        align=True,
    )


def damper_record(slots: Slots = damper.LIBRARY.slots) -> np.dtype[np.void]:
    """Return the record of a damper: see `component.damper.Constants`, and what couples it.

    smooth, smooth_1, smooth_2 are the force without friction at the ends of the last substeps;
    found, tried, excess belong to the sweeps; `jumps` says that its voltage has. `sharing` dampers
    bring what they push of structure `on_structure` (-1: none) to rest together, each between
    levels `lower` and `upper`; `holding` is the slot of the force that would hold it.
    """
    size, effects = slots.z_size, len(slots.effects)
    states = size + damper_component.REMEMBERED
    forces = ("smooth", "smooth_1", "smooth_2", "found", "tried", "excess")
    return np.dtype(
        [
            *((name, _INT) for name in ("law", "n_moving", "n_own", "first")),
            *((name, _INT) for name in ("on_structure", "holding", "lower", "upper")),
            *((name, _FLOAT) for name in ("v_max", "stroke", "moving_mass", "sharing", *forces)),
            *((name, _FLAG) for name in ("active", "advances", "signed", "lags")),
            *((name, _FLAG) for name in ("measured", "jumps")),
            ("range", _FLOAT, (len(damper_component.RANGE),)),
            *_inputs(5),
            *((name, _FLOAT, (states,)) for name in ("state", "new_state")),
            ("p", _FLOAT, (slots.p_size,)),
            ("moving", _INT, (max(1, size),)),
            ("on", _SWITCH, (max(1, effects),)),
            ("work", _FLOAT, (damper.room(states),)),
        ],
        align=True,
    )


def structure_record(slots: Slots = structure.SETS.library.slots) -> np.dtype[np.void]:
    """Return the record of a structure: see `component.structure.Constants`, and what couples it.

    `forces` are the slots of the inputs behind the first three, those of the `devices`; `friction`,
    `extra_friction` and `frictions` those of how much of the damper's force, the extra one and the
    devices' is friction.
    smooth0 is the damper's and the extra force without friction at the start, `smooths` that of
    each device. It is `followed` by a component that reads more than its motion.
    """
    n, most = LEVELS, MOST_DEVICES
    states = 3 * n + 1 + structure.state_size(n, slots)
    signals = ("first", "friction", "extra_friction")
    return np.dtype(
        [
            *((name, _INT) for name in ("n", "n_states", "devices", *signals)),
            *((name, _FLOAT) for name in ("mass", "h", "smooth0")),
            *((name, _FLAG) for name in ("active", "touches", "isolated", "followed")),
            ("inputs", _INT, (DEVICE_FORCES,)),
            *((name, _FLOAT, (DEVICE_FORCES + most,)) for name in ("before", "now")),
            *((name, _FLOAT, (states,)) for name in ("state", "new_state")),
            ("stiffnesses", _FLOAT, (n,)),
            *((name, _FLOAT, (n * n,)) for name in ("m_inverse", "damping", "stiffness")),
            ("phi", _FLOAT, (4 * n * n,)),
            *((name, _FLOAT, (2 * n * (n + 1),)) for name in ("held", "ramp")),
            ("p", _FLOAT, (max(1, slots.p_size),)),
            ("on", _SWITCH, (max(1, len(slots.effects)),)),
            ("work", _FLOAT, (structure_component.room(n, slots),)),
            ("ends", _INT, (2 * most,)),
            *((name, _INT, (most,)) for name in ("forces", "frictions")),
            ("smooths", _FLOAT, (most,)),
        ],
        align=True,
    )


def sampled_record() -> np.dtype[np.void]:
    """Return the record of a controller or of sensors: what acts on a clock of its own.

    See `component.controller.Constants` and `component.sensors.Constants`. Sequences whose length
    differs begin and end at these places of the run's constants, and in its memory, where state,
    room to work and `end` follow each other. A clock whose instants are all ends of substeps is
    `aligned`; sample `coming` is the next. It `senses`, or commands.
    """
    m = len(controller.MEASURED)
    matrices = [name + end for name in ("A", "B", "W", "C") for end in ("", "_end")]
    places = (*matrices, "state", "work", "end")
    numbers = ("v_max", "velocity_corner", "v_top", "f_min", "anti_windup", "still", "least_slope")
    own = ("gains", "biases", "deviation", "quantisation", "corner", "share")
    return np.dtype(
        [
            *(
                (name, _INT)
                for name in ("kind", "law", "n", "rows", "seed", "size", "coming", "first")
            ),
            *((name, _INT) for name in places),
            *((name, _FLOAT) for name in ("period", *numbers, "gain", "integral_corner")),
            *((name, _FLAG) for name in ("aligned", "senses")),
            *_inputs(m),
            *((name, _FLOAT, (m,)) for name in own),
            *((name, _INT, (m,)) for name in ("length", "ring")),
            ("p", _FLOAT, (damper.LIBRARY.slots.law_parameters,)),
        ],
        align=True,
    )


# Lays what components compute with out in the records of the time loop, in plain flat functions.
#
# They run in Python, for a run of the coupled engine, and compiled, in a scenario that is one FMU.
# A component's constants come first, then its wiring: numbers that say where its signals are. What
# dampers need to know of the structures that they push comes last, see `coupled.couple`.

NOWHERE = -1
"""Stands for a structure, a slot or an input where there is none."""

(
    _FIRST, ON_STRUCTURE, HOLDING, MEASURED, LOWER, UPPER, DAMPER_INPUTS,
) = range(7)  # fmt: skip
"""Wiring of a damper: the slot of its first output; the structure that it pushes and feels, the
slot of the force that would hold that; whether it is given the acceleration; the levels of the
device that it pushes; the slots of its inputs."""

FOLLOWED, FRICTION, EXTRA_FRICTION, STRUCTURE_INPUTS = range(1, 5)
"""Wiring of a structure: the slot of its first output; whether more than its motion is read; the
slots of the friction in the damper's force and in the extra one; those of its inputs; those of the
friction in each device's force."""

SAMPLED_INPUTS = 1
"""Wiring of a sampled component: the slot of its first output; those of its inputs."""


def lay_source(g: Any, c: SourceConstants, first: int, begin: int) -> None:
    """Fill in the record of a source.

    Parameters
    ----------
    g : record, see `source_record`
    c : Constants
    first : slot of its first output
    begin : place of its first sample among those of all sources
    """
    g["first"], g["begin"], g["end"] = first, begin, begin + len(c.times)
    g["kind"], g["scale"], g["delay"], g["rated"] = c.kind, c.scale, c.delay, c.rated
    for i in range(len(c.p)):
        g["p"][i] = c.p[i]


def lay_damper(d: Any, c: Constants, state: Row, wiring: Row) -> None:
    """Fill in the record of a damper; `coupled.couple` comes when all records are there.

    Parameters
    ----------
    d : record, see `damper_record`
    c : Constants
    state : states of law and effects at the start, and what `component.damper` keeps behind them
    wiring : numbers, see `DAMPER_INPUTS`
    """
    own = c.setup
    d["law"], d["n_moving"], d["n_own"] = own.law, own.n_moving, own.n_own
    d["active"], d["advances"] = own.active, own.advances
    d["signed"], d["lags"] = own.signed, own.lags
    d["v_max"], d["stroke"] = c.v_max, c.stroke
    for i in range(len(c.range)):
        d["range"][i] = c.range[i]
    for i in range(len(state)):
        d["state"][i] = d["new_state"][i] = state[i]
    for i in range(len(own.p)):
        d["p"][i] = own.p[i]
    for i in range(len(own.on)):
        d["on"][i] = int(own.on[i])
    for i in range(len(own.moving)):
        d["moving"][i] = int(own.moving[i])
    d["first"], d["measured"] = int(wiring[_FIRST]), c.measured or wiring[MEASURED] != 0.0
    d["on_structure"], d["holding"] = int(wiring[ON_STRUCTURE]), int(wiring[HOLDING])
    d["lower"], d["upper"] = int(wiring[LOWER]), int(wiring[UPPER])
    d["moving_mass"], d["sharing"] = 0.0, 1.0
    for i in range(len(wiring) - DAMPER_INPUTS):
        d["inputs"][i] = int(wiring[DAMPER_INPUTS + i])


def lay_structure(b: Any, c: StructureConstants, state: Row, wiring: Row) -> None:
    """Fill in the record of a structure.

    Parameters
    ----------
    b : record, see `structure_record`
    c : Constants, with the matrices of a substep
    state : as `component.structure` lays it down, at the start
    wiring : numbers, see `STRUCTURE_INPUTS`
    """
    lay_matrices(b, c)
    b["n"], b["mass"], b["isolated"], b["devices"] = c.n, c.mass, c.isolated, c.devices
    b["active"], b["touches"], b["n_states"] = c.active, c.touches, len(state)
    for i in range(len(state)):
        b["state"][i] = b["new_state"][i] = state[i]
    for i in range(len(c.p)):
        b["p"][i] = c.p[i]
    for i in range(len(c.on)):
        b["on"][i] = int(c.on[i])
    for i in range(2 * c.devices):
        b["ends"][i] = int(c.ends[i])
    b["first"], b["followed"] = int(wiring[_FIRST]), wiring[FOLLOWED] != 0.0
    b["friction"], b["extra_friction"] = int(wiring[FRICTION]), int(wiring[EXTRA_FRICTION])
    for i in range(DEVICE_FORCES):
        b["inputs"][i] = int(wiring[STRUCTURE_INPUTS + i])
    at = STRUCTURE_INPUTS + DEVICE_FORCES
    for i in range(c.devices):
        b["forces"][i] = int(wiring[at + i])
        b["frictions"][i] = int(wiring[at + c.devices + i])


def lay_matrices(b: Any, c: StructureConstants) -> None:
    """Fill in what the length of a substep implies of a structure, and its other matrices.

    Parameters
    ----------
    b, c : as in `lay_structure`
    """
    b["h"] = c.h
    for i in range(c.n):
        b["stiffnesses"][i] = c.stiffnesses[i]
    for i in range(c.n * c.n):
        b["m_inverse"][i], b["damping"][i] = c.m_inverse[i], c.damping[i]
        b["stiffness"][i] = c.stiffness[i]
    for i in range(4 * c.n * c.n):
        b["phi"][i] = c.phi[i]
    for i in range(2 * c.n * (c.n + 1)):
        b["held"][i], b["ramp"][i] = c.held[i], c.ramp[i]


def lay_sampled(r: Any, period: float, wiring: Row, h: float) -> None:
    """Fill in what the records of controllers and of sensors have in common.

    Parameters
    ----------
    r : record, see `sampled_record`
    period : time between two samples [s]
    wiring : numbers, see `SAMPLED_INPUTS`
    h : substep [s]
    """
    r["first"], r["period"], r["aligned"] = int(wiring[_FIRST]), period, is_whole(period, h)
    r["coming"] = 0
    for i in range(len(wiring) - SAMPLED_INPUTS):
        r["inputs"][i] = int(wiring[SAMPLED_INPUTS + i])


def lay_controller(r: Any, c: Any) -> None:
    """Fill in the record of a controller but for the places of its matrices.

    Parameters
    ----------
    r : record, see `sampled_record`
    c : `component.controller.Constants`
    """
    r["senses"] = False
    r["kind"], r["law"], r["n"], r["rows"] = c.kind, c.law, c.n, c.rows
    r["v_max"], r["velocity_corner"], r["v_top"] = c.v_max, c.velocity_corner, c.v_top
    r["f_min"], r["anti_windup"], r["still"] = c.f_min, c.anti_windup, c.still
    r["least_slope"], r["gain"], r["integral_corner"] = c.least_slope, c.gain, c.integral_corner
    for i in range(len(c.p)):
        r["p"][i] = c.p[i]


def lay_sensors(r: Any, c: Any) -> None:
    """Fill in the record of sensors.

    Parameters
    ----------
    r : record, see `sampled_record`
    c : `component.sensors.Constants`
    """
    r["senses"], r["seed"], r["size"] = True, c.seed, c.size
    for i in range(len(c.gains)):
        r["gains"][i], r["biases"][i], r["deviation"][i] = c.gains[i], c.biases[i], c.deviation[i]
        r["quantisation"][i], r["corner"][i] = c.quantisation[i], c.corner[i]
        r["share"][i], r["length"][i] = c.share[i], int(c.length[i])
        r["ring"][i] = int(c.ring[i])


ROUNDING = 1e-6
"""Share of a substep by which a sample period may miss a whole number of them."""


def is_whole(period: float, h: float) -> bool:
    """Return whether a period [s] is a whole number of substeps of h [s]."""
    return abs(period / h - round(period / h)) <= ROUNDING


def substeps_in(step: float, longest: float, periods: Row) -> int:
    """Return into how many substeps a step is cut: at best so that instants fall on their ends.

    Parameters
    ----------
    step, longest : length of the step, and of a substep at most [s]
    periods : sample periods [s]
    """
    least = max(1, ceil(step / longest - 1e-9))
    for n in range(least, 4 * least):
        whole = True
        for i in range(len(periods)):
            whole = whole and is_whole(periods[i], step / n)
        if whole:
            return n
    return least
