"""A physical effect: one class in one file, which registers itself and takes part everywhere.

An effect joins its sites (`damper`, `structure`, `sensor`) through hooks, pure functions of three
named tuples: `q` the motion and whatever else the site offers (`Q`), `z` the effect's states and
`p` its parameters. A hook uses `math`, arithmetic and `if`, never containers, so that one source
runs in plain Python and under numba.

Inside the functions of one site an effect goes by its name. Where a model has several sites, a
building's, the plain name means the first of `Effect.sites`; `NAME@SITE` means another one. On a
test bench, which has one site, the plain name does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import new_class
from typing import Any, ClassVar, NamedTuple

from ..errors import PhysicsError
from . import laws as _laws  # noqa: F401  (importing it registers the laws)
from .forms import QUADRATIC_FORM, choosable, joined_form
from .law import LAWS, PARTS, WHOLE, Law, laws_of
from .parameter import (
    ANY_BY_NAME,
    GRIDS,
    PARAMETERS,
    SWITCH,
    TABLES,
    TEXT,
    TEXT_BY_NAME,
    TEXTS,
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
from .parameter import Parameter as Parameter  # effects, users' own as well, take these from here
from .parameter import Table as Table
from .parameter import bilinear as bilinear
from .parameter import interpolate as interpolate

MIMICKED = ("force_bias", "late_drive", "limited_drive")
"""Faults of a sensor that an effect may look like: the force's zero, a drive on record late, or one
that was limited in slew or range behind its record."""


FIELDS = {
    **dict.fromkeys(("name", "site", "kind", "shows", "source", "expect"), TEXT),
    **dict.fromkeys(("family", "absorbed_by", "offset", "mass", "amount", "changes"), TEXT),
    **dict.fromkeys(("acts_on", "needs", "bristles", "assumed", "joint", "late"), TEXTS),
    **dict.fromkeys(("sites", "excludes", "start_ties", "mimics", "faults"), TEXTS),
    **dict.fromkeys(("contact", "passive", "zero_at_rest"), SWITCH),
    **dict.fromkeys(("states", "starts", "lookalikes", "labels", "label_means"), TEXT_BY_NAME),
    "channels": TEXT_BY_NAME,
    "label_words": ('a dictionary such as {"oil": ("A", "B")}', by_name(TEXTS[1])),
    **dict.fromkeys(("start_grid", "start_limits"), ANY_BY_NAME),
    "parameters": PARAMETERS,
    "tables": TABLES,
    "start_shares": GRIDS,
}
"""The class data of an effect, and of which kind each is."""


def check_sites(effect: type[Effect], where: str) -> None:
    """Refuse sites that there are not, and what an effect of several cannot use at all of them."""
    if not (isinstance(effect.sites, tuple) and effect.sites):
        raise PhysicsError(f"{where}: sites = {effect.sites!r}; a tuple of {SITES} is right.")
    for site in effect.sites:
        if site not in SITES:
            raise PhysicsError(f"{where}: site {site!r} is none of {SITES}.")
    if len(effect.sites) == 1:
        return
    if len(set(effect.sites)) < len(effect.sites) or "sensor" in effect.sites:
        raise PhysicsError(f'{where}: sites = {effect.sites}; each once, and "sensor" alone.')
    for what, used, both in (
        ("defines", effect.hooks(), SHARED_HOOKS),
        ("needs", effect.needs, SHARED_SIGNALS),
    ):
        wrong = [one for one in used if one not in both]
        if wrong:
            raise PhysicsError(
                f"{where}: {what} {wrong}, which not all of its sites have; {list(both)} they do."
            )


def check_search(effect: type[Effect], where: str) -> None:
    """Refuse starts that a search could not begin from."""
    grids: list[tuple[str, Mapping[str, tuple[float, ...]]]] = [
        ("start_grid", effect.start_grid),
        ("start_limits", effect.start_limits),
    ]
    grids += [("start_shares", grid) for grid in effect.start_shares]
    grids += [("start_ties", dict.fromkeys(effect.start_ties, (0.0,)))]
    for field, grid in grids:
        unknown = [name for name in grid if name not in effect.parameters]
        if unknown:
            raise PhysicsError(
                f"{where}: {field} names {unknown}; its parameters are {list(effect.parameters)}."
            )
        if not all(isinstance(values, tuple) and values for values in grid.values()):
            raise PhysicsError(f"{where}: {field} holds a tuple of numbers for each parameter.")
    wrong = [name for name in (*effect.labels, *effect.label_means) if name not in effect.assumed]
    if wrong:
        raise PhysicsError(f"{where}: labels names {wrong}, which assumed must name as well.")
    wrong = [n for n in effect.channels if n not in effect.assumed or n not in effect.parameters]
    if wrong:
        raise PhysicsError(
            f"{where}: channels names {wrong}; parameters that assumed names as well are right."
        )
    if effect.channels and effect.sites != ("damper",):
        raise PhysicsError(f"{where}: channels are what an effect of the damper alone may follow.")
    wrong = [name for name in effect.channels.values() if not name.isidentifier()]
    if wrong:
        raise PhysicsError(f"{where}: channels names {wrong}; letters, digits and _ are right.")
    if effect.start_grid and effect.start_shares:
        raise PhysicsError(f"{where}: start_grid or start_shares is right, not both.")
    for name, limits in effect.start_limits.items():
        if len(limits) != 2 or not limits[0] < limits[1]:
            raise PhysicsError(f"{where}: start_limits of {name} = {limits}; low, high is right.")
    if bool(effect.start_ties) != hasattr(effect, "tie"):
        raise PhysicsError(f"{where}: start_ties and a static method tie(p, sizes) go together.")


def check_verdict(effect: type[Effect], where: str) -> None:
    """Refuse class data that a verdict could not be made from."""
    for field, given, known in (
        ("mimics", effect.mimics, MIMICKED),
        ("absorbed_by", [effect.absorbed_by] if effect.absorbed_by else [], PARTS),
    ):
        wrong = [one for one in given if one not in known]
        if wrong:
            raise PhysicsError(f"{where}: {field} names {wrong}; there are {list(known)}.")
    for field, name, unit in (("offset", effect.offset, "N"), ("mass", effect.mass, "kg")):
        if name and (name not in effect.parameters or effect.parameters[name].unit != unit):
            raise PhysicsError(f"{where}: {field} = {name!r}; a parameter in {unit} is right.")
    if effect.amount and effect.amount.removeprefix("1/") not in effect.parameters:
        raise PhysicsError(
            f'{where}: amount = {effect.amount!r}; a parameter, or "1/" and a parameter, is right: '
            f"there are {list(effect.parameters)}."
        )
    others = [parameter for name, parameter in effect.parameters.items() if name != effect.offset]
    if effect.offset and not all(p.bounds[0] <= 0.0 <= p.bounds[1] for p in others):
        raise PhysicsError(f"{where}: offset asks that all other parameters may be zero.")
    if effect.faults and effect.site != "sensor":
        raise PhysicsError(f"{where}: faults are those of a sensor's effect.")
    if not all(isinstance(why, str) and why for why in effect.lookalikes.values()):
        raise PhysicsError(f"{where}: lookalikes holds a sentence for each.")


AT = "@"
"""Stands between an effect's name and a site that is not its first."""


