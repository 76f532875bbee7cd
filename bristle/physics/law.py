"""A damper's law, or that of a building's part: one class in one file, which registers itself.

A law is the plain model that effects join. It declares its numbers, how they depend on the command,
which parts it has, and hooks: pure functions of `q` the motion (`inputs.Inputs`), `z` the law's
states and `p` its parameters, as those of effects are. Whatever needs to know something of a law
asks its class; nothing knows a law by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

from ..errors import PhysicsError
from .command import Constant as Constant  # laws, users' own as well, take these from here
from .command import Form, Monotone
from .command import Linear as Linear
from .command import Quadratic as Quadratic
from .command import Rising as Rising
from .forms import LawsByName, joined_form, split_form
from .parameter import (
    CHOICES,
    PARAMETERS,
    TABLES,
    TEXT,
    TEXT_BY_NAME,
    TEXTS,
    Parameter,
    Table,
    all_parameters,
    by_name,
    check_fields,
    check_numbers,
    class_text,
    fields_of,
    first_line,
    named,
    refuse_twin,
)
from .parameter import bilinear as bilinear
from .parameter import interpolate as interpolate
from .tuples import FACTORS, FORM_STEP, Inputs, values_of_law

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

WHOLE = "force"
"""What an effect changes that changes each parameter in which the force of a law is linear."""

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


def _command(one: Any) -> bool:
    return isinstance(one, Form) and all(isinstance(name, str) for name in one.names())


def _shape(one: Any) -> bool:
    """Return whether this is a `Shape` that a search could begin from."""
    low, high, nodes, shapes, _ = one
    return 0.0 < low <= high and isinstance(nodes, int) and nodes > 0 and isinstance(shapes, tuple)


def _variant(one: Any) -> bool:
    """Return whether this is a `Variant`."""
    values, idle, lacks = one
    return isinstance(values, Mapping) and isinstance(idle, tuple) and isinstance(lacks, str)


FIELDS = {
    **dict.fromkeys(("name", "site", "place", "stiffness", "source", "felt", "offset"), TEXT),
    **dict.fromkeys(("parts", "contains", "assumed"), TEXTS),
    **dict.fromkeys(("states", "starts"), TEXT_BY_NAME),
    "parameters": PARAMETERS,
    "tables": TABLES,
    "command": (
        'a dictionary such as {"yield_force": Linear("f_c", "f_v")}', by_name(_command),
    ),
    "shapes": (
        'a dictionary such as {"v_s": Shape(0.02, 5.0, 9, ("f_c", "f_v"))}', by_name(_shape),
    ),
    "variants": ('a dictionary such as {"plain": Variant({"k": 0.0})}', by_name(_variant)),
}  # fmt: skip
"""The class data of a law, and of which kind each is."""


def check_law(law: type[Law]) -> None:
    """Refuse a law whose class data could not work, when it is defined."""
    where = class_text("law", law)
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
    if law.offset and (law.offset not in places or law.parameters[law.offset].unit != "N"):
        raise PhysicsError(f"{where}: offset = {law.offset!r}; a parameter in N is right.")
    if law.felt and law.states.get(law.felt) != "V":
        raise PhysicsError(f"{where}: felt = {law.felt!r}; the name of a state in V is right.")
    wrong = [n for n, signal in law.starts.items() if n not in law.states or signal not in SIGNALS]
    if wrong:
        raise PhysicsError(
            f"{where}: starts of {wrong}; a state's name and one of {SIGNALS} is right."
        )
    for what, names in (
        ("assumed", law.assumed),
        ("stiffness", filter(None, (law.stiffness,))),
        *(("shapes", (name, *shape.shapes)) for name, shape in law.shapes.items()),
        *((f"variant {n}", (*one.values, *one.idle)) for n, one in law.variants.items()),
    ):
        lacking = [name for name in names if name not in law.parameters]
        if lacking:
            raise PhysicsError(f"{where}: {what} names {lacking}, no parameters of it.")


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


FOREVER = 1e15
"""Time [s] after which sliding is steady at any speed."""

LEAST = 1e-12
"""Speed [m/s] and travel [m] at which a law's slopes at rest are read."""


MOST = 1e6
"""Voltage [V] at which everything that a voltage moves has moved."""


class Shape(NamedTuple):
    """A parameter in which a law is not linear: where fits look for it, and what it shapes.

    `nodes` values from `low` to `high` are looked at, spaced by equal ratios: factors on the
    typical size of the rig. `shapes` are the linear parameters whose force it shapes, `falls`
    whether their force falls with speed over it.
    """

    low: float
    high: float
    nodes: int
    shapes: tuple[str, ...]
    falls: bool = False


