"""The text of a damper's functions, woven from the hooks of all effects.

The laws' own calls stand where the hooks of the effects meet them: first what changes the voltage
and the motion, then the factors, then the forces, then what the states make of all that.
"""

from __future__ import annotations

from .bingham import Bingham
from .lugre import LuGre
from .weave import Layout, switched


def motion_source(layout: Layout) -> str:
    """Return `inner_motion`: the motion across the fluid, behind what gives way."""
    q = {name: name for name in ("x", "v", "a", "V", "dt", "energy", "rod_x", "rod_v")}
    lines = [
        "def inner_motion(x, v, a, V, dt, energy, z, p, on):",
        "    rod_x = x",
        "    rod_v = v",
        *switched(layout, "motion", "x, v = {call}", **q),
        "    return x, v",
    ]
    return "\n".join(lines)


def reach_source(layout: Layout) -> str:
    """Return `slip_reach`: the factor on the travel before sliding."""
    q = {name: name for name in ("x", "v", "dt", "energy", "rod_x", "rod_v")}
    lines = [
        "def slip_reach(x, v, dt, energy, z, p, on):",
        "    rod_x = x",
        "    rod_v = v",
        "    reach = 1.0",
        *switched(layout, "reach", "reach *= {call}", **q),
        "    return reach",
    ]
    return "\n".join(lines)


def series_source(layout: Layout) -> str:
    """Return `series_element`: where the states of the joint are that is switched on."""
    lines = ["def series_element(on):"]
    for effect in layout.effects:
        if effect.joint:
            slots = [str(layout.states[effect.name + "." + name]) for name in effect.joint]
            lines.append(f"    if on[{layout.switches[effect.name]}]:  # {effect.name}")
            lines.append(f"        return {', '.join(slots)}")
    return "\n".join([*lines, "    return -1, -1"])


def evaluate_source(layout: Layout, name: str) -> str:
    """Return `evaluate` under some name: force, friction and the rates of the states."""
    signals = ("x", "v", "a", "V", "dt", "energy", "force", "rod_x", "rod_v", "halt")
    q = {name: name for name in signals}
    lugre = ", ".join(f"p[{i}]" for i in range(len(LuGre.parameters)))
    bingham = ", ".join(f"p[{i}]" for i in range(len(Bingham.parameters)))
    lines = [
        f"def {name}(law, x, v, a, V, dt, energy, halt, halts, z, p, on, dz, z_next):",
        "    rod_x = x",
        "    rod_v = v",
        "    force = 0.0",
        *switched(layout, "voltage", "V = {call}", **q),
        *switched(layout, "motion", "x, v = {call}", **q),
        "    yield_factor = 1.0",
        "    viscous_factor = 1.0",
        "    reach = 1.0",
        "    added = 0.0",
        "    direction = 0.0",
        "    directed = False",
        *switched(layout, "yield_factor", "yield_factor *= {call}", **q),
        *switched(layout, "viscous_factor", "viscous_factor *= {call}", **q),
        *switched(layout, "reach", "reach *= {call}", **q),
        *switched(layout, "yield_force", "direction = {call}; directed = True", **q),
        *switched(layout, "force", "added += {call}", **q),
        "    factor = 1.0",
        *switched(layout, "factor", "factor *= {call}", **q),
        "    if law == 1:",
        f"        lugre = LuGreP({lugre})",
        "        viscous = LuGre_viscous(v, V, lugre) * viscous_factor",
        "        friction = 0.0",
        "        bristle = LuGre_bristle(z[0], v, V, lugre, reach, yield_factor)",
        "        rest = (bristle + viscous) * factor + added",
        "        dz[0] = LuGre_rate(z[0], v, lugre, reach)",
        "    else:",
        f"        bingham = BinghamP({bingham})",
        "        rest = Bingham_viscous(v, V, bingham) * viscous_factor * factor + added",
        "        limit = Bingham_yielding(V, bingham) * yield_factor * reach * factor",
        "        if directed:",
        "            friction = limit * direction",
        "        elif halts:",
        "            friction = min(max(halt - rest, -limit), limit)",
        "        elif v > 0.0:",
        "            friction = limit",
        "        elif v < 0.0:",
        "            friction = -limit",
        "        else:",
        "            friction = 0.0",
        "    force = friction + rest",
        *switched(layout, "rate", "{dz}= {call}", **q),
        *switched(layout, "advance", "{z_next}= {call}", **q),
        *switched(layout, "reaction", "force = {call}; friction = 0.0", **q),
        "    return force, friction",
    ]
    return "\n".join(lines)


def pull_source(layout: Layout) -> str:
    """Return the source of what accelerates a joint: `evaluate` without all that it can lack.

    The speed of a joint is found by trials, so nothing is called more often.
    """
    joints = [effect for effect in layout.effects if effect.joint]
    names = [f"{effect.name}.{state}" for effect in joints for state in effect.joint]
    layout = layout.reading({name: ("travel", "joint")[i % 2] for i, name in enumerate(names)})
    signals = ("x", "v", "a", "V", "dt", "energy", "force", "rod_x", "rod_v")
    q = {name: name for name in signals}
    lugre = ", ".join(f"p[{i}]" for i in range(len(LuGre.parameters)))
    bingham = ", ".join(f"p[{i}]" for i in range(len(Bingham.parameters)))
    lines = [
        "def joint_pull(",
        "    law, x, v, a, V, dt, energy, way, middle, travel, joint, z, p, on",
        "):",
        "    rod_x = x",
        "    rod_v = v",
        "    force = 0.0",
        *switched(layout, "voltage", "V = {call}", **q),
        *switched(layout, "motion", "x, v = {call}", **q),
        "    yield_factor = 1.0",
        "    viscous_factor = 1.0",
        "    reach = 1.0",
        "    half_reach = 1.0",
        "    added = 0.0",
        "    direction = way",
        *switched(layout, "yield_factor", "yield_factor *= {call}", **q),
        *switched(layout, "viscous_factor", "viscous_factor *= {call}", **q),
        *switched(layout, "reach", "reach *= {call}", **q),
        *switched(layout, "reach", "half_reach *= {call}", **{**q, "v": "middle"}),
        *switched(layout, "yield_force", "direction = {call}", **q),
        *switched(layout, "force", "added += {call}", **q),
        "    factor = 1.0",
        *switched(layout, "factor", "factor *= {call}", **q),
        "    if law == 1:",
        f"        lugre = LuGreP({lugre})",
        "        bristle = LuGre_advance(z[0], middle, dt, lugre.a_0 / half_reach)",
        "        viscous = LuGre_viscous(v, V, lugre) * viscous_factor",
        "        bent = LuGre_bristle(bristle, v, V, lugre, reach, yield_factor)",
        "        force = (bent + viscous) * factor + added",
        "    else:",
        f"        bingham = BinghamP({bingham})",
        "        viscous = Bingham_viscous(v, V, bingham) * viscous_factor",
        "        limit = Bingham_yielding(V, bingham) * yield_factor * reach",
        "        force = (limit * direction + viscous) * factor + added",
        "    pull = 0.0",
    ]
    for effect in joints:
        place = list(effect.states).index(effect.joint[1])
        only = layout.only(lambda one, wanted=effect: one is wanted)  # type: ignore[misc]
        lines += switched(only, "rate", f"pull = {{call}}[{place}]", **q)
    return "\n".join([*lines, "    return pull"])