class Registry(dict[str, "type[Effect]"]):
    """The effects by name; NAME@SITE gives an effect as it is at another one of its sites.

    Iteration goes over the plain names.
    """

    def __missing__(self, key: str) -> type[Effect]:
        name, _, site = key.partition(AT)
        if name != key and name in self and site in self[name].sites[1:]:
            return self[name].at(site)
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        if super().__contains__(key):
            return True
        name, at, site = str(key).partition(AT)
        return bool(at) and super().__contains__(name) and site in self[name].sites[1:]

    def get(self, key: str, default: Any = None) -> Any:
        """Return the effect of a name, or of NAME@SITE; the default where there is none."""
        try:
            return self[key]
        except KeyError:
            return default


EFFECTS = Registry()


def plain_name(key: str) -> str:
    """Return the effect's name of NAME, NAME@SITE, or of either with a parameter behind it."""
    name, dot, parameter = key.partition(".")
    return name.partition(AT)[0] + dot + parameter


def exclude(one: str, other: str) -> bool:
    """Return whether two effects, by a model's names, cannot be together at one site."""
    first, second = EFFECTS[one], EFFECTS[other]
    if (AT in one or AT in other) and first.site != second.site:
        return False
    return second.name in first.excludes or first.name in second.excludes


CLOSURE = "closure"
"""The kind of what is no effect of physics: a verdict that rests on it stays unknown."""


