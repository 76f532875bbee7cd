"""From the commanded voltage to the voltage that the fluid feels.

The curve of the amplifier or of the fluid's field first, then the coil, the iron's memory and its
saturation. All of it depends on the command alone, so it is done before the mechanics.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .kernel import FINE, electric_path

Array = NDArray[np.float64]


def felt_voltage(command: Array, step: float, fields: dict[str, Any]) -> Array:
    """Felt voltage (n, FINE + 1) V at the points of the command, step s between samples."""
    felt = np.ascontiguousarray(command, dtype=float).copy()
    if bend := int(fields.get("bend_kind", 0)):
        part = felt / fields["bend_v"]
        size = fields["bend_s"]
        felt *= part**size if bend == 1 else 1.0 - size * (1.0 - part)
    kinds = [int(fields.get(f"{name}_kind", 0)) for name in ("coil", "rem", "sat")]
    if not any(kinds):
        return felt
    piece = step / FINE
    electric_path(
        felt,
        kinds[0],
        fields.get("coil_up", 1.0) / piece,
        fields.get("coil_down", 1.0) / piece,
        kinds[1],
        fields.get("rem_r", 0.0),
        kinds[2],
        fields.get("sat_v", 1.0),
    )
    return felt
