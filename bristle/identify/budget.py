"""The force budget: what each part of a law and each effect makes of a model's force."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .model import Model, Problem, Run, without

Array = NDArray[np.float64]

PARTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("spring", ("elastic",)),
    ("viscous", ("viscous",)),
    ("damping of the bristles", ("damping",)),
    ("yield", ("limit", "yielding")),
)
"""Parts of a law by name, with the hooks that make them, in the order in which they are taken."""


class Share(NamedTuple):
    """A part of a model's force: `force` (n,) [N], and its RMS over that of the whole."""

    name: str
    force: Array
    share: float


def force_budget(problem: Problem, model: Model, run: Run) -> list[Share]:
    """Return what the parts of a model make of its force in a run; they sum up to the force.

    The force loses them one after the other: first the effects, the last one first, then the parts
    of the law, each with all parameters that it alone is linear in at zero. What an effect makes of
    the force is so what it loses without it, the law and the effects before it unchanged.

    Parameters
    ----------
    problem : Problem
        What predicts the runs of the model.
    model : Model
        Law and effects with their values.
    run : Run
        One of the problem's.

    Returns
    -------
    list of Share
        Parts of the law, then effects in the order of the model. "rest of the law" is what none of
        the parts takes, left out where there is none.
    """
    whole = problem.predict(model, run)
    size = float(np.sqrt(np.mean(whole**2)))
    out, before = [], whole
    for name, then in _less_and_less(model):
        after = problem.predict(then, run)
        out.append(_share(name, before - after, size))
        before = after
    out.append(_share("rest of the law", before, size))
    effects = len(model.effects)
    parts = [one for one in reversed(out[effects:]) if one.share > 1e-9]
    return [*parts, *reversed(out[:effects])]


def _share(name: str, force: Array, size: float) -> Share:
    own = float(np.sqrt(np.mean(force**2)))
    return Share(name, force, own / size if size > 0.0 else 0.0)


def _less_and_less(model: Model) -> Iterator[tuple[str, Model]]:
    """Yield what is taken from a model, and what is left of it then."""
    left = model
    for name in reversed(model.effects):
        kept = tuple(one for one in left.effects if one != name)
        values = {key: y for key, y in left.values.items() if not key.startswith(f"{name}.")}
        left = replace(left, effects=kept, values=values)
        yield name, left
    law, taken = model.law_class, set[str]()
    for name, hooks in PARTS:
        own = [one for one in law.linear_in(hooks) if one not in taken]
        if own:
            taken.update(own)
            left = without(left, tuple(own))
            yield name, left
