"""The files that `bristle new effect NAME`, `new law` and `new controller` write."""

from __future__ import annotations

LAW = '''"""{title}: a law of my own."""

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


CONTROLLER = '''"""FMU: {title}, a controller of my own."""

from math import exp, pi

from bristle.fmu.own_controller import OwnController


class {cls}(OwnController):
    """{title}: brakes the base the more, the faster it moves."""

    # Values that are kept from one sample to the next, 0 at first; () for none.
    memory = ("speed",)

    def declare_law(self):
        super().declare_law()  # the sample period
        # Name, value, SI unit, meaning, bounds. In `command` it is self.NAME; in a scenario
        # parameters = {{ NAME = VALUE }}. A parameter without a unit is "1".
        text = "volts per speed of the base"
        self.add_parameter("gain", 60.0, "V.s/m", text, (0.0, 1e6))
        text = "the speed is low-passed at this frequency"
        self.add_parameter("corner", 10.0, "Hz", text, (1e-3, 1e4))

    # Called at every sample. `measured` has floor_acceleration [m/s2], base_displacement [m],
    # base_velocity [m/s] and damper_force [N]; `memory` has the values of the previous sample.
    # Returns the wanted voltage [V], which is limited to 0 .. v_max, and the new memory.
    # Use only Python 3.9 and its standard library, because the FMU contains this file.
    def command(self, measured, memory):
        share = 1.0 - exp(-2.0 * pi * self.corner * self.sample_period)
        speed = memory.speed + share * (abs(measured.base_velocity) - memory.speed)
        return self.gain * speed, (speed,)
'''


EFFECT = '''"""{title}: an effect of my own."""

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


def class_name(name: str) -> str:
    """Return the class, and so the FMU, of a controller's name: MyController of my_controller."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


def file_text(kind: str, name: str) -> str:
    """Return the text of a working file with an "effect", a "law" or a "controller" of a name."""
    title = name.replace("_", " ").strip().capitalize()
    text = {"effect": EFFECT, "law": LAW, "controller": CONTROLLER}[kind]
    return text.format(name=name, title=title, cls=class_name(name))
