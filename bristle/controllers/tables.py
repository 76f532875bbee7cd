"""The tables of a comparison as texts: what the command prints and the report shows."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..quantity import plain, scale
from .entry import BEST, LIMIT
from .result import REFERENCES
from .site import DAMPER
from .verdict import what

if TYPE_CHECKING:
    from .result import ControllerComparison

MARK = "†"
"""Behind a controller with which the displacement leaves the damper's stroke."""
_SHORT = {"passive off": "of 0 V", "passive on": "of full", BEST: "of best"}


class Column(NamedTuple):
    """A column of numbers: heading and unit, and the outputs of which it shows the largest."""

    heading: str
    unit: str
    factor: float
    outputs: tuple[str, ...]


def columns(found: ControllerComparison) -> list[Column]:
    """Return the columns that every motion's table has."""
    site = found.setting.site
    shown: list[tuple[str, tuple[str, ...]]] = [
        (f"peak {site.building.levels()[-1]} acceleration", (f"peak {site.top}",))
    ]
    shown.append((f"RMS {site.building.levels()[-1]} acceleration", (f"rms {site.top}",)))
    if site.building.isolated:
        shown.append(("peak base drift", ("peak structure.base_displacement",)))
    shown.append(("peak storey drift", tuple(f"peak {name}" for name in site.drifts)))
    shown.append(("peak force", (f"peak {DAMPER}.force",)))
    shown.append(("RMS voltage", (f"rms {found.outputs[-1].column}",)))
    if not any(outputs == (found.setting.judged.name,) for _, outputs in shown):
        shown.insert(0, (what(found), (found.setting.judged.name,)))
    return [_column(found, heading, outputs) for heading, outputs in shown]


def _column(found: ControllerComparison, heading: str, outputs: tuple[str, ...]) -> Column:
    unit = found.units[outputs[0]]
    factor, said = scale(unit, float(found.table[list(outputs)].to_numpy().max()))
    return Column(heading, said.replace("s2", "s²"), factor, outputs)


def header(found: ControllerComparison) -> list[str]:
    """Return the titles of a motion's table, the controller's first."""
    titles = [f"{one.heading} [{one.unit}]" for one in columns(found)]
    titles += [f"{_SHORT[name]} [%]" for name in REFERENCES]
    if found.worst is not None:
        titles.append(f"worst [{_judged(found).unit}]")
    return ["", *titles]


def _judged(found: ControllerComparison) -> Column:
    return _column(found, "", (found.setting.judged.name,))


def rows(found: ControllerComparison, motion: str) -> list[list[str]]:
    """Return a motion's table as texts, a row per controller, its name first."""
    part = found.table[found.table["motion"] == motion]
    shown, judged = columns(found), _judged(found)
    texts = []
    for case in part.to_dict(orient="records"):
        name = str(case["controller"])
        title = f"{name} ({case['level']:g} V)" if isfinite(case["level"]) else name
        row = [title + (f" {MARK}" if case["stroke"] > 1.0 else "")]
        for one in shown:
            row.append(plain(one.factor * max(case[name] for name in one.outputs), 4))
        for reference in REFERENCES:
            share = found.value(motion, name) / found.value(motion, reference)
            row.append(f"{100.0 * share:.0f}")
        if found.worst is not None:
            value = found.worst_value(motion, name)
            row.append(plain(judged.factor * value, 4) if np.isfinite(value) else "")
        texts.append(row)
    return texts


def lowest(found: ControllerComparison, motion: str) -> int:
    """Return which row of a motion's table has the controller with the lowest judged value."""
    names = list(found.table[found.table["motion"] == motion]["controller"])
    first = min(found.controllers, key=lambda name: found.value(motion, name))
    return names.index(first)


def footnotes(found: ControllerComparison) -> list[str]:
    """Return what the tables' columns and marks mean."""
    texts = [
        f"of 0 V, of full, of best: the {what(found)} over that of the damper at 0 V, at its "
        "largest voltage, and at the best constant voltage."
    ]
    if found.worst is not None:
        texts.append(f"worst: the largest {what(found)} of the case and its members.")
    if (found.table["stroke"] > 1.0).any():
        texts.append(f"{MARK} the displacement leaves the damper's stroke.")
    if found.limits:
        texts.append(f"{LIMIT}: any voltage, the ground motion known in advance.")
    return texts
