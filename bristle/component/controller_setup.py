"""What a design and its parameters imply of a controller's constants, from flat numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import NamedTuple

from ..control.controller import Controller
from ..control.policy import BESIDES, hidden_units
from ..physics.linear import Row, copy
from ..physics.rows import open_row, packed, row

CLIPPED, INVERSE, SIGNED, CLIPPED_LQG, SKYHOOK_SWITCH, SKYHOOK_INVERSE, POLICY = range(7)
"""Kinds of controllers."""

REMEMBERED = 6
"""How many numbers the state holds behind those of the laws."""

NO_VELOCITY, NO_KIND, NO_INVERSE = -2, -3, -4
"""Why a controller cannot be set up: a text is none of its words."""

FIELDS = (
    "sample_period", "v_max", "velocity", "velocity_corner", "f_min", "anti_windup", "kind", "gain",
    "integral_corner", "inverse", "still", "least_slope",
)  # fmt: skip
"""What the values of a controller may hold besides the parameters of the laws to invert."""

_BUILT, _FIELDS, _BAKED_A, _BAKED_B, _BAKED_W, _BAKED_C, _LAWS, _COUNTS, _PARAMETERS = range(9)
_FIXED_KIND, _STATES, _TABLE, _FASTEST, _LAW_STATES = range(5)
(
    _PERIOD, _V_MAX, _VELOCITY, _CORNER, _F_MIN, _ANTI_WINDUP, _CHOSEN, _GAIN, _INTEGRAL, _INVERSE,
    _STILL, _LEAST,
) = range(len(FIELDS))  # fmt: skip

_NUMBERS, _A, _B, _W, _C, _P = range(6)
_KIND, _N, _ROWS, _V_TOP, _LAW = range(len(FIELDS), len(FIELDS) + 5)
_COUNT = _LAW + 1


class Constants(NamedTuple):
    """What a controller computes with; what its kind does not need is 0.

    `n`, `rows`, `v_top`, `A`, `B`, `W`, `C` are those of `control.controller.Controller`;
    `velocity_corner` [rad/s] is that of the low-passed displacement whose rate is the velocity, 0:
    the velocity is measured; `law` and `p` say which damper's law is inverted, `still` and
    `least_slope` how; `gain` and `integral_corner` [rad/s] belong to skyhook.
    """

    kind: int
    period: float
    v_max: float
    velocity_corner: float
    n: int
    rows: int
    v_top: float
    A: Row
    B: Row
    W: Row
    C: Row
    f_min: float
    anti_windup: float
    law: int
    p: Row
    still: float
    least_slope: float
    gain: float
    integral_corner: float


def bake(
    names: Sequence[str], kind: int | None, design: Controller | None,
    laws: Mapping[str, tuple[int, Sequence[str]]], law_states: int,
) -> list[float]:  # fmt: skip
    """Return what a build fixes of a controller.

    They are rows: sizes and the kind; the index of each of `FIELDS` among the values, -1 where it
    is none; the matrices of the design; the codes of the laws that can be inverted, the numbers of
    their parameters, and the indices of these among the values.

    Parameters
    ----------
    names : of the values, in their order
    kind : which of the kinds; None: the value of `kind` says switch or inverse, of skyhook
    design : of the state-space law; None: there is none
    laws : by name, in the order of the words of `inverse`, code and names of parameters among
        the values
    law_states : how many states of a law the controller estimates at most
    """
    at = {name: index for index, name in enumerate(names)}
    sizes = [-1 if kind is None else kind, 0, 1, 0.0, law_states]
    matrices: list[Sequence[float]] = [[], [], [], []]
    if design is not None:
        sizes[1:4] = design.n, design.rows, design.v_top
        matrices = [design.A, design.B, design.W, design.C]
    found = [at.get(name, -1) for name in FIELDS]
    codes = [code for code, _ in laws.values()]
    counts = [len(own) for _, own in laws.values()]
    indices = [at[name] for _, own in laws.values() for name in own]
    return packed(sizes, found, *matrices, codes, counts, indices)


def sizes(values: Row, baked: Row, counts: Row) -> int:
    """Fill in how many floats constants, state, outputs and work take.

    Parameters
    ----------
    values, baked : as in `setup`
    counts : (4,) filled

    Returns
    -------
    int
        0.
    """
    built = row(baked, _BUILT)
    n = int(built[_STATES])
    matrices = 0
    for k in range(4):
        matrices += len(row(baked, _BAKED_A + k))
    counts[0] = _P + 1 + _COUNT + matrices + len(row(baked, _PARAMETERS))
    counts[1], counts[2], counts[3] = n + built[_LAW_STATES] + REMEMBERED, 3, n + 4
    if built[_FIXED_KIND] == POLICY:
        counts[3] += n + BESIDES + hidden_units(n, len(row(baked, _BAKED_W)))
    return 0


def setup(values: Row, given: Row, baked: Row, store: Row, state: Row) -> int:
    """Fill in what parameters imply.

    Parameters
    ----------
    values : of the parameters, in the order of the names that were baked
    given : (4,) not used
    baked : as `bake` returns it
    store, state : of the sizes of `sizes`, zero; the store is filled

    Returns
    -------
    int
        0, `NO_VELOCITY`, `NO_KIND` or `NO_INVERSE`.
    """
    built, fields = row(baked, _BUILT), row(baked, _FIELDS)
    at = open_row(store, _NUMBERS, _COUNT)
    for i in range(len(fields)):
        store[at + i] = values[int(fields[i])] if fields[i] >= 0.0 else 0.0
    if fields[_LEAST] < 0.0:
        store[at + _LEAST] = 1.0
    if store[at + _VELOCITY] < 0.0:
        return NO_VELOCITY
    filtered = store[at + _VELOCITY] != 0.0
    store[at + _CORNER] = 2.0 * pi * store[at + _CORNER] if filtered else 0.0
    store[at + _INTEGRAL] = 2.0 * pi * store[at + _INTEGRAL]
    store[at + _KIND] = built[_FIXED_KIND]
    if built[_FIXED_KIND] < 0.0:
        store[at + _KIND] = SKYHOOK_SWITCH + store[at + _CHOSEN]
        if store[at + _CHOSEN] < 0.0:
            return NO_KIND
    if store[at + _INVERSE] < 0.0:
        return NO_INVERSE
    store[at + _N], store[at + _ROWS] = built[_STATES], built[_TABLE]
    store[at + _V_TOP] = built[_FASTEST]
    for k in range(4):
        matrix = row(baked, _BAKED_A + k)
        copy(matrix, 0, store, open_row(store, _A + k, len(matrix)), len(matrix))
    take_law(values, baked, int(store[at + _INVERSE]), store, at)
    return 0


def take_law(values: Row, baked: Row, chosen: int, store: Row, at: int) -> None:
    """Fill in code and parameters of the law that is inverted.

    Parameters
    ----------
    values, baked, store
        As in `setup`; the rows of `store` before that of the parameters are there.
    chosen : which of the laws it is
    at : where the numbers of the store begin
    """
    codes, counts, indices = row(baked, _LAWS), row(baked, _COUNTS), row(baked, _PARAMETERS)
    store[at + _LAW], count, first = 0.0, 0, 0
    if len(codes) > 0:
        store[at + _LAW], count = codes[chosen], int(counts[chosen])
    for k in range(chosen):
        first += int(counts[k])
    p = open_row(store, _P, count)
    for i in range(count):
        store[p + i] = values[int(indices[first + i])]


def constants(store: Row) -> Constants:
    """Return what `start`, `step` and `output` take; in compiled code its rows are views."""
    c = row(store, _NUMBERS)
    return Constants(
        int(c[_KIND]), c[_PERIOD], c[_V_MAX], c[_CORNER], int(c[_N]), int(c[_ROWS]), c[_V_TOP],
        row(store, _A), row(store, _B), row(store, _W), row(store, _C), c[_F_MIN],
        c[_ANTI_WINDUP], int(c[_LAW]), row(store, _P), c[_STILL], c[_LEAST], c[_GAIN],
        c[_INTEGRAL],
    )  # fmt: skip
