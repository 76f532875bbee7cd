"""One picture per effect for its page: the force with and without it."""

from __future__ import annotations

import io
from math import cos, pi, sin
from typing import TYPE_CHECKING

from bristle.physics import damper
from bristle.physics.effect import EFFECTS, Effect, Q, laws_joined
from bristle.physics.laws import DEFAULT
from bristle.view.style import BLUE, PALE, Page, label, look, zero_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP = 2.5e-4  # s
SPEED = 0.1  # m/s, largest
Points = list[tuple[float, float, float, float]]  # x [mm], v [mm/s], V, force [N]


def picture(name: str) -> tuple[bytes, str, float] | None:
    """Return an effect's picture as PNG, its caption and width [in]; None where there is none."""
    effect = EFFECTS[name]
    if effect.site == "damper":
        return _of_damper(effect)
    return _of_storey(effect) if "spring" in effect.hooks() else None


def _of_damper(effect: type[Effect]) -> tuple[bytes, str, float]:
    joined = laws_joined(effect)
    law = DEFAULT if DEFAULT in joined else joined[0]
    voltage = "voltage" in effect.hooks()
    motion = _sweep if voltage else _sine
    without, with_it = motion(law, []), motion(law, [effect.name])
    shows = ((2, "voltage [V]"),) if voltage else ((1, "velocity [mm/s]"), (0, "displacement [mm]"))
    with look():
        page = Page(8.0 if len(shows) > 1 else 4.6, 2.9, "")
        grid = page.grid(1, len(shows), left=0.5, top=0.3, column_gap=0.5)
        for column, (index, title) in enumerate(shows):
            axes = page.figure.add_subplot(grid[0, column])
            zero_lines(axes)
            for points, colour, width in ((without, PALE, 2.2), (with_it, BLUE, 1.2)):
                axes.plot(
                    [p[index] for p in points], [p[3] for p in points], color=colour, lw=width
                )
            axes.set_xlabel(title)
            axes.set_title("damper force [N]")
            _legend(axes, effect.name)
    moved = (
        "at a steady 50 mm/s, voltage in a triangle of 1 s" if voltage else "sine of 2 Hz at 4 V"
    )
    return _png(page), f"{law} law, {moved}; parameters as below", page.width


def _sine(law: str, effects: list[str]) -> Points:
    """Return the last of four cycles at 2 Hz and 4 V."""
    w = 4.0 * pi
    return _march(
        law, effects, 2.0, 0.5, lambda t: (SPEED / w * sin(w * t), SPEED * cos(w * t), 4.0)
    )


def _sweep(law: str, effects: list[str]) -> Points:
    """Return a second at a steady speed under a voltage that goes from 0 to 8 V and back."""
    return _march(
        law, effects, 3.0, 1.0, lambda t: (0.05 * t, 0.05, 8.0 - abs(8.0 - 16.0 * (t % 1.0)))
    )


def _march(law, effects, length, kept, motion) -> Points:  # type: ignore[no-untyped-def]
    model = damper.DamperModel(law, {}, effects)
    found = []
    count, before = round(length / STEP), motion(0.0)[1]
    for k in range(1, count + 1):
        x, v, voltage = motion(k * STEP)
        force = model.step(x, v, (v - before) / STEP, voltage, STEP, 0.0, 0.0, False)
        before = v
        if k * STEP > length - kept:
            found.append((1e3 * x, 1e3 * v, voltage, force))
    return found


def _of_storey(effect: type[Effect]) -> tuple[bytes, str, float]:
    values = effect.values_of({})
    z = effect.State(*(0.0 for _ in effect.states))
    stiffness = 1366.5  # N/m, of the default building
    rest = Q(*(0.0 for _ in Q._fields))._replace(dt=STEP, stiffness=stiffness, storey=1.0)
    drifts = [0.02 * sin(2.0 * pi * STEP * k) for k in range(round(1.25 / STEP) + 1)]
    forces = []
    for before, drift in zip([0.0, *drifts], drifts, strict=False):
        q = rest._replace(drift=0.5 * (before + drift), drift_rate=(drift - before) / STEP)
        if "advance" in effect.hooks():
            z = effect.State(*effect.advance(q, z, values))
        forces.append(stiffness * drift + effect.spring(q._replace(drift=drift), z, values))
    with look():
        page = Page(4.6, 2.9, "")
        axes = page.figure.add_subplot(page.grid(1, 1, left=0.5, top=0.3)[0, 0])
        zero_lines(axes)
        axes.plot([1e3 * d for d in drifts], [stiffness * d for d in drifts], color=PALE, lw=2.2)
        axes.plot([1e3 * d for d in drifts], forces, color=BLUE, lw=1.2)
        axes.set_xlabel("storey drift [mm]")
        axes.set_title("storey force [N]")
        _legend(axes, effect.name)
    return _png(page), "a storey of the default building; parameters as below", page.width


def _legend(axes: Axes, name: str) -> None:
    where = {"xycoords": "axes fraction", "fontsize": 8}
    label(axes, name, 0.03, 0.97, BLUE, va="top", **where)
    label(axes, "without", 0.03, 0.88, "#8a8a8a", va="top", **where)


def _png(page: Page) -> bytes:
    stream = io.BytesIO()
    with look():
        page.figure.savefig(stream, format="png", dpi=140)
    return stream.getvalue()
