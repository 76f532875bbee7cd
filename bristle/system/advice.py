"""What is allowed but seldom meant: order, coupling steps beyond stability, saturated dampers.

Components are known by their ports, not by their names, so that a structure or a damper of
somebody else's making gets the same advice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt

from ..core.config import Document
from ..core.graph import loop_in, reached
from ..errors import BristleError, PhysicsError
from ..physics.drive import DRIVES, Drive
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS, laws_of
from .library import check_design, driven_mass
from .model import Connection, Part, RunSettings
from .parameters import check_rod

# The step from which the coupling of a mass with a damper is unstable, for each algorithm.

_FINENESS = 1.02
"""Ratio [1] of neighbouring steps in the search for the first unstable one."""


def longest_step(algorithm: str, mass: float, c: float, k: float) -> float:
    """Return the step [s] from which the coupling of a mass with a damper is unstable.

    For m v' = -f, f = k z + c v, z' = v, with g = c h/m and q = k h^2/m. Jacobi, where f uses the
    velocity of one step before, has the characteristic equation (s - 1)^2 s + q s + g (s - 1) = 0,
    Gauss-Seidel (s - 1)(s - 1 + g) + q s = 0. Jury's criterion (Jury 1964, Theory and Application
    of the z-Transform Method) gives q < g (1 - g) and 2 g + q < 4. The exact step of the structure
    leaves its own stiffness out of this.

    With midpoint s (s - 1)^2 + (3 s - 1)/2 (a s + b) = 0, a = q/2 + g, b = q/2 - g, whichever of
    the two steps first: one of them is told ahead. Jury's criterion gives g < 1 and
    q^2 < 4 g + 2 g^2 + g q. One rollback makes it
    s (s - 1)(s - 1 + q/2) + (a s + b)((1 - 3 a/4) s + a/4) = 0.

    Parameters
    ----------
    algorithm : str
        One of `model.ALGORITHMS`.
    mass, c, k : float
        kg; N.s/m, above 0; N/m.
    """
    if algorithm == "jacobi":
        return mass * c / (c * c + k * mass)
    if algorithm == "gauss-seidel":
        return 4.0 * mass / (c + sqrt(c * c + 4.0 * k * mass))
    k = max(k, 1e-9 * c * c / mass)  # without bristles a root of 1 stands for where the mass is
    low = high = 1e-3 * mass / (c + sqrt(k * mass))
    while _settles(_cubic(algorithm, c * high / mass, k * high * high / mass)):
        low, high = high, high * _FINENESS
    for _ in range(50):
        middle = 0.5 * (low + high)
        stable = _settles(_cubic(algorithm, c * middle / mass, k * middle * middle / mass))
        low, high = (middle, high) if stable else (low, middle)
    return low


def _cubic(algorithm: str, g: float, q: float) -> tuple[float, float, float]:
    """Return the coefficients of s^2, s and 1 beside s^3 in the characteristic equation."""
    a, b = 0.5 * q + g, 0.5 * q - g
    if algorithm == "midpoint":
        return 1.5 * a - 2.0, 1.0 + 1.5 * b - 0.5 * a, -0.5 * b
    slope, rest = 1.0 - 0.75 * a, 0.25 * a
    return 0.5 * q - 2.0 + a * slope, 1.0 - 0.5 * q + a * rest + b * slope, b * rest


def _settles(cubic: tuple[float, float, float]) -> bool:
    """Return whether all roots lie within the unit circle, by Jury's criterion."""
    a2, a1, a0 = cubic
    return (
        1.0 + a2 + a1 + a0 > 0.0
        and 1.0 - a2 + a1 - a0 > 0.0
        and abs(a0) < 1.0
        and 1.0 - a0 * a0 > abs(a1 - a0 * a2)
    )


_DAMPER_PORTS = frozenset(("displacement", "velocity", "force"))  # and that of its command
_STRUCTURE_PORTS = frozenset(("ground_acceleration", "damper_force"))
_FORCES = ("damper_force", "extra_force")
_RELATIVE = 1e-3
"""How far [1] moving_mass may lie from the mass that it stands for."""


