"""A building under ground motion and the forces of devices, on its first level and between any."""

from __future__ import annotations

from ..physics.building import Building
from ..physics.linear import Row, copy
from ..physics.structure import (
    EFFECT_STEP,
    Loads,
    Setup,
    accelerations,
    add_force,
    free_step,
    functions_of,
    holding_force,
    matrices,
    resting_contact,
    resting_forces,
)
from ..physics.structure import step as effects_step
from .damper import stick_force
from .devices import (
    DAMPER_FORCE,
    EXTRA_FORCE,
    GROUND_ACCELERATION,
    PER_DEVICE,
    PER_LEVEL,
    add_devices,
    devices_at_first_level,
    forces_between,
    load_upper_levels,
    show_device_motion,
    show_holding_forces,
)
from .structure_setup import (
    Constants,
    bake,
    constants,
    discretise,
    laid_down,
    room,
    setup,
    sizes,
)

__all__ = [
    "Constants", "StructureModel", "bake", "constants", "discretise", "laid_down", "output",
    "room", "setup", "sizes", "start", "step",
]  # fmt: skip


def start(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Begin at rest, in balance with nothing yet: the state follows no input.

    Parameters
    ----------
    time : s, not used
    inputs : (3 + d,) ground acceleration [m/s2], damper force [N], extra force [N]; the force [N]
        of each of the d devices
    c : Constants
    state : as `setup` leaves it; what `settle` makes of it is filled
    outputs : displacement [m], velocity [m/s], absolute acceleration [m/s2] of each of the n
        levels; the drifts [m], n of them or, isolated, n - 1; the holding force [N]; displacement
        [m], velocity [m/s] and holding force [N] of each of the d devices; filled
    work : (`room(n, slots)`,) room to work

    Returns
    -------
    int
        0.
    """
    settle(c, state, work)
    show_motion(c, state, outputs)
    return output(time, inputs, c, state, outputs, work)


def step(
    clock: tuple[float, float, int], before: Row, now: Row, c: Constants, state: Row,
    new_state: Row, outputs: Row, work: Row,
) -> int:  # fmt: skip
    """Advance over one step: the ground linear, the devices' force held unless `c.linear`.

    A caller that sweeps, `c.linear`, gets the motion, drifts included; on what it keeps it calls
    `settle` before it asks for the other outputs.

    Parameters
    ----------
    clock : tuple
        Time at the begin [s], dt [s], sweep: 0 for the first of a step.
    before, now : (3 + d,) inputs at begin and end, as in `start`
    c : Constants
        With the matrices of a step of dt, as `discretise` returns them.
    state, new_state : states at begin (kept) and end (filled), as `setup` lays them down
    outputs : as in `start`, filled
    work : (`room(n, slots)`,) room to work, kept from one sweep of a step to the next

    Returns
    -------
    int
        0.
    """
    n, size = c.n, 2 * c.n
    a0, a1 = before[GROUND_ACCELERATION], now[GROUND_ACCELERATION]
    if c.active:
        effect_steps(before, now, c, state, new_state, work)
    else:
        # Without the devices' force no sweep differs from the one before.
        if clock[2] == 0 or work[size] != a1:
            free_step(n, c.phi, c.held, c.ramp, state, a0, a1, work)
            work[size] = a1
        for i in range(size):
            new_state[i] = work[i]
        f1 = now[DAMPER_FORCE] + now[EXTRA_FORCE]
        f0 = before[DAMPER_FORCE] + before[EXTRA_FORCE] if c.linear else f1
        add_force(n, c.held, c.ramp, 0, f0, f1, new_state)
        if c.devices > 0:
            add_devices(before, now, c, new_state)
    show_motion(c, new_state, outputs)
    if c.linear:
        return 0
    settle(c, new_state, work)
    return output(clock[0] + clock[1], now, c, new_state, outputs, work)


def effect_steps(
    before: Row, now: Row, c: Constants, state: Row, new_state: Row, work: Row
) -> None:
    """Advance motion and states of effects over the substeps of a step.

    Parameters
    ----------
    before, now : (3 + d,) inputs at begin and end, as in `start`; the ground acceleration goes
        linearly from one to the other
    c : Constants
    state, new_state : states at begin (kept) and end (filled), as `setup` lays them down
    work : (`room(n, slots)`,) room to work
    """
    n, size, states = c.n, 2 * c.n, len(state) - 3 * c.n - 1
    room = work[0 : 6 * n]
    x0 = work[6 * n : 8 * n]
    f0, f1 = work[8 * n : 9 * n], work[9 * n : 10 * n]
    z0 = work[10 * n : 10 * n + states]
    z1 = work[10 * n + states : 10 * n + 2 * states]
    copy(state, 0, new_state, 0, size)
    copy(state, size, z1, 0, states)
    setup = Setup(n, c.isolated, c.stiffnesses, c.phi, c.held, c.ramp, c.h, c.p, c.on, True)
    a0, a1 = before[GROUND_ACCELERATION], now[GROUND_ACCELERATION]
    forces_between(before, now, 0.0, c, f1)
    for k in range(c.substeps):
        s, e = k / c.substeps, (k + 1.0) / c.substeps
        copy(new_state, 0, x0, 0, size)
        copy(z1, 0, z0, 0, states)
        copy(f1, 0, f0, 0, n)
        forces_between(before, now, e, c, f1)
        loads = Loads(a0 + s * (a1 - a0), a0 + e * (a1 - a0), f0, f1, 0.0)
        effects_step(setup, loads, x0, z0, new_state, z1, room)
    copy(z1, 0, new_state, size, states)


def settle(c: Constants, state: Row, work: Row) -> None:
    """Put what follows from the state alone behind it, so that a new force costs little."""
    n, end = c.n, len(state) - c.n - 1
    loads, unloaded = work[3 * n : 4 * n], work[4 * n : 5 * n]  # behind what sweeps share
    if c.active:
        resting_forces(n, c.isolated, c.stiffnesses, state, state[2 * n : end], c.p, c.on, loads)
    else:
        for i in range(n):
            loads[i] = 0.0
    accelerations(n, c.m_inverse, c.damping, c.stiffness, state, loads, unloaded)
    copy(unloaded, 0, state, end, n)
    state[end + n] = holding_force(n, c.damping, c.stiffness, c.mass, state, 0.0, loads[0])


def show_motion(c: Constants, state: Row, outputs: Row) -> None:
    """Give displacements, velocities and drifts of a state, and the motion of devices."""
    n, at = c.n, 0
    for i in range(n):
        outputs[at], outputs[at + 1] = state[i], state[n + i]
        at += PER_LEVEL
    for i in range(1 if c.isolated else 0, n):
        outputs[at] = state[i] - (state[i - 1] if i > 0 else 0.0)
        at += 1
    if c.devices > 0:
        show_device_motion(c, state, outputs, at + 1)


def output(time: float, inputs: Row, c: Constants, state: Row, outputs: Row, work: Row) -> int:
    """Let absolute accelerations and holding forces follow the inputs, the motion held.

    A contact that sticks carries what the devices' force leaves of the holding force, for the
    devices hold first; the level then has the ground's acceleration.

    Parameters
    ----------
    time : s, not used
    inputs : (3 + d,) as in `start`
    c : Constants
    state : as `setup` lays it down, after `settle`; kept
    outputs : as in `start`; displacements, velocities and drifts stay, the others are filled
    work : not used

    Returns
    -------
    int
        0.
    """
    n, end = c.n, len(state) - c.n - 1
    others = inputs[EXTRA_FORCE]
    if c.devices > 0:
        others += devices_at_first_level(inputs, c)
    force = inputs[DAMPER_FORCE] + others
    hold = state[end + n] - c.mass * inputs[GROUND_ACCELERATION]
    left, contact = hold - force, 0.0
    if c.touches:
        stick = stick_force(left, state[n], c.mass, EFFECT_STEP)
        contact = resting_contact(
            n, c.isolated, c.stiffnesses, state, stick, state[2 * n : end], c.p, c.on
        )
        force += contact
    m_inverse, at = c.m_inverse, 2
    for i in range(n):
        outputs[at] = state[end + i] - m_inverse[i * n] * force
        at += PER_LEVEL
    at = PER_LEVEL * n + (n - 1 if c.isolated else n)
    outputs[at] = hold - others
    if c.devices > 0:
        load_upper_levels(inputs, c, outputs)
        first, free = inputs[DAMPER_FORCE] + inputs[EXTRA_FORCE] + contact, state[end : end + n]
        show_holding_forces(inputs, left, first, c, free, outputs, at + PER_DEVICE)
    return 0


class StructureModel:
    """A building and its state, ready to step in plain Python outside an FMU.

    `x` (2n,) [m, m/s] and `z`, the states of effects, may be set; `settle` then.
    """

    def __init__(
        self,
        building: Building,
        values: dict[str, float] | None = None,
        effects: list[str] | None = None,
    ) -> None:
        self.m = matrices(building)
        link = functions_of(effects or []).link
        self._settle, self._step, self._output = map(link, (settle, step, output))
        self._store, state, self._work = laid_down(building, values or {}, effects or [])
        self.constants = constants(self._store)
        size = 2 * self.m.n
        self.x, self.z = state[0:size], state[size : len(state) - self.m.n - 1]
        self.p, self.on = self.constants.p, self.constants.on
        self._idle = [0.0] * len(building.devices)
        shown = PER_LEVEL * self.m.n + self.m.n + 1 + PER_DEVICE * len(building.devices)
        self._outputs = [0.0] * shown
        self._h = 0.0
        self.settle()

    def settle(self) -> None:
        """Compute what follows from the state, which was set from outside."""
        self._state = [*self.x, *self.z, *[0.0] * (self.m.n + 1)]
        self._settle(self.constants, self._state, self._work)

    def step(self, dt: float, a0: float, a1: float, force: float) -> None:
        """Advance over one step, the ground acceleration linear and the devices' force held.

        Parameters
        ----------
        dt : length of the step [s]
        a0, a1 : ground acceleration at begin and end [m/s2]
        force : of the devices on the first level [N], positive against +x
        """
        if dt != self._h:
            discretise(dt, self._store, self._work)
            self.constants, self._h = constants(self._store), dt
        new = list(self._state)
        inputs = [a0, 0.0, 0.0, *self._idle], [a1, force, 0.0, *self._idle]
        clock = (0.0, dt, 0)
        self._step(clock, *inputs, self.constants, self._state, new, self._outputs, self._work)
        self._state, size = new, 2 * self.m.n
        self.x, self.z = new[0:size], new[size : size + len(self.z)]

    def absolute_accelerations(self, force: float, a_g: float = 0.0) -> list[float]:
        """Return q'' + a_g (n,) [m/s2] under the devices' force [N] on the first level."""
        self._show(a_g, force, 0.0)
        return self._outputs[2 : PER_LEVEL * self.m.n : PER_LEVEL]

    def holding_force(self, a_g: float, others: float) -> float:
        """Return the damper force [N] at which the first level stays at its velocity."""
        self._show(a_g, 0.0, others)
        return self._outputs[PER_LEVEL * self.m.n + self.m.n - self.m.isolated]

    def _show(self, a_g: float, force: float, extra: float) -> None:
        inputs = [a_g, force, extra, *self._idle]
        self._output(0.0, inputs, self.constants, self._state, self._outputs, self._work)
