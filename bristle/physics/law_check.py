"""What a law may declare, and what its class data must be for it to work."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import PhysicsError
from .command import Monotone
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

HOOKS = {
    "limit": "sign",
    "yielding": "yield",
    "damping": "bristle",
    "viscous": "viscous",
    "elastic": "spring",
}
"""The hooks that give a force [N], each with the part of which it is the force."""

ALL_HOOKS = (*HOOKS, "rate", "advance", "force")


def check_law(law: type[Law]) -> None:
    """Refuse a law whose class data could not work, when it is defined."""
    where = f"law {law.name!r} ({law.__module__}.{law.__qualname__})"
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
        if quantity in places and quantity not in form.names():
            raise PhysicsError(f"{where}: {quantity} is a quantity and a parameter.")
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