class Network:
    """The components and connections of a scenario, for questions about who feeds whom."""

    def __init__(self, parts: Mapping[str, Part], wires: Sequence[Connection]) -> None:
        self.parts = parts
        self.order = list(parts)
        self.wires = [wire for wire in wires if wire.target in parts and wire.source in parts]
        self.feeding = {(wire.target, wire.input): wire for wire in self.wires}

    def with_ports(self, ports: frozenset[str]) -> list[Part]:
        """Return the components that have all of these ports, in the order of the file."""
        return [part for part in self.parts.values() if ports <= part.variables.keys()]

    def source(self, part: Part, name: str) -> tuple[Part, str] | None:
        """Return the component and output that feed an input."""
        wire = self.feeding.get((part.name, name))
        return (self.parts[wire.source], wire.output) if wire else None

    def driven_by(self, damper: Part) -> tuple[Part, str] | None:
        """Return the structure that takes the damper's force and gives it its velocity.

        And which of the structure's inputs takes the force.
        """
        motion = self.source(damper, "velocity")
        for wire in self.wires:
            if (wire.source, wire.output) != (damper.name, "force"):
                continue
            structure = self.parts[wire.target]
            takes = wire.input in _FORCES or own_velocity(wire.input) in structure.variables
            if takes and motion and motion[0] is structure:
                return structure, wire.input
        return None

    def measured_by(self, controller: Part) -> Part | None:
        """Return the structure whose floor acceleration a controller gets, through sensors too."""
        part: Part | None = controller
        for _ in self.order:
            found = self.source(part, "floor_acceleration") if part else None
            part = found[0] if found else None
            if part and part.variables.keys() >= _STRUCTURE_PORTS:
                return part
        return None


def own_velocity(force: str) -> str:
    """Return the velocity that goes with the force of a structure's device, by their names."""
    return force.removesuffix("force") + "velocity"


def advise(
    run: RunSettings,
    parts: Mapping[str, Part],
    wires: Sequence[Connection],
    document: Document,
) -> None:
    """Add warnings, notes, and the errors of ports that must be used together.

    Parameters
    ----------
    run : RunSettings
        As far as it could be read.
    parts : mapping
        Name to component, in the order of the file.
    wires : sequence of Connection
        The connections that could be read.
    document : Document
        Takes what is found.
    """
    network = Network(parts, wires)
    _instances(network, document)
    _order(run, network, document)
    _rollback(run, network, document)
    _loops(network, document)
    _designs(network, document)
    for part in parts.values():
        check_rod(part, run, document)
    for damper, drive in dampers_of(network):
        _holding(damper, network, document)
        _limits(damper, drive, network, document)
    for structure in network.with_ports(_STRUCTURE_PORTS):
        _coupling(run, structure, network, document)


def _instances(network: Network, document: Document) -> None:
    """An FMU that lives once per process cannot be two components."""
    first: dict[object, str] = {}
    for part in network.parts.values():
        once = part.description and part.description.capabilities.get(
            "canBeInstantiatedOnlyOncePerProcess"
        )
        if part.file and once in ("true", "1"):
            if part.file in first:
                document.error(
                    part.path,
                    f"[components.{part.name}]: {part.file.name} allows one instance per process, "
                    f"and it is already [components.{first[part.file]}].",
                )
            first.setdefault(part.file, part.name)


def _order(run: RunSettings, network: Network, document: Document) -> None:
    """Unless all step at once the ground motion must have moved on before the structure steps."""
    if run.algorithm == "jacobi":
        return
    for structure in network.with_ports(_STRUCTURE_PORTS):
        ground = network.source(structure, "ground_acceleration")
        if ground and network.order.index(ground[0].name) > network.order.index(structure.name):
            document.warning(
                ground[0].path,
                f"[components.{ground[0].name}] comes after [components.{structure.name}], which "
                "then gets the ground acceleration one step late; put it first, because components "
                "step in the order of the file.",
            )


def _rollback(run: RunSettings, network: Network, document: Document) -> None:
    """What is to step again must go back first: each FMU of a loop needs its state in and out."""
    if run.algorithm != "midpoint-iterated":
        return
    feeds = {name: {w.target for w in network.wires if w.source == name} for name in network.order}
    for part in network.parts.values():
        if part.file is None or part.description is None:
            continue  # the built-in components can
        able = part.description.capabilities.get("canGetAndSetFMUstate")
        if part.name in reached(feeds, part.name) and able not in ("true", "1"):
            document.error(
                ("run", "algorithm"),
                f"[run] algorithm: midpoint-iterated lets the components of a loop step twice, and "
                f"[components.{part.name}] cannot go back: {part.file.name} declares no "
                'canGetAndSetFMUstate. "midpoint" is right.',
            )


