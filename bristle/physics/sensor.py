"""An instrument: what the channel of a sensor's effect shows, one sample after the other."""

from __future__ import annotations

from typing import Any

from . import effects as _effects  # noqa: F401  (importing it registers the effects)
from .effect import Effect
from .weave import Layout, call, q_source, weave


def _source(effect: type[Effect], layout: Layout) -> str:
    q = q_source(value="value", dt="dt")
    slots = [layout.states[f"{effect.name}.{state}"] for state in effect.states]
    lines = ["def show(value, dt, z, p):", f"    q = {q}"]
    if slots:
        targets = "".join(f"z[{slot}], " for slot in slots)
        lines.append(f"    {targets}= {call(effect, 'advance', layout, 'q')}")
    lines.append(f"    return {call(effect, 'channel', layout, 'q')}")
    return "\n".join(lines)


def instrument(effect: type[Effect]) -> tuple[Any, Layout]:
    """Return the function show(value, dt, z, p) of a sensor's effect, and where its numbers lie.

    It takes the next sample of the signal, advances the states `z` in place and returns what the
    instrument shows then.
    """
    layout = Layout("sensor", 0, 0).only(lambda known: known is effect)
    return weave("show", _source(effect, layout), layout), layout