class Variant(NamedTuple):
    """A law of its own name that is another with some values fixed: `NAME_standard`.

    `values` are fixed, `idle` the parameters that mean nothing then, `lacks` says in words what the
    variant does without.
    """

    values: Mapping[str, float]
    idle: tuple[str, ...] = ()
    lacks: str = ""


LAWS: dict[str, type[Law]] = LawsByName()


class Law:
    """Base of every law; defining a subclass with a `name` registers it.

    Class data
    ----------
    name, site
        "damper", or "structure" for the law of a building's part.
    parameters, tables, states
        `{name: Parameter}`, `{name: Table}`, `{name: unit}`. Start values of states are zero or the
        parameter `STATE_0`. Once the class is defined `parameters` also lists the values of its
        tables, as `curve[1]`.
    starts
        States that begin with the value of a signal where a measurement begins: {state: signal}.
    command
        `{quantity: form}`, how quantities depend on the voltage (see `command`). In a hook the
        quantity is p.NAME, and the parameters that make it are not there.
    felt
        The state [V] that stands for the voltage in `command`, of a law with a lag of its own.
    parts, contains
        `PARTS` that the law has: an effect joins laws with the parts that it acts on. `contains`
        names the kinds of effects that the law has in it already; they are not offered beside it.
    shapes
        `{parameter: Shape}`: the parameters in which the force is not linear. All others are
        linear, but `parameter.CHOICES` and what is `assumed`.
    assumed
        Parameters that measurements hardly tell: no fit moves them.
    offset
        The parameter [N] that is a constant force: the load cell's zero is not fitted beside it.
    variants
        `{suffix: Variant}`.
    place, stiffness
        Of a building's part: "layer" or "storey", and the parameter that is its linear stiffness.
    source
        Where it is from, with the year.
    own
        Whether it is a user's own, outside the library; `user_code.load` sets it.
    base, form, knots, form_code
        Of a law with a chosen form (see `forms`) the law that it is made of, the form's word, its
        knots [V] and its code; of others itself, "", () and 0.

    Hooks
    -----
    Static pure functions of q, z, p, each of which may be left out.

    limit
        Force [N] at which the law slides; needs the part "sign".
    yielding
        The yield force [N] where the law gives it itself, signed: by bristles, or smoothly.
    damping
        Force [N] of the bristles' own damping, which factors on the yield force leave alone.
    viscous, elastic
        Forces [N] that grow with speed, with displacement.
    rate
        Rates of the states, as a tuple. A law with states has it.
    advance
        States after q.dt at constant velocity q.v, as a tuple, where that is known exactly or as
        well as exactly. It sees `p` at a voltage within the step; a law with a lag of its own sees
        in q.V the mean of the step. A law that has states and none of it moves by `rate`.
    force
        Of a building's part: its force [N], at arrays as well.

    Examples
    --------
    >>> import bristle
    >>> class Dashpot(bristle.Law):
    ...     '''A damper that is viscous alone, whatever its voltage.'''
    ...
    ...     name = "dashpot"
    ...     parameters = {"c": bristle.Parameter(100.0, "N.s/m", (0.0, 1e6), "damping")}
    ...     parts = ("viscous",)
    ...     source = "Newton (1687), Principia"
    ...
    ...     @staticmethod
    ...     def viscous(q, z, p):
    ...         return p.c * q.v
    >>> Dashpot.linear()
    ('c',)
    """

    name: ClassVar[str] = ""
    site: ClassVar[str] = "damper"
    parameters: ClassVar[dict[str, Parameter]] = {}
    tables: ClassVar[dict[str, Table]] = {}
    states: ClassVar[dict[str, str]] = {}
    command: ClassVar[dict[str, Form]] = {}
    parts: ClassVar[tuple[str, ...]] = ()
    contains: ClassVar[tuple[str, ...]] = ()
    shapes: ClassVar[dict[str, Shape]] = {}
    starts: ClassVar[dict[str, str]] = {}
    felt: ClassVar[str] = ""
    offset: ClassVar[str] = ""
    assumed: ClassVar[tuple[str, ...]] = ()
    variants: ClassVar[dict[str, Variant]] = {}
    place: ClassVar[str] = ""
    stiffness: ClassVar[str] = ""
    source: ClassVar[str] = ""
    own: ClassVar[bool] = False
    base: ClassVar[type[Law]]
    form: ClassVar[str] = ""
    knots: ClassVar[tuple[float, ...]] = ()
    form_code: ClassVar[int] = 0
    State: ClassVar[Any]
    Values: ClassVar[Any]

    def __init_subclass__(cls, register: bool = True, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if not cls.name or not register:
            return
        cls.base = cls
        check_fields(cls, class_text("law", cls), FIELDS)
        cls.parameters = all_parameters(cls.parameters, cls.tables)
        if any(not isinstance(form, Constant) for form in cls.command.values()):
            cls.parts = tuple(dict.fromkeys((*cls.parts, "command")))
        refuse_twin("law", cls, LAWS.get(cls.name))
        check_law(cls)
        cls.State = named("State", tuple(cls.states))
        cls.Values = named("Values", cls.seen())
        LAWS[cls.name] = cls

    @classmethod
    def has(cls, part: str) -> bool:
        """Return whether the law has one of `PARTS`."""
        return part in cls.parts

    @classmethod
    def hook(cls, name: str) -> Callable[..., Any] | None:
        """Return a hook, None where the law leaves it out."""
        return getattr(cls, name, None)

    @classmethod
    def hooks(cls) -> dict[str, Callable[..., Any]]:
        """Return the hooks that the law defines."""
        return {name: getattr(cls, name) for name in ALL_HOOKS if hasattr(cls, name)}

    @classmethod
    def seen(cls) -> tuple[str, ...]:
        """Return the fields of `p`: quantities, then the parameters and tables that make none."""
        used = {name for form in cls.command.values() for name in form.names()}
        own = [name for name in fields_of(cls.parameters, cls.tables) if name not in used]
        return (*cls.command, *own, *(FACTORS if cls.has("bristle") else ()))

    @classmethod
    def listed(cls, name: str) -> tuple[str, ...]:
        """Return the parameters that a name of `command` stands for: several of a table."""
        return fields_of(cls.parameters, cls.tables).get(name, (name,))

    @classmethod
    def linear(cls) -> tuple[str, ...]:
        """Return the names of the parameters in which the force is linear."""
        return tuple(n for n in cls.parameters if n not in cls.shapes and n not in cls.fixed())

    @classmethod
    def fixed(cls) -> tuple[str, ...]:
        """Return the names of the parameters that no fit moves."""
        return tuple(n for n in cls.parameters if n in CHOICES or n in cls.assumed)

    @classmethod
    def driven(cls) -> tuple[str, ...]:
        """Return the names of the parameters that act through the voltage alone.

        Those of forms, and the shapes of nothing else.
        """
        names: list[str] = []
        for form in cls.command.values():
            if isinstance(form, Monotone):
                names += cls.listed(form.table)[1:]
            else:
                names += form.driven()
        own = [name for name, one in cls.shapes.items() if one.shapes and {*one.shapes} <= {*names}]
        return tuple(dict.fromkeys([*names, *own]))

    @classmethod
    def yield_parameters(cls) -> tuple[str, ...]:
        """Return the linear parameters that the yield force is made of."""
        return cls.linear_in(("limit", "yielding"))

    @classmethod
    def linear_in(cls, hooks: tuple[str, ...]) -> tuple[str, ...]:
        """Return the linear parameters that the forces of some hooks are made of."""
        return tuple(n for n in cls.linear() if _moves(cls, n, hooks))

    @classmethod
    def sliding_states(cls, values: Mapping[str, float], v: float, V: float) -> Any:
        """Return the states after long sliding at v [m/s] and V [V], of a law that is `exact`."""
        advance = cls.hook("advance")
        if advance is None:
            return ()
        rest = cls.State(*(0.0 for _ in cls.states))
        return cls.State(*advance(_motion(v, V, FOREVER), rest, cls.at(values, V)))

    @classmethod
    def sliding_force(cls, values: Mapping[str, float], v: float, V: float) -> tuple[float, float]:
        """Return the yield force [N] and all other force [N] in steady sliding at v > 0 [m/s].

        Of a law that is `exact`.
        """
        q, z, p = _motion(v, V), cls.sliding_states(values, v, V), cls.at(values, V)
        found = {name: own(q, z, p) for name in HOOKS if (own := cls.hook(name))}
        held = sum(found.pop(name, 0.0) for name in ("limit", "yielding"))
        return held, sum(found.values())

    @classmethod
    def slopes_at_rest(cls, values: Mapping[str, float], V: float) -> tuple[float, float]:
        """Return the slopes of the force as v -> 0 at V [V]: per speed [N.s/m], per travel [N/m].

        A jump with direction is left out, and so is a force at rest. Travel is that of the rod and
        of all states in metres.
        """
        p, rest = cls.at(values, V), dict.fromkeys(cls.states, 0.0)
        bent = {name: LEAST if unit == "m" else 0.0 for name, unit in cls.states.items()}
        hooks = [own for name in HOOKS if name != "limit" and (own := cls.hook(name))]
        still, moving = _motion(0.0, V), _motion(LEAST, V)
        apart, speed, travel = still._replace(x=LEAST), 0.0, 0.0
        for own in hooks:
            zero = own(still, cls.State(**rest), p)
            speed += own(moving, cls.State(**rest), p) - zero
            travel += own(apart, cls.State(**bent), p) - zero
        return speed / LEAST, travel / LEAST

    @classmethod
    def falling(cls) -> tuple[tuple[str, ...], str]:
        """Return the parameters whose force falls with speed, and the one that says over which.

        Empty where nothing falls.
        """
        for name, shape in cls.shapes.items():
            if shape.falls:
                return shape.shapes, name
        return (), ""

    @classmethod
    def idle(cls, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return the names of the parameters that mean nothing at these values of others."""
        return tuple(
            name
            for variant in cls.variants.values()
            if all(
                values.get(key, cls.parameters[key].value) == value
                for key, value in variant.values.items()
            )
            for name in variant.idle
        )

    @classmethod
    def affine(cls) -> bool:
        """Return whether the force is linear in the voltage: then controllers can invert it."""
        return cls.has("command") and all(form.affine for form in cls.command.values())

    @classmethod
    def exact(cls) -> bool:
        """Return whether the law has no states, or moves them by `advance`."""
        return not cls.states or cls.hook("advance") is not None

    @classmethod
    def first_line(cls) -> str:
        """Return the first line of the docstring, which users read."""
        return first_line(cls)

    @classmethod
    def at(cls, values: Mapping[str, float], V: float = 0.0) -> Any:
        """Return the `p` of the hooks at a voltage V [V]; missing values take their defaults."""
        return values_of_law(cls, values, V)


def _motion(v: float, V: float, dt: float = 0.0) -> Inputs:
    return Inputs(0.0, v, 0.0, V, dt, 0.0, 0.0, False)


def _moves(law: type[Law], name: str, hooks: tuple[str, ...]) -> bool:
    """Return whether a force, all other linear parameters at zero, is there with one alone."""
    q = Inputs(1e-3, 0.02, 0.1, 1.0, 1e-3, 0.0, 0.0, False)
    z = law.State(*(1e-4 for _ in law.states)) if law.states else ()
    none = dict.fromkeys(law.linear(), 0.0)
    p = law.at({**none, name: 1.0}, MOST)  # beyond all knots of a table over the voltage
    return any(function(q, z, p) for hook in hooks if (function := law.hook(hook)))


def laws_of(site: str = "damper") -> tuple[type[Law], ...]:
    """Return the registered laws of a site, in the order in which they were defined."""
    return tuple(law for law in LAWS.values() if law.site == site)


def law_code(name: str, laws: tuple[type[Law], ...] = ()) -> int:
    """Return the number of a law among a set's, the registered ones, as compiled code knows it.

    From `FORM_STEP` on it says which form of the command was chosen (see `forms`).
    """
    law = LAWS[name]
    return (laws or laws_of("damper")).index(law.base) + FORM_STEP * law.form_code


def law_names(site: str = "damper") -> tuple[str, ...]:
    """Return the names of the laws of a site, then those of their variants: "bingham_standard"."""
    laws = laws_of(site)
    return (
        *(law.name for law in laws),
        *(f"{law.name}_{suffix}" for law in laws for suffix in law.variants),
    )


def base_and_variant(name: str) -> tuple[type[Law], Variant]:
    """Return the law of a name, and the variant of it that the name stands for.

    Raises
    ------
    PhysicsError
        If there is no such law.
    """
    plain, form, knots = split_form(name)
    if plain in LAWS:
        return LAWS[name], Variant({})
    for law in LAWS.values():
        for suffix, variant in law.variants.items():
            if plain == f"{law.name}_{suffix}":
                return LAWS[joined_form(law.name, form, knots)], variant
    raise PhysicsError(f'no law is named "{name}". There are: {", ".join(law_names())}.')


def law_of_part(part: str) -> type[Law]:
    """Return the law of a building's part: "layer", "storey1", "storey2" ..."""
    return next(law for law in laws_of("structure") if part.rstrip("0123456789") == law.place)


def forget_law(law: type[Law]) -> None:
    """Take a law out of the library: for tests, and what registers laws of its own."""
    if LAWS.get(law.name) is law:
        del LAWS[law.name]
