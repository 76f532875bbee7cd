"""A curve that is learned: on which part of the model it acts, along which signal, its values.

Over two signals it is a surface: a curve along the first one at each of some levels of the second.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ...identify.rig import DAMPER
from ...physics.drive import VOLTAGE, drive_named, unit_for
from ...quantity import quantity
from .along import ALONG, Along, measured_signal
from .parts import Part, parts_at
from .place import Place
from .ring import RING, SIGNAL
from .slip import SLIP, force_source, signal_of

_SLOPES = (("force", "displacement"), ("force", "velocity"), ("friction", "speed"))
"""Parts and signals along which a straight curve is the line of a layer or a storey itself."""

_SURFACE = """bilinear(
            {}, KNOTS, LEVELS,
            ({}),
        )"""

WITHIN = 0.9
"""Share of the least value of a part, a negative one, that a scan goes down to."""

BOUND = 30.0
"""Times the largest value of a learned curve: bounds of each of its values."""

ROOM = 10.0
"""Times the range of a measured channel: how far beyond it the bounds of what follows it are."""

LEAST = {"K": 0.0, "degC": -273.15}
"""Where a unit ends: no temperature is lower."""


@dataclass(frozen=True)
class Curve:
    """A learned curve: its part and signal, knots (SI) and values there.

    `memory` holds the parameters of the signal's memory [SI]; `held` the knots (from 0) whose value
    stays zero; `slow` is the speed [m/s] below which a friction changes its sign smoothly, `top`
    the largest command of the runs; `drive` names what the command is, whose unit takes the place
    of volts. Elastic-slip elements have their travels as knots, and their forces as values; a
    resonance has one value, its share, and frequency and damping ratio as memory. `at` is the site
    of the rig where it acts. `measured` is the unit of its signal where that is a channel beside
    those that bristle knows, else "".

    Of a surface `across` is the second signal, `levels` are its values (SI), and `values` those at
    the knots of the first level, then of the next ones. `held` are then also the knots that hardly
    a sample is near to: their values continue those beside them; the first is the one that stays
    zero, if one does. `measured` is the unit of its second signal.
    """

    part: str
    along: str
    memory: tuple[tuple[str, float], ...]
    knots: tuple[float, ...]
    values: tuple[float, ...]
    held: tuple[int, ...] = ()
    slow: float = 1e-3
    top: float = 1.0
    drive: str = VOLTAGE.name
    at: str = DAMPER
    measured: str = ""
    across: str = ""
    levels: tuple[float, ...] = ()

    def finer(self) -> Curve:
        """Return the same curve with a knot more between any two."""
        at = 0.5 * np.arange(2 * len(self.knots) - 1)
        knots = np.interp(at, range(len(self.knots)), self.knots)
        values = np.interp(knots, self.knots, self.values)
        held = tuple(2 * k for k in self.held)
        return replace(self, knots=tuple(knots.tolist()), values=tuple(values.tolist()), held=held)

    @property
    def place(self) -> Place:
        """The site of the rig where it acts."""
        return Place(self.at)

    @property
    def of(self) -> Part:
        """The part of the model that it changes."""
        return parts_at(self.place)[self.part]

    @property
    def kind(self) -> tuple[str, str, str]:
        """Its part, its signal, and the second one of a surface."""
        return self.part, self.along, self.across

    @property
    def of_line(self) -> bool:
        """Whether its slope is the model's own already: its line, through rest."""
        return self.place.is_line and (self.part, self.along) in _SLOPES

    @property
    def rests(self) -> bool:
        """Whether it is zero where its signal is: a building at rest is to stay there."""
        return self.place.is_line and self.part == "force"

    @property
    def signal(self) -> Along:
        """The signal that it depends on, of a surface the first one."""
        if self.part == RING:
            return SIGNAL
        if self.measured and not self.across:
            return measured_signal(self.along, self.measured)
        along = ALONG[self.along] if self.along in ALONG else signal_of(self.knots)
        return signal_at(along, self.place)

    @property
    def second(self) -> Along:
        """The second signal of a surface."""
        if self.measured:
            return measured_signal(self.across, self.measured)
        return signal_at(ALONG[self.across], self.place)

    @property
    def signals(self) -> tuple[Along, ...]:
        """All signals that it depends on."""
        return (self.signal, self.second) if self.across else (self.signal,)

    @property
    def entries(self) -> tuple[str, ...]:
        """The names of the parameters that its values are."""
        if self.of.parameter:
            return (self.of.parameter,)
        knots = range(1, len(self.knots) + 1)
        return tuple(f"{row}[{k}]" for row in self.rows for k in knots)

    @property
    def rows(self) -> tuple[str, ...]:
        """The names of the tables that its values are in, of a surface one for each level."""
        levels = range(1, len(self.levels) + 1)
        return tuple(f"row_{k}" for k in levels) if self.across else ("curve",)

    @property
    def unit(self) -> str:
        """The unit of its values."""
        return unit_for(self.of.unit, drive_named(self.drive))

    @property
    def along_unit(self) -> str:
        """The unit of its knots."""
        return unit_for(self.signal.unit, drive_named(self.drive))

    @property
    def across_unit(self) -> str:
        """The unit of the levels of a surface."""
        return unit_for(self.second.unit, drive_named(self.drive))

    @property
    def source(self) -> str:
        """Its value as a hook computes it from the table."""
        if self.part == SLIP:
            return force_source(len(self.knots))
        if self.across:
            at, rows = f"{self.signal.source}, {self.second.source}", self.rows
            listed = ", ".join(f"p.{row}" for row in rows)
            return _SURFACE.format(at, listed)
        return self.signal.value or f"interpolate({self.signal.source}, KNOTS, p.curve)"

    @property
    def passive(self) -> bool:
        """Whether it gives no energy over a cycle, whatever its values."""
        conserves = (self.part, self.along, self.across) == ("force", "displacement", "")
        active = ("force", "spring", "voltage", "channel")
        return self.part == SLIP or conserves or self.of.hook not in active

    def words(self) -> str:
        """Return what it is, in a few words: "an added force along displacement"."""
        if self.part == SLIP:
            return self.of.words
        if self.part == RING:
            return f"{self.of.words}, near {quantity(dict(self.memory)['frequency'], 'Hz')}"
        times = dict(self.memory)
        faded = f" (over {quantity(times['tau'], 's')})" if "tau" in times else ""
        if self.across:
            return f"{self.of.words} over {self.signal.words} and {self.second.words}{faded}"
        return f"{self.of.words} along {self.signal.words}{faded}"


