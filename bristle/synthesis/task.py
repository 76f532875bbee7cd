"""What is to be designed: a checked description, from a design file or from Python."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..component.controller_file import KINDS
from ..errors import DesignError
from ..physics.building import Building, Device, frequencies, paper_building
from .damper import DesignDamper, spring, stiffness
from .lmi import VARIES
from .plant import Share, check_building, with_share
from .weights import LqgWeights, Weights

DAMPER = "damper"
"""The name of the place on the first level, where it stands among those of devices."""
SAMPLES_PER_PERIOD = 10
"""Fewest samples in a period of the first mode, which a controller must damp."""
MOST_SAMPLES = 1000
"""Samples in a period of the fastest mode beyond which more bring nothing."""
SPEEDS = (1.0, 50.0)
"""Where a grid usefully ends, in typical speeds of the damper's law."""
ABSURD_SAMPLES = 100_000
"""Samples in a period of the fastest mode that no controller takes, and that rounding spoils."""
ABSURD_SPEED = 1000.0
"""End of a grid, in typical speeds of the damper's law, that no damper reaches."""
FASTEST_TIMES_PERIOD = 1.0
"""Largest |pole| times sample period of a controller that may be sampled."""


@dataclass(frozen=True)
class Scheduling:
    """How an LPV design follows the speed r = |v|.

    Attributes
    ----------
    grid : tuple of float
        Speeds [m/s] at which the inequalities hold, rising from 0; faster motion is taken as the
        last one.
    rate : float
        Bound on the rate of change of the speed [m/s2]; counts where X or Y varies.
    varies : {"none", "X", "Y", "both"}
        Which Lyapunov matrix is X_0 + r X_1. "both" gives a bound and no controller, for that
        would need the rate as a measurement.
    eps : float
        Speed [m/s] within which the sign function is smoothed.
    rows : int
        Rows of the controller's table, even over the grid's range.
    balance_at : float or None
        The grid speed whose plant sets the balanced states for all; None: the one nearest to the
        mean of the grid.
    """

    grid: tuple[float, ...] = (0.0, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3)
    rate: float = 1.0
    varies: str = "none"
    eps: float = 0.005
    rows: int = 601
    balance_at: float | None = None

    def __post_init__(self) -> None:
        grid = self.grid
        if len(grid) < 2:
            raise DesignError(f"scheduling: a grid of {len(grid)} speed has no range; give two.")
        if not all(map(isfinite, grid)) or any(b <= a for a, b in pairwise(grid)):
            raise DesignError(f"scheduling: grid = {list(grid)} must rise from speed to speed.")
        if grid[0] != 0.0:
            raise DesignError(
                f"scheduling: the grid begins at {grid[0]:g} m/s; it must begin at 0, where every "
                "motion turns."
            )
        if self.varies not in VARIES:
            raise DesignError(f"scheduling: varies = {self.varies!r}; there are {list(VARIES)}.")
        for name in ("rate", "eps"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise DesignError(f"scheduling: {name} = {value!r} must be positive.")
        if not 2 <= self.rows <= 100_001:
            raise DesignError(f"scheduling: rows = {self.rows!r}; 2 to 100001 are right.")
        if self.balance_at is not None and self.balance_at not in grid:
            raise DesignError(f"scheduling: balance_at = {self.balance_at!r} is not in the grid.")

    @property
    def middle(self) -> int:
        """Index of the grid point that sets the balanced states."""
        if self.balance_at is not None:
            return self.grid.index(self.balance_at)
        grid = np.array(self.grid)
        return int(np.argmin(np.abs(grid - grid.mean())))

    def speeds(self) -> NDArray[np.float64]:
        """Return the speeds of the table's rows (rows,) [m/s]."""
        return np.linspace(0.0, self.grid[-1], self.rows)


@dataclass(frozen=True)
class Task:
    """A design task: kind, building, damper, weights.

    Attributes
    ----------
    kind : {"hinf", "lpv", "lqg"}
        "hinf" and "lqg" command a force; "lpv" commands the signed voltage.
    tau : float
        At least 1; holds X Y >= tau^2, which keeps the controller slow enough to be sampled. 1
        gives the least gamma and a controller that cannot be built.
    order : int or None
        How many balanced states the controller keeps; None: all of the plant's. Tall buildings
        have states that hardly count and make the solver slow (185 s for 42 states); with fewer
        states gamma is that of the reduced plant, the norm that of the whole.
    sample_period : float
        [s]
    device : str
        Name of the building's device that is commanded; "": the damper on the first level. The
        controller's measured displacement, velocity and force are those of this device.
    passive : dict
        What dampers at other places add to the plant, by the device's name; "damper" is the one on
        the first level. A device that is not named here adds nothing.

    Raises
    ------
    DesignError
        If a number or a device is out of place, or the building has a mode that the damper cannot
        damp.
    PhysicsError
        If the building lacks a device.
    """

    kind: str
    title: str = ""
    building: Building = field(default_factory=paper_building)
    damper: DesignDamper = field(default_factory=DesignDamper)
    weights: Weights = field(default_factory=Weights)
    scheduling: Scheduling = field(default_factory=Scheduling)
    lqg: LqgWeights = field(default_factory=LqgWeights)
    tau: float = 2.0
    order: int | None = None
    sample_period: float = 0.002
    device: str = ""
    passive: dict[str, Share] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DesignError(f"kind = {self.kind!r}; there are {', '.join(KINDS)}.")
        if not (isfinite(self.tau) and self.tau >= 1.0):
            raise DesignError(f"tau = {self.tau!r} must be at least 1.")
        if self.order is not None and not 1 <= self.order <= self.states:
            raise DesignError(
                f"order = {self.order!r} must lie in 1 .. {self.states}, the plant's states."
            )
        for name, share in self.passive.items():
            if name == (self.device or DAMPER):
                raise DesignError(f"passive: {name} is what is commanded; its law is in [damper].")
            for what, value in share._asdict().items():
                if not (isfinite(value) and value >= 0.0):
                    raise DesignError(f"passive: {name}.{what} = {value!r} must not be negative.")
        if not self.damper.follows_command:
            raise DesignError(
                f"damper: the voltage has no effect on the force of {self.damper.law!r} with these "
                "parameters, so there is nothing to control. A parameter per volt above 0 is right."
            )
        check_building(self.plant_building, self.place)
        check_sample_period(self.sample_period, self.plant_building)
        known = self.damper.known_to
        if self.kind == "lpv" and known is not None and self.scheduling.grid[-1] > known:
            raise DesignError(
                f"scheduling: the grid goes to {self.scheduling.grid[-1]:g} m/s, beyond the "
                f"{known:g} m/s of the damper's data."
            )
        typical = self.damper.speed
        if self.kind == "lpv" and self.scheduling.grid[-1] > ABSURD_SPEED * typical:
            raise DesignError(
                f"scheduling: the grid goes to {self.scheduling.grid[-1]:g} m/s, beyond any "
                f"damper's speed: the law's typical speed is {typical:g} m/s; up to "
                f"{SPEEDS[1] * typical:g} m/s is plausible."
            )

    @property
    def place(self) -> Device:
        """Where the damper is that is commanded."""
        return self.building.device(self.device)

    @property
    def plant_building(self) -> Building:
        """The building with the linear shares of the dampers that are not commanded."""
        building = self.building
        for name, share in self.passive.items():
            device = building.device("" if name == DAMPER else name)
            building = with_share(building, device, share)
        return building

    @property
    def stiffness(self) -> float:
        """What the commanded damper's springs add to the plant [N/m].

        Beside a voltage those of its law and its effects. Beside a commanded force that of its
        effects: the law's own is in that force, which an inverse takes apart. None where the
        measured force enters an estimator, for it holds them all.
        """
        if self.kind == "lqg":
            return 0.0
        return stiffness(self.damper) + (spring(self.damper) if self.kind == "lpv" else 0.0)

    @property
    def states(self) -> int:
        """Number of states of the generalized plant."""
        weights = self.weights
        return 2 * self.building.size + weights.acceleration.order + weights.command.order

    @property
    def reduced(self) -> bool:
        """Whether the controller has fewer states than the plant."""
        return self.order is not None and self.order < self.states

    def data(self) -> dict[str, Any]:
        """Return the task as the content of a design file, the building by name."""
        content: dict[str, Any] = {
            "schema": 1,
            "kind": self.kind,
            "title": self.title,
            "building": self.building.name,
            "sample_period": self.sample_period,
            "damper": self.damper.data(),
        }
        if self.device:
            content["device"] = self.device
        if self.passive:
            content["passive"] = {name: share._asdict() for name, share in self.passive.items()}
        if self.kind == "lqg":
            return {**content, "lqg": dict(vars(self.lqg))}
        content |= {"tau": self.tau, "order": self.order}
        content["weights"] = {
            "acceleration": self.weights.acceleration.data(),
            "command": self.weights.command.data(),
            "noise": self.weights.noise,
        }
        if self.kind == "lpv":
            s = self.scheduling
            content["scheduling"] = {**vars(s), "grid": list(s.grid)}
        return content

    def digest(self) -> str:
        """Return 16 hexadecimal digits that stand for the task."""
        # Which device measurements tell changes no design; one without devices is named as ever.
        plain = self.building._replace(studied="")[:-1]
        named = plain if plain[-1] else plain[:-1]
        text = json.dumps([self.data(), named], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def check_sample_period(h: float, building: Building) -> None:
    """Refuse a sample period that is not positive, or does not suit the building's modes.

    Raises
    ------
    DesignError
        With the longest or the shortest period that would do.
    """
    own = frequencies(building)
    first, fastest = own[0], own[-1]
    longest = 1.0 / (SAMPLES_PER_PERIOD * first)
    if not (isfinite(h) and h > 0.0):
        raise DesignError(f"sample_period = {h!r} s must be positive; 0.002 s is usual.")
    if h > longest:
        raise DesignError(
            f"sample_period = {h:g} s is too long for the first mode of {building.name!r}, "
            f"{first:.4g} Hz: at most {longest:.3g} s, {SAMPLES_PER_PERIOD} samples per period."
        )
    shortest = 1.0 / (MOST_SAMPLES * fastest)
    if h * fastest * ABSURD_SAMPLES < 1.0:
        raise DesignError(
            f"sample_period = {h:g} s is too short: the fastest mode of {building.name!r} has "
            f"{fastest:.4g} Hz, so that {shortest:.2g} to {longest:.2g} s is plausible."
        )
