"""What dampers that are not commanded add to the linear plant."""

from __future__ import annotations

from typing import NamedTuple

from ..physics.building import Building, Matrix
from ..physics.device import Device


class Share(NamedTuple):
    """What a passive device adds to the linear plant: damping [N s/m] and stiffness [N/m]."""

    damping: float = 0.0
    stiffness: float = 0.0


def with_share(building: Building, device: Device, share: Share) -> Building:
    """Return a building with a device's linear share: C + c b b^T, K + k b b^T."""
    b = device.incidence(building.size)

    def added(matrix: Matrix, factor: float) -> Matrix:
        return tuple(
            tuple(value + factor * b[i] * b[j] for j, value in enumerate(row))
            for i, row in enumerate(matrix)
        )

    return building._replace(
        C=added(building.C, share.damping), K=added(building.K, share.stiffness)
    )
