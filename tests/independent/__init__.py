"""Measurements with a hidden effect, made without the package that has to find it.

Own symbols, own forms, own integrator. Nothing in this folder imports the package, and a test
holds that line. `python -m tests.independent.generate --help` writes a case to a folder.

    rigs.py          rigs of 10 N and 2 kN, bench and building; the base laws in closed form
    effects.py       hidden effects, each in two or more forms of the literature
    experiments.py   motions, ground motions and voltage programmes
    kernel.py        the coupled equations and the adaptive integrator (numba)
    electrics.py     from the commanded voltage to the one the fluid feels
    specimen.py      a rig with its effects put through an experiment
    refit.py         what a refit of the base law leaves of the force
    instruments.py   noise and sensor faults
    generate.py      cases of a wanted strength, files, command line
"""
