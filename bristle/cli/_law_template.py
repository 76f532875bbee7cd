"""The file that `bristle new law NAME` writes."""

TEMPLATE = '''"""{title}: a law of my own."""

from math import tanh

from bristle.physics.law import Law, Linear, Parameter, Shape


class {cls}(Law):
    """{title}: a yield force that builds up with speed, a viscous part and a spring.

        f = (f_c + f_v V) tanh(v / v_s) + c v + k x

    Leaves out hysteresis: doubt it when the force depends on where the motion came from.
    """

    # The name in commands and model.toml, and the name of this file.
    name = "{name}"

    # The parts on which effects act: "yield", a force to be overcome; "sign", if this force jumps
    # with direction; "bristle", if bristles bend under it before they slip; "viscous"; "spring".
    parts = ("yield", "viscous", "spring")

    # Kinds of effects that the law already contains. They are not offered with it.
    contains = ("spring",)

    # The source of the formula.
    source = "Gavin (2001), Earthq. Eng. Struct. Dyn. 30(9), 1281-1300, hyperbolic functions"

    # Value, SI unit, physical bounds, meaning. The values are those of a damper of 10 N; a fit
    # scales its initial guesses to the rig.
    parameters = {{
        "f_c": Parameter(1.3, "N", (0.0, 1e5), "yield force without voltage"),
        "f_v": Parameter(0.83, "N/V", (0.0, 1e5), "yield force per volt"),
        "c": Parameter(15.0, "N.s/m", (0.0, 1e7), "viscous coefficient"),
        "k": Parameter(60.0, "N/m", (0.0, 1e7), "stiffness"),
        "v_s": Parameter(0.02, "m/s", (1e-4, 1e2), "speed over which the yield force builds up"),
    }}

    # How quantities depend on the voltage: Constant("a"), Linear("a", "b"), Quadratic("a", "b",
    # "c"), or Monotone("curve"), a table over the voltage that never falls. A hook reads the
    # quantity as p.yield_force. It does not see the parameters behind it.
    command = {{"yield_force": Linear("f_c", "f_v")}}

    # Parameters in which the force is not linear: the initial guesses of a fit, as factors on the
    # rig's typical size (low, high, number), and the parameters whose force they shape.
    shapes = {{"v_s": Shape(0.02, 5.0, 9, ("f_c", "f_v"))}}

    # A law with memory has states: states = {{"deflection": "m"}}, read as z.deflection. Write
    #     rate(q, z, p)     the derivatives, as a tuple: (q.v - p.rho * abs(q.v) * z.deflection,)
    # and, if you know them exactly,
    #     advance(q, z, p)  the values after q.dt at the velocity q.v, as a tuple.

    # Hooks are pure functions of q (x [m], v [m/s], a [m/s2], V [V], dt [s]), z (states) and p. Use
    # math, arithmetic and if. Forces [N] are positive if they resist motion along +x. The hooks are
    # `limit` (the part "sign": a force that jumps with direction), `yielding`, `damping` (of
    # bristles), `viscous` and `elastic`. Their sum is the force of the damper.

    @staticmethod
    def yielding(q, z, p):
        return p.yield_force * tanh(q.v / p.v_s)

    @staticmethod
    def viscous(q, z, p):
        return p.c * q.v

    @staticmethod
    def elastic(q, z, p):
        return p.k * q.x
'''


def template(name: str) -> str:
    """Return the text of a working file with a law of this name."""
    parts = name.split("_")
    title = " ".join(parts).strip().capitalize()
    cls = "".join(word[:1].upper() + word[1:] for word in parts)
    return TEMPLATE.format(name=name, title=title, cls=cls)
