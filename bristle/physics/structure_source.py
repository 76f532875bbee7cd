"""The text of a structure's functions, generated from the hooks of its effects.

Effects of the isolation layer act on the first level. Those of the storeys are called for each,
with its drift and with states of its own: behind the layer's in `z`, a block for every level.
"""

from __future__ import annotations

from .codegen import Slots, switched

_SHARED = {"dt": "dt", "energy": "energy", "halt": "halt"}
_ISOLATION = {
    "x": "x[0]",
    "v": "x[n]",
    "stiffness": "stiffnesses[0] if isolated else 0.0",
    **_SHARED,
}
_STOREY = {
    "drift": "drift",
    "drift_rate": "drift_rate",
    "stiffness": "stiffnesses[i]",
    "storey": "storey",
    **_SHARED,
}


def _each_storey(*body: str) -> list[str]:
    """Return the loop over the storeys; `i` is the level that a storey carries."""
    return [
        "    for i in range(1 if isolated else 0, n):",
        "        drift = x[i] - (x[i - 1] if i > 0 else 0.0)",
        "        drift_rate = x[n + i] - (x[n + i - 1] if i > 0 else 0.0)",
        "        storey = float(i if isolated else i + 1)",
        *("    " + line for line in body),
    ]


def _of_storeys(slots: Slots) -> Slots:
    """Return the slots of the effects of storeys, each storey with states of its own."""
    part = slots.only(lambda effect: "spring" in effect.hooks())
    return part.at(f" + (i + 1) * {slots.z_size}")


def forces_source(slots: Slots) -> str:
    """Return `effect_forces`: what all effects but contacts exert on the levels."""
    smooth = slots.only(lambda effect: not effect.contact)
    storeys = switched(_of_storeys(slots), "spring", "pull += {call}", **_STOREY)
    lines = [
        "def effect_forces(n, isolated, stiffnesses, x, dt, energy, halt, z, p, on, forces):",
        "    for i in range(n):",
        "        forces[i] = 0.0",
        *switched(smooth, "force", "forces[0] += {call}", **_ISOLATION),
        *_each_storey(
            "    pull = 0.0",
            *storeys,
            "    forces[i] += pull",
            "    if i > 0:",
            "        forces[i - 1] -= pull",
        ),
    ]
    return "\n".join(lines)


def contact_source(slots: Slots) -> str:
    """Return `contact_force`: the force of friction and stops on the first level."""
    contact = slots.only(lambda effect: effect.contact)
    lines = [
        "def contact_force(n, isolated, stiffnesses, x, dt, energy, halt, z, p, on):",
        "    total = 0.0",
        *switched(contact, "force", "total += {call}", **_ISOLATION),
        "    return total",
    ]
    return "\n".join(lines)


def advance_source(slots: Slots) -> str:
    """Return `advance_effects`: the states after a step, at one motion of all levels."""
    base = slots.only(lambda effect: "force" in effect.hooks() or "spring" not in effect.hooks())
    storeys = _of_storeys(slots)
    lines = [
        "def advance_effects(",
        "    n, isolated, stiffnesses, x, dt, energy, halt, force, z, p, on, z_next",
        "):",
        *_advanced(base, **_ISOLATION, force="force"),
        *_each_storey("    pass", *_advanced(storeys, **_STOREY)),
        "    return",
    ]
    return "\n".join(lines)


def _advanced(slots: Slots, **q: str) -> list[str]:
    """Return the source that advances the states of effects, by Euler's rule where they flow."""
    lines = switched(slots, "rate", "{z_next}= {call}", **q)
    for effect in slots.effects:
        if "rate" in effect.hooks():
            places = slots.places(effect)
            lines.append(f"    if on[{slots.switches[effect.name]}]:")
            lines += [f"        z_next[{k}] = z[{k}] + dt * z_next[{k}]" for k in places]
    return [*lines, *switched(slots, "advance", "{z_next}= {call}", **q)]
