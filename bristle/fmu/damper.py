"""The base of the dampers: ports, voltage limits, energy and the effects of the site."""

from __future__ import annotations

from math import inf, isfinite
from typing import Any, ClassVar

from ..physics.damper import DamperModel
from ..physics.laws import LAWS
from .slave import EffectSlave


class DamperSlave(EffectSlave):
    """A damper of one law, from motion and voltage to the force that resists it."""

    law: ClassVar[str] = ""

    def declare(self) -> None:
        self.add_input("displacement", "m", "displacement of the rod")
        self.add_input("velocity", "m/s", "velocity of the rod")
        self.add_input("voltage", "V", "voltage of the coil")
        text = "force that keeps the structure from accelerating; needs moving_mass"
        self.add_input("holding_force", "N", text, optional=True)
        text = "acceleration of the rod; else from differences of velocity"
        self.add_input("acceleration", "m/s2", text, optional=True)
        follows = ["displacement", "velocity", "voltage", "holding_force", "acceleration"]
        text = "force on the structure, positive against +x"
        self.add_output("force", "N", text, depends=follows, nominal=10.0)
        text = "integral of force times velocity, stored energy included"
        self.add_output("dissipated_energy", "J", text)
        text = "displacement over stroke: beyond 1 the piston would hit its end"
        self.add_output("stroke_ratio", "1", text, depends=["displacement"])
        for name, parameter in LAWS[self.law].parameters.items():
            self.add_physical(name, parameter)
        self.add_parameter("stroke", 0.02, "m", "from the middle to either end", (1e-6, 1e3))
        self.add_parameter("v_max", 8.0, "V", "largest voltage; the damper saturates", (0.0, 1e4))
        text = "mass that the damper moves; 0: no holding force, sliding law"
        self.add_parameter("moving_mass", 0.0, "kg", text, (0.0, 1e9))
        for name, unit in LAWS[self.law].states.items():
            text = f"start value of the {name.replace('_', ' ')}"
            self.add_parameter(f"{name}_0", 0.0, unit, text)
        self.add_effects("damper", self.law)

    def configure(self) -> None:
        self.model = DamperModel(self.law, self.numbers(), self.effects_on())
        self.step_before = inf  # no step yet
        self.difference = 0.0  # of velocity over the last step
        self.before = [0.0, 0.0]  # velocity and force at the end of the last step
        self.energy = 0.0
        self.started = False

    def _motion(self, step: float) -> tuple[float, float, float, float, float, bool]:
        """Return x, v, a, V within its limits, and the halting force and whether it is known."""
        x, v, V = self["displacement"], self["velocity"], self["voltage"]
        if not 0.0 <= V <= self["v_max"]:
            V = min(max(V, 0.0), self["v_max"])
            self.warn_once(
                "the voltage left 0 .. {:g} V; the damper saturates.".format(self["v_max"])
            )
        a = self["acceleration"] if self.was_set("acceleration") else self.difference
        mass = self["moving_mass"]
        halts = mass > 0.0 and (isfinite(step) or v == 0.0)
        halt = self["holding_force"] + mass * v / step if halts else 0.0
        return x, v, a, V, halt, halts

    def advance(self, time: float, step: float) -> None:
        self.difference = (self["velocity"] - self.before[0]) / step
        x, v, a, V, halt, halts = self._motion(step)
        force = self.model.step(x, v, a, V, step, self.energy, halt, halts)
        self.energy += 0.5 * step * (self.before[0] * self.before[1] + v * force)
        self.before = [v, force]
        self.step_before = step
        self.started = True

    def refresh(self) -> None:
        x, v, a, V, halt, halts = self._motion(self.step_before)
        values, at = self._values, self._index["force"]
        force = self.model.force(x, v, a, V, self.step_before, self.energy, halt, halts)
        if not self.started:
            self.before = [v, force]
        values[at] = force
        values[at + 1] = self.energy
        values[at + 2] = abs(x) / self["stroke"]

    def get_inner(self) -> Any:
        scalars = [self.step_before, self.difference, self.energy, self.started]
        return [list(self.model.z), list(self.before), *scalars]

    def set_inner(self, state: Any) -> None:
        self.model.z, self.before = list(state[0]), list(state[1])
        self.step_before, self.difference, self.energy, self.started = state[2:]
