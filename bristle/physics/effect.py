"""A physical effect: one class in one file, which registers itself and takes part everywhere.

An effect joins a site (`damper`, `structure`, `sensor`) through hooks, pure functions of three
named tuples: `q` the motion and whatever else the site offers (`Q`), `z` the effect's states and
`p` its parameters. A hook uses `math`, arithmetic and `if`, never containers, so that one source
runs in plain Python and under numba.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any, Callable, ClassVar, NamedTuple

from ..errors import PhysicsError

SITES = ("damper", "structure", "sensor")

# In the order in which an evaluation calls them.
HOOKS = (
    "voltage",
    "motion",
    "yield_factor",
    "viscous_factor",
    "yield_force",
    "force",
    "spring",
    "factor",
    "reaction",
    "rate",
    "advance",
    "channel",
)


class Q(NamedTuple):
    """What a hook may ask for. Damper: motion across the fluid; structure: motion of the base.

    `rod_x`, `rod_v` are the damper's motion before any `motion` hook. `force` is the force of this
    same evaluation (`rate`, `advance`), `halt` the force that would bring the motion to rest within
    the step (what a stuck contact carries), `stiffness` the linear stiffness of the storey at hand,
    `storey` its number (1 above the base), `value` the signal that an instrument is about to show.
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
    value: float  # unit of the channel


class Parameter(NamedTuple):
    """A number of a law or effect: default value, SI unit, bounds of what is physical, meaning."""

    value: float
    unit: str
    bounds: tuple[float, float]
    text: str


EFFECTS: dict[str, type[Effect]] = {}


class Effect:
    """Base of every physical effect; defining a subclass with a `name` registers it.

    Class data
    ----------
    name, site, laws
        `laws` names the damper laws that the effect can join.
    needs
        Names of the signals in `q` that the hooks use.
    states, parameters
        `{name: unit}` and `{name: Parameter}`; start values of states are zero.
    joint
        Of a series element: the names of two states, the travel between rod and fluid [m] and the
        velocity across the fluid [m/s]; the integrator finds both, from the second one's `rate`.
    passive, zero_at_rest, excludes, source, expect
        See each effect; conformance tests hold the first two.
    """

    name: ClassVar[str] = ""
    site: ClassVar[str] = "damper"
    laws: ClassVar[tuple[str, ...]] = ("bingham", "lugre")
    needs: ClassVar[tuple[str, ...]] = ()
    states: ClassVar[dict[str, str]] = {}
    parameters: ClassVar[dict[str, Parameter]] = {}
    joint: ClassVar[tuple[str, ...]] = ()
    passive: ClassVar[bool] = False
    zero_at_rest: ClassVar[bool] = True
    excludes: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str] = ""
    expect: ClassVar[str] = ""
    State: ClassVar[Any]
    Values: ClassVar[Any]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.name:
            cls.State = namedtuple("State", tuple(cls.states))  # type: ignore[misc]
            cls.Values = namedtuple("Values", tuple(cls.parameters))  # type: ignore[misc]
            _check(cls)
            EFFECTS[cls.name] = cls

    @classmethod
    def hooks(cls) -> dict[str, Callable[..., Any]]:
        """Return the hooks that this effect defines, in the order of `HOOKS`."""
        return {hook: getattr(cls, hook) for hook in HOOKS if hasattr(cls, hook)}

    @classmethod
    def first_line(cls) -> str:
        """Return the first line of the docstring, which users read."""
        return (cls.__doc__ or "").strip().splitlines()[0]


def _check(effect: type[Effect]) -> None:
    """Refuse an effect whose class data could not work, when it is defined."""
    where = f"effect {effect.name!r} ({effect.__module__}.{effect.__qualname__})"
    if effect.site not in SITES:
        raise PhysicsError(f"{where}: site {effect.site!r} is none of {SITES}.")
    if not effect.name.isidentifier():
        raise PhysicsError(f"{where}: a name is one word of letters, digits and _.")
    unknown = [need for need in effect.needs if need not in Q._fields]
    if unknown:
        raise PhysicsError(f"{where}: needs {unknown}; q offers {list(Q._fields)}.")
    if not effect.hooks():
        raise PhysicsError(f"{where}: defines no hook; there are {list(HOOKS)}.")
    if "rate" in effect.hooks() and "advance" in effect.hooks():
        raise PhysicsError(f"{where}: its states move by `rate` or by `advance`, not both.")
    if effect.states and not ("rate" in effect.hooks() or "advance" in effect.hooks()):
        raise PhysicsError(f"{where}: has states and neither `rate` nor `advance`.")
    if effect.joint and (len(effect.joint) != 2 or not set(effect.joint) <= set(effect.states)):
        raise PhysicsError(f"{where}: joint = {effect.joint}; the names of two states are right.")
    if not (effect.__doc__ or "").strip():
        raise PhysicsError(f"{where}: a first docstring line tells users what it is.")
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        if not low <= parameter.value <= high:
            raise PhysicsError(f"{where}: {name} = {parameter.value} lies outside {(low, high)}.")


def effects_of(site: str, law: str = "") -> tuple[type[Effect], ...]:
    """Return the registered effects of a site by name, or those of them that can join `law`."""
    return tuple(
        effect
        for _, effect in sorted(EFFECTS.items())
        if effect.site == site and (not law or law in effect.laws)
    )
