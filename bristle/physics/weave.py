"""Weaves the hooks of all registered effects into one plain function per site.

numba cannot loop over a list of different functions, and a Python loop over them would be slow.
So the loop is written out once as source, with a run-time switch per effect: the same text runs in
plain Python inside FMUs and, compiled, on the fast path. Numbers live in flat sequences, `p` for
parameters, `z` for states, `on` for switches; a `Layout` says which is where.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

from .effect import Effect, Q, effects_of

LAW_PARAMETERS = 8
"""Slots in front of `p` that belong to the law itself."""

LAW_STATES = 1
"""Slots in front of `z` that belong to the law itself: the bristle deflection."""


class Layout:
    """Where each effect of a site keeps its switch, states and parameters in the flat sequences.

    Attributes
    ----------
    effects : tuple of Effect classes, by name
    parameters, states : dict
        Name, such as "gas_spring.k", to its index in `p` or `z`.
    switches : dict
        Effect name to its index in `on`.
    elsewhere : dict
        State name to the variable that holds it in woven source, for those not read from `z`.
    block : str
        Source of what is added to a state's index: where the states of one of several places begin.
    """

    def __init__(self, site: str, parameters_first: int, states_first: int) -> None:
        self.effects = effects_of(site)
        self.parameters: dict[str, int] = {}
        self.states: dict[str, int] = {}
        self.switches: dict[str, int] = {}
        self.elsewhere: dict[str, str] = {}
        self.block = ""
        self.p_size = parameters_first
        self.z_size = states_first
        for effect in self.effects:
            self.switches[effect.name] = len(self.switches)
            for name in effect.parameters:
                self.parameters[effect.name + "." + name] = self.p_size
                self.p_size += 1
            for name in effect.states:
                self.states[effect.name + "." + name] = self.z_size
                self.z_size += 1

    def only(self, keep: Callable[[type[Effect]], bool]) -> Layout:
        """Return the same layout with those effects alone that are to be kept."""
        part = copy(self)
        part.effects = tuple(effect for effect in self.effects if keep(effect))
        return part

    def reading(self, elsewhere: dict[str, str]) -> Layout:
        """Return the same layout with states that are read from variables: name to variable."""
        part = copy(self)
        part.elsewhere = elsewhere
        return part

    def at(self, block: str) -> Layout:
        """Return the same layout with every state's index further by what `block` says."""
        part = copy(self)
        part.block = block
        return part

    def slots(self, effect: type[Effect]) -> list[str]:
        """Return the source of the indices of the effect's states in `z`."""
        return [f"{self.states[effect.name + '.' + name]}{self.block}" for name in effect.states]

    def values(self, effect: type[Effect]) -> str:
        """Return the source that makes the effect's parameter tuple from `p`."""
        slots = [self.parameters[effect.name + "." + name] for name in effect.parameters]
        return "{}_P({})".format(effect.name, ", ".join(f"p[{slot}]" for slot in slots))

    def state(self, effect: type[Effect]) -> str:
        """Return the source that makes the effect's state tuple, from `z` where nothing else is."""
        sources = [
            self.elsewhere.get(effect.name + "." + name, f"z[{slot}]")
            for name, slot in zip(effect.states, self.slots(effect))
        ]
        return "{}_Z({})".format(effect.name, ", ".join(sources))


def call(effect: type[Effect], hook: str, layout: Layout, q: str) -> str:
    """Return the source of one call of a hook."""
    return f"{effect.name}_{hook}({q}, {layout.state(effect)}, {layout.values(effect)})"


def q_source(**given: str) -> str:
    """Return the source of a `Q` in which every signal that is not given is zero."""
    return "Q({})".format(", ".join(given.get(name, "0.0") for name in Q._fields))


def switched(layout: Layout, hook: str, line: str, **q: str) -> list[str]:
    """Return `if on[...]: LINE` for every effect of the layout with that hook.

    `line` holds `{call}` where the hook's value belongs, and `{dz}` or `{z_next}` for the
    assignment targets of the effect's states; `q` names the variables that feed `Q`. An effect
    that changes the voltage keeps to the voltage that it was given, in `rate` and `advance` too.
    """
    lines = []
    for effect in layout.effects:
        if hook not in effect.hooks():
            continue
        if hook == "voltage":
            lines.append(f"    V_{effect.name} = V")
        if "voltage" in effect.hooks():
            q["V"] = "V_" + effect.name
        elif "V" in q:
            q["V"] = "V"
        slots = layout.slots(effect)
        lines.append(f"    if on[{layout.switches[effect.name]}]:  # {effect.name}")
        text = line.format(
            call=call(effect, hook, layout, q_source(**q)),
            dz="".join(f"dz[{slot}], " for slot in slots),
            z_next="".join(f"z_next[{slot}], " for slot in slots),
        )
        lines.append("        " + text)
    return lines


def weave(name: str, source: str, layout: Layout, **also: Any) -> Any:
    """Compile woven source; return the function `name` with the hooks in its globals."""
    namespace: dict[str, Any] = {"Q": Q, "__name__": __name__}
    namespace.update(also)
    for effect in layout.effects:
        namespace[effect.name + "_P"] = effect.Values
        namespace[effect.name + "_Z"] = effect.State
        for hook, function in effect.hooks().items():
            namespace[effect.name + "_" + hook] = function
    exec(compile(source, f"<woven {name}>", "exec"), namespace)
    function = namespace[name]
    function.source = source
    return function
