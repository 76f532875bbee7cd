"""What the time march knows of each component: one record of numbers per source, damper, structure,
sampled component.

Records rather than objects, because compiled code reads their fields at no cost. Matrices lie flat
and row by row in fields that have room for the largest building, so one compiled march fits all.
"""

from __future__ import annotations

import numpy as np

from ..fmu.controller import MEASURED
from ..physics import damper, structure
from ..physics.building import MAX_FLOORS
from ..physics.signals import PARAMETERS

LEVELS = MAX_FLOORS + 1
"""Most levels of a building, an isolated base included."""

_INT = np.int64
_FLOAT = np.float64
_FLAG = np.bool_
_SWITCH = np.int8  # compiled code knows no arrays of flags inside records


def source_record() -> np.dtype[np.void]:
    """Return the record of a signal that depends on time alone.

    `begin`, `end` bound its samples, `out` and `rate_out` are the slots of its value and rate (-1:
    none); the value is scale x signal(t - delay).
    """
    return np.dtype(
        [
            *((name, _INT) for name in ("kind", "begin", "end", "out", "rate_out")),
            *((name, _FLOAT) for name in ("delay", "scale")),
            ("p", _FLOAT, (len(PARAMETERS),)),
        ],
        align=True,
    )


def damper_record() -> np.dtype[np.void]:
    """Return the record of a damper.

    x, v, a, V, force, energy, stroke_ratio are slots of signals (a: -1 if it is not given), and so
    is friction, the part of the force that is; x0, v0, a0, V0, force0 hold what a substep began
    from; smooth, smooth_1, smooth_2 the rest of the force at the ends of the last substeps; found,
    tried, excess belong to the sweeps; z and z1 are the states at begin and end.

    `sharing` dampers bring the first level of structure `on_structure` to rest together.
    """
    size, effects = damper.SLOTS.z_size, len(damper.SLOTS.effects)
    integers = ("law", "n_moving", "n_own", "n_states", "on_structure")
    slots = ("x", "v", "a", "V", "force", "friction", "energy", "stroke_ratio")
    begin = ("x0", "v0", "a0", "V0", "force0")
    forces = ("smooth", "smooth_1", "smooth_2", "found", "tried", "excess")
    return np.dtype(
        [
            *((name, _INT) for name in (*integers, *slots)),
            *((name, _FLOAT) for name in ("v_max", "stroke", "sharing", *begin, *forces)),
            *((name, _FLAG) for name in ("active", "advances", "signed", "halts")),
            *((name, _FLOAT, (size,)) for name in ("z", "z1", "spare")),
            ("p", _FLOAT, (damper.SLOTS.p_size,)),
            ("moving", _INT, (size,)),
            ("on", _SWITCH, (max(1, effects),)),
            ("work", _FLOAT, (damper.work_size(),)),
        ],
        align=True,
    )


def structure_record() -> np.dtype[np.void]:
    """Return the record of a structure.

    ground, force, extra, friction, extra_friction, first_output, holding are slots of signals;
    x and x1 the state at begin and end of a substep, free the state without the forces of devices,
    ground0 and smooth0 the ground acceleration and the smooth forces at the begin.

    It `follows` another structure as its ground, or is `followed` by a component that reads more
    than its motion. `gain` is the velocity of the first level per force held over the substep.
    """
    n = LEVELS
    lay = structure.SLOTS
    slots = ("ground", "force", "extra", "friction", "extra_friction", "first_output", "holding")
    return np.dtype(
        [
            *((name, _INT) for name in ("n", *slots)),
            *((name, _FLOAT) for name in ("mass", "gain", "ground0", "smooth0")),
            *((name, _FLAG) for name in ("active", "isolated", "follows", "followed")),
            *((name, _FLOAT, (2 * n,)) for name in ("x", "x1", "free")),
            *((name, _FLOAT, (n,)) for name in ("stiffness", "absolute")),
            *((name, _FLOAT, (n * n,)) for name in ("m_inverse", "c", "k")),
            ("phi", _FLOAT, (4 * n * n,)),
            *((name, _FLOAT, (2 * n * (n + 1),)) for name in ("held", "ramp")),
            *((name, _FLOAT, (max(1, structure.state_size(n)),)) for name in ("z", "z1")),
            ("p", _FLOAT, (max(1, lay.p_size),)),
            ("on", _SWITCH, (max(1, len(lay.effects)),)),
            ("work", _FLOAT, (structure.work_size(n),)),
        ],
        align=True,
    )


def sampled_record() -> np.dtype[np.void]:
    """Return the record of a controller or of sensors: what acts on a clock of its own.

    `inputs`, `outputs` are slots of signals, in the order in which `sample` of the component takes
    and gives them; `now` and `before` what the inputs were at the ends of the last two substeps. A
    clock whose instants are all ends of substeps is `aligned`; `next` is the sample to come.

    The matrices A, B, W, C begin at these places of the run's constants, the state at its place of
    the run's memory. Of sensors, each channel has its own entry in the fields of arrays; `ring`
    and `noise` are places in memory and constants (noise: -1 without any).
    """
    channels = len(MEASURED)
    laws = ("kind", "law", "n", "rows", "A", "B", "W", "C", "state")
    numbers = ("v_max", "f_min", "anti_windup", "v_top", "velocity_corner", "still", "least_slope")
    hook = ("gain", "integral_corner", "absolute", "y_before")
    moving = ("low", "x_before")
    own = ("own_gain", "bias", "quantisation", "corner", "share", "channel_low", "channel_before")
    return np.dtype(
        [
            *((name, _INT) for name in (*laws, "next", "last")),
            *((name, _FLOAT) for name in ("period", *numbers, *hook, *moving)),
            *((name, _FLAG) for name in ("aligned", "filtered", "switches")),
            *((name, _INT, (channels,)) for name in ("inputs", "ring", "length", "noise")),
            *((name, _FLOAT, (channels,)) for name in ("now", "before", *own)),
            ("outputs", _INT, (channels,)),
            ("p", _FLOAT, (damper.SLOTS.law_parameters,)),
            ("z", _FLOAT, (max(1, damper.SLOTS.law_states),)),
        ],
        align=True,
    )
