"""Components as a check sees them, small and fixed, so that a test of wording stands on its own."""

from __future__ import annotations

import os
from pathlib import Path

from bristle.errors import FmuError, PhysicsError, RecordError
from bristle.fmu.description import Description, Variable
from bristle.system.library import Library, damper_of, law_of

BASE_MASS = 1.9693563369446  # kg

VALID = """\
schema = 1
title = "El Centro, LuGre damper at 4 V"

[run]
stop = 35.0
step = 0.002
algorithm = "gauss-seidel"

[components.ground]
fmu = "GroundMotion"
parameters = { record = "el_centro_1940_ns", peak = 5.886, factor = 0.45 }

[components.structure]
fmu = "Structure"

[components.voltage]
fmu = "ConstantVoltage"
parameters = { level = 4.0 }

[components.damper]
fmu = "LuGreDamper"
parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }

[connections]
"structure.ground_acceleration" = "ground.ground_acceleration"
"structure.damper_force" = "damper.force"
"damper.displacement" = "structure.base_displacement"
"damper.velocity" = "structure.base_velocity"
"damper.voltage" = "voltage.voltage"
"""


def real(name, causality, unit=None, **more):
    variability = "fixed" if causality == "parameter" else "continuous"
    return Variable(name, "Real", causality, variability, 0, unit, **more)


def other(name, kind, causality="parameter", **more):
    return Variable(name, kind, causality, "fixed", 0, **more)


def described(name, *variables, **capabilities):
    fault = Variable("fault", "Integer", "output", "discrete", 99)
    return Description(
        name, "guid", name, f"{name}.", {v.name: v for v in (*variables, fault)}, capabilities
    )


def damper(name, *law):
    return described(
        name,
        real("displacement", "input", "m", start=0.0),
        real("velocity", "input", "m/s", start=0.0),
        real("voltage", "input", "V", start=0.0),
        real("holding_force", "input", "N", start=0.0, optional=True),
        real("acceleration", "input", "m/s2", start=0.0, optional=True),
        real("force", "output", "N", dependencies=("velocity", "voltage", "holding_force")),
        real("dissipated_energy", "output", "J"),
        real("stroke_ratio", "output", "1"),
        real("stroke", "parameter", "m", start=0.02, minimum=1e-6, maximum=1e2),
        real("v_max", "parameter", "V", start=8.0, minimum=0.0),
        real("moving_mass", "parameter", "kg", start=0.0, minimum=0.0, maximum=1e6),
        *law,
        other("gas_spring.on", "Boolean", start=False),
        real("gas_spring.k", "parameter", "N/m", start=50.0, minimum=0.0, maximum=1e5),
        other("fluid_inertia.on", "Boolean", start=False),
        real("fluid_inertia.mass", "parameter", "kg", start=0.1, minimum=0.0),
    )


def law(**values):
    units = {"f_c": "N", "f_v": "N/V", "c_v": "N.s/(m.V)", "sigma_b": "N.s/(m.V)"} | {
        "sigma_a": "N/m",
        "sigma_0": "N/(m.V)",
    }
    return [
        real(name, "parameter", units.get(name, "N.s/m"), start=value, minimum=0.0, maximum=1e7)
        for name, value in values.items()
    ]


COMPONENTS = {
    "GroundMotion": described(
        "GroundMotion",
        other("record", "String", start="el_centro_1940_ns"),
        real("peak", "parameter", "m/s2", start=0.0, minimum=0.0),
        real("factor", "parameter", "1", start=1.0),
        real("start", "parameter", "s", start=0.0),
        real("ground_acceleration", "output", "m/s2", dependencies=()),
    ),
    "Structure": described(
        "Structure",
        real("ground_acceleration", "input", "m/s2", start=0.0),
        real("damper_force", "input", "N", start=0.0),
        real("extra_force", "input", "N", start=0.0, optional=True),
        real("base_displacement", "output", "m", dependencies=()),
        real("base_velocity", "output", "m/s", dependencies=()),
        real("base_acceleration_absolute", "output", "m/s2", dependencies=("damper_force",)),
        real("holding_force", "output", "N", dependencies=("ground_acceleration",)),
        real("attached_mass", "parameter", "kg", start=0.0, minimum=0.0),
    ),
    "ConstantVoltage": described(
        "ConstantVoltage",
        real("level", "parameter", "V", start=4.0),
        real("voltage", "output", "V"),
    ),
    "LuGreDamper": damper(
        "LuGreDamper", *law(sigma_a=650.0, sigma_0=415.0, sigma_1=5.0, sigma_2=100.0, sigma_b=20.0)
    ),
    "BinghamDamper": damper("BinghamDamper", *law(f_c=1.3, f_v=0.83, c_0=100.0, c_v=20.0)),
    "SignalSource": described(
        "SignalSource",
        other(
            "kind",
            "String",
            start="constant",
            description="one of constant, sine, chirp, steps, half_sine, csv",
        ),
        real("level", "parameter", start=0.0),
        real("amplitude", "parameter", start=1.0),
        other("steps", "String", start="0:0"),
        other("file", "String", start=""),
        other("seed", "Integer", start=0, minimum=0),
        real("value", "output"),
    ),
}


def describe(name, building=None, controller=None):
    if building is not None and "wrong" in building.name:
        raise PhysicsError(f"{building}: masses[0] = -1.0 must be positive.")
    return COMPONENTS[name]


def describe_file(path):
    """Stand in for foreign FMUs by name."""
    strange = {
        "kilonewton.fmu": real("force", "output", "kN"),
        "furlong.fmu": real("force", "output", "furlong"),
        "loop.fmu": real("force", "output", "N", dependencies=("acceleration",)),
        "once.fmu": real("force", "output", "N"),
        "once_1.fmu": real("force", "output", "N"),
    }
    if Path(path).name not in strange:
        raise FmuError(f"{path}: this is no zip archive, so no FMU.")
    once = {"once.fmu": "true", "once_1.fmu": "1"}.get(Path(path).name, "false")
    inputs = [real("acceleration", "input", "m/s2", start=0.0, optional=True)]
    inputs += [real("u", "input", optional=True)]
    return described(
        "Foreign", strange[path.name], *inputs, canBeInstantiatedOnlyOncePerProcess=once
    )


def read_record(record, folder):
    if record != "el_centro_1940_ns" and not os.path.isfile(folder / record):  # noqa: PTH113
        raise RecordError(f'record "{record}": no ground motion has this name.')


FAKE = Library(
    names=lambda: list(COMPONENTS),
    describe=describe,
    describe_file=describe_file,
    read_record=read_record,
    driven_mass=lambda building, port, attached: BASE_MASS + attached,
    check_controller=lambda name, controller, building: None,
    check_carried=lambda file, building: None,
    damper_of=damper_of,
    law_of=law_of,
)
