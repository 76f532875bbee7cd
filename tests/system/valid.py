"""A scenario that is right, for tests that spoil it."""

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
