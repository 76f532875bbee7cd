"""What the paper's text states in numbers or orders, each held against the numbers found here.

A statement is a function of computed tables: its verdict is nowhere written down. "Undecidable" is
said where the text leaves open what would decide, and the numbers differ along that gap.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from .controller_claims import (
    anti_windup,
    between,
    drift_controllers,
    drift_passive,
    force,
    hinf_against_clipped,
    inverses,
    lpv_against_clipped,
    lpv_against_hinf,
    roll_off,
    voltage,
    windows,
    without_damper,
)
from .model_claims import (
    better_law,
    flattening,
    four_volts,
    jump,
    modified_law,
    optimum,
    rig,
    stiction,
)
from .numbers import (
    ALIKE,
    AS_GOOD,
    POINTS,
    Numbers,
    Verdict,
)


@dataclass(frozen=True)
class Statement:
    """A statement of the text, in other words; `rule` is how it is decided."""

    number: int
    section: str
    text: str
    rule: str
    decide: Callable[[Numbers], Verdict] = field(repr=False)


def ledger(numbers: Numbers) -> list[tuple[Statement, Verdict]]:
    """Return every statement with its verdict."""
    return [(statement, statement.decide(numbers)) for statement in STATEMENTS]


STATEMENTS = (
    Statement(1, "II", "Sampling at 500 Hz; about 10 N at 8 V; stroke 2 cm; base springs 1057 N/m; "
              "2.1, 5.48 and 9 Hz.", "each within 0.1 %, the force within 5 %", rig),
    Statement(2, "III-A", "Beyond some velocity the force falls as velocity grows.",
              "the steady force at the last speed lies below its maximum and falls", flattening),
    Statement(3, "III-A", "The force jumps near zero velocity; it shows more at low force.",
              "the rise over the force at high speed is above 5 % and shrinks with voltage", jump),
    Statement(4, "III-A, Fig. 5", "Peaks in the base's absolute acceleration where the velocity "
              "crosses zero, at low damper force.",
              "median height above the crest of a sine at 0 V, not at 8 V", stiction),
    Statement(5, "III-C", "The LuGre law's identification error is below the Bingham law's.",
              "RMS error of the best fits, two specimens", better_law),
    Statement(6, "III-C, Fig. 8", "The modified laws lower the error by about 5 % (Bingham) and "
              "15 % (LuGre).", f"both within {POINTS:g} points, for both specimens", modified_law),
    Statement(7, "IV-B, Fig. 9", "The best constant voltage is 2 V at 0.2 g, 4 V at 0.4 and 0.6 g, "
              "8 V at 0.8 g.", f"the peaks at these lie within {100 * AS_GOOD:g} % of the least",
              optimum),
    Statement(8, "IV-B", "4 V serves as the passive choice over the range.",
              f"better than 0 V at every intensity, and within {100 * AS_GOOD:g} % of the best at "
              "more of them than any other voltage", four_volts),
    Statement(9, "IV-C", "The clipped voltage is always 0 or 8 V; LPV uses values between.",
              "share of samples strictly between", between),
    Statement(10, "IV-D", "Both inverses were tried; the LuGre inverse did better.",
              "peak and RMS of y over all cases: lower in more than three quarters; not if in "
              "half or fewer", inverses),
    Statement(11, "IV-D", "First mode about 13 rad/s; W_y starts to roll off before it.",
              "within 5 %; corner below the mode", roll_off),
    Statement(12, "V, Fig. 13", "Anti-windup λ = 0, 200, 400 at Northridge 0.7 g: with λ > 0 the "
              "voltage is bounded and peaks are smaller.",
              "peak y and largest command lower for both λ > 0", anti_windup),
    Statement(13, "V", "LPV against clipped, peak y: 30 % lower for weak, up to 25 % for strong "
              "earthquakes.", f"within {POINTS:g} points on some record of each kind",
              lpv_against_clipped),
    Statement(14, "V", "H-infinity against clipped, peak y: 7 % (weak), 22 % (strong) lower.",
              f"within {POINTS:g} points on some record of each kind", hinf_against_clipped),
    Statement(15, "V", "LPV is better than H-infinity with inverse, most for small earthquakes.",
              "peak y lower in every case", lpv_against_hinf),
    Statement(16, "V", "Base drift: passive 4 V is best.",
              "peak drift at 4 V at or below every controller's, in every case", drift_passive),
    Statement(17, "V", "Base drift, LPV against H-infinity: peaks in the same range, RMS up to 7 % "
              "lower.", f"peaks within {100 * ALIKE:g} %; RMS lower throughout, at most by 7 % "
              f"(within {POINTS:g} points)", drift_controllers),
    Statement(18, "V", "Damper force, passive 4 V: peak below the controllers', RMS larger.",
              "both, against all three controllers, in every case", force),
    Statement(19, "V", "Voltage RMS: clipped slightly lower; H-infinity and LPV about equal.",
              f"clipped lowest in every case; the others within {100 * ALIKE:g} %", voltage),
    Statement(20, "V", "El Centro runs 35 s, Northridge 20 s; two intensities each.",
              "these windows and intensities were run", windows),
    Statement(21, "V, Fig. 14", "Without damper: the isolated structure with no added damping.",
              "1 % in the first mode, no damper force, peaks proportional to the motion",
              without_damper),
)  # fmt: skip
