"""The named tuples that hooks are called with, and the source that makes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from .command import chosen_source, rising
from .forms import Law, choosable
from .linear import Row
from .parameter import climb, fields_of

record = tuple.__new__
"""Makes a named tuple from a tuple, in half the time of calling its class; `jit` knows it too."""

FACTORS = ("slip_length", "yield_factor", "viscous_factor")
"""What the `p` of a law with bristles holds beside its own numbers: the factors by which effects
stretch the travel before sliding, and change the yield force and the viscous part. The last two act
on the forces that the law gives; only what balances forces inside of a law needs them."""

NO_EFFECT = (1.0, 1.0, 1.0)
"""The factors where no effect changes them."""

FORM_STEP = 64
"""By how much codes of laws differ that differ in a chosen form alone; more laws there are not."""

FORM_OF_LAW = f"    form, law = law // {FORM_STEP}, law % {FORM_STEP}"
"""The line of generated source that tells a chosen form from a law's code."""


def made(kind: str, sources: Sequence[str]) -> str:
    """Return the source that makes a named tuple; an empty one needs no names."""
    return f"record({kind}, ({', '.join(sources)},))" if sources else "()"


def listed(fields: Mapping[str, Sequence[str]], tables: Any, at: Mapping[str, str]) -> list[str]:
    """Return the source of each field of a parameter tuple; that of a table is a tuple."""
    return [
        f"({', '.join(at[name] for name in names)})" if field in tables else at[field]
        for field, names in fields.items()
    ]


def law_state(law: Law) -> str:
    """Return the source that makes a law's state tuple from `z`."""
    return made(f"{law.name}_Z", [f"z[{k}]" for k in range(len(law.states))])


def law_values(
    law: Law, factors: Mapping[str, str] | None = None, felt: str = "z", place: int = -1
) -> str:
    """Return the source that makes a law's parameter tuple from `p` at the voltage V.

    Parameters
    ----------
    law : class of a law
    factors : the sources of `FACTORS`, 1 where one is missing
    felt : the sequence of states that holds the voltage of a law with a lag of its own, "" where V
        stands for it
    place : where in `p` the numbers of a chosen form begin, of which the variable `form` tells; -1
        where there is none
    """
    V = f"{felt}[{list(law.states).index(law.felt)}]" if law.felt and felt else "V"
    at = {name: f"p[{k}]" for k, name in enumerate(law.parameters)}
    fields = fields_of(law.parameters, law.tables)
    given = dict(zip(fields, listed(fields, law.tables, at)))
    free = choosable(law) if place >= 0 else {}
    for k, (quantity, form) in enumerate(law.command.items()):
        table = law.tables.get(form.names()[0])
        source = form.source(given.__getitem__, repr(table.knots) if table else "", V)
        free_form = quantity in free
        given[quantity] = chosen_source(source, place, k, V) if free_form else source
    given.update({name: (factors or {}).get(name, "1.0") for name in FACTORS})
    return made(f"{law.base.name}_P", [given[name] for name in law.seen()])


def values_of_law(law: Law, values: Mapping[str, float], V: float) -> Any:
    """Return the `p` of a law's hooks at a voltage V [V]; missing values take their defaults."""
    p = [values.get(name, one.value) for name, one in law.parameters.items()]
    return _maker(law)(p, V)


@cache
def _maker(law: Law) -> Any:
    """Return what makes the `p` of a law's hooks from its flat parameters and the voltage."""
    names = {"record": record, "climb": climb, "rising": rising, f"{law.base.name}_P": law.Values}
    return eval(f"lambda p, V: {law_values(law, felt='')}", names)


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
    whether more than the law is at work; `lags` whether the command lags by a state of the law;
    `heats` whether an effect knows the energy.
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
    heats: bool