def _loops(network: Network, document: Document) -> None:
    """Note cycles of outputs that follow their inputs at once: the master does not iterate."""
    follows: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for part in network.parts.values():
        for output in part.variables.values():
            if output.causality == "output":
                wires = [
                    network.feeding[part.name, name]
                    for name in output.dependencies or ()
                    if (part.name, name) in network.feeding
                ]
                follows[part.name, output.name] = [(wire.source, wire.output) for wire in wires]
    if cycle := loop_in(follows):
        words = " <- ".join(f"{part}.{port}" for part, port in cycle)
        document.note(
            network.parts[cycle[0][0]].path,
            f"algebraic loop {words}: each follows the next without delay. Nothing iterates; the "
            "loop is closed with values one step old.",
        )


def _designs(network: Network, document: Document) -> None:
    """A designed controller belongs to one building: that whose floor it measures."""
    for part in network.parts.values():
        structure = network.measured_by(part)
        if structure is None or structure.kind != "Structure":
            continue
        try:
            check_design(part, structure.building)
        except PhysicsError:
            continue  # the building is no building: its own check has said so
        except BristleError as error:
            path = (*part.path, "controller") if part.controller else part.path
            document.error(path, f"[components.{part.name}]: {error}")


def _holding(damper: Part, network: Network, document: Document) -> None:
    """holding_force and moving_mass work together or not at all."""
    if not {"holding_force", "moving_mass"} <= damper.variables.keys():
        return
    wire = network.feeding.get((damper.name, "holding_force"))
    fed = wire is not None or "holding_force" in damper.places
    mass = damper.real("moving_mass") or 0.0
    where = f"[components.{damper.name}]"
    if fed and mass == 0.0:
        document.error(
            wire.path if wire else damper.places["holding_force"],
            f'{where}: holding_force is connected while moving_mass is 0; set "moving_mass" to the '
            "mass that the damper holds, in kg, or leave holding_force unconnected.",
        )
    elif not fed and mass != 0.0:
        document.error(
            damper.places.get("moving_mass", damper.path),
            f"{where}: moving_mass = {mass:g} kg without holding_force; connect "
            f'"{damper.name}.holding_force" to the structure\'s holding_force, or leave '
            "moving_mass at 0.",
        )


def dampers_of(network: Network) -> list[tuple[Part, Drive]]:
    """Return the dampers among the components, each with what commands it."""
    return [
        (damper, drive)
        for drive in DRIVES.values()
        for damper in network.with_ports(_DAMPER_PORTS | {drive.name})
    ]


def asked_range(damper: Part, drive: Drive, network: Network) -> tuple[float, float] | None:
    """Return the lowest and highest command that a damper is asked for, None if unknown."""
    if drive.name in damper.values:
        level = damper.real(drive.name)
        return None if level is None else (level, level)
    source = network.source(damper, drive.name)
    if source is None or (source[0].value("kind") or "constant") != "constant":
        return None
    level = source[0].real("level")
    if level is None:
        return None
    level = network.feeding[damper.name, drive.name].given(level)
    return level, level


def _limits(damper: Part, drive: Drive, network: Network, document: Document) -> None:
    asked, most = asked_range(damper, drive, network), damper.real(drive.limit)
    if asked is None or most is None or 0.0 <= asked[0] <= asked[1] <= most:
        return
    source = network.source(damper, drive.name)
    path = damper.places.get(drive.name, damper.path)
    if source:
        path = source[0].places.get("level", source[0].path)
    document.warning(
        path,
        f"{damper.name}.{drive.name} = {asked[0]:g} {drive.unit} lies outside 0 to {most:g} "
        f"{drive.unit} ({drive.limit}): the damper saturates and feels "
        f"{min(max(asked[0], 0.0), most):g} {drive.unit}.",
    )


def slopes(damper: Part, level: float) -> tuple[float, float]:
    """Return the slopes of a damper's force as v -> 0: over velocity [N.s/m], over travel [N/m].

    Of the law whose parameters the damper has, its jump aside; (0, 0) where that is none we know.
    """
    for law in (LAWS[damper.law.name],) if damper.law else laws_of("damper"):
        values = {name: damper.real(name) for name in law.parameters}
        given = {name: value for name, value in values.items() if value is not None}
        if given and all(name in given for name in law.linear()):
            return law.slopes_at_rest(given, level)
    return 0.0, 0.0


