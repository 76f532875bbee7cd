"""What the time loop knows of each component: one record of numbers per source, damper, structure,
sampled component.

Records rather than objects, because compiled code reads their fields at no cost. Matrices lie flat
and row by row in fields that have room for the largest building, so one compiled loop fits all.

`inputs` are the slots of a component's inputs in the signals, `first` that of its first output; its
other outputs, the hidden ones too, follow. `before` and `now` are the inputs at begin and end of a
substep, `state` and `new_state` the states there.
"""

from __future__ import annotations

import numpy as np

from ..component import damper as damper_component
from ..component import structure as structure_component
from ..component.devices import DEVICE_FORCES
from ..fmu.controller import MEASURED
from ..physics import damper, structure
from ..physics.building import MAX_FLOORS
from ..physics.codegen import Slots
from ..physics.device import MOST_DEVICES
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
    smooth0 is the damper's and the extra force without friction at the begin, `smooths` that of
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
    m = len(MEASURED)
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
