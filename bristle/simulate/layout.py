"""Lays what components compute with out in the records of the time loop, in plain flat functions.

They run in Python, for a run of the coupled engine, and compiled, in a scenario that is one FMU. A
component's constants come first, then its wiring: numbers that say where its signals are. What
dampers need to know of the structures that they push comes last, see `pushed.couple`.
"""

from __future__ import annotations

from math import ceil
from typing import Any

from ..component.damper import Constants as DamperConstants
from ..component.devices import DEVICE_FORCES
from ..component.source import Constants as SourceConstants
from ..component.structure import Constants as StructureConstants
from ..physics.linear import Row

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
    g : record, see `records.source_record`
    c : Constants
    first : slot of its first output
    begin : place of its first sample among those of all sources
    """
    g["first"], g["begin"], g["end"] = first, begin, begin + len(c.times)
    g["kind"], g["scale"], g["delay"], g["rated"] = c.kind, c.scale, c.delay, c.rated
    for i in range(len(c.p)):
        g["p"][i] = c.p[i]


def lay_damper(d: Any, c: DamperConstants, state: Row, wiring: Row) -> None:
    """Fill in the record of a damper; `pushed.couple` comes when all records are there.

    Parameters
    ----------
    d : record, see `records.damper_record`
    c : Constants
    state : states of law and effects at the begin, and what `component.damper` keeps behind them
    wiring : numbers, see `DAMPER_INPUTS`
    """
    own = c.setup
    d["law"], d["n_moving"], d["n_own"] = own.law, own.n_moving, own.n_own
    d["active"], d["advances"] = own.active, own.advances
    d["signed"], d["lags"] = own.signed, own.lags
    d["v_max"], d["stroke"] = c.v_max, c.stroke
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
    b : record, see `records.structure_record`
    c : Constants, with the matrices of a substep
    state : as `component.structure` lays it down, at the begin
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
    r : record, see `records.sampled_record`
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
    r : record, see `records.sampled_record`
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
    r : record, see `records.sampled_record`
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
