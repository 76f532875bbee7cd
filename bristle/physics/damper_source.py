"""A damper's functions, generated from the hooks of laws and effects: their text, and their sets.

A law's own calls stand where the hooks of the effects meet them: first what changes the voltage and
the motion, then the factors, then the forces, then what the states make of all that.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from . import effects as _effects  # noqa: F401  (importing it registers the effects)
from .effect import Effect, effects_of
from .generate import Functions, Sets, Slots, call, q_source, switched, switched_laws
from .law import Law, base_and_variant, laws_of
from .tuples import FACTORS, FORM_OF_LAW, law_state, law_values

_FACTORS = {"limit": " * yield_factor * slip_length", "viscous": " * viscous_factor"}
_ALL_FACTORS = {name: name for name in FACTORS}  # variables of the generated source
_NOW = "    x, v, a, V, dt, energy, halt, halts = now"
_SETUP = f"    law, p, on = setup.law, setup.p, setup.on\n{FORM_OF_LAW}"
_MORE_THAN_ANY = "1e30"  # N, which no friction is: what would stop a motion that is prescribed
_BY_SIGN = f"({_MORE_THAN_ANY} if v > 0.0 else -{_MORE_THAN_ANY} if v < 0.0 else 0.0)"
_LEFT = f"halt - force if halts else {_BY_SIGN}"
_ROD = ["    rod_x = x", "    rod_v = v"]
_Q = {name: name for name in ("x", "v", "a", "V", "dt", "energy", "rod_x", "rod_v")}


def _of_motion(head: str, lines: list[str], result: str) -> str:
    """Return the source of a function of setup, motion and states, before the law has its say."""
    begin = [f"def {head}(setup, now, z):", "    p, on = setup.p, setup.on", _NOW, *_ROD]
    return "\n".join([*begin, *lines, f"    return {result}"])


def motion_source(slots: Slots) -> str:
    """Return `inner_motion`: the motion across the fluid, behind what gives way."""
    return _of_motion("inner_motion", switched(slots, "motion", "x, v = {call}", **_Q), "x, v")


def voltage_source(slots: Slots) -> str:
    """Return `felt_voltage`: the voltage that the fluid feels."""
    return _of_motion("felt_voltage", switched(slots, "voltage", "V = {call}", **_Q), "V")


def law_factors_source(slots: Slots) -> str:
    """Return `law_factors`: what effects make of the law's `FACTORS` at a motion."""
    return _of_motion("law_factors", _factors(slots, {**_Q}), ", ".join(FACTORS))


def series_source(slots: Slots) -> str:
    """Return `series_element`: where the states of the series element are that is switched on."""
    lines = ["def series_element(on):"]
    for effect in slots.effects:
        if effect.joint:
            places = [str(slots.states[effect.name + "." + name]) for name in effect.joint]
            lines.append(f"    if on[{slots.switches[effect.name]}]:  # {effect.name}")
            lines.append(f"        return {', '.join(places)}")
    return "\n".join([*lines, "    return -1, -1"])


def _values(slots: Slots, law: type[Law], factors: Mapping[str, str] | None = None) -> str:
    """Return the source of a law's parameter tuple, in the form of the command that `p` holds."""
    return law_values(law, factors, place=slots.law_parameters)


def advance_law_source(slots: Slots) -> str:
    """Return `advance_law`: the law's own states after a step at the motion of `now`, exactly.

    `factors` are those of `FACTORS` over the step, 1 where no effect changes them.
    """

    def own(law: type[Law]) -> list[str]:
        if law.hook("advance") is None:
            return []
        return [
            f"k = {_values(slots, law, _ALL_FACTORS)}",
            f"{_targets(law, 'z_next')} = {law.name}_advance(now, {law_state(law)}, k)",
        ]

    lines = [
        "def advance_law(law, p, now, factors, z, z_next):",
        "    V = now.V",
        f"    {', '.join(FACTORS)} = factors",
        FORM_OF_LAW,
        *switched_laws(slots, own),
        "    return",
    ]
    return "\n".join(lines)


def _targets(law: type[Law], name: str) -> str:
    return "".join(f"{name}[{k}], " for k in range(len(law.states))).rstrip()


def _forces(law: type[Law], factors: bool = True) -> str:
    """Return the source of a law's force but for friction with a sign, at `q`, `s`, `k`."""
    own = dict(_FACTORS) if factors else {}
    if factors:
        # Bristles that slip later bend further and carry more; what has none must be told so.
        own["yielding"] = " * yield_factor" + ("" if law.has("bristle") else " * slip_length")
    hooks = ("yielding", "damping", "viscous", "elastic")
    terms = [f"{law.name}_{hook}(q, s, k){own.get(hook, '')}" for hook in hooks if law.hook(hook)]
    return " + ".join(terms) or "0.0"


def _friction(limit: str) -> list[str]:
    return [
        f"limit = {limit}",
        "if halts:",
        "    friction = min(max(halt - rest, -limit), limit)",
        "elif v > 0.0:",
        "    friction = limit",
        "elif v < 0.0:",
        "    friction = -limit",
    ]


