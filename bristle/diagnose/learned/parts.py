"""The parts of a model that a learned curve may change, and along which signals."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from .along import ALONG
from .place import AT_DAMPER, Place
from .ring import RING
from .slip import SLIP


class Part(NamedTuple):
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
    "force": Part("force", "{g}", "N", "an added force", "F = F_model + g"),
    "friction": Part(
        "force", "tanh(q.v / SLOW) * {g}", "N", "a friction force", "F = F_model + g sgn(v)",
        ("v",), level=True,
    ),
    "yield": Part(
        "yield_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the yield force",
        "yield force x (1 + g)", (), -0.98, True,
    ),
    "viscous": Part(
        "viscous_factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the viscous force",
        "viscous force x (1 + g)", (), -0.98, True,
    ),
    "fluid": Part(
        "factor", "max(1.0 + {g}, 0.02)", "1", "a factor of the fluid's whole force",
        "force of the fluid x (1 + g)", (), -0.98, True,
    ),
    "yield_field": Part(
        "yield_factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the yield force under command",
        "yield force x (1 + g u/u_top), u the command", ("V",), -0.98,
    ),
    "fluid_field": Part(
        "factor", "max(1.0 + {g} * q.V / TOP, 0.02)", "1",
        "a factor of the fluid's whole force under command",
        "force of the fluid x (1 + g u/u_top), u the command", ("V",), -0.98,
    ),
    "command": Part(
        "voltage", "max(q.V + {g}, 0.0)", "V", "a map of the command",
        "the damper sees u + g, u the command", ("V",), level=True,
    ),
    SLIP: Part(
        "force", "{g}", "N", "parallel elastic-slip elements", "F = F_model + sum of curve[k] s_k",
        low=0.0, alone=True, cause=ALONG["travel"].words,
        law="-1 <= s_k <= 1\n\n    s_k is the state of a spring with a slider: x/KNOTS[k] since the"
        " last reversal, until\n    it slips (Iwan 1966, J. Appl. Mech. 33(4)).",
    ),
    RING: Part(
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
    "spring": Part(
        "force", "max({g}, -0.98) * q.stiffness * q.x", "1", "a factor of the stiffness",
        "stiffness x (1 + g)", ("x", "stiffness"), -0.98, True, along=("speed", *_PAST),
    ),
    "damping": Part(
        "force", "{g} * q.v", "N.s/m", "an added damping", "F = F_model + g v", ("v",),
        level=True, along=("displacement", *_PAST),
    ),
    SLIP: PARTS[SLIP],
}  # fmt: skip
"""The parts of the model of an isolation layer or a storey, a line: k x + c v with a constant."""


@cache
def parts_at(place: Place) -> dict[str, Part]:
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


def may_change(part: str, along: str, place: Place = AT_DAMPER) -> bool:
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
