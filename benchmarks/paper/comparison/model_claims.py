"""Sections II to IV-B: statements on the rig, the damper's models and the constant voltage."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from .identification import STIFFNESS, gain
from .numbers import (
    AS_GOOD,
    NOT,
    OPTIMA,
    POINTS,
    REPRODUCED,
    UNDECIDABLE,
    Numbers,
    Verdict,
    near,
    verdict_word,
)

# -- sections II and III: the rig and the damper


def rig(n: Numbers) -> Verdict:
    """Decide whether sample rate, force, stroke, stiffness and frequencies are the stated ones."""
    f = n.facts
    frequencies = f["frequencies"]
    holds = (
        near(f["sample_period"], 0.002, 1e-9)
        and near(f["force_at_8V"], 10.0, 0.05)
        and near(f["stroke"], 0.02, 1e-9)
        and near(f["k_b"], 1057.0, 1e-3)
        and all(near(a, b, 1e-3) for a, b in zip(frequencies, (2.1, 5.48, 9.0), strict=True))
    )
    listed = ", ".join(f"{value:.3g}" for value in frequencies)
    return Verdict(
        verdict_word(holds),
        f"{1.0 / f['sample_period']:.0f} Hz; {f['force_at_8V']:.2f} N at 8 V; stroke "
        f"{100 * f['stroke']:g} cm; {f['k_b']:.0f} N/m; {listed} Hz",
        "The model was built to these; damper parameters are reconstructed.",
    )


def flattening(n: Numbers) -> Verdict:
    """Decide whether the steady force falls again at high speed."""
    steady = n.facts["steady"]
    holds = all(c[-1] < 0.98 * max(c) and c[-1] <= c[-2] for c in steady.values())
    measured = "; ".join(f"{V:g} V: {max(c):.2f} to {c[-1]:.2f} N" for V, c in steady.items())
    return Verdict(
        verdict_word(holds),
        f"largest force to that at {n.facts['speeds'][-1]:g} m/s: {measured}",
        "Built into the law.",
    )


def jump(n: Numbers) -> Verdict:
    """Decide whether the force rises over that at high speed, the less the higher the voltage."""
    rises = {V: max(curve) / curve[-1] - 1.0 for V, curve in n.facts["steady"].items()}
    values = list(rises.values())
    holds = min(values) > 0.05 and all(a > b for a, b in pairwise(values))
    measured = ", ".join(f"{100 * rise:.0f} % at {V:g} V" for V, rise in rises.items())
    return Verdict(
        verdict_word(holds), f"rise over the force at high speed: {measured}", "Built into the law."
    )


def stiction(n: Numbers) -> Verdict:
    """Decide whether stiction shows in the peaks at the low voltage and not at the high one."""
    lugre: Any = n.peaks[n.peaks["law"] == "LuGre"].groupby("voltage [V]")
    over = {
        float(V): (float(part["height [m/s2]"].median()), float(part["crest [m/s2]"].iloc[0]))
        for V, part in lugre
    }
    low, high = over[min(over)], over[max(over)]
    holds = low[0] > low[1] and high[0] <= high[1]
    return Verdict(
        verdict_word(holds),
        f"peaks stand {low[0]:.2f} m/s² over their chord at {min(over):g} V and {high[0]:.2f} at "
        f"{max(over):g} V; the crest of a sine of that size: {low[1]:.2f} and {high[1]:.2f}",
        "LuGre law, base shaken by a sine; see Fig. 5.",
    )


def better_law(n: Numbers) -> Verdict:
    """Decide whether the LuGre law fits better than the Bingham law."""
    parts = {s: n.fits[n.fits["specimen"] == s].set_index("law")["share"] for s in STIFFNESS}
    ratios = {s: (float(p["LuGre"]), float(p["Bingham"])) for s, p in parts.items()}
    measured = "; ".join(
        f"{s}: LuGre {100 * a:.1f} %, Bingham {100 * b:.1f} % of the force" for s, (a, b) in
        ratios.items()
    )  # fmt: skip
    return Verdict(
        verdict_word(all(a < b for a, b in ratios.values())), measured,
        "The specimen here is itself a LuGre damper; the paper's data are lost. So this says that "
        "bristles show in such a test, not that a real damper has them.",
    )  # fmt: skip


def modified_law(n: Numbers) -> Verdict:
    """Decide whether the exponential lowers the error of both laws as far as stated."""
    gains = {s: (100 * gain(n.fits, s, "Bingham"), 100 * gain(n.fits, s, "LuGre"))
             for s in STIFFNESS}  # fmt: skip
    close = [abs(b - 5.0) <= POINTS and abs(u - 15.0) <= POINTS for b, u in gains.values()]
    measured = "; ".join(f"{s}: Bingham {b:.0f} %, LuGre {u:.0f} % lower" for s, (b, u) in
                     gains.items())  # fmt: skip
    verdict = REPRODUCED if all(close) else UNDECIDABLE if any(close) else NOT
    return Verdict(
        verdict, measured,
        "A known conflict: with these parameters the exponential matters far more to the LuGre "
        "law. Tables II and III, which would decide, are lost.",
    )  # fmt: skip


# -- section IV: the optimum voltage, the laws


def _curves(n: Numbers) -> dict[str, dict[float, float]]:
    peak = next(name for name in n.optimum if str(name).startswith("peak floor 2"))
    return {
        str(intensity): dict(zip(part["voltage [V]"], part[peak], strict=True))
        for intensity, part in n.optimum.groupby("intensity")
    }


def optimum(n: Numbers) -> Verdict:
    """Decide whether the stated voltages are as good as the best, intensity by intensity."""
    curves = _curves(n)
    excess = {g: curves[g][V] / min(curves[g].values()) - 1.0 for g, V in OPTIMA.items()}
    measured = ", ".join(
        f"{g}: least at {min(curve, key=lambda V, c=curve: c[V]):g} V"  # type: ignore[misc]
        for g, curve in curves.items()
    )
    return Verdict(
        verdict_word(max(excess.values()) <= AS_GOOD),
        f"{measured}; the text's voltages lie at most {100 * max(excess.values()):.1f} % above",
        "With the motion at 0.45 of its nominal peak, a reconstruction: at full size no set of "
        "damper parameters that was tried gives this.",
    )


def four_volts(n: Numbers) -> Verdict:
    """Decide whether 4 V is near the best at more intensities than any other voltage."""
    curves = _curves(n)
    good: dict[float, int] = {}
    for curve in curves.values():
        for V, peak in curve.items():
            good[V] = good.get(V, 0) + (peak <= (1.0 + AS_GOOD) * min(curve.values()))
    gains = all(curve[4.0] < curve[0.0] for curve in curves.values())
    worst = max(curve[4.0] / min(curve.values()) - 1.0 for curve in curves.values())
    most = max(count for V, count in good.items() if V != 4.0)
    return Verdict(
        verdict_word(gains and good[4.0] > most),
        f"4 V is within {100 * AS_GOOD:g} % of the best at {good[4.0]} of {len(curves)} "
        f"intensities, any other voltage at {most} or fewer; at worst {100 * worst:.0f} % above",
    )
