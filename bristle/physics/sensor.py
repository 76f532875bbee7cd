"""An instrument: what the channel of a sensor's effect shows, one sample after the other."""

from __future__ import annotations

from typing import Any

from .codegen import Slots, call, generate, q_source
from .effect import Effect


def _source(effect: type[Effect], slots: Slots) -> str:
    q = q_source(value="value", dt="dt")
    places = slots.places(effect)
    lines = ["def show(value, dt, z, p):", f"    q = {q}"]
    if places:
        targets = "".join(f"z[{place}], " for place in places)
        lines.append(f"    {targets}= {call(effect, 'advance', slots, 'q')}")
    lines.append(f"    return {call(effect, 'channel', slots, 'q')}")
    return "\n".join(lines)


def instrument(effect: type[Effect]) -> tuple[Any, Slots]:
    """Return the function show(value, dt, z, p) of a sensor's effect, and where its numbers lie.

    It takes the next sample of the signal, advances the states `z` in place and returns what the
    instrument shows then.
    """
    slots = Slots((), (effect,))
    return generate("show", _source(effect, slots), slots), slots