def law_force_source(slots: Slots) -> str:
    """Return `law_force`: force and friction of the law alone, without any effect."""

    def own(law: type[Law]) -> list[str]:
        lines = [
            f"s = {law_state(law)}",
            f"k = {_values(slots, law)}",
            f"rest = {_forces(law, False)}",
        ]
        return [*lines, *(_friction(f"{law.name}_limit(q, s, k)") if law.has("sign") else [])]

    return _of_law(slots, "def law_force(law, p, q, z):", own)


def _of_law(slots: Slots, head: str, own: Callable[[type[Law]], list[str]]) -> str:
    """Return the source of a function that gives force and friction of the law alone."""
    lines = [
        head,
        "    v, V, halt, halts = q.v, q.V, q.stick_force, q.sticks",
        FORM_OF_LAW,
        "    friction = 0.0",
        "    rest = 0.0",
        *switched_laws(slots, own),
        "    return friction + rest, friction",
    ]
    return "\n".join(lines)


def step_law_source(slots: Slots) -> str:
    """Return `step_law`: a step of the law alone; force and friction at its end.

    The command of a law that lags moves on with the voltage's mean, else it is that of the end.
    """
    middle = (
        "m = record(Inputs, (0.5 * (begin.x + q.x), 0.5 * (begin.v + q.v), q.a, {V}, q.dt, "
        "q.energy, halt, halts))"
    )
    return _law_steps(slots, "def step_law(law, p, begin, q, z, z1):", middle)


def hold_law_source(slots: Slots) -> str:
    """Return `hold_law`: `step_law` with the inputs held over the step."""
    return _law_steps(slots, "def hold_law(law, p, q, z, z1):", "m = q")


def _law_steps(slots: Slots, head: str, middle: str) -> str:
    def own(law: type[Law]) -> list[str]:
        lines = [f"k = {_values(slots, law)}"]
        if law.hook("advance") is not None:
            advanced = f"{law.name}_advance(m, {law_state(law)}, k)"
            lines.append(middle.format(V="0.5 * (begin.V + V)" if law.felt else "V"))
            lines.append(f"{_targets(law, 'z1')} = {advanced}")
        if law.felt:
            lines.append(f"k = {law_values(law, felt='z1', place=slots.law_parameters)}")
        lines += [f"s = {law_state(law).replace('z[', 'z1[')}", f"rest = {_forces(law, False)}"]
        return [*lines, *(_friction(f"{law.name}_limit(q, s, k)") if law.has("sign") else [])]

    return _of_law(slots, head, own)


def evaluate_source(slots: Slots) -> str:
    """Return `evaluate`: force, friction and the rates of the states."""
    q = {**_Q, "force": "force", "halt": "halt"}

    def own(law: type[Law]) -> list[str]:
        lines = [
            f"s = {law_state(law)}",
            f"k = {_values(slots, law, _ALL_FACTORS)}",
            f"rest = ({_forces(law)}) * factor + added",
        ]
        if law.has("sign"):
            limit = f"{law.name}_limit(q, s, k){_FACTORS['limit']} * factor"
            first, if_sticks, *others = _friction(limit)
            lines += [first, "if directed:", "    friction = limit * direction"]
            lines += ["el" + if_sticks, *others]
        if law.hook("rate") is not None:
            lines.append(f"{_targets(law, 'dz')} = {law.name}_rate(q, s, k)")
        return lines

    beside = slots.only(lambda effect: "parallel" in effect.hooks())
    lines = [
        "def evaluate(setup, now, z, dz, z_next):",
        _SETUP,
        _NOW,
        *_ROD,
        *(["    command = V", "    beside = 0.0"] if beside.effects else []),
        *switched(beside, "parallel", "beside += {call}", **_Q),
        *(["    halt = halt - beside"] if beside.effects else []),  # friction carries the rest
        "    force = 0.0",
        *switched(slots, "voltage", "V = {call}", **q),
        *switched(slots, "motion", "x, v = {call}", **q),
        *_factors(slots, q),
        "    direction = 0.0",
        "    directed = False",
        *switched(slots, "yield_force", "direction = {call}; directed = True", **q),
        *_added(slots, q),
        "    friction = 0.0",
        "    rest = 0.0",
        "    q = record(Inputs, (x, v, a, V, dt, energy, halt, halts))",
        *switched_laws(slots, own),
        "    force = friction + rest",
        *_contacts(slots, q),
        *switched(slots, "rate", "{dz}= {call}", **q),
        *switched(slots, "advance", "{z_next}= {call}", **q),
        *switched(slots, "reaction", "force = {call}; friction = 0.0", **q),
        f"    return force{' + beside' if beside.effects else ''}, friction",
    ]
    return "\n".join(lines)


def _factors(slots: Slots, q: dict[str, str]) -> list[str]:
    return [
        "    yield_factor = 1.0",
        "    viscous_factor = 1.0",
        "    slip_length = 1.0",
        *switched(slots, "yield_factor", "yield_factor *= {call}", **q),
        *switched(slots, "viscous_factor", "viscous_factor *= {call}", **q),
        *switched(slots, "reach", "slip_length *= {call}", **q),
    ]