def closures(names: Iterable[str]) -> list[str]:
    """Return those of some effects, by a model's names, that are closures."""
    return [name for name in names if name in EFFECTS and EFFECTS[name].kind == CLOSURE]


SITES = ("damper", "structure", "sensor")

CHANNELS = ("force", "velocity")
"""Channels whose instrument a sensor's effect may be."""

HOOKS = (
    "parallel", "voltage", "motion", "yield_factor", "viscous_factor", "reach", "yield_force",
    "force", "spring", "factor", "reaction", "rate", "advance", "channel", "changed",
)  # fmt: skip
"""In the order in which an evaluation calls them."""

ACTS_ON = {
    "voltage": "command",
    "yield_factor": "yield",
    "reach": "yield",
    "yield_force": "sign",
    "viscous_factor": "viscous",
}
"""The part of a law that a hook acts on; the other hooks join any law."""

SHARED_HOOKS = ("force", "rate", "advance")
SHARED_SIGNALS = ("x", "v", "dt", "energy", "halt", "stiffness")
"""What a damper and a structure both call and offer: an effect of both sites uses no other."""

OFFERED = {
    "damper": (
        "x", "v", "a", "V", "dt", "energy", "force", "rod_x", "rod_v", "halt", "stiffness", "value",
    ),
    "structure": (*SHARED_SIGNALS, "force", "drift", "drift_rate", "storey"),
    "sensor": ("value", "dt"),
}  # fmt: skip
"""The signals of each site; the others of `Q` are zero there."""


class Q(NamedTuple):
    """What a hook may ask for. Damper: motion across the fluid; structure: motion of the base.

    `dt` is the step; `advance` is called with `dt` = 0 too, at the end of a step, so that states
    which do not depend on time end where their signals do. `rod_x`, `rod_v` are the damper's motion
    before any `motion` hook. `force` is the force of this same evaluation (`rate`, `advance`),
    `halt` the force that would bring the motion to rest within the step (what a stuck contact
    carries; to a contact in a damper whose motion is prescribed no force is enough), `stiffness`
    the linear stiffness of the storey at hand (in `force`: of the isolation; in a damper 0),
    `storey` its number (1 above the base), `value` the signal that an instrument is to show, or in
    `changed` the parameter that changes.
    """

    x: float  # m
    v: float  # m/s
    a: float  # m/s2
    V: float  # V
    dt: float  # s
    drift: float  # m
    drift_rate: float  # m/s
    energy: float  # J, dissipated so far
    force: float  # N
    rod_x: float  # m
    rod_v: float  # m/s
    halt: float  # N
    stiffness: float  # N/m
    storey: float  # 1
    value: float  # unit of the channel, or of the parameter


class Sizes(NamedTuple):
    """Typical sizes of a measured rig, standard deviations (V: the largest), for `Effect.tie`."""

    x: float  # m
    v: float  # m/s
    V: float  # V
    force: float  # N


