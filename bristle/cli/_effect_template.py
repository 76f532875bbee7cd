"""The file that `bristle new effect NAME` writes."""

TEMPLATE = '''"""{title}: an effect of my own."""

from math import tanh

from bristle.physics.effect import Effect, Parameter


class {cls}(Effect):
    """{title}: the rod's seals rub against the motion, whatever the voltage.

        F = f_s tanh(v / v_s)

    Leaves out the pressure on the seals: doubt it when the error grows with the damper's force.
    """

    # The name in commands, scenarios and model.toml, and the name of this file.
    name = "{name}"

    # "damper": between rod and fluid. "structure": base and storeys. "sensor": an instrument. An
    # effect with two sites, ("damper", "structure"), reads only x, v, dt, energy, halt, stiffness.
    sites = ("damper",)

    # The signals that the hooks below read from q. A damper offers x [m], v [m/s], a [m/s2] across
    # the fluid, V [V], dt [s], energy [J] dissipated so far; a structure x, v of the base, and
    # drift, drift_rate, stiffness, storey in `spring`.
    needs = ("v",)

    # `bristle check` tests these two: a closed cycle never produces energy; there is no
    # force at rest without history.
    passive = True
    zero_at_rest = True

    # The source of the formula, and what a residual looks like while the effect is missing.
    source = "Andersson, Soderberg & Bjorklund (2007), Tribology International 40(4), 580-587"
    expect = "a force with the sign of the velocity, the same at every voltage"

    # Value, SI unit, physical bounds, meaning. A fit begins at the value and stays within the
    # bounds.
    parameters = {{
        "f_s": Parameter(0.2, "N", (0.0, 1e5), "friction of the seals"),
        "v_s": Parameter(2e-3, "m/s", (1e-5, 1.0), "speed over which it builds up"),
    }}

    # How much of the effect there is: at zero it is gone. Verdicts tell how large it may still be.
    amount = "f_s"

    # Initial guesses of a fit, as factors on the values: start_grid = {{"v_s": (0.3, 1.0, 3.0)}}.
    # The docstring of bristle.physics.effect.Effect describes further data for search and verdict
    # (lookalikes, family, mimics, ...).

    # An effect with memory has states: states = {{"heat": "J"}}, read as z.heat. Write one of
    #     rate(q, z, p)     the derivatives, as a tuple: (q.force * q.v - z.heat / p.tau,)
    #     advance(q, z, p)  the values after q.dt, as a tuple, if you know them exactly.

    # Hooks are pure functions of q (signals), z (states) and p (parameters). Use math, arithmetic
    # and if. Hooks other than `force`: voltage, motion, yield_factor, viscous_factor, reach,
    # yield_force, spring, factor, channel. `force` is positive if it resists motion along +x. Write
    # a step such as the sign of v as a smooth function, because a fit must be able to follow it.

    @staticmethod
    def force(q, z, p):
        return p.f_s * tanh(q.v / p.v_s)
'''


def template(name: str) -> str:
    """Return the text of a working file with an effect of this name."""
    parts = name.split("_")
    title = " ".join(parts).strip().capitalize()
    cls = "".join(word[:1].upper() + word[1:] for word in parts)
    return TEMPLATE.format(name=name, title=title, cls=cls)
