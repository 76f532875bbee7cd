"""Generates the plain functions of a site from the hooks of a set of laws and effects.

numba cannot loop over a list of different functions, and a Python loop over them would be slow.
So the loop is written out once as source, with a run-time switch per law and effect: the same text
runs in plain Python inside FMUs and, compiled, on the fast path. Numbers live in flat sequences,
`p` for parameters, `z` for states, `on` for switches; `Slots` say which is where. The first slots
of `p` and `z` belong to the law, as many as the largest law needs.

The functions of some laws and effects are a value, `Functions`. Modules import those of the library
by name, which never change; `Link` makes copies that call those of another set.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from types import FunctionType, SimpleNamespace
from typing import Any, Union

from .command import MOST_KNOTS, entered, rising
from .effect import Effect, Q
from .law import Law
from .parameter import climb
from .tuples import Inputs, listed, made, record

Owner = Union[type[Law], type[Effect]]


class Slots:
    """Where each effect of a set keeps its switch, states and parameters in the flat sequences.

    Attributes
    ----------
    laws : tuple of Law classes, by code; none where the site's law is not generated
    effects : tuple of Effect classes, by name
    law_parameters, law_states : int
        How many slots in front of `p` and `z` belong to the law. In `p` the knots and numbers of a
        chosen form come next (see `command.entered`).
    parameters, states : dict
        Name, such as "gas_spring.k", to its index in `p` or `z`.
    switches : dict
        Effect name to its index in `on`.
    elsewhere : dict
        State name to the variable that holds it in generated source, for those not read from `z`.
    block : str
        Source of what is added to a state's index: where the states of one of several places begin.
    """

    def __init__(self, laws: tuple[type[Law], ...], effects: tuple[type[Effect], ...]) -> None:
        self.laws, self.effects = laws, effects
        self.parameters: dict[str, int] = {}
        self.states: dict[str, int] = {}
        self.switches: dict[str, int] = {}
        self.elsewhere: dict[str, str] = {}
        self.block = ""
        self.law_parameters = max((len(law.parameters) for law in self.laws), default=0)
        self.law_states = max((len(law.states) for law in self.laws), default=0)
        quantities = max((len(law.command) for law in self.laws), default=-1)
        self.p_size = self.law_parameters + MOST_KNOTS * (quantities + 1)
        self.z_size = self.law_states
        for effect in self.effects:
            self.switches[effect.name] = len(self.switches)
            for name in effect.parameters:
                self.parameters[effect.name + "." + name] = self.p_size
                self.p_size += 1
            for name in effect.states:
                self.states[effect.name + "." + name] = self.z_size
                self.z_size += 1

    def only(self, keep: Callable[[type[Effect]], bool]) -> Slots:
        """Return the same slots with those effects alone that are to be kept."""
        return self._with(effects=tuple(effect for effect in self.effects if keep(effect)))

    def reading(self, elsewhere: dict[str, str]) -> Slots:
        """Return the same slots with states that are read from variables: name to variable."""
        return self._with(elsewhere=elsewhere)

    def at(self, block: str) -> Slots:
        """Return the same slots with every state's index further by what `block` says."""
        return self._with(block=block)

    def _with(self, **changed: Any) -> Slots:
        part = copy(self)
        vars(part).update(changed)
        return part

    def places(self, effect: type[Effect]) -> list[str]:
        """Return the source of the indices of the effect's states in `z`."""
        return [f"{self.states[effect.name + '.' + name]}{self.block}" for name in effect.states]

    def values(self, effect: type[Effect]) -> str:
        """Return the source that makes the effect's parameter tuple from `p`."""
        at = {name: f"p[{self.parameters[effect.name + '.' + name]}]" for name in effect.parameters}
        return made(f"{effect.name}_P", listed(effect.fields(), effect.tables, at))

    def state(self, effect: type[Effect]) -> str:
        """Return the source that makes the effect's state tuple, from `z` where nothing else is."""
        sources = [
            self.elsewhere.get(effect.name + "." + name, f"z[{place}]")
            for name, place in zip(effect.states, self.places(effect))
        ]
        return made(f"{effect.name}_Z", sources)