def _coupling(run: RunSettings, structure: Part, network: Network, document: Document) -> None:
    """Warn where a damper's mass terms or the step make the explicit coupling unstable.

    Of dampers on one level together, of those elsewhere in the building each by itself.
    """
    driven: dict[str, list[tuple[Part, Drive]]] = {}
    for damper, drive in dampers_of(network):
        pushed = network.driven_by(damper)
        if pushed and pushed[0] is structure:
            port = pushed[1]
            _other_motion(damper, structure, port, network, document)
            driven.setdefault(_FORCES[0] if port in _FORCES else port, []).append((damper, drive))
    if structure.kind != "Structure":
        return  # the mass behind the ports of another structure is not known
    for port, dampers in driven.items():
        attached = structure.real("attached_mass") or 0.0
        try:
            mass = driven_mass(structure.building, port, attached)
        except BristleError:
            return  # the component's own check has said what is wrong with the building
        _stability(run, structure, dampers, mass, network, document)


def _other_motion(
    damper: Part, structure: Part, port: str, network: Network, document: Document
) -> None:
    """Warn where a damper feels another motion than that of the device whose force it gives."""
    wire = network.feeding[damper.name, "velocity"]
    right = own_velocity(port)
    if port not in _FORCES and wire.output != right:
        document.warning(
            wire.path,
            f"{damper.name} feels {structure.name}.{wire.output} and pushes "
            f"{structure.name}.{port}; the motion there is {structure.name}.{right}.",
        )


def _stability(
    run: RunSettings, structure: Part, dampers: list[tuple[Part, Drive]], mass: float,
    network: Network, document: Document,
) -> None:  # fmt: skip
    """Warn where dampers that drive one mass [kg] make the coupling unstable at the run's step."""
    c, k = 0.0, 0.0
    for damper, drive in dampers:
        over_velocity, over_travel = _scaled(damper, structure, network)
        _mass_terms(damper, mass / over_velocity if over_velocity > 0.0 else mass, document)
        most = damper.real(drive.limit) or 0.0
        asked = asked_range(damper, drive, network)
        each = slopes(damper, min(max(asked[1], 0.0), most) if asked else most)
        c, k = c + over_velocity * each[0], k + over_travel * each[1]
    if run.step is None or c <= 0.0:
        return
    rough = any(_jumps(damper, network) for damper, _ in dampers)
    algorithm = "gauss-seidel" if rough and run.algorithm != "jacobi" else run.algorithm
    limit = longest_step(algorithm, mass, c, k)
    if run.step >= limit:
        document.warning(
            ("run", "step"),
            f"[run] step = {1e3 * run.step:g} ms lies above about {1e3 * limit:.3g} ms, where the "
            f"{run.algorithm} coupling of {', '.join(damper.name for damper, _ in dampers)} with "
            f"{structure.name} becomes unstable ({mass:.4g} kg, {c:.4g} N.s/m, {k:.4g} N/m); a "
            f"shorter step{' or gauss-seidel' if run.algorithm == 'jacobi' else ''} is right.",
        )


def _scaled(damper: Part, structure: Part, network: Network) -> tuple[float, float]:
    """Return by what connections multiply the slopes of a damper's force on a structure.

    Over velocity and over travel [1]: two dampers alike may stand in a scenario as one, with a
    factor of 2 on its force.
    """
    ends = (damper.name, "force", structure.name)
    force = next(w.factor for w in network.wires if (w.source, w.output, w.target) == ends)
    felt = (network.feeding.get((damper.name, name)) for name in ("velocity", "displacement"))
    velocity, travel = (wire.factor if wire else 1.0 for wire in felt)
    return force * velocity, force * travel


def _jumps(damper: Part, network: Network) -> bool:
    """Return whether a damper's force may jump: midpoint then leaves it at the newest values."""
    force = damper.variables["force"]
    return force.jumps_without is not None and (
        (damper.name, force.jumps_without) not in network.feeding
    )


def _mass_terms(damper: Part, mass: float, document: Document) -> None:
    """Compare the masses that a damper was given with the mass it moves."""
    held = damper.real("moving_mass") or 0.0
    if held and abs(held - mass) > _RELATIVE * mass:
        document.warning(
            damper.places.get("moving_mass", damper.path),
            f"{damper.name}.moving_mass = {held:.6g} kg; the mass that it moves is {mass:.6g} kg "
            "(attached_mass included).",
        )
    carried = [n for n, e in EFFECTS.items() if e.mass and damper.value(f"{n}.on") is True]
    for name, variable in damper.variables.items():
        value = damper.real(name)
        if name.partition(".")[0] not in carried or variable.unit != "kg" or value is None:
            continue
        if value >= 0.5 * mass:
            document.warning(
                damper.places.get(name, damper.path),
                f"{damper.name}.{name} = {value:.4g} kg is half or more of the moving mass of "
                f"{mass:.4g} kg: from velocity differences the run diverges near the whole of it; "
                "put it into attached_mass of the structure.",
            )