def _added(slots: Slots, q: dict[str, str]) -> list[str]:
    smooth = slots.only(lambda effect: not effect.contact)
    return [
        "    added = 0.0",
        *switched(smooth, "force", "added += {call}", **q),
        "    factor = 1.0",
        *switched(slots, "factor", "factor *= {call}", **q),
    ]


def _contacts(slots: Slots, q: dict[str, str]) -> list[str]:
    """Return the forces of contacts, which come last: friction carries what the others leave."""
    lines: list[str] = []
    for effect in slots.effects:
        if effect.contact and "force" in effect.hooks():
            only = slots.only(lambda one, wanted=effect: one is wanted)  # type: ignore[misc]
            rubs = " friction += pushed;" if is_friction(effect) else ""
            line = f"left = {_LEFT}; pushed = {{call}};{rubs} force += pushed"
            lines += switched(only, "force", line, **{**q, "halt": "left"})
    return lines


def is_friction(effect: type[Effect]) -> bool:
    """Return whether a contact can hold the motion, as dry friction does."""
    return effect.contact and "halt" in effect.needs


def changed_source(slots: Slots) -> str:
    """Return `changed`: what effect k makes of the parameter that it changes, before a run."""
    lines = ["def changed(k, value, p):"]
    for k, effect in enumerate(slots.effects):
        if effect.changes:
            made = call(effect, "changed", slots, q_source(value="value"))
            lines += [f"    if k == {k}:  # {effect.name}", f"        return {made}"]
    return "\n".join([*lines, "    return value"])


def net_force_source(slots: Slots) -> str:
    """Return what accelerates a series mass: `evaluate` without all that it can lack.

    The speed of a series mass is found by trials, so nothing is called more often. `way` is the
    direction of friction, `middle` the velocity in the middle of the step; `deflection` and `speed`
    stand for the states of the series element.
    """
    series = [effect for effect in slots.effects if effect.joint]
    names = [f"{effect.name}.{state}" for effect in series for state in effect.joint]
    slots = slots.reading({name: ("deflection", "speed")[i % 2] for i, name in enumerate(names)})
    q = {**_Q, "force": "force"}

    def own(law: type[Law]) -> list[str]:
        lines = [f"s = {law_state(law)}"]
        if law.hook("advance") is not None:
            lines += [
                f"k = {_values(slots, law, {**_ALL_FACTORS, 'slip_length': 'half_slip_length'})}",
                "m = record(Inputs, (x, middle, a, V, dt, energy, 0.0, False))",
                f"s = record({law.name}_Z, {law.name}_advance(m, s, k))",
            ]
        lines.append(f"k = {_values(slots, law, _ALL_FACTORS)}")
        forces = _forces(law)
        if law.has("sign"):
            friction = f"{law.name}_limit(q, s, k){_FACTORS['limit']} * direction"
            forces = friction if forces == "0.0" else f"{friction} + {forces}"
        return [*lines, f"force = ({forces}) * factor + added"]

    lines = [
        "def net_force(setup, now, way, middle, deflection, speed, z):",
        _SETUP,
        _NOW,
        *_ROD,
        "    force = 0.0",
        *switched(slots, "voltage", "V = {call}", **q),
        *switched(slots, "motion", "x, v = {call}", **q),
        *_factors(slots, q),
        "    half_slip_length = 1.0",
        *switched(slots, "reach", "half_slip_length *= {call}", **{**q, "v": "middle"}),
        "    direction = way",
        *switched(slots, "yield_force", "direction = {call}", **q),
        *_added(slots, q),
        *switched(
            slots.only(lambda effect: effect.contact),
            "force",
            "added += {call}",
            **{**q, "halt": f"way * {_MORE_THAN_ANY}"},
        ),
        "    q = record(Inputs, (x, v, a, V, dt, energy, 0.0, False))",
        *switched_laws(slots, own),
        "    pull = 0.0",
    ]
    for effect in series:
        place = list(effect.states).index(effect.joint[1])
        only = slots.only(lambda one, wanted=effect: one is wanted)  # type: ignore[misc]
        lines += switched(only, "rate", f"pull = {{call}}[{place}]", **q)
    return "\n".join([*lines, "    return pull"])


SETS = Sets(
    {
        "advance_law": advance_law_source,
        "changed": changed_source,
        "evaluate": evaluate_source,
        "felt_voltage": voltage_source,
        "hold_law": hold_law_source,
        "inner_motion": motion_source,
        "law_factors": law_factors_source,
        "law_force": law_force_source,
        "net_force": net_force_source,
        "series_element": series_source,
        "step_law": step_law_source,
    },
    *laws_of("damper"),
    *effects_of("damper"),
)
LIBRARY = SETS.library
(
    advance_law, changed, evaluate, felt_voltage, hold_law, inner_motion, law_factors, law_force,
    net_force, series_element, step_law,
) = LIBRARY.made.values()  # fmt: skip


def functions_of(law: str, effects: Collection[str]) -> Functions:
    """Return functions of a law with effects: the library's, if it has them."""
    wanted = tuple(effect for effect in effects_of("damper") if effect.name in effects)
    return SETS.serving(base_and_variant(law)[0].base, *wanted)