Texts = Mapping[str, Callable[[Slots], str]]


def call(effect: type[Effect], hook: str, slots: Slots, q: str) -> str:
    """Return the source of one call of a hook.

    Parameters
    ----------
    effect : Effect class that has the hook
    hook : name of the hook, such as "force"
    slots : Slots, say where the effect's states and parameters are
    q : source of the signals, as `q_source` returns it
    """
    return f"{effect.name}_{hook}({q}, {slots.state(effect)}, {slots.values(effect)})"


def q_source(**given: str) -> str:
    """Return the source of a `Q` in which every signal that is not given is zero."""
    return made("Q", [given.get(name, "0.0") for name in Q._fields])


def switched(slots: Slots, hook: str, line: str, **q: str) -> list[str]:
    """Return `if on[...]: LINE` for every effect of the slots with that hook.

    `line` holds `{call}` where the hook's value belongs, and `{dz}` or `{z_next}` for the
    assignment targets of the effect's states; `q` names the variables that feed `Q`. An effect
    that changes the voltage keeps to the voltage that it was given, in `rate` and `advance` too.
    One in parallel with the whole damper knows motion and command as they come to that.
    """
    lines = []
    for effect in slots.effects:
        if hook not in effect.hooks():
            continue
        if hook == "voltage":
            lines.append(f"    V_{effect.name} = V")
        given = dict(q)
        if "parallel" in effect.hooks():
            given |= {"x": "rod_x", "v": "rod_v", "V": "command"}
        elif "voltage" in effect.hooks():
            given["V"] = "V_" + effect.name
        places = slots.places(effect)
        lines.append(f"    if on[{slots.switches[effect.name]}]:  # {effect.name}")
        text = line.format(
            call=call(effect, hook, slots, q_source(**given)),
            dz="".join(f"dz[{place}], " for place in places),
            z_next="".join(f"z_next[{place}], " for place in places),
        )
        lines.append("        " + text)
    return lines


def switched_laws(slots: Slots, lines: Callable[[type[Law]], list[str]]) -> list[str]:
    """Return `if law == CODE: LINES` for every law of the slots that has lines."""
    out: list[str] = []
    for code, law in enumerate(slots.laws):
        own = lines(law)
        if own:
            out.append(f"    {'elif' if out else 'if'} law == {code}:  # {law.name}")
            out += ["        " + line for line in own]
    return out


def generate(name: str, source: str, slots: Slots) -> Any:
    """Compile generated source; return the function `name` with the hooks in its globals."""
    namespace: dict[str, Any] = {"Q": Q, "Inputs": Inputs, "record": record}
    namespace.update(climb=climb, rising=rising, entered=entered)
    namespace["__name__"] = __name__
    owners: tuple[Owner, ...] = (*slots.laws, *slots.effects)
    for owner in owners:
        namespace[owner.name + "_P"] = owner.Values
        namespace[owner.name + "_Z"] = owner.State
        for hook, function in owner.hooks().items():
            namespace[owner.name + "_" + hook] = function
    exec(compile(source, f"<generated {name}>", "exec"), namespace)
    function = namespace[name]
    function.source = source
    return function


class Functions:
    """The functions of a set of laws and effects at one site; nothing changes it.

    Attributes
    ----------
    slots : Slots
    made : dict
        Name to function.
    link : Link
        Puts them in place of the library's.
    """

    def __init__(self, slots: Slots, texts: Texts) -> None:
        self.slots, self._texts = slots, texts
        self.made = {name: generate(name, text(slots), slots) for name, text in texts.items()}
        self.link = Link(self.made)
        self._changing: dict[tuple[type[Effect], ...], Functions] = {}

    def have(self, *owners: Owner) -> bool:
        """Return whether laws and effects are in the set."""
        return {*owners}.issubset((*self.slots.laws, *self.slots.effects))

    def changing(self, effects: Iterable[type[Effect]]) -> Functions:
        """Return these with effects that change parameters before a run, behind all others.

        Nothing that is computed over a run is generated, or compiled, anew.
        """
        wanted = tuple(sorted(effects, key=lambda one: one.name))
        if not wanted:
            return self
        if wanted not in self._changing:
            found = self._changing[wanted] = copy(self)
            found.slots = Slots(self.slots.laws, (*self.slots.effects, *wanted))
            text = self._texts["changed"](found.slots)
            found.made = {**self.made, "changed": generate("changed", text, found.slots)}
            found.link = Link(found.made)
        return self._changing[wanted]


