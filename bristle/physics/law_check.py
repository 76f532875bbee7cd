"""What a law may declare, and what its class data must be for it to work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import PhysicsError
from .command import Form, Monotone
from .field_check import PARAMETERS, TABLES, TEXT, TEXT_BY_NAME, TEXTS, by_name, told
from .parameter import check_numbers

if TYPE_CHECKING:
    from .law import Law

SITES = ("damper", "structure")

PARTS = ("yield", "sign", "bristle", "viscous", "spring", "command")
"""What a law may have, and effects may act on.

    yield     a force to be overcome before it slides
    sign      this force jumps with the direction of motion, and at rest it is what holds the motion
    bristle   this force is carried by what bends before it slips
    viscous   a force that grows with speed
    spring    a force that grows with displacement
    command   something depends on the command; found from `command`
"""

SIGNALS = ("x", "v", "a", "V")
"""Signals that a state may begin with."""

HOOKS = {
    "limit": "sign",
    "yielding": "yield",
    "damping": "bristle",
    "viscous": "viscous",
    "elastic": "spring",
}
"""The hooks that give a force [N], each with the part of which it is the force."""

ALL_HOOKS = (*HOOKS, "rate", "advance", "force")


FIELDS = {
    **dict.fromkeys(("name", "site", "place", "stiffness", "source", "felt"), TEXT),
    **dict.fromkeys(("parts", "contains", "assumed"), TEXTS),
    **dict.fromkeys(("states", "starts"), TEXT_BY_NAME),
    "parameters": PARAMETERS,
    "tables": TABLES,
    "command": by_name(
        'a dictionary such as {"yield_force": Linear("f_c", "f_v")}',
        lambda one: isinstance(one, Form) and all(isinstance(n, str) for n in one.names()),
    ),
    "shapes": by_name(
        'a dictionary such as {"v_s": Shape(0.02, 5.0, 9, ("f_c", "f_v"))}', lambda one: _shape(one)
    ),
    "variants": by_name(
        'a dictionary such as {"plain": Variant({"k": 0.0})}', lambda one: _variant(one)
    ),
}
"""The class data of a law, and of which kind each is."""


def _shape(one: Any) -> bool:
    """Return whether this is a `law.Shape` that a search could begin from."""
    low, high, nodes, shapes, _ = one
    return 0.0 < low <= high and isinstance(nodes, int) and nodes > 0 and isinstance(shapes, tuple)


def _variant(one: Any) -> bool:
    """Return whether this is a `law.Variant`."""
    values, idle, lacks = one
    return isinstance(values, Mapping) and isinstance(idle, tuple) and isinstance(lacks, str)


def check_law(law: type[Law]) -> None:
    """Refuse a law whose class data could not work, when it is defined."""
    where = told("law", law)
    if law.site not in SITES:
        raise PhysicsError(f"{where}: site {law.site!r} is none of {SITES}.")
    if not law.name.isidentifier():
        raise PhysicsError(f"{where}: a name is one word of letters, digits and _.")
    wrong = [part for part in law.parts if part not in PARTS]
    if wrong:
        raise PhysicsError(f"{where}: parts {wrong}; there are {PARTS}.")
    if not law.first_line():
        raise PhysicsError(f"{where}: a first docstring line tells users what it is.")
    check_numbers(where, law.parameters, law.tables)
    _check_names(law, where)
    _check_hooks(law, where)


def _check_names(law: type[Law], where: str) -> None:
    """Refuse forms, shapes and variants that name what the law has not."""
    places = {**dict.fromkeys(law.parameters), **dict.fromkeys(law.tables)}
    for quantity, form in law.command.items():
        lacking = [name for name in form.names() if name not in places]
        if lacking:
            raise PhysicsError(f"{where}: command of {quantity} names {lacking}, no parameters.")
        if isinstance(form, Monotone) and form.table not in law.tables:
            raise PhysicsError(f"{where}: command of {quantity}: {form.table} is no table.")
        if isinstance(form, Monotone) and law.tables[form.table].bounds[0] < 0.0:
            raise PhysicsError(
                f"{where}: the table {form.table} over the command is not monotone: its values are "
                f"what the quantity gains from knot to knot, and its bounds "
                f"{law.tables[form.table].bounds} let it fall. Bounds that begin at 0 are right."
            )
        if quantity in places and quantity not in form.names():
            raise PhysicsError(f"{where}: {quantity} is a quantity and a parameter.")
    if law.felt and law.states.get(law.felt) != "V":
        raise PhysicsError(f"{where}: felt = {law.felt!r}; the name of a state in V is right.")
    wrong = [n for n, signal in law.starts.items() if n not in law.states or signal not in SIGNALS]
    if wrong:
        raise PhysicsError(
            f"{where}: starts of {wrong}; a state's name and one of {SIGNALS} is right."
        )
    for field, names in (("assumed", law.assumed), ("stiffness", (law.stiffness,))):
        lacking = [name for name in names if name and name not in law.parameters]
        if lacking:
            raise PhysicsError(f"{where}: {field} names {lacking}, no parameters of it.")
    for name, shape in law.shapes.items():
        lacking = [n for n in (name, *shape.shapes) if n not in law.parameters]
        if lacking:
            raise PhysicsError(f"{where}: shapes names {lacking}, no parameters of it.")
    for suffix, variant in law.variants.items():
        lacking = [n for n in (*variant.values, *variant.idle) if n not in law.parameters]
        if lacking:
            raise PhysicsError(f"{where}: variant {suffix} names {lacking}, no parameters of it.")


def _check_hooks(law: type[Law], where: str) -> None:
    if law.site == "structure":
        if law.hook("force") is None:
            raise PhysicsError(f"{where}: the law of a building's part has the hook `force`.")
        return
    given = [hook for hook in HOOKS if law.hook(hook) is not None]
    if not given:
        raise PhysicsError(f"{where}: defines none of the hooks {list(HOOKS)}.")
    lacking = [HOOKS[hook] for hook in given if not law.has(HOOKS[hook])]
    if lacking:
        raise PhysicsError(f"{where}: has the hooks {given}; its parts must name {lacking}.")
    if law.has("sign") and law.hook("limit") is None:
        raise PhysicsError(f"{where}: the part sign needs the hook `limit`.")
    if law.states and law.hook("rate") is None:
        raise PhysicsError(f"{where}: has states and no `rate`.")
    if not law.states and (law.hook("rate") or law.hook("advance")):
        raise PhysicsError(f"{where}: has `rate` or `advance` and no states.")