class Effect:
    """Base of every physical effect; defining a subclass with a `name` registers it.

    It then takes part everywhere: in runs, identification, diagnosis and FMUs.

    Class data
    ----------
    name, sites
        Where it can be: of `SITES`, one or more. The first is the one that its plain name means in
        a building. `site` is that one; a class that gives `site` alone is still read.
    needs
        Names of the signals in `q` that the hooks use.
    states, parameters, tables
        `{name: unit}`, `{name: Parameter}`, `{name: Table}`; start values of states are zero. Once
        the class is defined `parameters` also lists the values of its tables, as `curve[1]`.
    acts_on
        Parts of a law (`law.PARTS`) that it must have for the effect to join, beside those that the
        effect's hooks act on (`ACTS_ON`).
    kind
        What it is a case of: "spring", "lag", "series element", "inertia" ... A law that contains
        one is not offered another. Its own name where nothing is said. `CLOSURE`: no effect of
        physics, but a network for what has no name.
    starts
        States that begin with the value of a signal where a measurement begins: {state: signal}.
    bristles
        Parameters that count for laws with bristles alone; with others a fit leaves them.
    assumed
        Parameters that measurements hardly tell: no fit moves them.
    labels, label_means, label_span
        Parameters that are no property of the damper but known of each run: {parameter: label}, by
        the labels of `[[runs]]` in study.toml. The one is the run's own number, the other the mean
        of the training runs. No fit moves them, so `assumed` names them, too. The effect is tried
        where all runs have the labels and differ in them, by `label_span` at the least.
    label_words
        The words that a label may be, where it is no number: {label: words}. The parameter is then
        the place of the run's word among them, from 1 on.
    changes
        Of an effect of the damper that says how another parameter depends on a label: that
        parameter, "f_0" of the law or "gas_spring.k" of an effect that is on, or "force" for each
        parameter in which the law's force is linear. The hook `changed` gives the value from
        `q.value`, which it has without; it is called once, before a run.
    channels
        Parameters of an effect of the damper that follow a channel measured beside motion, command
        and force: {parameter: name in [extra] of study.toml}. No fit moves them, so `assumed` names
        them, too. The effect is tried where all runs have the channel; an FMU has it as an input.
    contact
        Its `force` is dry friction, which carries what holds the motion (`q.halt`), or the push of
        a stop. In a structure it is found together with the motion, whatever its stiffness, and
        held over a step; other forces are linear over it. In a damper it comes last, so that
        friction carries what all other forces leave.
    shows
        Of a sensor's effect: the channel whose instrument it is, "force" or "velocity".
    late
        Of a sensor's effect: the parameter that says how late [s] it shows its signal, the one with
        the share of that time which a filter of second order takes, and that with its damping
        ratio; the rest is a pure delay.
    joint
        Of a series element: the names of two states, the travel between rod and fluid [m] and the
        velocity across the fluid [m/s]; the integrator finds both, from the second one's `rate`.
    own
        Whether it is a user's own, outside the library; `user_code.load` sets it.
    passive, zero_at_rest, excludes, source, expect
        See each effect; conformance tests hold the first two.

    Class data of the search
    ------------------------
    start_grid
        Where a search for the effect begins: {parameter: factors} on the defaults, which are scaled
        to the rig first. All combinations are looked at; without it, the defaults alone.
    start_shares
        The same, for an effect whose scale is what was measured and not a rig of 10 N: one grid or
        more, {parameter: shares} of the largest displacement and speed, the typical force, and
        what follows from these, by the parameter's unit. Others begin at their defaults. One empty
        grid, ({},): the defaults are those of the rig at hand, and nothing scales them.
    start_limits
        {parameter: (low, high)}, as such shares: the search stays between them.
    start_ties
        Parameters whose start follows from the others: a static method `tie(p, sizes)` gives their
        values, in this order, as a tuple; `sizes` are the rig's (`Sizes`).
    A static method `in_words(p)` says what its values mean, in a sentence for the verdict.
    A static method `yield_share(p)` says by what the law's own yield force is divided at a start,
    for an effect that the law has absorbed in part.

    Class data of the verdict
    -------------------------
    family
        A name that effects share which small motion cannot tell apart; they are no rivals.
    lookalikes
        What else does the same to a building's damper whose force no load cell shows, and in a
        sentence why: {name of an effect, or what it is in words: sentence}.
    absorbed_by
        The part of the damper's law (`law.PARTS`) that then absorbs the effect entirely.
    mimics
        Faults of sensors that its absence may look like (`MIMICKED`): they are weighed against it.
    faults
        Of a sensor's effect: the kinds of fault of its channel that are this effect ("delay").
    offset
        The parameter [N] that is a constant force, all others at zero.
    mass
        The parameter [kg] of a mass that moves with the rod; beside a building's model it is part
        of the moving mass.
    amount
        The parameter that says how much of the effect there is: at zero it is gone. "1/NAME" where
        it vanishes as the parameter grows. Limits are told in it; without it, as shares alone.

    Examples
    --------
    >>> import bristle
    >>> class CubicSpring(bristle.Effect):
    ...     '''A spring in the damper that stiffens with its displacement.'''
    ...
    ...     name = "cubic_spring"
    ...     site = "damper"
    ...     needs = ("x",)
    ...     passive = True
    ...     zero_at_rest = True
    ...     expect = "force grows with the third power of displacement"
    ...     source = "Kovacic & Brennan (2011), The Duffing Equation"
    ...     parameters = {
    ...         "k": bristle.Parameter(1e6, "N/m3", (0.0, 1e9), "force per displacement cubed")
    ...     }
    ...
    ...     @staticmethod
    ...     def force(q, z, p):
    ...         return p.k * q.x**3
    >>> CubicSpring.parameters["k"].unit
    'N/m3'
    """

    name: ClassVar[str] = ""
    site: ClassVar[str] = "damper"
    sites: ClassVar[tuple[str, ...]] = ("damper",)
    acts_on: ClassVar[tuple[str, ...]] = ()
    kind: ClassVar[str] = ""
    needs: ClassVar[tuple[str, ...]] = ()
    states: ClassVar[dict[str, str]] = {}
    parameters: ClassVar[dict[str, Parameter]] = {}
    tables: ClassVar[dict[str, Table]] = {}
    starts: ClassVar[dict[str, str]] = {}
    bristles: ClassVar[tuple[str, ...]] = ()
    assumed: ClassVar[tuple[str, ...]] = ()
    labels: ClassVar[dict[str, str]] = {}
    label_means: ClassVar[dict[str, str]] = {}
    label_span: ClassVar[float] = 0.0
    label_words: ClassVar[dict[str, tuple[str, ...]]] = {}
    changes: ClassVar[str] = ""
    channels: ClassVar[dict[str, str]] = {}
    contact: ClassVar[bool] = False
    shows: ClassVar[str] = "force"
    own: ClassVar[bool] = False
    joint: ClassVar[tuple[str, ...]] = ()
    late: ClassVar[tuple[str, ...]] = ()
    passive: ClassVar[bool] = False
    zero_at_rest: ClassVar[bool] = True
    excludes: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str] = ""
    expect: ClassVar[str] = ""
    start_grid: ClassVar[dict[str, tuple[float, ...]]] = {}
    start_shares: ClassVar[tuple[dict[str, tuple[float, ...]], ...]] = ()
    start_limits: ClassVar[dict[str, tuple[float, float]]] = {}
    start_ties: ClassVar[tuple[str, ...]] = ()
    family: ClassVar[str] = ""
    lookalikes: ClassVar[dict[str, str]] = {}
    absorbed_by: ClassVar[str] = ""
    mimics: ClassVar[tuple[str, ...]] = ()
    faults: ClassVar[tuple[str, ...]] = ()
    offset: ClassVar[str] = ""
    mass: ClassVar[str] = ""
    amount: ClassVar[str] = ""
    _elsewhere: ClassVar[dict[str, type[Effect]]]
    State: ClassVar[Any]
    Values: ClassVar[Any]
    _laid_down: ClassVar[dict[str, tuple[str, ...]]]

    def __init_subclass__(cls, register: bool = True, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.name and register:
            check_fields(cls, class_text("effect", cls), FIELDS)
            _take_sites(cls)
            cls.parameters = all_parameters(cls.parameters, cls.tables)
            cls.State = named("State", tuple(cls.states))
            cls._laid_down = fields_of(cls.parameters, cls.tables)
            cls.Values = named("Values", tuple(cls.fields()))
            _check(cls)
            refuse_twin("effect", cls, EFFECTS.get(cls.name))
            EFFECTS[cls.name] = cls

    @classmethod
    def hooks(cls) -> dict[str, Callable[..., Any]]:
        """Return the hooks that this effect defines, in the order of `HOOKS`."""
        return {hook: getattr(cls, hook) for hook in HOOKS if hasattr(cls, hook)}

    @classmethod
    def fields(cls) -> dict[str, tuple[str, ...]]:
        """Return what `p` holds: field to the parameters in it, several for a table."""
        laid_down = cls.__dict__.get("_laid_down")  # hooks are called some hundred thousand times
        return fields_of(cls.parameters, cls.tables) if laid_down is None else laid_down

    @classmethod
    def values_of(cls, values: Mapping[str, float]) -> Any:
        """Return the `p` of the hooks from values by name; missing ones take their defaults."""
        given = {name: float(values.get(name, p.value)) for name, p in cls.parameters.items()}
        return cls.Values(
            *(
                tuple(given[name] for name in names) if field in cls.tables else given[field]
                for field, names in cls.fields().items()
            )
        )

    @classmethod
    def at(cls, site: str) -> type[Effect]:
        """Return the effect as it is at one of its sites, `site` and `sites` being that one alone.

        Raises
        ------
        PhysicsError
            If it has no such site.
        """
        if site not in cls.sites:
            raise PhysicsError(f"{cls.name}: of {' and '.join(cls.sites)}, not of {site}.")
        if cls.sites == (site,):
            return cls
        known: dict[str, type[Effect]] = cls.__dict__.get("_elsewhere") or {}
        if site not in known:
            own = {"site": site, "sites": (site,), "__doc__": cls.__doc__}
            own["__module__"] = cls.__module__
            apart = {"register": False}
            known[site] = new_class(cls.__name__, (cls,), apart, lambda names: names.update(own))
            cls._elsewhere = known
        return known[site]

    @classmethod
    def key(cls, site: str) -> str:
        """Return how a model of several sites names the effect at this one: NAME or NAME@SITE."""
        return cls.name if site == cls.site else cls.name + AT + site

    @classmethod
    def joins(cls, law: type[Law]) -> bool:
        """Return whether the effect can join a law: it has the parts, and not the effect in it."""
        if law.site not in cls.sites:
            return False
        if (cls.kind or cls.name) in law.contains:
            return False
        if cls.joint and not law.exact():  # the bristle beside a joint is advanced exactly
            return False
        other, _, own = cls.changes.rpartition(".")
        if other and not (other in EFFECTS and EFFECTS[other].joins(law)):
            return False
        able = (EFFECTS[other] if other else law).parameters
        if cls.changes and cls.changes != WHOLE and own not in able:
            return False
        parts = {*cls.acts_on, *(ACTS_ON[hook] for hook in cls.hooks() if hook in ACTS_ON)}
        return all(law.has(part) for part in parts)

    @classmethod
    def of_this_rig(cls) -> bool:
        """Return whether the defaults are those of the rig at hand, so that nothing scales them."""
        return cls.start_shares == ({},)

    @classmethod
    def first_line(cls) -> str:
        """Return the first line of the docstring, which users read."""
        return first_line(cls)


def _take_sites(effect: type[Effect]) -> None:
    """Let `sites` and `site` say the same, whichever of them a class gives."""
    own = vars(effect)
    if "sites" not in own and "site" in own:
        effect.sites = (effect.site,)
    elif isinstance(effect.sites, tuple) and effect.sites:
        if own.get("site", effect.sites[0]) != effect.sites[0]:
            raise PhysicsError(
                f"effect {effect.name!r}: site = {effect.site!r} and sites = {effect.sites}; sites "
                "alone is right."
            )
        effect.site = effect.sites[0]


def _check(effect: type[Effect]) -> None:
    """Refuse an effect whose class data could not work, when it is defined."""
    where = class_text("effect", effect)
    check_sites(effect, where)
    if not effect.name.isidentifier():
        raise PhysicsError(f"{where}: a name is one word of letters, digits and _.")
    unknown = [need for need in effect.needs if need not in Q._fields]
    if unknown:
        raise PhysicsError(f"{where}: needs {unknown}; q offers {list(Q._fields)}.")
    for site in effect.sites:
        zero = [need for need in effect.needs if need not in OFFERED[site]]
        if zero:
            there = list(OFFERED[site])
            raise PhysicsError(f"{where}: needs {zero}; at the site {site} there are {there}.")
    if effect.site == "sensor" and effect.shows not in CHANNELS:
        raise PhysicsError(f"{where}: shows = {effect.shows!r} is none of {CHANNELS}.")
    if (effect.site == "sensor") != ("channel" in effect.hooks()):
        raise PhysicsError(f"{where}: the hook `channel` belongs to the site sensor, to it alone.")
    if "parallel" in effect.hooks() and (
        effect.sites != ("damper",) or not {*effect.hooks()} <= {"parallel", "rate", "advance"}
    ):
        raise PhysicsError(
            f"{where}: the hook `parallel` belongs to the site damper, with states and no other "
            "hook beside it."
        )
    wrong = [name for name in effect.starts if name not in effect.states]
    if wrong:
        raise PhysicsError(f"{where}: starts names {wrong}; its states are {list(effect.states)}.")
    if not effect.hooks():
        raise PhysicsError(f"{where}: defines no hook; there are {list(HOOKS)}.")
    if "rate" in effect.hooks() and "advance" in effect.hooks():
        raise PhysicsError(f"{where}: its states move by `rate` or by `advance`, not both.")
    if bool(effect.changes) != ("changed" in effect.hooks()):
        raise PhysicsError(f"{where}: changes and the hook `changed` go together.")
    if effect.changes and (len(effect.hooks()) > 1 or effect.sites != ("damper",)):
        raise PhysicsError(f"{where}: changes a parameter of the damper; no other hook is right.")
    if effect.states and not ("rate" in effect.hooks() or "advance" in effect.hooks()):
        raise PhysicsError(f"{where}: has states and neither `rate` nor `advance`.")
    if effect.joint and (len(effect.joint) != 2 or not set(effect.joint) <= set(effect.states)):
        raise PhysicsError(f"{where}: joint = {effect.joint}; the names of two states are right.")
    if not (effect.__doc__ or "").strip():
        raise PhysicsError(f"{where}: a first docstring line tells users what it is.")
    if "laws" in vars(effect):
        raise PhysicsError(
            f"{where}: names laws; its hooks decide which laws it joins, acts_on narrows them."
        )
    wrong = [part for part in effect.acts_on if part not in PARTS]
    if wrong:
        raise PhysicsError(f"{where}: acts_on {wrong}; laws have parts {PARTS}.")
    check_numbers(where, effect.parameters, effect.tables)
    check_search(effect, where)
    check_verdict(effect, where)


def effects_of(site: str, law: str = "") -> tuple[type[Effect], ...]:
    """Return the registered effects of a site by name, or those of them that can join `law`."""
    return tuple(
        effect
        for _, effect in sorted(EFFECTS.items())
        if site in effect.sites and (not law or effect.joins(LAWS[law]))
    )


def laws_joined(effect: type[Effect]) -> tuple[str, ...]:
    """Return the names of the laws that an effect can join in a damper; none for other sites.

    One that changes what only a bent command has joins laws of that form.
    """
    laws = laws_of("damper")
    straight = tuple(law.name for law in laws if effect.joins(law))
    if straight or not effect.changes:
        return straight
    bent = [LAWS[joined_form(law.name, QUADRATIC_FORM, ())] for law in laws if choosable(law)]
    return tuple(law.name for law in bent if effect.joins(law))


def instrument_of(channel: str, fault: str) -> str:
    """Return the sensor effect that is a kind of fault of a channel, "" if none is."""
    known = [e for e in effects_of("sensor") if e.shows == channel and fault in e.faults]
    return min(known, key=lambda effect: effect.own).name if known else ""
