"""Simulation of a scenario: by co-simulation of FMUs, or as one coupled system.

`engine.run.run` gives a frame from either engine. `engine.coupled` solves any scenario of
built-in components through numba, without coupling error: in each substep the forces are iterated
until they and the motion agree.
"""
