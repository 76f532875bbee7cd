"""Designs for a comparison's building: made anew where none was made for it.

A stock design belongs to the library's building and damper. For others it is made again with the
same weights, brought to their size: a command costs as much of the acceleration that it can make,
drift weighs as much beside acceleration, and corners move with the first mode. So a building that
differs in its unit of mass alone gets the same design.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..control.controller import COMMAND_UNITS, POLICY, Controller
from ..design import Damper as DesignDamper
from ..design import LqgWeights, Task, Weight, Weights, design
from ..design.plausible import Reach, reach_of
from ..errors import DesignError
from ..physics.building import frequencies
from ..physics.drive import VOLTAGE
from .dampers import DEFAULT, Damper, catalogue_law
from .site import Site


def designed_for(kind: str, site: Site, damper: Damper) -> Controller:
    """Return a controller of some kind, designed for a building and its damper.

    Parameters
    ----------
    kind : of the design, "hinf", "lpv", "lqg" ...
    site, damper : what it is for

    Raises
    ------
    DesignError
        If there is none, or the design needs the damper's law and nobody knows it.
    """
    return design(task_for(kind, site, damper)).controller


def task_for(kind: str, site: Site, damper: Damper) -> Task:
    """Return the stock task of a kind, brought to a building and its damper.

    Parameters
    ----------
    kind, site, damper
        As in `designed_for`, and what is raised too.
    """
    if kind == POLICY:
        raise DesignError(
            f"the library's {kind} was trained for its own building and damper. Train one for "
            f"yours in a checkout: `python -m benchmarks train my_{kind}.toml`, then --controller "
            f"my_{kind}.json."
        )
    known = DesignDamper() if damper.usual else damper.for_design()
    if known is None and COMMAND_UNITS[kind] == VOLTAGE.unit:
        raise DesignError(
            f"a design of the kind {kind} follows the damper's law, and {damper.name} has none "
            "that is known in closed form."
        )
    stock = Task(kind)
    here = replace(
        stock, title=f"{kind} for {site.building.name}", building=site.building,
        device=site.device.name, damper=known or DesignDamper(),
    )  # fmt: skip
    return replace(here, **_weights(stock, here))


def _weights(stock: Task, here: Task) -> dict[str, Any]:
    """Return the weights of a stock task at the size of another plant."""
    before, now = reach_of(stock), reach_of(here)
    if stock.kind == "lqg":
        return {"lqg": _lqg(stock.lqg, before, now)}
    faster = frequencies(here.building)[0] / frequencies(stock.building)[0]
    w = stock.weights
    command = _moved(w.command, faster, now.command / before.command)
    return {"weights": Weights(_moved(w.acceleration, faster, 1.0), command, w.noise)}


def _lqg(w: LqgWeights, before: Reach, now: Reach) -> LqgWeights:
    per_force = now.command / before.command
    per_drift = (now.command / now.drift) / (before.command / before.drift)
    return replace(w, force=w.force * per_force**2, drift=w.drift * per_drift**2)


def _moved(weight: Weight, faster: float, share: float) -> Weight:
    """Return a weight whose frequencies are `faster` times as high, and its gain times `share`."""

    def scaled(polynomial: tuple[float, ...], gain: float = 1.0) -> tuple[float, ...]:
        missing = len(weight.denominator) - len(polynomial)
        return tuple(gain * c * faster ** (k + missing) for k, c in enumerate(polynomial))

    return Weight(scaled(weight.numerator, share), scaled(weight.denominator))


def force_share(damper: Damper) -> float:
    """Return how strong a damper is beside the library's: force at its typical speed and most V.

    1 where its law is not known in closed form.
    """
    return _beside(damper, lambda one: sum(one.sliding_force(one.speed, one.v_max)))


def slope_share(damper: Damper) -> float:
    """Return how much force a volt makes beside the library's damper, at its typical speed.

    1 where its law is not known in closed form.
    """

    def per_volt(one: DesignDamper) -> float:
        still, driven = (sum(one.sliding_force(one.speed, V)) for V in (0.0, one.v_max))
        return (driven - still) / one.v_max

    return _beside(damper, per_volt)


def _beside(damper: Damper, measure: Callable[[DesignDamper], float]) -> float:
    """Return what a measure tells of a damper over what it tells of the library's."""
    known = damper.for_design()
    if known is None or damper.usual:
        return 1.0
    return measure(known) / measure(DesignDamper(catalogue_law(DEFAULT)))
