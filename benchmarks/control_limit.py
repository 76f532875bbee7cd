"""How much control of the damper could gain in the eight cases, and what it costs not to foresee.

For each case the least peak that any voltage reaches, that of a receding horizon with some preview,
the clipped-optimal controller's, and that of the design of `better`; minutes.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from bristle.engine.coupled import Coupled
from bristle.errors import RecordError
from bristle.optimal_control import Limit, limit
from bristle.system.scenario import load_scenario

from ._motions import DATA, NEWHALL, REPORTED, G, recorded
from ._rows import Row
from ._semi_active import ESTIMATED, peak
from .better import CHOSEN

OUTPUT = "structure.floor2_acceleration_absolute"
SECONDS = 60.0
"""Goal for a case [s]."""
APART = 0.02
"""Goal for how far the starts lie apart, as a share."""


def run() -> list[Row]:
    """Return a row per case, and those on all of them."""
    rows, shares, gains, slowest, apart, wrong = [], [], [], 0.0, 0.0, 0
    for name, record, intensity, seconds in REPORTED:
        try:
            ground = recorded(record, intensity, seconds)
        except RecordError:
            continue
        found, clipped, spent = _found(record, intensity)
        design = peak(ESTIMATED, ground, CHOSEN)
        shares.append((clipped - design) / (clipped - found.value))
        gains.append([1.0 - value / clipped for value in (*found.previews.values(), found.value)])
        slowest = max(slowest, spent)
        apart = max(apart, found.starts[-1].value / found.starts[0].value - 1.0)
        wrong += not found.sure
        rows.append(
            Row(
                f"control_limit, {name} {intensity:g} g",
                f"{found.value:.3f} m/s2 of {clipped:.3f} under clipped-optimal control",
                note=_noted(found, clipped, design, spent),
            )
        )
    mean = ", ".join(f"{100 * share:.0f} %" for share in np.mean(gains, axis=0))
    ahead = ", ".join(f"{seconds:g} s" for seconds in found.previews)
    rows += [
        Row("control_limit, starts apart at most", f"{100 * apart:.2f} %", "2 %", apart / APART),
        Row("control_limit, not confirmed", f"{wrong} of {len(shares)} cases", "none", 1.0 + wrong),
        Row(
            "control_limit, slowest case, processor",
            f"{slowest:.0f} s",
            f"{SECONDS:g} s",
            slowest / SECONDS,
            "the first one compiles",
        ),
        Row(
            "control_limit, mean below clipped",
            f"{mean} with {ahead} of preview, and with the whole motion known",
            note=f"the design of `better` closes {100 * np.mean(shares):.0f} % of the gap from "
            "clipped to the limit",
        ),
    ]
    return rows


def _found(record: str, intensity: float) -> tuple[Limit, float, float]:
    """Return the limit of a case, the peak under clipped-optimal control [m/s2], processor time."""
    name = str(Path(DATA) / record) if record == NEWHALL else record
    values = {"ground.record": name, "ground.peak": intensity * G, "run.stop": 32.0}
    began = time.process_time()
    found = limit("el_centro_0p6g_constant_voltage", values)
    spent = time.process_time() - began
    rows = Coupled().run(load_scenario("el_centro_0p6g_clipped", values))
    return found, float(np.abs(rows[OUTPUT]).max()), spent


def _noted(found: Limit, clipped: float, design: float, spent: float) -> str:
    def below(value: float) -> str:
        return f"{100 * (1 - value / clipped):.0f} %"

    ahead = ", ".join(f"{s:g} s: {v:.3f} ({below(v)})" for s, v in found.previews.items())
    (at, best), bound = found.best_constant, found.bound or 0.0
    return (
        f"{below(found.value)} below; with preview {ahead}; the design of `better` {design:.3f} "
        f"({below(design)}); best constant voltage {best:.3f} ({below(best)}, {at:g} V); lower "
        f"bound {bound:.3f}; starts {', '.join(f'{s.value:.3f}' for s in found.starts)}; "
        f"{spent:.0f} s"
    )
