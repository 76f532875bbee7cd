"""What a damper is given: its inputs at one moment, and how it was set up."""

from __future__ import annotations

from typing import Any, NamedTuple

from .linear import Row


class Inputs(NamedTuple):
    """What acts on a damper at one moment, and the step that leads there.

    `stick_force` is the force that would bring the motion to rest within the step, `sticks` says
    whether it is known. The hooks of a law take this record as `q`: motion and voltage are then
    those across the fluid, behind the effects that change them.
    """

    x: Any  # m; a float, or of a whole motion (n,), and so the next three
    v: Any  # m/s
    a: Any  # m/s2
    V: Any  # V
    dt: float  # s
    energy: float  # J, dissipated so far
    stick_force: float  # N
    sticks: bool


class Setup(NamedTuple):
    """A damper as its functions need it: numbers that stay over a run.

    `law` is the code of the law, `p` the flat parameters of law and effects, `on` the switches;
    `moving` lists the slots of the states that move by `rate`, `n_moving` says how many; `advances`
    whether an effect moves its states by `advance`; `n_own` how many states, the first ones, the
    law itself moves by `advance`; `signed` whether its friction jumps with direction; `active`
    whether more than the law is at work; `lags` whether the command lags by a state of the law.
    """

    law: int
    p: Row
    on: Any
    moving: Any
    n_moving: int
    advances: bool
    n_own: int
    signed: bool
    active: bool
    lags: bool