def inside(part: Part, values: Iterable[float]) -> tuple[float, ...]:
    """Return values (k,) of a curve, none of them too near to the least one that its part takes."""
    return tuple(float(max(value, WITHIN * part.low)) for value in values)


def signal_at(along: Along, place: Place) -> Along:
    """Return a signal as it is called at a place: the displacement of a storey is its drift.

    The states of a building begin at zero, whatever its motion.
    """
    if not place.is_line:
        return along
    return replace(
        along, words=place.words(along.words), needs=place.needs(along.needs),
        source=place.source(along.source), advance=place.source(along.advance), starts=(),
    )  # fmt: skip


def bounds_of(curve: Curve) -> tuple[float, float]:
    """Return the bounds of the values of a curve, in its unit."""
    size = BOUND * max(max(abs(value) for value in curve.values), 1e-9)
    return max(curve.of.low, -size), max(size, 5.0) if curve.of.unit == "1" else size


def followed(curve: Curve) -> tuple[float, float, float]:
    """Return value and bounds of the parameter that follows a measured channel.

    Only a model without runs keeps that value; the bounds leave the channel of later runs room.
    """
    knots, unit = (
        (curve.levels, curve.across_unit) if curve.across else (curve.knots, curve.along_unit)
    )
    first, last = knots[0], knots[-1]
    room = max(ROOM * (last - first), abs(first), abs(last))
    return 0.5 * (first + last), max(first - room, LEAST.get(unit, float("-inf"))), last + room


@dataclass(frozen=True)
class Formula:
    """A closed form in the place of a curve's table: `g` its expression of `p`, as source.

    `text` for readers; `parameters` by name: value and unit; `ends` whether it keeps its value
    beyond the ends of the data, as a table does; `positive` names parameters that stay above zero.
    """

    g: str
    text: str
    parameters: tuple[tuple[str, float, str], ...]
    ends: bool = False
    positive: tuple[str, ...] = ()
