"""Makes what many test files need, in a process of its own beside the first of them.

Else each worker of a run on a fresh machine compiles the coupled engine and a diagnosis by itself,
for two minutes.
"""

from __future__ import annotations

import gc

import numpy as np
import studies

import bristle
from bristle.identification.histories import DamperForces


def compile_ahead() -> None:
    """Call each compiled function once, as tests do: its machine code is then on disk.

    The studies of the session are made with it.
    """
    bristle.run("half_sine_pulse", {"run.stop": 0.01}, engine="compiled")
    still = np.zeros(8)
    for effects in ([], ["coil_lag"]):
        DamperForces("lugre", effects).force(still, still, still, still, 0.002, {})
    for name in studies.MADE:
        studies.made(name)


if __name__ == "__main__":
    gc.disable()  # as tests/conftest.py says
    compile_ahead()
