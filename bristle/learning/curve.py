"""A curve that is learned: on which part of the model it acts, along which signal, its values.

Over two signals it is a surface: a curve along the first one at each of some levels of the second.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ..comparison.names import OF_STOREY, site_name
from ..core.text import quantity
from ..errors import StudyError
from ..identification.rig import DAMPER
from ..physics.drive import VOLTAGE, drive_named, unit_for
from .signals import ALONG, RING, SIGNAL, SLIP, Along, force_source, measured_signal, signal_of

# Where a curve acts: in a damper, in the isolation layer of a building, or in one of its storeys.
#
# The model of a layer or a storey is a line. What an effect is offered there differs in name: a
# storey's motion is its drift, and its force is asked for by another hook.

_SIGNALS = {"x": "drift", "v": "drift_rate"}
"""Signals of a layer, and what a storey calls them."""

_OFFERED = {*_SIGNALS, "dt"}
"""What a curve along a line may depend on, beside what is known of the line itself."""

_READ = re.compile(rf"\bq\.({'|'.join(_SIGNALS)})\b")


@dataclass(frozen=True)
class CurvePlace:
    """A site of a rig, by its name: "damper", "layer", "storey1", "storey2" ..."""

    name: str = DAMPER

    @property
    def is_line(self) -> bool:
        """Whether the model there is a line, k x + c v with a constant, not a damper's law."""
        return self.name != DAMPER

    @property
    def storey(self) -> int:
        """The storey's number, 0 elsewhere."""
        return int(self.name.removeprefix("storey")) if self._of_storey else 0

    @property
    def site(self) -> str:
        """The site that an effect there declares."""
        return "structure" if self.is_line else DAMPER

    @property
    def _of_storey(self) -> bool:
        return self.name.startswith("storey")

    def offers(self, needs: tuple[str, ...]) -> bool:
        """Return whether a hook there has these signals, by their names in a damper."""
        return not self.is_line or set(needs) <= _OFFERED

    def hook(self, name: str) -> str:
        """Return what the hook of a damper that adds a force is called there."""
        return "spring" if self._of_storey and name == "force" else name

    def needs(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return what signals are called there."""
        return tuple(_SIGNALS.get(one, one) for one in names) if self._of_storey else names

    def source(self, text: str) -> str:
        """Return the source of a hook with the signals as they are called there."""
        if not self._of_storey:
            return text
        return _READ.sub(lambda found: f"q.{_SIGNALS[found[1]]}", text)

    def words(self, text: str) -> str:
        """Return the words for a signal as they are there: the displacement of a storey is drift.

        Parameters
        ----------
        text : a few words, in each of which one signal is named at the most
        """
        if not self._of_storey:
            return text
        return " ".join(OF_STOREY.get(word, word) for word in text.split(" "))


AT_DAMPER = CurvePlace()
"""The damper, on a bench or in a building."""


# The parts of a model that a learned curve may change, and along which signals.


class CurvePart(NamedTuple):
    """A part of the model that a curve may change.

    `hook` of an effect and the expression that it returns, `{g}` being the curve's value; `unit` of
    the curve; `words` for sentences; `needs` more signals; `low`, `high` the bounds of its values;
    `level` whether a constant is the law's own already, so that one knot stays at zero. `site` is
    where the effect acts. What is no curve along a signal is `alone`: `law` is the rest of its
    equation, `cause` on what the error depends that it explains, `parameter` its only value.
    `along` names the signals that it may depend on, where not all say something of their own.
    """

    hook: str
    expression: str
    unit: str
    words: str
    formula: str
    needs: tuple[str, ...] = ()
    low: float = float("-inf")
    level: bool = False
    high: float = float("inf")
    site: str = "damper"
    alone: bool = False
    law: str = ""
    cause: str = ""
    parameter: str = ""
    along: tuple[str, ...] = ()


PARTS = {
    "force": CurvePart("force", "{g}", "N", "an added force", "F = F_model + g"),
    "friction": CurvePart(
        "force", "tanh(q.v / SLOW) * {g}", "N", "a friction force", "F = F_model + g sgn(v)",
        ("v",), level=True,
    ),
    "yield": CurvePart(
        "yield_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the yield force",
        "yield force x (1 + g)", (), -0.98, True,
    ),
    "viscous": CurvePart(
        "viscous_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the viscous force",
        "viscous force x (1 + g)", (), -0.98, True,
    ),
    "fluid": CurvePart(
        "factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the fluid's whole force",
        "force of the fluid x (1 + g)", (), -0.98, True,
    ),
    "yield_field": CurvePart(
        "yield_factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the yield force under command",
        "yield force x (1 + g u/u_top), u the command", ("V",), -0.98,
    ),
    "fluid_field": CurvePart(
        "factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the fluid's whole force under command",
        "force of the fluid x (1 + g u/u_top), u the command", ("V",), -0.98,
    ),
    "command": CurvePart(
        "voltage", "max(q.V + {g}, 0.0)", "V", "a map of the command",
        "the damper sees u + g, u the command", ("V",), level=True,
    ),
    SLIP: CurvePart(
        "force", "{g}", "N", "parallel elastic-slip elements", "F = F_model + sum of curve[k] s_k",
        low=0.0, alone=True, cause=ALONG["travel"].words,
        law="-1 <= s_k <= 1\n\n    s_k is the state of a spring with a slider: x/KNOTS[k] since the"
        " last reversal, until\n    it slips (Iwan 1966, J. Appl. Mech. 33(4)).",
    ),
    RING: CurvePart(
        "channel", "q.value + p.share * (z.ring - q.value)", "1",
        "a resonance of what holds the load cell", "F_shown = F + share (r - F)",
        low=0.0, high=1.2, site="sensor", alone=True, cause="the frequency of the force",
        law="r'' + 2 damping w r' + w^2 r = w^2 F,   w = 2 pi frequency\n\n    F is the damper's "
        "force, r its part that a mode of the frame or the fixture lets ring.",
        parameter="share",
    ),
}  # fmt: skip
"""The parts of a damper's model."""

_PAST = ("travel", "rebuilding", "age", "recent_displacement", "recent_speed")

PARTS_OF_LINE = {
    "force": PARTS["force"]._replace(
        level=True, along=("displacement", "velocity", "recent_displacement"),
    ),
    "friction": PARTS["friction"]._replace(
        level=False, along=("displacement", "speed", *_PAST),
    ),
    "spring": CurvePart(
        "force", "max({g}, -0.98) * q.stiffness * q.x", "1", "a factor of the stiffness",
        "stiffness x (1 + g)", ("x", "stiffness"), -0.98, True, along=("speed", *_PAST),
    ),
    "damping": CurvePart(
        "force", "{g} * q.v", "N.s/m", "an added damping", "F = F_model + g v", ("v",),
        level=True, along=("displacement", *_PAST),
    ),
    SLIP: PARTS[SLIP],
}  # fmt: skip
"""The parts of the model of an isolation layer or a storey, a line: k x + c v with a constant."""


@cache
def parts_at(place: CurvePlace) -> dict[str, CurvePart]:
    """Return the parts of the model at a place by name, as an effect acts on them there."""
    if not place.is_line:
        return PARTS
    return {
        name: part._replace(
            site=place.site, hook=place.hook(part.hook), needs=place.needs(part.needs),
            expression=place.source(part.expression),
        )
        for name, part in PARTS_OF_LINE.items()
    }  # fmt: skip


def may_change(part: str, along: str, place: CurvePlace = AT_DAMPER) -> bool:
    """Return whether a curve along a signal may change a part there.

    A command's map depends on the command. What one part along a signal says already, such as a
    stiffness along displacement and a force along it, no other one says again.
    """
    at = parts_at(place)[part]
    if at.alone or along in PARTS:
        return part == along
    if at.along and along not in at.along:
        return False
    if part == "friction" and along == "stroke":
        return False  # each direction has a curve of its own already
    of_command = along in ("voltage", "recent_voltage")
    if part == "command":
        return of_command
    return not (of_command and part.endswith("_field"))


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
    def place(self) -> CurvePlace:
        """The site of the rig where it acts."""
        return CurvePlace(self.at)

    @property
    def of(self) -> CurvePart:
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


def inside(part: CurvePart, values: Iterable[float]) -> tuple[float, ...]:
    """Return values (k,) of a curve, none of them too near to the least one that its part takes."""
    return tuple(float(max(value, WITHIN * part.low)) for value in values)


def signal_at(along: Along, place: CurvePlace) -> Along:
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
class CurveFormula:
    """A closed form in the place of a curve's table: `g` its expression of `p`, as source.

    `text` for readers; `parameters` by name: value and unit; `ends` whether it keeps its value
    beyond the ends of the data, as a table does; `positive` names parameters that stay above zero.
    """

    g: str
    text: str
    parameters: tuple[tuple[str, float, str], ...]
    ends: bool = False
    positive: tuple[str, ...] = ()


# What may be asked of a learned curve: on which part of a model, along which signal.


def refuse_elsewhere(
    parts: Sequence[str], along: Sequence[str], place: CurvePlace, extra: Sequence[str] = ()
) -> None:
    """Refuse parts and signals that curves do not have at a place.

    Parameters
    ----------
    parts, along : that are asked for
    place : where the curve is to act
    extra : names of the channels that runs hold beside those that bristle knows

    Raises
    ------
    StudyError
        Naming what there is.
    """
    there = parts_at(place)
    signals = [one.name for one in ALONG.values() if place.offers(one.needs)]
    signals += extra if not place.is_line else []
    for asked, known, option in ((parts, list(there), "--as"), (along, signals, "--along")):
        wrong = [one for one in asked if one not in known and one not in there]
        if wrong:
            raise StudyError(
                f"{option}: {site_name(place.name)} has no {', '.join(wrong)}; there are "
                f"{', '.join(known)}."
            )
    pairs = product(parts or there, along or [*signals, *there])
    if not any(may_change(*pair, place) for pair in pairs):
        raise StudyError(
            f"--as {','.join(parts)} --along {','.join(along)}: at {site_name(place.name)} no such "
            "part is learned along such a signal. Leave one of the two options out."
        )
