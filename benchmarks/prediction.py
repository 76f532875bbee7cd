"""Building and identified damper under ground motions alone: how often the stated band holds.

    python -m benchmarks prediction --cases 12

makes what is missing of so many buildings as `bristle example building` makes them, each with
another hidden effect, and prints the share of measured peaks and RMS that lie in the 95 % band of
`bristle predict` on held-out runs. The model is identified, and has the hidden effect
added: what is judged is the band, not the verdict. Without a number it prints what is there.
"""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path

import numpy as np

from bristle.examples.hidden import able
from bristle.examples.make import Choice, make_building
from bristle.prediction.closed_loop import closed_loop
from bristle.study.identify import identify_study
from bristle.study.steps import add_effects

from ._answers import Answer, asked
from ._rows import Row

FIRST = 700
"""Seed of the first building."""


def rows(done: dict[str, Answer]) -> list[Row]:
    """Return the rows of what has answers."""
    if not done:
        return []
    out = []
    failed = [key for key, one in done.items() if "error" in one]
    for kind in ("peak", "rms"):
        inside = [
            ok for one in done.values() for what, ok, _ in one.get("rows", ()) if what == kind
        ]
        share = float(np.mean(inside)) if inside else 0.0
        text = f"{share:.1%} of {len(inside)} in {len(done)} buildings, {len(failed)} failed"
        ratio = max(0.9 / max(share, 1e-3), share / 0.99)
        out.append(Row(f"closed loop: {kind} within the band", text, "90 to 99 %", ratio))
    errors = [abs(off) for one in done.values() for _, _, off in one.get("rows", ())]
    if errors:
        text = f"{float(np.median(errors)):.2%}, 95 % below {float(np.quantile(errors, 0.95)):.1%}"
        out.append(Row("closed loop: error of peaks and RMS, median", text, "", None))
    return out


def answered(_kind: str, number: int) -> Answer:
    """Return whether each peak and RMS lies in its band; an error is an answer too."""
    effects = able("building", "lugre")
    effect = effects[number % len(effects)]
    about = {"effect": effect}
    try:
        with tempfile.TemporaryDirectory() as folder:
            study = make_building(
                Path(folder) / "tower", Choice((effect,), "lugre", seed=FIRST + number)
            )
            identify_study(study, law="lugre")
            add_effects(study, (effect,))
            found = closed_loop(study)
    except Exception:  # whatever it is, it is the method's failure on this case
        return about | {"error": traceback.format_exc()}
    told = [(one.kind, bool(one.inside), one.error) for one in found.rows if one.inside is not None]
    return about | {"rows": told, "notes": list(found.notes)}


run, main = asked("prediction", __doc__, ("cases",), answered, rows)
