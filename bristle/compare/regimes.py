"""In which regimes of speed and command a model is right within its noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..identify.search import z_scale
from ..physics.drive import VOLTAGE, Drive
from ..quantity import plain, quantity

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

RIGHT = 1.1
"""z up to which a model is right within its noise, when so many samples are asked."""
_FEWEST = 200  # samples of a regime that says something


@dataclass(frozen=True)
class Regime:
    """A part of the samples by speed, command or both: `text` as in "at low speed and 0 V"."""

    text: str
    speed: str
    command: str
    z: float
    samples: int

    @property
    def right(self) -> bool:
        """Whether the model is right within its noise there."""
        return self.z <= RIGHT

    def as_dict(self) -> dict[str, Any]:
        """Return the regime as JSON has it."""
        return {
            "words": self.text, "speed": self.speed, "voltage": self.command, "z": self.z,
            "samples": self.samples, "right": self.right,
        }  # fmt: skip


def regimes(
    normalised: Sequence[Array], coordinates: Sequence[Mapping[str, Array]],
    drive: Drive = VOLTAGE,
) -> list[Regime]:  # fmt: skip
    """Return the regimes with their z: classes of speed, of the command, and of both together."""
    r = np.concatenate(list(normalised))

    def joined(name: str) -> Array | None:
        if not all(name in one for one in coordinates):
            return None
        return np.concatenate([one[name] for one in coordinates])

    speeds = speed_classes(joined("speed"))
    levels = level_classes(joined(drive.name), drive)
    cells = [*((s, None) for s in speeds), *((None, V) for V in levels)]
    cells += [(s, V) for s in speeds for V in levels]
    out = []
    for s, V in cells:
        chosen = np.ones(len(r), dtype=bool)
        names = []
        for kind in (s, V):
            if kind is not None:
                chosen &= kind[1]
                names.append(kind[0])
        if chosen.sum() >= _FEWEST:
            name = [kind[0] if kind else "" for kind in (s, V)]
            out.append(
                Regime(" and ".join(names), name[0], name[1], z_scale(r[chosen]), int(chosen.sum()))
            )
    return out


def speed_classes(speed: Array | None) -> list[tuple[str, Mask]]:
    """Return low, middle and high speed, cut at a quarter and 60 % of its high values."""
    if speed is None or not np.ptp(speed) > 0.0:
        return []
    top = float(np.quantile(speed, 0.98))
    low, high = 0.25 * top, 0.6 * top
    below, above = (quantity(speed, "m/s", 2, top) for speed in (low, high))
    return [
        (f"at low speed (below {below})", speed < low),
        ("at middle speed", (speed >= low) & (speed < high)),
        (f"at high speed (above {above})", speed >= high),
    ]


def level_classes(V: Array | None, drive: Drive = VOLTAGE) -> list[tuple[str, Mask]]:
    """Return a command (n,) off, low and high; nothing where it does not vary."""
    if V is None or not np.ptp(V) > 1e-3 * max(float(np.max(np.abs(V))), 1e-12):
        return []
    top = float(np.quantile(V, 0.98))
    off, middle = 0.05 * top, 0.5 * top
    return [
        (f"at 0 {drive.unit}", off >= V),
        (f"at low {drive.name} (below {plain(middle, 2)} {drive.unit})", (off < V) & (middle > V)),
        (f"at high {drive.name} (above {plain(middle, 2)} {drive.unit})", middle <= V),
    ]
