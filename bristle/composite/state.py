"""The state of a whole scenario: numbers, signals, the records of the time loop as they are."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..physics.codegen import Link
from ..physics.linear import Row
from ..physics.rows import row
from ..simulate import records
from ..simulate.coupled import linked
from ..simulate.pushed import room
from ..simulate.system import System
from .rows import (
    CONTROLLER,
    DAMPERS,
    FIRST_PARAMETER,
    GENERAL,
    KIND,
    PARTS,
    SAMPLED,
    SHOWN,
    SIGNALS,
    SLOTS,
    SOURCES,
    STRUCTURES,
    about,
    part_sizes,
    store_size,
)

ORIGIN, BASE, COUNT, SUBSTEP, SCALE = range(5)
NUMBERS = 8
"""What the state begins with: the begin of the run [s]; substeps count from the time `BASE` [s] on,
each of so many seconds; the largest force so far [N]. Behind them the signals, the inputs at the
last step, and the records and the memory of the time loop."""

SOURCE_RECORD = records.source_record()
DAMPER_RECORD, STRUCTURE_RECORD = records.damper_record(), records.structure_record()
SAMPLED_RECORD = records.sampled_record()
SOURCE_SIZE, DAMPER_SIZE, STRUCTURE_SIZE, SAMPLED_SIZE = (
    record.itemsize // 8
    for record in (SOURCE_RECORD, DAMPER_RECORD, STRUCTURE_RECORD, SAMPLED_RECORD)
)


def fitted(system: System) -> Link:
    """Return what fits functions of a whole scenario to the laws and effects of its components."""
    damper = records.damper_record(system.dampers.slots)
    structure = records.structure_record(system.structures.slots)
    return linked(
        system.dampers, system.structures,
        DAMPER_RECORD=damper, DAMPER_SIZE=damper.itemsize // 8,
        STRUCTURE_RECORD=structure, STRUCTURE_SIZE=structure.itemsize // 8,
    )  # fmt: skip


class Opened(NamedTuple):
    """The state of a whole scenario, apart."""

    signals: Any
    kept: Any
    sources: Any
    dampers: Any
    structures: Any
    sampled: Any
    memory: Any


def opened(state: Row, baked: Row) -> Opened:
    """Return the parts of a state; in compiled code they are views."""
    general = row(baked, GENERAL)
    a = NUMBERS + len(row(baked, SIGNALS))
    b = a + len(row(baked, SLOTS))
    c = b + int(general[SOURCES]) * SOURCE_SIZE
    d = c + int(general[DAMPERS]) * DAMPER_SIZE
    e = d + int(general[STRUCTURES]) * STRUCTURE_SIZE
    f = e + int(general[SAMPLED]) * SAMPLED_SIZE
    return Opened(
        state[NUMBERS:a], state[a:b], state[b:c].view(SOURCE_RECORD),
        state[c:d].view(DAMPER_RECORD), state[d:e].view(STRUCTURE_RECORD),
        state[e:f].view(SAMPLED_RECORD), state[f:],
    )  # fmt: skip


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take.

    Parameters
    ----------
    values, baked : as in `rows.setup`
    counts : (4,) filled

    Returns
    -------
    int
        0.
    """
    general = row(baked, GENERAL)
    dampers, inputs = int(general[DAMPERS]), len(row(baked, SLOTS))
    state = NUMBERS + len(row(baked, SIGNALS)) + inputs + dampers * DAMPER_SIZE
    state += int(general[SOURCES]) * SOURCE_SIZE + int(general[SAMPLED]) * SAMPLED_SIZE
    state += int(general[STRUCTURES]) * STRUCTURE_SIZE
    store, most = store_size(values, baked, counts)
    for k in range(int(general[PARTS])):
        if int(about(baked, k)[KIND]) >= CONTROLLER:
            part_sizes(k, values[int(about(baked, k)[FIRST_PARAMETER]) :], baked, counts)
            state += int(counts[1]) + int(counts[3])
    counts[0], counts[1], counts[2] = store, state, len(row(baked, SHOWN))
    counts[3] = state + inputs + most + room(dampers)
    return 0