class Sets:
    """The sets of functions of a site, each made once: that of the `library`, then others.

    Parameters
    ----------
    texts : mapping
        Name of a function to what returns its source.
    owners : classes
        Laws in the order of their codes, effects by name; those in this package are the library's.
    """

    def __init__(self, texts: Texts, *owners: Owner) -> None:
        self._texts, here = texts, __name__.rpartition(".")[0]
        self._made: dict[frozenset[Owner], Functions] = {}
        own = [one for one in _apart(owners)[0] if one.__module__.startswith(here)]
        self.library = self._add(own)

    def _add(self, owners: Sequence[Owner]) -> Functions:
        laws = tuple(one for one in owners if issubclass(one, Law))
        effects = tuple(one for one in owners if issubclass(one, Effect))
        found = self._made[frozenset(owners)] = Functions(Slots(laws, effects), self._texts)
        return found

    def of(self, *owners: Owner) -> Functions:
        """Return the functions of these laws and effects alone."""
        rest, changing = _apart(owners)
        known = self._made.get(frozenset(rest))
        known = known or self._add(sorted({*rest}, key=lambda one: one.name))
        return known.changing(changing)

    def offering(self, *owners: Owner) -> Functions:
        """Return the functions of the library, or of these alone where it lacks one."""
        rest, changing = _apart(owners)
        return self.library.changing(changing) if self.library.have(*rest) else self.of(*owners)

    def serving(self, *owners: Owner) -> Functions:
        """Return the first set that has these: what it has besides is switched off."""
        rest, changing = _apart(owners)
        for one in [*self._made.values()]:
            if one.have(*rest):
                return one.changing(changing)
        return self.of(*owners)


def _apart(owners: Iterable[Owner]) -> tuple[list[Owner], list[type[Effect]]]:
    """Return laws and effects, apart from the effects that change parameters before a run."""
    changing = [one for one in owners if issubclass(one, Effect) and one.changes]
    return [one for one in owners if one not in changing], changing


class Link:
    """Returns functions as they are with others in place of what they call by name.

    A function that numba compiles finds what it calls among its module's globals. So it is copied
    with other ones, and so is what leads there; what calls nothing of that name stays as it is.

    Parameters
    ----------
    names : mapping
        Name of a global to what stands in its place.
    keep : functions that stay as they are, with all that they call
    """

    def __init__(self, names: Mapping[str, Any], keep: Iterable[Any] = ()) -> None:
        self.names = names
        self._done = {one: one for one in keep}

    def __call__(self, function: Any) -> Any:
        """Return a function that is linked, the same one each time."""
        if function not in self._done:
            self._done[function] = function
            known, changed = function.__globals__, {}
            for name in function.__code__.co_names:
                value = known.get(name)
                if name in self.names and name in known:
                    changed[name] = self.names[name]
                elif isinstance(value, FunctionType):
                    changed[name] = self(value)
            if any(known[name] != value for name, value in changed.items()):
                self._done[function] = with_globals(function, changed)
        return self._done[function]

    def all_of(self, module: Any) -> Any:
        """Return a module's functions, linked: the module itself where that changes none."""
        found = {
            name: self(value)
            for name, value in vars(module).items()
            if isinstance(value, FunctionType)
        }
        if all(vars(module)[name] is value for name, value in found.items()):
            return module
        return SimpleNamespace(**{**vars(module), **found})


def with_globals(function: Any, changed: Mapping[str, Any]) -> FunctionType:
    """Return a copy of a function some of whose globals are others."""
    copied = FunctionType(
        function.__code__, {**function.__globals__, **changed}, function.__name__,
        function.__defaults__, function.__closure__,
    )  # fmt: skip
    copied.__module__, copied.__qualname__ = function.__module__, function.__qualname__
    return copied
